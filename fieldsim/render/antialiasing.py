"""More samples for pixels where the picture changes: five, nine, and sixteen where nine do not settle it."""

import numpy as np
import warp as wp

from fieldsim.launch import launch
from fieldsim.render.scene.compaction import picked
from fieldsim.render.scene.hits import Hits

CONTRAST = wp.constant(0.1)  # of square roots of linear colours, from which pixels are given more samples
# Places on a 4 x 4 grid in a pixel. Beside its centre: four with no two in a row or column, four more, and the rest.
_ROOKS = ((0, 1), (1, 3), (2, 0), (3, 2))
_OTHER_ROOKS = ((1, 0), (3, 1), (0, 2), (2, 3))
_REST = ((0, 0), (3, 0), (2, 1), (1, 2), (0, 3), (3, 3), (2, 2))
_ROUNDS = (_ROOKS, _OTHER_ROOKS, _REST)


@wp.func
def _perceived(linear: wp.vec3):
    """Square roots of linear colours: close to perceived brightness."""
    c = wp.min(wp.max(linear, wp.vec3(0.0, 0.0, 0.0)), wp.vec3(1.0, 1.0, 1.0))
    return wp.vec3(wp.sqrt(c[0]), wp.sqrt(c[1]), wp.sqrt(c[2]))


@wp.func
def _differ(a: int, b: int, hits: Hits, color: wp.array(dtype=wp.vec3)):
    """Whether the picture changes so much between two neighbouring pixels that they need more samples."""
    if hits.thing[a] == -1 and hits.thing[b] == -1:
        return False
    return wp.max(wp.abs(_perceived(color[a]) - _perceived(color[b]))) > CONTRAST


@wp.kernel(enable_backward=False)
def _edges(
    start: int, slot: wp.array2d(dtype=int), hits: Hits, color: wp.array(dtype=wp.vec3), edge: wp.array(dtype=int)
):
    """Mark pixels of a row, and those below it, that differ from a neighbour."""
    y = start + wp.tid()
    for x in range(slot.shape[1]):
        i = slot[y, x]
        if x < slot.shape[1] - 1:
            right = slot[y, x + 1]
            if _differ(i, right, hits, color):
                edge[i] = 0
                edge[right] = 0
        if y < slot.shape[0] - 1:
            below = slot[y + 1, x]
            if _differ(i, below, hits, color):
                edge[i] = 0
                edge[below] = 0


@wp.kernel(enable_backward=False)
def _place(
    start: int,
    pattern: wp.array(dtype=wp.vec2),
    which: wp.array(dtype=int),
    centers: wp.array(dtype=wp.vec2),
    samples: wp.array(dtype=wp.vec2),
):
    k = start + wp.tid()
    number = pattern.shape[0]
    samples[k] = centers[which[k // number]] + pattern[k % number]


@wp.kernel(enable_backward=False)
def _mix(
    start: int,
    before: int,
    number: int,
    which: wp.array(dtype=int),
    found: wp.array(dtype=wp.vec3),
    sum: wp.array(dtype=wp.vec3),
    color: wp.array(dtype=wp.vec3),
    more: wp.array(dtype=int),
):
    """Mix `number` new samples of pixels with `before` old ones; mark the pixels that need more."""
    k = start + wp.tid()
    i = which[k]
    old = wp.vec3(0.0, 0.0, 0.0)
    if before == 1:
        old = color[i]
    elif before > 1:
        old = sum[i]
    white = wp.vec3(1.0, 1.0, 1.0)
    # Brighter than white counts as white, or highlights would have ragged edges.
    old = wp.min(old, float(before) * white)
    low = _perceived(found[k * number])
    high = low
    new = wp.vec3(0.0, 0.0, 0.0)
    for j in range(number):
        c = found[k * number + j]
        new += wp.min(c, white)
        low = wp.min(low, _perceived(c))
        high = wp.max(high, _perceived(c))
    if before == 1:
        low = wp.min(low, _perceived(old))
        high = wp.max(high, _perceived(old))
    if before > 1:
        # A pixel is done when its new mean agrees with the old one.
        low = _perceived(old / float(before))
        high = _perceived(new / float(number))
    sum[i] = old + new
    color[i] = (old + new) / float(before + number)
    more[k] = wp.where(wp.max(wp.abs(high - low)) > CONTRAST, i, -1)


class Smoother:
    """Smooths pictures of one size, keeping buffers.

    slot (height, width): where a pixel is in the order of `centers`, which are points of the picture, (pixels,).
    """

    def __init__(self, slot, centers):
        self._slot, self._centers = slot, centers
        device, count = slot.device, centers.shape[0]
        self._edge = wp.empty(count, dtype=int, device=device)
        self._sum = wp.empty(count, dtype=wp.vec3, device=device)
        self._patterns = [
            wp.array((np.array(places) + 0.5) / 4.0 - 0.5, dtype=wp.vec2, device=device) for places in _ROUNDS
        ]

    def smooth(self, most: int, hits: Hits, color: wp.array, shade) -> None:
        """Give more samples to pixels that differ from their neighbours, and more still where those differ.

        most: samples a pixel, 4 or 16; shade(samples, share): their colours, `share` of them in a pixel.
        """
        device = color.device
        self._edge.fill_(-1)
        launch(_edges, self._slot.shape[0], [self._slot, hits, color], [self._edge], device=device, grain=16)
        _, which, number = picked(self._edge)
        # Four without the centre are more even than with it.
        before = 0 if most == 4 else 1
        for pattern in self._patterns[: 1 if most == 4 else None]:
            if not number:
                return
            share = pattern.shape[0]
            samples = wp.empty(number * share, dtype=wp.vec2, device=device)
            launch(_place, number * share, [pattern, which, self._centers], [samples], device=device, grain=4096)
            more = wp.empty(number, dtype=int, device=device)
            given = [before, share, which, shade(samples, share), self._sum]
            launch(_mix, number, given, [color, more], device=device, grain=4096)
            which, _, number = picked(more)
            before += share
