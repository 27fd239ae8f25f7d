"""MuJoCo in a field: energy and trajectories of a free body, and contact with a planet."""

import time

import mujoco
import numpy as np

import fieldsim as fs

DONUT = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)
PLANET = fs.Body(DONUT, gravity=fs.Newtonian(), mass=1.0, surface=fs.Material(radius=0.25, blobbiness=-8.0))

# Orbits: a tilted one that stays twice the ring's radius away from the wire, of a body a tenth as large.
REACH = np.array([0.12, 0.08, 0.04])
INERTIA = (REACH**2 / 3).sum() - REACH**2 / 3
PLACE, VELOCITY, SPIN = (3.0, 0.0, 0.4), (0.0, 0.6, 0.1), (0.3, 0.5, -0.2)
PERIOD = 2 * np.pi * np.linalg.norm(PLACE) / np.linalg.norm(VELOCITY)
STEPS = 1600


def numbers(values):
    """A vector as MJCF writes it."""
    return " ".join(repr(float(value)) for value in values)


def world(bodies, *, timestep, integrator="RK4", assets="", options=""):
    """A model of some bodies, without gravity of its own."""
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 0" integrator="{integrator}" timestep="{float(timestep)!r}" {options}/>'
        f"<asset>{assets}</asset><worldbody>{bodies}</worldbody></mujoco>"
    )


def orbits(periods: int = 100):
    """The drift of energy of a free body round the donut, and how its path converges to our own rigid body's."""
    name = f"free body, {periods} periods of {STEPS} steps"
    for integrator in ("RK4", "implicitfast"):
        for accuracy in ("points", "torque"):
            drift = _drift(periods, integrator, accuracy)
            yield {"name": f"{name}, {integrator}, {accuracy}: relative error of energy", "value": drift, "unit": ""}
    for integrator in (fs.Leapfrog, fs.BlanesMoan6):
        drift = _own_drift(periods, integrator(PERIOD / STEPS))
        kind = f"our own {integrator.__name__}"
        yield {"name": f"{name}, {kind}: relative error of energy", "value": drift, "unit": ""}
    yield from _distances()


def _orbiter(timestep, integrator="RK4"):
    """A free body with the inertia of six points on its axes; model and data."""
    body = f'<body pos="{numbers(PLACE)}"><freejoint/>'
    body += f'<inertial pos="0 0 0" mass="1" diaginertia="{numbers(INERTIA)}"/></body>'
    model = world(body, timestep=timestep, integrator=integrator)
    data = mujoco.MjData(model)
    data.qvel[:] = *VELOCITY, *SPIN
    return model, data


def _drift(periods, integrator, accuracy):
    model, data = _orbiter(PERIOD / STEPS, integrator)
    with fs.mujoco.FieldForces(model, data, PLANET, accuracy=accuracy) as forces:
        start, worst = forces.energy().total, 0.0
        for _ in range(10 * periods):
            mujoco.mj_step(model, data, STEPS // 10)
            worst = max(worst, abs(forces.energy().total / start - 1.0))
    return worst


def _own(integrator):
    """The same body in our own simulation."""
    points = [fs.Point(tuple((side * row).tolist())) for row in np.diag(REACH) for side in (1, -1)]
    scene = fs.World()
    scene.add_body(PLANET)
    scene.add_body(fs.Body(points, mass=1.0, motion=fs.Rigid(PLACE, velocity=VELOCITY, angular_velocity=SPIN)))
    return fs.Simulation(scene, integrator)


def _own_drift(periods, integrator):
    simulation = _own(integrator)
    bodies, found = simulation.bodies, []
    for k in range(10 * periods + 1):
        simulation.advance(0.1 * k * PERIOD)
        found.append(float(bodies.kinetic_energies.sum() + bodies.potential_energy()))
    return max(abs(energy / found[0] - 1.0) for energy in found)


def _distances():
    """How far MuJoCo's RK4 is from our own rigid body after one turn, as steps shorten."""
    simulation = _own(fs.BlanesMoan6(PERIOD / 3200))
    simulation.advance(PERIOD)
    place = np.array(simulation.snapshot().poses[1].position)
    before = None
    for steps in (50, 100, 200, 400):
        model, data = _orbiter(PERIOD / steps)
        with fs.mujoco.FieldForces(model, data, PLANET):
            mujoco.mj_step(model, data, steps)
        distance = float(np.linalg.norm(data.qpos[:3] - place))
        name = f"free body, one turn in {steps} RK4 steps"
        yield {"name": f"{name}: distance to our own", "value": distance, "unit": ""}
        if before:
            yield {"name": f"{name}: order", "value": float(np.log2(before / distance)), "unit": ""}
        before = distance


# Contact

LAW = fs.mujoco.Contact(speed=0.5, depth=0.04, damping=2.0)
RADIUS = 0.05


def contacts(full: bool = False):
    """A ball at rest, a ball through the hole, and with `full` the rain of objects: on a geom and by the potential."""
    geom = fs.mujoco.planet_geom(PLANET, resolution=64)
    for name, asset, body, law in (("distance field", geom.asset, geom.body, None), ("potential", "", "", LAW)):
        yield {"name": f"ball at rest on the tube, {name}: error of its height", "value": _rest(asset, body, law)} | {
            "unit": "%"
        }
        touches, lowest = _fall(asset, body, law)
        yield {"name": f"ball through the hole, {name}: steps in touch", "value": touches, "unit": ""}
        yield {"name": f"ball through the hole, {name}: lowest height", "value": lowest, "unit": ""}
    if full:
        yield from _rain()


def _surface_height():
    """Height of the donut's surface over its ring."""
    field, low, high = PLANET.surface_field(), 0.2, 0.3
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if field.value((0.0, 1.0, middle)) > 1.0 else (low, middle)
    return low


def _rest(asset, planet, law):
    """Error, in percent, of the height of a ball's centre once it lies still."""
    ball = f'<body pos="0 1 0.302"><joint type="slide" axis="0 0 1"/><geom size="{RADIUS}"/></body>'
    model = world(planet + ball, timestep=5e-4, integrator="Euler", assets=asset)
    data = mujoco.MjData(model)
    with fs.mujoco.FieldForces(model, data, PLANET, contact=law):
        mujoco.mj_step(model, data, 6000)
    return float(100.0 * (data.xpos[-1, 2] / (_surface_height() + RADIUS) - 1.0))


def _fall(asset, planet, law):
    """Steps with a contact of a ball that falls from above the hole, and how deep it gets."""
    ball = f'<body pos="0.01 0 1.2"><freejoint/><geom size="{RADIUS}"/></body>'
    model = world(planet + ball, timestep=1e-3, integrator="Euler", assets=asset)
    data = mujoco.MjData(model)
    touches, lowest = 0, np.inf
    with fs.mujoco.FieldForces(model, data, PLANET, contact=law) as forces:
        for _ in range(800):
            mujoco.mj_step(model, data, 10)
            touches += data.ncon > 0 or forces.energy().contact > 0.0
            lowest = min(lowest, float(data.xpos[-1, 2]))
    return touches, lowest


# Rain

SHAPES = (
    'type="sphere" size="0.05"',
    'type="ellipsoid" size="0.06 0.05 0.04"',
    'type="capsule" size="0.04 0.05"',
    'type="box" size="0.05 0.05 0.05"',
)
SIZE = 0.1
# What is so close has touched.
NEAR = 2e-3


def _rain():
    """Objects that fall on the donut from rest and bounce, through each other so that each one's energy is its own.

    An object that started at rest where the field is F0 has not the energy to be where it is less. On a geom there are
    fewer, for less time: MuJoCo searches its distance field, at hundreds of times the cost of the potential.
    """
    law = fs.mujoco.Contact(speed=1.3, depth=0.03)
    yield from _rained("potential", 200, 20.0, 2e-4, law=law)
    geom = fs.mujoco.planet_geom(PLANET, resolution=64)
    yield from _rained("distance field", 5, 4.0, 1e-3, geom=geom)


def _rained(name, count, duration, timestep, law=None, geom=None):
    model = _rainy(count, geom, timestep)
    data = mujoco.MjData(model)
    with fs.mujoco.FieldForces(model, data, PLANET, contact=law) as forces:
        start, seen = time.perf_counter(), _Seen(model, data)
        before = forces.energy().total
        # A hit takes a few thousandths.
        for _ in range(round(duration / 1e-3)):
            mujoco.mj_step(model, data, round(1e-3 / timestep))
            seen.look(data)
        after, wall = forces.energy().total, time.perf_counter() - start
    name = f"{count} objects on the donut for {duration:g}, {name}"
    yield {"name": f"{name}: greatest penetration", "value": 100 * seen.deepest / SIZE, "unit": "% of the size"}
    yield {"name": f"{name}: greatest rise above the start", "value": seen.highest, "unit": "of the energy"}
    yield {"name": f"{name}: objects that touched", "value": int(seen.touched.sum()), "unit": ""}
    yield {"name": f"{name}: change of the total energy", "value": after / before - 1.0, "unit": ""}
    yield {"name": f"{name}: wall time", "value": wall, "unit": "s"}


def _rainy(count, geom, timestep):
    """Objects of all shapes, 0.4 to 1 away from the ring, turned anyhow; with a planet's geom if given."""
    rng = np.random.default_rng(4)
    round_ring, round_tube = rng.uniform(0.0, 2 * np.pi, (2, count))
    away = rng.uniform(0.4, 1.0, count)
    out = 1.0 + away * np.cos(round_tube)
    places = np.column_stack([out * np.cos(round_ring), out * np.sin(round_ring), away * np.sin(round_tube)])
    bodies = "".join(
        f'<body pos="{numbers(place)}" quat="{numbers(rng.normal(size=4))}"><freejoint/>'
        f'<geom {SHAPES[k % len(SHAPES)]} contype="1" conaffinity="0" solref="{2 * timestep} 1"/></body>'
        for k, place in enumerate(places)
    )
    assets = geom.asset if geom else ""
    return world((geom.body if geom else "") + bodies, timestep=timestep, assets=assets)


class _Seen:
    """What the rain's objects did: how deep a point of their surfaces was, and how high they rose for their energy."""

    def __init__(self, model, data):
        mujoco.mj_forward(model, data)
        self.bodies = bodies = np.flatnonzero(model.body_dofnum)
        self.geoms = model.body_geomadr[bodies]
        self.skins = np.stack([_skin(model, geom) for geom in self.geoms])
        self.gravity, self.surface = PLANET.gravity_field(), PLANET.surface_field()
        self.start = self.gravity.value(data.xipos[bodies])
        self.deepest, self.highest = -np.inf, -np.inf
        self.touched = np.zeros(len(bodies), dtype=bool)

    def look(self, data):
        turns = data.geom_xmat[self.geoms].reshape(-1, 3, 3)
        places = np.einsum("nij,nkj->nki", turns, self.skins) + data.geom_xpos[self.geoms][:, None]
        close = np.flatnonzero(self.surface.value(data.xipos[self.bodies]) > 1e-8)
        if len(close):
            value, slope = self.surface.value_and_gradient(places[close].reshape(-1, 3))
            # log F is about straight.
            depth = np.log(np.maximum(value, 1e-300)) * value / np.maximum(np.linalg.norm(slope, axis=1), 1e-300)
            depth = depth.reshape(len(close), -1).max(axis=1)
            self.deepest = max(self.deepest, float(depth.max()))
            self.touched[close] |= depth > -NEAR
        rise = 1.0 - self.gravity.value(data.xipos[self.bodies]) / self.start
        self.highest = max(self.highest, float(rise.max()))


def _skin(model, geom, count=200):
    """Points (count, 3) on a geom's surface, in its frame: where lines from the middle leave it."""
    k = np.arange(count) + 0.5
    z, angle = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    way = np.column_stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z])
    size, kind = model.geom_size[geom], mujoco.mjtGeom(int(model.geom_type[geom]))
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return way * np.min(size / np.abs(way), axis=1)[:, None]
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return size[0] * way + np.sign(z)[:, None] * (0.0, 0.0, size[1])
    return way * (size[[0, 0, 0]] if kind == mujoco.mjtGeom.mjGEOM_SPHERE else size)
