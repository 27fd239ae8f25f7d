"""What free bodies may start as: apart from each other and from what stands, and with pulls that are mutual."""

import dataclasses
import functools
import math

import numpy as np

from fieldsim.dynamics.refusals import body_name
from fieldsim.dynamics.rigid.body import FreeBody
from fieldsim.dynamics.rigid.mass_points import mass_points
from fieldsim.errors import InputError
from fieldsim.potentials.elements import Elements
from fieldsim.sources.field import field_of_elements
from fieldsim.sources.margins import with_reach
from fieldsim.sources.rows import REACH
from fieldsim.world.motion import Pose

# Where a point of one surface starts within the other's field of more than this, the two overlap.
OVERLAP = 1.001
# Points along a primitive of 1, 2, 3 dimensions that are looked for within others.
INNER = {0: 1, 1: 24, 2: 6, 3: 4}
# Rounding of what pulls over what resists.
EQUAL = 1e-9


def refuse_unequal_pulls(starts: list[FreeBody]) -> None:
    """Raise InputError where free bodies that pull each other would not do so with opposite forces.

    The force of a on b is the mass of b that resists times G_a M_a times what a's kernel says, M the mass that pulls:
    forces are opposite where kernels are the same, and G M over the mass that resists is.
    """
    pulling = [start for start in starts if start.pulls]
    for start in pulling[1:]:
        first = pulling[0]
        pair = f"{first.name} and {start.name} pull each other"
        one, other = first.body, start.body
        if one.gravity != other.gravity:
            raise InputError(
                f"{pair} with different kernels, {one.gravity} and {other.gravity}, so that their forces would not be "
                "opposite; give them one gravity"
            )
        if not math.isclose(first.pull, start.pull, rel_tol=EQUAL):
            raise InputError(
                f"{pair} with G = {one.G:g} and {other.G:g}, mass = {one.mass:g} and {other.mass:g}, and masses that "
                f"resist of {first.mass:g} and {start.mass:g}, so that their forces would not be opposite; give them "
                "one G, and Rigid masses in the same ratio as their own (leave out Rigid(mass=))"
            )


@dataclasses.dataclass(frozen=True, eq=False)
class Extent:
    """Where one surface is: its elements in the body's frame, which is at `pose`.

    free: its `FreeBody`, or None; skeleton: as it is now; center (3,), world frame, and radius: of a sphere around it.
    """

    name: str
    elements: Elements
    pose: Pose
    free: FreeBody | None
    skeleton: tuple
    center: np.ndarray
    radius: float

    @functools.cached_property
    def points(self) -> np.ndarray:
        """Points on it, of a free body, and within it, (n, 3) in the body's frame."""
        points = np.zeros((0, 3)) if self.free is None else self.free.shell_points
        if math.isinf(self.radius):
            return points
        inner, _ = mass_points(self.skeleton, [INNER[primitive.dimension] for primitive in self.skeleton])
        # What takes away from the surface lies outside.
        return np.concatenate([points, inner[field_of_elements(self.elements, inner)[0] > OVERLAP]])

    def holds(self, other: "Extent") -> bool:
        """Whether a point of the other lies in this one."""
        points = other.points @ other.pose.matrix.T + other.pose.position
        points = points[np.linalg.norm(points - self.center, axis=1) <= self.radius]
        local = (points - self.pose.position) @ self.pose.matrix
        return len(local) > 0 and bool(field_of_elements(self.elements, local)[0].max() > OVERLAP)


def extent_of(name: str, body, pose: Pose, time: float, free: FreeBody | None) -> Extent:
    """The extent of a body's surface at `time`."""
    elements = body.surface_elements(time)
    skeleton = tuple(primitive.at(time) for primitive in body.skeleton)
    middle, radius = np.zeros(3), math.inf
    if not any(primitive.endless for primitive in skeleton):
        low, high = zip(*(primitive.box for primitive in skeleton), strict=True)
        low, high = np.min(low, axis=0), np.max(high, axis=0)
        reach = with_reach(elements.rows, elements.kinds, len(elements))[:, REACH].max()
        middle, radius = 0.5 * (low + high), float(0.5 * np.linalg.norm(high - low) + reach)
    return Extent(name, elements, pose, free, skeleton, pose.matrix @ middle + pose.position, radius)


def refuse_overlaps(world, starts: list[FreeBody], poses, time: float, moved) -> None:
    """Raise InputError where the surface of a free body of `moved` lies in another's, naming both.

    poses: of all the world's bodies; moved: indices among these. Only neighbours are looked at closely.
    """
    free = {start.index: start for start in starts}
    extents = {}
    for index, body in enumerate(world.bodies):
        if body.surface is not None:
            extents[index] = extent_of(body_name(index, body), body, poses[index], time, free.get(index))
    indices = np.array(list(extents), dtype=int)
    centers = np.array([extent.center for extent in extents.values()])
    radii = np.array([extent.radius for extent in extents.values()])
    for index in moved:
        if index not in extents:
            continue
        one = extents[index]
        near = np.linalg.norm(centers - one.center, axis=1) < radii + one.radius
        for other in indices[near].tolist():
            # Of two that moved the pair is looked at once.
            if other == index or (other in moved and other > index):
                continue
            if extents[other].holds(one) or one.holds(extents[other]):
                raise InputError(
                    f"{one.name} and {extents[other].name} overlap at the start, time {time:g}; move them apart"
                )
