"""Recordings: a run's snapshots in one file, to be drawn again, later, elsewhere, or read with NumPy.

A recording is a `.npz` file: entry `time/000012` is snapshot 12's time, `poses/000012` (B, 7) the positions and
quaternions (w, x, y, z) of the bodies, `shapes/0/000012` (N, 7) those of group 0 of the hard shapes, where a run moves
them, `positions/0/000012` and `velocities/0/000012` (N, 3) those of set 0 of the particles. Snapshots are written as
they come, so that a run that fails leaves what it had. The last entry, `about.json` (bytes as uint8), tells of the run:
its scenario, parameters, integrator, frames per second, duration and the version of fieldsim; older ones have none.
"""

import contextlib
import dataclasses
import importlib.metadata
import json
import threading
import types
import zipfile
from collections.abc import Iterator
from typing import Any, Protocol

import numpy as np

from fieldsim import files, interrupts, validate
from fieldsim.copies import Uncopied
from fieldsim.errors import FilmError, InputError
from fieldsim.numerics import quaternion
from fieldsim.recording.archive import MOST_ABOUT, Archive
from fieldsim.types import PathLike, RealLike, WholeLike
from fieldsim.world.motion import Pose
from fieldsim.world.snapshot import Snapshot
from fieldsim.world.world import World, given_world


@dataclasses.dataclass
class _Open:
    """A recording that is open: its part of a file, the archive within, and the arrays of the last snapshot."""

    part: files.Part
    file: zipfile.ZipFile
    last: dict[str, np.ndarray] | None = None


class Recording(Uncopied):
    """A recording being written: a context manager with `add(snapshot)`.

        with fs.Recording("run.npz") as recording:
            for snapshot in simulation.snapshots(times):
                recording.add(snapshot)

    The file appears under its name when the block ends. When it is left by an error or an interrupt, the snapshots so
    far appear under that name if there was nothing before, else as `run.partial.npz`, and the error says so; without
    snapshots nothing appears. What was there before is replaced by a whole recording only.
    about: what the entry `about.json` says of the run, see `about_run`. planned: how many snapshots there shall be, for
    messages.
    Raises InputError for a path that cannot be, before anything is written, and FilmError when writing fails.
    """

    _remedy = "make one in each process"

    def __init__(self, path: PathLike, about: dict[str, Any] | None = None, *, planned: WholeLike | None = None):
        path = validate.path("Recording", "path", path)
        about = {} if about is None else about
        self._about = _json(validate.instance("Recording", "about", about, dict, "give a dict"))
        self._planned = None if planned is None else validate.whole("Recording", "planned", planned, at_least=0)
        if path.suffix != ".npz":
            raise InputError(f"Recording: path is {str(path)!r}; it should end in .npz")
        self.path = files.checked_target("Recording", path)
        self.count = 0
        self._open: _Open | None = None
        self._lock = threading.Lock()

    def __enter__(self) -> "Recording":
        if self._open is not None:
            raise FilmError(f"{self.path}: the recording is open already; give every `with` a fs.Recording of its own")
        try:
            part = files.Part(self.path)
            file = zipfile.ZipFile(part.path, "w", zipfile.ZIP_DEFLATED, compresslevel=1)
        except OSError as reason:
            raise FilmError(f"{self.path}: cannot write here: {reason.strerror or reason}") from None
        self.count, self._open = 0, _Open(part, file)
        return self

    def add(self, snapshot: Snapshot) -> None:
        """Append a snapshot; InputError for one of another world or an earlier time than the one before."""
        target = self._open
        if target is None:
            raise self._not_open()
        validate.instance("Recording.add", "snapshot", snapshot, Snapshot, "give a fs.Snapshot")
        arrays = _arrays(snapshot)
        with self._lock:
            self._refuse(arrays, target.last or arrays)
            self._append(target.file, arrays)
            target.last = arrays
            self.count += 1

    def _append(self, file, arrays):
        entries = file.filelist
        before = len(entries)
        try:
            for name, array in arrays.items():
                _write(file, f"{name}/{self.count:06d}", array)
        except BaseException as error:
            # Of a snapshot that is not whole nothing is to be found.
            for entry in entries[before:]:
                file.NameToInfo.pop(entry.filename, None)
            del entries[before:]
            if isinstance(error, OSError):
                raise FilmError(f"{self.path}: writing failed: {error.strerror or error}") from None
            raise

    def _not_open(self):
        return FilmError(f"{self.path}: the recording is not open; add inside `with fs.Recording(...) as recording:`")

    @staticmethod
    def _refuse(arrays, last):
        """Raise InputError for what could not be read again; last: the arrays of the snapshot before."""
        for name, array in arrays.items():
            if not np.isfinite(array).all():
                raise InputError(f"Recording.add: the snapshot has nan or inf in its {name}")
        if {name: np.shape(array) for name, array in arrays.items()} != {n: np.shape(a) for n, a in last.items()}:
            raise InputError("Recording.add: the snapshot has other bodies, particles or shapes than the one before")
        if arrays["time"] < last["time"]:
            raise InputError(
                f"Recording.add: the snapshot's time is {arrays['time']:g}, the one before has {last['time']:g}; "
                "add them in the order of time"
            )

    @interrupts.held()
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None
    ) -> None:
        target = self._open
        if target is None:
            if error is None:
                raise self._not_open()
            return
        try:
            kept = self._finished(target, whole=error is None)
            if kept and error is not None:
                files.say(error, files.kept_words(kept, self.count, self._planned, "snapshot"))
        except OSError as reason:
            if error is None:
                raise FilmError(f"{self.path}: writing failed, nothing is kept: {reason.strerror or reason}") from None
            files.say(error, files.lost_words(self.path, reason))
        finally:
            with contextlib.suppress(OSError):  # it is closed, or what could not be written still cannot
                target.file.close()
            target.part.discard()
            self._open = None

    def _finished(self, target, whole):
        """Close the file and let it appear; where, or None for a recording without snapshots."""
        if self.count and self._about:
            _write(target.file, "about.json", np.frombuffer(self._about, np.uint8))
        target.file.close()
        if not self.count:
            return None
        if not whole:
            return target.part.keep()
        target.part.publish()
        return self.path


def _write(file, name, array):
    # Without a date, the same run is the same bytes.
    entry = zipfile.ZipInfo(f"{name}.npy")
    entry.compress_type = zipfile.ZIP_DEFLATED
    with file.open(entry, "w", force_zip64=True) as target:
        np.lib.format.write_array(target, np.asarray(array, order="C"), allow_pickle=False)


def _json(about):
    """What is known of a run as it is written, b"" for nothing."""
    try:
        words = json.dumps(about).encode() if about else b""
    except (TypeError, ValueError, RecursionError) as reason:
        raise InputError(f"Recording: about is {validate.shown(about)}, which is no JSON: {reason}") from None
    if len(words) > MOST_ABOUT:
        raise InputError(f"Recording: about takes {len(words)} bytes; give less than {MOST_ABOUT}")
    return words


def _arrays(snapshot):
    """What a snapshot has, by the names of its entries."""
    poses = [(*pose.position, *pose.rotation) for pose in snapshot.poses]
    found = {"time": np.array(snapshot.time), "poses": np.array(poses, dtype=float).reshape(-1, 7)}
    for name in ("positions", "velocities"):
        found |= {f"{name}/{k}": np.asarray(array, dtype=float) for k, array in enumerate(getattr(snapshot, name))}
    for index, (positions, rotations) in enumerate(snapshot.shape_poses or ()):
        turns = rotations if np.ndim(rotations) == 2 else list(map(quaternion.of_matrix, rotations))
        found[f"shapes/{index}"] = np.hstack([positions, turns])
    return found


class Described(Protocol):
    """What is known of a run, such as a `fs.Scenario`: the script's name and parameters, integrator and duration."""

    @property
    def name(self) -> str:
        """The script's name, "" for none."""
        ...

    @property
    def parameters(self) -> dict[str, Any]:
        """The values of its `build`'s parameters."""
        ...

    @property
    def integrator(self) -> object:
        """What moves things, by its text."""
        ...

    @property
    def duration(self) -> float:
        """Length in time."""
        ...


def about_run(scenario: Described, fps: float) -> dict[str, Any]:
    """What a recording says of its run: scenario and title, parameters, integrator, fps, duration and version."""
    parameters = scenario.parameters
    return {
        "scenario": scenario.name,
        "parameters": {k: v if isinstance(v, float | int | str | None) else str(v) for k, v in parameters.items()},
        "integrator": str(scenario.integrator),
        "fps": fps,
        "duration": scenario.duration,
        "fieldsim": importlib.metadata.version("fieldsim"),
    }


def _told(value):
    """A parameter's value in a message, which may come from any file: short, and without what terminals obey."""
    return "".join(c if c.isprintable() else "?" for c in str(value)[:100])


class Recorded:
    """A recording that was written: len() snapshots, `times` (T,), and `snapshot(index, world)`.

    about: what is known of the run, see `about_run`; nothing for a recording that does not say. The file is read
    without trust: InputError, naming it, for one that is damaged, cut off or not as `Recording` writes them.
    """

    def __init__(self, path: PathLike):
        self.path = validate.path("Recorded", "path", path)
        self._archive = Archive(self.path)
        self.times = np.array([self._archive.numbers("time", index) for index in range(self._archive.count)])
        if (self.times[1:] < self.times[:-1]).any():
            raise self._archive.damaged("has times that go back")
        self.about = self._archive.facts("about.json")

    def __len__(self) -> int:
        return len(self.times)

    def __reduce__(self):
        return Recorded, (self.path,)

    def differences(self, scenario: Described) -> list[str]:
        """Words on what the scenario has in another way than the run that was recorded: its name and parameters."""
        remedy = "give a fs.Scenario"
        validate.having("Recorded.differences", "scenario", scenario, ("name", "parameters", "world"), remedy)
        known, words = self.about, []
        if scenario.name and known.get("scenario") not in (None, "", scenario.name):
            words.append(f"it is of the scenario {_told(known['scenario'])}, here it is {scenario.name}")
        before = known.get("parameters")
        if not scenario.name or not isinstance(before, dict):
            return words
        for name in sorted({*before, *scenario.parameters} - {"duration", "fps"}):
            one, other = before.get(name, "not there"), scenario.parameters.get(name, "not there")
            if one != other:
                words.append(f"parameter {name} was {_told(one)}, here it is {_told(other)}")
        return words

    def snapshot(self, index: WholeLike, world: World) -> Snapshot:
        """Snapshot `index` of the recorded `world`; InputError for a world of other bodies or particles."""
        index = validate.whole("Recorded.snapshot", "index", index, at_least=0, at_most=len(self) - 1)
        validate.instance("Recorded.snapshot", "world", world, World, "give the World that was recorded")
        self._refuse_other(world)
        poses, shapes = (self._placed(kind, index) for kind in ("poses", "shapes"))
        positions, velocities = (self._archive.all_numbers(kind, index) for kind in ("positions", "velocities"))
        placed = tuple(Pose(row[:3], row[3:]) for row in poses[0])
        shapes = tuple((rows[:, :3], rows[:, 3:]) for rows in shapes) or None
        return Snapshot(world, float(self.times[index]), placed, positions, velocities, shapes)

    def _placed(self, kind, index):
        """Places and turns of an entry of that kind after the other, (N, 7) each."""
        found = self._archive.all_numbers(kind, index)
        if any((np.abs(np.abs(rows[:, 3:]).max(axis=1) - 1.0) > 0.99).any() for rows in found):
            raise self._archive.damaged(f"has turns in snapshot {index} that are no unit quaternions")
        return found

    def _refuse_other(self, world):
        """Raise InputError for a world of other bodies, particles or shapes."""
        rows = self._archive.rows
        sets, shapes = self._archive.sets("positions"), self._archive.sets("shapes")
        counts = [("bodies", rows["poses"], len(world.bodies))]
        counts += [("sets of particles", len(sets), len(world.particles))]
        counts += [("groups of shapes", len(shapes), len(world.shapes))] if shapes else []
        parts = zip(sets, world.particles, strict=False)
        counts += [(f"particles in set {k}", rows[name], len(p)) for k, (name, p) in enumerate(parts)]
        for noun, here, there in counts:
            if here != there:
                raise InputError(
                    f"{str(self.path)!r} is of {here} {noun}, the world has {there}; "
                    "give the world that was recorded, with the same parameters"
                )

    @property
    def fps(self) -> float:
        """Snapshots per unit of time, 30 for a single one."""
        span = float(self.times[-1]) - float(self.times[0])
        return (len(self) - 1) / span if span > 0.0 else 30.0

    def at(self, time: RealLike, world: World) -> Snapshot:
        """The snapshot nearest to `time`."""
        time = validate.number("Recorded.at", "time", time)
        with np.errstate(over="ignore"):
            return self.snapshot(int(np.argmin(np.abs(self.times - time))), world)

    def snapshots(self, world: World) -> Iterator[Snapshot]:
        """All snapshots in turn."""
        world = given_world("Recorded.snapshots", world)
        return (self.snapshot(index, world) for index in range(len(self)))

    def replay(self, world: World) -> "Replay":
        """The recording of `world` as a run: at each time it is where the nearest snapshot has it."""
        return Replay(self, given_world("Recorded.replay", world))


class Replay:
    """A recording that is run again, without computing: a `Run`, made by `Recorded.replay`."""

    def __init__(self, recorded: Recorded, world: World):
        self.recorded, self.world = recorded, world
        self.time = float(recorded.times[0])

    def advance(self, until: float) -> None:
        """Go to the time `until`; InputError for one before the present."""
        until = validate.number("Replay.advance", "until", until)
        if until < self.time:
            raise InputError(f"Replay.advance: until is {until:g}, before the present time {self.time:g}")
        self.time = until

    def snapshot(self) -> Snapshot:
        """The snapshot nearest to the present time."""
        return self.recorded.at(self.time, self.world)
