"""Contact of geoms of every shape with thin and thick planets: depths, forces, energy, grip, starts inside, cloth."""

import contextlib
import warnings

import mujoco
import numpy as np
import pytest

import fieldsim as fs

# Sources that touch, and next to do not pull.
FAINT = {"gravity": fs.Newtonian(1e-9), "mass": 1e-9}
CORNERS = "0.1 0 0 -0.08 0.02 0 0 0.12 0.03 0.02 -0.1 0.04 0 0 0.11 0.01 0.02 -0.09"
MESH = f'<mesh name="hull" vertex="{CORNERS}"/>'
GEOMS = {
    "sphere": 'type="sphere" size="0.1"',
    "large sphere": 'type="sphere" size="1.5"',
    "ellipsoid": 'type="ellipsoid" size="0.16 0.1 0.06"',
    "capsule": 'type="capsule" size="0.06 0.12"',
    "box": 'type="box" size="0.2 0.15 0.08"',
    "cylinder": 'type="cylinder" size="0.15 0.08"',
    "mesh": 'type="mesh" mesh="hull"',
}


def planet(primitive, radius, blobbiness=-4.0, motion=None, **material):
    surface = fs.Material(radius=radius, blobbiness=blobbiness, **material)
    # What has no end has no mass.
    faint = {} if isinstance(primitive, fs.Plane) else FAINT
    return fs.Body(primitive, surface=surface, **faint, **({"motion": motion} if motion else {}))


TIP = planet(fs.Segment((0.3, 0, -2), (0.3, 0, 0)), 0.05)
RING = planet(fs.Circle((0, 0, 0), (0, 0, 1), 1.0), 0.1, -8.0)
GROUND = planet(fs.Point((0, 0, -100)), 100.0)
# What touches: one thing alone, bodies of unlike radii, of which one turns.
WORLDS = {
    "tip": [TIP],
    "ring": [RING],
    "unlike": [TIP, RING, planet(fs.Point((0, 0, -5)), 4.9)],
    "compact": [planet(fs.Segment((-0.8, 0, 0), (0.8, 0.3, 0)), 0.15, kernel=fs.Metaball)],
    "turning": [planet(fs.Segment((-1, 0, 0), (1, 0.2, 0)), 0.12, motion=fs.Spin(rate=0.4, center=(0.3, 0.2, 0))), TIP],
}


def model_of(bodies, options="", more=""):
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 0" {options}/><asset>{MESH}</asset>'
        f"<worldbody>{bodies}</worldbody>{more}</mujoco>"
    )


def free(geom, place=(0, 0, 0), more=""):
    return f'<body pos="{place[0]} {place[1]} {place[2]}"><freejoint/><geom {geom} {more}/></body>'


def contact_of(geom, sources, law=None, native=False, **options):
    """Model, data and forces of one free geom, not entered: Python, which needs no compiling."""
    model = model_of(free(geom), **options)
    data = mujoco.MjData(model)
    law = law or fs.mujoco.Contact(1.0, depth=0.1)
    return model, data, fs.mujoco.FieldForces(model, data, sources, contact=law, native=native)


def moved(data, pose, k, step):
    """Set a free body's pose, moved along (k < 3) or turned about the axis k - 3 through its centre of mass."""
    data.qpos[:] = pose
    if k < 3:
        data.qpos[k] += step
        return
    model = data.model
    mujoco.mj_kinematics(model, data)
    center, turn, axis = data.xipos[1].copy(), np.empty(4), np.zeros(3)
    axis[k - 3] = 1.0
    mujoco.mju_axisAngle2Quat(turn, axis, step)
    mujoco.mju_mulQuat(data.qpos[3:], turn, pose[3:].copy())
    mujoco.mj_kinematics(model, data)
    data.qpos[:3] += center - data.xipos[1]


def slopes(forces, data, pose, step=1e-6):
    """Minus the gradient of the contact energy by the six ways to move a free body, from differences."""
    found = np.empty(6)
    for k in range(6):
        moved(data, pose, k, step)
        above = forces.energy().contact
        moved(data, pose, k, -step)
        found[k] = (forces.energy().contact - above) / (2 * step)
    data.qpos[:] = pose
    return found


@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize("geom", GEOMS)
def test_forces_are_gradients_of_the_energy(world, geom):
    """Wherever a geom touches: faces, edges, corners, several places at once, between bodies of unlike radii."""
    _, data, forces = contact_of(GEOMS[geom], WORLDS[world])
    data.time = 0.7
    rng = np.random.default_rng(sum(map(ord, world + geom)))
    for _ in range(2):
        pose = touching_pose(forces, data, rng)
        wrench = np.concatenate([part[0] for part in forces.wrenches()])
        assert np.abs(slopes(forces, data, pose) - wrench).max() < 1e-5 * np.abs(wrench).max()


def touching_pose(forces, data, rng, depth=0.004):
    """A pose anyhow turned, let down from above until it touches, and a little more."""
    while True:
        low, high = 0.0, 1.8
        data.qpos[:] = np.append(rng.uniform(-1.0, 1.0, 3), rng.normal(size=4))
        data.qpos[3:] /= np.linalg.norm(data.qpos[3:])
        data.qpos[2] = low
        if not forces.energy().contact > 0.0:
            continue
        for _ in range(16):
            data.qpos[2] = 0.5 * (low + high)
            low, high = (data.qpos[2], high) if forces.energy().contact > 0.0 else (low, data.qpos[2])
        data.qpos[2] = low - depth
        return data.qpos.copy()


def surface_over(body, x, y, low, high):
    """Height of a body's surface over (x, y), between two heights."""
    field = body.surface_field()
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if field.value((x, y, middle)) > 1.0 else (low, middle)
    return low


TOP = surface_over(TIP, 0.3, 0.0, 0.0, 0.06)


def energy_at(geom, place, turn=(1, 0, 0, 0), sources=(TIP,), law=None):
    _, data, forces = contact_of(geom, list(sources), law)
    data.qpos[:3], data.qpos[3:] = place, turn
    return forces.energy().contact, forces


def stored(law, mass, thickness, radius, depth):
    """stiffness depth^3 / 3."""
    return law.stiffness(mass, min(thickness, radius)) * depth**3 / 3


@pytest.mark.parametrize("aside", [(0.0, 0.0), (0.13, 0.12), (0.5, -0.7)])
@pytest.mark.parametrize(
    ("geom", "half"),
    [
        ('type="box" size="1 1 0.05"', 0.05),
        ('type="cylinder" size="1.2 0.05"', 0.05),
        ('type="mesh" mesh="plate"', 0.05),
    ],
)
def test_a_thin_tip_is_felt_anywhere_under_a_wide_face(geom, half, aside):
    plate = " ".join(f"{x} {y} {z}" for x in (-1, 1) for y in (-1, 1) for z in (-0.05, 0.05))
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 0"/><asset><mesh name="plate" vertex="{plate}"/></asset><worldbody>'
        f'<body pos="{0.3 + aside[0]} {aside[1]} {TOP + half - 0.004}"><freejoint/><geom {geom} mass="1"/></body>'
        "</worldbody></mujoco>"
    )
    law = fs.mujoco.Contact(1.0, depth=0.3)
    forces = fs.mujoco.FieldForces(model, mujoco.MjData(model), TIP, contact=law, native=False)
    assert forces.energy().contact == pytest.approx(stored(law, 1.0, 0.05, 0.05, 0.004), rel=1e-6)


@pytest.mark.parametrize("native", [False, True])
def test_edges_and_corners_and_rims_are_felt(native):
    """On the ring's crest, whose height is known, at places where no sample is."""
    law = fs.mujoco.Contact(1.0, depth=0.1)
    crest = surface_over(RING, 1.0, 0.0, 0.05, 0.15)
    eighth, half = np.pi / 8, np.sqrt(0.5)
    cases = {
        # A box's edge along x, across the tube; a face turned by an eighth; a corner; a cylinder's side, its rim.
        "edge": ('type="box" size="0.2 0.1 0.1"', (np.cos(eighth), np.sin(eighth), 0, 0), 0.1 * np.sqrt(2), 0.1),
        "face": ('type="box" size="0.2 0.2 0.1"', (np.cos(eighth), 0, 0, np.sin(eighth)), 0.1, 0.1),
        "side": ('type="cylinder" size="0.1 0.3"', (half, 0, half, 0), 0.1, 0.1),
        "rim": ('type="cylinder" size="0.1 0.1"', (np.cos(eighth), 0, np.sin(eighth), 0), 0.1 * np.sqrt(2), 0.1),
        "side of a capsule": ('type="capsule" size="0.1 0.3"', (half, 0, half, 0), 0.1, 0.1),
    }
    for name, (geom, turn, reach, thickness) in cases.items():
        model = model_of(free(geom, more='mass="1"'))
        data = mujoco.MjData(model)
        forces = fs.mujoco.FieldForces(model, data, RING, contact=law, native=native)
        data.qpos[:] = 1.0, 0.0, crest + reach - 0.003, *turn
        found = forces.energy().contact
        # The lowest place need not be over the crest, but next to it.
        assert found == pytest.approx(stored(law, 1.0, thickness, 0.1, 0.003), rel=0.02), name
        data.qpos[2] = crest + reach + 1e-5
        assert forces.energy().contact == 0.0, name


def test_what_stands_flat_is_held_by_all_its_corners():
    """A box level with a slab: four times one corner, and no torque; tilted, the lower corners push it back."""
    slab = planet(fs.Plane((0, 0, 0), (0, 0, 1)), 0.2)
    law = fs.mujoco.Contact(1.0, depth=0.1)
    energy, forces = energy_at('type="box" size="0.1 0.1 0.1" mass="1"', (0, 0, 0.298), sources=[slab], law=law)
    assert energy == pytest.approx(4 * stored(law, 1.0, 0.1, 0.2, 0.002), rel=1e-6)
    assert np.abs(forces.wrenches()[1]).max() < 1e-9 * np.abs(forces.wrenches()[0]).max()
    forces.data.qpos[3:] = np.cos(0.005), np.sin(0.005), 0, 0
    assert forces.wrenches()[1][0, 0] < -0.01 * np.abs(forces.wrenches()[0]).max()


def test_one_thing_on_two_tips_is_pushed_by_both():
    """Even where it is symmetrical, so that both are as deep."""
    tips = [TIP, planet(fs.Segment((-0.3, 0, -2), (-0.3, 0, 0)), 0.05)]
    law = fs.mujoco.Contact(1.0, depth=0.3)
    place = (0, 0, TOP + 0.05 - 0.004)
    for geom in ('type="box" size="1 1 0.05" mass="1"', 'type="cylinder" size="1 0.05" mass="1"'):
        energy, _ = energy_at(geom, place, sources=tips, law=law)
        assert energy == pytest.approx(2 * stored(law, 1.0, 0.05, 0.05, 0.004), rel=1e-6), geom


def test_a_ball_wider_than_the_hole_touches_all_around():
    """On the axis its centre is as far from all of the ring: it is held as by one place, without any push aside."""
    energy, forces = energy_at('type="sphere" size="1.0" mass="1"', (0, 0, 0.45), sources=[RING])
    assert energy > 0.0
    force = forces.wrenches()[0][0]
    assert force[2] > 0.0


def test_a_plate_over_a_ring_is_felt_where_it_is_lowest():
    """Whichever way it leans: also where the ring's place nearest to its centre is just the one that it is off."""
    _, data, forces = contact_of('type="box" size="1.3 1.3 0.05"', [RING])
    energies = []
    for turn in (0.0, 0.4, 1.0, np.pi / 2, 2.5):
        across, lean = np.array([np.cos(turn), np.sin(turn), 0.0]), 0.037
        data.qpos[:3] = -0.0017 * np.cross((0.0, 0.0, 1.0), across) + np.array([0.0, 0.0, 0.1134])
        data.qpos[3:] = [np.cos(-lean / 2), *(np.sin(-lean / 2) * across)]
        mujoco.mj_forward(forces.model, data)
        energies.append(forces.energy().contact)
    assert energies[0] > 0.0
    np.testing.assert_allclose(energies, energies[0], rtol=1e-6)


def test_bodies_of_unlike_radii_keep_their_own_stiffness():
    """A planet beside does not make a thin ring softer, nor the ring the planet harder."""
    thick = planet(fs.Point((0, 0, -5)), 2.0)
    for body, place in ((RING, (1.0, 0, 0.17)), (thick, (0, 0, -2.93))):
        alone, _ = energy_at('type="sphere" size="0.1"', place, sources=[body])
        beside, _ = energy_at('type="sphere" size="0.1"', place, sources=[RING, thick])
        assert beside == pytest.approx(alone, rel=1e-6)
        assert alone > 0.0


# Motion


@contextlib.contextmanager
def without_warnings():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def thrown(geom, timestep, duration, place, velocity, sources=(RING,)):
    """Relative change of energy, at most, of a geom that bounces."""
    law = fs.mujoco.Contact(1.0, depth=0.2)
    options = f'integrator="RK4" timestep="{timestep}"'
    model = model_of(free(geom, place, 'mass="1"'), options)
    data = mujoco.MjData(model)
    data.qvel[:] = velocity
    with without_warnings(), fs.mujoco.FieldForces(model, data, list(sources), contact=law) as forces:
        start, worst = forces.energy().total, 0.0
        for _ in range(60):
            mujoco.mj_step(model, data, round(duration / timestep / 60))
            worst = max(worst, abs(forces.energy().total / start - 1.0))
    return worst, data


@pytest.mark.parametrize("geom", ["box", "cylinder", "mesh", "capsule"])
def test_bounces_keep_the_energy_the_better_the_shorter_the_step(geom):
    # The mesh turns slowly: its edges are not to lie along the ring, where two deepest points take turns.
    spin = (0.3, 0.2, 0.1) if geom == "mesh" else (0.8, 1.1, 0.5)
    runs = [thrown(GEOMS[geom], step, 1.2, (0.9, 0.1, 0.5), (0.1, 0, -0.6, *spin)) for step in (4e-4, 2e-4, 1e-4)]
    errors = [error for error, _ in runs]
    assert runs[2][1].qvel[2] > 0.1, "it bounced"
    assert errors[2] < 1e-5
    assert errors[0] > 4.0 * errors[2]


def test_a_hundred_bounces_of_a_box_gain_nothing():
    """Between two slabs."""
    slabs = [planet(fs.Plane((0, 0, z), (0, 0, 1)), 0.2) for z in (-0.6, 0.6)]
    velocity = (0, 0, -0.8, 0.5, 0.3, 0.7)
    error, data = thrown('type="box" size="0.1 0.1 0.1"', 2e-4, 75.0, (0, 0, 0), velocity, slabs)
    assert error < 1e-4
    assert abs(data.qpos[2]) < 0.4


TOWERS = {
    "one body": '<geom type="box" size=".1 .1 .05" mass="10"/>',
    "a light foot": '<geom type="box" size=".1 .1 .05" mass="0.1"/><body pos="0 0 0.001">'
    '<geom type="box" size=".1 .1 .045" mass="9.9" contype="0" conaffinity="0"/></body>',
    "a light foot on a hinge": '<geom type="box" size=".1 .1 .05" mass="0.1"/><body pos="0 0 0.1">'
    '<joint type="slide" axis="0 0 1" stiffness="3e5" damping="1e3"/><geom type="box" size=".1 .1 .045" mass="9.9" '
    'contype="0" conaffinity="0"/></body>',
}


@pytest.mark.parametrize("tower", TOWERS)
def test_what_stands_on_a_slope_sticks(tower):
    """The pull along the ground is 0.33 of that onto it, below the friction of 0.8: but for creep it does not move."""
    pulling = fs.Body(fs.Point((0, 0, -100)), gravity=fs.Newtonian(), mass=1e4, surface=fs.Material(radius=100.0))
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option gravity="0.33 0 0" timestep="0.0005" integrator="implicitfast"/><worldbody>'
        f'<body pos="0 0 0.0501"><freejoint/>{TOWERS[tower]}</body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    law = fs.mujoco.Contact(0.5, depth=0.1, damping=1.0, friction=0.8)
    with fs.mujoco.FieldForces(model, data, pulling, contact=law, keep_gravity=True):
        mujoco.mj_step(model, data, 2000)
        start = data.qpos[0]
        mujoco.mj_step(model, data, 1000)
    # As a speed, the pull of a few steps.
    assert abs(data.qpos[0] - start) < 8 * 0.33 * 0.0005 * 0.5


def test_what_is_too_steep_slides_as_coulomb_says():
    pulling = fs.Body(fs.Point((0, 0, -100)), gravity=fs.Newtonian(), mass=1e4, surface=fs.Material(radius=100.0))
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option gravity="0.5 0 0" timestep="0.0005" integrator="implicitfast"/><worldbody>'
        f'<body pos="0 0 0.0501"><freejoint/>{TOWERS["a light foot"]}</body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    law = fs.mujoco.Contact(0.5, depth=0.1, damping=1.0, friction=0.2)
    with fs.mujoco.FieldForces(model, data, pulling, contact=law, keep_gravity=True):
        mujoco.mj_step(model, data, 1000)
        start = data.qvel[0]
        mujoco.mj_step(model, data, 1000)
    assert data.qvel[0] - start == pytest.approx((0.5 - 0.2) * 0.5, rel=0.02)


# Starts inside, cloth


def test_a_start_inside_is_told_of():
    donut = fs.Body(
        fs.Circle((0, 0, 0), (0, 0, 1), 1.0), gravity=fs.Newtonian(), mass=1.0, surface=fs.Material(radius=0.25)
    )
    model = model_of(
        '<body pos="1.12 0 0.1"><freejoint/><geom name="crate" type="box" size="0.05 0.05 0.05" mass="1"/></body>'
    )
    data = mujoco.MjData(model)
    forces = fs.mujoco.FieldForces(model, data, donut, contact=fs.mujoco.Contact(1.0, depth=0.1), native=False)
    with pytest.warns(fs.FieldsimWarning, match="timestep"):
        with pytest.warns(fs.FieldsimWarning, match="geom 'crate' starts 0.1.* deep in a surface"), forces:
            pass
    model.opt.timestep = 1e-4
    data.qpos[:3] = 1.3, 0, 0.4
    with without_warnings(), forces:
        pass


def test_cloth_is_felt_by_its_vertices():
    """A flex falls on a planet, and lies on it: no vertex gets through."""
    cloth = (
        '<flexcomp name="cloth" type="grid" count="4 4 1" spacing="0.1 0.1 0.1" pos="0 0 0.15" mass="0.2" dim="2" '
        'radius="0.02"><edge equality="true" damping="0.1"/>'
        '<contact selfcollide="none"/></flexcomp>'
    )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 -1" timestep="0.0005"/><worldbody>{cloth}</worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    law = fs.mujoco.Contact(1.0, depth=0.2, damping=1.0, friction=0.5)
    ball = planet(fs.Point((0, 0, -0.5)), 0.6)
    with fs.mujoco.FieldForces(model, data, ball, contact=law, keep_gravity=True) as forces:
        assert forces.energy().contact == 0.0
        mujoco.mj_step(model, data, 1500)
        vertices = data.flexvert_xpos.reshape(-1, 3)
        away = np.linalg.norm(vertices - (0, 0, -0.5), axis=1) - 0.6 - 0.02
        assert away.min() > -0.2 * 0.02
        assert forces.energy().contact > 0.0
