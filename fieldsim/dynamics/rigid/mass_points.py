"""Mass points: a skeleton's mass as points with weights, by Gauss's rules, exact as more are taken."""

import math

import numpy as np

from fieldsim.potentials.gravity import total_measure

# Greatest number of points along a dimension of a curve, a surface, a solid.
MOST = {1: 64, 2: 16, 3: 6}
# So many points along a length give moments of mass to rounding, also those of whole circles.
EXACT = 24


def mass_points(skeleton, counts) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) in the body's frame and weights (n,), of sum 1, of a concrete skeleton of even density.

    counts: points along each primitive's dimensions, one number per primitive.
    """
    total = total_measure(skeleton)
    parts = [p.mass_points(count) for p, count in zip(skeleton, counts, strict=True)]
    shares = [p.measure / total * weights for p, (_, weights) in zip(skeleton, parts, strict=True)]
    return np.concatenate([points for points, _ in parts]), np.concatenate(shares)


def enough(primitive, clearance: float, tolerance: float) -> int:
    """Points along a primitive that give its pull on what is `clearance` away to a relative error of `tolerance`.

    No more than MOST.
    """
    count = primitive.mass_points_needed(clearance, math.log(1.0 / tolerance))
    return 1 if primitive.dimension == 0 else max(3, min(MOST[primitive.dimension], math.ceil(count)))
