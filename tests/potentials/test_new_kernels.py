"""Kernels defined in one file each, beside this: they pull, collide, are drawn, meshed and calibrated as others are."""

import generalised_wyvill
import mpmath
import numpy as np
import pytest
import sixth_power
import test_formula_conformance as conformance
from mpmath import mp, mpf

import fieldsim as fs
from fieldsim.filming.comparing import compare_depths
from fieldsim.potentials import registry

CAMERA = fs.Camera((1.2, -3.4, 1.6), fov=36)
BEFORE = [key for key in registry.FORMULAS if key[0].__module__.startswith("fieldsim")]
POINTS = [fs.Point((-0.25, 0.1, 0.0)), fs.Point((0.2, -0.1, 0.15)), fs.Point((0.9, 0.3, -0.2))]
SKELETONS = {"GeneralisedWyvill": [*POINTS, fs.Segment((-0.8, -0.5, 0.2), (0.5, -0.6, 0.4))], "SixthPower": POINTS}


@pytest.fixture(params=[generalised_wyvill, sixth_power], ids=lambda module: module.__name__, scope="module")
def kernel(request):
    with request.param.registered() as known:
        yield known


@pytest.fixture
def skeleton(kernel):
    return SKELETONS[kernel.__name__]


def material(kernel, **options):
    return fs.Material(kernel=kernel, radius=0.3, blobbiness=-2.0, **options)


def test_the_formulas_hold_on_every_target(kernel, skeleton):
    value = kernel(0.9)
    field = fs.Field(skeleton, value)
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (12, 3))
    f, gradient = field.value_and_gradient(points)
    hessian = field.hessian(points)
    step = 1e-5
    for k in range(3):
        aside = step * np.eye(3)[k]
        slope = (field.value(points + aside) - field.value(points - aside)) / (2 * step)
        np.testing.assert_allclose(gradient[:, k], slope, atol=1e-8)
        bend = (field.gradient(points + aside) - field.gradient(points - aside)) / (2 * step)
        np.testing.assert_allclose(hessian[:, k], bend, atol=1e-7)
    rows, kinds = field.elements.rows, field.elements.kinds
    total = registry.field_sum(field.elements.kinds_used)
    for point, expected in zip(points, f, strict=True):
        assert total.numba(*point, rows, kinds, 0, len(kinds))[0] == pytest.approx(expected, rel=1e-14)
        assert total(*map(float, point), rows, kinds, 0, len(kinds))[0] == pytest.approx(expected, rel=1e-14)


def test_they_pass_what_all_kernels_pass(kernel):
    keys = [key for key in registry.FORMULAS if key[0] is kernel]
    assert keys
    for key in keys:
        conformance.test_formulas_are_the_declared_law_on_the_declared_mass_points(key)


@pytest.mark.parametrize("kernel", [generalised_wyvill], ids=["generalised_wyvill"], indirect=True, scope="module")
def test_segments_by_quadrature(kernel):
    start, end = mpmath.matrix([-0.8, -0.5, 0.2]), mpmath.matrix([0.5, -0.6, 0.4])
    field = fs.Field(fs.Segment(tuple(map(float, start)), tuple(map(float, end))), kernel(0.7))
    for point in [(0.0, -0.3, 0.1), (0.9, -0.5, 0.5), (-0.8, -0.5, 0.2), (-0.1, 0.05, 0.3)]:
        q = mpmath.matrix(point)

        def h(t, q=q):
            away = q - start - t * (end - start)
            return max(1 - mp.norm(away) ** 2 / mpf(0.7) ** 2, mpf(0)) ** 4

        with mpmath.workdps(30):
            expected = mp.norm(end - start) * mp.quad(h, mp.linspace(0, 1, 41))
        assert field.value(point) == pytest.approx(float(expected), rel=1e-8, abs=1e-12)


def test_it_pulls(kernel, skeleton):
    world = fs.World()
    for primitive in skeleton:
        world.add_body(fs.Body(primitive, gravity=kernel(1.5), mass=0.5))
    rng = np.random.default_rng(0)
    x, v = rng.uniform(-1, 1, (5, 3)), 0.3 * rng.normal(size=(5, 3))
    world.add_particles(x, v)
    ends = []
    for integrator in (fs.BlanesMoan6(0.01), fs.Radau()):
        run = fs.Simulation(world, integrator)
        run.advance(1.0)
        ends.append(run.positions[0])
    np.testing.assert_allclose(*ends, atol=1e-6)
    assert np.abs(ends[0] - (x + v)).max() > 0.1


def test_particles_pull_each_other(kernel):
    world = fs.World()
    world.add_particles([(-0.3, 0, 0), (0.3, 0, 0)], np.zeros((2, 3)), gravity=kernel(1.5), mass=1.0)
    run = fs.Simulation(world, fs.Leapfrog(0.01))
    run.advance(0.3)
    x = run.positions[0]
    assert x[0, 0] > -0.3
    np.testing.assert_allclose(x[0], -x[1], atol=1e-15)


def drop(world):
    """A pebble falls onto the surface of the world's body, and bounces."""
    world.add_particles([(0.2, -0.1, 1.4)], [(0, 0, -1.0)], radius=0.02, contact=fs.Bounce(1.0))
    run = fs.Simulation(world, fs.Leapfrog(2e-3))
    run.advance(2.0)
    return run


def test_it_collides(kernel):
    world = fs.World()
    world.add_body(fs.Body(POINTS, surface=material(kernel)))
    run = drop(world)
    assert run.velocities[0][0, 2] > 0
    # It never was within.
    assert world.at(0.0).surface_field().value(run.positions[0]) < 1.0


def test_it_pulls_down_what_bounces_off_another_surface(kernel, skeleton):
    world = fs.World()
    for primitive in skeleton:
        world.add_body(fs.Body(primitive, gravity=kernel(3.0), mass=1.0, surface=fs.Material(radius=0.3)))
    assert drop(world).velocities[0][0, 2] != -1.0


def test_it_is_drawn(kernel, skeleton):
    world = fs.World()
    world.add_body(fs.Body(skeleton, surface=material(kernel)))
    seen = compare_depths(world.at(0.0), CAMERA, ("hermite", "referee"), size=(56, 56))
    assert np.isfinite(seen.depths[1]).sum() > 200
    assert seen.mismatched.sum() <= 2
    assert seen.inner_error < 3e-5
    picture = fs.Renderer((32, 32), samples=1).frame(world.at(0.0), CAMERA)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 20
    with pytest.raises(fs.InputError, match=f"cannot do {kernel.__name__} on Point, only SoftObject on Point"):
        fs.Renderer((8, 8), solver="laguerre").frame(world.at(0.0), CAMERA)


def test_it_is_meshed(kernel, skeleton):
    world = fs.World()
    world.add_body(fs.Body(skeleton, surface=material(kernel)))
    mesh = world.at(0.0).surface_mesh(resolution=40)
    assert len(mesh.vertices) > 500
    np.testing.assert_allclose(world.at(0.0).surface_field().value(mesh.vertices), 1.0, atol=1e-6)


@pytest.mark.parametrize("blobbiness", [-0.5, -2.0, -9.0])
def test_materials_put_its_surface_at_the_radius(kernel, skeleton, blobbiness):
    made = fs.Material(kernel=kernel, radius=0.3, blobbiness=blobbiness)
    for primitive in (fs.Point((0, 0, 0)), fs.Segment((-9, 0, 0), (9, 0, 0))):
        if any(isinstance(p, type(primitive)) for p in skeleton):
            strength, fold = made.strength_on(primitive)
            assert fold == 0.0
            assert fs.Field(primitive, made.surface_kernel, strength).value((0.0, 0.0, 0.3)) == pytest.approx(1.0)


def test_kernels_come_and_go():
    class Passing(sixth_power.SixthPower):
        """As the other, but on its own."""

    sixth_power.register_points(Passing)
    first = registry.FORMULAS[Passing, fs.Point].kind
    field = fs.Field(POINTS, Passing(1.0))
    field.value((0, 0, 0))
    with pytest.raises(fs.InputError, match="Passing on Point is registered already"):
        sixth_power.register_points(Passing)
    registry.unregister(Passing)
    with pytest.raises(fs.InputError, match=r"no field is known for .*Passing\(s=1.0\) on Point"):
        fs.Field(POINTS, Passing(1.0)).value((0, 0, 0))
    # What is compiled for a field's formulas goes on with it; nothing new is compiled for them.
    assert field.value((0, 0, 0)) > 0.0
    with pytest.raises(fs.InputError, match=f"formulas .{first}. are not registered any more"):
        registry.element_jet.__wrapped__((first,))
    sixth_power.register_points(Passing)
    assert registry.FORMULAS[Passing, fs.Point].kind > first
    registry.unregister(Passing)
    assert [key for key in registry.FORMULAS if key[0].__module__.startswith("fieldsim")] == BEFORE
    assert [formula.kind for formula in registry.FORMULAS.values()][: len(BEFORE)] == list(range(len(BEFORE)))


def test_only_kernels_that_end_are_integrated_over_segments():
    with pytest.raises(fs.InputError, match="SixthPower has no end"):
        generalised_wyvill.register_segments(sixth_power.SixthPower)
