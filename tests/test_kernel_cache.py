"""The cache of compiled kernels: damaged, in the way, full, shared by two processes at once."""

import os
import pathlib
import resource
import shutil
import subprocess
import sys

import pytest

SCRIPT = """
import fieldsim as fs
print(fs.gravity(fs.Point((0, 0, 0)), 1.0).value((0, 0, 2)))
"""


def start(folder, **options):
    environment = {**os.environ, "WARP_CACHE_PATH": str(folder)}
    return subprocess.Popen(
        [sys.executable, "-c", options.pop("script", SCRIPT)],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


def run(folder, **options):
    out, err = start(folder, **options).communicate(timeout=300)
    return out, err


@pytest.fixture(scope="module")
def filled(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cache")
    assert run(folder) == ("0.5\n", "")
    return folder


def files(folder, ending):
    found = list(folder.rglob("*" + ending))
    assert found, ending
    return found


def emptied(path):
    path.write_bytes(b"")


def flipped(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 16
    path.write_bytes(content)


def piped(path):
    """Reading it would wait for ever."""
    path.unlink()
    os.mkfifo(path)


def foldered(path):
    path.unlink()
    path.mkdir()


@pytest.mark.parametrize(
    ("ending", "damage"),
    [
        (".o", emptied),
        (".o", flipped),
        (".meta", flipped),
        pytest.param(".o", piped, marks=pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes in folders")),
        pytest.param(".sha256", piped, marks=pytest.mark.full),
        pytest.param(".o", foldered, marks=pytest.mark.full),
        pytest.param(".meta", emptied, marks=pytest.mark.full),
        pytest.param(".o", pathlib.Path.unlink, marks=pytest.mark.full),
        pytest.param(".sha256", pathlib.Path.unlink, marks=pytest.mark.full),
        pytest.param(".sha256", emptied, marks=pytest.mark.full),
    ],
)
def test_what_is_damaged_is_compiled_anew(filled, ending, damage):
    for path in files(filled, ending):
        damage(path)
    assert run(filled) == ("0.5\n", "")
    stamps = {path: path.stat().st_mtime_ns for path in files(filled, ".o")}
    assert run(filled) == ("0.5\n", "")
    assert {path: path.stat().st_mtime_ns for path in files(filled, ".o")} == stamps, "healed, then compiled again"


@pytest.mark.parametrize("target", [None, "nowhere"])
def test_what_stands_in_a_module_s_place_goes(filled, tmp_path, target):
    (module,) = {path.parent for path in files(filled, ".o")}
    shutil.rmtree(module)
    module.write_text("in the way") if target is None else module.symlink_to(tmp_path / target)
    assert run(filled) == ("0.5\n", "")
    assert files(module, ".o")


@pytest.mark.parametrize("place", ["file/cache", "file"])
def test_a_folder_that_cannot_be_is_told_in_a_line(tmp_path, place):
    (tmp_path / "file").write_text("in the way")
    out, err = run(tmp_path / place)
    assert out == "0.5\n"
    (line,) = err.splitlines()
    assert f"the kernel cache {tmp_path / place} cannot be used" in line
    assert "WARP_CACHE_PATH" in line


def test_a_full_disk_is_told_without_a_traceback_of_others(tmp_path):
    """No file may grow, in any folder: the import works, the first kernel says why it does not."""

    def limited():
        resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))

    script = "import sys\nimport fieldsim as fs\nsys.stdout.write('imported ')\nsys.stdout.flush()\n" + SCRIPT
    out, err = run(tmp_path, script=script, preexec_fn=limited)
    assert out == "imported "
    last = err.splitlines()[-1]
    assert last.startswith(f"fieldsim.errors.FieldsimError: the kernel cache {tmp_path}")
    assert "set WARP_CACHE_PATH to a folder" in last


def test_two_processes_share_an_empty_cache(tmp_path):
    pair = [start(tmp_path) for _ in range(2)]
    assert [process.communicate(timeout=300) for process in pair] == [("0.5\n", "")] * 2
    assert not list(tmp_path.rglob("*_p*_t*")), "parts of a compilation were left"


def test_compiling_is_told_on_a_terminal(tmp_path):
    """Within two seconds, once; not where standard error is a file (see the tests above), nor from the cache."""
    pty = pytest.importorskip("pty")
    script = "from fieldsim import launch\nlaunch._notice.AFTER = 0.01\n" + SCRIPT
    for told in (1, 0):
        ours, theirs = pty.openpty()
        environment = {**os.environ, "WARP_CACHE_PATH": str(tmp_path)}
        done = subprocess.run(
            [sys.executable, "-c", script], env=environment, stdout=subprocess.PIPE, stderr=theirs, timeout=300
        )
        os.close(theirs)
        said = b""
        while told and said.count(b"\n") < told:
            said += os.read(ours, 1000)
        os.close(ours)
        assert done.stdout == b"0.5\n"
        assert said.count(b"compiling kernels") == told
