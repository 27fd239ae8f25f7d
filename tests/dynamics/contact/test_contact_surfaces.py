"""Contact with the surface of every skeleton that a Material can give: nothing tunnels, reaches are safe."""

import math

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.sources.margins import with_reach
from fieldsim.sources.rows import REACH

BALL = 0.02
WALL = 0.02
KERNELS = [fs.Gaussian, fs.Cauchy]
TURN = fs.profile.hat(1.0, 1.5)


def thin(kernel):
    return fs.Material(radius=WALL, kernel=kernel, blobbiness=-2.0)


def primitives(shift=0.0):
    """One primitive of each finite kind, 4 apart along x."""
    at = [np.array([4.0 * k + shift, 0.0, 0.0]) for k in range(7)]
    ring = {"normal": (0, 0, 1), "radius": 0.5}
    e, u = np.array([0.5, 0, 0]), np.array([0, 0.6, 0])
    return [
        fs.Point(at[0]),
        fs.Segment(at[1] - e, at[1] + e),
        fs.Arc(at[2], start=(1, 0, 0), angle=2.0, **ring),
        fs.Circle(at[3], **ring),
        fs.Triangle(at[4] - e - u, at[4] + e - u, at[4] + u),
        fs.profiled(fs.Segment(at[5] - e, at[5] + e), TURN),
        fs.profiled(fs.Arc(at[6], start=(1, 0, 0), angle=2.0, **ring), TURN),
    ]


def samples(primitive, u, v):
    """Points of a primitive for parameters in 0..1, (N, 3)."""
    if isinstance(primitive, fs.Point):
        return np.tile(primitive.position, (len(u), 1))
    if isinstance(primitive, fs.Segment):
        start, end = np.array(primitive.start), np.array(primitive.end)
        return start + u[:, None] * (end - start)
    if isinstance(primitive, fs.Triangle):
        a, b, c = np.array([primitive.a, primitive.b, primitive.c])
        s = np.sqrt(u)[:, None]
        return (1 - s) * a + s * (1 - v)[:, None] * b + s * v[:, None] * c
    angle = u * getattr(primitive, "angle", 2 * np.pi)
    offsets = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    return np.array(primitive.center) + primitive.radius * offsets


def directions(count, seed):
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


@pytest.mark.parametrize("kernel", KERNELS)
def test_nothing_tunnels_through_any_skeleton(kernel):
    # 500 a time unit at dt = 5e-3: a step is 60 times as long as a wall is thick.
    count, skeleton = 60, primitives()
    floor = fs.Plane((0, 0, -3.0), (0, 0, 1))
    world = fs.World()
    world.add_body(fs.Body([*skeleton, floor], surface=thin(kernel)))
    rng = np.random.default_rng(1)
    targets = np.concatenate([samples(p, rng.random(count), rng.random(count)) for p in skeleton])
    targets = np.concatenate([targets, np.column_stack([rng.uniform(0, 24, (count, 2)), np.full(count, -3.0)])])
    heading = directions(len(targets), seed=2)
    heading[:, 2] = -np.abs(heading[:, 2]) - 0.3  # onto the floor from above, and steeply enough
    heading /= np.linalg.norm(heading, axis=1)[:, None]
    # Past the middle of the wall, too: grazing up to 0.9 of where ball and wall would only just meet.
    aside = np.cross(heading, directions(len(targets), seed=3))
    aside *= (rng.uniform(0, 0.9, len(targets)) * (WALL + BALL) / np.linalg.norm(aside, axis=1))[:, None]
    aside[-count:] = 0.0
    start = targets + aside - 1.5 * heading
    world.add_particles(start, 500.0 * heading, radius=BALL, contact=fs.Bounce(0.5))
    simulation = fs.Simulation(world, fs.Leapfrog(5e-3), threads=1)
    simulation.advance(0.005)
    events = simulation.events
    first = np.unique(events.particles, return_index=True)[1]
    # Whoever aimed at the middle of a primitive hits; a ball may pass beside a pointed end or a corner that it grazes.
    missed = np.setdiff1d(np.arange(len(start)), events.particles)
    surface = world.bodies[0].surface
    strengths = [surface.surface_strength(p.dimension) for p in world.bodies[0].skeleton]
    field = fs.Field([*skeleton, floor], surface.surface_kernel, [s * np.exp(fold) for s, fold in strengths])
    np.testing.assert_allclose(field.value(events.positions[first]), 1.0, atol=1e-7)
    assert len(missed) < 0.02 * len(start)

    def deepest(who, times):
        """The greatest F at the lowest point of the balls on the way to the given times."""
        greatest = np.zeros(len(who))
        for share in np.linspace(0.0, 1.0, 2000, endpoint=False):
            center = start[who] + (500.0 * times * share)[:, None] * heading[who]
            gradient = field.gradient(center)
            size = np.linalg.norm(gradient, axis=1)[:, None]
            inward = np.divide(gradient, size, out=np.zeros_like(gradient), where=size > 0)
            greatest = np.maximum(greatest, field.value(center + BALL * inward))
        return greatest

    assert (deepest(events.particles[first], events.times[first]) < 1.0 + 1e-7).all()
    assert (deepest(missed, np.full(len(missed), 0.005)) < 1.0).all()


@pytest.mark.parametrize("kernel", KERNELS)
def test_balls_come_to_rest_on_a_slab_of_triangles(kernel):
    # A slab of two triangles: no seam where they meet, thickness WALL on both sides.
    world = fs.World()
    world.add_body(fs.Body(fs.rectangle((0, 0, 0), (2, 0, 0), (0, 2, 0)), surface=thin(kernel)))
    world.add_body(fs.Body(fs.Point((0, 0, -1e4)), gravity=fs.Newtonian(), mass=1e8))
    rng = np.random.default_rng(4)
    start = np.column_stack([rng.uniform(-0.6, 0.6, (40, 2)), np.full(40, 0.2)])
    world.add_particles(start, 0.2 * rng.normal(size=(40, 3)), radius=BALL, contact=fs.Bounce(0.4, friction=0.5))
    simulation = fs.Simulation(world, fs.Leapfrog(5e-3), threads=1)
    simulation.advance(10.0)
    # The slab is that thick far from its edges; Cauchy's tails reach them.
    np.testing.assert_allclose(simulation.positions[0][:, 2], WALL + BALL, atol=3e-4 if kernel is fs.Cauchy else 1e-9)
    np.testing.assert_array_equal(simulation.velocities[0], 0.0)


@pytest.mark.parametrize("kernel", KERNELS)
def test_beyond_their_reach_elements_are_less_than_one(kernel):
    points = np.random.default_rng(5).uniform(-1.2, 1.2, (1500, 3))
    for primitive in [*primitives(), fs.Plane((0.1, 0, 0), (1, 2, 3))]:
        points_here = (
            points + getattr(primitive, "center", samples(primitive, np.array([0.5]), np.array([0.5]))[0])
            if not isinstance(primitive, fs.Plane)
            else points
        )
        material = fs.Material(radius=0.2, kernel=kernel)
        elements = fs.Body(primitive, surface=material).surface_elements(0.0)
        rows = with_reach(elements.rows, elements.kinds, 1)
        far = np.array([primitive.distance(*p, rows, 0) for p in points_here]) > rows[0, REACH]
        strength, fold = material.surface_strength(primitive.dimension)
        field = fs.Field(primitive, material.surface_kernel, strength * np.exp(fold))
        assert 100 < far.sum() < 1500
        assert (field.value(points_here[far]) <= 1.0).all()
        # And not much farther than needed: the surface of a straight one lies at 0.2.
        assert 0.2 <= rows[0, REACH] < 0.6


def test_distances_to_triangles_are_those_to_their_nearest_point():
    rng = np.random.default_rng(6)
    u, v = (side.ravel() for side in np.meshgrid(np.linspace(0, 1, 300), np.linspace(0, 1, 300)))
    for _ in range(20):
        a, b, c, x = rng.normal(size=(4, 3))
        triangle = fs.Triangle(a, b, c)
        row = fs.Field(triangle, fs.Gaussian()).at(0.0).elements.rows
        nearest = np.linalg.norm(samples(triangle, u, v) - x, axis=1).min()
        # The grid's points are a hundredth apart, and so miss the nearest by 1e-4 or so.
        assert nearest - 1e-3 < fs.Triangle.distance(*x, row, 0) <= nearest + 1e-12


def test_a_moving_triangle_carries_and_a_turning_plane_is_refused():
    world = fs.World()
    lift = fs.Keyframes([0.0, 1.0], [(0, 0, 0), (0, 0, 1.0)], interpolation="linear")
    skeleton = fs.rectangle((0, 0, 0), (2, 0, 0), (0, 2, 0))
    world.add_body(fs.Body(skeleton, surface=thin(fs.Gaussian), motion=lift))
    world.add_particles([(0.3, 0.2, 0.5)], [(0, 0, 0)], radius=BALL, contact=fs.Bounce(0.0))
    simulation = fs.Simulation(world, fs.Leapfrog(5e-3), threads=1)
    simulation.advance(0.8)
    np.testing.assert_allclose(simulation.velocities[0], [[0, 0, 1.0]], atol=1e-9)
    np.testing.assert_allclose(simulation.positions[0], [[0.3, 0.2, 0.8 + WALL + BALL]], atol=1e-6)
    turning = fs.World()
    turning.add_body(fs.Body(fs.Plane((0, 0, 0), (0, 0, 1)), surface=thin(fs.Gaussian), motion=fs.Spin((1, 0, 0))))
    turning.add_particles([(0, 0, 1.0)], [(0, 0, 0)], contact=fs.Bounce())
    with pytest.raises(fs.InputError, match="Plane that turns"):
        fs.Simulation(turning, fs.Leapfrog(5e-3)).advance(1.0)


@pytest.mark.parametrize("surface", [fs.Material(level=1.25), fs.Material(kernel=fs.Newtonian, radius=0.4)])
def test_balls_bounce_on_equipotentials(surface):
    # Elastic bounces on the field's own level, under the field's own pull: energy is kept as in free motion.
    world = fs.World()
    wire = fs.Segment((-0.5, 0, 0), (0.5, 0, 0))
    body = world.add_body(fs.Body(wire, gravity=fs.Newtonian(), surface=surface))
    start = 1.5 * directions(30, seed=8)
    world.add_particles(start, np.zeros((30, 3)), radius=BALL, contact=fs.Bounce(1.0))
    simulation = fs.Simulation(world, fs.Leapfrog(2e-3), threads=1)
    before = fs.energy(simulation.snapshot()).total
    simulation.advance(4.0)
    events = simulation.events
    assert len(np.unique(events.particles)) == 30
    np.testing.assert_allclose(body.surface_field().value(events.positions), 1.0, atol=1e-7)
    np.testing.assert_allclose(fs.energy(simulation.snapshot()).total, before, atol=2e-5)
    assert (body.surface_field().value(simulation.positions[0]) < 1.0).all()


@pytest.mark.parametrize("kernel", [fs.Quartic, fs.SoftObject, fs.Metaball])
def test_balls_bounce_off_kernels_that_end(kernel):
    """The field is 0 at the centre of a ball that touches; its nearest surface is found all the same."""
    world = fs.World()
    world.add_body(fs.Body(fs.Point((0, 0, 0)), surface=fs.Material(radius=0.3, kernel=kernel)))
    world.add_particles([(2.0, 0.5, 0)], [(-1.0, 0, 0)], radius=0.9, contact=fs.Bounce(1.0))
    simulation = fs.Simulation(world, fs.Leapfrog(0.05))
    simulation.advance(3.0)
    across = np.array([np.sqrt(1.2**2 - 0.5**2), 0.5, 0.0]) / 1.2
    assert simulation.bounces == 1
    assert simulation.events.times[0] == pytest.approx(2.0 - 1.2 * across[0], abs=1e-9)
    np.testing.assert_allclose(simulation.events.positions[0], 0.3 * across, atol=1e-9)
    np.testing.assert_allclose(simulation.velocities[0][0], [-1.0, 0, 0] + 2.0 * across[0] * across, atol=1e-9)


def test_balls_bounce_off_the_tip_of_a_spindle():
    """Its profile, and so its field, is 0 at the tip and beyond."""
    world = fs.World()
    spindle = fs.profiled(fs.Segment((-1, 0, 0), (1, 0, 0)), fs.profile.hat(0.0, 1.0))
    body = world.add_body(fs.Body(spindle, surface=fs.Material(radius=0.25)))
    world.add_particles([(3.0, 0, 0)], [(-1.0, 0, 0)], radius=1.0, contact=fs.Bounce(1.0))
    simulation = fs.Simulation(world, fs.Leapfrog(0.01), threads=1)
    simulation.advance(2.5)
    assert simulation.bounces == 1
    tip = simulation.events.positions[0, 0]
    assert body.surface_field().value((tip, 0, 0)) == pytest.approx(1.0, abs=1e-8)
    assert simulation.positions[0][0, 0] == pytest.approx(1.0 + tip + 2.5 - (2.0 - tip), abs=1e-8)


def test_what_spins_by_half_a_turn_in_a_step_is_refused():
    for rate, fails in ((300.0, False), (320.0, True)):
        world = fs.World()
        wire = fs.Segment((0.2, 0, 0), (1, 0, 0))
        world.add_body(fs.Body(wire, surface=fs.Material(radius=0.2), motion=fs.Spin(rate=rate), name="fan"))
        world.add_particles([(3.0, 0, 0)], [(0, 0, 0)], radius=0.1, contact=fs.Bounce(1.0))
        simulation = fs.Simulation(world, fs.Leapfrog(0.01))
        if fails:
            with pytest.raises(fs.InputError, match=r"Body 0 \(fan\) spins by 0.509 turns in a step of 0.01"):
                simulation.advance(0.05)
        else:
            simulation.advance(0.05)


@pytest.mark.parametrize("radius", [0.02, 0.3])
def test_a_ball_that_falls_on_a_crease_touches_it_on_time_and_rises_from_it(radius):
    """The nearest point is the crease's own as long as the centre is between the normals of its two sides."""
    body = fs.Body(
        fs.profiled(fs.Segment((-1, 0, 0), (1, 0, 0)), TURN), surface=fs.Material(radius=0.2, blobbiness=-2.0)
    )
    field = body.surface_field()
    top = 0.2
    for _ in range(50):
        top -= math.log(field.value((0, 0, top))) * field.value((0, 0, top)) / field.gradient((0, 0, top))[2]
    side = -field.gradient((1e-9, 0, top))
    half = math.atan2(side[0], side[2])
    assert half > 0.01
    aside = radius * math.sin(half) * np.array([-0.99, -0.5, -1e-3, -1e-6, 0.0, 1e-9, 1e-4, 0.03, 0.2, 0.7, 0.99])
    world = fs.World()
    world.add_body(body)
    world.add_body(fs.Body(fs.Point((0, 0, -1e6)), gravity=fs.Newtonian(), mass=1e12))
    start = np.column_stack([aside, 0.0 * aside, np.full(len(aside), 0.9)])
    world.add_particles(start, np.zeros_like(start), radius=radius, contact=fs.Bounce(1.0))
    simulation = fs.Simulation(world, fs.Leapfrog(1e-3), threads=1)
    simulation.advance(1.3)
    events = simulation.events
    assert len(events) == len(aside)
    order = np.argsort(events.particles)
    normals = np.column_stack([aside / radius, 0.0 * aside, np.sqrt(1.0 - (aside / radius) ** 2)])
    touched = np.sqrt(2.0 * (0.9 - top - radius * normals[:, 2]))
    np.testing.assert_allclose(events.times[order], touched, rtol=3e-6)
    np.testing.assert_allclose(events.positions[order], [(0.0, 0.0, top)] * len(aside), atol=1e-10)
    speeds = np.linalg.norm(events.impulses[order], axis=1)
    np.testing.assert_allclose(events.impulses[order], speeds[:, None] * normals, atol=1e-7)
    np.testing.assert_allclose(speeds, 2.0 * touched * normals[:, 2], rtol=3e-6)
