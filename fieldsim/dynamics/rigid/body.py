"""Free bodies as they start: what the user gave, in the principal frame."""

import dataclasses
import functools
import math

import numpy as np

from fieldsim.dynamics.contact.surface_points import SurfacePoints, spacing, surface_points
from fieldsim.dynamics.refusals import body_name
from fieldsim.dynamics.rigid.inertia import NOTHING, mass_properties, once_for_equals, surface_box
from fieldsim.dynamics.rigid.mass_points import enough, mass_points
from fieldsim.errors import InputError
from fieldsim.numerics import quaternion
from fieldsim.potentials.elements import Elements, concatenate
from fieldsim.sources.margins import with_reach
from fieldsim.world.body import Body
from fieldsim.world.motion import Pose
from fieldsim.world.rigid import Rigid

# Relative error of the mass points' pull on what touches the body.
TOLERANCE = 1e-8
# Where a body has no surface, a distance below this share of its size counts as touching.
NEAR = 0.25


@dataclasses.dataclass(frozen=True, eq=False)
class FreeBody:
    """One free body as it starts. index: among the world's bodies; frame: its principal frame in the body's frame.

    mass; moments (3,), ascending, any put in the place of those that are none (see `Rigid`): nothing turns there; idle
    (3,): which those are. Raises InputError for a spin about an axis without a moment.
    """

    index: int
    name: str
    body: Body
    mass: float
    moments: np.ndarray
    frame: Pose
    idle: np.ndarray

    def __post_init__(self):
        spin = self.motion.matrix.T @ np.array(self.motion.angular_velocity)
        if self.idle.any() and np.abs(self.frame.matrix[:, self.idle].T @ spin).max() > 1e-9 * np.linalg.norm(spin):
            what = "a point" if self.idle.all() else "a straight line"
            raise InputError(
                f"{self.name}: its mass lies on {what}, which has no inertia to spin about itself with; give its "
                "motion inertia='solid' or a matrix, or an angular_velocity without that part"
            )

    @property
    def motion(self) -> Rigid:
        """How it starts."""
        assert isinstance(self.body.motion, Rigid)  # what makes a body free
        return self.body.motion

    @property
    def radius(self) -> float:
        """Of its surface's material, which what touches has."""
        assert self.body.surface is not None
        return self.body.surface.radius

    def moved(self, **motion) -> "FreeBody":
        """The same body that starts with other fields of its `Rigid`."""
        body = dataclasses.replace(self.body, motion=dataclasses.replace(self.motion, **motion))
        found = dataclasses.replace(self, body=body)
        found.__dict__["shell"] = self.shell
        return found

    @property
    def center(self) -> np.ndarray:
        """Its centre of mass, world frame, (3,)."""
        motion = self.motion
        return np.array(motion.position) + motion.matrix @ self.frame.position

    @property
    def turn(self) -> np.ndarray:
        """The quaternion (4,) from the principal to the world's frame."""
        return quaternion.product(self.motion.rotation, self.frame.rotation)

    @property
    def pull(self) -> float:
        """G times the mass that pulls over the mass that resists: 0 where the body does not pull."""
        return 0.0 if self.body.gravity is None else self.body.G * self.body.mass / self.mass

    @property
    def pulls(self) -> bool:
        """Whether other bodies feel it."""
        return self.pull != 0.0

    def gravity_elements(self) -> Elements:
        """What pulls, in the principal frame."""
        return self._placed(self.body.gravity_elements(0.0)) if self.pulls else concatenate([])

    def surface_elements(self) -> Elements:
        """What collides, in the principal frame, with its reach."""
        own = self.body.surface_elements(0.0)
        placed = self._placed(own)
        return dataclasses.replace(placed, rows=with_reach(placed.rows, own.kinds, len(own)))

    def _placed(self, elements):
        turn = self.frame.matrix.T
        return elements.placed(turn, -turn @ self.frame.position)

    def mass_points(self) -> tuple[np.ndarray, np.ndarray]:
        """Mass points (n, 3) in the principal frame and their masses (n,)."""
        skeleton = self.body.skeleton
        clearance = 2.0 * self.radius if self.body.surface else NEAR * _extent(skeleton)
        points, weights = mass_points(skeleton, [enough(p, clearance, TOLERANCE) for p in skeleton])
        return self._inward(points), self.mass * weights

    @functools.cached_property
    def shell(self) -> SurfacePoints | None:
        """Points on its surface, in the principal frame, or None."""
        if self.body.surface is None:
            return None
        found = _shell_of(self.body)
        blocks = np.column_stack([self._inward(found.blocks[:, :3]), found.blocks[:, 3]])
        return dataclasses.replace(found, points=self._inward(found.points), blocks=blocks)

    @property
    def shell_points(self) -> np.ndarray:
        """Points on its surface, in the body's frame, (n, 3)."""
        points = self.shell.points if self.shell else np.zeros((0, 3))
        return points @ self.frame.matrix.T + self.frame.position

    def _inward(self, points):
        """Points of the body's frame in the principal one."""
        return (points - self.frame.position) @ self.frame.matrix

    @property
    def depth(self) -> float:
        """How deep the hardest hit that the start's energy allows may press into its surface: a tenth of its radius."""
        return 0.1 * self.radius

    @property
    def _hardness(self):
        """U / (stiffness d^4) of two equal surfaces of this radius R that overlap by d.

        They do so on an area of pi R d, over which the cube of the depth has the mean d^3 / 4.
        """
        return math.pi * self.radius / 12.0

    def stiffness(self, energy: float) -> float:
        """Such that a hit of `energy` presses in by `depth`; or the motion's own stiffness."""
        given = self.motion.stiffness
        return given or (energy or 1.0) / (self._hardness * self.depth**4)

    def highest_frequency(self, stiffness: float, energy: float) -> float:
        """Angular frequency of contact in a hit of `energy`: of U ~ d^4 at the depth d where U is `energy`.

        Assumes the other body to be at least as heavy: the lighter body of a pair determines the frequency.
        """
        depth = (energy / (stiffness * self._hardness)) ** 0.25
        return math.sqrt(24.0 * energy / self.mass) / depth if depth else 0.0


def free_body(index, body) -> FreeBody:
    """The start of body `index`; raises InputError for mass properties that cannot be."""
    name = body_name(index, body)
    properties = mass_properties(body)
    moments, axes = properties.principal()
    frame = Pose(tuple(properties.center), tuple(quaternion.of_matrix(axes)))
    idle = moments <= NOTHING * moments[2]
    moments = np.where(idle, moments[2] or properties.mass, moments)
    return FreeBody(index, name, body, properties.mass, moments, frame, idle)


@once_for_equals
def _shell_of(body):
    """Points on a body's surface, in its frame."""
    elements = body.surface_elements(0.0)
    return surface_points(elements, *surface_box(body.skeleton, elements), spacing(body.surface.radius))


def _extent(skeleton):
    points, _ = mass_points(skeleton, [8] * len(skeleton))
    return float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0
