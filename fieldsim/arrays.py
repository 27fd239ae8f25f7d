"""Arrays that are handed out: copies, which refuse to be written, for what was written there would change nothing."""

import numpy as np


def read_only(array: np.ndarray) -> np.ndarray:
    """`array`, one that nobody else holds, made read-only."""
    array.flags.writeable = False
    return array


def kept(array: np.ndarray) -> np.ndarray:
    """A read-only array of the same numbers that nobody else can write: a copy, unless it is such a one."""
    return read_only(array.copy()) if array.flags.writeable or not array.flags.owndata else array
