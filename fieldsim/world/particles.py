"""Sets of particles: where they start, and what happens to them at surfaces."""

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from fieldsim import validate
from fieldsim.arrays import kept
from fieldsim.errors import InputError
from fieldsim.potentials.kernels import Kernel
from fieldsim.types import ArrayLike, ColorLike, RealLike
from fieldsim.world.body import KERNEL
from fieldsim.world.color import color_rgb
from fieldsim.world.contact import LAWS, Absorb, Bounce, Repulsion


@dataclasses.dataclass(frozen=True, eq=False)
class Particles:
    """A set of particles as they start: positions and velocities (N, 3) in the world's frame, copies to read only.

    radius: of the sphere that is seen and that collides; contact: what happens at a surface, a Bounce, Absorb or
    Repulsion, or None to pass through everything. Particles do not touch each other.
    gravity: the kernel with which each pulls all other particles, with its mass; None: they are test particles. mass:
    of each, or N numbers, copies to read only. G:
    gravitational constant, with which others feel these: of sets with several, what is kept together is weighted by
    G times mass. A mass below 0 repels all, and falls as any other. Free bodies do not feel particles, so a Simulation
    of both with particles that pull is refused.
    """

    positions: np.ndarray
    velocities: np.ndarray
    radius: float = 0.02
    contact: Bounce | Absorb | Repulsion | None = None
    color: ColorLike = "bone"
    name: str = ""
    gravity: Kernel | None = None
    mass: float | np.ndarray = 1.0
    G: float = 1.0

    if TYPE_CHECKING:

        def __init__(
            self,
            positions: ArrayLike,
            velocities: ArrayLike,
            radius: RealLike = ...,
            contact: Bounce | Absorb | Repulsion | None = ...,
            color: ColorLike = ...,
            name: str = ...,
            gravity: Kernel | None = ...,
            mass: RealLike | ArrayLike = ...,
            G: RealLike = ...,
        ) -> None: ...

    def __post_init__(self):
        positions, velocities = (
            validate.not_far("Particles", name, validate.points("Particles", name, getattr(self, name)))
            for name in ("positions", "velocities")
        )
        if positions.shape != velocities.shape:
            raise InputError(
                f"Particles: positions have shape {positions.shape} but velocities {velocities.shape}; "
                "give one velocity per position"
            )
        object.__setattr__(self, "positions", kept(positions))
        object.__setattr__(self, "velocities", kept(velocities))
        validate.fields(self, validate.number, "radius", above=0.0)
        laws = "give fs.Bounce(restitution, friction), fs.Absorb(), fs.Repulsion(stiffness) or None"
        validate.instance("Particles", "contact", self.contact, (*LAWS, type(None)), laws)
        validate.instance("Particles", "gravity", self.gravity, Kernel | None, KERNEL)
        validate.text("Particles", "name", self.name)
        validate.fields(self, validate.number, "G", at_least=-validate.FARTHEST, at_most=validate.FARTHEST)
        object.__setattr__(self, "mass", _masses(self.mass, len(positions)))
        color_rgb("Particles", self.color)

    def __len__(self) -> int:
        return len(self.positions)


def _masses(mass, count):
    """One mass, or an array of one for each of the particles."""
    if not isinstance(mass, list | tuple | np.ndarray):
        return validate.number("Particles", "mass", mass, at_least=-validate.FARTHEST, at_most=validate.FARTHEST)
    return kept(validate.not_far("Particles", "mass", validate.numbers("Particles", "mass", mass, shape=(count,))))
