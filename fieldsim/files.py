"""Files that appear under their names when they are whole, and never in place of more than they hold.

What is written goes into a part first: a hidden file or folder beside its target, `.NAME-TOKEN.part.ENDING`. Its name
cannot be guessed and is made anew, so that no link planted there is followed. A part is locked as long as its writer
lives: one without a lock was left by a run that was killed, and goes when the next part is made in its folder.
"""

import collections
import contextlib
import itertools
import os
import pathlib
import re
import secrets
import shutil
import stat
import warnings
import weakref

from fieldsim import validate
from fieldsim.errors import FieldsimError, FieldsimWarning, InputError

try:
    import fcntl
except ImportError:  # Windows: parts are not locked there, and none is taken for a killed run's
    fcntl = None

# The last files that appeared whole.
appeared = collections.deque(maxlen=4)

_PART = re.compile(r"\..*-[0-9a-f]{16}\.part(\.\w+)?")


class Part:
    """What is written before it appears at `target`: an empty hidden file at `path`, or a folder.

    End it by `publish`, `keep` or `discard`; what is forgotten goes with its part, or when Python ends.
    Raises OSError where nothing can be written.
    """

    def __init__(self, target, *, folder: bool = False):
        self.given = pathlib.Path(target)
        # Where that is now, wherever the working folder is later.
        self.target = pathlib.Path.cwd() / target
        # Within a folder that is there: what is around it may be another disk's, or not for us to write.
        place = self.target / "part" if folder and self.target.is_dir() else self.target
        remove_left(place.parent)
        self.path, lock = _made(place, folder)
        self.discard = weakref.finalize(self, _discard, self.path, lock, os.getpid())

    def publish(self) -> None:
        """Let it appear at the target, in place of what is there."""
        os.replace(self.path, self.target)
        appeared.append(self.given)
        self.discard()

    def keep(self) -> pathlib.Path:
        """Let it appear in place of nothing: at the target, or as NAME.partial where there is one; returns where."""
        kept = next(name for name in names(self.target) if claim(self.path, name))
        self.discard()
        return self.beside(kept.name)

    def beside(self, name: str) -> pathlib.Path:
        """The path of a file beside the target, in the user's way."""
        return (self.given if self.given.name else self.target).with_name(name)


def checked_target(owner: str, value) -> pathlib.Path:
    """The path of a file that is to be written; InputError, before any work, for one that cannot be."""
    path = validate.path(owner, "path", value)
    folder = path.parent
    if not os.path.isdir(folder):
        raise InputError(f"{owner}: {str(path)!r}: the folder {str(folder)!r} does not exist; create it first")
    if os.path.isdir(path):
        raise InputError(f"{owner}: {str(path)!r}: this is a folder; give a file's name")
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        mode = stat.S_IFREG
    except OSError as reason:
        raise InputError(f"{owner}: {str(path)!r} cannot be the name of a file: {reason.strerror}") from None
    # A link is not followed, but replaced.
    if not (stat.S_ISREG(mode) or stat.S_ISLNK(mode)):
        raise InputError(f"{owner}: {str(path)!r} is a device or a pipe; give a file's name")
    if stat.S_ISREG(mode) and path.exists() and not _may(path, os.W_OK):
        raise InputError(f"{owner}: {str(path)!r} may not be written; give another name, or the right to write it")
    if not _may(folder, os.W_OK | os.X_OK):
        raise InputError(f"{owner}: {str(path)!r}: nothing may be written into the folder {str(folder)!r}")
    return path


def _may(path, what):
    return os.access(path, what, effective_ids=os.access in os.supports_effective_ids)


def write(owner: str, target, data: bytes) -> None:
    """Write a whole file, or none: InputError, naming the `owner`, where that cannot be done."""
    try:
        part = Part(target)
        try:
            part.path.write_bytes(data)
            part.publish()
        finally:
            part.discard()
    except OSError as reason:
        raise InputError(f"{owner}: {str(target)!r} cannot be written: {reason.strerror or reason}") from None


def names(target: pathlib.Path):
    """The names for what is left of an interrupted run: the target's own, NAME.partial, NAME.partial-2, ..."""
    yield target
    for count in itertools.count(1):
        ending = f".partial{'' if count == 1 else f'-{count}'}{target.suffix}"
        # What a name may have, in bytes.
        stem = os.fsencode(target.stem)[: 255 - len(os.fsencode(ending))]
        yield target.with_name(stem.decode(errors="ignore") + ending)


def new_folder(target: pathlib.Path) -> pathlib.Path:
    """A new folder NAME.partial."""
    candidates = itertools.islice(names(target), 1, None)
    while True:
        name = next(candidates)
        with contextlib.suppress(FileExistsError):
            name.mkdir()
            return name


def claim(source: pathlib.Path, target: pathlib.Path) -> bool:
    """Move a file to `target` where nothing has that name, also if another process is about to make it."""
    try:
        os.link(source, target)
    except FileExistsError:
        return False
    except OSError:  # no links on this disk
        if os.path.lexists(target):
            return False
        os.replace(source, target)
        return True
    os.unlink(source)
    return True


def say(error: BaseException, words: str) -> None:
    """Add words to an error under way: to the message of fieldsim's own, to the notes of others."""
    if isinstance(error, FieldsimError):
        error.args = (f"{error}; {words}",)
    else:
        error.add_note(words)


def kept_words(where, count: int, planned: int | None, noun: str) -> str:
    """Words on what was kept: film.mp4 keeps the 6 of 10 frames made before."""
    of = "" if planned is None else f" of {planned}"
    return f"{where} keeps the {count}{of} {noun}{'' if (planned or count) == 1 else 's'} made before"


def lost_words(where, reason: OSError) -> str:
    """Words on what could not be kept."""
    return f"nothing of {where} is kept: {reason.strerror or reason}"


def remove_left(folder: pathlib.Path) -> None:
    """Remove the parts in `folder` whose writers were killed, and warn of that."""
    if fcntl is None:
        return
    try:
        found = [entry.path for entry in os.scandir(folder) if _PART.fullmatch(entry.name) and _is_own(entry)]
    except OSError:
        return
    for path in found:
        lock = _lock_of_nobody(path)
        if lock is not None:
            _discard(pathlib.Path(path), lock, os.getpid())
            words = f"{path}: removed, the unfinished part of a run that was killed"
            warnings.warn(words, FieldsimWarning, stacklevel=4)


def _is_own(entry):
    about = entry.stat(follow_symlinks=False)
    return about.st_uid == os.getuid() and (stat.S_ISREG(about.st_mode) or stat.S_ISDIR(about.st_mode))


def _made(target, folder):
    """A new part and the descriptor that locks it."""
    # What encoders take for a pattern or a protocol stays out of the name.
    stem = re.sub(r"\W", "_", target.stem)[:40]
    while True:
        path = target.parent / f".{stem}-{secrets.token_hex(8)}.part{target.suffix}"
        if folder:
            path.mkdir()
        else:
            path.touch(exist_ok=False)
        if fcntl is None:
            return path, None
        lock = os.open(path, os.O_RDONLY)
        with contextlib.suppress(OSError):  # a disk without locks
            fcntl.flock(lock, fcntl.LOCK_EX)
        # Another run may have taken it for a killed one's before it was locked.
        if path.exists():
            return path, lock
        os.close(lock)


def _lock_of_nobody(path):
    """A descriptor with the lock of a part that nobody holds; None for one that is held, or cannot be."""
    if fcntl is None:
        return None
    lock = None
    try:
        lock = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        if lock is not None:
            os.close(lock)
        return None
    return lock


def _discard(path, lock, owner):
    """Remove a part, if it is still there, and then its lock; not in a fork, whose parent goes on writing."""
    if os.getpid() == owner:
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            with contextlib.suppress(OSError):
                path.unlink()
    if lock is not None:
        os.close(lock)
