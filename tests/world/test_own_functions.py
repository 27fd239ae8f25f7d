"""Functions of time that users write: what they raise or give wrongly names the object, the time and their line."""

import inspect
import math
import re

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.render.solids.packing import solids_of

ORIGIN = (0, 0, 0)


def _world(**options):
    world = fs.World()
    world.add_body(fs.Body(fs.Point(ORIGIN), gravity=fs.Newtonian(0.1), name="sun", **options))
    world.add_particles([(2, 0, 0)], [(0, 0.7, 0)])
    return world


def _shape(motion):
    world = fs.World()
    world.add_shape(fs.Ball(), motion=lambda time: motion(time) if time else ORIGIN)
    return world


def _rig(motion):
    return fs.Rig([fs.Bone("thigh", motion=lambda time: motion(time) if time else ORIGIN)])


# Every place where a function of time may stand: what messages call it, and how the place is asked at time 0.5.
PLACES = {
    "a primitive's point": ("Segment: start", lambda f: fs.Segment(f, (0, 0, 1)).at(0.5)),
    "a primitive's number": ("Circle: radius", lambda f: fs.Circle(ORIGIN, (0, 0, 1), f).at(0.5)),
    "a carried primitive": (
        "Segment: end",
        lambda f: _rig(lambda t: ORIGIN).carry("thigh", fs.Segment((0, 0, 9), f)).at(0.5),
    ),
    "a carried direction": (
        "Circle: normal",
        lambda f: _rig(lambda t: ORIGIN).carry("thigh", fs.Circle(ORIGIN, f, 1.0)).at(0.5),
    ),
    "a bone": ("Bone 'thigh': motion", lambda f: _rig(f).pose("thigh", 0.5)),
    "a body": ("Body 'sun': motion", lambda f: _world(motion=f).at(0.5)),
    "a body in a run": ("Body 'sun': motion", lambda f: fs.Simulation(_world(motion=f), time=0.5)),
    "a mass": ("mass", lambda f: fs.gravity(fs.Point(ORIGIN), f).at(0.5)),
    "a mass in a run": ("mass", lambda f: fs.Simulation(_world(mass=f), time=0.5)),
    "a strength": ("Field: strength", lambda f: fs.Field(fs.Point(ORIGIN), fs.Gaussian(), f).at(0.5)),
    "a scaled strength": ("Field: strength", lambda f: (-2 * fs.Field(fs.Point(ORIGIN), fs.Gaussian(), f)).at(0.5)),
    "a material": ("Material: radius", lambda f: fs.Material(radius=f).at(0.5)),
    "a colour": ("color", lambda f: fs.Material(color=f).at(0.5)),
    "a camera": ("Camera: fov", lambda f: fs.Camera((0, -5, 0), fov=f).at(0.5)),
    "an orbit": ("Camera.orbit: radius", lambda f: fs.Camera.orbit(radius=lambda t: f(t) if t else 5.0).at(0.5)),
    "a shape": ("World.add_shape: motion", lambda f: solids_of(_shape(f).at(0.5))),
}


def _line(function):
    return f"test_own_functions.py:{inspect.getsourcelines(function)[1]}"


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("given", [None, math.nan, "x", np.zeros((2, 2)), object, {}, 1j, (1, "x")], ids=str)
def test_an_answer_that_cannot_be_used(place, given):
    name, ask = PLACES[place]

    def wrong(time):
        return given

    with pytest.raises(fs.InputError, match=re.escape(name)) as caught:
        ask(wrong)
    said = str(caught.value)
    if "carried" not in place and "shape" not in place and "bone" not in place and "orbit" not in place:
        assert _line(wrong) in said
    assert "time 0.5" in said


@pytest.mark.parametrize("place", PLACES)
def test_a_function_that_raises(place):
    name, ask = PLACES[place]

    def failing(time):
        return 1 / 0

    with pytest.raises(fs.InputError, match=re.escape(name)) as caught:
        ask(failing)
    line = inspect.getsourcelines(failing)[1] + 1
    assert f"ZeroDivisionError: division by zero; see test_own_functions.py:{line} in failing" in str(caught.value)
    assert "at 0.5" in str(caught.value)


def test_the_line_is_the_users_where_a_package_raises():
    def singular(time):
        return np.linalg.inv(np.zeros((2, 2)))

    with pytest.raises(fs.InputError, match=r"test_own_functions\.py:[0-9]+ in singular"):
        fs.Segment(ORIGIN, singular).at(0.5)


def test_a_function_that_leaves_the_process_or_is_interrupted():
    def leaving(time):
        raise SystemExit(0)

    def interrupted(time):
        raise KeyboardInterrupt

    with pytest.raises(fs.InputError, match="SystemExit"):
        fs.Camera(leaving).at(0.5)
    with pytest.raises(KeyboardInterrupt):
        fs.Camera(interrupted).at(0.5)


@pytest.mark.parametrize("time", [None, math.nan, "x", (1, 2), 1j])
def test_times_that_are_none(time):
    for thing in (
        _world(),
        fs.Segment(lambda t: ORIGIN, (0, 0, 1)),
        fs.Camera(lambda t: (1, 1, t)),
        fs.Material(radius=abs),
    ):
        with pytest.raises(fs.InputError, match="time is"):
            thing.at(time)


def test_an_error_of_fieldsim_within_a_function_is_located_once():
    def thrown(time):
        return fs.Pose((0, 0, math.nan))

    rig = _rig(thrown)
    leg = rig.carry("thigh", fs.Segment(ORIGIN, (0, 0, -1)))
    line = inspect.getsourcelines(thrown)[1] + 1
    for ask in (lambda: _world(motion=thrown).at(0.5), lambda: leg.at(0.5)):
        with pytest.raises(fs.InputError, match="Pose: position is") as caught:
            ask()
        assert str(caught.value).count(f"test_own_functions.py:{line} in thrown") == 1
