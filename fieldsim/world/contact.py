"""Contact laws: what happens to a particle that meets a surface."""

import dataclasses
import enum
from typing import TYPE_CHECKING

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.types import RealLike


class Status(enum.IntEnum):
    """What a particle does: MOVING freely, RESTING (or sliding, or rolling) on a surface, ABSORBED, or ESCAPED."""

    MOVING = 0
    RESTING = 1
    ABSORBED = 2
    ESCAPED = 3


@dataclasses.dataclass(frozen=True)
class Bounce:
    """Contact law: the particle is a hard sphere that bounces, slides, rolls and comes to rest.

    restitution: the factor (0..1) on the normal velocity, reversed. friction: Coulomb's coefficient mu, of sliding and
    of sticking: along the surface the ball's velocity relative to the material it touches changes by at most mu times
    the normal impulse. rolling: whether the ball turns (a solid sphere, inertia 2/5 m r^2); otherwise it is a point
    mass that friction can bring to rest. The material moves with its body's pose (where bodies melt together, as their
    mean weighted by their fields); what growth or bending does to it along the surface is not known.
    """

    restitution: float = 0.6
    friction: float = 0.0
    rolling: bool = False

    if TYPE_CHECKING:

        def __init__(self, restitution: RealLike = ..., friction: RealLike = ..., rolling: bool = ...) -> None: ...

    def __post_init__(self):
        validate.fields(self, validate.number, "restitution", "friction", at_least=0.0)
        validate.fields(self, validate.flag, "rolling")
        if self.restitution > 1.0:
            raise InputError(f"Bounce: restitution is {self.restitution:g}; give a number in 0..1 (1 keeps the energy)")
        if self.rolling and self.friction == 0.0:
            raise InputError("Bounce: rolling without friction; give a friction above 0, such as 0.5")


@dataclasses.dataclass(frozen=True)
class Absorb:
    """Contact law: the particle stays where it touches the surface, and moves with the material there."""


@dataclasses.dataclass(frozen=True)
class Repulsion:
    """Contact law without events: a smooth potential of short range that keeps the energy.

    Per unit mass it is the sum of stiffness * max(0, 1 - gap / reach)^3 over all points of the surfaces that are nearer
    to the ball than those around them: nothing where its gap is above `reach`, a length, `stiffness` where it touches,
    more where it reaches in. Of a ball whose centre is inside, the nearest way out counts alone; it passes through
    where its energy tops the potential. reach: default half the length over which the thinnest surface's field varies.
    The steps must resolve it: about 30 to a passage. Where a ball passes between two sides of a surface, as on the axis
    of a hole, a reach above its gap there makes the force jump (docs/contact.md).
    """

    stiffness: float
    reach: float | None = None

    if TYPE_CHECKING:

        def __init__(self, stiffness: RealLike, reach: RealLike | None = ...) -> None: ...

    def __post_init__(self):
        given = ["stiffness"] if self.reach is None else ["stiffness", "reach"]
        validate.fields(self, validate.number, *given, above=0.0)


LAWS = (Bounce, Absorb, Repulsion)
