"""Recordings that are damaged, cut off or made to do harm: refused in fieldsim's own words, never read as less."""

import io
import tracemalloc
import zipfile

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.world.motion import Pose

SNAPSHOTS = 4


def world(particles=3):
    made = fs.World()
    made.add_body(fs.Body(fs.Point((0, 0, 0)), surface=fs.Material(), motion=lambda t: (t, 0, 0)))
    places = np.random.default_rng(1).normal(size=(particles, 3))
    made.add_particles(places + 5, places)
    made.add_particles(places[:2] - 5, places[:2])
    made.add_shape(fs.Ball((0, 0, 0), 1.0))
    return made


WORLD = world()


def recorded(path):
    turn = Pose.turned((0, 0, 1), 0.5)
    with fs.Recording(path) as recording:
        for k in range(SNAPSHOTS):
            at = WORLD.at(0.1 * k)
            shapes = (((0.0, 0.0, float(k)),), (turn.rotation,))
            moved = [p + k for p in at.positions]
            recording.add(fs.Snapshot(WORLD, at.time, at.poses, tuple(moved), at.velocities, (shapes,)))
    return path.read_bytes()


def read(path):
    """All numbers of a recording."""
    again = fs.Recorded(path)
    found = []
    for snapshot in again.snapshots(WORLD):
        poses = [(*pose.position, *pose.rotation) for pose in snapshot.poses]
        found += [np.array(snapshot.time), np.array(poses), *snapshot.positions, *snapshot.velocities]
        found += [np.asarray(part) for pair in snapshot.shape_poses for part in pair]
    return found


def as_array(array, **options):
    stream = io.BytesIO()
    np.save(stream, array, **options)
    return stream.getvalue()


def with_header(header, data=b"", version=b"\1\0"):
    size = len(header).to_bytes(2 if version == b"\1\0" else 4, "little")
    return b"\x93NUMPY" + version + size + header.encode() + data


class Packed:
    """The entries of a whole recording, to be changed and packed again."""

    def __init__(self, content):
        with zipfile.ZipFile(io.BytesIO(content)) as file:
            self.entries = {name: file.read(name) for name in file.namelist()}

    def __call__(self, changes, drop=(), compression=zipfile.ZIP_DEFLATED):
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w", compression) as file:
            for name, data in ({k: v for k, v in self.entries.items() if k not in drop} | changes).items():
                file.writestr(name, data)
        return stream.getvalue()


@pytest.fixture(scope="module")
def content(tmp_path_factory):
    return recorded(tmp_path_factory.mktemp("whole") / "run.npz")


@pytest.fixture(scope="module")
def packed(content):
    return Packed(content)


def check(path, data, right):
    """Whether bytes that are no recording any more are refused; else they have to be read as what they were."""
    path.write_bytes(data)
    try:
        found = read(path)
    except fs.InputError as reason:
        words = str(reason)
        assert str(path) in words
        assert not any(word in words for word in ("pickle", "Errno", "attribute", "header"))
        return True
    assert len(found) == len(right)
    for one, other in zip(found, right, strict=True):
        np.testing.assert_array_equal(one, other)
    return False


def damaged(content, rng):
    """The content with one of the ways in which files go wrong."""
    data, length = bytearray(content), len(content)
    at = int(rng.integers(length))
    match rng.integers(7):
        case 0:  # a bit
            data[at] ^= 1 << rng.integers(8)
        case 1:  # a byte at the end, where the directory is
            data[length - 1 - int(rng.integers(min(length, 1500)))] = rng.integers(256)
        case 2:  # cut off
            del data[at:]
        case 3:  # a block of zeros
            end = min(at + 64, length)
            data[at:end] = bytes(end - at)
        case 4:  # a part missing
            del data[at : at + int(rng.integers(1, 99))]
        case 5:  # something in between
            data[at:at] = rng.bytes(int(rng.integers(1, 99)))
        case 6:  # a part twice
            data[at:at] = data[max(at - 99, 0) : at]
    return bytes(data)


def fuzz(tmp_path, content, seeds):
    (tmp_path / "run.npz").write_bytes(content)
    right = read(tmp_path / "run.npz")
    return sum(check(tmp_path / "run.npz", damaged(content, np.random.default_rng(s)), right) for s in seeds)


def test_damage_is_refused_or_does_not_matter(tmp_path, content):
    assert fuzz(tmp_path, content, range(1200)) > 800


@pytest.mark.full
def test_much_damage_is_refused_or_does_not_matter(tmp_path, content):
    assert fuzz(tmp_path, content, range(1200, 9000)) > 5000


def test_every_bit_of_the_directory(tmp_path, content):
    """Names, sizes, sums and places of the entries."""
    (tmp_path / "run.npz").write_bytes(content)
    right = read(tmp_path / "run.npz")
    start = content.index(b"PK\1\2")
    for at in range(start, min(start + 260, len(content))):
        data = bytearray(content)
        data[at] ^= 1 << at % 8
        check(tmp_path / "run.npz", bytes(data), right)


def test_packed_again_it_is_the_same(tmp_path, packed, content):
    (tmp_path / "run.npz").write_bytes(content)
    right = read(tmp_path / "run.npz")
    for compression in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        assert not check(tmp_path / "run.npz", packed({}, compression=compression), right)
    with np.load(tmp_path / "run.npz") as arrays:
        everything = dict(arrays)
    np.savez(tmp_path / "run.npz", **everything)
    assert not check(tmp_path / "run.npz", (tmp_path / "run.npz").read_bytes(), right)


SHAPE = "{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}\n"
HOSTILE = {
    "objects": {"poses/000001.npy": as_array(np.array([print], dtype=object), allow_pickle=True)},
    "float32": {"poses/000001.npy": as_array(np.zeros((1, 7), np.float32))},
    "complex": {"time/000001.npy": as_array(np.array(1j))},
    "strings": {"time/000001.npy": as_array(np.array("now"))},
    "by columns": {"positions/0/000001.npy": as_array(np.asfortranarray(np.ones((3, 3))[:, ::2]))},
    "two columns": {"positions/0/000001.npy": as_array(np.zeros((3, 2)))},
    "three dimensions": {"positions/0/000001.npy": as_array(np.zeros((3, 3, 1)))},
    "fewer rows": {"positions/0/000002.npy": as_array(np.zeros((2, 3)))},
    "more rows": {"velocities/1/000002.npy": as_array(np.zeros((9, 3)))},
    "more bodies": {"poses/000003.npy": as_array(np.zeros((2, 7)))},
    "many times": {"time/000001.npy": as_array(np.zeros(5))},
    "nan": {"positions/0/000001.npy": as_array(np.full((3, 3), np.nan))},
    "inf of the last": {"velocities/1/000003.npy": as_array(np.full((2, 3), np.inf))},
    "a time of nan": {"time/000002.npy": as_array(np.array(np.nan))},
    "times that go back": {"time/000002.npy": as_array(np.array(-7.0))},
    "no turn": {"poses/000001.npy": as_array(np.zeros((1, 7)))},
    "a turn without end": {"poses/000001.npy": as_array(np.full((1, 7), 1e308))},
    "no turn of a shape": {"shapes/0/000001.npy": as_array(np.zeros((1, 7)))},
    "negative rows": {"poses/000000.npy": with_header(SHAPE.format("<f8", "-1, 7"))},
    "rows beyond numbers": {"poses/000000.npy": with_header(SHAPE.format("<f8", f"{10**30}, 7"))},
    "rows beyond digits": {"poses/000000.npy": with_header(SHAPE.format("<f8", "9" * 900 + ", 7"))},
    "rows beyond the file": {"poses/000000.npy": with_header(SHAPE.format("<f8", f"{10**9}, 7"), bytes(56))},
    "a header of code": {"poses/000000.npy": with_header("__import__('os').system('touch ran')\n")},
    "a deep header": {"poses/000000.npy": with_header("(" * 60000)},
    "a huge header": {"poses/000000.npy": with_header(" " * 10**7, version=b"\2\0")},
    "a later version": {"poses/000000.npy": with_header(SHAPE.format("<f8", "1, 7"), bytes(56), b"\3\0")},
    "no array": {"poses/000001.npy": b"hello"},
    "an empty entry": {"poses/000001.npy": b""},
    "another entry": {"../../etc/passwd": b"root"},
    "a set of its own": {"positions/5/000000.npy": as_array(np.zeros((3, 3)))},
    "a snapshot far away": {"time/999999.npy": as_array(np.array(7.0))},
    "a snapshot twice": {"time/0000001.npy": as_array(np.array(0.1))},
    "a set twice": {"positions/00/000000.npy": as_array(np.zeros((3, 3)))},
}


@pytest.mark.parametrize("name", HOSTILE)
def test_other_things_than_were_recorded_are_refused(tmp_path, packed, name, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tracemalloc.start()
    refused = check(tmp_path / "run.npz", packed(HOSTILE[name]), [])
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert refused
    assert most < 10_000_000
    assert not (tmp_path / "ran").exists()


def test_no_entry_may_be_missing(tmp_path, packed):
    for name in packed.entries:
        if "/" in name:
            assert check(tmp_path / "run.npz", packed({}, drop=[name]), []), name


def test_no_entry_may_be_there_twice(tmp_path, packed, recwarn):
    for name in packed.entries:
        stream = io.BytesIO(packed({}))
        with zipfile.ZipFile(stream, "a") as file:
            file.writestr(name, packed.entries[name])
        assert check(tmp_path / "run.npz", stream.getvalue(), [])
    recwarn.clear()


@pytest.mark.parametrize("compression", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_other_ways_to_compress_are_refused(tmp_path, packed, compression):
    assert check(tmp_path / "run.npz", packed({}, compression=compression), [])


def test_a_bomb_is_refused_before_it_goes_off(tmp_path, packed):
    """A gigabyte of zeros in a megabyte, as the particles of a snapshot, or as one header."""
    rows = 2_000_000
    header = with_header(SHAPE.format("<f8", f"{rows}, 3"))
    bomb = packed({"positions/0/000000.npy": header + bytes(24 * rows)})
    assert len(bomb) < 200_000
    tracemalloc.start()
    assert check(tmp_path / "run.npz", bomb, [])
    uniform = {f"{kind}/0/{k:06d}.npy": header + bytes(24 * rows) for kind in ("positions", "velocities") for k in (0,)}
    only = Packed(packed({}))
    only.entries = {name: data for name, data in only.entries.items() if "000000" in name}
    data = only(uniform)
    tracemalloc.reset_peak()
    assert check(tmp_path / "run.npz", data, [])
    most = tracemalloc.get_traced_memory()[1] - len(data)
    tracemalloc.stop()
    assert most < 120_000_000


@pytest.mark.parametrize(
    "data",
    [b"", b"this is a text, no recording\n" * 20, bytes(5000), as_array(np.zeros(3)), b"PK\5\6" + bytes(18), b"PK\5\6"],
)
def test_other_files_are_no_recordings(tmp_path, data):
    assert check(tmp_path / "run.npz", data, [])


def test_names_that_are_no_recordings(tmp_path):
    for path, words in [
        (tmp_path / "no.npz", "there is no file"),
        (tmp_path, "there is no file"),
        (7, "give the path"),
    ]:
        with pytest.raises(fs.InputError, match=words):
            fs.Recorded(path)


def test_another_world_is_refused(tmp_path, content):
    path = tmp_path / "run.npz"
    path.write_bytes(content)
    less, more = world(), world()
    less.particles = less.particles[:-1]
    more.add_particles([(0, 0, 9)], [(0, 0, 0)])
    bare = world()
    bare.shapes = ()
    for other, words in [
        (world(particles=5), "is of 3 particles in set 0, the world has 5"),
        (less, "is of 2 sets of particles, the world has 1"),
        (more, "is of 2 sets of particles, the world has 3"),
        (bare, "is of 1 groups of shapes, the world has 0"),
        (None, "world is None; give the World that was recorded"),
    ]:
        with pytest.raises(fs.InputError, match=words):
            fs.Recorded(path).snapshot(0, other)


@pytest.mark.parametrize("index", [-1, SNAPSHOTS, 0.5, "first", None])
def test_snapshots_that_are_not_there(tmp_path, content, index):
    (tmp_path / "run.npz").write_bytes(content)
    with pytest.raises(fs.InputError, match=r"Recorded\.snapshot: index is"):
        fs.Recorded(tmp_path / "run.npz").snapshot(index, WORLD)


def test_what_could_not_be_read_is_not_added(tmp_path):
    at = WORLD.at(1.0)
    other = world(particles=4).at(2.0)
    shapes = ((((0.0, 0.0, 0.0),), ((1.0, 0.0, 0.0, 0.0),)),)
    with fs.Recording(tmp_path / "run.npz") as recording:
        recording.add(at)
        for snapshot, words in [
            (WORLD.at(0.5), "the snapshot's time is 0.5, the one before has 1; add them in the order of time"),
            (other, "has other bodies, particles or shapes than the one before"),
            (fs.Snapshot(WORLD, 2.0, at.poses, at.positions, at.velocities, shapes), "has other bodies, particles"),
            ("now", "snapshot is 'now'; give a fs.Snapshot"),
        ]:
            with pytest.raises(fs.InputError, match=rf"Recording\.add: .*{words}"):
                recording.add(snapshot)
        recording.add(WORLD.at(1.0))
    assert len(fs.Recorded(tmp_path / "run.npz")) == 2


def test_what_a_run_says_of_itself_is_read_without_trust(tmp_path, packed):
    path = tmp_path / "run.npz"
    for about in (b"[1]", b"{", b"7", b"\xff", b"[" * 10**5, b'"' + b"a" * (1 << 20) + b'"'):
        assert check(path, packed({"about.json.npy": as_array(np.frombuffer(about, np.uint8))}), [])
    path.write_bytes(packed({"about.json.npy": as_array(np.frombuffer(b'{"parameters": {"a": "b"}}', np.uint8))}))
    assert fs.Recorded(path).about == {"parameters": {"a": "b"}}


def test_a_recording_is_left_only_where_it_was_entered(tmp_path):
    recording = fs.Recording(tmp_path / "run.npz")
    with pytest.raises(fs.FilmError, match="the recording is not open"):
        recording.__exit__(None, None, None)
    assert not recording.__exit__(KeyError, KeyError("own"), None)


@pytest.mark.parametrize("about", [{"a": print}, {"a": 1j}, {(1, 2): 3}, "words"])
def test_only_what_can_be_written_is_said_of_a_run(tmp_path, about):
    with pytest.raises(fs.InputError, match="Recording: about is"):
        fs.Recording(tmp_path / "run.npz", about)


def test_what_a_run_says_of_itself_cannot_write_to_the_terminal(tmp_path, packed):
    about = b'{"scenario": "\\u001b[2J' + b"x" * 1000 + b'", "parameters": {}}'
    (tmp_path / "run.npz").write_bytes(packed({"about.json.npy": as_array(np.frombuffer(about, np.uint8))}))
    scenario = fs.Scenario(WORLD, fs.Camera((0, -5, 1)), duration=1.0, name="own")
    (words,) = fs.Recorded(tmp_path / "run.npz").differences(scenario)
    assert words.isprintable()
    assert len(words) < 200


def test_times_near_the_largest_numbers(tmp_path, packed):
    times = (-1.7e308, -1.0, 1.0, 1.7e308)
    path = tmp_path / "run.npz"
    path.write_bytes(packed({f"time/{k:06d}.npy": as_array(np.array(t)) for k, t in enumerate(times)}))
    again = fs.Recorded(path)
    assert (again.fps, len(again), again.at(1.6e308, WORLD).time) == (0.0, 4, 1.7e308)
