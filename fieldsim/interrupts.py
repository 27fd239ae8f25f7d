"""Interrupts that are obeyed, soon and once.

Python handles a signal wherever its main thread happens to be. Within a `__del__`, or a function that C code called, as
numba's compiler does, the KeyboardInterrupt is printed and lost. Here it waits until such a place is left; where it is
lost all the same, the next launch of a kernel raises it again.
"""

import _thread
import contextlib
import signal
import threading

# Functions whose exceptions Python cannot pass on: destructors, and what LLVM calls when it has compiled.
_DEAF = {"__del__", "_raw_object_cache_notify", "_raw_object_cache_getbuffer"}
_AGAIN = 0.02  # seconds

_heard = False
_come: int | None = None


def come() -> int | None:
    """The signal that has come, while signals are heard."""
    return _come


def check() -> None:
    """Raise KeyboardInterrupt if a signal has come, in the main thread."""
    if _come is not None and threading.current_thread() is threading.main_thread():
        raise KeyboardInterrupt


@contextlib.contextmanager
def heard(*names):
    """Within the block the signals of these names raise KeyboardInterrupt and are remembered.

    Handlers of others, and that signals are ignored (as `nohup` asks for), stay as they are.
    """
    global _heard, _come
    if _heard or threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {}
    usual = (signal.SIG_DFL, signal.default_int_handler)
    _heard, _come = True, None
    try:
        for name in names:
            number = getattr(signal, name, None)  # not every system has all
            if number is not None and signal.getsignal(number) in usual:
                before[number] = signal.signal(number, _handle)
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        _heard, _come = False, None


@contextlib.contextmanager
def obeyed():
    """Within the block Ctrl-C raises KeyboardInterrupt, at its end at the latest."""
    with heard("SIGINT"):
        try:
            yield
        except Exception:
            check()
            raise
        check()


def _handle(number, frame):
    global _come
    _come = _come or number
    while frame is not None:
        if frame.f_code.co_name in _DEAF:
            timer = threading.Timer(_AGAIN, _thread.interrupt_main, (number,))
            timer.daemon = True
            timer.start()
            return
        frame = frame.f_back
    raise KeyboardInterrupt
