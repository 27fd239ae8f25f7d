"""MuJoCo models from MJCF, and what of them is seen."""

import os
import pathlib
from typing import TypeAlias

import mujoco
import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.types import PathLike

# As in MuJoCo's own viewer, geoms of these groups are seen; those of others are for collisions alone, say.
SEEN_GROUPS = (0, 1, 2)
# What MuJoCo gives a geom that states no colour: one with a material then has the material's.
UNTOLD = np.array((0.5, 0.5, 0.5, 1.0), dtype=np.float32)
# A model, MJCF as text, or the path of a file of it.
ModelLike: TypeAlias = mujoco.MjModel | PathLike
# Things at most that a warning names.
MOST_NAMED = 12


def model_of(source: ModelLike) -> mujoco.MjModel:
    """The MjModel of `source`: itself, or the path of an .xml or .mjb file, or MJCF as text.

    Raises InputError for what is none of these, for a file that is not there, and for what MuJoCo cannot read, with
    its reason.
    """
    if isinstance(source, mujoco.MjModel):
        return source
    if not isinstance(source, str | os.PathLike):
        raise InputError(
            f"model is {validate.shown(source)}; give a mujoco.MjModel, MJCF as text, or the path of a file of it"
        )
    # A text has no path's limits.
    path = None if isinstance(source, str) else validate.path("MuJoCo", "model", source)
    text = str(path or source)
    if not is_text(text):
        raise InputError(f"model is {validate.shown(source)}; give MJCF as text, or the path of a file of it")
    if path is None and text.lstrip().startswith("<"):
        return _read(mujoco.MjModel.from_xml_string, text, "the MJCF")
    path = pathlib.Path(text)
    if not os.path.isfile(path):
        raise InputError(
            f"there is no model {validate.shown(text)}; give the path of an MJCF file, such as humanoid.xml"
        )
    binary = path.suffix == ".mjb"
    return _read(mujoco.MjModel.from_binary_path if binary else mujoco.MjModel.from_xml_path, text, repr(text))


def is_text(text: str) -> bool:
    """Whether MuJoCo can take a string: no zero characters, no halves of characters."""
    try:
        return "\0" not in text and text.encode() is not None
    except UnicodeEncodeError:
        return False


def named_body(model, name: str) -> int:
    """The number of the body of that name, -1 where there is none."""
    return mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name) if is_text(name) else -1


def _read(read, source, name):
    try:
        return read(source)
    except ValueError as reason:
        raise InputError(f"MuJoCo cannot read {name}: {' '.join(str(reason).split())}") from None


def color_of(model, number: int, of: str = "geom") -> np.ndarray:
    """What MuJoCo draws a geom, or another thing (`of`: site, tendon, flex, skin), with.

    Red, green, blue, opacity (4,), sRGB in 0..1.
    """
    material = getattr(model, f"{of}_matid")[number]
    own = getattr(model, f"{of}_rgba")[number]
    rgba = model.mat_rgba[material] if material >= 0 and np.array_equal(own, UNTOLD) else own
    return np.clip(rgba, 0.0, 1.0)


def seen(model, of: str) -> list[int]:
    """The objects of a type that MuJoCo shows by default: of groups 0 to 2, and not wholly transparent."""
    groups = getattr(model, f"{of}_group")
    return [k for k in range(len(groups)) if groups[k] in SEEN_GROUPS and color_of(model, k, of)[3] > 0.0]


def seen_geoms(model) -> list[int]:
    """The geoms that are seen."""
    return seen(model, "geom")


def label(model, geom: int) -> str:
    """A geom's name, or its number and its body."""
    name, body = model.geom(geom).name, int(model.geom_bodyid[geom])
    return repr(name) if name else f"{geom} of body {model.body(body).name or body!r}"


def named(model, sort: str, number: int) -> str:
    """The name of a thing of a sort (tendon, flex, texture, ...) as it stands in a message, or its number."""
    name = mujoco.mj_id2name(model, getattr(mujoco.mjtObj, f"mjOBJ_{sort.upper()}"), number)
    return repr(name) if name else str(number)


def listed(names) -> str:
    """Names as they stand in a warning: the first ones, and how many more there are."""
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return ", ".join(names[:MOST_NAMED]) + more


# Counts of objects by which models are distinguished.
COUNTS = ("nq", "nv", "na", "nu", "nbody", "njnt", "ngeom", "nsite", "nmocap", "nmesh")


def counts(model) -> tuple[int, ...]:
    """What copies of a model have in common, and hardly another one."""
    return tuple(int(getattr(model, name)) for name in COUNTS)


def alike(model, data, owner: str) -> None:
    """Refuse what is no MjData of this model or of a copy of it."""
    if not isinstance(data, mujoco.MjData):
        raise InputError(f"{owner}: data is {validate.shown(data)}; give a mujoco.MjData of the model")
    # MuJoCo's own number for the structure, which models that were stored lack.
    signed = {data.model.signature, model.signature} - {0}
    if counts(data.model) != counts(model) or len(signed) > 1:
        raise InputError(f"{owner}: this data belongs to another model; give a mujoco.MjData(model) of this one")
