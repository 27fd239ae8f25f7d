"""Values are copied and pickled before and after use, and work in forked and in spawned processes."""

import copy
import pickle
import subprocess
import sys

import numpy as np
import pytest

import fieldsim as fs

RING = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)
PLACES = np.array([(0.2, 0.3, 0.4), (2.0, -1.0, 0.5)])
TURN = fs.Keyframes([0.0, 1.0], [fs.Pose(), fs.Pose.turned((0, 0, 1), 1.0)])
MASSES = fs.Keyframes([0.0, 1.0], [1.0, 2.0])
WAYS = {"pickle": lambda value: pickle.loads(pickle.dumps(value)), "deepcopy": copy.deepcopy, "copy": copy.copy}


def a_world():
    world = fs.World(background=fs.Background(), fog=fs.Fog(0.01))
    world.add_body(fs.Body(RING, gravity=fs.Newtonian(), surface=fs.Material("marble", radius=0.2)))
    world.add_body(fs.Body(fs.Point((0, 0, 3)), gravity=fs.Newtonian(), mass=1e-3, motion=fs.Rigid()))
    rig = fs.Rig([fs.Bone("arm", motion=TURN), fs.Bone("hand", "arm", fs.Pose((1, 0, 0)))])
    world.add_body(fs.Body(rig.carry("hand", fs.Segment((0, 0, 0), (1, 0, 0))), surface=fs.Material("clouds")))
    world.add_shape(fs.TriangleSurface(fs.mesh(fs.box((3, 0, 0), (1, 1, 1)))))
    world.add_particles([(0, 3, 0)], [(0.5, 0, 0)], contact=fs.Bounce())
    return world


def field_values(field):
    return [field.at(0.5).value(PLACES), field.at(0.5).hessian(PLACES)]


FIELDS = {
    "field": lambda: fs.gravity(RING, 1.0),
    "sum": lambda: 2.0 * fs.gravity(RING, 1.0) - fs.Body(RING, surface=fs.Material()).surface_field(),
    "of time": lambda: (
        -fs.gravity(fs.Point(fs.Keyframes([0, 1], [(0, 0, 0), (1, 0, 0)])), fs.Keyframes([0, 1], [1, 2]))
    ),
    "solid": lambda: fs.solid(fs.mesh(fs.box((0, 0, 0), (1, 1, 1))), 1.0),
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", FIELDS)
def test_fields(name, way):
    field = FIELDS[name]()
    expected = field_values(WAYS[way](field))
    np.testing.assert_equal(field_values(field), expected)
    np.testing.assert_equal(field_values(WAYS[way](field)), expected)


@pytest.mark.parametrize("way", WAYS)
def test_worlds_and_what_they_consist_of(way):
    world, camera = a_world(), fs.Camera.orbit(radius=a_radius())
    scenario = fs.Scenario(world, camera, duration=1.0, integrator=fs.Leapfrog(0.05))
    renderer = fs.Renderer((16, 9), samples=1, shadows=False)
    run = fs.Simulation(world, fs.Leapfrog(0.05))
    run.advance(0.1)
    snapshot = run.snapshot()
    picture = renderer.frame(snapshot, camera)
    made = WAYS[way]
    np.testing.assert_array_equal(made(renderer).frame(made(snapshot), made(camera)), picture)
    again = made(scenario).begin()[0]
    again.advance(0.1)
    np.testing.assert_array_equal(again.positions, run.positions)
    assert made(made(TURN))(0.3) == TURN(0.3)
    for value in (run.events, run.wrenches(), fs.Radau(), fs.Auto(), world.bodies[0], world.particles[0], snapshot):
        made(value)


def a_radius():
    return fs.Keyframes([0.0, 1.0], [4.0, 5.0])


def test_a_copied_mesh_stays_read_only():
    mesh = fs.mesh(fs.box((0, 0, 0), (1, 1, 1)))
    again = pickle.loads(pickle.dumps(mesh))
    np.testing.assert_array_equal(again.vertices, mesh.vertices)
    assert not again.vertices.flags.writeable


def test_recordings(tmp_path):
    world = a_world()
    with fs.Recording(tmp_path / "run.npz") as recording:
        recording.add(world.at(0.0))
        with pytest.raises(fs.InputError, match="Recording: it is tied to this process"):
            pickle.dumps(recording)
    recorded = fs.Recorded(tmp_path / "run.npz")
    assert pickle.loads(pickle.dumps(recorded)).snapshot(0, world).poses == recorded.snapshot(0, world).poses


@pytest.mark.parametrize("way", WAYS)
def test_what_is_tied_to_its_process_says_so(way):
    run = fs.Simulation(a_world(), fs.Leapfrog(0.05))
    for value in (run, run.bodies, run.mutual, fs.EnergyLog(run), fs.Film("film.gif")):
        with pytest.raises(fs.InputError, match=f"{type(value).__name__}: .* neither copied nor pickled; "):
            WAYS[way](value)


SCRIPT = """
import concurrent.futures, multiprocessing, sys
import numpy as np
import fieldsim as fs

ring = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)
field = fs.gravity(ring, mass=1.0)
points = np.random.default_rng(0).normal(size=(3000, 3))
world = fs.World()
world.add_body(fs.Body(ring, surface=fs.Material("red", radius=0.3)))
camera = fs.Camera.orbit()

def work(field, world, camera):
    return field.value(points), fs.render(world.at(0.0), camera, size=(32, 18), quality="draft")

if __name__ == "__main__":
    expected = work(field, world, camera)
    context = multiprocessing.get_context(sys.argv[1])
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=context) as pool:
        for got, right in zip(pool.submit(work, field, world, camera).result(), expected):
            assert np.array_equal(got, right)
    print("same")
"""


@pytest.mark.parametrize("method", ["fork", "spawn", pytest.param("forkserver", marks=pytest.mark.full)])
def test_other_processes(method, tmp_path):
    if method != "spawn" and sys.platform == "win32":
        pytest.skip("there is no fork on Windows")
    (tmp_path / "script.py").write_text(SCRIPT)
    command = [sys.executable, str(tmp_path / "script.py"), method]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.stdout == "same\n", done.stderr
