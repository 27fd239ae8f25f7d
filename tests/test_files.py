"""Files that are written: whole or not at all, never through links, and what killed runs leave goes."""

import os
import signal
import subprocess
import sys
import warnings

import pytest

import fieldsim as fs
from fieldsim import files, plots
from fieldsim.errors import FieldsimWarning, InputError


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def part_of(target, data=b"new", **options):
    part = files.Part(target, **options)
    part.path.write_bytes(data)
    return part


def test_a_part_is_hidden_until_it_is_published(tmp_path):
    target = tmp_path / "a.mp4"
    target.write_bytes(b"old")
    part = part_of(target)
    assert target.read_bytes() == b"old"
    assert part.path.name.startswith(".a-")
    assert part.path.suffix == ".mp4"
    part.publish()
    assert (names(tmp_path), target.read_bytes()) == (["a.mp4"], b"new")


def test_what_is_kept_replaces_nothing(tmp_path):
    target = tmp_path / "a.b.mp4"
    kept = [part_of(target, data).keep() for data in (b"1", b"2", b"3")]
    assert [path.name for path in kept] == ["a.b.mp4", "a.b.partial.mp4", "a.b.partial-2.mp4"]
    assert [path.read_bytes() for path in kept] == [b"1", b"2", b"3"]
    assert len(names(tmp_path)) == 3


def test_what_is_kept_replaces_nothing_where_there_are_no_links(tmp_path, monkeypatch):
    def link(*_):
        raise PermissionError

    monkeypatch.setattr(os, "link", link)
    test_what_is_kept_replaces_nothing(tmp_path)


def test_a_link_that_is_dead_is_something(tmp_path):
    (tmp_path / "a.npz").symlink_to(tmp_path / "nowhere")
    assert part_of(tmp_path / "a.npz").keep().name == "a.partial.npz"
    assert not (tmp_path / "nowhere").exists()


@pytest.mark.parametrize("stem", ["é" * 125, "x" * 250])
def test_the_longest_names_can_be_kept_beside_others(tmp_path, stem):
    kept = [part_of(tmp_path / f"{stem}.mp4").keep().name for _ in range(3)]
    assert len(set(kept)) == 3
    assert kept[1].endswith(".partial.mp4")


def test_names_of_parts_are_no_patterns_and_cannot_be_guessed(tmp_path):
    parts = [files.Part(tmp_path / "12:30 %d*?.gif") for _ in range(2)]
    assert parts[0].path != parts[1].path
    assert not set(":%*? ") & set(parts[0].path.name)


def test_a_part_that_is_forgotten_is_removed(tmp_path):
    part = part_of(tmp_path / "a.mp4")
    folder = files.Part(tmp_path / "b.mp4", folder=True)
    (folder.path / "0").touch()
    assert len(names(tmp_path)) == 2
    del part, folder
    assert names(tmp_path) == []


MAKE = """
import os, sys, time
from fieldsim import files
part = files.Part("a.mp4", folder=sys.argv[1] == "folder")
print("made", flush=True)
sys.stdin.readline()
"""


@pytest.mark.parametrize("kind", ["file", "folder"])
def test_parts_of_the_killed_go_and_those_of_the_living_stay(tmp_path, kind):
    pytest.importorskip("fcntl")
    (tmp_path / ".film-0123.part").touch()  # of another program
    (tmp_path / f".link-{'0' * 16}.part.mp4").symlink_to(tmp_path / ".film-0123.part")
    others = names(tmp_path)
    command = [sys.executable, "-c", MAKE, kind]
    with subprocess.Popen(command, cwd=tmp_path, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        (left,) = set(names(tmp_path)) - set(others)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            files.remove_left(tmp_path)
        assert left in names(tmp_path)
        process.send_signal(signal.SIGKILL)
    assert left in names(tmp_path)
    with pytest.warns(FieldsimWarning, match=rf"{left}: removed, the unfinished part of a run that was killed"):
        files.write("test", tmp_path / "b.txt", b"")
    assert names(tmp_path) == sorted([*others, "b.txt"])


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
def test_a_fork_that_ends_leaves_its_parents_part(tmp_path):
    part = part_of(tmp_path / "a.mp4")
    child = os.fork()
    if child == 0:
        part.discard()
        os._exit(0)
    os.waitpid(child, 0)
    part.publish()
    assert names(tmp_path) == ["a.mp4"]


def test_whole_files_or_none(tmp_path):
    files.write("Mesh", tmp_path / "a.stl", b"old")
    with pytest.raises(InputError, match=r"Mesh: '.*b\.stl' cannot be written: "):
        files.write("Mesh", tmp_path / "a.stl" / "b.stl", b"new")
    assert (names(tmp_path), (tmp_path / "a.stl").read_bytes()) == (["a.stl"], b"old")


def test_errors_are_told_what_was_kept():
    own, other = InputError("a is wrong"), KeyboardInterrupt()
    for error in (own, other):
        files.say(error, "b is kept")
    assert str(own) == "a is wrong; b is kept"
    assert other.__notes__ == ["b is kept"]


def made_file(path, mode=0o644):
    path.write_bytes(b"old")
    path.chmod(mode)
    return path


# What takes the path of a file to be written.
MESH = fs.TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
WRITERS = {
    ".mp4": fs.Film,
    ".gif": fs.Film,
    ".png": fs.Film,
    ".npz": fs.Recording,
    ".stl": MESH.save,
    ".svg": plots.checked_path,
}


@pytest.mark.parametrize("ending", WRITERS)
def test_names_that_cannot_be_written_are_refused_at_once(tmp_path, ending):
    (tmp_path / f"folder{ending}").mkdir()
    made_file(tmp_path / "plain")
    cases = {
        tmp_path / ("a" * 300 + ending): "cannot be the name of a file: File name too long",
        f"{tmp_path}/a\0b{ending}": "give the path of a file as a string",
        f"{tmp_path}/\ud800{ending}": "give the path of a file as a string",
        os.fsencode(tmp_path) + b"/a" + ending.encode(): "give the path of a file as a string",
        7: "give the path of a file",
        tmp_path / "nowhere" / f"a{ending}": "does not exist; create it first",
        tmp_path / "plain" / f"a{ending}": "does not exist; create it first",
        tmp_path / f"folder{ending}": "this is a folder; give a file's name",
    }
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / f"pipe{ending}")
        cases[tmp_path / f"pipe{ending}"] = "is a device or a pipe"
    for path, words in cases.items():
        with pytest.raises(InputError, match=words):
            WRITERS[ending](path)
    assert not [name for name in names(tmp_path) if "part" in name]


@pytest.mark.parametrize("ending", WRITERS)
def test_what_may_not_be_written_is_refused_at_once(tmp_path, ending, monkeypatch):
    """Rights as a user has them: root may write anywhere."""
    locked = tmp_path / "locked"
    locked.mkdir()
    kept = made_file(tmp_path / f"a{ending}")
    monkeypatch.setattr(os, "access", lambda path, mode, **_: os.fspath(path) not in (str(kept), str(locked)))
    with pytest.raises(InputError, match="may not be written; give another name"):
        WRITERS[ending](kept)
    with pytest.raises(InputError, match="nothing may be written into the folder"):
        WRITERS[ending](locked / f"a{ending}")
    assert kept.read_bytes() == b"old"


def test_a_sequence_is_refused_where_it_cannot_be(tmp_path):
    made_file(tmp_path / "plain")
    for name, words in {
        "plain/": "is a file; give a folder",
        "a" * 300 + "/": "File name too long",
        "a" * 250 + "_%04d.png": "File name too long",
        "nowhere/a/": "does not exist",
        "a_%99999999d.png": r"written name_%04d\.png",
        "a_%d_%d.png": r"written name_%04d\.png",
        "50%.png": r"written name_%04d\.png; a single picture has no %",
        "a_%04d.png/": "a folder without %",
    }.items():
        with pytest.raises(InputError, match=words):
            fs.Film(f"{tmp_path}/{name}")


@pytest.mark.parametrize("ending", ["stl", "obj", "ply", "off", "glb"])
def test_no_link_is_followed(tmp_path, ending):
    """Neither at a name that a part could have, nor at the target, which is replaced."""
    victim = made_file(tmp_path / "victim")
    shared = tmp_path / "shared"
    shared.mkdir()
    for name in (f".a.{ending}.part", f".a.{ending}", f"a.{ending}"):
        (shared / name).symlink_to(victim)
    MESH.save(shared / f"a.{ending}")
    assert victim.read_bytes() == b"old"
    assert not (shared / f"a.{ending}").is_symlink()
    assert len(fs.mesh(shared / f"a.{ending}").faces) == 4
