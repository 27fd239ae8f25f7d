"""Gravity: the field of a mass spread evenly over a skeleton."""

import dataclasses
from collections.abc import Iterable

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials.field import Field, number_at, skeleton
from fieldsim.potentials.kernels import Kernel, Newtonian
from fieldsim.potentials.primitives.base import Primitive
from fieldsim.types import RealLike, Timed


@dataclasses.dataclass(frozen=True)
class _SpreadMass:
    """G times a mass over the measure of a skeleton, at a time. Every element needs it at the same one."""

    owner: str
    primitives: tuple[Primitive, ...]
    mass: Timed[RealLike]
    G: float

    # The last time and the strength then.
    latest: list = dataclasses.field(default_factory=lambda: [(None, 0.0)], repr=False, compare=False)

    def __call__(self, time):
        known, strength = self.latest[0]
        if known != time:
            strength = (
                self.G
                * number_at(self.owner, "mass", self.mass, time)
                / total_measure(p.at(time) for p in self.primitives)
            )
            self.latest[0] = time, strength
        return strength


def gravity(
    primitives: Primitive | Iterable[Primitive],
    mass: Timed[RealLike],
    *,
    G: RealLike = 1.0,
    kernel: Kernel | None = None,
) -> Field:
    """The field whose gradient is the acceleration towards a skeleton of the given mass.

    The mass is spread evenly over the skeleton's total measure (arc length, area; points count 1 each):
    strength = G mass / measure. The default kernel is Newtonian. The mass may be negative, or a function of time.
    Raises InputError for a mass or G that is not finite, for a skeleton that mixes points, curves and surfaces, and for
    profiled primitives: a profile shapes a surface and is no density.
    """
    return spread("gravity", primitives, mass, G, Newtonian() if kernel is None else kernel)


def spread(owner: str, primitives, mass, G, kernel: Kernel) -> Field:
    """`gravity` in the name of `owner`."""
    primitives = skeleton(owner, primitives)
    for index, primitive in enumerate(primitives):
        if primitive.profiled:
            raise InputError(
                f"{owner}: skeleton[{index}] is a {type(primitive).__name__}, and a profile is no density; give the "
                "plain primitive, or a TaperedSegment, which has one (the profile may shape another body's surface)"
            )
    validate.instance(owner, "kernel", kernel, Kernel, "give a kernel such as fs.Newtonian(), or None")
    G = validate.number(owner, "G", G)
    _refuse_mixed_dimensions(owner, primitives)
    if not callable(mass):
        mass = validate.number(owner, "mass", mass)
    if not callable(mass) and not any(p.animated for p in primitives):
        return Field(primitives, kernel, G * mass / total_measure(primitives))

    return Field(primitives, kernel, _SpreadMass(owner, primitives, mass, G))


def total_measure(primitives) -> float:
    """Total measure of a concrete skeleton of one dimension; raises InputError for one that mixes dimensions."""
    primitives = list(primitives)
    _refuse_mixed_dimensions("gravity", primitives)
    return float(sum(p.measure for p in primitives))


def _refuse_mixed_dimensions(owner, primitives):
    if len({p.dimension for p in primitives}) > 1:
        raise InputError(
            f"{owner}: a skeleton that mixes points, curves and surfaces has no common measure to spread mass over; "
            "add one Field or Body for each"
        )
