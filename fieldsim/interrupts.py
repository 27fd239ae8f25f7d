"""Interrupts that are obeyed, soon and once.

Python handles a signal wherever its main thread happens to be. Within a `__del__`, or a function that C code called, as
numba's compiler does, the KeyboardInterrupt is printed and lost. Here it waits until such a place is left; where it is
lost all the same, the next launch of a kernel raises it again. What is being finished or kept is finished first, and of
signals that follow each other closely, as a closing terminal sends them, one counts.
"""

import _thread
import contextlib
import signal
import threading
import time

# Functions whose exceptions Python cannot pass on: destructors, and what LLVM calls when it has compiled.
_DEAF = {"__del__", "_raw_object_cache_notify", "_raw_object_cache_getbuffer"}
_AGAIN = 0.02  # seconds
_CLOSELY = 1.0  # seconds after a signal in which others are the same one
_PATIENCE = 30.0  # seconds for which signals wait for what is being kept


class _Hearing:
    """The signals that are heard at a time."""

    def __init__(self, names):
        self.come: int | None = None
        self.before = {}
        self.timer: threading.Timer | None = None
        # When a signal was raised last; since when one waits, while something is being kept.
        self.raised, self.keeping = -_CLOSELY, False
        self.waiting: float | None = None
        # Handlers of others, and that signals are ignored (as by `nohup`), stay as they are.
        usual = (signal.SIG_DFL, signal.default_int_handler)
        for name in names:
            number = getattr(signal, name, None)  # not every system has all
            if number is not None and signal.getsignal(number) in usual:
                self.before[number] = signal.signal(number, self.handle)

    def handle(self, number, frame):
        """What Python calls when a signal has come."""
        self.come = self.come or number
        if self._waits(time.monotonic()):
            return
        while frame is not None:
            if frame.f_code.co_name in _DEAF:
                return self._come_again(number)
            frame = frame.f_back
        self.obey()

    def _waits(self, now):
        """Whether a signal is not to be raised now: it was just raised, or something is being kept."""
        if not self.keeping:
            return now < self.raised + _CLOSELY
        if self.waiting is None:
            self.waiting = now
        return now < self.waiting + _PATIENCE

    def obey(self):
        """Raise it."""
        self.forget_timer()
        self.raised, self.waiting = time.monotonic(), None
        raise KeyboardInterrupt

    def _come_again(self, number):
        self.timer = again(number)

    def forget_timer(self):
        """Let the signal not come again: it is obeyed."""
        if self.timer is not None:
            self.timer.cancel()
            self.timer = None

    def end(self):
        self.forget_timer()
        for number, handler in self.before.items():
            signal.signal(number, handler)


_hearing: _Hearing | None = None


def again(number: int = signal.SIGINT) -> threading.Timer:
    """Let a signal come again, soon: for what C code called and cannot pass KeyboardInterrupt on."""
    timer = threading.Timer(_AGAIN, _thread.interrupt_main, (number,))
    timer.daemon = True
    timer.start()
    return timer


def come() -> int | None:
    """The signal that has come, while signals are heard."""
    return _hearing.come if _hearing else None


def check() -> None:
    """Raise KeyboardInterrupt if a signal has come, in the main thread."""
    if _hearing and _hearing.come is not None and threading.current_thread() is threading.main_thread():
        _hearing.obey()


@contextlib.contextmanager
def heard(*names):
    """Within the block the signals of these names raise KeyboardInterrupt and are remembered."""
    global _hearing
    if _hearing or threading.current_thread() is not threading.main_thread():
        yield
        return
    hearing = _hearing = _Hearing(names)
    try:
        yield
    finally:
        hearing.end()
        _hearing = None


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


@contextlib.contextmanager
def held():
    """Within the block signals wait, for what is being finished or kept; at its end one that has come is raised."""
    with heard("SIGINT"):
        hearing = _hearing
        if hearing is None or hearing.keeping or threading.current_thread() is not threading.main_thread():
            yield
            return
        hearing.keeping = True
        try:
            yield
        finally:
            hearing.keeping = False
            if hearing.waiting is not None:
                hearing.obey()
