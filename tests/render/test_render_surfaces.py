"""Surfaces of every kernel and every primitive: depths against a slow root search on the true field in float64."""

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.potentials import registry
from fieldsim.potentials.registry import FORMULAS
from fieldsim.sources.elements import surface_of

RADIUS = 0.22
CAMERA = fs.Camera((2.6, -1.9, 1.4), fov=36)
SIZE = (40, 40)
KERNELS = [fs.Gaussian, fs.Cauchy, fs.Newtonian, fs.InverseSquare, fs.Metaball, fs.SoftObject, fs.Quartic]
ENDS = [(-0.6, -0.3, 0), (0.5, 0.4, 0.2)]
RING = ((0, 0, 0), (0.3, 0.2, 1))
PRIMITIVES = {
    "point": fs.Point((0, 0, 0)),
    "segment": fs.Segment(*ENDS),
    "arc": fs.Arc(*RING, (1, 0, -0.3), 0.7, 4.2),
    "circle": fs.Circle(*RING, 0.7),
    "triangle": fs.Triangle((-0.7, -0.5, 0), (0.7, -0.4, 0.1), (0, 0.7, -0.2)),
    "plane": fs.Plane((0, 0, -0.3), (0.1, 0.2, 1)),
    "profiled segment": fs.profiled(fs.Segment(*ENDS), fs.profile.hat(0.6, 1.6)),
    "profiled arc": fs.profiled(fs.Arc(*RING, (1, 0, -0.3), 0.7, 4.2), fs.profile.sine(0.6, 1.6)),
    "tapered segment": fs.TaperedSegment(*ENDS, 1.0, 0.2),
}


def world_of(*bodies):
    world = fs.World()
    for skeleton, material in bodies:
        world.add_body(fs.Body(skeleton, surface=material))
    return world


def material(kernel, radius=RADIUS, blobbiness=-3.0, **options):
    return fs.Material(kernel=kernel, radius=radius, blobbiness=blobbiness, **options)


def rays(camera, size):
    """Unit directions (W H, 3) through the pixels' centres, row by row."""
    width, height = size
    right, up, forward = camera.axes()
    half = np.tan(np.radians(camera.fov) / 2)
    x = (np.arange(width) + 0.5 - width / 2) / (height / 2) * half
    y = -(np.arange(height) + 0.5 - height / 2) / (height / 2) * half
    d = (forward + x[None, :, None] * right + y[:, None, None] * up).reshape(-1, 3)
    return d / np.linalg.norm(d, axis=1)[:, None]


class Truth:
    """The field of a world's surface along rays, as plain Python in float64: no kernels to compile, and few rays."""

    def __init__(self, world, camera, size):
        elements = surface_of(world.at(0.0)).elements
        self.rows, self.kinds = elements.rows, elements.kinds
        self.total = registry.field_sum(elements.kinds_used)
        self.eye, self.d = np.array(camera.eye), rays(camera, size)

    def along(self, pixel, t):
        """(F, dF/dt) at the distance t through a pixel."""
        p = self.eye + t * self.d[pixel]
        f, *slope = self.total(*p.tolist(), self.rows, self.kinds, 0, len(self.kinds))
        return f, np.dot(slope, self.d[pixel])


def check(world, radius=RADIUS, near=1.0, far=6.5, pixels=24, samples=120, camera=CAMERA, seed=0):
    """A sparse set of rays hit where the field first comes to 1, and miss where it stays below."""
    depth, _ = fs.Renderer(SIZE).depth_and_normals(world.at(0.0), camera)
    depth = depth.ravel()
    truth = Truth(world, camera, SIZE)
    rng = np.random.default_rng(seed)
    hit = np.isfinite(depth)
    edge = hit.reshape(SIZE[::-1])
    edge = (edge != np.roll(edge, 1, 0)) | (edge != np.roll(edge, 1, 1))
    assert 8 < hit.sum()
    # As many inside as just beside the silhouette, where what is missed or false shows.
    inside = rng.permutation(np.flatnonzero(hit))[: pixels // 2]
    beside = rng.permutation(np.flatnonzero(edge.ravel()))[: pixels // 2]
    for pixel in np.concatenate([inside, beside]):
        end = min(depth[pixel], far)
        values = [truth.along(pixel, t)[0] for t in np.linspace(near, end, samples, endpoint=False)]
        # Nothing before the hit; a grazing hump of the tolerance's height may stay unseen.
        assert max(values) < 1.0 + 2e-5
        if hit[pixel]:
            f, slope = truth.along(pixel, depth[pixel])
            # Depth in float32 is good to 1e-7 of itself; where a ray grazes, that says nothing of F.
            assert abs(f - 1.0) < 1e-5 * radius * abs(slope) + 1e-6
            assert abs(slope) > 0.0


# Every primitive once, and every kernel on points below: each pair compiles kernels of its own, which takes seconds.
PAIRS = [
    (fs.Newtonian, "segment"),
    (fs.Quartic, "segment"),
    (fs.SoftObject, "arc"),
    (fs.Gaussian, "circle"),
    (fs.Quartic, "triangle"),
    (fs.Cauchy, "plane"),
    (fs.Metaball, "profiled segment"),
    (fs.InverseSquare, "profiled arc"),
    (fs.Newtonian, "tapered segment"),
]


@pytest.mark.parametrize(("kernel", "name"), PAIRS)
def test_every_primitive(kernel, name):
    check(world_of((PRIMITIVES[name], material(kernel))))


@pytest.mark.parametrize("kernel", KERNELS)
def test_every_kernel_on_points_that_melt_together(kernel):
    rng = np.random.default_rng(3)
    points = [fs.Point(p) for p in rng.uniform(-0.6, 0.6, (9, 3))]
    for blobbiness in (-0.7, -4.0, -60.0) if kernel is not fs.Newtonian else (-4.0,):
        radius = RADIUS if not kernel.power else 0.05
        check(world_of((points, material(kernel, radius, blobbiness))), radius)


def test_the_chart_is_covered():
    # Whoever adds a primitive or a kernel to the registry gives it a volume, a width and a test here.
    assert {kernel for kernel, _ in FORMULAS} == set(KERNELS)
    drawn = {primitive for _, primitive in FORMULAS if primitive.distance is not None}
    assert {type(PRIMITIVES[name]) for _, name in PAIRS} | {fs.Point, fs.Arc} == drawn


def test_what_cannot_be_drawn_is_refused():
    with pytest.raises(fs.InputError, match="infinite plane has no level"):
        surface_of(world_of((PRIMITIVES["plane"], material(fs.Newtonian))).at(0.0))
    faces = fs.solid_faces(fs.mesh(fs.box((0, 0, 0), (1, 1, 1))))
    world = fs.World()
    world.add_body(fs.Body(faces, gravity=fs.Newtonian(), surface=fs.Material(level=1.0)))
    with pytest.raises(fs.InputError, match="Newtonian on Face can neither be drawn"):
        fs.Renderer(SIZE).frame(world.at(0.0), CAMERA)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
@pytest.mark.parametrize("kernel", [fs.Quartic, fs.Newtonian])
def test_scale_changes_nothing(kernel, scale):
    def depths(k):
        skeleton = [fs.Point((0, 0.4 * k, 0)), fs.Point((0.3 * k, -0.2 * k, 0.1 * k))]
        world = world_of((skeleton, material(kernel, 0.2 * k)))
        camera = fs.Camera(tuple(k * np.array(CAMERA.eye)), fov=36)
        return fs.Renderer(SIZE).depth_and_normals(world.at(0.0), camera)[0] / k

    # Powers of two apart from what is rounded on input.
    np.testing.assert_allclose(depths(scale), depths(1.0), rtol=1e-6)


def test_tiny_beside_large_and_mixed_kernels():
    rng = np.random.default_rng(5)
    large = [fs.Point(p) for p in rng.uniform(-0.5, 0.5, (3, 3))]
    tiny = [fs.Point(p) for p in rng.uniform(-0.7, 0.7, (20, 3))]
    world = world_of((large, material(fs.Gaussian, 0.3)), (tiny, material(fs.Quartic, 0.03)))
    # Depth in float32 is some 1e-5 of a radius that is a hundredth of it.
    check(world, radius=0.1, samples=600)


def test_equipotentials_are_levels_of_the_bodies_gravity():
    world, bodies = fs.World(), []
    for x, mass in ((-0.5, 1.0), (0.6, 0.4)):
        look = fs.Material(level=2.4)
        bodies.append(world.add_body(fs.Body(fs.Point((x, 0, 0)), gravity=fs.Newtonian(), mass=mass, surface=look)))
    check(world)
    depth, _ = fs.Renderer(SIZE).depth_and_normals(world.at(0.0), CAMERA)
    hit = np.isfinite(depth).ravel()
    points = np.array(CAMERA.eye) + depth.ravel()[hit, None] * rays(CAMERA, SIZE)[hit]
    potential = sum(m / np.linalg.norm(points - (x, 0, 0), axis=1) for x, m in ((-0.5, 1.0), (0.6, 0.4)))
    np.testing.assert_allclose(potential, 2.4, rtol=1e-5)
    with pytest.raises(fs.InputError, match="equipotential of its gravity"):
        fs.Body(fs.Point((0, 0, 0)), surface=fs.Material(level=1.0))


def test_a_plane_is_seen_to_the_horizon_and_from_both_sides():
    for eye in ((0, 0, 1.0), (0, 0, -1.0)):
        camera = fs.Camera(eye, (10.0, 0, eye[2]), fov=60)
        world = world_of((fs.Plane((0, 0, 0), (0, 0, 1)), material(fs.Cauchy)))
        depth, _ = fs.Renderer((4, 401)).depth_and_normals(world.at(0.0), camera)
        d = rays(camera, (4, 401)).reshape(401, 4, 3)
        down = -np.sign(eye[2]) * d[..., 2]
        assert (np.isfinite(depth) == (down > 1e-6)).all()
        np.testing.assert_allclose(depth[down > 1e-6], (1.0 - RADIUS) / down[down > 1e-6], rtol=2e-5)


def test_more_equipotentials_than_fit_into_local_memory():
    points = [fs.Point((0.01 * k, 0, 0)) for k in range(-25, 26)]
    world = fs.World()
    world.add_body(fs.Body(points, gravity=fs.Newtonian(), surface=fs.Material(level=2.0)))
    check(world, pixels=8, samples=40)


def test_tolerance_is_checked_and_bounds_the_error():
    with pytest.raises(fs.InputError, match="tolerance"):
        fs.Renderer(SIZE, tolerance=0.0)
    world = world_of(([fs.Point((0, 0.3 * k, 0)) for k in range(-3, 4)], material(fs.Gaussian, 0.3, -1.0)))
    fine, coarse = (
        fs.Renderer(SIZE, tolerance=tolerance).depth_and_normals(world.at(0.0), CAMERA)[0] for tolerance in (1e-7, 1e-3)
    )
    assert np.count_nonzero(np.isfinite(fine) != np.isfinite(coarse)) <= 2
    both = np.isfinite(fine) & np.isfinite(coarse)
    assert 1e-6 < np.abs(fine[both] - coarse[both]).max() < 3e-2


# Materials


WHOLE = [fs.Point((0, 0, 0)), fs.Segment((-1e17, 0, 0), (1e17, 0, 0)), fs.Plane((0, 0, 0), (0, 0, 1))]
LIMITED = [PRIMITIVES["segment"], fs.Circle((0, 0, 0), (0, 0, 1), 0.7), PRIMITIVES["triangle"]]


def field_on(look, primitive, place):
    """The surface's field of one primitive at a point."""
    elements = fs.Body(primitive, surface=look).surface_elements(0.0)
    return registry.formula_of(look.surface_kernel, primitive).jet(*map(float, place), elements.rows, 0)[0]


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("blobbiness", [-0.3, -4.0, -256.0])
def test_the_surface_in_isolation_lies_at_the_radius(kernel, blobbiness):
    look = material(kernel, 0.3, blobbiness)
    for primitive in WHOLE:
        if primitive.dimension < {fs.Newtonian: 1, fs.InverseSquare: 2}.get(kernel, 3):
            if primitive.dimension == 1 and kernel in (fs.Metaball, fs.SoftObject, fs.Quartic):
                primitive = fs.Segment((-2, 0, 0), (2, 0, 0))  # the rest of the line is out of their reach
            # The folded exponent of 256 costs three digits.
            assert field_on(look, primitive, (0, 0, 0.3)) == pytest.approx(1.0, abs=1e-9)


def test_where_the_whole_line_or_plane_is_infinite_a_primitive_is_measured_by_itself():
    look = material(fs.Newtonian, 0.3)
    segment, circle, triangle = LIMITED
    middle = 0.5 * np.add(*ENDS)
    aside = np.cross(np.subtract(*ENDS), (0.3, -0.8, 0.5))
    assert field_on(look, segment, middle + 0.3 * aside / np.linalg.norm(aside)) == pytest.approx(1.0, rel=1e-12)
    assert field_on(look, circle, (0.7, 0, 0.3)) == pytest.approx(1.0, rel=1e-12)
    corners = np.array([triangle.a, triangle.b, triangle.c])
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    above = corners.mean(axis=0) - 0.3 * normal / np.linalg.norm(normal)
    for kernel in (fs.Newtonian, fs.InverseSquare):
        assert field_on(material(kernel, 0.3), triangle, above) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("kernel", [fs.Metaball, fs.SoftObject, fs.Quartic])
@pytest.mark.parametrize("blobbiness", [-0.2, -0.45, -0.6, -4.0, -100.0])
def test_compact_kernels_fall_at_the_radius_as_the_gaussian_does(kernel, blobbiness):
    look = material(kernel, 0.3, blobbiness)
    elements = fs.Body(fs.Point((0, 0, 0)), surface=look).surface_elements(0.0)
    f, slope = registry.formula_of(look.surface_kernel, fs.Point((0, 0, 0))).jet(0.3, 0.0, 0.0, elements.rows, 0)[:2]
    assert f == pytest.approx(1.0, rel=1e-9)
    assert slope == pytest.approx(2.0 * blobbiness / 0.3, rel=1e-9)


def test_a_kernel_may_bring_its_own_width():
    bare = fs.Material(kernel=fs.Newtonian(), radius=0.4)
    assert bare.surface_kernel == fs.Newtonian()
    assert bare.surface_strength(0) == (pytest.approx(0.4), 0.0)
    with pytest.raises(fs.InputError, match="ends before"):
        fs.Material(kernel=fs.Quartic(0.2), radius=0.3).surface_strength(0)
    with pytest.raises(fs.InputError, match="whole line is infinite"):
        bare.surface_strength(1)
    with pytest.raises(fs.InputError, match="give a kernel"):
        fs.Material(kernel="gaussian")
