"""Where MuJoCo keeps the arrays of an mjData: byte offsets in the struct, from MuJoCo's own description of it.

Native callbacks receive bare addresses. The struct differs from version to version, so its layout is worked out from
`mujoco.introspect` of the version at hand, and checked against the arrays that Python sees (`check`).
"""

import ctypes

import mujoco
from mujoco.introspect import structs

from fieldsim.errors import FieldsimError

# Fields that the callback reads or writes; all but the first are pointers to arrays of doubles.
FIELDS = ("time", "xipos", "ximat", "subtree_com", "cdof", "cvel", "qfrc_passive")

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
    """Byte offsets in mjData of the `FIELDS`; raises FieldsimError for a MuJoCo whose description is not understood."""
    return places_of("mjData", FIELDS)


def places_of(struct: str, fields) -> dict[str, int]:
    """Byte offsets of fields in a struct of MuJoCo's; raises FieldsimError where they are not known."""
    try:
        layout = _structure(struct)
        return {name: getattr(layout, name).offset for name in fields}
    except (KeyError, AttributeError) as reason:
        raise FieldsimError(
            f"MuJoCo {mujoco.__version__} describes {struct} in a way that is not known ({reason}); "
            "use native=False, or a version from 3.3 to 4.0"
        ) from None


def _structure(name):
    fields = [(field.name, _type_of(field.type)) for field in structs.STRUCTS[name].fields]
    return type(name, (ctypes.Structure,), {"_fields_": fields})


def _type_of(described):
    """The ctypes type of a described one: arrays have extents, pointers an inner type, values a name."""
    if hasattr(described, "extents"):
        inner = _type_of(described.inner_type)
        for extent in reversed(described.extents):
            inner = inner * extent
        return inner
    if hasattr(described, "inner_type"):
        return ctypes.c_void_p
    return _TYPES.get(described.name) or _structure(described.name)


def check(data, places: dict[str, int]) -> None:
    """Raise FieldsimError unless `places` lead to the very arrays that Python sees in `data` (an MjData)."""
    address = data._address
    found = ctypes.c_double.from_address(address + places["time"]).value
    wrong = [] if found == data.time else ["time"]
    for name in FIELDS[1:]:
        pointer = ctypes.c_void_p.from_address(address + places[name]).value
        if pointer != getattr(data, name).ctypes.data:
            wrong.append(name)
    if wrong:
        raise FieldsimError(
            f"MuJoCo {mujoco.__version__} keeps {', '.join(wrong)} elsewhere in mjData than it says; use native=False"
        )
