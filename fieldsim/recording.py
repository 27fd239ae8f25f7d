"""Recordings: a run's snapshots in one file, to be drawn again, later, elsewhere, or read with NumPy.

A recording is a `.npz` file: entry `time/000012` is snapshot 12's time, `poses/000012` (B, 7) the positions and
quaternions (w, x, y, z) of the bodies, `shapes/0/000012` (N, 7) those of group 0 of the hard shapes, where a run moves
them, `positions/0/000012` and `velocities/0/000012` (N, 3) those of set 0 of the particles. Snapshots are written as
they come, so that a run that fails leaves what it had.
"""

import os
import pathlib
import secrets
import zipfile

import numpy as np

from fieldsim.copies import Uncopied
from fieldsim.errors import InputError
from fieldsim.world import quaternion
from fieldsim.world.motion import Pose
from fieldsim.world.world import Snapshot, World


class Recording(Uncopied):
    """A recording being written: a context manager with `add(snapshot)`.

        with fs.Recording("run.npz") as recording:
            for snapshot in simulation.snapshots(times):
                recording.add(snapshot)

    The file appears under its name when the block ends, by an error, too: then it holds the snapshots made before.
    Raises InputError for a path that cannot be, before anything is written.
    """

    _remedy = "make one in each process"

    def __init__(self, path):
        self.path = pathlib.Path(path)
        if self.path.suffix != ".npz":
            raise InputError(f"Recording: {str(self.path)!r} should end in .npz")
        if not self.path.parent.is_dir():
            raise InputError(f"Recording: the folder {str(self.path.parent)!r} does not exist; create it first")
        self.count = 0
        self._partial = self._file = None

    def __enter__(self) -> "Recording":
        self._partial = self.path.with_name(f".{self.path.stem}-{secrets.token_hex(4)}.part")
        self._file = zipfile.ZipFile(self._partial, "w", zipfile.ZIP_DEFLATED, compresslevel=1)
        return self

    def add(self, snapshot: Snapshot) -> None:
        """Append a snapshot."""
        poses = [(*pose.position, *pose.rotation) for pose in snapshot.poses]
        self._write("time", np.float64(snapshot.time))
        self._write("poses", np.array(poses, dtype=float).reshape(-1, 7))
        for name in ("positions", "velocities"):
            for index, array in enumerate(getattr(snapshot, name)):
                self._write(f"{name}/{index}", array)
        for index, (positions, rotations) in enumerate(snapshot.shape_poses or ()):
            turns = rotations if np.ndim(rotations) == 2 else list(map(quaternion.of_matrix, rotations))
            self._write(f"shapes/{index}", np.hstack([positions, turns]))
        self.count += 1

    def _write(self, name, array):
        # Without a date, the same run is the same bytes.
        entry = zipfile.ZipInfo(f"{name}/{self.count:06d}.npy")
        entry.compress_type = zipfile.ZIP_DEFLATED
        with self._file.open(entry, "w", force_zip64=True) as target:
            np.lib.format.write_array(target, np.asarray(array, order="C"), allow_pickle=False)

    def __exit__(self, *error):
        self._file.close()
        if self.count:
            os.replace(self._partial, self.path)
        else:
            self._partial.unlink(missing_ok=True)


class Recorded:
    """A recording that was written: len() snapshots, `times` (T,), and `snapshot(index, world)`."""

    def __init__(self, path):
        self.path = pathlib.Path(path)
        try:
            self._arrays = np.load(self.path, allow_pickle=False)
            names = self._arrays.files
        except (OSError, ValueError, AttributeError, zipfile.BadZipFile) as reason:
            raise InputError(f"{str(self.path)!r} cannot be read as a recording: {reason}") from None
        count = sum(name.startswith("time/") for name in names)
        if not count:
            raise InputError(f"{str(self.path)!r} is no recording: it has no snapshots")
        self.times = np.array([self._arrays[f"time/{index:06d}"] for index in range(count)])

    def __len__(self) -> int:
        return len(self.times)

    def __reduce__(self):
        return Recorded, (self.path,)

    def snapshot(self, index: int, world: World) -> Snapshot:
        """Snapshot `index` of the recorded `world`; InputError for a world of other bodies or particles."""
        poses = self._arrays[f"poses/{index:06d}"]
        sets = [self._sets(name, index, world) for name in ("positions", "velocities")]
        if len(poses) != len(world.bodies):
            raise InputError(
                f"{str(self.path)!r} is of {len(poses)} bodies, the world has {len(world.bodies)}; "
                "give the world that was recorded, with the same parameters"
            )
        placed = tuple(Pose(tuple(row[:3]), tuple(row[3:])) for row in poses)
        return Snapshot(world, float(self.times[index]), placed, *sets, self._shapes(index, world))

    def _shapes(self, index, world):
        """Positions and quaternions of the groups of shapes, None where their motions say."""
        names = (f"shapes/{number}/{index:06d}" for number in range(len(world.shapes)))
        found = [self._arrays[name] for name in names if name in self._arrays]
        return tuple((rows[:, :3], rows[:, 3:]) for rows in found) or None

    def _sets(self, name, index, world):
        arrays = []
        for number, particles in enumerate(world.particles):
            key = f"{name}/{number}/{index:06d}"
            array = self._arrays[key] if key in self._arrays else np.zeros((0, 3))
            if len(array) != len(particles):
                raise InputError(
                    f"{str(self.path)!r} is of {len(array)} particles in set {number}, the world has {len(particles)}; "
                    "give the world that was recorded, with the same parameters"
                )
            arrays.append(array)
        return tuple(arrays)

    @property
    def fps(self) -> float:
        """Snapshots per unit of time, 30 for a single one."""
        span = self.times[-1] - self.times[0]
        return float((len(self) - 1) / span) if span > 0 else 30.0

    def at(self, time: float, world: World) -> Snapshot:
        """The snapshot nearest to `time`."""
        return self.snapshot(int(np.argmin(np.abs(self.times - time))), world)

    def snapshots(self, world: World):
        """All snapshots in turn."""
        return (self.snapshot(index, world) for index in range(len(self)))
