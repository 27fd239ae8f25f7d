"""Mipmaps: pictures on a device, each with its smaller copies, and trilinear lookup in Warp functions.

All pictures of a scene lie in one flat array of texels. A picture starts at its first texel, row by row from the top;
its copy of half the width and height follows, and so on down to a single texel (Williams 1983). A lookup interpolates
between two copies and among four texels of each: smooth, and as sharp as pixels can show.
"""

import functools

import numpy as np
import warp as wp

# First texels are multiples of this, so that float32 holds them: tables of materials carry them.
_STEP = 1024
_MOST_HALVED = wp.constant(30.0)


def pyramid(texels: np.ndarray) -> np.ndarray:
    """All copies of a picture (H, W, 3) after each other, (N, 3)."""
    levels = [texels]
    while levels[-1].shape[:2] != (1, 1):
        levels.append(_halved(_halved(levels[-1], 0), 1))
    return np.concatenate([level.reshape(-1, 3) for level in levels])


def _halved(texels, axis):
    """Means of two neighbours each; the last takes in an odd one."""
    size = texels.shape[axis]
    if size == 1:
        return texels
    starts = np.arange(size // 2) * 2
    counts = np.diff([*starts, size]).reshape([-1 if k == axis else 1 for k in range(3)])
    return np.add.reduceat(texels, starts, axis=axis) / counts.astype(texels.dtype)


def uploaded_pictures(pictures, device) -> tuple[wp.array, dict]:
    """The texels of several `Pixels` on a device, and the first texel of each; kept for the next frames."""
    return _uploaded(tuple(dict.fromkeys(pictures)), device.alias)


@functools.lru_cache(maxsize=8)
def _uploaded(pictures, device):
    parts, firsts, count = [np.zeros((0, 3), dtype=np.float32)], {}, 0
    for picture in pictures:
        firsts[picture] = count
        part = pyramid(picture.linear)
        parts.append(np.pad(part, ((0, -len(part) % _STEP), (0, 0))))
        count += len(parts[-1])
    return wp.array(np.concatenate(parts), dtype=wp.vec3, device=device), firsts


@wp.func
def _along(x: float, size: int, end: float):
    """(texel, next texel, share of the next) at x, in pictures; without an end they repeat, others stop at `end`."""
    if end > 0.0:
        half = 0.5 / float(size)
        x = wp.clamp(x, half, wp.max(end - half, half))
    place = (x - wp.floor(x)) * float(size) - 0.5
    low = int(wp.floor(place))
    share = place - float(low)
    here = (low + size) % size
    return here, (here + 1) % size, share


@wp.func
def _smooth(texels: wp.array(dtype=wp.vec3), first: int, width: int, height: int, place: wp.vec2, ends: wp.vec2):
    x0, x1, right = _along(place[0], width, ends[0])
    y0, y1, down = _along(place[1], height, ends[1])
    top = wp.lerp(texels[first + y0 * width + x0], texels[first + y0 * width + x1], right)
    bottom = wp.lerp(texels[first + y1 * width + x0], texels[first + y1 * width + x1], right)
    return wp.lerp(top, bottom, down)


@wp.func
def looked_up(
    texels: wp.array(dtype=wp.vec3), first: int, width: int, height: int, place: wp.vec2, ends: wp.vec2, covered: float
):
    """Linear colour of a picture at `place`, in pictures to the right and down.

    ends: number of pictures side by side and one above the other, 0 if they repeat or close; covered: texels along a
    side of what a pixel covers.
    """
    level = wp.clamp(wp.log2(wp.max(covered, 1.0)), 0.0, _MOST_HALVED)
    start = int(first)
    w = int(width)
    h = int(height)
    while level >= 1.0 and (w > 1 or h > 1):
        start += w * h
        w = wp.max(w // 2, 1)
        h = wp.max(h // 2, 1)
        level -= 1.0
    color = _smooth(texels, start, w, h, place, ends)
    if level > 0.0 and (w > 1 or h > 1):
        less = _smooth(texels, start + w * h, wp.max(w // 2, 1), wp.max(h // 2, 1), place, ends)
        color = wp.lerp(color, less, wp.min(level, 1.0))
    return color
