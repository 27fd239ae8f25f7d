"""Points on prescribed surfaces that free bodies' own points could miss: those thinner than these are apart."""

import warnings

import numpy as np
import warp as wp

from fieldsim.dynamics.contact.surface_points import SurfacePoints, surface_points
from fieldsim.dynamics.refusals import body_name
from fieldsim.dynamics.rigid.inertia import once_for_equals, surface_box
from fieldsim.dynamics.rigid.shells import Thin
from fieldsim.errors import FieldsimWarning, InputError
from fieldsim.sources.poses import body_poses

# Distance between points in radii: what they press on is far wider.
SPACING = 0.5


class ThinSurfaces:
    """The prescribed bodies of a world that are thinner than `widest`, the distance between free bodies' points.

    Bodies that deform are left out, and planes, which are not thin. What is too long to be sampled is left out with a
    FieldsimWarning.
    """

    def __init__(self, world, widest: float):
        self._found: list[tuple[int, SurfacePoints]] = []
        self._bodies = world.bodies
        for index, body in enumerate(world.bodies):
            if body.free or body.surface is None or body.deforming or any(p.endless for p in body.skeleton):
                continue
            if body.surface.radius < widest:
                try:
                    self._found.append((index, _points_of(body)))
                except InputError as reason:
                    warnings.warn(
                        f"{body_name(index, body)} is thinner than the points on free bodies are apart, and may pass "
                        f"between them: {reason}",
                        FieldsimWarning,
                        stacklevel=5,
                    )

    def __len__(self) -> int:
        """How many points there are."""
        return sum(len(shell.points) for _, shell in self._found)

    def table(self, times, device, only: int | None = None) -> Thin:
        """The points at the stages `times`; only: of that body of the world alone."""
        found = [(self._bodies[index], shell) for index, shell in self._found if only in (None, index)]
        moving = any(body.moving for body, _ in found)
        times = np.asarray(times) if moving else np.asarray(times)[:1]
        points, blocks = [np.zeros((len(times), 0, 3))], [np.zeros((len(times), 0, 4))]
        for body, shell in found:
            rotations, positions = body_poses(body, times)
            points.append(_placed(shell.points, rotations, positions))
            balls = np.broadcast_to(shell.blocks[:, 3:], (len(times), len(shell.blocks), 1))
            blocks.append(np.concatenate([_placed(shell.blocks[:, :3], rotations, positions), balls], axis=2))
        before = np.cumsum([0, *(len(shell.points) for _, shell in found)])
        ends = [shell.ends + first for (_, shell), first in zip(found, before, strict=False)]
        thin = Thin()
        thin.points = wp.array(np.concatenate(points, axis=1), dtype=wp.vec3d, device=device)
        thin.blocks = wp.array(np.concatenate(blocks, axis=1), dtype=wp.vec4d, device=device)
        thin.areas = _numbers([shell.areas for _, shell in found], wp.float64, device)
        thin.block_end = _numbers(ends, wp.int32, device)
        widths = [np.full(len(shell.blocks), body.surface.radius) for body, shell in found]
        thin.width = _numbers(widths, wp.float64, device)
        thin.moving = int(moving)
        return thin


@once_for_equals
def _points_of(body):
    """Points on a body's surface, in its frame."""
    elements = body.surface_elements(0.0)
    return surface_points(elements, *surface_box(body.skeleton, elements), SPACING * body.surface.radius)


def _placed(points, rotations, positions):
    """Points (n, 3) of a body's frame in the world's, at each stage (stages, n, 3)."""
    return np.einsum("sij,nj->sni", rotations, points) + positions[:, None]


def _numbers(parts, dtype, device):
    return wp.array(np.concatenate([np.zeros(0), *parts]), dtype=dtype, device=device)
