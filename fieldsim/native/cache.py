"""Object code on disk, in the folder of Warp's kernels: shared between processes, and never in the way.

A file has the SHA-256 of its content in its first line, so that a torn or damaged one is made anew. It is made by one
process at a time, and in one piece. Where it cannot be written it is made in every process.
"""

import contextlib
import hashlib
import os
import pathlib
import tempfile
from collections.abc import Callable

from fieldsim import kernel_cache
from fieldsim.copies import ThreadLock

# Files of one name that are kept, the newest: of other sources, processors and versions.
MOST = 12

_threads = ThreadLock()


def kept(name: str, key: str, make: Callable[[], bytes], usable: Callable[[bytes], bool]) -> bytes:
    """The content of the file of a name and a key, as `make` gives it; made anew where it is damaged or not usable."""
    path = kernel_cache.root() / "fieldsim-native" / f"{name}-{key[:40]}.object"
    found = _read(path)
    if found is not None and usable(found):
        return found
    # Locks on files are not between threads.
    with _threads, kernel_cache.held(path.parents[1] / path.name):
        found = _read(path)
        if found is None or not usable(found):
            found = make()
            with contextlib.suppress(OSError):
                _write(path, found)
                _forget(path.parent, name)
    return found


def _read(path):
    """What was written; None where there is nothing, or something else."""
    try:
        if not path.is_file():  # reading from a pipe would wait for ever
            return None
        first, _, content = path.read_bytes().partition(b"\n")
    except OSError:
        return None
    return content if first == hashlib.sha256(content).hexdigest().encode() else None


def _write(path: pathlib.Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
        try:
            file.write(hashlib.sha256(content).hexdigest().encode() + b"\n" + content)
            file.close()
            os.replace(file.name, path)
        except BaseException:
            os.unlink(file.name)
            raise


def _forget(folder, name):
    """Delete the oldest files of a name where there are many."""
    files = [path for path in folder.glob("*.object") if path.name.rpartition("-")[0] == name]
    for path in sorted(files, key=lambda path: path.stat().st_mtime)[:-MOST]:
        path.unlink(missing_ok=True)
