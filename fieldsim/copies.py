"""Copies and pickles: values take them; what is tied to its process refuses them in words."""

import os
import threading
import weakref

from fieldsim.errors import InputError

# For a forked child, in which nobody gives back the locks of other threads.
_LOCKS = weakref.WeakSet()


def _free_all():
    for lock in _LOCKS:
        lock._lock = threading.RLock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_free_all)


class ThreadLock:
    """A lock that one thread at a time holds, as often as it likes, and that is free in a forked child."""

    def __init__(self):
        self._lock = threading.RLock()
        _LOCKS.add(self)

    def __enter__(self):
        self._lock.acquire()

    def __exit__(self, *_):
        self._lock.release()


class Uncopied:
    """Base of what is tied to its process: buffers, files, a run under way."""

    _remedy = "make another one"

    def __reduce_ex__(self, protocol):
        name = type(self).__name__
        raise InputError(f"{name}: it is tied to this process and can be neither copied nor pickled; {self._remedy}")


def shallow(thing):
    """Another object of the same class with the same attributes, for a method's own use."""
    twin = object.__new__(type(thing))
    twin.__dict__.update(thing.__dict__)
    return twin
