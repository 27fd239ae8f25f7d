"""Pictures that users give, as files or as arrays, as linear RGB."""

import functools
import os
import pathlib

import numpy as np

from fieldsim.errors import InputError
from fieldsim.world.color import linear_of

_REMEDY = "give a path or an array (height, width, 3), uint8 or sRGB floats in 0..1"


class Pixels:
    """The pixels of a picture; those of a file are read when they are first asked for.

    image: a path, or an array (H, W, 3), (H, W, 4) (transparency is left out) or (H, W) of grey: uint8, uint16 or sRGB
    floats in 0..1, from the top. Raises InputError, in the name of `owner`, for a file that is not there or that cannot
    be read, and for an array of another shape, type or range.
    """

    def __init__(self, owner: str, image):
        self._owner = owner
        if isinstance(image, str | os.PathLike):
            self._path = pathlib.Path(image).absolute()
            if not self._path.is_file():
                raise InputError(f"{owner}: there is no image {str(image)!r}; {_REMEDY}")
        else:
            self.linear = _linear(owner, image)

    @functools.cached_property
    def linear(self) -> np.ndarray:
        """Linear RGB, (H, W, 3) float32, from the top."""
        import imageio.v3 as imageio

        try:
            # By name: others would be tried on what is no picture, some with a warning.
            image = imageio.imread(self._path, plugin="pillow")
        except (OSError, ValueError, RuntimeError) as reason:
            raise InputError(f"{self._owner}: image {str(self._path)!r} cannot be read: {reason}") from None
        return _linear(self._owner, image)

    @functools.cached_property
    def mean(self) -> tuple[float, float, float]:
        """Its mean colour, linear RGB."""
        return tuple(self.linear.mean(axis=(0, 1), dtype=float).tolist())


def _linear(owner, image):
    try:
        array = np.asarray(image)
    except ValueError:
        raise InputError(f"{owner}: image has rows of different lengths; {_REMEDY}") from None
    if array.ndim == 2:
        array = np.repeat(array[..., None], 3, axis=2)
    if array.ndim != 3 or array.shape[2] not in (3, 4) or array.size == 0:
        raise InputError(f"{owner}: image has shape {np.shape(image)}; {_REMEDY}")
    array = array[..., :3]
    if array.dtype in (np.uint8, np.uint16):
        most = np.iinfo(array.dtype).max
        return linear_of(np.arange(most + 1) / most).astype(np.float32)[array]
    if array.dtype.kind != "f":
        raise InputError(f"{owner}: image is of type {array.dtype}; {_REMEDY}")
    if not np.isfinite(array).all():
        count = np.count_nonzero(~np.isfinite(array).all(axis=2))
        raise InputError(f"{owner}: image has {count} pixels that are not finite; {_REMEDY}")
    if array.min() < 0.0 or array.max() > 1.0:
        raise InputError(f"{owner}: image has values from {array.min():g} to {array.max():g}; {_REMEDY}")
    return linear_of(array).astype(np.float32)
