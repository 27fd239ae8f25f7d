"""Free bodies in motion: what they keep, order, known motions, forces from one energy, and particles that feel them."""

import math

import mpmath
import numpy as np
import pytest
import warp as wp

import fieldsim as fs
from fieldsim.dynamics import simulation as module
from fieldsim.dynamics.rigid.bodies import FreeBodies
from fieldsim.dynamics.rigid.diagnostics import body_angular_momentum, body_energy, body_momentum
from fieldsim.dynamics.rigid.diagnostics import wrenches as wrenches_of
from fieldsim.dynamics.rigid.kernel import energy_kernel, rigid_kernel
from fieldsim.filming import pipeline
from fieldsim.numerics.quaternion import product

ROD = fs.Segment((-1, 0, 0), (1, 0, 0))
ORIGIN = fs.Point((0, 0, 0))
BRICK = np.diag([1.0, 1.6, 2.0])


def world_of(*bodies):
    world = fs.World()
    for body in bodies:
        world.add_body(body)
    return world


def rod_and_bent_rod(surface=None, speed=0.4, **motion):
    """Two rods at skew, one with an inertia of its own, that pull each other."""
    one = fs.Rigid((1.5, 0, 0), velocity=(0, speed, 0.1), angular_velocity=(0.3, 0.5, 1.0), inertia=BRICK, **motion)
    turn = fs.Pose.turned((1, 2, 3), 1.0).rotation
    two = fs.Rigid(
        (-1.5, 0, 0.2), turn, velocity=(0, -speed, 0.3), angular_velocity=(0.3, 0, 1), inertia=BRICK, **motion
    )
    law = fs.Newtonian(softening=0.3)
    bent = [ROD, fs.Segment((1, 0, 0), (1, 1, 0))]
    return world_of(
        fs.Body(ROD, gravity=law, mass=1.0, motion=one, surface=surface),
        fs.Body(bent, gravity=law, mass=0.7, motion=two, surface=surface, name="bent"),
    )


def kept(bodies):
    """Momentum and angular momentum of all, (6,)."""
    return np.concatenate([body_momentum(bodies).sum(axis=0), body_angular_momentum(bodies).sum(axis=0)])


def test_torque_free_motion_keeps_energy_and_angular_momentum():
    spin = (1e-3, 1.0, 1e-3)  # about the middle axis: it flips over and over
    world = world_of(fs.Body(ORIGIN, motion=fs.Rigid(velocity=(1, 2, 3), angular_velocity=spin, inertia=BRICK)))
    simulation = fs.Simulation(world, fs.Leapfrog(0.1))
    start, turning = body_energy(simulation.bodies), simulation.bodies.spins
    upright = []
    for time in (*range(0, 40, 2), 2000.0):
        simulation.advance(time)
        upright.append(simulation.snapshot().poses[0].matrix[1, 1])
    end = body_energy(simulation.bodies)
    np.testing.assert_allclose(end.rotation, start.rotation, rtol=2e-14)
    np.testing.assert_array_equal(simulation.bodies.spins, turning)
    np.testing.assert_allclose(simulation.bodies.centers, [(2000.0, 4000.0, 6000.0)], rtol=1e-15)
    assert min(upright) < -0.99


def test_pairs_keep_momentum_and_angular_momentum_and_their_energy_swings_with_dt_squared():
    swings = []
    for dt in (0.04, 0.02, 0.01):
        simulation = fs.Simulation(rod_and_bent_rod(), fs.Leapfrog(dt))
        energy, start = body_energy(simulation.bodies).total, kept(simulation.bodies)
        drift = 0.0
        for time in np.arange(0.5, 15.1, 0.5):
            simulation.advance(time)
            np.testing.assert_allclose(kept(simulation.bodies), start, atol=1e-13)
            drift = max(drift, abs(body_energy(simulation.bodies).total - energy))
        swings.append(drift)
    np.testing.assert_allclose(np.log2(np.divide(swings[:-1], swings[1:])), 2.0, atol=0.2)
    assert swings[-1] < 1e-5 * abs(energy)


@pytest.mark.parametrize(("method", "order"), [(fs.Leapfrog(), 2), (fs.Suzuki4(), 4)], ids=["leapfrog", "suzuki"])
def test_order(method, order):
    def end(steps):
        bodies = FreeBodies(rod_and_bent_rod(), 0.0)
        bodies.leap(np.linspace(0.0, 4.0, steps * len(method.drifts) + 1), 4.0 / steps, method)
        return np.concatenate([bodies.centers.ravel(), *(p.rotation for p in bodies.present.values())])

    fine = [end(steps) for steps in (40, 80, 160, 1600)]
    errors = [np.abs(one - fine[-1]).max() for one in fine[:-1]]
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), order, atol=0.2)


def test_forces_and_torques_are_derivatives_of_the_energy():
    """In gravity and in contact, of a prescribed body and of another free one."""
    skin = fs.Material(radius=0.3)
    world = rod_and_bent_rod(surface=skin, stiffness=3.0)
    world.add_body(fs.Body(ORIGIN, gravity=fs.Newtonian(0.3), mass=2.0, surface=fs.Material(radius=0.2)))
    bodies = FreeBodies(world, 0.0)
    turns = bodies.state.q.numpy().copy()
    places = np.array([(0.5, 0.35, 0.2), (-0.3, -0.2, 0.4)])  # now all overlap

    def energy(b, shift, turn):
        x = places.copy()
        x[b] += shift
        q = turns.copy()
        q[b] = small_turn(turn, q[b])
        bodies.state.x = wp.array(x, dtype=wp.vec3d, device="cpu")
        bodies.state.q = wp.array(q, dtype=wp.quatd, device="cpu")
        return bodies.potential_energy()

    energy(0, 0.0, np.zeros(3))
    found = bodies.state.force.numpy().copy(), bodies.state.torque.numpy().copy()
    for b in range(2):
        for axis in np.eye(3):
            for k, kinds in enumerate([(1e-5 * axis, np.zeros(3)), (np.zeros(3), 1e-5 * axis)]):
                rise = energy(b, *kinds) - energy(b, *(-part for part in kinds))
                # The central difference errs by h^2 times third derivatives of a stiff contact.
                assert rise / 2e-5 == pytest.approx(-(found[k][b] @ axis), abs=2e-6 * np.abs(found).max())
    energy(0, 0.0, np.zeros(3))
    wrenches = wrenches_of(bodies)
    np.testing.assert_allclose(wrenches.forces.sum(axis=0), found[0], atol=1e-12)
    np.testing.assert_allclose(wrenches.torques.sum(axis=0), found[1], atol=1e-12)
    np.testing.assert_allclose(wrenches.forces[0, 1], -wrenches.forces[1, 0], atol=1e-12)
    assert np.abs(wrenches.forces[2]).max() > 0.0


def small_turn(vector, q):
    """Turn a quaternion (x, y, z, w) by a small rotation vector in the world's frame."""
    x, y, z, w = q
    turned = product((1.0, *(0.5 * vector)), (w, x, y, z))
    turned /= np.linalg.norm(turned)
    return turned[[1, 2, 3, 0]]


def test_a_pendulum_swings_with_the_analytic_period():
    """In an even field, about a centre of mass that is not the mean of what is pulled: I a'' = -m g d sin a."""
    far, d, g, swing = 1e9, 0.5, 2.0, 1.0
    sky = fs.Body(fs.Point((0, 0, -far)), gravity=fs.Newtonian(), mass=g * far**2)
    turn = fs.Pose.turned((0, 1, 0), math.pi / 2 - swing)  # the bob hangs along x in the body's frame
    motion = fs.Rigid(rotation=turn.rotation, center=(0, 0, 0), inertia=np.diag([0.2, 0.3, 0.3]), mass=1.0)
    simulation = fs.Simulation(world_of(sky, fs.Body(fs.Point((d, 0, 0)), motion=motion)), fs.Leapfrog(1e-3))
    period = 4 * math.sqrt(0.3 / (g * d)) * float(mpmath.ellipk(math.sin(swing / 2) ** 2))
    simulation.advance(period / 2)
    x = np.array(simulation.snapshot().poses[1].matrix[:, 0])
    np.testing.assert_allclose(x, (-math.sin(swing), 0, -math.cos(swing)), atol=1e-6)
    simulation.advance(period)
    pose = simulation.snapshot().poses[1]
    np.testing.assert_allclose(pose.matrix, turn.matrix, atol=1e-5)
    np.testing.assert_allclose(pose.position, (0, 0, -0.5 * g * period**2), rtol=1e-6, atol=1e-6)


def test_the_tide_swings_a_rod_on_a_circular_orbit():
    """Small librations about the direction to the centre: frequency sqrt(3) n (gravity-gradient stabilisation)."""
    r, small = 1000.0, 1e-3
    n = math.sqrt(1.0 / r**3)
    motion = fs.Rigid(
        (r, 0, 0),
        fs.Pose.turned((0, 0, 1), small).rotation,
        velocity=(0, n * r, 0),
        angular_velocity=(0, 0, n),
    )
    world = world_of(fs.Body(ORIGIN, gravity=fs.Newtonian(0.3)), fs.Body(ROD, motion=motion))
    simulation = fs.Simulation(world, fs.Leapfrog(2 * math.pi / n / 2000))
    for quarter in (0.5, 1.0, 1.5):
        time = quarter * 2 * math.pi / (math.sqrt(3.0) * n)
        simulation.advance(time)
        along = simulation.snapshot().poses[1].matrix[:, 0]
        out = simulation.bodies.centers[0] / np.linalg.norm(simulation.bodies.centers[0])
        angle = np.cross(out, along)[2]
        # The rod's size over the distance, squared, puts its orbit off by some 1e-6.
        assert angle == pytest.approx(small * math.cos(2 * math.pi * quarter), abs=2e-3 * small)


def test_a_rod_and_a_point_turn_about_each_other_as_one():
    """The relative equilibrium in line: omega^2 = G (M + m) / (r (r^2 - l^2)), half length l."""
    r, heavy, light = 3.0, 1.0, 0.4
    omega = math.sqrt((heavy + light) / (r * (r * r - 1.0)))
    total = heavy + light
    one = fs.Rigid(
        (-r * light / total, 0, 0), velocity=(0, -omega * r * light / total, 0), angular_velocity=(0, 0, omega)
    )
    two = fs.Rigid((r * heavy / total, 0, 0), velocity=(0, omega * r * heavy / total, 0))
    law = fs.Newtonian()
    world = world_of(
        fs.Body(ROD, gravity=law, mass=heavy, motion=one), fs.Body(ORIGIN, gravity=law, mass=light, motion=two)
    )
    period = 2 * math.pi / omega
    simulation = fs.Simulation(world, fs.Leapfrog(period / 4000))
    simulation.advance(period)
    # Leapfrog's error is of second order in 2 pi / 4000: 2.5e-6 times the turn and the distance.
    np.testing.assert_allclose(simulation.bodies.centers, [one.position, two.position], atol=5e-5)
    np.testing.assert_allclose(simulation.snapshot().poses[0].matrix, np.eye(3), atol=5e-5)


def test_particles_feel_free_bodies_where_they_are_at_every_stage():
    """A particle that falls with a free body stays with it, as it would by a body at rest."""
    away, v = (0.9, 0.3, 0.2), (0.1, 0.8, 0.4)
    still = world_of(fs.Body(ROD, gravity=fs.Newtonian()))
    still.add_particles([away], [v])
    moving = world_of(
        fs.Body(ROD, gravity=fs.Newtonian(), motion=fs.Rigid(velocity=(3, -2, 1))),
    )
    moving.add_particles([away], [np.add(v, (3, -2, 1))])
    ends = []
    for world in (still, moving):
        simulation = fs.Simulation(world, fs.Leapfrog(1e-3))
        simulation.advance(3.0)
        ends.append(simulation.positions[0][0])
    np.testing.assert_allclose(ends[1] - (9.0, -6.0, 3.0), ends[0], atol=1e-10)
    snapshot = simulation.snapshot()
    np.testing.assert_allclose(snapshot.poses[0].position, (9.0, -6.0, 3.0), atol=1e-12)
    kinetic, potential = fs.energy(snapshot).kinetic[0], fs.energy(snapshot).potential[0]
    assert potential == pytest.approx(-fs.gravity(ROD, 1.0).value(ends[0]), rel=1e-9)
    assert kinetic == pytest.approx(0.5 * np.sum(simulation.velocities[0] ** 2))


def test_particles_bounce_on_free_bodies():
    """As on one whose motion is given."""
    skin, pull, move = fs.Material(radius=0.3), fs.Newtonian(0.3), np.array([2.0, -1.0, 0.5])
    ends = []
    for motion in (fs.Keyframes([0, 4], [(0, 0, 0), 4 * move], interpolation="linear"), fs.Rigid(velocity=tuple(move))):
        world = world_of(fs.Body(ROD, gravity=pull, surface=skin, motion=motion))
        world.add_particles([(0.3, 0.2, 1.2)], [move], radius=0.05, contact=fs.Bounce(0.9))
        simulation = fs.Simulation(world, fs.Leapfrog(1e-3))
        simulation.advance(2.5)
        assert simulation.bounces == 1
        ends.append(simulation.positions[0])
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-9)  # rounding, amplified by the bounce


def test_between_stages_bodies_are_on_smooth_paths():
    bodies = FreeBodies(rod_and_bent_rod(), 0.0)
    bodies.leap(np.linspace(0.0, 0.4, 41), 0.01, fs.Leapfrog())
    found = [[a[k] for k in (1, 2)] for a in bodies.poses(1, np.array([0.2, 0.205, 0.2149]))]
    bodies.leap(np.array([0.4, 0.405]), 0.005, fs.Leapfrog())
    other = FreeBodies(rod_and_bent_rod(), 0.0)
    other.leap(np.linspace(0.0, 0.2, 21), 0.01, fs.Leapfrog())
    for k, more in enumerate((0.005, 0.0149)):
        other = FreeBodies(rod_and_bent_rod(), 0.0)
        other.leap(np.linspace(0.0, 0.2, 21), 0.01, fs.Leapfrog())
        other.leap(np.array([0.2, 0.2 + more]), more, fs.Leapfrog())
        rotations, positions = other.poses(1, np.array([0.2 + more]))
        # Of the step's third order: 1e-6 / 24 times accelerations below 1.
        np.testing.assert_allclose(found[0][k], rotations[0], atol=1e-6)
        np.testing.assert_allclose(found[1][k], positions[0], atol=1e-6)


def test_bodies_bounce_without_loss():
    skin = fs.Material(radius=0.3)
    drifts = []
    for dt in (4e-3, 2e-3):
        simulation = fs.Simulation(rod_and_bent_rod(surface=skin, speed=0.05, stiffness=3e4), fs.Leapfrog(dt))
        bodies = simulation.bodies
        energy, start, nearest, drift = body_energy(bodies).total, kept(bodies), 9.0, 0.0
        for time in np.arange(0.1, 8.05, 0.1):
            simulation.advance(time)
            drift = max(drift, abs(body_energy(bodies).total - energy))
            nearest = min(nearest, np.linalg.norm(bodies.centers[1] - bodies.centers[0]))
        np.testing.assert_allclose(kept(bodies), start, atol=1e-13)
        drifts.append(drift)
    assert nearest < 1.0
    assert drifts[1] < 1e-3 * abs(energy)
    assert drifts[1] < 0.4 * drifts[0]


def test_a_body_rests_on_what_it_fell_on_no_deeper_than_stated():
    """A ball bounces on the top of a ball planet as high as it came from."""
    planet = fs.Body(ORIGIN, gravity=fs.Newtonian(0.3), mass=4.0, surface=fs.Material(radius=1.0))
    ball = fs.Body(ORIGIN, mass=0.1, surface=fs.Material(radius=0.3), motion=fs.Rigid((0, 0, 2.0), inertia="solid"))
    simulation = fs.Simulation(world_of(planet, ball), fs.Leapfrog(1e-3))
    heights = []
    for time in np.arange(0.01, 3.0, 0.01):
        simulation.advance(time)
        heights.append(simulation.bodies.centers[0][2])
    # Stated: pressed in by no more than a tenth of its radius, plus what its points leave open, a fiftieth.
    assert 1.3 - 0.036 < min(heights) < 1.3
    bottom = int(np.argmin(heights))
    assert max(heights[bottom:]) == pytest.approx(2.0, abs=1e-3)
    np.testing.assert_allclose(simulation.bodies.centers[0][:2], 0.0, atol=0.02)


def test_surfaces_are_as_smooth_as_stated():
    """However a cigar is rolled, the same energy presses it into another equally deep, to a fiftieth of its radius."""
    ground = fs.Body(ROD, surface=fs.Material(radius=1.0))
    cigar = fs.Segment((-0.5, 0, 0), (0.5, 0, 0))
    motion = fs.Rigid((0, 0, 3.0), inertia="solid", stiffness=1.0)
    bodies = FreeBodies(world_of(ground, fs.Body(cigar, surface=fs.Material(radius=0.3), motion=motion)), 0.0)

    def energy(height, roll):
        turn = bodies.starts[0].turn
        q = product(turn, (math.cos(roll / 2), math.sin(roll / 2), 0, 0))  # the first principal axis lies along it
        bodies.state.q = wp.array([q[[1, 2, 3, 0]]], dtype=wp.quatd, device="cpu")
        bodies.state.x = wp.array([(0, 0, height)], dtype=wp.vec3d, device="cpu")
        return bodies.potential_energy()

    rolls = np.linspace(0.0, 2 * math.pi, 17)
    given = energy(1.27, 0.0)
    low, high = np.full(17, 1.2), np.full(17, 1.3)
    for _ in range(20):
        middle = 0.5 * (low + high)
        deep = np.array([energy(*pair) for pair in zip(middle, rolls, strict=True)]) > given
        low, high = np.where(deep, middle, low), np.where(deep, high, middle)
    np.testing.assert_allclose(low, low.mean(), atol=0.02 * 0.3)
    assert np.ptp(low) > 1e-6  # it did roll


def test_runs_do_not_depend_on_how_they_are_cut(monkeypatch):
    ends = []
    for steps in (256, 7):
        monkeypatch.setattr(module, "LAUNCH_STEPS", steps)
        simulation = fs.Simulation(rod_and_bent_rod(), fs.Leapfrog(0.01))
        simulation.advance(1.0)
        ends.append((simulation.bodies.centers.tobytes(), simulation.bodies.spins.tobytes()))
    assert ends[0] == ends[1]


def test_films_of_free_bodies_without_particles():
    world = world_of(fs.Body(ORIGIN, surface=fs.Material(), motion=fs.Rigid(velocity=(1, 0, 0))))
    scenario = fs.Scenario(world, fs.Camera(eye=(0, -5, 0), look_at=(0, 0, 0)), duration=1.0)
    moments = pipeline.snapshots(scenario, [0.0, 0.5], None, fs.Report("", (8, 8)))
    np.testing.assert_allclose([m.poses[0].position[0] for m in moments], [0.0, 0.5], atol=1e-14)


def test_bad_worlds_are_refused():
    skin = fs.Material(radius=0.3)
    near = fs.Rigid((0.4, 0, 0))
    world = world_of(fs.Body(ORIGIN, surface=skin, name="moon"), fs.Body(ORIGIN, surface=skin, motion=near))
    with pytest.raises(fs.InputError, match=r"Body 1 and Body 0 \(moon\) overlap at the start"):
        fs.Simulation(world)
    falling = world_of(fs.Body(ORIGIN, gravity=fs.Newtonian()), fs.Body(ORIGIN, motion=fs.Rigid((1e-3, 0, 0))))
    fast = fs.Body(ORIGIN, surface=skin, motion=fs.Rigid(velocity=(9, 0, 0)))
    fs.Simulation(world_of(fast), fs.Leapfrog(0.1)).advance(0.1)  # nothing to hit
    stiff = fs.Simulation(world_of(fast, fs.Body(fs.Point((0, 5, 0)), surface=skin)), fs.Leapfrog(0.1))
    with pytest.warns(fs.FieldsimWarning, match="give dt below"):
        stiff.advance(0.1)
    with pytest.raises(fs.InputError, match="without force gradients"):
        FreeBodies(falling, 0.0).leap(np.linspace(0.0, 1.0, len(fs.Chin4.drifts) + 1), 1.0, fs.Chin4())


def test_kernels_compile_for_cuda(compiles_for_cuda):
    kinds = FreeBodies(rod_and_bent_rod(surface=fs.Material(radius=0.3)), 0.0).kinds_used
    for kernel in (rigid_kernel(*kinds, lossy=True), energy_kernel(*kinds)):
        compiles_for_cuda(kernel.module)
