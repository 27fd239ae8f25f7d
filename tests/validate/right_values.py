"""The things that right calls are made of, and which values mean the same."""

import contextlib
import functools
import pathlib
import tempfile

import numpy as np

import fieldsim as fs

# Bases, of which users make subclasses only.
BASES = {"Integrator", "Splitting", "Texture"}

ORIGIN, UP = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)


class Or:
    """One right value, and others like which are right, too."""

    def __init__(self, first, *others):
        self.first, self.others = first, others


def of_time(value):
    """A value in whose place may stand a function of time."""
    first, *others = (value.first, *value.others) if isinstance(value, Or) else (value,)
    return Or(first, *others, len)


@functools.cache
def folder():
    return pathlib.Path(tempfile.mkdtemp())


# What is entered once for all calls of its methods.
OPEN = contextlib.ExitStack()


def body_of(**options):
    return fs.Body(fs.Point(ORIGIN), gravity=fs.Newtonian(0.1), surface=fs.Material(radius=0.3), **options)


def world_of():
    world = fs.World()
    world.add_body(body_of())
    world.add_particles([(2, 0, 0)], [(0, 0.7, 0)])
    return world


def simulation_of():
    return fs.Simulation(world_of())


@functools.cache
def free():
    world = fs.World()
    world.add_body(fs.Body(fs.Circle(ORIGIN, UP, 1.0), gravity=fs.Newtonian(0.1), motion=fs.Rigid()))
    return fs.Simulation(world)


def log_of():
    log = fs.EnergyLog(simulation_of())
    log.record()
    return log


@functools.cache
def ready():
    return simulation_of()


def mesh_of():
    return fs.mesh(fs.box(ORIGIN, (1, 1, 1)))


def field_of():
    return fs.gravity(fs.Point(ORIGIN), 1.0)


def group_of():
    return fs.World().add_shape(fs.Ball())


def rig_of():
    return fs.Rig([fs.Bone("thigh")])


def scenario_of():
    return fs.Scenario(world_of(), CAMERA, duration=0.1, fps=10)


@functools.cache
def recorded():
    path = folder() / "recorded.npz"
    with fs.Recording(path) as recording:
        recording.add(world_of().at(0.0))
    return fs.Recorded(path)


@functools.cache
def open_recording():
    return OPEN.enter_context(fs.Recording(folder() / "open.npz"))


@functools.cache
def open_film():
    film = OPEN.enter_context(fs.Film(folder() / "open.png", size=(2, 2)))
    film.write(np.zeros((2, 2, 3), np.uint8))
    return film


def script():
    path = folder() / "planet.py"
    path.write_text("def build():\n    pass\n")
    return path


def build():
    """A scenario."""


@functools.cache
def lyapunov_of():
    return fs.Lyapunov(np.ones(2), np.ones((2, 1, 1)))


@functools.cache
def renderer_of():
    return fs.Renderer((2, 2), "draft")


def figure_of(size):
    return fs.plots.figure(size)


CAMERA = fs.Camera((0, -5, 1))
SPIN = fs.Spin()
COLOR = Or("white", (1.0, 1.0, 1.0))
TEXTURE = Or("white", (1.0, 1.0, 1.0), fs.Marble())
MOTION = Or(fs.Pose(), ORIGIN, len)
SKELETON = Or(fs.Point(ORIGIN), (fs.Point(ORIGIN),))
INTEGRATOR = Or(fs.Leapfrog(0.1), "auto")
SIZE = (4, 4)
CENTERED = {"center": ORIGIN, "normal": UP}
POINTS = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
RANGE = Or((1.0, 2.0), 1.0)
SEEDED = {"seed": 1, "count": 3, "velocity": ORIGIN}
SPEEDY = {**SEEDED, "center": ORIGIN, "speed": Or(1.0, np.zeros(3), len)}
DEVICE = {"device": "cpu", "threads": 1}
LIGHT = {"color": COLOR, "intensity": 1.0, "shadows": True, "samples": 4}
WOOLLY = {"color": COLOR, "other": COLOR, "scale": 0.2, "turbulence": 1.0, "seed": 1}
ENDS = {"start": of_time(ORIGIN), "end": of_time(UP)}
ROUND = {"center": of_time(ORIGIN), "normal": of_time(UP), "radius": of_time(1.0)}
ARC = {**ROUND, "start": of_time((1.0, 0.0, 0.0)), "angle": of_time(1.0)}
CORNERS = {"a": of_time(ORIGIN), "b": of_time((1.0, 0.0, 0.0)), "c": of_time((0.0, 1.0, 0.0))}
PROFILE = {"profile": of_time(fs.profile.linear(1, 2))}


def parts(values, *names):
    return {name: values[name] for name in names}


def call(make, **arguments):
    """A right call: what makes the function (a method is of a thing made anew), and its arguments."""
    return make, arguments
