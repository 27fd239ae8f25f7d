"""MuJoCo models that move in fields: energy, order of convergence, contact with analytic surfaces."""

import warnings

import mujoco
import numpy as np
import pytest

import fieldsim as fs

DONUT = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)
PLANET = fs.Body(DONUT, gravity=fs.Newtonian(), mass=1.0, surface=fs.Material(radius=0.25, blobbiness=-8.0))
# Six equal points on the axes: for MuJoCo a mass with an inertia, for our own simulation a skeleton.
REACH = np.array([0.3, 0.2, 0.1])
INERTIA = (REACH**2 / 3).sum() - REACH**2 / 3
START = fs.Pose((2.2, 0.0, 0.4), (0.9, 0.2, 0.3, 0.1))
VELOCITY, SPIN = (0.1, 0.55, 0.2), np.array([0.3, 0.5, -0.2])


def free_body(timestep, integrator="RK4", position=START.position, velocity=VELOCITY):
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 0" integrator="{integrator}" timestep="{timestep!r}"/><worldbody>'
        f'<body pos="{numbers(position)}" quat="{numbers(START.rotation)}"><freejoint/>'
        f'<inertial pos="0 0 0" mass="1" diaginertia="{numbers(INERTIA)}"/></body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    data.qvel[:] = *velocity, *SPIN
    return model, data


# Before version 4 (seen in 3.3) MuJoCo's RK4 adds up the stages' rates of turning as if turns commuted: order 2.
TURNS_WELL = int(mujoco.__version__.split(".")[0]) >= 4

# Far enough from the ring for a calm orbit.
CALM = {"position": (3.0, 0.0, 0.4), "velocity": (0.0, 0.56, 0.1)}


def numbers(values):
    return " ".join(repr(float(value)) for value in values)


def our_own(until):
    """The same body in our own simulation: a splitting of order 6 with steps that leave no error to see."""
    points = [fs.Point(tuple(side * row)) for row in np.diag(REACH) for side in (1, -1)]
    spin = tuple((START.matrix @ SPIN).tolist())
    world = fs.World()
    world.add_body(PLANET)
    motion = fs.Rigid(START.position, START.rotation, velocity=VELOCITY, angular_velocity=spin)
    world.add_body(fs.Body(points, mass=1.0, motion=motion))
    simulation = fs.Simulation(world, fs.BlanesMoan6(dt=5e-3))
    simulation.advance(until)
    return simulation.snapshot().poses[1]


def test_it_converges_to_our_own_rigid_body_at_order_four():
    until = 4.0
    pose = our_own(until)
    errors = []
    for steps in (64, 128, 256):
        model, data = free_body(until / steps)
        with fs.mujoco.FieldForces(model, data, PLANET, accuracy="points"):
            mujoco.mj_step(model, data, steps)
        side = np.sign(data.qpos[3:] @ pose.rotation)
        errors.append((np.abs(data.qpos[:3] - pose.position).max(), np.abs(side * data.qpos[3:] - pose.rotation).max()))
    errors = np.array(errors)
    slopes = np.log2(errors[:-1] / errors[1:])
    if TURNS_WELL:
        assert slopes == pytest.approx(4.0, abs=0.2)
        assert errors[-1].max() < 1e-10
    else:
        assert slopes == pytest.approx(2.0, abs=0.2)
        assert errors[-1].max() < 1e-5


def test_an_orbit_keeps_its_energy():
    """To RK4's error, which at thousands of steps to a turn is rounding; the body is large: its tumbling counts."""
    model, data = free_body(5e-3, **CALM)
    with fs.mujoco.FieldForces(model, data, PLANET, accuracy="points") as forces:
        start = forces.energy()
        found = []
        for _ in range(40):
            mujoco.mj_step(model, data, 200)
            found.append(forces.energy().total)
    assert start.kinetic == pytest.approx(
        0.5 * np.dot(CALM["velocity"], CALM["velocity"]) + 0.5 * SPIN @ (INERTIA * SPIN)
    )
    assert np.abs(np.array(found) - start.total).max() < (1e-12 if TURNS_WELL else 1e-8)


def test_a_spinning_source_keeps_jacobis_integral():
    """A native step sees the turning cross at every stage: energy minus rate times angular momentum stays."""
    rate = 0.7
    cross = [fs.Segment((-1, 0, 0), (1, 0, 0)), fs.Segment((0, -1, 0), (0, 1, 0))]
    spinning = fs.Body(cross, gravity=fs.Newtonian(), motion=fs.Spin(rate=rate))
    model, data = free_body(5e-3, **CALM)

    def integral(forces):
        spun = np.cross(data.qpos[:3], data.qvel[:3])[2]
        turn = np.empty(9)
        mujoco.mju_quat2Mat(turn, data.qpos[3:])
        spun += (turn.reshape(3, 3) @ (INERTIA * data.qvel[3:]))[2]
        return forces.energy().total - rate * spun

    with fs.mujoco.FieldForces(model, data, spinning, accuracy="points") as forces:
        start = integral(forces)
        energy = forces.energy().total
        mujoco.mj_step(model, data, 2000)
        assert abs(integral(forces) - start) < (1e-12 if TURNS_WELL else 1e-8)
        assert abs(forces.energy().total - energy) > 1e-4, "the energy alone is not kept"


def test_springs_and_gravity_count_in_the_energy():
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option gravity="0 0 -1" integrator="RK4" timestep="0.002"/><worldbody><body pos="0 0 2">'
        '<joint type="slide" axis="0 0 1" stiffness="3"/><joint axis="0 1 0" stiffness="0.5" springref="20"/>'
        '<geom type="capsule" fromto="0 0 0 0.5 0 0" size="0.05"/></body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    with fs.mujoco.FieldForces(model, data, PLANET, keep_gravity=True, accuracy="points") as forces:
        start = forces.energy()
        mujoco.mj_step(model, data, 500)
        end = forces.energy()
    assert abs(end.kinetic - start.kinetic) > 1e-2
    assert end.total == pytest.approx(start.total, abs=1e-9)
    assert end.total == end.kinetic + end.potential


# Contact by a potential


def surface_height():
    """Of the donut's surface over its ring."""
    field = PLANET.surface_field()
    low, high = 0.2, 0.3
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if field.value((0.0, 1.0, middle)) > 1.0 else (low, middle)
    return low


def contacts(bodies, law, timestep=5e-4, options=""):
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 0" integrator="RK4" timestep="{timestep}" {options}/>'
        f'<default><geom contype="1" conaffinity="1"/></default><worldbody>{bodies}</worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    return model, data, fs.mujoco.FieldForces(model, data, PLANET, contact=law, accuracy="points")


GENTLE = fs.mujoco.Contact(speed=0.5, depth=0.04)
LOSSY = fs.mujoco.Contact(speed=0.5, depth=0.04, damping=2.0, friction=0.5)


def test_a_ball_rests_at_the_analytic_height():
    ball = '<body pos="0 1 0.3005"><joint type="slide" axis="0 0 1"/><geom size="0.05"/></body>'
    model, data, forces = contacts(ball, LOSSY)
    with forces:
        mujoco.mj_step(model, data, 8000)
    assert abs(data.qvel[0]) < 1e-3
    assert data.xpos[1, 2] == pytest.approx(surface_height() + 0.05, rel=1e-3)


SHAPES = {
    "sphere": 'type="sphere" size="0.05"',
    "ellipsoid": 'type="ellipsoid" size="0.08 0.05 0.03"',
    "capsule": 'type="capsule" size="0.03 0.06"',
    "box": 'type="box" size="0.06 0.05 0.03"',
    "cylinder": 'type="cylinder" size="0.05 0.03"',
}


@pytest.mark.parametrize("shape", SHAPES)
def test_bounces_keep_the_energy(shape):
    body = f'<body pos="0.03 1.02 0.38" euler="10 25 40"><freejoint/><geom {SHAPES[shape]}/></body>'
    model, data, forces = contacts(body, GENTLE, timestep=1e-4)
    energies, touched = [], 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with forces:
            start = forces.energy().total
            for _ in range(350):
                mujoco.mj_step(model, data, 40)
                energies.append(forces.energy().total)
                touched = max(touched, forces.energy().contact)
    kinetic = 0.5 * model.body_mass[1] * 0.5**2
    assert touched > 0.05 * kinetic, "it bounced"
    assert np.abs(np.array(energies) - start).max() < 1e-4 * kinetic


@pytest.mark.parametrize("shape", ['type="box" size="0.05 0.1 0.1"', 'type="capsule" size="0.05 0.1"'])
def test_a_round_surface_is_felt_between_the_points(shape):
    """The tube's crest, 0.004 within a side, off its middle: where points were 0.1 apart they would be clear of it."""
    field = PLANET.surface_field()
    crest = next(x for x in np.arange(1.2, 1.3, 1e-4) if field.value((x, 0.0, 0.0)) < 1.0)
    body = f'<body pos="{crest - 0.004 + 0.05} 0 0.05"><freejoint/><geom {shape}/></body>'
    _, _, forces = contacts(body, GENTLE)
    with forces:
        assert forces.energy().contact > 0.0


def test_damping_and_friction_only_take():
    """A sliding ball begins to roll: friction turns 2/7 of its energy into heat, and stops."""
    ball = '<body pos="1.2999 0 0"><freejoint/><geom size="0.05"/></body>'
    model, data, forces = contacts(ball, fs.mujoco.Contact(speed=0.3, depth=0.04, damping=1.0, friction=0.3))
    data.qvel[1] = 0.2
    with forces:
        totals = [forces.energy().total]
        for _ in range(30):
            mujoco.mj_step(model, data, 100)
            totals.append(forces.energy().total)
    assert np.diff(totals).max() < 1e-6 * abs(totals[0])
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, data.qpos[3:])
    spin = turn.reshape(3, 3) @ data.qvel[3:]
    outward = np.append(data.qpos[:2] / np.linalg.norm(data.qpos[:2]), 0.0)
    slip = data.qvel[:3] + np.cross(spin, -0.05 * outward)
    assert np.linalg.norm(data.qvel[:3]) == pytest.approx(0.2 * 5 / 7, rel=0.02)
    slip -= (slip @ outward) * outward
    assert np.linalg.norm(slip) < 5e-3


def test_a_spinning_planet_drags_along():
    spinning = fs.Body(DONUT, gravity=fs.Newtonian(), surface=PLANET.surface, motion=fs.Spin(rate=0.2))
    puck = '<body pos="1.281 0 0"><freejoint/><geom type="box" size="0.03 0.06 0.06"/></body>'
    model, data, _ = contacts(puck, LOSSY)
    with fs.mujoco.FieldForces(model, data, spinning, contact=LOSSY):
        mujoco.mj_step(model, data, 8000)
    radius = np.linalg.norm(data.qpos[:2])
    around = np.array([-data.qpos[1], data.qpos[0]]) / radius
    assert data.qvel[:2] @ around == pytest.approx(0.2 * radius, rel=0.02)


@pytest.mark.parametrize("known_to_python_only", [False, True])
def test_friction_is_against_the_ground_as_it_moves(known_to_python_only):
    """A planet that turns about a centre of no symmetry pushes a ball at rest the way the surface under it goes."""
    spin = fs.Spin(rate=0.4, center=(0.5, 0.3, 0.0))
    motion = (lambda time: spin(time)) if known_to_python_only else spin
    planet = fs.Body(DONUT, gravity=fs.Newtonian(), surface=PLANET.surface, motion=motion)
    model, data, _ = contacts('<body pos="0 1 0.299"><freejoint/><geom size="0.05"/></body>', GENTLE)
    rough = fs.mujoco.Contact(speed=0.5, depth=0.04, friction=0.5)
    elastic, with_friction, pull = (
        fs.mujoco.FieldForces(model, data, planet, contact=law).wrenches()[0][0] for law in (GENTLE, rough, None)
    )
    normal = (elastic - pull) / np.linalg.norm(elastic - pull)
    under = np.array([0.0, 1.0, 0.299]) - 0.05 * normal
    ground = np.cross((0.0, 0.0, 0.4), under - spin.center)
    ground -= (ground @ normal) * normal
    friction = with_friction - elastic
    # The difference in time that Python's motions take errs by 1e-10 of the turn.
    np.testing.assert_allclose(friction / np.linalg.norm(friction), ground / np.linalg.norm(ground), atol=1e-7)
    assert np.linalg.norm(friction) == pytest.approx(0.5 * np.linalg.norm(elastic - pull), rel=1e-9)


def test_a_ball_falls_through_the_hole():
    model, data, forces = contacts('<body pos="0.01 0 1.2"><freejoint/><geom size="0.05"/></body>', GENTLE)
    heights = []
    with forces:
        for _ in range(60):
            mujoco.mj_step(model, data, 200)
            heights.append(data.qpos[2])
            assert forces.energy().contact == 0.0
    assert min(heights) < -1.0


def test_large_balls_find_where_they_touch():
    """A ball wider than the hole sits on its rim, where the gradient at its centre points nowhere near."""
    _, data, forces = contacts('<body pos="0 0 1.2"><freejoint/><geom size="0.9"/></body>', GENTLE)
    with forces:
        assert forces.energy().contact == 0.0
        data.qpos[2] = 0.4
        assert forces.energy().contact > 0.0


def test_long_steps_are_warned_of():
    model, data, forces = contacts('<body pos="2 0 0"><freejoint/><geom size="0.05"/></body>', GENTLE, timestep=0.01)
    with pytest.warns(fs.FieldsimWarning, match="timestep of 0.01 is too long for body 1"), forces:
        pass
    assert model.opt.timestep == 0.01
    del data
