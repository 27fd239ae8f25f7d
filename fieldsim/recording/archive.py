"""The entries of a recording's file, read without trust: it may be damaged, cut off, or made to do harm."""

import contextlib
import json
import math
import os
import pathlib
import re
import struct
import zipfile

import numpy as np

from fieldsim.errors import InputError

# Entries of snapshots and the others. What a snapshot has is one row a thing, of so many numbers.
_ENTRY = re.compile(r"(time|poses|positions/\d{1,6}|velocities/\d{1,6}|shapes/\d{1,6})/(\d{6,12})\.npy", re.ASCII)
_WIDTHS = {"time": None, "poses": 7, "positions": 3, "velocities": 3, "shapes": 7}
_HEADER = re.compile(rb"\{'descr': '<f8', 'fortran_order': False, 'shape': \(([\d, ]*)\), \} *\n")
_MOST_HEADER = 1024

# No deflated entry is more than so many times as long as what it takes in the file, but for a few bytes.
_MOST_INFLATED = 1032
# Bytes of what a recording says of its run, and of the header before it.
MOST_ABOUT, _MOST_WORDS = 1 << 20, (1 << 20) + 1024

# The marks of an archive's last lines and how many entries they count: first those of a long one.
_ENDS = struct.Struct("<4s28xQ36x4s6xH10x")


def _entries_told(path):
    """How many entries there are by the last lines of an archive without a comment."""
    with open(path, "rb") as file:
        file.seek(-min(_ENDS.size, os.path.getsize(path)), os.SEEK_END)
        mark64, count64, mark, count = _ENDS.unpack(file.read().rjust(_ENDS.size, b"\0"))
    if mark != b"PK\5\6":
        raise zipfile.BadZipFile
    return count64 if count == 0xFFFF and mark64 == b"PK\6\6" else count


class Archive:
    """Entries of a recording: which there are is checked when it is opened, what each holds when it is read.

    count: of snapshots; rows: of each entry that a snapshot has, such as {"poses": 2, "positions/0": 500}, the same for
    all. Raises InputError, naming the file, for whatever is not as `Recording` writes it.
    """

    def __init__(self, path: pathlib.Path):
        self._name = f"the recording {str(path)!r}"
        if not os.path.isfile(path):
            raise InputError(f"there is no file {str(path)!r}; give the path of a recording, NAME.npz")
        try:
            with open(path, "rb"):
                pass
        except OSError as reason:
            raise InputError(f"{self._name} cannot be opened: {reason.strerror}") from None
        try:
            self._file = zipfile.ZipFile(path)
            entries = self._file.infolist()
            told = _entries_told(path)
        except Exception:  # whatever comes of nonsense taken for an archive
            words = "cannot be read as a recording: it is none, or cut off or damaged"
            raise InputError(f"{str(path)!r} {words}") from None
        # A damaged length within the directory can hide the entries that follow.
        if len(entries) != told:
            raise self.damaged(f"has a directory of {told} entries and {len(entries)} of them")
        self._others, self._moments = self._sorted(entries)
        self.count = len(self._moments)
        self.rows = {name: self._rows(info) for name, info in self._moments[0].items()}
        self._refuse_uneven()

    def _sorted(self, entries):
        """Entries that are of no snapshot, by name; and those of each snapshot in turn, by name."""
        others, moments = {}, {}
        for info in entries:
            match = _ENTRY.fullmatch(info.filename)
            name, place = (match[1], moments.setdefault(int(match[2]), {})) if match else (info.filename, others)
            if name in place:
                raise self.damaged(f"holds the entry {info.filename!r} twice")
            if not match and "/" in info.filename:
                raise self.damaged(f"holds the unknown entry {info.filename!r}")
            place[name] = info
            self._refuse_packing(info)
        if not moments:
            raise InputError(f"{self._name} is no recording: it has no snapshots")
        missing = next((k for k in range(len(moments)) if k not in moments), None)
        if missing is not None:
            raise self.damaged(f"has no snapshot {missing} of {max(moments) + 1}")
        return others, [moments[k] for k in range(len(moments))]

    def _refuse_packing(self, info):
        packed = info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED) or info.flag_bits & 1
        if packed or info.file_size > _MOST_INFLATED * (info.compress_size + 64):
            raise self.damaged(f"holds the entry {info.filename!r} in a way that no recording has")

    def _rows(self, info):
        with self._opened(info) as stream:
            return self._shape(info, stream)[0]

    def _shape(self, info, stream):
        """Rows of an entry, None for a single number, and how many bytes they take, by its header, which is read."""
        head = stream.read(10)
        size = int.from_bytes(head[8:], "little")
        header = _HEADER.fullmatch(stream.read(min(size, _MOST_HEADER)))
        if head[:8] != b"\x93NUMPY\x01\0" or header is None:
            raise self.damaged(f"holds other things than numbers as {info.filename!r}")
        shape = [int(word) for word in header[1].split(b",") if word.strip()]
        width = _WIDTHS[info.filename.partition("/")[0]]
        if shape != [] if width is None else (len(shape) != 2 or shape[1] != width):
            raise self.damaged(f"holds numbers of shape {tuple(shape)} as {info.filename!r}")
        length = 8 * math.prod(shape)
        if info.file_size != 10 + size + length:
            raise self.damaged(f"holds more or fewer numbers as {info.filename!r} than it says")
        return (shape[0] if shape else None), length

    def _refuse_uneven(self):
        first = self._moments[0]
        if "time" not in first or "poses" not in first:
            raise self.damaged("has a snapshot 0 without a time or without poses")
        for kind in ("positions", "velocities", "shapes"):
            numbers = sorted(int(name.partition("/")[2]) for name in first if name.startswith(kind))
            if numbers != list(range(len(numbers))):
                raise self.damaged(f"has {kind} of sets {numbers}")
        if [self.rows[n] for n in self.sets("positions")] != [self.rows[n] for n in self.sets("velocities")]:
            raise self.damaged("has positions and velocities of different particles")
        sizes = {name: info.file_size for name, info in first.items()}
        for k, moment in enumerate(self._moments):
            if {name: info.file_size for name, info in moment.items()} != sizes:
                raise self.damaged(f"has in snapshot {k} other things than in snapshot 0")

    def sets(self, kind: str) -> list[str]:
        """Names of the entries of a kind that a snapshot has: "positions/0", "positions/1", ..."""
        return [f"{kind}/{k}" for k in range(sum(name.startswith(f"{kind}/") for name in self.rows))]

    def numbers(self, name: str, index: int) -> np.ndarray:
        """What snapshot `index` has as entry `name`: (N, width) finite float64, or () for its time."""
        info = self._moments[index][name]
        with self._opened(info) as stream:
            rows, length = self._shape(info, stream)
            # Sums are compared where an entry ends.
            data = stream.read(length) + stream.read()
        if rows != self.rows[name] or len(data) != length:
            raise self.damaged(f"holds more or fewer numbers as {info.filename!r} than it says")
        array = np.frombuffer(data, "<f8").astype(float)
        if not np.isfinite(array).all():
            raise self.damaged(f"holds nan or inf as {info.filename!r}")
        width = _WIDTHS[name.partition("/")[0]]
        return array[0] if width is None else array.reshape(-1, width)

    def all_numbers(self, kind: str, index: int) -> tuple[np.ndarray, ...]:
        """The entries of a kind that snapshot `index` has: of "poses" one, of "positions" one a set."""
        return tuple(self.numbers(name, index) for name in ([kind] if kind in self.rows else self.sets(kind)))

    def facts(self, name: str) -> dict:
        """The JSON object of an entry that is of no snapshot; an empty one where there is no such entry."""
        info = self._others.get(f"{name}.npy")
        if info is None:
            return {}
        if info.file_size > _MOST_WORDS:
            raise self.damaged(f"has {info.file_size} bytes as {info.filename!r}")
        with self._opened(info) as stream:
            found = json.loads(stream.read().partition(b"\n")[2])
            return {**found}

    @contextlib.contextmanager
    def _opened(self, info):
        """The bytes of an entry; whatever damage it has is reported by a message."""
        try:
            with self._file.open(info) as stream:
                yield stream
        except InputError:
            raise
        except Exception:
            raise self.damaged(f"has a torn entry {info.filename!r}") from None

    def damaged(self, words: str) -> InputError:
        """The error that says what the file has or holds."""
        return InputError(f"{self._name} {words}; it is damaged, or no recording")
