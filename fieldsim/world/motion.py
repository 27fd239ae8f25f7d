"""Functions of time: keyframes for any parameter, and motions that give a body its pose."""

import bisect
import dataclasses
import itertools
import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Generic, TypeAlias, TypeVar, overload

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.numerics import quaternion
from fieldsim.types import ArrayLike, RealLike, VectorLike

# What keyframes give: a Pose, a float or an array.
Value = TypeVar("Value")


@dataclasses.dataclass(frozen=True)
class Pose:
    """Position and orientation of a body: x_world = R x_body + position. Rotation: unit quaternion (w, x, y, z)."""

    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)

    if TYPE_CHECKING:

        def __init__(self, position: VectorLike = ..., rotation: VectorLike = ...) -> None: ...

    def __post_init__(self):
        owner, remedy = type(self).__name__, "give a unit quaternion (w, x, y, z)"
        validate.fields(self, validate.near_vector, "position")
        rotation = validate.numbers(owner, "rotation", self.rotation, shape=(4,), remedy=remedy)
        size = np.abs(rotation).max()
        if size == 0.0:
            raise InputError(f"{owner}: rotation is (0, 0, 0, 0); {remedy}")
        # Of a length of 1 by rounding the last bits stay.
        rotation = rotation if 1e-150 < size < 1e150 else rotation / size
        object.__setattr__(self, "rotation", tuple((rotation / np.linalg.norm(rotation)).tolist()))

    @classmethod
    def turned(cls, axis: VectorLike, angle: RealLike, position: VectorLike = (0.0, 0.0, 0.0)) -> "Pose":
        """The pose after a right-handed turn by `angle` (radians) about `axis` through the body's origin."""
        x, y, z = validate.direction("Pose.turned", "axis", axis)
        angle = validate.number("Pose.turned", "angle", angle)
        position = validate.vector("Pose.turned", "position", position)
        s = math.sin(angle / 2)
        return cls(position, (math.cos(angle / 2), s * x, s * y, s * z))

    @property
    def matrix(self) -> np.ndarray:
        """Rotation matrix R, (3, 3)."""
        return quaternion.matrices(self.rotation)

    def apply(self, points: ArrayLike) -> np.ndarray:
        """Points (..., 3) of the body's frame, in the world's."""
        points = validate.numbers("Pose.apply", "points", points)
        if points.ndim == 0 or points.shape[-1] != 3:
            raise InputError(f"Pose.apply: points have shape {points.shape}; give an array of shape (..., 3)")
        return points @ self.matrix.T + np.asarray(self.position)

    def __matmul__(self, inner: "Pose") -> "Pose":
        """The pose of what has the pose `inner` in the frame of a body that has this one."""
        validate.instance("Pose", "inner (what stands after @)", inner, Pose, "give a fs.Pose")
        return Pose(self.apply(inner.position), quaternion.product(self.rotation, inner.rotation))

    @property
    def is_identity(self) -> bool:
        """Whether body and world frames coincide."""
        return self == IDENTITY


IDENTITY = Pose()

# How things move: a pose, or a function of time that gives a pose or a position, such as a Spin or Keyframes; a
# position alone may be given, too.
Motion: TypeAlias = Pose | Callable[[float], Pose | VectorLike]
MotionLike: TypeAlias = Motion | VectorLike


# Two directions, places or rates that differ by this share of their size are one: by rounding.
SAME = 1e-12


@dataclasses.dataclass(frozen=True)
class Spin:
    """Uniform rotation: at time t the body is turned by phase + rate t about `axis` through `center`.

    rate: radians per unit of time, right-handed about axis. In the frame that turns along, the Jacobi integral is kept.
    """

    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    rate: float = 1.0
    phase: float = 0.0
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)

    if TYPE_CHECKING:

        def __init__(
            self,
            axis: VectorLike = ...,
            rate: RealLike = ...,
            phase: RealLike = ...,
            center: VectorLike = ...,
        ) -> None: ...

    def __post_init__(self):
        validate.fields(self, validate.direction, "axis")
        validate.fields(self, validate.near_vector, "center")
        validate.fields(self, validate.number, "rate", "phase")

    def __call__(self, time: RealLike) -> Pose:
        """The pose at `time`."""
        time = validate.number("Spin", "time", time)
        turned = Pose.turned(self.axis, self.phase + self.rate * time)
        center = np.asarray(self.center)
        return Pose(center - turned.matrix @ center, turned.rotation)

    def same_line(self, other: "Spin") -> bool:
        """Whether both turn about one line, in either sense, to rounding."""
        validate.instance("Spin.same_line", "other", other, Spin, "give a fs.Spin")
        axis, apart = np.array(self.axis), np.subtract(self.center, other.center)
        size = max(np.abs(self.center).max(), np.abs(other.center).max())
        aligned = np.linalg.norm(np.cross(axis, other.axis)) <= SAME
        return bool(aligned and np.linalg.norm(np.cross(axis, apart)) <= SAME * size)

    def same_as(self, other: "Spin") -> bool:
        """Whether both are one turning motion, however they are written and whatever their phases, to rounding."""
        validate.instance("Spin.same_as", "other", other, Spin, "give a fs.Spin")
        if not self.rate and not other.rate:
            return True
        rate = math.copysign(other.rate, other.rate * np.dot(self.axis, other.axis))
        return self.same_line(other) and abs(self.rate - rate) <= SAME * abs(rate)


class Keyframes(Generic[Value]):
    """A function of time through given values: numbers, vectors or arrays of any one shape, or poses.

    times: increasing, at least one; values: one per time. interpolation: "cubic" (Catmull-Rom with the true time steps:
    smooth, exact for straight uniform motion and uniform rotation), "linear" or "step". Before the first and after the
    last key the value stays, unless `loop`: then time wraps, and the last key should equal the first.
    Between two poses the body turns the shorter way round; give a key at least every half turn.
    """

    @overload
    def __init__(
        self: "Keyframes[Pose]", times: ArrayLike, values: Sequence[Pose], *, interpolation: str = ..., loop: bool = ...
    ): ...
    @overload
    def __init__(
        self: "Keyframes[float]",
        times: ArrayLike,
        values: Sequence[RealLike],
        *,
        interpolation: str = ...,
        loop: bool = ...,
    ): ...
    @overload
    def __init__(
        self: "Keyframes[np.ndarray]",
        times: ArrayLike,
        values: ArrayLike,
        *,
        interpolation: str = ...,
        loop: bool = ...,
    ): ...
    def __init__(
        self: "Keyframes[Any]",
        times: ArrayLike,
        values: ArrayLike | Sequence[Pose],
        *,
        interpolation: str = "cubic",
        loop: bool = False,
    ):
        remedy = "give a list of times that increase"
        self.times = validate.numbers("Keyframes", "times", times, shape=(None,), remedy=remedy).tolist()
        self.interpolation = validate.choice("Keyframes", "interpolation", interpolation, ("cubic", "linear", "step"))
        self.loop = validate.flag("Keyframes", "loop", loop)
        places, self.rotations = _split_poses(values)
        remedy = "give one number, vector or pose per time, all of one shape"
        self.values = validate.numbers("Keyframes", "values", places, remedy=remedy)
        if not self.times or self.values.ndim == 0 or len(self.times) != len(self.values):
            count = len(self.values) if self.values.ndim else 0
            raise InputError(f"Keyframes: {len(self.times)} times for {count} values; give one value per time")
        if any(b <= a for a, b in zip(self.times, self.times[1:], strict=False)):
            raise InputError(f"Keyframes: times {self.times} do not increase; sort them and drop repeats")
        if self.rotations is not None:
            self._turns = [_turn(p, q) for p, q in itertools.pairwise(self.rotations)]

    def __call__(self, time: RealLike) -> Value:
        """The value at `time`: a float, an array of the keys' shape, or a Pose."""
        k, u, step = self._span(validate.number("Keyframes", "time", time))
        result = self._value(k, u, step)
        if self.rotations is not None:
            result = Pose(result, self._rotation(self.rotations, k, u, step))
        elif result.ndim == 0:
            result = float(result)
        return result

    def rates(self, time: RealLike) -> tuple[np.ndarray, np.ndarray]:
        """How fast the value changes at `time`, in the keys' shape, and the angular velocity (3,) of poses, else 0.

        Exact; at a key the rates after it.
        """
        time = validate.number("Keyframes.rates", "time", time)
        still = np.zeros_like(self.values[0]), np.zeros(3)
        if self.interpolation == "step" or not (self.loop or self.times[0] <= time < self.times[-1]):
            return still
        if len(self.times) == 1:
            return still
        k, u, step = self._span(time)
        step = step or self.times[1] - self.times[0]
        turning = still[1] if self.rotations is None else self._angular_velocity(self.rotations[k], k, u, step)
        change = self.values[k + 1] - self.values[k]
        if self.interpolation == "linear":
            return change / step, turning
        first, last = self._slopes(k, np.diff(self.values, axis=0))
        growth = 6 * u * (1 - u) / step * change + (1 - u) * (1 - 3 * u) * first + u * (3 * u - 2) * last
        return growth, turning

    def _angular_velocity(self, start, k, u, step):
        """Of the product of turns in `_rotation`: each turns about its own vector, moved by those before it."""
        if self.interpolation == "linear":
            return quaternion.matrices(start) @ self._turns[k] / step
        total, turned = np.zeros(3), start
        rates = 3 * (1 - u) ** 2, 6 * u * (1 - u), 3 * u * u
        for (weight, vector), rate in zip(self._bezier(k, u, step), rates, strict=True):
            total += quaternion.matrices(turned) @ vector * (rate / step)
            turned = quaternion.product(turned, quaternion.exponential(weight * vector))
        return total

    def _span(self, time):
        """The key before `time`, the fraction u of the span to the next one, and that span's length."""
        first, last = self.times[0], self.times[-1]
        if self.loop and last > first:
            time = first + (time - first) % (last - first)
        if time <= first or last == first:
            return 0, 0.0, 0.0
        if time >= last:
            return len(self.times) - 1, 0.0, 0.0
        k = bisect.bisect_right(self.times, time) - 1
        step = self.times[k + 1] - self.times[k]
        return k, (time - self.times[k]) / step, step

    def _value(self, k, u, step):
        if u == 0.0 or self.interpolation == "step":
            return self.values[k]
        if self.interpolation == "linear":
            return (1 - u) * self.values[k] + u * self.values[k + 1]
        slopes = self._slopes(k, np.diff(self.values, axis=0))
        return (
            (1 + 2 * u) * (1 - u) ** 2 * self.values[k]
            + u * (1 - u) ** 2 * step * slopes[0]
            + u * u * (3 - 2 * u) * self.values[k + 1]
            + u * u * (u - 1) * step * slopes[1]
        )

    def _rotation(self, rotations, k, u, step):
        """The cubic Bezier curve in its cumulative form, with rotations for sums (Kim, Kim & Shin 1995)."""
        start = rotations[k]
        if u == 0.0 or self.interpolation == "step":
            return start
        turn = self._turns[k]
        if self.interpolation == "linear":
            return quaternion.product(start, quaternion.exponential(u * turn))
        result = start
        for weight, vector in self._bezier(k, u, step):
            result = quaternion.product(result, quaternion.exponential(weight * vector))
        return result

    def _bezier(self, k, u, step):
        """Weights at the fraction u of a span, and rotation vectors, of the three turns from the key k on."""
        first, last = (quaternion.exponential(-slope * step / 3) for slope in self._slopes(k, self._turns))
        between = quaternion.product(quaternion.product(first, quaternion.exponential(self._turns[k])), last)
        first, last = quaternion.logarithm(quaternion.inverse(first)), quaternion.logarithm(quaternion.inverse(last))
        return (1 - (1 - u) ** 3, first), (u * u * (3 - 2 * u), quaternion.logarithm(between)), (u**3, last)

    def _slopes(self, k, changes):
        """Catmull-Rom tangents at the keys k and k + 1; `changes`: from each key to the next."""
        return self._slope(k, changes), self._slope(k + 1, changes)

    def _slope(self, k, changes):
        """The mean speed over a key's two neighbours, zero at ends that do not loop."""
        count = len(self.times)
        if 0 < k < count - 1:
            return (changes[k - 1] + changes[k]) / (self.times[k + 1] - self.times[k - 1])
        if not self.loop or count < 3:
            return np.zeros_like(changes[0])
        return (changes[0] + changes[-1]) / (self.times[1] - self.times[0] + self.times[-1] - self.times[-2])


def _split_poses(values):
    """Positions and rotations of poses, or the values and None."""
    if not isinstance(values, list | tuple) or not any(isinstance(value, Pose) for value in values):
        return values, None
    validate.instances("Keyframes", "values", values, Pose, "give a fs.Pose for every time")
    return [pose.position for pose in values], [np.array(pose.rotation) for pose in values]


def _turn(p, q):
    """Rotation vector from rotation p to q, in the frame of p."""
    return quaternion.logarithm(quaternion.product(quaternion.inverse(p), q))


def pose_at(motion: MotionLike, time: RealLike, owner: str = "Body") -> Pose:
    """The pose that a motion (a Pose, or a function of time giving a Pose or a position) gives at `time`.

    Raises InputError in the name of `owner` where it fails or gives something else.
    """

    def pose(motion):
        if isinstance(motion, Pose):
            return motion
        return Pose(
            validate.numbers(owner, "motion", motion, shape=(3,), remedy="give a fs.Pose or a position (x, y, z)")
        )

    return validate.at_time(owner, pose, {"motion": motion}, time)


# Nine hours at 30 frames a second.
MOST_FRAMES = 1_000_000


def timeline(seconds: RealLike, fps: RealLike = 30.0) -> list[float]:
    """The times of a film's frames, 0, 1/fps, ...: round(seconds * fps) of them, at least one, at most a million."""
    seconds = validate.number("timeline", "seconds", seconds, above=0.0)
    fps = validate.number("timeline", "fps", fps, above=0.0)
    validate.bounded("timeline", "frames", seconds * fps, MOST_FRAMES, "give fewer seconds, or fewer frames a second")
    return [frame / fps for frame in range(frame_count(seconds, fps))]


def frame_count(seconds: float, fps: float) -> int:
    """Number of frames in a film."""
    return max(1, round(seconds * fps))
