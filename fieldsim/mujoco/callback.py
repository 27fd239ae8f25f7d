"""Who owns `mjcb_passive`: MuJoCo has one such callback for the whole process.

While any `FieldForces` is active ours is in its place, and calls first what was there before; the last one that ends
puts that back. Each acts on its own model alone, so several models may be in several fields at once.
"""

import ctypes

import mujoco

from fieldsim.errors import InputError
from fieldsim.mujoco import native

# By the address of the model, in the order of their beginning.
_active: dict[int, object] = {}
_before = None


def begin(forces) -> None:
    """Let a FieldForces act on its model; raises InputError where that model has one already."""
    global _before
    if forces.model._address in _active:
        raise InputError(
            "FieldForces: this model is in the forces of another FieldForces already; leave that one first, or "
            "give all sources to one"
        )
    if len(_active) == native.MOST:
        raise InputError(f"FieldForces: {native.MOST} models are in fields already; leave some of them first")
    if not _active:
        _before = mujoco.get_mjcb_passive()
    _active[forces.model._address] = forces
    _install()


def end(forces) -> None:
    """Let it act no more."""
    global _before
    _active.pop(forces.model._address, None)
    if _active:
        return _install()
    mujoco.set_mjcb_passive(_before)
    _before = None
    native.REGISTRY[0] = 0


def active(forces) -> bool:
    """Whether it acts now."""
    return _active.get(forces.model._address) is forces


def is_native() -> bool:
    """Whether native code can do all that is asked for."""
    foreign = _before is None or isinstance(_before, ctypes._CFuncPtr)
    return foreign and all(forces.free_of_python for forces in _active.values())


def _install():
    if not is_native():
        mujoco.set_mjcb_passive(_dispatch)
        return
    table = native.REGISTRY
    table[0] = len(_active), ctypes.cast(_before, ctypes.c_void_p).value if _before else 0, 0
    for row, (model, forces) in zip(table[1:], _active.items(), strict=False):
        row[:] = model, *forces.addresses
    mujoco.set_mjcb_passive(_native_callback())


def _native_callback():
    return native.POINTER(native.dispatcher().address)


def _dispatch(model, data):
    """The same in Python, where a callback or a motion is known to Python only."""
    if isinstance(_before, ctypes._CFuncPtr):
        _before(model._address, data._address)
    elif _before is not None:
        _before(model, data)
    forces = _active.get(model._address)
    if forces is not None:
        forces.act(data)
