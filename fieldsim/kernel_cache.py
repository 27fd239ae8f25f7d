"""The cache of compiled kernels: kept whole, shared between processes, and never in the way.

Warp keeps compiled modules in a folder (`WARP_CACHE_PATH`, else the user's cache folder) and trusts what it finds
there. Here each file has its SHA-256 beside it, so that a torn or damaged one is compiled anew instead of failing for
ever, or worse. A module is loaded by one process at a time: two that want the same one compile it once. Where the
folder cannot be made, written or filled further, a private temporary one takes its place, and one line says so.
"""

import atexit
import contextlib
import hashlib
import os
import pathlib
import shutil
import sys
import tempfile

import warp as wp

from fieldsim.copies import ThreadLock
from fieldsim.errors import FieldsimError

try:
    import fcntl
except ImportError:  # where there are no such locks two processes may compile one module twice
    fcntl = None

# What Warp loads from a module's folder, beside the source that it was made from.
_LOADED = {".o", ".ptx", ".cubin", ".meta"}
_DIGEST = ".sha256"

# Less room than this on the disk, in bytes, is none: what a few modules take.
_ROOM = 1 << 20

# Loading changes Warp's tables, and locks on files are not between threads.
_threads = ThreadLock()


def prepare() -> None:
    """Make sure that Warp finds a folder it can write to. To be called before Warp is initialised."""
    folder = _chosen()
    if folder is None:
        return
    try:
        _try_out(folder)
    except OSError as reason:
        try:
            _use_another(folder, reason)
        except FieldsimError as error:  # importing goes on; the first kernel will say the same
            _say(error)


def _chosen():
    """The folder that Warp will take, as far as it is known beforehand."""
    given = wp.config.kernel_cache_dir or os.environ.get("WARP_CACHE_PATH")
    if given:
        return pathlib.Path(os.path.realpath(given))
    if os.name == "nt" or sys.platform == "darwin":
        return None
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    return pathlib.Path(home) / "warp"


def _try_out(folder, room=0):
    """Raise OSError unless files of `room` bytes can be made in `folder`, which is made where it is missing."""
    if str(folder).startswith("~"):
        raise OSError("there is no home folder")
    folder = folder / wp.config.version
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder) as file:
        file.write(bytes(room))


def _use_another(folder, reason):
    """Compile into a temporary folder of this process's own from now on, gone when it ends."""
    words = f"the kernel cache {folder} cannot be used ({getattr(reason, 'strerror', None) or reason})"
    remedy = "set WARP_CACHE_PATH to a folder that you can write to"
    try:
        other = tempfile.mkdtemp(prefix="fieldsim-kernels-")
    except OSError as none:
        raise FieldsimError(f"{words}, and there is no temporary folder: {none.strerror}; {remedy}") from None
    atexit.register(shutil.rmtree, other, ignore_errors=True)
    wp.config.kernel_cache_dir = other
    _say(f"{words}; this run compiles into a temporary folder; {remedy}")


def _say(words):
    with contextlib.suppress(OSError, ValueError, AttributeError):  # standard error is closed: nobody to tell
        print("fieldsim:", words, file=sys.stderr, flush=True)


def load(module, device, block_dim) -> None:
    """Load a Warp module, compiled anew where the cache does not hold it whole; raises FieldsimError if all fails."""
    with _threads:
        try:
            return _load(module, device, block_dim)
        except Exception as reason:
            first = reason
        # The second try starts from nothing, and elsewhere if there is no room.
        folder = pathlib.Path(wp.config.kernel_cache_dir)
        shutil.rmtree(_folder_of(module, block_dim), ignore_errors=True)
        try:
            _try_out(folder.parent, _ROOM)
        except OSError as reason:
            _use_another(folder, reason)
        module.mark_modified()
        try:
            return _load(module, device, block_dim)
        except Exception as reason:
            raise FieldsimError(
                f"a kernel cannot be compiled or loaded: {reason}; if the kernel cache "
                f"{wp.config.kernel_cache_dir} is at fault, delete it or set WARP_CACHE_PATH to another folder"
            ) from first


def object_of(module) -> bytes:
    """The object code of a Warp module for this processor, compiled now; its threads know nothing of blocks."""
    level = wp.config.log_level
    module.options["block_dim"] = 1
    with _threads, tempfile.TemporaryDirectory() as folder:
        # Warp warns that this code is for this processor alone, as is meant.
        wp.config.log_level = max(level, wp.LOG_ERROR)
        try:
            (path,) = wp.compile_aot_module(module, device="cpu", module_dir=folder)
        finally:
            wp.config.log_level = level
        return path.read_bytes()


def is_compiled(module, block_dim) -> bool:
    """Whether the cache seems to hold the module, so that loading takes no time to speak of."""
    return _folder_of(module, block_dim).is_dir()


def _folder_of(module, block_dim):
    return pathlib.Path(wp.config.kernel_cache_dir) / module.get_module_identifier(block_dim)


def _load(module, device, block_dim):
    folder = _folder_of(module, block_dim)
    with held(folder):
        _drop_damaged(folder)
        module.load(device, block_dim=block_dim)
        _sign(folder)


def root() -> pathlib.Path:
    """The folder of this version's modules."""
    folder = _chosen()
    if folder is None:
        wp.init()
        folder = pathlib.Path(wp.config.kernel_cache_dir)
    return folder if folder.name == wp.config.version else folder / wp.config.version


@contextlib.contextmanager
def held(folder: pathlib.Path):
    """Hold the folder's lock against other processes: one byte, by its name, of one file that all lock in."""
    place = int.from_bytes(hashlib.sha256(folder.name.encode()).digest()[:4], "big")
    file = _lock_file(folder.parent)
    if file is None or fcntl is None:
        yield
        return
    try:
        fcntl.lockf(file, fcntl.LOCK_EX, 1, place)
        yield
    finally:
        fcntl.lockf(file, fcntl.LOCK_UN, 1, place)


_lock_files: dict[tuple[int, pathlib.Path], int | None] = {}
# No link that somebody planted there is followed.
_LOCK_FLAGS = os.O_RDWR | os.O_CREAT | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_NOFOLLOW", 0)


def _lock_file(root):
    """The descriptor of the lock file in `root`, never closed: closing one would free all locks; None without locks."""
    key = os.getpid(), root
    if key not in _lock_files:
        _lock_files[key] = None
        # A disk without locks, or a system.
        with contextlib.suppress(OSError):
            if fcntl is not None:
                file = os.open(root / "fieldsim.lock", _LOCK_FLAGS, 0o600)
                fcntl.lockf(file, fcntl.LOCK_SH, 1, 0)
                fcntl.lockf(file, fcntl.LOCK_UN, 1, 0)
                _lock_files[key] = file
    return _lock_files[key]


def _loaded_files(folder):
    try:
        return [path for path in folder.iterdir() if path.suffix in _LOADED]
    except OSError:
        return []


def _drop_damaged(folder):
    """Delete files that are not as they were written, pipes that reading would wait for, and what is no folder."""
    if not folder.is_dir():
        folder.unlink(missing_ok=True)
    for path in _loaded_files(folder):
        digest = path.with_name(path.name + _DIGEST)
        try:
            whole = path.is_file() and digest.is_file() and digest.read_text() == _digest_of(path)
        except (OSError, ValueError):
            whole = False
        if not whole:
            path.unlink(missing_ok=True)
            digest.unlink(missing_ok=True)


def _sign(folder):
    """Keep the digests of files that have none yet."""
    for path in _loaded_files(folder):
        # Made anew: no link is followed.
        with contextlib.suppress(OSError), open(path.with_name(path.name + _DIGEST), "x") as digest:
            digest.write(_digest_of(path))


def _digest_of(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()
