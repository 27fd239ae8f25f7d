"""Worlds: bodies, particles, hard shapes, lights and a background."""

import copy
import warnings
from collections.abc import Iterable
from typing import Any

from fieldsim import validate
from fieldsim.errors import FieldsimWarning, InputError
from fieldsim.types import ArrayLike, RealLike
from fieldsim.world.body import Body
from fieldsim.world.light import DEFAULT_LIGHTS, Background, Fog, Light
from fieldsim.world.material import Material
from fieldsim.world.motion import IDENTITY
from fieldsim.world.particles import Particles
from fieldsim.world.shapes import PLAIN, GroupMotionLike, Shape, ShapeGroup
from fieldsim.world.snapshot import Snapshot


class World:
    """What there is. Plain values: physics and pictures read them.

    bodies, particles, shapes: tuples of what was added. escape_radius: a particle farther than this from the origin has
    escaped: it stays where it is. None: none ever does. What is assigned to these is checked as what is given.

    A script builds a world step by step, so a World can change. Whoever computes with it takes `world.frozen()`, its
    value at that moment, which refuses every change: a simulation, a snapshot, a picture never see a world change under
    them. The frozen value is a World too, so that every function takes either; it is one object until the world
    changes, so that "is it the same world?" is asked with `is`, and what was made of it once can be kept. `replace`
    copies either, with all that it has.
    """

    bodies: tuple[Body, ...]
    particles: tuple[Particles, ...]
    shapes: tuple[ShapeGroup, ...]
    lights: tuple[Light, ...]
    background: Background
    fog: Fog | None
    escape_radius: float | None
    # Whether it stays as it is; its frozen value, where one was asked for since the last change.
    _fixed = False
    _value: "World | None" = None

    def __init__(
        self,
        *,
        lights: Iterable[Light] = DEFAULT_LIGHTS,
        background: Background | None = None,
        fog: Fog | None = None,
        escape_radius: RealLike | None = None,
    ):
        given = {"lights": lights, "background": background, "fog": fog, "escape_radius": escape_radius}
        for name, value in ({"bodies": (), "particles": (), "shapes": ()} | given).items():
            setattr(self, name, value)
        _warn_of_darkness(self.lights)

    def __setattr__(self, name, value):
        self._set(name, FIELDS[name]("World", value) if name in FIELDS else value)

    def __delattr__(self, name):
        self._refuse_change()
        object.__delattr__(self, name)
        self.__dict__.pop("_value", None)

    def _set(self, name, value):
        self._refuse_change()
        object.__setattr__(self, name, value)
        self.__dict__.pop("_value", None)

    def _refuse_change(self):
        if self._fixed:
            raise InputError(
                "World: this one is the value that a Simulation, a Snapshot or the like was made of, and stays as it "
                "is; change the world that you built, or a world.replace(...), and make another Simulation of it"
            )

    def add_body(self, body: Body) -> Body:
        """Add a body and return it."""
        validate.instance("World.add_body", "body", body, Body, "write world.add_body(fs.Body(...))")
        self._set("bodies", (*self.bodies, body))
        return body

    def add_particles(self, positions: ArrayLike, velocities: ArrayLike, **options: Any) -> Particles:
        """Add a set of particles (see `Particles`) and return it."""
        particles = Particles(positions, velocities, **options)
        self._set("particles", (*self.particles, particles))
        return particles

    def add_shape(
        self,
        shape: Shape | Iterable[Shape],
        material: Material | Iterable[Material] = PLAIN,
        motion: GroupMotionLike = IDENTITY,
        *,
        name: str = "",
    ) -> ShapeGroup:
        """Add a hard object, or several that share a motion, which are seen but do not act; return their group.

        shape: `Ball`, `Ellipsoid`, `Box`, `Cylinder`, `Capsule`, `Ground`, `TriangleSurface`, or a list of such;
        material: its colour and lighting factors count; motion: see `ShapeGroup`.
        """
        group = ShapeGroup(shape, material, motion, name)
        self._set("shapes", (*self.shapes, group))
        return group

    def replace(self, **changes: Any) -> "World":
        """A world of its own that loses nothing, with `changes`: bodies, particles, shapes, lights, fog, ...

            quick = world.replace(particles=[p for p in world.particles if p.name == "dust"], escape_radius=None)

        Raises InputError as World does.
        """
        for name in changes:
            if name not in FIELDS:
                raise InputError(f"World.replace: a world has no {name!r}; give {', '.join(FIELDS)}")
        copied = copy.copy(self)
        copied.__dict__.pop("_fixed", None)
        for name, value in changes.items():
            copied._set(name, FIELDS[name]("World.replace", value))
        if "lights" in changes:
            _warn_of_darkness(copied.lights)
        return copied

    def frozen(self) -> "World":
        """The world as it is now, a value that refuses changes: itself where it is one, else one until it changes."""
        if self._fixed:
            return self
        value = self._value
        if value is None:
            value = copy.copy(self)
            object.__setattr__(value, "_fixed", True)
            object.__setattr__(self, "_value", value)
        return value

    def __getstate__(self):
        # A copy goes its own way: its frozen value is another one.
        return {name: value for name, value in vars(self).items() if name != "_value"}

    def at(self, time: RealLike) -> Snapshot:
        """The world at `time`: bodies with a motion as they are then, free ones and particles as they start."""
        time = validate.number("World.at", "time", time)
        return Snapshot(
            self.frozen(),
            time,
            tuple(body.pose_at(time) for body in self.bodies),
            tuple(p.positions for p in self.particles),
            tuple(p.velocities for p in self.particles),
        )


def _things(name, kind):
    """How a tuple of things is checked."""
    remedy = f"give a list of {kind.__name__}, as world.{name} is"
    return lambda owner, value: validate.instances(owner, name, value, kind, remedy)


def _lights(owner, value):
    return validate.instances(owner, "lights", value, Light, "give fs.PointLight or fs.DirectionalLight")


def _background(owner, value):
    remedy = "give fs.Background(top, bottom), or None"
    return validate.instance(owner, "background", value, Background | None, remedy) or Background()


def _fog(owner, value):
    return validate.instance(owner, "fog", value, Fog | None, "give fs.Fog(density), or None")


def _escape_radius(owner, value):
    return validate.optional(validate.number, owner, "escape_radius", value, above=0.0)


# What a world has, and how it is checked: functions of whom to name and of what is given, which return what is kept.
FIELDS = {
    "bodies": _things("bodies", Body),
    "particles": _things("particles", Particles),
    "shapes": _things("shapes", ShapeGroup),
    "lights": _lights,
    "background": _background,
    "fog": _fog,
    "escape_radius": _escape_radius,
}


def _warn_of_darkness(lights):
    if not lights:
        words = "World: there are no lights, only the background's own; give lights=[fs.DirectionalLight(...)]"
        warnings.warn(words, FieldsimWarning, stacklevel=3)


def given_world(owner: str, value) -> World:
    """The frozen value of what was given as a world."""
    return validate.instance(owner, "world", value, World, "give a fs.World").frozen()
