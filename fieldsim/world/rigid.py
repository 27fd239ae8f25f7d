"""Rigid: the motion of a body that forces move."""

import dataclasses
import math
import warnings
from typing import TYPE_CHECKING

import numpy as np

from fieldsim import validate
from fieldsim.errors import FieldsimWarning, InputError
from fieldsim.types import ArrayLike, RealLike, Vector, VectorLike
from fieldsim.world.motion import Pose

INERTIAS = ("skeleton", "solid")


@dataclasses.dataclass(frozen=True)
class Rigid(Pose):
    """A pose at the start, and free motion from there: `Body(..., motion=Rigid(...))` is moved by the simulation.

    position, rotation: the pose at the start, as of any `Pose`. velocity: of the centre of mass, angular_velocity
    (radians per unit of time): both in the world's frame.
    inertia: "skeleton": the mass lies on the skeleton; "solid": it fills the body's surface evenly; or a matrix (3, 3)
    about the centre of mass, in the body's frame. mass: inertial mass, default the body's own. center: the centre of
    mass in the body's frame, default the skeleton's or the solid's.
    stiffness: of contacts, pressure over depth squared: a point within another surface is pushed out by stiffness
    depth^2 times its area; default such that the hardest hit that the energy of all bodies at the start allows presses
    two surfaces into each other by a tenth of the radius.
    restitution: the factor (0..1) on the normal velocity of a hit, reversed; friction: Coulomb's coefficient, of
    sliding and of sticking. Of two free bodies the lesser restitution counts, and the geometric mean of the frictions;
    against a body whose motion is given, the free one's own. By default nothing is lost. See docs/motion.md.

    Gravity gives all bodies at a place the same acceleration: it pulls on the mass that resists, spread over the
    skeleton. Other free bodies feel the body's own mass, times its G; what it does to them they do to it. So free
    bodies that pull each other have one kernel, and one ratio of G times the mass that pulls to the mass that resists,
    which may be negative; a Simulation of others is refused. One of mass 0 does not pull.

    A point, or a straight line, has no inertia about itself, and nothing there turns it: a point moves as a particle,
    a line does not spin about itself. Raises InputError for a mass that is not above 0 and for a matrix that is not
    symmetric and positive definite; warns of a quaternion whose length is off 1 by more than 1e-6.
    """

    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    angular_velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inertia: str | tuple[Vector, Vector, Vector] = "skeleton"
    mass: float | None = None
    center: tuple[float, float, float] | None = None
    stiffness: float | None = None
    restitution: float = 1.0
    friction: float = 0.0

    if TYPE_CHECKING:

        def __init__(
            self,
            position: VectorLike = ...,
            rotation: VectorLike = ...,
            velocity: VectorLike = ...,
            angular_velocity: VectorLike = ...,
            inertia: str | ArrayLike = ...,
            mass: RealLike | None = ...,
            center: VectorLike | None = ...,
            stiffness: RealLike | None = ...,
            restitution: RealLike = ...,
            friction: RealLike = ...,
        ) -> None: ...

    def __post_init__(self):
        given = self.rotation
        super().__post_init__()
        _warn_of_length(given)
        validate.fields(self, validate.near_vector, "velocity", "angular_velocity")
        for name, check, limits in (
            ("center", validate.near_vector, {}),
            ("mass", validate.number, {"above": 0.0, "at_most": validate.FARTHEST}),
            ("stiffness", validate.number, {"above": 0.0, "at_most": validate.FARTHEST}),
        ):
            object.__setattr__(self, name, validate.optional(check, "Rigid", name, getattr(self, name), **limits))
        if not (isinstance(self.inertia, str) and self.inertia in INERTIAS):
            object.__setattr__(self, "inertia", _matrix(self.inertia))
        validate.fields(self, validate.number, "restitution", "friction", at_least=0.0, at_most=validate.FARTHEST)
        if self.restitution > 1.0:
            raise InputError(f"Rigid: restitution is {self.restitution:g}; give a number in 0..1 (1 keeps the energy)")

    @property
    def loses(self) -> bool:
        """Whether its contacts lose energy."""
        return self.restitution < 1.0 or self.friction > 0.0


def _warn_of_length(rotation):
    length = math.hypot(*rotation)
    if abs(length - 1.0) > 1e-6:
        warnings.warn(
            f"Rigid: rotation {tuple(rotation)!r} has length {length:.9g} and was normalised; give a unit quaternion "
            "(w, x, y, z)",
            FieldsimWarning,
            stacklevel=4,
        )


def _matrix(inertia):
    """A checked inertia tensor, as rows of floats."""
    what = "give 'skeleton', 'solid' or a symmetric, positive definite matrix (3, 3)"
    matrix = validate.numbers("Rigid", "inertia", inertia, shape=(3, 3), remedy=what)
    validate.not_far("Rigid", "inertia", matrix)
    if not np.allclose(matrix, matrix.T, rtol=1e-9, atol=1e-12 * np.abs(matrix).max()):
        raise InputError(f"Rigid: inertia is {matrix.tolist()}, which is not symmetric; {what}")
    moments = np.linalg.eigvalsh(matrix)
    if not moments[0] > 0.0:
        raise InputError(f"Rigid: inertia has the principal moments {moments.tolist()}, not all above 0; {what}")
    if moments[2] * (1.0 - 1e-9) - moments[0] > moments[1]:
        raise InputError(
            f"Rigid: inertia has the principal moments {moments.tolist()}; no body has one above the sum of the others"
        )
    return tuple(tuple(row) for row in matrix.tolist())
