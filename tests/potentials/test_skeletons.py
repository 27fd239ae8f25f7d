"""Skeletons of several primitives: they fill what they say, join without gaps and keep their tolerance."""

import itertools
import math

import numpy as np
import pytest

from fieldsim.errors import InputError
from fieldsim.potentials.field import Field
from fieldsim.potentials.gravity import gravity, total_measure
from fieldsim.potentials.kernels import Newtonian
from fieldsim.potentials.meshes.mesh import mesh
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.skeletons import planets, shapes
from fieldsim.potentials.skeletons.biarc import _distances
from fieldsim.potentials.skeletons.solid import solid
from fieldsim.world.body import Body

CONCAVE = [[0, 0, 0], [3, 0, 0], [3, 3, 0], [2, 3, 0], [2, 1, 0], [1, 1, 0], [1, 3, 0], [0, 3, 0]]
SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def tilted(points):
    """Points in a plane that no axis knows."""
    u, v = np.linalg.qr([[1.0, 0.3], [0.2, 1.0], [-0.5, 0.4]])[0].T
    return np.asarray(points, dtype=float) @ np.array([u, v, np.cross(u, v)]) + [0.3, -2.0, 7.0]


def ends(primitive):
    """First and last point, and the unit tangents there."""
    if isinstance(primitive, Segment):
        start, end = np.array(primitive.start), np.array(primitive.end)
        along = (end - start) / np.linalg.norm(end - start)
        return start, end, along, along
    normal, start = np.array(primitive.normal), np.array(primitive.start)
    aside = np.cross(normal, start)
    cos, sin = math.cos(primitive.angle), math.sin(primitive.angle)
    first = primitive.center + primitive.radius * start
    last = primitive.center + primitive.radius * (cos * start + sin * aside)
    return first, last, aside, cos * aside - sin * start


def gaps(primitives):
    """The largest distance and the largest turn between successive primitives."""
    pairs = [(ends(p), ends(q)) for p, q in itertools.pairwise(primitives)]
    return max(np.linalg.norm(p[1] - q[0]) for p, q in pairs), max(np.linalg.norm(p[3] - q[2]) for p, q in pairs)


def distance(primitives, points):
    return np.min([_distances(p, points) for p in primitives], axis=0)


def test_polyline():
    open_line = shapes.polyline(SQUARE)
    assert [p.start for p in open_line] == [tuple(map(float, p)) for p in SQUARE[:3]]
    assert shapes.polyline(SQUARE, closed=True)[-1] == Segment(SQUARE[3], SQUARE[0])


@pytest.mark.parametrize("turn", range(8))
def test_concave_polygon(turn):
    """Whichever corner comes first: the area, the side of the normal, and what is covered once."""
    corners = tilted(np.roll(CONCAVE, turn, axis=0))
    triangles = shapes.polygon(corners)
    assert len(triangles) == 6
    assert total_measure(triangles) == pytest.approx(7.0, rel=1e-13)
    normal = tilted([[0, 0, 1]]) - tilted([[0, 0, 0]])
    for t in triangles:
        a, b, c = np.array([t.a, t.b, t.c])
        assert np.cross(b - a, c - a) @ normal[0] > 0
    # One point of the notch and one beside it are not covered; of the arms and the base, once. All lie off the
    # diagonals: there a point lies in two triangles, or in none, as rounding will.
    for place, covered in (
        ([1.5, 2.03, 0], 0),
        ([0.52, 2.01, 0], 1),
        ([2.53, 2.19, 0], 1),
        ([1.37, 0.31, 0], 1),
        ([3.5, 1.03, 0], 0),
    ):
        point = tilted([place])[0]
        shares = [_shares(t, point) for t in triangles]
        assert np.min(np.abs(shares)) > 1e-3, "a tie"
        assert sum((s > 0).all() for s in shares) == covered


def _shares(triangle, point):
    """Barycentric coordinates of a point in the triangle's plane."""
    a, b, c = np.array([triangle.a, triangle.b, triangle.c])
    s, t = np.linalg.lstsq(np.transpose([b - a, c - a]), point - a, rcond=None)[0]
    return np.array([s, t, 1 - s - t])


def test_random_stars_are_filled():
    rng = np.random.default_rng(0)
    for count in (3, 4, 7, 30):
        angles = (np.arange(count) + rng.uniform(0.1, 0.9, count)) * 2 * np.pi / count
        radii = rng.uniform(0.3, 1.0, count)
        corners = np.stack([radii * np.cos(angles), radii * np.sin(angles), 0 * angles], axis=1)
        area = 0.5 * np.sum(np.cross(corners, np.roll(corners, -1, axis=0))[:, 2])
        triangles = shapes.polygon(tilted(corners))
        assert len(triangles) == count - 2
        assert total_measure(triangles) == pytest.approx(area, rel=1e-12)


def test_polygon_with_corners_on_a_straight_side():
    triangles = shapes.polygon([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [3, 1, 0], [0, 1, 0]])
    assert total_measure(triangles) == pytest.approx(3.0, rel=1e-14)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (SQUARE[:2], "polygon: 2 points; give at least 3"),
        ([*SQUARE, SQUARE[3]], r"points\[3\] and points\[4\] are both \(0, 1, 0\)"),
        ([*SQUARE, SQUARE[0]], r"points\[4\] and points\[0\] .*does not repeat its first point"),
        ([[0, 0, 0], [1, 0, 0], [1, 1, 0.1], [0, 1, 0]], r"points\[\d\].* off the plane"),
        ([[0, 0, 0], [2, 2, 0], [2, 0, 0], [0, 1, 0]], r"the sides from points\[0\] and from points\[2\] cross"),
        ([[0, 0, 0], [4, 0, 0], [4, 4, 0], [2, 0, 0], [0, 4, 0]], r"cross or touch"),
        ([[0, 0, 0], [2, 0, 0], [1, 0, 0], [1, 1, 0]], r"the sides from points\[0\] and from points\[1\] cross"),
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], "no area"),
        ([[0, 0, 0], [1, 0, 0], [2, 0, np.inf]], r"points\[2\]"),
    ],
)
def test_bad_polygons(points, message):
    with pytest.raises(InputError, match=message):
        shapes.polygon(points)


def test_rectangle():
    a, b = shapes.rectangle((1, 2, 3), (2, 0, 0), (0, 0, 4))
    assert a.measure == b.measure == 4.0
    assert np.ptp([*np.array([a.a, a.b, a.c]), *np.array([b.a, b.b, b.c])], axis=0).tolist() == [2, 0, 4]
    assert np.cross(np.subtract(a.b, a.a), np.subtract(a.c, a.a)).tolist() == [0, -8, 0]
    with pytest.raises(InputError, match="not perpendicular"):
        shapes.rectangle((0, 0, 0), (1, 0, 0), (1, 1, 0))
    with pytest.raises(InputError, match=r"v is \(0, 0, 0\)"):
        shapes.rectangle((0, 0, 0), (1, 0, 0), (0, 0, 0))


@pytest.mark.parametrize("tolerance", [1.0, 0.3, 1e-2, 1e-4])
def test_disc(tolerance):
    center, normal = np.array([1.0, -2.0, 0.5]), np.array([0.0, 0.6, 0.8])
    triangles = shapes.disc(center, normal, 2.0, tolerance)
    assert total_measure(triangles) == pytest.approx(4 * np.pi, rel=1e-12)
    rim = np.array([[t.b, t.c] for t in triangles])
    for points in (rim[:, 0], rim.mean(axis=1)):
        assert np.abs((points - center) @ normal).max() < 1e-14
        assert np.abs(np.linalg.norm(points - center, axis=1) - 2.0).max() <= tolerance
    assert np.abs(np.linalg.norm(rim[:, 0] - center, axis=1) - 2.0).max() <= tolerance
    # Not finer than needed.
    assert len(triangles) <= 2 + math.ceil(math.pi * math.sqrt(2.0 / (3 * tolerance)))


def test_box_is_closed_and_faces_outward():
    faces = shapes.box((1, 2, 3), (2, 3, 4))
    made = mesh(faces)
    assert (len(faces), len(made.vertices)) == (12, 8)
    assert made.volume == pytest.approx(24.0, rel=1e-14)
    assert solid(made, 0.5).value((101.0, 2.0, 3.0)) == pytest.approx(0.12, rel=1e-3)
    with pytest.raises(InputError, match=r"box: size\[1\] is 0; give a number above 0"):
        shapes.box((0, 0, 0), (1, 0, 1))


def bezier_points(points, count=3001):
    t = np.linspace(0.0, 1.0, count)[:, None]
    s = 1 - t
    p = np.asarray(points, dtype=float)
    return s**3 * p[0] + 3 * s * s * t * p[1] + 3 * s * t * t * p[2] + t**3 * p[3]


CUBICS = {
    "in space": [[0, 0, 0], [1, 2, 0], [2, -1, 1], [3, 0, 0.5]],
    "loop": [[0, 0, 0], [3, 3, 0], [-2, 3, 0], [1, 0, 0]],
    "cusp": [[0, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, 0]],
    "closed": [[0, 0, 0], [2, 1, 0], [0, 2, 1], [0, 0, 0]],
    "end without tangent": [[0, 0, 0], [0, 0, 0], [1, 2, 0], [3, 0, 0]],
}


@pytest.mark.parametrize("tolerance", [1e-1, 1e-3, 1e-5])
@pytest.mark.parametrize("name", CUBICS)
def test_bezier_keeps_its_tolerance(name, tolerance):
    result = shapes.bezier(CUBICS[name], tolerance)
    assert distance(result, bezier_points(CUBICS[name])).max() <= tolerance
    joints, turns = gaps(result) if len(result) > 1 else (0.0, 0.0)
    assert joints < 1e-9
    if name in ("in space", "loop"):
        assert turns < 1e-6
    np.testing.assert_allclose(ends(result[0])[0], CUBICS[name][0], atol=1e-9)
    np.testing.assert_allclose(ends(result[-1])[1], CUBICS[name][3], atol=1e-9)


def test_arcs_are_fewer_than_segments():
    """The error of a biarc falls with the third power of its length: ten times finer takes 10^(1/3) times more."""
    counts = [len(shapes.bezier(CUBICS["in space"], t)) for t in (1e-3, 1e-6)]
    assert counts[1] / counts[0] < 16
    tolerance = 1e-4
    points = bezier_points(CUBICS["in space"])
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert total_measure(shapes.bezier(CUBICS["in space"], tolerance)) == pytest.approx(length, rel=1e-4)


def test_straight_curves_are_segments():
    assert shapes.bezier([[0, 0, 0], [1, 1, 0], [2, 2, 0], [3, 3, 0]], 1e-6) == (Segment((0, 0, 0), (3, 3, 0)),)
    straight = shapes.catmull_rom([[0, 0, 0], [1, 0, 0], [3, 0, 0]], tolerance=1e-6)
    assert straight == (Segment((0, 0, 0), (1, 0, 0)), Segment((1, 0, 0), (3, 0, 0)))


def test_a_circle_is_found():
    def circle(t):
        return np.stack([2 * np.cos(t), 2 * np.sin(t), 0 * t], axis=1)

    def slope(t):
        return np.stack([-np.sin(t), np.cos(t), 0 * t], axis=1)

    (arc,) = shapes.curve(circle, slope, 0.0, 3.0, tolerance=1e-6)
    assert isinstance(arc, Arc)
    assert (arc.radius, arc.angle) == (pytest.approx(2.0), pytest.approx(3.0))
    ring = shapes.curve(circle, slope, 0.0, 2 * np.pi, tolerance=1e-6)
    points = np.array([[3.0, 0.4, 0.2], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(
        Field(ring, Newtonian()).gradient(points),
        Field(Circle((0, 0, 0), (0, 0, 1), 2.0), Newtonian()).gradient(points),
        atol=1e-11,
    )


@pytest.mark.parametrize("closed", [False, True])
def test_catmull_rom(closed):
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.3], [0.9, 1.1, 0.3], [0, 1, 0]])
    result = shapes.catmull_rom(points, closed=closed, tolerance=1e-4)
    assert distance(result, points).max() < 1e-10
    joints, turns = gaps([*result, result[0]] if closed else result)
    assert joints < 1e-10
    assert turns < 1e-6
    finer = shapes.catmull_rom(points, closed=closed, tolerance=1e-7)
    assert distance(result, np.array([ends(p)[0] for p in finer])).max() < 1.01e-4


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: shapes.polyline([[0, 0, 0]]), "polyline: 1 points; give at least 2"),
        (lambda: shapes.polyline([[0, 0, 0], [1, 0, 0], [1, 0, 0]]), r"polyline: points\[1\] and points\[2\]"),
        (lambda: shapes.polyline([[0, 0], [1, 0]]), r"polyline: points has shape \(2, 2\)"),
        (lambda: shapes.bezier(np.zeros((5, 3)), 0.1), "bezier: 5 control points; give 4, 7, 10"),
        (lambda: shapes.bezier(np.zeros((4, 3)), 0.1), r"bezier: points\[0\] to points\[3\] are all \(0, 0, 0\)"),
        (lambda: shapes.bezier(CUBICS["loop"], 0), "bezier: tolerance is 0; give a number above 0"),
        (lambda: shapes.catmull_rom([[0, 0, 0], [1, 0, 0]], closed=True, tolerance=1), "catmull_rom: 2 points"),
        (lambda: shapes.disc((0, 0, 0), (0, 0, 0), 1), "disc: normal"),
        (lambda: shapes.disc((0, 0, 0), (0, 0, 1), 1, -1), "disc: tolerance is -1"),
        (lambda: shapes.curve(np.sin, np.cos, 0, 1, tolerance=1), r"curve: position\(\.\.\.\) has shape \(9,\)"),
        (lambda: shapes.curve(np.sin, np.cos, 1, 0, tolerance=1), "curve: start is 1 and end 0"),
        (lambda: planets.cigar(0), "cigar: length is 0"),
        (lambda: planets.star(1), "star: points is 1; give a whole number of at least 2"),
        (lambda: planets.star(5, 1.0, 2.0), "star: inner is 2 and radius 1"),
        (lambda: planets.spiral(inner=3), "spiral: inner is 3 and radius 1"),
        (lambda: planets.asterisk(2.5), "asterisk: arms is"),
        (lambda: planets.helix(height=np.nan), "helix: height is nan"),
    ],
)
def test_bad_input(call, message):
    with pytest.raises(InputError, match=message):
        call()


def test_a_curve_with_a_hole_is_refused():
    def hole(t):
        return np.stack([t, np.where(abs(t - 0.3) < 0.04, np.nan, 1.0), 0 * t], axis=1)

    with pytest.raises(InputError, match="not smooth, or not finite, near the parameter"):
        shapes.curve(hole, lambda t: np.stack([1 + 0 * t, 0 * t, 0 * t], axis=1), 0.0, 1.0, tolerance=1e-3)


PLANETS = ["cigar", "cross", "asterisk", "jack", "donut", "star", "spiral", "helix", "knot", "pancake", "brick"]


def test_every_planet_is_tested():
    made = [n for n, f in vars(planets).items() if getattr(f, "__module__", "") == planets.__name__ and n[0] != "_"]
    assert sorted(made) == sorted(PLANETS)


@pytest.mark.parametrize("name", PLANETS)
def test_planets_are_bodies(name):
    planet = getattr(planets, name)
    body = Body(planet(), gravity=Newtonian(), mass=2.0)
    assert total_measure(body.skeleton) > 0
    moved = planet(center=(5.0, 0.0, 0.0))
    assert total_measure(moved) == pytest.approx(total_measure(body.skeleton), rel=1e-9)
    if name in ("cigar", "cross", "asterisk", "jack", "donut", "star", "spiral", "helix", "knot"):
        pull = gravity(moved, 2.0).gradient((5.0, 300.0, 0.0))
        np.testing.assert_allclose(pull, [0, -2 / 300**2, 0], atol=3e-2 * 2 / 300**2)


def test_planets_have_their_measures():
    assert total_measure(planets.cross(3.0)) == pytest.approx(6.0)
    assert total_measure(planets.asterisk(5, 2.0)) == pytest.approx(10.0)
    assert total_measure(planets.helix(2, 1.0, 3.0)) == pytest.approx(math.hypot(4 * np.pi, 3.0), rel=1e-4)
    assert total_measure(planets.brick((1, 2, 3))) == pytest.approx(22.0)
    for planet in (planets.star, planets.spiral, planets.knot, planets.donut, planets.pancake):
        flat = planet(normal=(1.0, 2.0, -2.0), center=(0.0, 1.0, 0.0))
        assert total_measure(flat) == pytest.approx(total_measure(planet()), rel=1e-9)


def test_spiral_and_knot_keep_their_tolerance():
    t = np.linspace(0, 6 * np.pi, 5000)
    r = 0.1 + 0.9 * t / t[-1]
    spiral = planets.spiral(tolerance=1e-4)
    assert distance(spiral, np.stack([r * np.cos(t), r * np.sin(t), 0 * t], axis=1)).max() < 1e-4
    assert gaps(spiral)[0] < 1e-12
    closed = planets.knot()
    joints, turns = gaps([*closed, closed[0]])
    assert joints < 1e-12
    assert turns < 1e-9
