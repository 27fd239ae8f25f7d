"""Solid polyhedra: against many digits, quadrature of the definition, balls, boxes of bodies and a peer."""

import functools

import numba
import numpy as np
import pytest
import warp as wp
from solid_oracle import jet

from fieldsim import launch
from fieldsim.errors import InputError
from fieldsim.potentials.elements import place
from fieldsim.potentials.field import Field
from fieldsim.potentials.formulas.solid import face_jet
from fieldsim.potentials.gravity import gravity
from fieldsim.potentials.kernels import Newtonian
from fieldsim.potentials.meshes.mesh import TriangleMesh
from fieldsim.potentials.primitives.face import Face
from fieldsim.potentials.skeletons.solid import solid, solid_faces
from fieldsim.world.body import Body

CUBE_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) - 0.5
CUBE_FACES = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
CUBE_FACES += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
CUBE = TriangleMesh(CUBE_CORNERS, CUBE_FACES)
# Coordinates that float32 holds, so that both precisions answer the same question.
TETRAHEDRON = TriangleMesh(
    np.float32([[0.1, 0.2, -0.3], [1.1, 0.1, -0.2], [0.3, 1.3, 0.1], [0.2, 0.4, 0.9]]).astype(float),
    [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
)
SLAB = TriangleMesh(CUBE_CORNERS * [1.0, 0.5, 0.125] + [2.0, 0.25, -1.0], CUBE_FACES)
SOLIDS = {"cube": CUBE, "tetrahedron": TETRAHEDRON, "slab": SLAB}


def icosphere(levels):
    """A ball's surface of 20 * 4^levels faces, its corners on the unit sphere."""
    golden = (1 + 5**0.5) / 2
    corners = [[0, s, t * golden] for s in (-1, 1) for t in (-1, 1)]
    corners = np.array([np.roll(c, k) for k in range(3) for c in corners]) / np.hypot(1, golden)
    near = np.linalg.norm(corners[:, None] - corners, axis=2) < 1.2
    faces = [
        (i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] and near[j, k] and near[i, k]
    ]
    triangles = corners[np.array(faces)]
    for _ in range(levels):
        a, b, c = np.moveaxis(triangles, 1, 0)
        middles = [m / np.linalg.norm(m, axis=1, keepdims=True) for m in (a + b, b + c, c + a)]
        ab, bc, ca = middles
        triangles = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
    inward = np.einsum("ij,ij->i", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    corners, index = np.unique(triangles.reshape(-1, 3).round(14), axis=0, return_inverse=True)
    return TriangleMesh(corners, index.reshape(-1, 3))


def evaluate(target, mesh, points):
    """The jet (N, 10) of the solid's integral of 1/r; outputs start as NaN."""
    elements = Field(solid_faces(mesh), Newtonian()).elements
    points = np.ascontiguousarray(points, dtype=float)
    out = np.full((len(points), 10), np.nan)
    if target == "numba":
        _numba()(points, elements.rows, out)
        return out
    scalar = wp.float64 if target == "warp64" else wp.float32
    arrays = [wp.array(a, dtype=scalar, device="cpu") for a in (points, elements.rows, out)]
    launch.launch(_warp(scalar), len(points), arrays[:2], arrays[2:], device="cpu")
    return arrays[2].numpy().astype(float)


@functools.cache
def _numba():
    element = face_jet.numba

    @numba.njit(error_model="numpy")
    def each(points, rows, out):
        for i in range(len(points)):
            out[i] = 0.0
            for j in range(len(rows)):
                terms = element(points[i, 0], points[i, 1], points[i, 2], rows, j)
                for k, term in enumerate(terms):
                    out[i, k] += term

    return each


@functools.cache
def _warp(scalar):
    element = face_jet.warp(scalar)

    @wp.kernel(module="unique", enable_backward=False)
    def each(
        start: int,
        points: wp.array(dtype=scalar, ndim=2),
        rows: wp.array(dtype=scalar, ndim=2),
        out: wp.array(dtype=scalar, ndim=2),
    ):
        i = start + wp.tid()
        for k in range(10):
            out[i, k] = scalar(0.0)
        for j in range(rows.shape[0]):
            f, fx, fy, fz, fxx, fyy, fzz, fxy, fxz, fyz = element(points[i, 0], points[i, 1], points[i, 2], rows, j)
            out[i, 0] = out[i, 0] + f
            out[i, 1] = out[i, 1] + fx
            out[i, 2] = out[i, 2] + fy
            out[i, 3] = out[i, 3] + fz
            out[i, 4] = out[i, 4] + fxx
            out[i, 5] = out[i, 5] + fyy
            out[i, 6] = out[i, 6] + fzz
            out[i, 7] = out[i, 7] + fxy
            out[i, 8] = out[i, 8] + fxz
            out[i, 9] = out[i, 9] + fyz

    return each


def errors(jets, exact):
    """Largest relative errors (value, gradient, Hessian), by norms."""
    parts = [slice(0, 1), slice(1, 4), slice(4, 10)]
    return [np.max(np.linalg.norm((jets - exact)[:, p], axis=1) / np.linalg.norm(exact[:, p], axis=1)) for p in parts]


@functools.cache
def hard_points(name):
    """Points at 1e-12 to 1e6 sizes from corners, edges, faces, lines of edges and planes of faces, and their jets."""
    mesh = SOLIDS[name]
    rng = np.random.default_rng(len(name))
    points = []
    for distance in 10.0 ** np.array([-12, -9, -6, -3, -1.5, 0, 0.5, 1, 1.2, 2, 4, 6]):
        a, b, c = mesh.corners[rng.integers(len(mesh.faces))]
        places = [a, a + rng.uniform() * (b - a), rng.dirichlet([1, 1, 1]) @ np.array([a, b, c])]
        places += [a - rng.uniform(1, 3) * (b - a), a + 1.7 * (b - a) - 0.6 * (c - a), a + 1e-5 * (b - a)]
        for near in places:
            way = rng.normal(size=3)
            points.append(near + distance * way / np.linalg.norm(way))
    points = np.array(points)
    return points, np.array([jet(mesh.corners, p) for p in points])


@pytest.mark.parametrize("target", ["warp64", "numba"])
@pytest.mark.parametrize("name", SOLIDS)
def test_everywhere(name, target):
    points, exact = hard_points(name)
    # The closed forms lose (distance / size)^2 up to 15 sizes; a slab loses its length over its thickness as well.
    accepted = 1e-11 if name == "slab" else 1e-12
    assert max(errors(evaluate(target, SOLIDS[name], points), exact)) < accepted


@pytest.mark.parametrize("name", ["cube", "tetrahedron"])
def test_single_precision(name):
    points = np.float32(hard_points(name)[0]).astype(float)
    points = points[_away(SOLIDS[name], points) > 1e-3]
    exact = np.array([jet(SOLIDS[name].corners, p) for p in points])
    assert max(errors(evaluate("warp32", SOLIDS[name], points), exact)) < 2e-5


def _away(mesh, points):
    """A lower bound of the distance from the planes of the faces."""
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return np.abs(np.einsum("fj,ifj->if", normals, points[:, None] - a)).min(axis=1)


def test_is_the_integral_over_the_solid():
    """Gauss quadrature of the definition over the tetrahedron, from a distance; the oracle is held to it as well."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    u, w = (nodes + 1) / 2, weights / 2
    # Duffy's map of the cube onto the tetrahedron.
    r, s, t = np.meshgrid(u, u, u, indexing="ij")
    bary = np.stack([r, (1 - r) * s, (1 - r) * (1 - s) * t], axis=-1)
    jacobian = (1 - r) ** 2 * (1 - s) * w[:, None, None] * w[None, :, None] * w[None, None, :]
    a, b, c, d = TETRAHEDRON.vertices
    volume = abs(np.linalg.det([b - a, c - a, d - a]))
    sources = a + bary[..., :1] * (b - a) + bary[..., 1:2] * (c - a) + bary[..., 2:] * (d - a)
    for point in np.array([[2.0, 0.5, 1.0], [-1.0, -0.5, 0.3]]):
        offset = sources - point
        distance = np.linalg.norm(offset, axis=-1)
        value = volume * np.sum(jacobian / distance)
        pull = volume * np.sum((jacobian / distance**3)[..., None] * offset, axis=(0, 1, 2))
        field = solid(TETRAHEDRON, 2.0, G=3.0)
        assert field.value(point) == pytest.approx(6.0 * value, rel=1e-13)
        np.testing.assert_allclose(field.gradient(point), 6.0 * pull, rtol=1e-12)
        np.testing.assert_allclose(jet(TETRAHEDRON.corners, point)[:4], [value, *pull], rtol=1e-12)


@pytest.mark.parametrize("target", ["warp64", "numba"])
def test_poisson(target):
    inside = np.random.default_rng(1).uniform(-0.49, 0.49, (50, 3))
    for points, trace in ((inside, -4 * np.pi), (inside + np.array([0.0, 1.1, 0.0]), 0.0)):
        np.testing.assert_allclose(evaluate(target, CUBE, points)[:, 4:7].sum(axis=1), trace, atol=1e-12)


def test_finite_on_corners_edges_and_faces():
    """Value and gradient there are the limits; the Hessian on a face is the mean of both sides."""
    a, b, c = CUBE.corners[0]
    points = np.array([a, b, (a + b) / 2, a + 0.3 * (c - a), 0.2 * a + 0.3 * b + 0.5 * c, a + 2 * (b - a)])
    away = np.array([0.61, 0.33, 0.71]) * 1e-9
    for target in ("warp64", "warp32", "numba"):
        on = evaluate(target, CUBE, points)
        assert np.isfinite(on).all()
        tolerance = 1e-4 if target == "warp32" else 1e-7
        np.testing.assert_allclose(on[:, :4], evaluate("numba", CUBE, points + away)[:, :4], atol=tolerance)
    middle = points[4]
    normal = np.cross(b - a, c - a)
    sides = evaluate("numba", CUBE, [middle + 1e-9 * normal, middle - 1e-9 * normal])
    np.testing.assert_allclose(evaluate("numba", CUBE, [middle])[0, 4:], sides[:, 4:].mean(axis=0), atol=1e-7)


def test_ball_is_a_point_mass_outside_and_a_spring_inside():
    errors = []
    inside = np.array([[0.2, 0.3, -0.4]])
    for levels in (1, 2, 3):
        ball = icosphere(levels)
        r = 3.0
        mass = 4 / 3 * np.pi
        # Of the ball's own mass: the icosahedron's symmetry leaves nothing else of its shape outside.
        even = gravity(solid_faces(ball), mass)
        assert even.value((0.0, 0.0, r)) == pytest.approx(mass / r, rel=1e-6)
        np.testing.assert_allclose(even.gradient((0.0, 0.0, r)), [0, 0, -mass / r**2], atol=1e-5)
        field = solid(ball, 1.0)
        errors.append([mass / r - field.value((0.0, 0.0, r)), *np.ravel(field.gradient(inside) + mass * inside)])
    # A polyhedron lacks of the ball what its edges' squares measure; inside, the shell's lack pulls nowhere.
    slopes = np.log2(np.array(errors)[:-1, 0] / np.array(errors)[1:, 0])
    np.testing.assert_allclose(slopes, 2.0, atol=0.1)
    assert np.abs(errors[-1][1:]).max() < 1e-3


def test_gradient_is_that_of_the_value():
    step = 1e-5
    for mesh, point in ((CUBE, [0.3, 0.9, -0.2]), (CUBE, [0.1, 0.2, 0.3]), (SLAB, [9.0, 3.0, -12.0])):
        around = np.concatenate([point + step * np.eye(3), point - step * np.eye(3)])
        jets = evaluate("numba", mesh, around)
        slopes = (jets[:3] - jets[3:]) / (2 * step)
        here = evaluate("numba", mesh, [point])[0]
        np.testing.assert_allclose(slopes[:, 0], here[1:4], rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(np.diag(slopes[:, 1:4]), here[4:7], rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(slopes[[0, 0, 1], [2, 3, 3]], here[7:], rtol=1e-7, atol=1e-9)


def test_bodies_are_solids_too():
    """Mass spread over the measure is mass over the volume, wherever the body stands."""
    assert sum(face.measure for face in solid_faces(SLAB)) == pytest.approx(SLAB.volume, rel=1e-14) == 1 / 16
    body = Body(solid_faces(SLAB), gravity=Newtonian(), mass=3.0)
    points = np.array([[2.0, 0.5, 1.0], [100.0, 0.0, 0.0]])
    np.testing.assert_allclose(body.gravity_field().gradient(points), solid(SLAB, 48.0).gradient(points), rtol=1e-13)
    elements = body.gravity_elements(0.0)
    rotation = np.array([[0.0, -1.0, 0.0], [0.6, 0.0, -0.8], [0.8, 0.0, 0.6]])
    shift = np.array([0.3, -5.0, 2.0])
    rows = place(elements.rows, rotation, shift)
    moved = np.full((2, 10), np.nan)
    _numba()(points @ rotation.T + shift, rows, moved)
    np.testing.assert_allclose(moved[:, 0], solid(SLAB, 48.0).value(points), rtol=1e-12)


def test_agrees_with_polyhedral_gravity():
    peer = pytest.importorskip("polyhedral_gravity")
    ball = icosphere(2)
    check = peer.PolyhedronIntegrity.DISABLE
    polyhedron = peer.Polyhedron((ball.vertices, ball.faces), density=1.0, integrity_check=check)
    # In and around the ball: farther away the peer's own sums cancel (2e-11 at five radii).
    points = np.random.default_rng(3).uniform(-1.1, 1.1, size=(40, 3))
    theirs = peer.evaluate(polyhedron, points, parallel=False)
    theirs = np.array([[value, *gradient, *tensor] for value, gradient, tensor in theirs]) / 6.67430e-11
    assert max(errors(evaluate("warp64", ball, points), theirs)) < 1e-12


def test_compiles_for_cuda(compiles_for_cuda):
    for scalar in (wp.float32, wp.float64):
        compiles_for_cuda(_warp(scalar).module)


def test_open_and_inside_out_meshes_are_refused():
    with pytest.raises(InputError, match=r"edge from vertex 3 to vertex 2 of faces\[1\] belongs to no other face"):
        solid(TriangleMesh(CUBE_CORNERS, [f for f in CUBE_FACES if f != [2, 3, 7]]), 1.0)
    turned = [CUBE_FACES[0][::-1], *CUBE_FACES[1:]]
    with pytest.raises(InputError, match=r"faces\[0\] is run along in the same direction by another face"):
        solid(TriangleMesh(CUBE_CORNERS, turned), 1.0)
    with pytest.raises(InputError, match=r"volume of -1, it is inside out.*flipped"):
        solid(CUBE.flipped(), 1.0)
    assert solid(CUBE.flipped().flipped(), 1.0).value((0, 0, 9)) > 0


def test_closed_by_position():
    """Every face with vertices of its own, as STL files have them."""
    scattered = TriangleMesh(CUBE.corners.reshape(-1, 3), np.arange(36).reshape(-1, 3))
    assert solid(scattered, 1.0).value((1, 2, 3)) == solid(CUBE, 1.0).value((1, 2, 3))


def test_bad_input():
    for density in (np.nan, "heavy"):
        with pytest.raises(InputError, match="solid: density"):
            solid(CUBE, density)
    with pytest.raises(InputError, match="solid: mesh is 3"):
        solid(3, 1.0)
    with pytest.raises(InputError, match=r"Face: the kernel has softening 0\.1"):
        Field(solid_faces(CUBE), Newtonian(0.1)).value((0, 0, 0))
    with pytest.raises(InputError, match=r"Face: a, b and c are .* without area"):
        Face((0, 0, 0), (1, 0, 0), (2, 0, 0))
    with pytest.raises(InputError, match="Face: reach is -1"):
        Face((0, 0, 0), (1, 0, 0), (0, 1, 0), reach=-1)
