"""Native functions kept on disk: loaded and not compiled by a second process, and never what they should not be."""

import ctypes
import json
import math
import os
import subprocess
import sys

import numba
import pytest
from numba import types

from fieldsim.errors import FieldsimError
from fieldsim.native import cache, fingerprint, functions, inner, known, native_function, place_of
from fieldsim.portable import portable, real

# A function of a number, an address that is of the process, and C's mathematics; says what was compiled.
SCRIPT = """
import ctypes, math, sys
from numba import types
from fieldsim.native import functions, inner, known, native_function, place_of

PLACE = place_of("offset", int(sys.argv[1]))

@inner
def shifted(x, place):
    return math.sin(x) + known(place)

def function(x):
    return shifted(x, PLACE)

made = native_function("shifted", lambda: function, types.float64(types.float64), folders=())
print(ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(made.address)(0.5), functions.compiled)
"""
FORCES = """
import mujoco, fieldsim as fs
from fieldsim.native import functions

model = mujoco.MjModel.from_xml_string(
    '<mujoco><option gravity="0 0 0"/><worldbody><body pos="2 0 0.3"><freejoint/><geom size="0.1"/></body></worldbody>'
    "</mujoco>"
)
data = mujoco.MjData(model)
turning = fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(), mass=1.0, motion=lambda t: fs.Pose((0.1 * t, 0, 0)))
with fs.mujoco.FieldForces(model, data, turning):
    mujoco.mj_step(model, data, 100)
print(data.qpos.tolist(), functions.compiled)
"""


TWO = """
import pathlib, sys, time
from fieldsim.native import cache

def make():
    print("made", flush=True)
    time.sleep(0.5)
    return b"content"

assert cache.kept("slow", "key", make, lambda content: True) == b"content"
"""


def start(folder, *arguments, script=SCRIPT):
    return subprocess.Popen(
        [sys.executable, "-c", script, *map(str, arguments)],
        env={**os.environ, "WARP_CACHE_PATH": str(folder)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def run(folder, *arguments, **options):
    out, err = start(folder, *arguments, **options).communicate(timeout=300)
    assert err == ""
    return out.strip()


def test_a_second_process_compiles_nothing_and_has_addresses_of_its_own(tmp_path):
    assert run(tmp_path, 7) == f"{math.sin(0.5) + 7} ['shifted']"
    assert run(tmp_path, 9) == f"{math.sin(0.5) + 9} []"


def test_two_processes_at_once_make_it_once(tmp_path):
    both = [start(tmp_path, script=TWO) for _ in range(2)]
    assert sorted(one.communicate(timeout=300) for one in both) == [("", ""), ("made\n", "")]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The cache, empty, and for this process alone."""
    monkeypatch.setattr(cache.kernel_cache, "root", lambda: tmp_path)
    return tmp_path / "fieldsim-native"


PLACE = place_of("of the tests", 40)


@inner
def summed(x, y):
    return x + y + known(PLACE)


def function(x, y):
    return summed(x, y)


def made():
    """Whether the function was compiled, and not loaded; it works in any case."""
    before = len(functions.compiled)
    one = native_function("summed", lambda: function, types.intp(types.intp, types.intp), folders=())
    assert ctypes.CFUNCTYPE(ctypes.c_ssize_t, ctypes.c_ssize_t, ctypes.c_ssize_t)(one.address)(1, 1) == 42
    return len(functions.compiled) > before


def test_names_have_places_of_their_own():
    assert place_of("of the tests") == PLACE != place_of("other")
    with pytest.raises(FieldsimError, match="'4097' and 'of the tests' have the same place in native code's table"):
        place_of("4097")


def the_file(folder):
    (path,) = folder.iterdir()
    return path


def flipped(path):
    content = bytearray(path.read_bytes())
    content[-9] ^= 16
    path.write_bytes(content)


def halved(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def emptied(path):
    path.write_bytes(b"")


def piped(path):
    """Reading it would wait for ever."""
    path.unlink()
    os.mkfifo(path)


def needing(path):
    """Whole, but of a process that had a function which this one lacks."""
    _, head, code = path.read_bytes().split(b"\n", 2)
    head = json.dumps({**json.loads(head), "needs": ["fieldsim_is_not_there"]}).encode()
    cache._write(path, head + b"\n" + code)


@pytest.mark.parametrize("damage", [flipped, halved, emptied, piped, needing])
def test_what_is_damaged_is_made_anew(damage, folder):
    assert made()
    assert not made()
    damage(the_file(folder))
    assert made()
    assert not made()


def test_where_nothing_can_be_kept_it_is_made_each_time(folder):
    folder.write_bytes(b"in the way")
    assert made()
    assert made()


@pytest.mark.parametrize(("name", "value"), [("CPU_NAME", "generic"), ("CPU_FEATURES", "+sse2"), ("BOUNDSCHECK", 1)])
def test_another_processor_or_setting_gets_code_of_its_own(name, value, folder, monkeypatch):
    assert made()
    with monkeypatch.context() as patch:
        patch.setattr(numba.core.config, name, value)
        assert made()
        assert not made()
    assert not made()
    assert len(list(folder.iterdir())) == 2


def test_old_files_are_forgotten(folder, monkeypatch):
    monkeypatch.setattr(cache, "MOST", 3)
    for k in range(6):
        cache.kept("one", f"{k}", lambda: b"content", lambda content: True)
    cache.kept("one-more", "0", lambda: b"content", lambda content: True)
    found = [path.name for path in folder.iterdir()]
    assert len([name for name in found if name.startswith("one-") and "more" not in name]) == 3
    assert "one-more-0.object" in found


def test_another_source_has_another_fingerprint(tmp_path):
    """One letter in a module, wherever in the folders; a file beside them does not matter."""
    (tmp_path / "part" / "deep").mkdir(parents=True)
    (tmp_path / "part" / "deep" / "module.py").write_text("A = 1\n")
    digest = fingerprint.sources.__wrapped__
    before = digest(("part",), tmp_path)
    (tmp_path / "beside.py").write_text("A = 1\n")
    assert digest(("part",), tmp_path) == before
    (tmp_path / "part" / "deep" / "module.py").write_text("A = 2\n")
    assert digest(("part",), tmp_path) != before


FACTOR = 2.0


@portable
def scaled(x: real):
    return real(FACTOR) * x


@portable
def shifted(x: real):
    return scaled(x) + real(1.0)


@portable
def shifted_by_two(x: real):
    return scaled(x) + real(2.0)


def test_portable_functions_differ_by_all_that_they_call_and_read(monkeypatch):
    def digest(*functions):
        return fingerprint.portables(functions)

    @portable
    def halved(x: real):
        return real(0.5) * x

    first = digest(shifted)
    others = [digest(shifted_by_two), digest(shifted.bind(scaled=halved)), digest(shifted, shifted), digest(scaled)]
    assert digest(shifted) == first == digest(shifted.bind(scaled=scaled))
    monkeypatch.setitem(globals(), "FACTOR", 3.0)
    assert len({first, digest(shifted), *others}) == 6


def test_it_works_beside_numba_itself(folder):
    """What numba compiles for all the world here is also called from Python, before and after."""
    largest = numba.njit(lambda x, y: max(x, y, 0))
    assert largest(1, 2) == 2
    assert made()
    assert numba.njit(lambda x, y: max(min(x, y), 1.5))(1, 2) == 1.5


@pytest.mark.parametrize("called", [numba.njit(lambda x: 2.0 * x), scaled.numba], ids=["numba", "portable"])
def test_functions_that_python_calls_are_refused(called, folder):
    """They would have no code for it, and the call would end the process."""
    with pytest.raises(FieldsimError, match=r"that Python may call, and a native function calls it; use .*\.native"):
        native_function("doubled", lambda: lambda x: called(x), types.float64(types.float64), folders=())
    assert called(2.0) == scaled(2.0) == 4.0
    assert not list(folder.rglob("*doubled*"))


def test_the_callback_is_compiled_by_one_process():
    """With a motion that only Python knows: native code finds this process's Python."""
    first, second = (
        subprocess.run([sys.executable, "-c", FORCES], capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    )
    assert second.endswith("] []\n")
    assert second.partition("]")[0] == first.partition("]")[0]
