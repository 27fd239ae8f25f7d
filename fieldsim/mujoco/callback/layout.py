"""Where MuJoCo keeps what the callback needs: byte offsets in mjData and mjModel, from MuJoCo's own description.

Native callbacks receive bare addresses. The structs differ from version to version, so their layout is worked out from
`mujoco.introspect` of the version at hand, and checked against the arrays that Python sees (`check`).
"""

import ctypes
import functools
from typing import Any

import mujoco
from mujoco.introspect import structs

from fieldsim.errors import FieldsimError

# Fields of mjData that the callback reads or writes; all but the first are pointers to arrays of doubles.
FIELDS = ("time", "xipos", "ximat", "subtree_com", "cdof", "cvel", "qfrc_passive")
# Fields of mjModel that it reads; all but the first three are such pointers. And of its option: the time step, and the
# *mark*, four bytes at its end that belong to no field, but are copied and stored with the others.
MODEL_FIELDS = ("nv", "nbody", "signature", "body_mass", "body_inertia", "body_gravcomp")

# The modules that the callback is made of, but for portable functions.
FOLDERS = (
    "mujoco/callback",
    "mujoco/contact",
    "native",
    "portable/function.py",
    "portable/lanes/words.py",
    "potentials/row.py",
)

_TYPES = {
    "mjtNum": ctypes.c_double,
    "mjtSize": ctypes.c_int64,
    "mjtByte": ctypes.c_ubyte,
    "mjtBool": ctypes.c_bool,
    "int": ctypes.c_int,
    "float": ctypes.c_float,
    "size_t": ctypes.c_size_t,
    "uint64_t": ctypes.c_uint64,
    "uintptr_t": ctypes.c_void_p,
}


def offsets() -> dict[str, int]:
    """Byte offsets of the `FIELDS`, the `MODEL_FIELDS`, and in mjModel of "timestep", "gravity" and "mark".

    "mark" is -1 where there is no room for it.

    "size": the bytes of one of its numbers of things. Raises FieldsimError for a MuJoCo that is described otherwise.
    """
    try:
        model, option = _structure("mjModel"), _structure("mjOption")
        places = places_of("mjData", FIELDS) | places_of("mjModel", MODEL_FIELDS)
        end = max(getattr(option, name).offset + getattr(option, name).size for name, _ in option._fields_)
        room = ctypes.sizeof(option) - end >= ctypes.sizeof(ctypes.c_uint32)
        places |= {name: model.opt.offset + getattr(option, name).offset for name in ("timestep", "gravity")}
        places["size"] = model.nbody.size
        places["mark"] = model.opt.offset + end if room else -1
        return places
    except (KeyError, AttributeError) as reason:
        raise _unknown("mjModel", reason) from None


def taken() -> tuple:
    """What compiled code takes for granted of MuJoCo."""
    return mujoco.__version__, tuple(sorted(offsets().items()))


def places_of(struct: str, names) -> dict[str, int]:
    """Byte offsets of fields in a struct of MuJoCo's; raises FieldsimError where they are not known."""
    try:
        layout = _structure(struct)
        return {name: getattr(layout, name).offset for name in names}
    except (KeyError, AttributeError) as reason:
        raise _unknown(struct, reason) from None


def _unknown(struct, reason):
    return FieldsimError(
        f"MuJoCo {mujoco.__version__} describes {struct} in a way that is not known ({reason}); "
        "install a version from 3.3 to 4.0"
    )


@functools.cache
def _structure(name) -> Any:
    return _record(name, structs.STRUCTS[name].fields)


def _record(name, fields) -> Any:
    return type(name, (ctypes.Structure,), {"_fields_": [(field.name, _type_of(field.type)) for field in fields]})


def _type_of(described):
    """The ctypes type of what is described: arrays have extents, pointers an inner type, records fields, or a name."""
    if hasattr(described, "extents"):
        inner = _type_of(described.inner_type)
        for extent in reversed(described.extents):
            inner = inner * extent
        return inner
    if hasattr(described, "inner_type"):
        return ctypes.c_void_p
    if hasattr(described, "fields"):
        return _record("nameless", described.fields)
    return _TYPES.get(described.name) or _structure(described.name)


def check(data, places: dict[str, int]) -> None:
    """Raise FieldsimError unless `places` lead to the arrays that Python sees in `data`, an MjData, and its model."""
    model = data.model
    values = [(data, "time", data.time), (model, "timestep", model.opt.timestep)]
    wrong = [name for owner, name, value in values if _number(owner, places[name], ctypes.c_double) != value]
    size = ctypes.c_int64 if places["size"] == ctypes.sizeof(ctypes.c_int64) else ctypes.c_int32
    for name, kind in (("nv", size), ("nbody", size), ("signature", ctypes.c_uint64)):
        if _number(model, places[name], kind) != getattr(model, name):
            wrong.append(name)
    for owner, names in ((data, FIELDS[1:]), (model, MODEL_FIELDS[3:])):
        for name in names:
            if _number(owner, places[name], ctypes.c_void_p) != getattr(owner, name).ctypes.data:
                wrong.append(name)
    if wrong:
        raise FieldsimError(
            f"MuJoCo {mujoco.__version__} keeps {', '.join(wrong)} elsewhere than it says; "
            "install a version from 3.3 to 4.0"
        )


def _number(owner, place, kind):
    return kind.from_address(owner._address + place).value
