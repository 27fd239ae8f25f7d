"""Triangle meshes: from arrays and files, and what is refused."""

import subprocess
import sys

import numpy as np
import pytest

from fieldsim.errors import InputError
from fieldsim.potentials.meshes.mesh import TriangleMesh, mesh
from fieldsim.potentials.primitives.triangle import Triangle
from fieldsim.potentials.skeletons.solid import solid

VERTICES = [[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]]
FACES = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]


def test_arrays():
    made = mesh(VERTICES, FACES)
    assert (made.vertices.shape, made.faces.shape, made.corners.shape) == ((4, 3), (4, 3), (4, 3, 3))
    assert made.volume == pytest.approx(1.0, rel=1e-14)
    assert made.area == pytest.approx(1 + 1.5 + 3 + 3.5, rel=1e-14)
    assert made.flipped().volume == pytest.approx(-1.0, rel=1e-14)
    assert made.triangles()[0] == Triangle((0, 0, 0), (0, 2, 0), (1, 0, 0))
    assert sum(t.measure for t in made.triangles()) == pytest.approx(made.area)
    assert repr(made) == "<TriangleMesh of 4 vertices and 4 faces>"


def test_a_mesh_keeps_its_own_arrays():
    vertices = np.array(VERTICES, dtype=float)
    made = mesh(vertices, FACES)
    vertices[0] = 7.0
    assert made.vertices[0].tolist() == [0, 0, 0]
    with pytest.raises(ValueError, match="read-only"):
        made.vertices[0] = 1.0


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply"])
def test_files(tmp_path, suffix):
    trimesh = pytest.importorskip("trimesh")
    path = tmp_path / f"rock.{suffix}"
    trimesh.Trimesh(VERTICES, FACES, process=False).export(path)
    read = mesh(path)
    assert (len(read.vertices), len(read.faces)) == (4, 4)
    assert solid(read, 1.0).value((5, 5, 5)) == pytest.approx(solid(mesh(VERTICES, FACES), 1.0).value((5, 5, 5)))


def test_unreadable_files(tmp_path):
    pytest.importorskip("trimesh")
    with pytest.raises(InputError, match=r"there is no file .*nowhere\.stl"):
        mesh(tmp_path / "nowhere.stl")
    for name, content in (("broken.ply", "not a mesh"), ("broken.xyzzy", "")):
        (tmp_path / name).write_text(content)
        with pytest.raises(InputError, match="cannot be read as a triangle mesh"):
            mesh(tmp_path / name)


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply", "off", "glb"])
@pytest.mark.parametrize(("scale", "offset"), [(1, 0), (1e-9, 0), (1e9, 0), (1e-30, 0), (1e-3, 7), (1e30, 0)])
def test_what_is_saved_is_read(tmp_path, suffix, scale, offset):
    made = mesh(scale * np.array(VERTICES) / 3 + offset, FACES)
    made.save(tmp_path / f"rock.{suffix}")
    read = mesh(tmp_path / f"rock.{suffix}")
    exact = suffix in ("obj", "ply", "off")
    tolerance = 0.0 if exact else 1e-7 * max(offset, scale)
    np.testing.assert_allclose(np.sort(read.corners, axis=None), np.sort(made.corners, axis=None), 0.0, tolerance)
    assert read.volume == pytest.approx(made.volume, rel=1e-12 if exact else 1e-3)


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply", "off", "glb"])
def test_others_read_what_is_saved(tmp_path, suffix):
    trimesh = pytest.importorskip("trimesh")
    made = mesh(VERTICES, FACES)
    made.save(tmp_path / f"rock.{suffix}")
    read = trimesh.load(tmp_path / f"rock.{suffix}", force="mesh")
    assert (read.is_watertight, len(read.vertices), len(read.faces)) == (True, 4, 4)
    assert (read.volume, read.area) == pytest.approx((made.volume, made.area))
    np.testing.assert_allclose(read.face_normals, trimesh.Trimesh(VERTICES, FACES, process=False).face_normals)


@pytest.mark.parametrize("suffix", ["stl", "glb"])
@pytest.mark.parametrize(("scale", "offset"), [(1.0, 1e8), (1e40, 0.0), (1e-60, 0.0)])
def test_a_mesh_that_would_lose_its_shape_is_not_saved(tmp_path, suffix, scale, offset):
    made = mesh(scale * np.array(VERTICES) + offset, FACES)
    with pytest.raises(InputError, match=r"would lose its shape in the 7 digits .* save it as \.ply, \.obj or \.off"):
        made.save(tmp_path / f"rock.{suffix}")
    assert not list(tmp_path.iterdir())


def test_files_need_no_other_package(tmp_path):
    script = f"""
import sys
from fieldsim.potentials.meshes.mesh import mesh
mesh({VERTICES}, {FACES}).save({str(tmp_path / "rock.glb")!r})
mesh({str(tmp_path / "rock.glb")!r})
print("trimesh" in sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        ([*VERTICES[:3], [0, 0, 1e200]], FACES, r"vertices\[3\] is \(0.0, 0.0, 1e\+200\); give coordinates of at most"),
        (VERTICES, [[0, 1, 4]], r"faces\[0\] is \[0, 1, 4\]; give indices from 0 to 3"),
        (VERTICES, [[0, 1, 2], [0, 1, -1]], r"faces\[1\] is \[0, 1, -1\]"),
        (VERTICES, [[0, 1, 2], [0, 1, 1]], r"faces\[1\] is \[0, 1, 1\] .* without area"),
        ([*VERTICES, [0.5, 0, 0]], [[0, 1, 2], [0, 1, 4]], r"faces\[1\] is \[0, 1, 4\] .* without area"),
        (VERTICES, [[0.0, 1.0, 2.0]], r"faces are an array of float64 with shape .*; give integers"),
        (VERTICES, [[0, 1, 2, 3]], r"shape \(1, 4\); give integers of shape \(F, 3\)"),
        (VERTICES, [[0, 1, 2], [0, 1]], r"give integers of shape \(F, 3\)"),
        (VERTICES, np.zeros((0, 3), dtype=int), "no faces"),
        ([[0, 0, np.nan], *VERTICES[1:]], FACES, r"vertices\[0\]"),
        ([[0, 0], [1, 0]], FACES, r"vertices has shape \(2, 2\)"),
        (VERTICES, None, "vertices are given without faces"),
        ("rock.stl", FACES, r"faces are given beside the file 'rock\.stl'"),
    ],
)
def test_bad_input(vertices, faces, message):
    with pytest.raises(InputError, match=message):
        mesh(vertices, faces)


def test_equality_is_identity():
    made = TriangleMesh(VERTICES, FACES)
    assert made == made
    assert made != TriangleMesh(VERTICES, FACES)
