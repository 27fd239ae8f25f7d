"""Mass, centre of mass and inertia of bodies: of the mass on a skeleton, or of the solid within a surface."""

import dataclasses
import functools

import numpy as np

from fieldsim import validate
from fieldsim.dynamics.rigid.mass_points import EXACT, mass_points
from fieldsim.errors import InputError
from fieldsim.sources.field import field_of_elements
from fieldsim.sources.margins import with_reach
from fieldsim.sources.rows import REACH
from fieldsim.world.motion import IDENTITY

# Relative error of a solid's volume and moments.
TOLERANCE = 1e-4
# Cells along the longest side of a solid's box: the first try, and the finest.
COARSE, FINE = 24, 192
# Moments below this share of the largest count as none.
NOTHING = 1e-12


@dataclasses.dataclass(frozen=True, eq=False)
class MassProperties:
    """Inertia of a body: mass; center (3,): of mass, in the body's frame; inertia (3, 3) about it, in that frame."""

    mass: float
    center: np.ndarray
    inertia: np.ndarray

    def principal(self) -> tuple[np.ndarray, np.ndarray]:
        """Principal moments (3,), ascending, and the rotation (3, 3) from the principal to the body's frame."""
        moments, axes = np.linalg.eigh(self.inertia)
        axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
        return moments, axes


def mass_properties(body) -> MassProperties:
    """Mass properties of a body whose motion is a `Rigid`; see there. Raises InputError for an impossible one."""
    motion = body.motion
    mass = motion.mass
    if mass is None:
        if callable(body.mass) or not body.mass > 0.0:
            raise InputError(
                f"Body{_named(body)}: its mass is {body.mass!r}, which cannot be that of a free body; "
                "give motion=fs.Rigid(mass=...) a mass above 0"
            )
        mass = validate.number(f"Body{_named(body)}", "mass", body.mass, at_most=validate.FARTHEST)
    if not isinstance(motion.inertia, str):
        center = np.zeros(3) if motion.center is None else np.array(motion.center)
        if motion.center is None:
            center, _ = moments_of_skeleton(body.skeleton)
        return MassProperties(mass, center, mass_matrix(motion.inertia))
    center, second = solid_moments(body) if motion.inertia == "solid" else moments_of_skeleton(body.skeleton)
    if motion.center is not None:
        # Steiner: about another point the moments grow.
        offset = center - motion.center
        center, second = np.array(motion.center), second + np.outer(offset, offset)
    return MassProperties(mass, center, mass * (np.trace(second) * np.eye(3) - second))


def mass_matrix(rows) -> np.ndarray:
    """A matrix (3, 3), made symmetric to the last digit."""
    matrix = np.array(rows)
    return 0.5 * (matrix + matrix.T)


def _named(body):
    return f" ({body.name})" if body.name else ""


def moments_of_skeleton(skeleton) -> tuple[np.ndarray, np.ndarray]:
    """Centre (3,) and second moments about it (3, 3), per unit of mass, of mass spread evenly over a skeleton."""
    return _moments(*mass_points(skeleton, [EXACT] * len(skeleton)))


def _moments(points, weights):
    center = weights @ points
    offset = points - center
    return center, np.einsum("n,ni,nj->ij", weights, offset, offset)


def once_for_equals(function):
    """`function` of a body, wherever it is and moves: called once for bodies that are equal but for their motion."""
    kept = functools.lru_cache(maxsize=64)(function)

    @functools.wraps(function)
    def of(body):
        shape = dataclasses.replace(body, motion=IDENTITY, name="")
        try:
            hash(shape)
        except TypeError:
            return function(shape)
        return kept(shape)

    return of


def solid_moments(body) -> tuple[np.ndarray, np.ndarray]:
    """Centre (3,) and second moments about it (3, 3), per unit of mass, of the even solid within the surface F = 1.

    Sums over ever finer grids, extrapolated, until two agree to TOLERANCE of the largest extent squared. Raises
    InputError where there is no surface, or nothing within it.
    """
    if body.surface is None:
        raise InputError(
            f"Body{_named(body)}: inertia is 'solid', but there is no surface that bounds one; give surface=fs.Material"
        )
    found = _solid_moments(body)
    if found is None:
        raise InputError(f"Body{_named(body)}: nothing lies within its surface; give a larger radius")
    return found


@once_for_equals
def _solid_moments(body):
    """The same, or None where nothing lies within."""
    elements = body.surface_elements(0.0)
    low, high = surface_box(body.skeleton, elements)
    cells = COARSE
    sums = _grid_sums(elements, low, high, cells)
    best, before = sums, None
    while cells < FINE:
        cells *= 2
        finer = _grid_sums(elements, low, high, cells)
        # The error of a grid sum is of second order.
        best = (4.0 * finer - sums) / 3.0
        sums = finer
        if not best[0] > 0.0:
            return None
        if before is not None and np.abs(best / best[0] - before / before[0]).max() < TOLERANCE:
            break
        before = best
    center = best[1:4] / best[0]
    second = best[4:].reshape(3, 3) / best[0] - np.outer(center, center)
    middle, scale = 0.5 * (low + high), float((high - low).max())
    return middle + scale * center, scale**2 * second


def surface_box(skeleton, elements) -> tuple[np.ndarray, np.ndarray]:
    """Corners of a box that holds the surface of a skeleton's elements: its own, widened by how far any can reach."""
    points, _ = mass_points(skeleton, [EXACT] * len(skeleton))
    reach = float(with_reach(elements.rows, elements.kinds, len(elements))[:, REACH].max())
    # Ends lie a little beyond the outermost points.
    margin = reach + 0.02 * float(np.ptp(points, axis=0).max())
    return points.min(axis=0) - margin, points.max(axis=0) + margin


def _grid_sums(elements, low, high, count):
    """Volume, first moments (3) and second moments (9) of the solid about the box's middle, in units of its size.

    A cell counts by how far its middle lies inside, over a smooth step of three cells' width.
    """
    scale = float((high - low).max())
    middle = 0.5 * (low + high)
    cell = scale / count
    total = np.zeros(13)
    axes = [(np.arange(-n, n) + 0.5) * cell for n in np.ceil(0.5 * (high - low) / cell).astype(int)]
    for x in axes[0]:
        y, z = np.meshgrid(axes[1], axes[2], indexing="ij")
        places = np.stack([np.full(y.size, x), y.ravel(), z.ravel()], axis=1)
        field, gradient = field_of_elements(elements, places + middle)
        depth = signed_depth(field, gradient) / (1.5 * cell)
        inside = np.clip(depth, -1.0, 1.0)
        share = 0.5 * (1.0 + inside + np.sin(np.pi * inside) / np.pi)
        p = places / scale
        moments = np.concatenate([np.ones((len(p), 1)), p, (p[:, :, None] * p[:, None, :]).reshape(-1, 9)], axis=1)
        total += share @ moments
    return total * (cell / scale) ** 3


def signed_depth(field, gradient):
    """About how far points lie within the surface, from log F and its slope: exact to first order."""
    field = np.maximum(field, 1e-300)
    slope = np.maximum(np.linalg.norm(gradient, axis=1) / field, 1e-12)
    return np.log(field) / slope
