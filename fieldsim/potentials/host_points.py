"""Points at which fields are evaluated, as users give them."""

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError

# Beyond, squares of distances are of no use.
FARTHEST = 1e100


def host_points(points):
    """`points` as a checked (N, 3) array, and whether they were a single (3,)."""
    array = validate.reals("Field", "points", points, "give an array of shape (N, 3) or (3,)")
    single = array.shape == (3,)
    array = validate.points("Field", "points", array[None] if single else array)
    if array.size and np.abs(array).max() > FARTHEST:
        far = array[np.abs(array).max(axis=1).argmax()]
        raise InputError(
            f"Field: points has {tuple(far.tolist())}, and squares of such lengths overflow; give coordinates of at "
            f"most {FARTHEST:g}, in another unit"
        )
    return array, single
