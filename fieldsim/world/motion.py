"""Functions of time: keyframes for any parameter, and motions that give a body its pose."""

import bisect
import dataclasses
import math

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.world.quaternion import matrices


def value_at(value, time: float):
    """`value`, or `value(time)` where it is a function of time."""
    return value(time) if callable(value) else value


class Keyframes:
    """A function of time through given values: numbers, vectors or arrays of any one shape.

    times: increasing, at least one; values: one per time. interpolation: "cubic" (Catmull-Rom with the true time steps:
    smooth, exact for straight uniform motion), "linear" or "step". Before the first and after the last key the value
    stays, unless `loop`: then time wraps, and the last key should equal the first.
    """

    def __init__(self, times, values, *, interpolation: str = "cubic", loop: bool = False):
        self.times = [validate.number("Keyframes", f"times[{i}]", t) for i, t in enumerate(times)]
        try:
            self.values = np.asarray(values, dtype=float)
        except (TypeError, ValueError):
            raise InputError(
                "Keyframes: values differ in shape; give one number or vector of one length per time"
            ) from None
        self.interpolation, self.loop = interpolation, loop
        if not self.times or self.values.ndim == 0 or len(self.times) != len(self.values):
            count = len(self.values) if self.values.ndim else 0
            raise InputError(f"Keyframes: {len(self.times)} times for {count} values; give one value per time")
        if any(b <= a for a, b in zip(self.times, self.times[1:], strict=False)):
            raise InputError(f"Keyframes: times {self.times} do not increase; sort them and drop repeats")
        if not np.isfinite(self.values).all():
            raise InputError("Keyframes: a value is not finite; give finite numbers")
        if interpolation not in ("cubic", "linear", "step"):
            raise InputError(f"Keyframes: interpolation is {interpolation!r}; give 'cubic', 'linear' or 'step'")

    def __call__(self, time: float):
        """The value at `time`: a float, or an array of the keys' shape."""
        result = self._value(time)
        return float(result) if result.ndim == 0 else result

    def _value(self, time):
        first, last = self.times[0], self.times[-1]
        if self.loop and last > first:
            time = first + (time - first) % (last - first)
        if time <= first:
            return self.values[0]
        if time >= last:
            return self.values[-1]
        k = bisect.bisect_right(self.times, time) - 1
        step = self.times[k + 1] - self.times[k]
        u = (time - self.times[k]) / step
        if self.interpolation == "step":
            return self.values[k]
        if self.interpolation == "linear":
            return (1 - u) * self.values[k] + u * self.values[k + 1]
        return (
            (1 + 2 * u) * (1 - u) ** 2 * self.values[k]
            + u * (1 - u) ** 2 * step * self._slope(k)
            + u * u * (3 - 2 * u) * self.values[k + 1]
            + u * u * (u - 1) * step * self._slope(k + 1)
        )

    def _slope(self, k):
        """Catmull-Rom tangent at key k: the mean speed over its two neighbours, zero at ends that do not loop."""
        count = len(self.times)
        if 0 < k < count - 1:
            return (self.values[k + 1] - self.values[k - 1]) / (self.times[k + 1] - self.times[k - 1])
        if not self.loop or count < 3:
            return np.zeros_like(self.values[k])
        steps = self.times[1] - self.times[0] + self.times[-1] - self.times[-2]
        return (self.values[1] - self.values[-2]) / steps


@dataclasses.dataclass(frozen=True)
class Pose:
    """Position and orientation of a body: x_world = R x_body + position. Rotation: unit quaternion (w, x, y, z)."""

    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self):
        object.__setattr__(self, "position", validate.vector("Pose", "position", self.position))
        rotation = np.asarray(self.rotation, dtype=float)
        if rotation.shape != (4,) or not np.isfinite(rotation).all() or not np.any(rotation):
            raise InputError(f"Pose: rotation is {self.rotation!r}; give a unit quaternion (w, x, y, z)")
        object.__setattr__(self, "rotation", tuple((rotation / np.linalg.norm(rotation)).tolist()))

    @classmethod
    def turned(cls, axis, angle: float, position=(0.0, 0.0, 0.0)) -> "Pose":
        """The pose after a right-handed turn by `angle` (radians) about `axis` through the body's origin."""
        x, y, z = validate.direction("Pose", "axis", axis)
        s = math.sin(angle / 2)
        return cls(position, (math.cos(angle / 2), s * x, s * y, s * z))

    @property
    def matrix(self) -> np.ndarray:
        """Rotation matrix R, (3, 3)."""
        return matrices(self.rotation)

    @property
    def is_identity(self) -> bool:
        """Whether body and world frames coincide."""
        return self == IDENTITY


IDENTITY = Pose()


@dataclasses.dataclass(frozen=True)
class Spin:
    """Uniform rotation: at time t the body is turned by phase + rate t about `axis` through `center`.

    rate: radians per unit of time, right-handed about axis. In the frame that turns along, the Jacobi integral is kept.
    """

    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    rate: float = 1.0
    phase: float = 0.0
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self):
        object.__setattr__(self, "axis", validate.direction("Spin", "axis", self.axis))
        object.__setattr__(self, "center", validate.vector("Spin", "center", self.center))
        for name in ("rate", "phase"):
            object.__setattr__(self, name, validate.number("Spin", name, getattr(self, name)))

    def __call__(self, time: float) -> Pose:
        """The pose at `time`."""
        turned = Pose.turned(self.axis, self.phase + self.rate * time)
        center = np.asarray(self.center)
        return Pose(tuple(center - turned.matrix @ center), turned.rotation)


def pose_at(motion, time: float) -> Pose:
    """The pose that a motion (a Pose, or a function of time giving a Pose or a position) gives at `time`."""
    pose = value_at(motion, time)
    return pose if isinstance(pose, Pose) else Pose(pose)


def timeline(seconds: float, fps: float = 30.0) -> list[float]:
    """The times of the frames of a film: 0, 1/fps, ... below `seconds`. At least one frame."""
    seconds = validate.number("timeline", "seconds", seconds, above=0.0)
    fps = validate.number("timeline", "fps", fps, above=0.0)
    return [frame / fps for frame in range(frame_count(seconds, fps))]


def frame_count(seconds: float, fps: float) -> int:
    """Number of frames in a film."""
    return max(1, round(seconds * fps))
