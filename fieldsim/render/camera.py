"""Perspective cameras."""

import dataclasses
import functools
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.types import RealLike, Timed, VectorLike

TONES = ("clip", "filmic")


@dataclasses.dataclass(frozen=True)
class Camera:
    """A perspective camera at `eye`, looking at `look_at`. Every field may be a function of time, such as Keyframes.

    up: the direction that is up in the picture; a camera that looks along `up` uses another axis instead.
    fov: the vertical angle of view in degrees, in (0, 180); the horizontal one follows from the picture's shape.
    aperture: diameter of the lens: what is nearer or farther than `focus` blurs; 0 is a pinhole camera, all is sharp.
    focus: distance along the view at which things are sharp; None: the distance of look_at.
    shutter: exposure time of each frame, from the frame's time on: what moves meanwhile blurs.
    exposure: in stops; each stop doubles the light. tone: of TONES: "clip" cuts off what is brighter than white;
    "filmic" rolls it off as film does and deepens contrast (Narkowicz's fit of ACES).
    """

    eye: tuple[float, float, float]
    look_at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    fov: float = 40.0
    aperture: float = 0.0
    focus: float | None = None
    shutter: float = 0.0
    exposure: float = 0.0
    tone: str = "clip"

    if TYPE_CHECKING:

        def __init__(
            self,
            eye: Timed[VectorLike],
            look_at: Timed[VectorLike] = ...,
            up: Timed[VectorLike] = ...,
            fov: Timed[RealLike] = ...,
            aperture: Timed[RealLike] = ...,
            focus: Timed[RealLike] | None = ...,
            shutter: Timed[RealLike] = ...,
            exposure: Timed[RealLike] = ...,
            tone: Timed[str] = ...,
        ) -> None: ...

    def __post_init__(self):
        if not self.animated:
            self._check()

    @classmethod
    def orbit(
        cls,
        look_at: Timed[VectorLike] = (0.0, 0.0, 0.0),
        radius: Timed[RealLike] = 5.0,
        height: Timed[RealLike] = 2.0,
        period: RealLike = 20.0,
        phase: RealLike = 0.0,
        *,
        clockwise: bool = False,
        **options: Any,
    ) -> "Camera":
        """A camera that circles the vertical axis through `look_at`, looking at it.

        radius: of the circle, above 0; height: above `look_at`; period: time of one turn, above 0, counterclockwise
        seen from above unless `clockwise`; phase: angle from the x axis at time 0, in radians. look_at, radius and
        height may be functions of time. options: the camera's others, such as fov.
        """
        owner = "Camera.orbit"
        period = validate.number(owner, "period", period, above=0.0)
        phase = validate.number(owner, "phase", phase)
        rate = (-1 if validate.flag(owner, "clockwise", clockwise) else 1) * 2.0 * math.pi / period

        camera = cls(functools.partial(_orbiting, (look_at, radius, height), rate, phase), look_at, **options)
        camera.at(0.0)
        return camera

    @property
    def animated(self) -> bool:
        """Whether any field is a function of time."""
        return any(callable(getattr(self, field.name)) for field in dataclasses.fields(self))

    def at(self, time: float) -> "Camera":
        """The camera at `time`, checked; returns itself if no field is animated."""
        time = validate.number("Camera", "time", time)
        if not self.animated:
            return self
        values = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        return validate.at_time("Camera", Camera, values, time)

    def axes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Unit vectors (right, up, forward) of a camera that is not animated."""
        if self.animated:
            raise InputError("Camera.axes: the camera is a function of time; ask camera.at(time)")
        # The eye's own size could swallow the difference, so the difference is scaled before it is normalised.
        forward = np.asarray(self.look_at) - np.asarray(self.eye)
        forward = forward / np.max(np.abs(forward))
        forward /= np.linalg.norm(forward)
        up = np.asarray(self.up)
        right = np.cross(forward, up)
        if np.linalg.norm(right) < 1e-6:
            # The view is along `up`: use the coordinate axis that is least along the view instead.
            right = np.cross(forward, np.eye(3)[1 if abs(forward[1]) < 0.9 else 0])
        right /= np.linalg.norm(right)
        return right, np.cross(right, forward), forward

    def _check(self):
        validate.fields(self, validate.vector, "eye", "look_at")
        validate.fields(self, validate.direction, "up")
        if self.eye == self.look_at:
            raise InputError(f"Camera: eye and look_at are both {self.eye}; move one of them")
        validate.fields(self, validate.number, "fov", above=0.0, below=180.0)
        validate.fields(self, validate.number, "aperture", "shutter", at_least=0.0)
        if self.focus is not None:
            validate.fields(self, validate.number, "focus", above=0.0)
        validate.fields(self, validate.number, "exposure")
        validate.choice("Camera", "tone", self.tone, TONES)


def _orbiting(values, rate, phase, time):
    """The eye of `Camera.orbit` at a time. values: its look_at, radius and height."""
    owner = "Camera.orbit"

    def place(look_at, radius, height):
        radius = validate.number(owner, "radius", radius, above=0.0)
        height = validate.number(owner, "height", height)
        angle = phase + rate * time
        across = np.array([radius * math.cos(angle), radius * math.sin(angle), height])
        return validate.vector(owner, "look_at", look_at) + across

    return validate.at_time(owner, place, dict(zip(("look_at", "radius", "height"), values, strict=True)), time)
