"""No nan comes out of a field: what has no strength is 0 everywhere, extreme lengths are right or refused."""

import numpy as np
import pytest
import warp as wp

import fieldsim as fs
from fieldsim.potentials import registry
from fieldsim.potentials.elements import pack

PLACES = np.random.default_rng(0).normal(size=(8, 3))


def primitives(unit=1.0):
    """One of each, and a place on its source."""

    def at(*place):
        return tuple(unit * np.array(place))

    arc = fs.Arc(at(0, 0, 0.25), (0, 0, 1), (1, 0, 0), unit, 2.0)
    segment = fs.Segment(at(-1, 0, 0), at(1, 0, 0))
    return {
        "Point": (fs.Point(at(0, 0.5, 0)), at(0, 0.5, 0)),
        "Segment": (segment, at(0.25, 0, 0)),
        "TaperedSegment": (fs.TaperedSegment(at(-1, 0, 0), at(1, 0, 0), 1, 2), at(0.25, 0, 0)),
        "ProfiledSegment": (fs.profiled(segment, fs.profile.hat(1, 2)), at(0.25, 0, 0)),
        "Arc": (arc, at(1, 0, 0.25)),
        "ProfiledArc": (fs.profiled(arc, fs.profile.hat(1, 2)), at(1, 0, 0.25)),
        "Circle": (fs.Circle(at(0, 0, 0), (0, 0, 1), unit), at(1, 0, 0)),
        "Triangle": (fs.Triangle(at(0, 0, 0), at(1, 0, 0), at(0, 1, 0)), at(0.25, 0.25, 0)),
        "Plane": (fs.Plane(at(0, 0, 0.5), (0, 0, 1)), at(3, 1, 0.5)),
    }


KERNELS = {
    fs.Newtonian: lambda unit: fs.Newtonian(0.0),
    fs.InverseSquare: lambda unit: fs.InverseSquare(0.0),
    fs.Gaussian: lambda unit: fs.Gaussian(1.0 / unit),
    fs.Cauchy: lambda unit: fs.Cauchy(1.0 / unit),
    fs.Metaball: lambda unit: fs.Metaball(2.0 * unit),
    fs.SoftObject: lambda unit: fs.SoftObject(2.0 * unit),
    fs.Quartic: lambda unit: fs.Quartic(2.0 * unit),
}
PAIRS = [
    (k, p)
    for k, p in ((formula.kernel, formula.primitive.__name__) for formula in registry.FORMULAS.values())
    if p != "Face"
]


def jets(primitive, kernel, strength, places):
    """Rows of the jet in plain Python, which the compiled twins equal elsewhere."""
    elements = pack([primitive], [kernel], [strength])
    jet = registry.element_jet(elements.kinds_used)
    with np.errstate(all="ignore"):
        return np.array([jet(*map(float, place), elements.rows, elements.kinds, 0) for place in places])


@pytest.mark.parametrize(("kernel", "name"), PAIRS)
def test_without_strength_there_is_nothing_on_the_source(kernel, name):
    primitive, place = primitives()[name]
    assert not np.any(jets(primitive, KERNELS[kernel](1.0), 0.0, [place, (0, 0, 0), (1, 0, 0), (-1, 0, 0)]))


@pytest.mark.parametrize(("kernel", "name"), PAIRS)
@pytest.mark.parametrize("unit", [1e-50, 1e-25, 1e25, 1e50])
def test_any_unit(kernel, name, unit):
    right = jets(primitives()[name][0], KERNELS[kernel](1.0), 1.0, PLACES)
    got = jets(primitives(unit)[name][0], KERNELS[kernel](unit), 1.0, unit * PLACES)
    power = {"Point": 0, "Triangle": 2, "Plane": 2}.get(name, 1) - {fs.Newtonian: 1, fs.InverseSquare: 2}.get(kernel, 0)
    orders = np.array([0, 1, 1, 1, 2, 2, 2, 2, 2, 2])
    scaled = got / unit**power * unit**orders
    # An InverseSquare plane is a logarithm, right up to a constant.
    first = 1 if (kernel, name) == (fs.InverseSquare, "Plane") else 0
    error = np.abs(scaled - right).max(axis=0)
    assert (error <= 1e-8 * np.abs(right).max())[first:].all()


SOURCES = [fs.Point((0, 0, 0)), fs.Segment((0, 0, 0), (1, 0, 0)), fs.Circle((0, 0, 0), (0, 0, 1), 1.0)]
ON_THEM = np.array([(0.0, 0, 0), (0.25, 0, 0), (1, 0, 0)])


@pytest.mark.parametrize("vector", [wp.vec3f, wp.vec3d])
def test_compiled_fields_without_strength(vector):
    bare = fs.Field(SOURCES, fs.Newtonian(), 0.0)
    of_time = fs.gravity(SOURCES[1], lambda t: t)
    for field in (
        bare,
        fs.Field(SOURCES, fs.Newtonian(1e-200), 0.0),
        0.0 * fs.Field(SOURCES, fs.Newtonian()),
        bare + of_time.at(0.0),
    ):
        assert not field.value(ON_THEM).any()
        points = wp.array(ON_THEM, dtype=vector, device="cpu")
        for result in (field.value(points), field.gradient(points), field.hessian(points)):
            assert not result.numpy().any()
    # Others are not touched.
    assert (bare + fs.Field(SOURCES[0], fs.Newtonian())).value((0.5, 0, 0)) == pytest.approx(2.0)


def test_a_run_at_a_source_that_has_no_mass_yet():
    world = fs.World()
    world.add_body(fs.Body(SOURCES[2], gravity=fs.Newtonian(), mass=lambda t: 0.0))
    world.add_particles([(1, 0, 0)], [(0, 0, 0)])
    run = fs.Simulation(world, fs.Leapfrog(0.1))
    run.advance(1.0)
    np.testing.assert_array_equal(run.positions[0], [(1, 0, 0)])


def test_bare_sources_are_infinite_and_nothing_else():
    field = fs.Field(SOURCES, fs.Newtonian())
    assert np.isposinf(field.value(ON_THEM)).all()
    assert np.isneginf((-field).value((0.25, 0, 0)))
    np.testing.assert_array_equal(fs.Field(SOURCES[0], fs.Newtonian()).gradient((0, 0, 0)), 0.0)
    with pytest.raises(fs.InputError, match=r"Field: its value at \(0.0, 0.0, 0.0\) is .* both signs"):
        (fs.Field(SOURCES[0], fs.Newtonian()) - fs.Field(SOURCES[1], fs.Newtonian())).value([(1, 1, 1), (0, 0, 0)])
    with pytest.raises(fs.InputError, match=r"Field: its (value|gradient) .* overflows"):
        fs.Field(SOURCES[0], fs.Newtonian(), 1e300).gradient((1e-10, 0, 0))


@pytest.mark.parametrize("distance", [1e20, 1e60, 1e100])
def test_far_points(distance):
    ring = fs.Field(SOURCES[2], fs.Newtonian(), 1.0 / (2 * np.pi))
    x = np.array([0.6, 0.0, 0.8]) * distance
    assert ring.value(x) * distance == pytest.approx(1.0, rel=1e-12)
    np.testing.assert_allclose(ring.gradient(x) * distance * distance, (-0.6, 0.0, -0.8), rtol=1e-12)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: fs.Circle((0, 0, 0), (0, 0, 1), 1e200),
            "Circle: radius is 1e.200, .* overflow; give lengths of at most",
        ),
        (lambda: fs.Segment((0, 0, 0), (1e200, 0, 0)), "Segment: end is"),
        (lambda: fs.Segment((0, 0, 0), (1e-200, 0, 0)), "Segment: its size is 1e-200"),
        (lambda: fs.Circle((0, 0, 0), (0, 0, 1), 1e-200), "Circle: its size is 1e-200"),
        (lambda: fs.Arc((0, 0, 1e90), (0, 0, 1), (1, 0, 0), 1.0, 1.0), "Arc: center is"),
        (lambda: fs.Point((1e61, 0, 0)), "Point: position is"),
        (lambda: fs.Plane((0, 0, 1e160), (0, 0, 1)), "Plane: point is"),
        (lambda: fs.Triangle((0, 0, 0), (1e160, 0, 0), (0, 1e160, 0)), "Triangle"),
        (lambda: fs.Triangle((0, 0, 0), (1e-160, 0, 0), (0, 1e-160, 0)), "Triangle"),
        (lambda: fs.Newtonian(1e160), "Newtonian: softening is 1e.160, .* from 1e-60 to 1e.60, in another unit"),
        (lambda: fs.Gaussian(1e160), "Gaussian: a is 1e.160"),
        (lambda: fs.Quartic(1e-160), "Quartic: radius"),
        (lambda: fs.Field(SOURCES, fs.Newtonian()).gradient((1e200, 0, 1e200)), r"Field: points has \(1e.200, 0.0, 1e"),
        (lambda: fs.Field(SOURCES, fs.Newtonian()).value([(0, 0, 2), (0, -1e308, 0)]), "Field: points has"),
    ],
)
def test_lengths_whose_powers_are_no_numbers(make, words):
    with pytest.raises(fs.InputError, match=words):
        make()


HUGE = 1e200


@pytest.mark.parametrize(
    "make",
    [
        lambda: fs.Pose((HUGE, 0, 0)),
        lambda: fs.Spin(center=(0, HUGE, 0)),
        lambda: fs.Rigid(velocity=(0, 0, HUGE)),
        lambda: fs.Rigid(angular_velocity=(HUGE, 0, 0)),
        lambda: fs.Rigid(center=(HUGE, 0, 0)),
        lambda: fs.Rigid(mass=HUGE),
        lambda: fs.Rigid(inertia=HUGE * np.eye(3)),
        lambda: fs.World().add_particles([(HUGE, 0, 0)], [(0, 0, 0)]),
        lambda: fs.World().add_particles([(0, 0, 0)], [(0, -HUGE, 0)]),
        lambda: fs.World().add_particles([(0, 0, 0)], [(0, 0, 0)], gravity=fs.Newtonian(), mass=-HUGE),
    ],
)
def test_what_moves_has_energies_that_are_numbers(make):
    with pytest.raises(fs.InputError, match=r"1e\+60"):
        make()


def test_manoeuvres_and_flights_stay_within_what_numbers_hold():
    world = fs.World()
    world.add_body(fs.Body(fs.Point((0, 0, 0)), mass=1.0, motion=fs.Rigid((0, 3, 0))))
    world.add_particles([(9e59, 0, 0)], [(1e60, 0, 0)])
    simulation = fs.Simulation(world, fs.Leapfrog(1.0))
    with pytest.raises(fs.InputError, match="velocities"):
        simulation.set_particles(0, velocities=[(HUGE, 0, 0)])
    with pytest.raises(fs.InputError, match="velocity"):
        simulation.set_body(0, velocity=(HUGE, 0, 0))
    assert np.isfinite(fs.energy(simulation.snapshot()).total).all()
    with pytest.raises(fs.FieldsimError, match="particle 0 of set 0"):
        simulation.advance(2.0)


def test_steps_that_no_time_tells_apart_are_refused():
    world = fs.World()
    world.add_particles([(1, 0, 0)], [(0, 1, 0)])
    with pytest.raises(fs.InputError, match="too short for times"):
        fs.Simulation(world, fs.Leapfrog(1e-3), time=1e16).advance(1e16 + 2)
    simulation = fs.Simulation(world, fs.Leapfrog(2.0), time=1e16)
    simulation.advance(1e16 + 4)
    np.testing.assert_allclose(simulation.positions[0], [(1, 4, 0)])
