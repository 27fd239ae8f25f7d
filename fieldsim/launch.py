"""Warp kernels, launched: one place that tiles CPU launches over threads and picks devices.

Kernels written for `launch` take the index of their first item as their first argument:
`i = start + wp.tid()`. A CPU launch of Warp is serial but releases the GIL, so slices of it run on a thread pool.
"""

import concurrent.futures
import functools
import os

import warp as wp

from fieldsim.errors import DeviceError

wp.config.quiet = True

THREADS = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def device_named(name: str | None):
    """The Warp device for "cpu", "cuda", "cuda:1" or None (the CPU); raises DeviceError when it is not there."""
    _initialise()
    if name is None:
        return wp.get_device("cpu")
    try:
        return wp.get_device(name)
    except Exception as reason:
        here = ", ".join(str(device) for device in wp.get_devices())
        raise DeviceError(f"device {name!r} is not available ({reason}); available: {here}") from None


@functools.cache
def _initialise():
    wp.init()


@functools.cache
def _pool():
    return concurrent.futures.ThreadPoolExecutor(THREADS, thread_name_prefix="fieldsim")


def launch(kernel, count, inputs, outputs=(), *, device, grain=256, threads=None):
    """Run `kernel(start, *inputs, *outputs)` for `count` items.

    On a CPU, slices of at least `grain` items run on `threads` threads (all cores unless told); results do not depend
    on the slicing as long as items do not write to the same place.
    """
    device = wp.get_device(device)
    arguments = [*inputs, *outputs]
    if count == 0:
        return
    threads = threads or THREADS
    if device.is_cuda or threads == 1 or count < 2 * grain:
        wp.launch(kernel, dim=count, inputs=[0, *arguments], device=device)
        return
    kernel.module.load(device)
    size = max(grain, -(-count // (8 * threads)))
    starts = range(0, count, size)
    work = _pool().map(
        lambda start: wp.launch(kernel, dim=min(size, count - start), inputs=[start, *arguments], device=device), starts
    )
    for _ in work:
        pass
