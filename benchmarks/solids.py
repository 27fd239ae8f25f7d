"""What a solid's field costs: value, gradient and Hessian of 1280 faces at points, one core, compiled beforehand.

polyhedral-gravity (Tsoulis' formulas in C++), where installed, is timed in turns; `ratio` is our time over its.
"""

import time

import numpy as np

import fieldsim as fs
from benchmarks.fields import evaluation
from fieldsim.potentials.meshes.mesh import TriangleMesh

# A ball of 20 * 4^3 faces.
LEVELS = 3
POINTS = 400
PLACES = {"around it": (1.1, 3.0), "far away": (20.0, 60.0)}


def rows(turns: int = 5):
    """Microseconds a point, by where the points are."""
    ball = icosphere(LEVELS)
    elements = fs.solid(ball, 1.0).elements
    theirs = _peer(ball)
    for where, radii in PLACES.items():
        points = _shell(*radii)
        runs = [evaluation(elements, points, 2), *([lambda points=points: theirs(points)] if theirs else [])]
        least = [np.inf] * len(runs)
        for run in runs:
            run()
        for _ in range(turns):
            for place, run in enumerate(runs):
                start = time.process_time()
                run()
                least[place] = min(least[place], time.process_time() - start)
        ours, *peer = (1e6 * seconds / POINTS for seconds in least)
        row = {
            "name": f"solid of {len(ball.faces)} faces, V, g and tensor, points {where}",
            "value": ours,
            "unit": "us",
        }
        yield row | ({"peer": "polyhedral-gravity", "peer_value": peer[0]} if peer else {})


def icosphere(levels: int) -> TriangleMesh:
    """A ball of radius 1: an icosahedron whose faces are cut into four, so many times."""
    golden = (1.0 + 5.0**0.5) / 2.0
    corners = [(a, b * golden, 0.0) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    corners = np.array([np.roll(corner, turn) for turn in range(3) for corner in corners])
    gaps = np.linalg.norm(corners[:, None] - corners, axis=-1)
    near = np.isclose(gaps, 2.0)
    faces = [
        (i, j, k) if np.linalg.det(corners[[i, j, k]]) > 0.0 else (i, k, j)
        for i in range(12)
        for j in range(i)
        for k in range(j)
        if near[i, j] and near[j, k] and near[k, i]
    ]
    vertices = [tuple(corner) for corner in (corners / np.linalg.norm(corners[0])).tolist()]
    for _ in range(levels):
        vertices, faces = _cut(vertices, faces)
    return TriangleMesh(np.array(vertices), np.array(faces))


def _cut(vertices, faces):
    vertices, middles = list(vertices), {}

    def middle(i, j):
        key = min(i, j), max(i, j)
        if key not in middles:
            middles[key] = len(vertices)
            between = np.add(vertices[i], vertices[j])
            vertices.append(tuple((between / np.linalg.norm(between)).tolist()))
        return middles[key]

    found = []
    for a, b, c in faces:
        ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
        found += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return vertices, found


def _shell(low, high):
    """Points (POINTS, 3) at those distances from the middle."""
    rng = np.random.default_rng(4)
    points = rng.normal(size=(POINTS, 3))
    return points * (rng.uniform(low, high, POINTS) / np.linalg.norm(points, axis=1))[:, None]


def _peer(ball):
    """A function of points that evaluates the peer's field of the ball, or None where it is not installed."""
    try:
        import polyhedral_gravity as peer
    except ImportError:
        return None
    check = peer.PolyhedronIntegrity.DISABLE
    evaluable = peer.GravityEvaluable(peer.Polyhedron((ball.vertices, ball.faces), density=1.0, integrity_check=check))
    return lambda points: evaluable(points, parallel=False)
