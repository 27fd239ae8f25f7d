"""Stream compaction: the entries of an array that are wanted, on a device."""

import warp as wp

from fieldsim.launch import launch


@wp.kernel(enable_backward=False)
def _chosen(start: int, values: wp.array(dtype=int), chosen: wp.array(dtype=int)):
    i = start + wp.tid()
    chosen[i] = wp.where(values[i] >= 0, 1, 0)


@wp.kernel(enable_backward=False)
def _pack(
    start: int,
    values: wp.array(dtype=int),
    slot: wp.array(dtype=int),
    packed: wp.array(dtype=int),
    places: wp.array(dtype=int),
):
    i = start + wp.tid()
    if values[i] >= 0:
        packed[slot[i] - 1] = values[i]
        places[slot[i] - 1] = i


def picked(values: wp.array) -> tuple[wp.array, wp.array, int]:
    """(entries >= 0 in order, their indices, their number); the arrays have twice that length, for a radix sort."""
    device, number = values.device, values.shape[0]
    slot = wp.empty(number, dtype=int, device=device)
    launch(_chosen, number, [values], [slot], device=device, grain=1 << 14)
    wp.utils.array_scan(slot, slot, inclusive=True)
    total = int(slot[number - 1 :].numpy()[0]) if number else 0
    packed, places = (wp.empty(max(2 * total, 1), dtype=int, device=device) for _ in range(2))
    launch(_pack, number, [values, slot], [packed, places], device=device, grain=1 << 14)
    return packed, places, total
