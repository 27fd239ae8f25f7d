"""What tools and methods do not know of a world is refused when they are called; what they know, they take in."""

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.dynamics import refusals
from fieldsim.world.world import FIELDS

SUN = fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(), surface=fs.Material(radius=0.2))
ORBIT = {"positions": [(2.0, 0, 0)], "velocities": [(0, 0.7, 0)]}


def world_with(*traits):
    world = fs.World(escape_radius=50.0 if "escape" in traits else None)
    world.add_body(SUN)
    if {"free", "losses"} & set(traits):
        moon = fs.Rigid(position=(0, 3, 0), velocity=(-0.5, 0, 0), friction=0.1 if "losses" in traits else 0.0)
        world.add_body(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(), mass=0.1, motion=moon, name="moon"))
    contact = fs.Bounce() if "contact" in traits else None
    pull = {"gravity": fs.Newtonian(0.1), "mass": 0.01} if "pull" in traits else {}
    world.add_particles(**ORBIT, contact=contact, **pull)
    return world


def on_mujoco(world):
    mujoco = pytest.importorskip("mujoco")
    mjcf = "<mujoco><worldbody><body pos='9 0 0'><freejoint/><geom size='1'/></body></worldbody></mujoco>"
    model = mujoco.MjModel.from_xml_string(mjcf)
    fs.mujoco.FieldForces(model, mujoco.MjData(model), world, keep_gravity=False, native=False)


TOOLS = {
    "Radau": lambda world: fs.Simulation(world, fs.Radau()),
    "force gradients": lambda world: fs.Simulation(world, fs.Omelyan4(0.01)),
    "poincare": lambda world: fs.poincare(world, fs.Section(normal=(0, 1, 0)), 1.0),
    "lyapunov": lambda world: fs.lyapunov(world, 1.0, samples=1),
    "steps": lambda world: fs.Simulation(world, fs.Leapfrog(0.01)),
    "steps backwards": lambda world: fs.Simulation(world, fs.BlanesMoan6(0.01)),
    "energy": lambda world: fs.energy(fs.Simulation(world).snapshot()),
    "log": lambda world: fs.EnergyLog(fs.Simulation(world)),
    "MuJoCo": lambda world: on_mujoco(world),
}
NAMED = {
    "contact": "particles of set 0 have contact",
    "escape": "the world's escape_radius is 50, .*world.replace",
    "pull": "particles of set 0 pull each other",
    "free": r"Body 1 \(moon\) moves freely",
    "losses": r"Body 1 \(moon\) (loses energy where it touches .*friction=0\.1|moves freely)",
}


@pytest.mark.parametrize("trait", NAMED)
@pytest.mark.parametrize("tool", TOOLS)
def test_each_tool_takes_each_trait_or_refuses_it_by_name_when_called(tool, trait):
    world = world_with(trait)
    known = {"free": {"free"}, "losses": {"free", "losses"}}.get(trait, {trait})
    if known & set(refusals.TABLE.get(tool, ((),))[0]):
        with pytest.raises(fs.InputError, match=NAMED[trait]):
            TOOLS[tool](world)
    else:
        TOOLS[tool](world)


@pytest.mark.parametrize("trait", ["contact", "escape"])
def test_particles_that_pull_neither_collide_nor_escape(trait):
    with pytest.raises(fs.InputError, match=f"Simulation: {NAMED[trait][:28]}.*cannot both pull each other"):
        fs.Simulation(world_with("pull", trait))
    with pytest.raises(fs.InputError, match=f"Simulation: {NAMED[trait]}"):
        fs.Simulation(world_with("pull", trait), "auto")


@pytest.mark.parametrize("value", [fs.Leapfrog, "radau", 0.01, fs.Integrator()])
def test_what_is_no_integrator_is_refused(value):
    with pytest.raises(fs.InputError, match="Simulation: integrator is"):
        fs.Simulation(world_with(), value)


def test_a_run_keeps_its_method():
    simulation = fs.Simulation(world_with("pull"), fs.Leapfrog(0.01))
    simulation.integrator = fs.Omelyan6(0.01)
    with pytest.raises(fs.InputError, match="its integrator was Leapfrog"):
        simulation.advance(1.0)


def test_a_picture_of_nothing_is_refused():
    log = fs.EnergyLog(fs.Simulation(world_with()))
    with pytest.raises(fs.InputError, match=r"plots\.energy: the log holds no moment"):
        fs.plots.energy(log)
    log.record()
    assert len(fs.plots.energy(log).axes[0].get_lines()) == 2


# Free bodies in sections and exponents


def binary(radius=0.5):
    """A particle around two free bodies."""
    world = fs.World()
    for sign in (-1, 1):
        motion = fs.Rigid(position=(radius * sign, 0, 0), velocity=(0, 0.5 * sign, 0))
        world.add_body(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(0.1), motion=motion))
    world.add_particles([(3, 0, 0)], [(0, 0.7, 0)])
    return world


def test_a_section_sees_free_bodies_where_they_are():
    world, method = binary(), fs.BlanesMoan6(0.05)
    times = 0.02 * np.arange(1, 1501)
    path = np.array([s.positions[0][0] for s in fs.Simulation(world, method).snapshots(times)])
    i = np.flatnonzero((path[1:, 1] > 0) & (path[:-1, 1] <= 0))
    assert len(i) == 1
    wanted = times[i] - 0.02 * path[i, 1] / (path[i + 1, 1] - path[i, 1])
    found = fs.poincare(world, fs.Section(normal=(0, 1, 0)), 30.0, method)
    np.testing.assert_allclose(found.times, wanted, atol=1e-5)
    np.testing.assert_allclose(found.positions[0, 0], np.interp(wanted[0], times, path[:, 0]), atol=1e-4)
    assert not len(fs.poincare(world.replace(particles=[]), fs.Section(), 1.0, method))


def test_exponents_are_those_of_neighbours_among_free_bodies():
    method = fs.BlanesMoan6(0.02)
    world = binary()
    found = fs.lyapunov(world, 12.0, method, samples=1).largest[0]
    # The tangent flow's largest singular value bounds the growth of the one vector that is followed.
    ends, step = [], 1e-6
    for k in range(6):
        for sign in (1, -1):
            x, v = (np.array(a) for a in ([(3.0, 0, 0)], [(0, 0.7, 0)]))
            (x, v)[k // 3][0, k % 3] += sign * step
            particles = fs.World().add_particles(x, v)
            simulation = fs.Simulation(world.replace(particles=[particles]), method)
            simulation.advance(12.0)
            ends.append(np.concatenate([simulation.positions[0][0], simulation.velocities[0][0]]))
    ends = np.array(ends).reshape(6, 2, 6)
    flow = ((ends[:, 0] - ends[:, 1]) / (2 * step)).T
    first = np.linalg.qr(np.random.default_rng(0).normal(size=(1, 6, 1)))[0][0, :, 0]
    assert found == pytest.approx(np.log(np.linalg.norm(flow @ first)) / 12.0, abs=1e-6)


# Copies of worlds


def test_a_copy_of_a_world_loses_nothing():
    class Mine(fs.World):
        pass

    world = Mine(
        lights=[fs.PointLight(position=(0, 0, 1))],
        fog=fs.Fog(0.1),
        background=fs.Background(stars=0.2),
        escape_radius=9.0,
    )
    world.add_body(SUN)
    world.add_shape(fs.Ball((0, 0, 0), 1.0))
    world.add_particles(**ORBIT)
    world.note = "kept"
    copied = world.replace()
    assert type(copied) is Mine
    assert vars(copied) == vars(world)
    assert set(FIELDS) | {"note"} == set(vars(world)), "what a world has is what replace knows, and what was added"
    copied.bodies = ()
    copied.add_particles(**ORBIT)
    assert (len(world.bodies), len(world.particles)) == (1, 1)
    dark = world.replace(bodies=[], escape_radius=None, fog=None)
    assert (dark.bodies, dark.escape_radius, dark.fog) == ((), None, None)
    assert (dark.shapes, dark.lights, dark.background) == (world.shapes, world.lights, world.background)
    assert world.escape_radius == 9.0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"escape_radius": -1.0}, "escape_radius is -1"),
        ({"light": ()}, "a world has no 'light'; give bodies, particles"),
        ({"bodies": [3]}, r"World.replace: bodies\[0\] is 3"),
        ({"particles": SUN}, "World.replace: particles is Body"),
        ({"lights": ["sun"]}, r"lights\[0\] is 'sun'"),
    ],
)
def test_bad_changes_to_a_world_are_refused(changes, words):
    with pytest.raises(fs.InputError, match=words):
        world_with().replace(**changes)
