"""Pictures that users give, as files or as arrays, as linear RGB."""

import functools
import os
import warnings

import numpy as np
from PIL import Image

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.world.color import linear_of

# Kinds of files, recognised by their content, that Pillow reads by itself: for others, such as PostScript, it would
# start programs.
KINDS = ("PNG", "JPEG", "GIF", "BMP", "TIFF", "WEBP", "PPM")

# A file of a hundred kilobytes can stand for thousands of millions of pixels.
MOST_PIXELS = 1 << 26

_REMEDY = "give a path or an array (height, width, 3), uint8 or sRGB floats in 0..1"

# How a camera was held (Exif 2.32, table 6): what sets its pictures upright.
_ORIENTATION = 0x0112
TURNS = {
    2: Image.Transpose.FLIP_LEFT_RIGHT,
    3: Image.Transpose.ROTATE_180,
    4: Image.Transpose.FLIP_TOP_BOTTOM,
    5: Image.Transpose.TRANSPOSE,
    6: Image.Transpose.ROTATE_270,
    7: Image.Transpose.TRANSVERSE,
    8: Image.Transpose.ROTATE_90,
}


class Pixels:
    """The pixels of a picture; those of a file are read when they are first asked for.

    image: a path, an image of Pillow's, or an array (H, W, 3), (H, W, 4) (transparency is left out) or (H, W) of grey:
    uint8, uint16 or sRGB floats in 0..1, from the top. A file is PNG, JPEG, GIF, BMP, TIFF, WebP or PPM, whatever its
    name; an animation gives its first frame, CMYK becomes RGB without a colour profile, and Exif's orientation is
    heeded. Raises InputError, in the name of `owner`, for a file that is not there, is no picture or is damaged, for an
    array of another shape, type or range, and for more than `MOST_PIXELS`.
    """

    def __init__(self, owner: str, image):
        self._owner = owner
        if isinstance(image, str | os.PathLike):
            self._path = validate.path(owner, "image", image).absolute()
            if not os.path.isfile(self._path):
                raise InputError(f"{owner}: there is no image {str(image)!r}; {_REMEDY}")
            _read(owner, self._path, _check)
        elif isinstance(image, Image.Image):
            self.linear = _linear(owner, _looked(f"{owner}: image", image, _decoded))
        else:
            self.linear = _linear(owner, image)

    @functools.cached_property
    def linear(self) -> np.ndarray:
        """Linear RGB, (H, W, 3) float32, from the top."""
        return _linear(self._owner, _read(self._owner, self._path, _decoded))

    @functools.cached_property
    def mean(self) -> tuple[float, float, float]:
        """Its mean colour, linear RGB."""
        return tuple(self.linear.mean(axis=(0, 1), dtype=float).tolist())


def _read(owner, path, look):
    """What `look` finds in the Pillow image of a file, whose size is checked before it is decoded."""
    name = f"{owner}: image {str(path)!r}"
    try:
        file = open(path, "rb")
    except OSError as reason:
        raise InputError(f"{name} cannot be opened: {reason.strerror}; {_REMEDY}") from None
    with file, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Pillow's, about parts of the file that are not needed
        try:
            picture = Image.open(file, formats=KINDS)
        except Image.DecompressionBombError:
            raise InputError(f"{name} is too large; {_smaller()}") from None
        except Exception:  # whatever Pillow raises on what it cannot make sense of
            raise InputError(f"{name} is no picture, or a damaged one; give one of {', '.join(KINDS)}") from None
        return _looked(name, picture, look)


def _looked(name, picture, look):
    """What `look` finds in a Pillow image."""
    _refuse_large(name, picture.size)
    try:
        return look(picture)
    except Exception as reason:
        raise InputError(f"{name} {_unreadable(picture, reason)}") from None


def _unreadable(picture, reason):
    if "conversion" in str(reason):
        return f"has colours of the kind {picture.mode}; save it in RGB"
    return "is damaged or cut off; give a whole one"


def _refuse_large(name, size):
    if size[0] * size[1] > MOST_PIXELS:
        raise InputError(f"{name} is of {size[0]}x{size[1]} pixels; {_smaller()}")


def _smaller():
    return f"give one of at most {MOST_PIXELS / 1e6:.0f} million pixels, such as 8192x8192"


def _check(picture):
    """Sums over the parts of a file, where its kind has them."""
    picture.verify()


def _decoded(picture):
    """The array of a picture, upright: grey or RGB."""
    picture.load()
    turn = TURNS.get(_orientation(picture) or 0)
    if turn is not None:
        picture = picture.transpose(turn)
    if picture.mode == "F" or picture.mode.startswith("I;16"):
        return np.asarray(picture)
    if picture.mode == "I":
        return _deep(np.asarray(picture))
    return np.asarray(picture.convert("RGB"))


def _orientation(picture):
    try:
        return picture.getexif().get(_ORIENTATION)
    except Exception:  # a picture is as good without what its camera wrote beside
        return None


def _deep(grey):
    """Pillow's whole numbers of 32 bits as the 16 that they stand for in files of 16 bits."""
    if grey.min() < 0 or grey.max() > 65535:
        raise ValueError("conversion of 32 bits")
    return grey.astype(np.uint16)


def _linear(owner, image):
    array = validate.array(owner, "image", image, _REMEDY)
    if array.ndim in (2, 3):
        _refuse_large(f"{owner}: image", array.shape[1::-1])
    if array.ndim == 2:
        array = np.repeat(array[..., None], 3, axis=2)
    if array.ndim != 3 or array.shape[2] not in (3, 4) or array.size == 0:
        raise InputError(f"{owner}: image has shape {np.shape(image)}; {_REMEDY}")
    array = array[..., :3]
    if array.dtype.kind == "u" and array.dtype.itemsize <= 2:
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
