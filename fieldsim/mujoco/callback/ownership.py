"""Who owns `mjcb_passive`: MuJoCo has one such callback for the whole process.

While any `FieldForces` is active ours is in its place, and calls first what was there before; the last one that ends
puts that back. Each acts on its own model and on copies of it, so several models may be in several fields at once, in
threads that come and go, too. What a user sets in the meantime is not undone: the field is off then, and that is told.
"""

import ctypes
import functools
import os
import threading
from typing import Any, Protocol

import mujoco
import numpy as np

from fieldsim.errors import InputError
from fieldsim.mujoco.callback import entries, native
from fieldsim.mujoco.callback.addresses import library


class Acting(Protocol):
    """Forces of which native code has an entry: they act on a model and on its copies; a `FieldForces`.

    model, data: an MjModel and an MjData; mark: by which copies of the model are known; entry: see `entries.entry_of`.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    mark: int
    entry: np.ndarray

    @property
    def free_of_python(self) -> bool:
        """Whether native code alone can do it."""
        ...

    def act_at(self, model: int, data: int) -> None:
        """Add the forces at the addresses of a model and its data."""
        ...

    def act_apart(self, model: int, data: int) -> None:
        """The same in a thread of MuJoCo's, where nothing may be raised."""
        ...

    def warn_of_start(self) -> None:
        """Tell of what starts inside of a surface; called when its data was set back to an earlier time."""
        ...


# Guards what follows; native code reads its rows without it.
_lock = threading.RLock()
# Who acts, by the row that stands for it; and who did, and may be at work still in another thread.
_active: dict[int, Acting] = {}
_leaving: dict[int, Acting] = {}
# Rows that were active while a callback that the user set stood in the place of ours.
_displaced: set[int] = set()
# What was there before; what Python is told is there now.
_before: Any = None
_ours: Any = None


def begin(forces: Acting) -> None:
    """Let a FieldForces act on its model; raises InputError where that model has one already."""
    with _lock:
        if any(other.model._address == forces.model._address for other in _active.values()):
            raise InputError(
                "FieldForces: this model is in the forces of another FieldForces already; leave that one first, or "
                "give all sources to one"
            )
        _forget()
        row = next((row for row in range(entries.MOST) if row not in _active and row not in _leaving), None)
        if row is None:
            raise InputError(f"FieldForces: {entries.MOST} models are in fields already; leave some of them first")
        if not in_place():
            _displaced.update(_active)
            _install()
        _active[row] = forces
        entries.set_mark(forces.model._address, forces.mark)
        entries.publish(row, forces.entry, forces.data._address)


def renew(forces: Acting) -> bool:
    """Take its new entry, if it acts. Whether no thread is at work with the one before."""
    with _lock:
        row = _row_of(forces)
        if row is not None:
            entries.renew(row, forces.entry)
        return row is None or not entries.is_busy(row)


def end(forces: Acting) -> tuple[bool, int, int]:
    """Let it act no more. Whether it was displaced, and what moved without the field (see `entries.strangers`)."""
    with _lock:
        row = _row_of(forces)
        if row is None:
            return False, 0, 0
        found = not in_place() or row in _displaced, *entries.strangers(row)
        _displaced.discard(row)
        entries.withdraw(row)
        _leaving[row] = _active.pop(row)
        _forget()
        if not _active:
            _restore()
        return found


def active(forces: Acting) -> bool:
    """Whether it was entered, and not left."""
    with _lock:
        return _row_of(forces) is not None


def is_native(forces: Acting) -> bool:
    """Whether MuJoCo calls ours, and that nothing but native code for its model."""
    return in_place() and not _asks_python(_before) and forces.free_of_python


def in_place() -> bool:
    """Whether MuJoCo calls ours."""
    return _ours is not None and _pointer().value == native.dispatcher(_act).address


def _row_of(forces):
    return next((row for row, other in _active.items() if other is forces), None)


def _forget():
    for row in [row for row in _leaving if not entries.is_busy(row)]:
        del _leaving[row]


@functools.cache
def _pointer():
    """MuJoCo's own variable."""
    return ctypes.c_void_p.in_dll(library(), "mjcb_passive")


def _asks_python(callback):
    return callback is not None and not isinstance(callback, ctypes._CFuncPtr)


def _install():
    global _before, _ours
    found, address = mujoco.get_mjcb_passive(), native.dispatcher(_act).address
    if found is not None and found is _ours:
        found = _before  # ours, set again by hand
    _before = found
    if _asks_python(found):
        # MuJoCo keeps it, and we call what MuJoCo would: its own way into Python.
        _ours = functools.partial(found)
        mujoco.set_mjcb_passive(_ours)
        entries.HEADER[1] = _pointer().value or 0
        _pointer().value = address
    else:
        entries.HEADER[1] = ctypes.cast(found, ctypes.c_void_p).value or 0 if found else 0
        _ours = native.POINTER(address)
        mujoco.set_mjcb_passive(_ours)


def _restore():
    """Put back what was there, unless the user has set something else."""
    global _before, _ours
    if mujoco.get_mjcb_passive() is _ours:
        mujoco.set_mjcb_passive(_before)
    entries.HEADER[1] = 0
    _before = _ours = None


def _act(model: int, data: int, foreign: int) -> None:
    """What native code asks of Python: to act where a source's motion, or all, is known to Python only."""
    known = [(row, forces) for row, forces in list(_active.items()) if entries.is_copy(forces.entry, model)]
    # The model's own before those that it is a copy of.
    for row, forces in sorted(known, key=lambda one: one[1].model._address != model)[:1]:
        if entries.begin_anew(row, data) and not foreign:
            forces.warn_of_start()
        (forces.act_apart if foreign else forces.act_at)(model, data)


def _after_a_fork():
    """In the child no other thread holds a lock, or is at work."""
    global _lock
    _lock = threading.RLock()
    entries.ROWS[:, entries.BUSY] = 0


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_a_fork)
