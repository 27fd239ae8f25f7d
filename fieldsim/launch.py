"""Warp kernels, launched: one place that tiles CPU launches over threads, picks devices and keeps Warp quiet.

Kernels written for `launch` take the index of their first item as their first argument:
`i = start + wp.tid()`. A CPU launch of Warp is serial but releases the GIL, so slices of it run on a thread pool.
"""

import concurrent.futures
import contextlib
import ctypes
import functools
import math
import os
import sys
import tempfile
import threading
import time

import warp as wp

from fieldsim import interrupts, kernel_cache, validate
from fieldsim.errors import DeviceError
from fieldsim.types import WholeLike

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
        heard = tempfile.TemporaryFile()
    except OSError:  # standard error is closed: nobody to spare the line; or there is no place to keep it
        return
    with heard:
        try:
            os.dup2(heard.fileno(), 2)
            wp.init()
        except OSError:  # no kernel cache: `kernel_cache` has said so
            pass
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            heard.seek(0)
            for line in heard.read().splitlines():
                if b"NVIDIA CUDA driver" not in line:
                    os.write(2, line + b"\n")


kernel_cache.prepare()
_initialise_quietly_without_driver()


def checked_threads(owner: str, threads: WholeLike | None) -> int | None:
    """A number of threads, or None for all cores."""
    return validate.optional(validate.whole, owner, "threads", threads, at_least=1)


def device_named(name: str | None):
    """The Warp device for "cpu", "cuda", "cuda:1" or None (the CPU); raises DeviceError when it is not there."""
    wp.init()
    name = "cpu" if name is None else validate.text("device", "its name", name)
    why = "no CUDA device was found"
    # Without a driver, asking Warp for a CUDA device makes its native library print errors of its own.
    if wp.is_cuda_available() or not name.startswith("cuda"):
        try:
            return wp.get_device(name)
        except Exception as reason:
            why = reason
    here = ", ".join(str(device) for device in wp.get_devices())
    raise DeviceError(f"device {validate.shown(name)} is not available: {why}; available: {here}")


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
        # Warp launches CPU kernels with blocks of 1; loaded for any other size they would be compiled twice.
        block_dim = kernel.module.options["block_dim"] if device.is_cuda else 1
        with self.counted(aloud=not kernel_cache.is_compiled(kernel.module, block_dim)):
            kernel_cache.load(kernel.module, device, block_dim)
        self.modules.add(key)

    @contextlib.contextmanager
    def counted(self, aloud=True):
        """Count the time of a block, a nested block counts once; aloud: say to a waiting user what takes time."""
        outer = self.started
        self.started = outer or time.perf_counter()
        try:
            with interrupts.obeyed(), _notice.while_waiting() if aloud and outer is None else contextlib.nullcontext():
                yield
        finally:
            if outer is None:
                self.seconds += time.perf_counter() - self.started
            self.started = outer


class _Notice:
    """One line on standard error when a compiler keeps someone waiting who looks at a terminal or a notebook."""

    AFTER = 1.5  # seconds
    AGAIN = 30.0  # seconds between two such lines

    def __init__(self):
        self.muted = 0
        self.said = -self.AGAIN

    @contextlib.contextmanager
    def while_waiting(self):
        """Say so if the block takes long."""
        if self.muted or not is_watched(sys.stderr):
            yield
            return
        timer = threading.Timer(self.AFTER, self._say)
        timer.daemon = True
        timer.start()
        try:
            yield
        finally:
            timer.cancel()

    def _say(self):
        now = time.perf_counter()
        if self.muted or now - self.said < self.AGAIN:
            return
        self.said = now
        print(
            "fieldsim: compiling kernels, some seconds for each new kind of world; "
            f"they are kept in {wp.config.kernel_cache_dir}",
            file=sys.stderr,
            flush=True,
        )

    @contextlib.contextmanager
    def elsewhere(self):
        """While the block runs, something else shows that, as a bar does."""
        self.muted += 1
        try:
            yield
        finally:
            self.muted -= 1


def is_watched(stream):
    """Whether a person sees what goes to `stream`: a terminal's or a notebook's."""
    try:
        return stream.isatty() or type(stream).__module__.startswith("ipykernel")
    except (AttributeError, ValueError):  # none, or closed
        return False


_notice = _Notice()
told_elsewhere = _notice.elsewhere
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


# A forked process has the pool's queue but none of its threads.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)


# Slices of a launch take about so long [s]; so long, what items took last time is trusted.
_SLICE, _TRUSTED = 0.1, 0.0005
# Launches that take longer than this [s] are worth threads.
_THREADED = 0.00005
# So many parts of items a slice has at most: the next items may take far longer than those before.
_PARTS = 200_000
# Seconds that a part of an item took last, by kernel.
_paces = {}


class _Slices:
    """The slices of a launch, which threads take in turn until all are done.

    How long items take differs by powers of ten, and no launch can be broken off: the first slices are small, and
    others as large as takes about a tenth of a second, so that Ctrl-C is obeyed soon.
    """

    def __init__(self, kernel, count, most, parts, arguments, device):
        self._kernel, self._count, self._parts = kernel, count, parts
        self._most = max(1, min(most, _PARTS // parts)) if parts > 1 else most
        self._arguments, self._device = arguments, device
        self._size = min(self._most, max(1, int(_TRUSTED / (parts * _paces.get(kernel, math.inf)))))
        self._next = self._largest = 0
        self._lock = threading.Lock()
        self.stopped = False

    def work(self):
        """Launch slices as long as there are some."""
        while not self.stopped:
            with self._lock:
                first, size = self._next, min(self._size, self._count - self._next)
                self._next += size
            if size == 0:
                return
            begin = time.perf_counter()
            wp.launch(self._kernel, dim=size, inputs=[first, *self._arguments], device=self._device)
            self._learn(size, time.perf_counter() - begin)

    def _learn(self, size, seconds):
        """Fit the size of the slices to come."""
        if size >= self._largest:
            self._largest, _paces[self._kernel] = size, seconds / (size * self._parts)
        self._size = max(1, min(self._most, int(size * min(4.0, _SLICE / max(seconds, 1e-9)))))


def launch(kernel, count, inputs, outputs=(), *, device, grain=256, threads=None, parts=1):
    """Run `kernel(start, *inputs, *outputs)` for `count` items.

    On a CPU, slices run on `threads` threads (default all cores), of at least `grain` items where these take little
    time; results do not depend on the slicing as long as items do not write to the same place.
    Ctrl-C is obeyed between slices. parts: of how many parts an item consists, such as rays, if that varies.
    """
    device = wp.get_device(device)
    arguments = [*inputs, *outputs]
    interrupts.check()
    if count == 0:
        return
    _loading.load(kernel, device)
    expected = count * parts * _paces.get(kernel, math.inf)
    # Threads take longer to start than the shortest launches take.
    is_short = expected < (_TRUSTED if count < 2 * grain else _THREADED) and (parts == 1 or count * parts <= _PARTS)
    if device.is_cuda or is_short:
        begin = time.perf_counter()
        wp.launch(kernel, dim=count, inputs=[0, *arguments], device=device)
        _paces[kernel] = (time.perf_counter() - begin) / (count * parts)
        return
    threads = threads or THREADS
    if threads == 1 or count < 2 * grain:
        _Slices(kernel, count, count, parts, arguments, device).work()
        return
    slices = _Slices(kernel, count, max(grain, -(-count // (4 * threads))), parts, arguments, device)
    at_work = []
    try:
        at_work += (_pool().submit(slices.work) for _ in range(threads))
        for one in at_work:
            one.result()
    except BaseException:
        # Nothing may be written to the arrays once they are gone.
        slices.stopped = True
        concurrent.futures.wait(at_work)
        raise


def recorded(kernel, count, inputs, outputs=(), *, device):
    """A function that launches `kernel(0, *inputs, *outputs)` for `count` items on this thread, each time it is called.

    The arguments stay as they are, and so do the arrays' places.
    """
    device = wp.get_device(device)
    _loading.load(kernel, device)
    again = wp.launch(kernel, dim=count, inputs=[0, *inputs, *outputs], device=device, record_cmd=True).launch

    def run():
        interrupts.check()
        again()

    return run
