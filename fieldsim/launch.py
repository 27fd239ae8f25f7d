"""Warp kernels, launched: one place that tiles CPU launches over threads, picks devices and keeps Warp quiet.

Kernels written for `launch` take the index of their first item as their first argument:
`i = start + wp.tid()`. A CPU launch of Warp is serial but releases the GIL, so slices of it run on a thread pool.
"""

import concurrent.futures
import contextlib
import ctypes
import functools
import os
import sys
import tempfile
import time

import warp as wp

from fieldsim.errors import DeviceError

THREADS = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1

# Warnings and errors of Warp are wanted, its banner and its word on every module loaded are not.
wp.config.log_level = max(wp.config.log_level, wp.LOG_WARNING)


def _initialise_quietly_without_driver():
    """Initialise Warp where there is no CUDA driver, leaving out its line on standard error that says so.

    The native library prints that line at first use, past every setting. With a driver nothing is printed, and Warp may
    initialise when it is first used, which takes longer there.
    """
    try:
        ctypes.CDLL("nvcuda.dll" if sys.platform == "win32" else "libcuda.so.1")
    except OSError:
        pass
    else:
        return
    try:
        kept = os.dup(2)
    except OSError:  # standard error is closed: nobody to spare the line
        return
    with tempfile.TemporaryFile() as heard:
        try:
            os.dup2(heard.fileno(), 2)
            wp.init()
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            heard.seek(0)
            for line in heard.read().splitlines():
                if b"NVIDIA CUDA driver" not in line:
                    os.write(2, line + b"\n")


_initialise_quietly_without_driver()


def device_named(name: str | None):
    """The Warp device for "cpu", "cuda", "cuda:1" or None (the CPU); raises DeviceError when it is not there."""
    wp.init()
    name = name or "cpu"
    why = "no CUDA device was found"
    # Without a driver, asking Warp for a CUDA device makes its native library print errors of its own.
    if wp.is_cuda_available() or not name.startswith("cuda"):
        try:
            return wp.get_device(name)
        except Exception as reason:
            why = reason
    here = ", ".join(str(device) for device in wp.get_devices())
    raise DeviceError(f"device {name!r} is not available: {why}; available: {here}")


class _Loading:
    """What loading (at first: compiling) kernels has taken."""

    def __init__(self):
        self.modules = set()
        self.started = None
        self.seconds = 0.0

    def load(self, kernel, device):
        """Load the kernel's module once, ahead of its launches: they then start at once, on any thread."""
        key = kernel.module, device.alias
        if key in self.modules:
            return
        with self.counted():
            # Warp launches CPU kernels with blocks of 1; loaded for any other size they would be compiled twice.
            kernel.module.load(device, block_dim=None if device.is_cuda else 1)
        self.modules.add(key)

    @contextlib.contextmanager
    def counted(self):
        """Count the time of a block, of a block within a block once."""
        outer = self.started
        self.started = outer or time.perf_counter()
        try:
            yield
        finally:
            if outer is None:
                self.seconds += time.perf_counter() - self.started
            self.started = outer


_loading = _Loading()


def loading():
    """A context: what happens within counts as loading, as code does that other compilers compile."""
    return _loading.counted()


def load_seconds() -> float:
    """Seconds that this process has spent loading kernels so far; above a second or so a load means compiling."""
    return _loading.seconds


def loading_for() -> float:
    """Seconds since the load of kernels that is now under way began; 0 when there is none."""
    started = _loading.started
    return 0.0 if started is None else time.perf_counter() - started


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
    _loading.load(kernel, device)
    if device.is_cuda or threads == 1 or count < 2 * grain:
        wp.launch(kernel, dim=count, inputs=[0, *arguments], device=device)
        return
    size = max(grain, -(-count // (4 * threads)))
    starts = range(0, count, size)
    work = _pool().map(
        lambda start: wp.launch(kernel, dim=min(size, count - start), inputs=[start, *arguments], device=device), starts
    )
    for _ in work:
        pass
