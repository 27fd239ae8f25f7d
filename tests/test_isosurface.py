"""Meshes of level surfaces: closed, on the surface, within tolerance, and refused where there is no such mesh."""

import numpy as np
import pytest

from fieldsim.errors import InputError
from fieldsim.potentials import isosurface
from fieldsim.potentials.circle import Circle
from fieldsim.potentials.field import Field
from fieldsim.potentials.kernels import Gaussian, InverseSquare, Newtonian
from fieldsim.potentials.mesh import mesh
from fieldsim.potentials.plane import Plane
from fieldsim.potentials.point import Point
from fieldsim.potentials.segment import Segment
from fieldsim.world.body import Body
from fieldsim.world.material import Material

trimesh = pytest.importorskip("trimesh")
pytest.importorskip("skimage")

RING = Field(Circle((0, 0, 0), (0, 0, 1), 1.0), Newtonian())


def closed(found):
    solid = trimesh.Trimesh(found.vertices, found.faces, process=False)
    return solid.is_watertight and solid.is_winding_consistent and found.volume > 0


@pytest.mark.parametrize(("level", "holes"), [(6.0, 0), (8.0, 1)])
def test_a_ring_is_a_bun_or_a_donut(level, holes):
    # At the centre the ring's potential is 2 pi: below that level the hole is closed.
    found = RING.mesh(level)
    assert closed(found)
    assert trimesh.Trimesh(found.vertices, found.faces, process=False).euler_number == 2 - 2 * holes
    np.testing.assert_allclose(RING.value(found.vertices), level, rtol=1e-12)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_a_sphere_within_tolerance_far_from_the_origin(tolerance):
    center, radius = np.array([40.0, -3.0, 7.0]), 0.5
    found = Body(Point(tuple(center)), surface=Material(radius=radius)).surface_mesh(tolerance=tolerance)
    assert closed(found)
    middles = found.corners.mean(axis=1)
    assert np.abs(np.linalg.norm(middles - center, axis=1) - radius).max() < 1.05 * tolerance
    assert found.volume == pytest.approx(4 / 3 * np.pi * radius**3, rel=6 * tolerance)


def test_parts_of_any_number_and_bare_skeletons():
    field = Field([Point((0, 0, 0)), Segment((3, 0, 0), (4, 1, 0))], InverseSquare())
    found = field.mesh(5.0, resolution=80)
    assert closed(found)
    assert trimesh.Trimesh(found.vertices, found.faces, process=False).body_count == 2


def test_files_hold_the_mesh(tmp_path):
    found = RING.mesh(8.0, resolution=16)
    for kind in ("stl", "ply", "obj", "glb"):
        found.save(tmp_path / f"ring.{kind}")
        again = mesh(tmp_path / f"ring.{kind}")
        assert again.volume == pytest.approx(found.volume, rel=1e-4)
    assert len(list(tmp_path.iterdir())) == 4
    with pytest.raises(InputError, match=r"ends in no format of meshes; known: .*stl"):
        found.save(tmp_path / "ring.xyzzy")
    with pytest.raises(InputError, match="does not exist; create it first"):
        found.save(tmp_path / "nowhere" / "ring.stl")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Field(Point((0, 0, 0)), Gaussian(1.0)).mesh(2.0), "stays below 2"),
        (lambda: Field(Plane((0, 0, 0), (0, 0, 1)), Gaussian(1.0)).mesh(0.5), "a plane has no end"),
        (lambda: RING.mesh(0.0), "level is 0"),
        (lambda: RING.mesh(7.0, resolution=8, tolerance=0.1), "both given"),
        (lambda: RING.mesh(1.0, resolution=2), "resolution is 2"),
        (lambda: RING.mesh(8.0, tolerance=1e-9), "more than 64 cells"),
        (lambda: Field(lambda_point(), Newtonian()).mesh(1.0), "function of time"),
        (lambda: Body(Point((0, 0, 0))).surface_mesh(), "has no surface"),
    ],
)
def test_what_has_no_mesh_is_refused(make, words, monkeypatch):
    monkeypatch.setattr(isosurface, "FINEST", 64)
    with pytest.raises(InputError, match=words):
        make()


def lambda_point():
    return Point(lambda t: (t, 0, 0))
