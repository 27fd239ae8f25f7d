"""What users give wrongly is refused at the gate: every public callable, every parameter, some fifty bad values each.

`CALLS` holds one right call of every public callable, with a value for every parameter; the test puts each bad value in
the place of each. Right is a FieldsimError, or success where the value is one that the parameter may have (`means`).
"""

import contextlib
import datetime
import decimal
import fractions
import functools
import inspect
import itertools
import os
import pathlib
import shutil
import tempfile
import types
import warnings

import numpy as np
import pytest

import fieldsim as fs
from fieldsim import validate

ORIGIN, UP = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
# Made by fieldsim as results, not by users.
RESULTS = {"Choice", "Crossings", "Drift", "Energy", "EnergyReport", "Lyapunov", "Report", "Status"}
# Bases, of which users make subclasses only.
BASES = {"Integrator", "Splitting", "Texture"}
# For fieldsim itself: rows of tables, and what a run and its log tell each other.
OWN = {"pack", "account", "measured", "manoeuvred"}
# Methods with special names that take what users give.
OPERATORS = {"__call__", "__add__", "__sub__", "__mul__", "__matmul__"}


class Kilometres(np.ndarray):
    """Numbers with a unit."""

    unit = "km"

    def __float__(self):
        raise TypeError("only dimensionless quantities can be converted")


def _km(values):
    return np.asarray(values, float).view(Kilometres)


class Hostile:
    """Whatever is asked of it fails."""

    def _fail(self, *_):
        raise OSError("no")

    __repr__ = __str__ = __float__ = __int__ = __index__ = __len__ = __iter__ = __array__ = __eq__ = __bool__ = _fail
    __hash__ = object.__hash__


BAD = {
    "None": None,
    "nan": float("nan"),
    "inf": -np.inf,
    "huge whole number": 10**400,
    "-1": -1,
    "0": 0,
    "1e300": 1e300,
    "half": 0.5,
    "empty string": "",
    "'x'": "x",
    "number in a string": "1.5",
    "zero character": "\0",
    "long string": "x" * 300,
    "empty list": [],
    "empty dict": {},
    "dict": {"x": 1},
    "object": object(),
    "hostile object": Hostile(),
    "function of nothing": lambda: None,
    "function that fails": lambda *_: 1 / 0,
    "complex number": 1j,
    "complex vector": [1j, 0, 1],
    "truth": True,
    "truths": [True, False, True],
    "masked number": np.ma.masked,
    "masked vector": np.ma.masked_array([0.0, 0.0, 1.0], mask=[0, 0, 1]),
    "date": np.datetime64("2020-01-01"),
    "dates": np.ones((1, 3), "datetime64[s]"),
    "python's date": datetime.date(2020, 1, 1),
    "span of time": np.timedelta64(1, "s"),
    "number with a unit": _km(7.0),
    "vector with a unit": _km([0, 0, 7]),
    "points with a unit": _km([[0, 0, 7]]),
    "list of numbers with units": [_km(0.0), _km(0.0), _km(7.0)],
    "matrix (2, 2)": np.ones((2, 2)),
    "four numbers": (1.0, 2.0, 3.0, 4.0),
    "zero vector": (0.0, 0.0, 0.0),
    "vector with nan": (0.0, float("nan"), 0.0),
    "array without rows": np.zeros((0, 3)),
    "bytes": b"x",
    "class": int,
    "class of fieldsim": fs.Point,
    "fog": fs.Fog(),
    "list of fogs": [fs.Fog(), None],
    "ragged list": [[1.0], [1.0, 2.0]],
    "Nones": [None, None, None],
    "strings": ["a", "b", "c"],
    "set": {1.0, 2.0},
    "numpy string": np.str_("x"),
    "numpy record": np.zeros(1, [("a", int)])[0],
    "numpy half": np.float16(1.5),
    "numpy byte": np.int8(3),
    "fraction": fractions.Fraction(1, 3),
    "decimal nan": decimal.Decimal("nan"),
    "module": os,
}


class Or:
    """One right value, and others like which are right, too."""

    def __init__(self, first, *others):
        self.first, self.others = first, others


def of_time(value):
    """A value in whose place may stand a function of time."""
    first, *others = (value.first, *value.others) if isinstance(value, Or) else (value,)
    return Or(first, *others, len)


def means(bad, right) -> bool:
    """Whether `bad` is what could be meant where `right` is right."""
    if isinstance(right, Or):
        return any(means(bad, one) for one in (right.first, *right.others))
    if right is None or bad is None or isinstance(bad, Hostile):
        return bad is right
    if isinstance(right, bool):
        return isinstance(bad, bool | np.bool_)
    if isinstance(right, int | float):
        return _is_numbers(bad, 0)
    if isinstance(right, str | pathlib.Path):
        return isinstance(bad, str | os.PathLike)
    if isinstance(right, type | types.FunctionType | types.BuiltinFunctionType):
        return callable(bad)
    if isinstance(right, np.ndarray) or (isinstance(right, tuple | list) and right and _is_numbers(right[0])):
        return _is_numbers(bad, np.ndim(right))
    if isinstance(right, dict):
        return isinstance(bad, dict)
    if isinstance(right, tuple | list):
        return isinstance(bad, tuple | list | set) and all(right and means(one, right[0]) for one in bad)
    return isinstance(bad, [c for c in type(right).__mro__ if c.__module__.startswith("fieldsim")][-1])


def _is_numbers(value, ndim=None):
    """Whether `value` is real finite numbers and nothing else."""
    if isinstance(value, np.ma.MaskedArray | Kilometres | dict | set | type | types.ModuleType):
        return False
    if isinstance(value, list | tuple) and any(isinstance(one, Kilometres) for one in value):
        return False
    try:
        array = np.asarray(value)
        if array.dtype.kind == "O":
            array = np.asarray([float(x) for x in array.flat if not isinstance(x, str)]).reshape(array.shape)
        return array.dtype.kind in "iuf" and np.isfinite(array).all() and ndim in (None, array.ndim)
    except (TypeError, ValueError, OverflowError):
        return False


# The things of which right calls are made


@functools.cache
def _folder():
    return pathlib.Path(tempfile.mkdtemp())


# What is entered once for all calls of its methods.
_OPEN = contextlib.ExitStack()


@pytest.fixture(scope="module", autouse=True)
def _nothing_left():
    yield
    _OPEN.close()
    shutil.rmtree(_folder())


def _body(**options):
    return fs.Body(fs.Point(ORIGIN), gravity=fs.Newtonian(0.1), surface=fs.Material(radius=0.3), **options)


def _world():
    world = fs.World()
    world.add_body(_body())
    world.add_particles([(2, 0, 0)], [(0, 0.7, 0)])
    return world


def _simulation():
    return fs.Simulation(_world())


@functools.cache
def _free():
    world = fs.World()
    world.add_body(fs.Body(fs.Circle(ORIGIN, UP, 1.0), gravity=fs.Newtonian(0.1), motion=fs.Rigid()))
    return fs.Simulation(world)


def _log():
    log = fs.EnergyLog(_simulation())
    log.record()
    return log


@functools.cache
def _ready():
    return _simulation()


def _mesh():
    return fs.mesh(fs.box(ORIGIN, (1, 1, 1)))


def _field():
    return fs.gravity(fs.Point(ORIGIN), 1.0)


def _group():
    return fs.World().add_shape(fs.Ball())


def _rig():
    return fs.Rig([fs.Bone("thigh")])


def _scenario():
    return fs.Scenario(_world(), CAMERA, duration=0.1, fps=10)


@functools.cache
def _recorded():
    path = _folder() / "recorded.npz"
    with fs.Recording(path) as recording:
        recording.add(_world().at(0.0))
    return fs.Recorded(path)


@functools.cache
def _open_recording():
    return _OPEN.enter_context(fs.Recording(_folder() / "open.npz"))


@functools.cache
def _open_film():
    film = _OPEN.enter_context(fs.Film(_folder() / "open.png", size=(2, 2)))
    film.write(np.zeros((2, 2, 3), np.uint8))
    return film


def _script():
    path = _folder() / "planet.py"
    path.write_text("def build():\n    pass\n")
    return path


def _build():
    """A scenario."""


@functools.cache
def _lyapunov():
    return fs.Lyapunov(np.ones(2), np.ones((2, 1, 1)))


@functools.cache
def _renderer():
    return fs.Renderer((2, 2), "draft")


def _figure(size):
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


def _parts(values, *names):
    return {name: values[name] for name in names}


def _call(make, **arguments):
    return make, arguments


# A right call of each public callable: what makes the function (a method is of a thing made anew), and its arguments.
CALLS = {
    **{
        name: _call(lambda name=name: getattr(fs, name), dt=0.1)
        for name in fs.__all__
        if isinstance(getattr(fs, name), type) and issubclass(getattr(fs, name), fs.Splitting) and name not in BASES
    },
    "Absorb": _call(lambda: fs.Absorb),
    "Arc": _call(lambda: fs.Arc, **ARC),
    "Auto": _call(lambda: fs.Auto, tolerance=1e-6, span=1.0, candidates=(fs.Leapfrog, fs.Radau)),
    "Background": _call(
        lambda: fs.Background,
        top=COLOR,
        bottom=COLOR,
        stars=0.1,
        image=Or(np.zeros((2, 2, 3)), "x", np.zeros((2, 2))),
        turn=0.0,
        intensity=1.0,
    ),
    "Ball": _call(lambda: fs.Ball, center=ORIGIN, radius=1.0),
    "Body": _call(
        lambda: fs.Body,
        skeleton=SKELETON,
        gravity=fs.Newtonian(),
        mass=of_time(1.0),
        G=1.0,
        surface=fs.Material(),
        motion=MOTION,
        name="planet",
    ),
    "Body.gravity_elements": _call(lambda: _body().gravity_elements, time=0.0),
    "Body.gravity_field": _call(lambda: _body().gravity_field),
    "Body.pose_at": _call(lambda: _body().pose_at, time=0.0),
    "Body.surface_elements": _call(lambda: _body().surface_elements, time=0.0),
    "Body.surface_field": _call(lambda: _body().surface_field, time=0.0),
    "Body.surface_mesh": _call(lambda: _body().surface_mesh, time=0.0, resolution=4, tolerance=0.1),
    "Bone": _call(lambda: fs.Bone, name="thigh", parent="hip", joint=fs.Pose(), motion=MOTION),
    "Bounce": _call(lambda: fs.Bounce, restitution=0.5, friction=0.5, rolling=True),
    "Box": _call(lambda: fs.Box, size=(1.0, 1.0, 1.0), center=ORIGIN),
    "Camera": _call(
        lambda: fs.Camera,
        eye=of_time((0.0, -5.0, 1.0)),
        look_at=of_time(ORIGIN),
        up=of_time(UP),
        fov=of_time(40.0),
        aperture=of_time(0.0),
        focus=of_time(1.0),
        shutter=of_time(0.0),
        exposure=of_time(0.0),
        tone=of_time("clip"),
    ),
    "Camera.at": _call(lambda: CAMERA.at, time=0.0),
    "Camera.axes": _call(lambda: CAMERA.axes),
    "Camera.orbit": _call(
        lambda: fs.Camera.orbit,
        look_at=of_time(ORIGIN),
        radius=of_time(5.0),
        height=of_time(1.0),
        period=20.0,
        phase=0.0,
        clockwise=True,
        fov=of_time(40.0),
    ),
    "Capsule": _call(lambda: fs.Capsule, start=ORIGIN, end=UP, radius=1.0),
    "Cauchy": _call(lambda: fs.Cauchy, s=1.0),
    "Checker": _call(lambda: fs.Checker, **_parts(WOOLLY, "color", "other", "scale")),
    "Circle": _call(lambda: fs.Circle, **ROUND),
    "Clouds": _call(lambda: fs.Clouds, **_parts(WOOLLY, "color", "other", "scale", "seed")),
    "Cylinder": _call(lambda: fs.Cylinder, start=ORIGIN, end=UP, radius=1.0),
    "DirectionalLight": _call(lambda: fs.DirectionalLight, **LIGHT, direction=UP, angle=1.0),
    "Ellipsoid": _call(lambda: fs.Ellipsoid, radii=(1.0, 1.0, 1.0), center=ORIGIN),
    "EnergyLog": _call(lambda: fs.EnergyLog, simulation=_simulation()),
    "EnergyLog.record": _call(lambda: fs.EnergyLog(_simulation()).record),
    "EnergyLog.report": _call(lambda: fs.EnergyLog(_simulation()).report),
    "Face": _call(lambda: fs.Face, **CORNERS, center=of_time(ORIGIN), reach=of_time(2.0)),
    "Field": _call(lambda: fs.Field, primitives=SKELETON, kernel=fs.Gaussian(), strength=Or(1.0, (1.0,), len, (len,))),
    "Field.__add__": _call(lambda: _field().__add__, other=_field()),
    "Field.__mul__": _call(lambda: _field().__mul__, factor=2.0),
    "Field.__sub__": _call(lambda: _field().__sub__, other=_field()),
    "Field.at": _call(lambda: _field().at, time=0.0),
    "Field.gradient": _call(lambda: _field().gradient, points=Or(POINTS, UP)),
    "Field.hessian": _call(lambda: _field().hessian, points=Or(POINTS, UP)),
    "Field.mesh": _call(lambda: _field().mesh, level=1.0, resolution=4, tolerance=0.1),
    "Field.of_elements": _call(lambda: fs.Field.of_elements, elements=_field().elements),
    "Field.of_terms": _call(lambda: fs.Field.of_terms, terms=_field().terms, packed=(_field().elements,)),
    "Field.value": _call(lambda: _field().value, points=Or(POINTS, UP)),
    "Field.value_and_gradient": _call(lambda: _field().value_and_gradient, points=Or(POINTS, UP)),
    "Film": _call(lambda: fs.Film, path=_folder() / "film.mp4", size=(2, 2), fps=30.0, planned=3),
    "Film.write": _call(lambda: _open_film().write, image=np.zeros((2, 2, 3), np.uint8)),
    "Fog": _call(lambda: fs.Fog, density=0.1, color=COLOR),
    "Gaussian": _call(lambda: fs.Gaussian, a=1.0),
    "Ground": _call(lambda: fs.Ground, point=Or(ORIGIN, 0.0), normal=UP, checker=COLOR, tile=1.0, extent=(1.0, 1.0)),
    "ImageTexture": _call(
        lambda: fs.ImageTexture, image=Or(np.zeros((2, 2, 3)), "x", np.zeros((2, 2))), repeat=(1.0, 1.0)
    ),
    "InverseSquare": _call(lambda: fs.InverseSquare, softening=1.0),
    "Keyframes": _call(
        lambda: fs.Keyframes,
        times=[0.0, 1.0, 2.0],
        values=Or(np.zeros((3, 2)), np.zeros(3), (fs.Pose(), fs.Pose(), fs.Pose())),
        interpolation="cubic",
        loop=True,
    ),
    "Keyframes.__call__": _call(lambda: fs.Keyframes([0, 1], [0, 1]), time=0.5),
    "Marble": _call(lambda: fs.Marble, **WOOLLY),
    "Material": _call(
        lambda: fs.Material,
        color=of_time(TEXTURE),
        radius=of_time(0.2),
        blobbiness=of_time(-4.0),
        kernel=Or(fs.Gaussian, fs.Gaussian()),
        threshold=of_time(1.0),
        ambient=of_time(1.0),
        diffuse=of_time(1.0),
        specular=of_time(1.0),
        shininess=of_time(1.0),
        level=of_time(1.0),
        reflection=of_time(0.0),
        transmission=of_time(0.0),
        ior=of_time(1.5),
        visible_to=Or(("camera",), "camera"),
    ),
    "Material.at": _call(lambda: fs.Material().at, time=0.0),
    "Material.strength_on": _call(lambda: fs.Material().strength_on, primitive=fs.Point(ORIGIN)),
    "Material.surface_strength": _call(lambda: fs.Material().surface_strength, dimension=1),
    "Metaball": _call(lambda: fs.Metaball, radius=1.0),
    "Newtonian": _call(lambda: fs.Newtonian, softening=1.0),
    "Particles": _call(
        lambda: fs.Particles,
        positions=POINTS,
        velocities=POINTS,
        radius=0.1,
        contact=Or(fs.Bounce(), fs.Absorb(), fs.Repulsion(1.0)),
        color=COLOR,
        name="pebbles",
        gravity=fs.Newtonian(),
        mass=1.0,
        G=1.0,
    ),
    "Picture": _call(lambda: fs.Picture, draw=_figure, title="plot"),
    "Picture.save": _call(lambda: fs.Picture(_figure).save, path=_folder() / "plot.svg", size=(40, 40)),
    "Plane": _call(lambda: fs.Plane, point=of_time(ORIGIN), normal=of_time(UP)),
    "Point": _call(lambda: fs.Point, position=of_time(ORIGIN)),
    "PointLight": _call(lambda: fs.PointLight, **LIGHT, position=UP, radius=1.0),
    "Pose": _call(lambda: fs.Pose, position=ORIGIN, rotation=(1.0, 0.0, 0.0, 0.0)),
    "Pose.__matmul__": _call(lambda: fs.Pose().__matmul__, inner=fs.Pose()),
    "Pose.apply": _call(lambda: fs.Pose().apply, points=Or(POINTS, UP, POINTS[None])),
    "Pose.turned": _call(lambda: fs.Pose.turned, axis=UP, angle=1.0, position=ORIGIN),
    "Primitive.turns_about": _call(lambda: fs.Point(ORIGIN).turns_about, point=ORIGIN, axis=UP),
    "Primitive.at": _call(lambda: fs.Point(ORIGIN).at, time=0.0),
    "Profile": _call(lambda: fs.Profile, coefficients=(1.0, 2.0), shape="hat"),
    "ProfiledArc": _call(lambda: fs.ProfiledArc, **ARC, **PROFILE),
    "ProfiledSegment": _call(lambda: fs.ProfiledSegment, **ENDS, **PROFILE),
    "Quartic": _call(lambda: fs.Quartic, radius=1.0),
    "Radau": _call(lambda: fs.Radau, tolerance=1e-6),
    "Recorded": _call(lambda: fs.Recorded, path=_recorded().path),
    "Recorded.at": _call(lambda: _recorded().at, time=0.0, world=_world()),
    "Recorded.differences": _call(lambda: _recorded().differences, scenario=_scenario()),
    "Recorded.snapshot": _call(lambda: _recorded().snapshot, index=0, world=_world()),
    "Recorded.snapshots": _call(lambda: _recorded().snapshots, world=_world()),
    "Recording": _call(lambda: fs.Recording, path=_folder() / "run.npz", about={"seed": 1}, planned=3),
    "Recording.add": _call(lambda: _open_recording().add, snapshot=_world().at(0.0)),
    "Renderer": _call(
        lambda: fs.Renderer,
        size=SIZE,
        quality="draft",
        device="cpu",
        shadows=True,
        samples=1,
        exposures=1,
        tolerance=1e-5,
        mode="soft",
        solver="hermite",
    ),
    "Renderer.depth_and_normals": _call(
        lambda: _renderer().depth_and_normals, snapshot=_world().at(0.0), camera=CAMERA
    ),
    "Renderer.frame": _call(
        lambda: _renderer().frame, snapshot=Or(_world().at(0.0), (_world().at(0.0),)), camera=CAMERA
    ),
    "Renderer.layers": _call(lambda: _renderer().layers, snapshot=_world().at(0.0), camera=CAMERA),
    "Repulsion": _call(lambda: fs.Repulsion, stiffness=1.0, reach=1.0),
    "Rig": _call(lambda: fs.Rig, bones=(fs.Bone("thigh"),)),
    "Rig.carry": _call(lambda: _rig().carry, name="thigh", primitive=fs.Point(ORIGIN)),
    "Rig.pose": _call(lambda: _rig().pose, name="thigh", time=0.0),
    "Rigid": _call(
        lambda: fs.Rigid,
        position=ORIGIN,
        rotation=(1.0, 0.0, 0.0, 0.0),
        velocity=ORIGIN,
        angular_velocity=ORIGIN,
        inertia=Or("solid", np.eye(3)),
        mass=1.0,
        center=ORIGIN,
        stiffness=1.0,
    ),
    "Scenario": _call(
        lambda: fs.Scenario,
        world=_world(),
        camera=CAMERA,
        duration=1.0,
        fps=10.0,
        integrator=INTEGRATOR,
        title="film",
        name="film",
        parameters={"seed": 1},
    ),
    "Scenario.begin": _call(lambda: _scenario().begin, device="cpu"),
    "Section": _call(lambda: fs.Section, point=ORIGIN, normal=UP, direction=1, spin=SPIN),
    "Section.seen": _call(lambda: fs.Section(spin=SPIN).seen, times=np.zeros(3), x=POINTS, v=POINTS),
    "Segment": _call(lambda: fs.Segment, **ENDS),
    "ShapeGroup": _call(
        lambda: fs.ShapeGroup,
        shapes=Or(fs.Ball(), (fs.Ball(),)),
        materials=Or(fs.Material(), (fs.Material(),)),
        motion=MOTION,
        name="balls",
    ),
    "ShapeGroup.poses_at": _call(lambda: _group().poses_at, time=0.0),
    "Simulation": _call(lambda: fs.Simulation, world=_world(), integrator=fs.Leapfrog(0.1), time=0.0, **DEVICE, log=4),
    "Simulation.advance": _call(lambda: _simulation().advance, until=0.01),
    "Simulation.census": _call(lambda: _simulation().census),
    "Simulation.set_body": _call(
        lambda: _free().set_body,
        index=0,
        position=ORIGIN,
        rotation=(1.0, 0.0, 0.0, 0.0),
        velocity=ORIGIN,
        angular_velocity=ORIGIN,
    ),
    "Simulation.set_particles": _call(
        lambda: _ready().set_particles, index=0, positions=POINTS[:1], velocities=POINTS[:1], spins=POINTS[:1]
    ),
    "Simulation.snapshot": _call(lambda: _simulation().snapshot),
    "Simulation.snapshots": _call(lambda: lambda times: list(_simulation().snapshots(times)), times=np.array([0.0])),
    "Simulation.watch": _call(lambda: _simulation().watch, watcher=len, sums=[]),
    "Simulation.wrenches": _call(lambda: _simulation().wrenches),
    "Snapshot": _call(
        lambda: fs.Snapshot,
        world=_world(),
        time=0.0,
        poses=(fs.Pose(),),
        positions=(POINTS[:1],),
        velocities=(POINTS[:1],),
        shape_poses=Or((), np.zeros((0, 3))),
    ),
    "Snapshot.surface_field": _call(lambda: _world().at(0.0).surface_field),
    "Snapshot.surface_mesh": _call(lambda: _world().at(0.0).surface_mesh, resolution=4, tolerance=0.1),
    "Snapshot.poses_at": _call(lambda: _world().at(0.0).poses_at, index=0, times=np.zeros(1)),
    "SoftObject": _call(lambda: fs.SoftObject, radius=1.0),
    "SolidTexture": _call(lambda: fs.SolidTexture, **_parts(WOOLLY, "color", "other", "scale")),
    "Spin": _call(lambda: fs.Spin, axis=UP, rate=1.0, phase=0.0, center=ORIGIN),
    "Spin.__call__": _call(lambda: SPIN, time=0.5),
    "Spin.same_as": _call(lambda: SPIN.same_as, other=SPIN),
    "Spin.same_line": _call(lambda: SPIN.same_line, other=SPIN),
    "Splitting.steps": _call(lambda: fs.Leapfrog(0.1).steps, duration=1.0),
    "TaperedSegment": _call(lambda: fs.TaperedSegment, **ENDS, start_density=of_time(1.0), end_density=of_time(2.0)),
    "Triangle": _call(lambda: fs.Triangle, **CORNERS),
    "TriangleMesh": _call(lambda: fs.TriangleMesh, vertices=POINTS, faces=np.array([[0, 1, 2]])),
    "TriangleMesh.flipped": _call(lambda: _mesh().flipped),
    "TriangleMesh.save": _call(lambda: _mesh().save, path=_folder() / "box.ply"),
    "TriangleMesh.triangles": _call(lambda: _mesh().triangles),
    "TriangleSurface": _call(lambda: fs.TriangleSurface, mesh=_mesh(), smooth=True),
    "Wood": _call(lambda: fs.Wood, **WOOLLY),
    "World": _call(
        lambda: fs.World,
        lights=(fs.DirectionalLight(direction=UP), fs.PointLight(position=UP)),
        background=fs.Background(),
        fog=fs.Fog(),
        escape_radius=10.0,
    ),
    "World.add_body": _call(lambda: fs.World().add_body, body=_body()),
    "World.add_particles": _call(lambda: fs.World().add_particles, positions=POINTS, velocities=POINTS, radius=0.1),
    "World.add_shape": _call(
        lambda: fs.World().add_shape,
        shape=Or(fs.Ball(), (fs.Ball(),)),
        material=Or(fs.Material(), (fs.Material(),)),
        motion=MOTION,
        name="balls",
    ),
    "World.replace": _call(
        lambda: _world().replace,
        bodies=[_body()],
        particles=(),
        shapes=[_group()],
        lights=(fs.DirectionalLight(UP), fs.PointLight(UP)),
        background=Or(fs.Background(), None),
        fog=Or(fs.Fog(), None),
        escape_radius=Or(10.0, None),
    ),
    "World.frozen": _call(lambda: _world().frozen),
    "World.at": _call(lambda: _world().at, time=0.0),
    "angular_momentum": _call(lambda: fs.angular_momentum, snapshot=_world().at(0.0), center=ORIGIN),
    "bezier": _call(lambda: fs.bezier, points=np.vstack([POINTS, POINTS[:1] + 1.0]), tolerance=0.1),
    "box": _call(lambda: fs.box, center=ORIGIN, size=(1.0, 1.0, 1.0)),
    "catmull_rom": _call(lambda: fs.catmull_rom, points=POINTS, closed=True, tolerance=0.1),
    "common_spin": _call(lambda: fs.common_spin, world=_world()),
    "disc": _call(lambda: fs.disc, center=ORIGIN, normal=UP, radius=1.0, tolerance=0.1),
    "energy": _call(lambda: fs.energy, snapshot=_world().at(0.0)),
    "film": _call(
        lambda: fs.film,
        scenario=_scenario(),
        out=_folder() / "film.png",
        integrator=INTEGRATOR,
        size=SIZE,
        fps=10.0,
        duration=0.1,
        device="cpu",
        quality="draft",
        preview=True,
        record=_folder() / "filmed.npz",
        replay=_recorded().path,
        mode="soft",
        layer="depth",
        beside=None,
        watch=lambda done, count: None,
    ),
    "gravity": _call(lambda: fs.gravity, primitives=SKELETON, mass=of_time(1.0), G=1.0, kernel=fs.Newtonian()),
    "jacobi": _call(lambda: fs.jacobi, snapshot=_world().at(0.0), spin=SPIN),
    "load": _call(lambda: fs.load, name=_script()),
    "lyapunov": _call(
        lambda: fs.lyapunov,
        world=_world(),
        duration=0.1,
        integrator=fs.Leapfrog(0.1),
        count=1,
        samples=1,
        seed=1,
        **DEVICE,
    ),
    "main": _call(lambda: fs.main, build=_build, argv=("--help",)),
    "mesh": _call(
        lambda: fs.mesh, path_or_vertices=Or(POINTS, "x", (fs.Triangle(*POINTS),)), faces=np.array([[0, 1, 2]])
    ),
    "planets.asterisk": _call(lambda: fs.planets.asterisk, arms=6, radius=1.0, **CENTERED),
    "planets.brick": _call(lambda: fs.planets.brick, size=(1.0, 1.0, 1.0), center=ORIGIN),
    "planets.cigar": _call(lambda: fs.planets.cigar, length=1.0, center=ORIGIN, axis=UP),
    "planets.cross": _call(lambda: fs.planets.cross, length=1.0, **CENTERED),
    "planets.donut": _call(lambda: fs.planets.donut, radius=1.0, **CENTERED),
    "planets.helix": _call(lambda: fs.planets.helix, turns=1.0, radius=1.0, height=1.0, **CENTERED, tolerance=0.1),
    "planets.jack": _call(lambda: fs.planets.jack, length=1.0, center=ORIGIN),
    "planets.knot": _call(lambda: fs.planets.knot, radius=1.0, **CENTERED, tolerance=0.1),
    "planets.pancake": _call(lambda: fs.planets.pancake, radius=1.0, **CENTERED, tolerance=0.1),
    "planets.spiral": _call(lambda: fs.planets.spiral, turns=1.0, radius=1.0, inner=0.1, **CENTERED, tolerance=0.1),
    "planets.star": _call(lambda: fs.planets.star, points=5, radius=1.0, inner=0.5, **CENTERED),
    "plots.energy": _call(lambda: fs.plots.energy, log=_log(), size=(40, 40)),
    "plots.figure": _call(lambda: fs.plots.figure, size=(40, 40)),
    "plots.lyapunov": _call(lambda: fs.plots.lyapunov, result=_lyapunov(), size=(40, 40)),
    "plots.orbits": _call(lambda: fs.plots.orbits, positions=np.zeros((2, 1, 3)), plane="xy", size=(40, 40)),
    "plots.section": _call(
        lambda: fs.plots.section,
        x=np.zeros(2),
        y=np.zeros(2),
        colors=np.zeros(2),
        labels=("x", "y"),
        title="section",
        color_label="z",
        size=(40, 40),
    ),
    "poincare": _call(
        lambda: fs.poincare,
        world=_world(),
        section=fs.Section(),
        duration=0.1,
        integrator=Or(fs.Leapfrog(0.1), fs.Radau()),
        **DEVICE,
    ),
    "polygon": _call(lambda: fs.polygon, points=POINTS),
    "polyline": _call(lambda: fs.polyline, points=POINTS, closed=True),
    "profile.constant": _call(lambda: fs.profile.constant, factor=1.0),
    "profile.hat": _call(lambda: fs.profile.hat, ends=0.0, middle=1.0),
    "profile.linear": _call(lambda: fs.profile.linear, start=0.0, end=1.0),
    "profile.polynomial": _call(lambda: lambda coefficients: fs.profile.polynomial(coefficients), coefficients=1.0),
    "profile.sine": _call(lambda: fs.profile.sine, ends=0.0, middle=1.0),
    "profiled": _call(lambda: fs.profiled, primitive=fs.Segment(ORIGIN, UP), profile=fs.Profile((1.0,))),
    "rectangle": _call(lambda: fs.rectangle, center=ORIGIN, u=(1.0, 0.0, 0.0), v=UP),
    "render": _call(
        lambda: fs.render,
        snapshot=Or(_world().at(0.0), (_world().at(0.0),)),
        camera=CAMERA,
        size=SIZE,
        quality="draft",
        device="cpu",
    ),
    "sampling.ball": _call(lambda: fs.sampling.ball, radius=1.0, **SPEEDY),
    "sampling.box": _call(lambda: fs.sampling.box, low=ORIGIN, high=UP, **SEEDED),
    "sampling.cylinder": _call(lambda: fs.sampling.cylinder, radius=RANGE, height=(0.0, 1.0), center=ORIGIN, **SEEDED),
    "sampling.disk": _call(lambda: fs.sampling.disk, radius=RANGE, thickness=0.1, normal=UP, **SPEEDY),
    "sampling.orbits": _call(
        lambda: fs.sampling.orbits, radius=RANGE, mass=1.0, G=1.0, tilt=0.1, count=3, seed=1, **CENTERED
    ),
    "sampling.shell": _call(lambda: fs.sampling.shell, radius=RANGE, **SPEEDY),
    "solid": _call(lambda: fs.solid, mesh=_mesh(), density=1.0, G=1.0),
    "solid_faces": _call(lambda: fs.solid_faces, mesh=_mesh()),
    "timeline": _call(lambda: fs.timeline, seconds=1.0, fps=10.0),
}


# What messages call what was called, where it is something else.
ALIASES = {
    "Body.surface_mesh": ("mesh",),
    "Snapshot.surface_mesh": ("mesh",),
    "World.replace": ("World",),
    "Primitive.at": ("Point",),
    "Recorded": ("recording",),
    "ShapeGroup": ("World.add_shape",),
    "ShapeGroup.poses_at": ("World.add_shape",),
    "Simulation.advance": ("Leapfrog",),
    "Splitting.steps": ("Leapfrog",),
    "World.add_particles": ("Particles",),
    "film": ("Film", "Recording", "recording"),
    "gravity": ("skeleton",),
    "load": ("scenario",),
    "lyapunov": ("Leapfrog",),
    "mesh": ("TriangleMesh",),
    "poincare": ("Leapfrog",),
}
NAMES = {"primitives": "skeleton", "path_or_vertices": "vertices", "x": "shape"}


def _public():
    """Every public callable: its name in `CALLS`, and itself."""
    for name in fs.__all__:
        thing = getattr(fs, name)
        if isinstance(thing, types.ModuleType):
            functions = {n: f for n, f in vars(thing).items() if not n.startswith("_") and inspect.isfunction(f)}
            yield from ((f"{name}.{n}", f) for n, f in functions.items() if f.__module__ == thing.__name__)
        elif not isinstance(thing, type):
            yield name, thing
        elif not issubclass(thing, BaseException):
            if name not in RESULTS | BASES:
                yield name, thing
            yield from _methods(thing)


def _methods(kind):
    for owner in kind.__mro__:
        if owner.__module__.startswith("fieldsim"):
            for name, raw in vars(owner).items():
                public = name in OPERATORS or not name.startswith("_")
                if public and name not in OWN and isinstance(raw, types.FunctionType | classmethod | staticmethod):
                    yield f"{owner.__name__}.{name}", getattr(kind, name)


def test_every_public_callable_and_parameter_is_tried():
    public = dict(_public())
    aliases = {"profile.profiled", "plots.checked_path"}
    assert set(public) - aliases == set(CALLS)
    for name, (_make, arguments) in CALLS.items():
        taken = set(inspect.signature(public[name]).parameters) - {"self", "options", "changes", "cls"}
        assert taken <= set(arguments), name


def test_every_public_callable_says_what_it_returns():
    silent = [
        name
        for name, function in _public()
        if not isinstance(function, type) and inspect.signature(function).return_annotation is inspect.Signature.empty
    ]
    assert not silent


def _first(right):
    return right.first if isinstance(right, Or) else right


def _flaw(said, callable_name, name, bad):
    """What a message lacks: the object as the user called it, what is wrong by its name or value, a remedy."""
    owners = {callable_name, *callable_name.split("."), *ALIASES.get(callable_name, ()), "device"}
    if not any(owner in said for owner in owners):
        return f"names no {callable_name}: {said}"
    if (
        NAMES.get(name, name) not in said
        and name not in said
        and validate.shown(bad) not in said
        and (isinstance(bad, Hostile) or str(bad) not in said)
    ):
        return f"names neither {name} nor its value: {said}"
    return "" if "; " in said else f"no remedy: {said}"


def _outcome(callable_name, function, arguments, name, label):
    """What a call with one bad value did: "" where that is right."""
    right, bad = arguments[name], BAD[label]
    default = inspect.signature(function).parameters.get(name)
    allowed = means(bad, right) or (bad is None and default is not None and default.default is None)
    given = {key: _first(value) for key, value in arguments.items()} | {name: bad}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", fs.FieldsimWarning)
            function(**given)
    except fs.FieldsimError as error:
        return "" if allowed else _flaw(str(error), callable_name, name, bad)
    except SystemExit:
        return "" if allowed and name in ("build", "argv") else "left the process"
    except BaseException as error:
        return f"{type(error).__name__}: {error}"
    return "" if allowed else "was taken"


@pytest.mark.parametrize("callable_name", CALLS)
def test_bad_values_are_refused(callable_name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make, arguments = CALLS[callable_name]
    wrong = {}
    for name, label in itertools.product(arguments, BAD):
        outcome = _outcome(callable_name, make(), arguments, name, label)
        if outcome:
            wrong[name, label] = outcome
    assert not wrong, "\n".join(f"{name} = {label}: {outcome}" for (name, label), outcome in wrong.items())
