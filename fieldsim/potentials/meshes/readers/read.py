"""Files of triangle meshes, which may come from anyone: STL, OBJ, PLY, OFF and GLB.

Each format has a reader in a file of its own, which takes the bytes of a file and gives vertices (V, 3) and faces
(F, 3). It opens no other file, and holds counts that the file names against its size before it takes memory for them.
It raises InputError with the end of a sentence about the file, or whatever Python does on nonsense.
"""

import os

import numpy as np

from fieldsim.errors import InputError
from fieldsim.potentials.meshes.readers.common import checked
from fieldsim.potentials.meshes.readers.glb import read_glb
from fieldsim.potentials.meshes.readers.obj import read_obj
from fieldsim.potentials.meshes.readers.off import read_off
from fieldsim.potentials.meshes.readers.ply import read_ply
from fieldsim.potentials.meshes.readers.stl import read_stl

READERS = {".stl": read_stl, ".obj": read_obj, ".ply": read_ply, ".off": read_off, ".glb": read_glb}


def read(path: str):
    """Vertices (V, 3) and faces (F, 3) of a file; InputError, naming it, for one that is no sound mesh."""
    bad = f"mesh: {path!r} cannot be read as a triangle mesh"
    if not os.path.isfile(path):
        raise InputError(f"mesh: there is no file {path!r}; give the path of one")
    reader = READERS.get(os.path.splitext(path)[1].lower())
    if reader is None:
        raise InputError(f"{bad}: its name should end in one of {', '.join(READERS)}; save it as one of them")
    try:
        with open(path, "rb") as file, np.errstate(all="ignore"):
            # Some editors put a mark of three bytes before a text.
            vertices, faces = reader(file.read().removeprefix(b"\xef\xbb\xbf"))
            return vertices, checked(vertices, faces)
    except InputError as reason:
        raise InputError(f"{bad}: {reason}") from None
    except OSError as reason:
        raise InputError(f"{bad}: {reason.strerror}") from None
    except Exception:  # whatever comes of taking nonsense for numbers, names and counts
        raise InputError(f"{bad}: it is damaged, or no {os.path.splitext(path)[1][1:].upper()}") from None
