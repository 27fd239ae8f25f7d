"""Contact with what leaves no field at its nearest point: tips of spindles, rims of holes, creases of profiles."""

import mujoco
import numpy as np
import pytest
from test_mujoco_contact import CORNERS, FAINT, GEOMS, contact_of, free, model_of

import fieldsim as fs
from fieldsim import profile

LINE = fs.Segment((-1, 0, 0), (1, 0, 0))
BOW = fs.Arc(center=(0, 0, 0), normal=(0, 0, 1), radius=1.0, start=(1, 0, 0), angle=2.5)
ON_END, ON_MIDDLE = ((0.5, 0, 0), (1, 0, 0)), ((0, 0, 0), (0, 0, 1))
HOLE = fs.profiled(fs.Segment((-0.2, 0, 0), (0.2, 0, 0)), profile.constant(-4.0))
TIP_OF_BOW = (np.cos(0.75), np.sin(0.75), 0)
# Skeleton, kernel, places within the surface and ways to come at them: where a foot has no field, or over a crease.
BODIES = {
    "hat": (
        [fs.profiled(LINE, profile.hat(0.0, 1.0))],
        fs.Gaussian,
        [ON_END, ON_MIDDLE],
    ),
    "bent sine": ([fs.profiled(BOW, profile.sine(0.0, 1.0))], fs.Metaball, [(TIP_OF_BOW, (0, -1, 0))]),
    "bent hat": ([fs.profiled(BOW, profile.hat(0.0, 1.0))], fs.Gaussian, [(TIP_OF_BOW, (0, -1, 0))]),
    "taper": (
        [fs.profiled(LINE, profile.linear(1.0, 0.0))],
        fs.Metaball,
        [((0.1, 0, 0), (1, 0, 0)), ((-1, 0, 0), (-1, 0, 0)), ((-1, 0, 0), (0, 0, 1))],
    ),
    "dumbbell": ([fs.profiled(LINE, profile.hat(1.0, -0.2))], fs.Gaussian, [((0.6, 0, 0), (-1, 0, 2))]),
    "hole": ([fs.profiled(LINE, profile.constant(1.0)), HOLE], fs.Gaussian, [((0.6, 0, 0), (-1, 0, 2))]),
}


def body_of(name):
    skeleton, kernel, places = BODIES[name]
    shape = {"blobbiness": -4.0} if kernel is fs.Gaussian else {"kernel": kernel}
    return fs.Body(skeleton, surface=fs.Material(radius=0.2, **shape)), places


def cloud(geom, rng, count=4000):
    """Points (count, 3) all over a geom of `GEOMS`, in its frame as it is written down."""
    kind, numbers = geom.split('"')[1], geom.split('size="')[-1].rstrip('"')
    ball = rng.normal(size=(count, 3))
    ball *= rng.uniform(size=(count, 1)) ** (1 / 3) / np.linalg.norm(ball, axis=1, keepdims=True)
    if kind == "mesh":
        return rng.dirichlet(np.full(6, 0.5), count) @ np.array(CORNERS.split(), dtype=float).reshape(6, 3)
    size, along = np.array(numbers.split(), dtype=float), rng.uniform(-1.0, 1.0, (count, 1)) * (0, 0, 1)
    if kind in ("sphere", "ellipsoid"):
        return size * ball
    if kind == "capsule":
        return size[0] * ball + size[1] * along
    if kind == "box":
        return size * rng.uniform(-1.0, 1.0, (count, 3))
    angle, radius = rng.uniform(0, 2 * np.pi, count), size[0] * np.sqrt(rng.uniform(size=count))
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(count)]) + size[1] * along


@pytest.mark.parametrize("geom", GEOMS)
@pytest.mark.parametrize("name", BODIES)
def test_what_reaches_into_a_surface_touches(name, geom):
    """From the ends, from the side and askew, until points of it are well within."""
    body, places = body_of(name)
    _, data, forces = contact_of(GEOMS[geom], [body])
    rng, field = np.random.default_rng(sum(map(ord, name + geom))), body.surface_field()
    points = cloud(GEOMS[geom], rng)
    for place, outward in places:
        for aside in (0.0, 0.7):
            way = outward + aside * rng.normal(size=3)
            data.qpos[3:] = rng.normal(size=4)
            data.qpos[3:] /= np.linalg.norm(data.qpos[3:])
            for distance in np.arange(2.5, -0.3, -0.05):
                data.qpos[:3] = place + distance * way / np.linalg.norm(way)
                mujoco.mj_kinematics(data.model, data)
                turn = data.xmat[1].reshape(3, 3)
                reaches = field.value(data.xpos[1] + points @ turn.T).max() > 1.1
                if reaches:
                    break
            assert reaches, (place, aside)
            assert forces.energy().contact > 0.0, (place, aside)


@pytest.mark.parametrize("name", ["hat", "hole"])
def test_a_ball_bounces_off_a_tip_and_off_the_rims_of_a_hole(name):
    """It comes at a place without any field, and goes back as fast, straight: both rims push."""
    body, _ = body_of(name)
    way = np.array({"hat": (1.0, 0, 0), "hole": (0, 0, 1.0)}[name])
    model = model_of(free('type="sphere" size="0.6" mass="1"'), options='timestep="0.005" integrator="RK4"')
    data = mujoco.MjData(model)
    data.qpos[:3], data.qvel[:3] = 2.0 * way, -way
    law = fs.mujoco.Contact(1.0, depth=0.3)
    with fs.mujoco.FieldForces(model, data, body, contact=law, native=False) as forces:
        while data.time < 4.0 and not (data.qvel[:3] @ way > 0.0 and forces.energy().contact == 0.0):
            mujoco.mj_step(model, data)
    np.testing.assert_allclose(data.qvel[:3], way, atol=1e-4)


@pytest.mark.parametrize(
    ("skeleton", "size", "place"),
    [(LINE, 0.3, (0.003, 0.01, 0.4)), (BOW, 1.5, (0.81225186, -0.36095075, 1.3287979))],
)
def test_on_a_crease_the_force_is_the_gradient_of_the_energy(skeleton, size, place):
    """Where steps along the surface lead from one side to the other: the middle of a hat, the start of a taper."""
    shape = profile.hat(0.0, 1.0) if skeleton is LINE else profile.linear(1.0, 0.0)
    body = fs.Body(fs.profiled(skeleton, shape), surface=fs.Material(radius=0.2, blobbiness=-4.0))
    _, data, forces = contact_of(f'type="sphere" size="{size}"', [body])
    data.qpos[:3] = place
    force, step = forces.wrenches()[0][0], 1e-5
    assert force.any()
    for k in range(3):
        energies = []
        for sign in (1, -1):
            data.qpos[k] += sign * step
            energies.append(forces.energy().contact)
            data.qpos[k] -= sign * step
        assert (energies[1] - energies[0]) / (2 * step) == pytest.approx(force[k], abs=2e-4 * np.linalg.norm(force))


@pytest.mark.parametrize("keyframe", [False, True])
def test_a_reset_into_a_surface_is_told_of(keyframe):
    """As the start is, but for data that are set back while in the field."""
    donut = fs.Body(fs.Circle((0, 0, 0), (0, 0, 1), 1.0), surface=fs.Material(radius=0.25), **FAINT)
    ball = '<body pos="{} 0 0.1"><freejoint/><geom name="crate" type="sphere" size="0.05" mass="1"/></body>'
    keys = '<keyframe><key qpos="1.12 0 0.1 1 0 0 0"/></keyframe>'
    model = model_of(ball.format(1.12), options='timestep="1e-4"', more=keys)
    data = mujoco.MjData(model)
    data.qpos[0] = 3.0
    law = fs.mujoco.Contact(1.0, depth=0.1)
    with fs.mujoco.FieldForces(model, data, donut, contact=law, native=False):
        mujoco.mj_step(model, data, 3)
        if keyframe:
            mujoco.mj_resetDataKeyframe(model, data, 0)
        else:
            mujoco.mj_resetData(model, data)
        with pytest.warns(fs.FieldsimWarning, match="geom 'crate' starts 0.1.* deep in a surface"):
            mujoco.mj_step(model, data)
        mujoco.mj_step(model, data)
