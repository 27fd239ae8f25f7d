"""Meshes of level surfaces: closed, on the surface, within tolerance, and refused where there is no such mesh."""

import dataclasses

import numpy as np
import pytest

from fieldsim.errors import InputError
from fieldsim.potentials.field import Field
from fieldsim.potentials.gravity import gravity
from fieldsim.potentials.kernels import Gaussian, InverseSquare, Newtonian, Quartic
from fieldsim.potentials.meshes import isosurface
from fieldsim.potentials.meshes.mesh import mesh
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.plane import Plane
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.skeletons.shapes import box, rectangle
from fieldsim.potentials.skeletons.solid import solid
from fieldsim.world.body import Body
from fieldsim.world.material import Material
from fieldsim.world.motion import Pose
from fieldsim.world.world import World

trimesh = pytest.importorskip("trimesh")

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


def ball(radius, center=(0.0, 0.0, 0.0), sharpness=2.0):
    """A Gaussian point whose surface F = 1 is a sphere."""
    return Field(Point(center), Gaussian(sharpness / radius), np.exp(sharpness**2))


@pytest.mark.parametrize("radius", [1e-6, 1.0, 6371.0, 1e8])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_any_unit_anywhere(radius, offset):
    center = radius * offset * np.array([1.0, -2.0, 0.5])
    for options in ({"resolution": 16}, {"tolerance": 0.01 * radius}):
        found = Body(Point(center), surface=Material(radius=radius)).surface_mesh(**options)
        assert closed(found)
        assert found.volume == pytest.approx(4 / 3 * np.pi * radius**3, rel=0.02)


@pytest.mark.parametrize("options", [{"tolerance": 0.02}, {"resolution": 8}])
def test_small_parts_beside_big_ones(options):
    places = {1.0: (0, 0, 0), 0.1: (4, 0.013, 0.007), 0.003: (0, 3.1, 0.2), 1e-4: (-2, -1, 1.7)}
    found = sum(ball(radius, center) for radius, center in places.items()).mesh(1.0, **options)
    assert closed(found)
    near = {radius: np.linalg.norm(found.vertices - center, axis=1) for radius, center in places.items()}
    for radius, distances in near.items():
        np.testing.assert_allclose(distances[distances < 2 * radius], radius, rtol=1e-6)
        assert (distances < 2 * radius).sum() >= 20
    assert trimesh.Trimesh(found.vertices, found.faces, process=False).body_count == 4


@pytest.mark.parametrize("kernel", [Gaussian, Quartic, InverseSquare])
def test_thin_rings(kernel):
    tube = 0.03
    found = Body(Circle((0, 0, 0), (0, 0, 1), 1.0), surface=Material(radius=tube, kernel=kernel)).surface_mesh(
        tolerance=tube / 10
    )
    assert closed(found)
    assert trimesh.Trimesh(found.vertices, found.faces, process=False).euler_number == 0
    assert found.volume == pytest.approx(2 * np.pi**2 * tube**2, rel=0.08)


def test_a_thin_wire_on_a_big_ball_is_whole():
    field = ball(1.0) + Body(Segment((0, 0, 0), (0, 0, 4)), surface=Material(radius=0.02)).surface_field()
    found = field.mesh(1.0, tolerance=0.01)
    assert closed(found)
    assert found.vertices[:, 2].max() == pytest.approx(4.0, abs=0.03)
    along = found.vertices[found.vertices[:, 2] > 1.2]
    assert np.diff(np.sort(along[:, 2])).max() < 0.1
    assert trimesh.Trimesh(found.vertices, found.faces, process=False).body_count == 1


def test_hollows_and_what_no_element_reaches_alone():
    # A ball without its middle, and six points that come to the level only together.
    hollow = (ball(1.0, sharpness=1.0) - ball(0.5, sharpness=1.5)).mesh(1.0, resolution=32)
    assert closed(hollow)
    assert trimesh.Trimesh(hollow.vertices, hollow.faces, process=False).body_count == 2
    around = [(np.cos(t), np.sin(t), 0.0) for t in np.arange(6) * np.pi / 3]
    together = Field([Point(p) for p in around], Gaussian(0.8))
    assert together.value(around).max() < 3.0 < together.value((0, 0, 0))
    assert closed(together.mesh(3.0))


def test_sums_and_whole_worlds():
    body = Body(Point((0, 0, 0)), surface=Material(radius=0.5))
    twice = (body.surface_field() + body.surface_field()).mesh(2.0, tolerance=0.002)
    assert twice.volume == pytest.approx(4 / 3 * np.pi * 0.5**3, rel=0.02)
    world = World()
    for x in (0.0, 3.0):
        world.add_body(dataclasses.replace(body, motion=Pose((x, 0, 0)), surface=Material("blue", radius=0.5 + x)))
    mixed = (world.at(0.0).surface_field() + RING).mesh(9.0, resolution=16)
    assert closed(mixed)
    found = world.at(0.0).surface_mesh(tolerance=0.02)
    assert closed(found)
    assert found.vertices[:, 0].max() == pytest.approx(3.0 + 3.5, abs=1e-3)
    with pytest.raises(InputError, match="no body of the world has a surface"):
        World().at(0.0).surface_field()


def test_the_field_of_a_solid():
    # Outside a cube its pull is nearly that of a point.
    found = solid(mesh(box((5, 0, 0), (1, 1, 1))), 1.0).mesh(0.3, tolerance=0.05)
    assert closed(found)
    assert found.volume == pytest.approx(4 / 3 * np.pi / 0.3**3, rel=0.03)


def test_an_open_mesh_is_not_returned():
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1.0)])
    faces = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
    assert len(isosurface.closed(corners, faces).faces) == 4
    for wrong in (faces[:3], faces[[0, 1, 2, 2]], np.concatenate([faces, faces[:1]])):
        with pytest.raises(InputError, match="could not be closed"):
            isosurface.closed(corners, wrong)


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
        (lambda: RING.mesh(8.0, tolerance=1e-9), r"tolerance is 1e-09, .* about [\d,]+ cells, more than 2,000,000"),
        (lambda: RING.mesh(8.0, resolution=512), r"resolution is 512, .* about [\d,]+ cells, more than 2,000,000"),
        (lambda: RING.mesh(8.0, resolution=10**6), r"resolution is 1e\+06; give a whole number of at most 512"),
        (lambda: RING.mesh(20.0), "too thin of about 0.0003"),
        (lambda: (-RING).mesh(1.0), "stays below 1"),
        (lambda: Field(lambda_point(), Newtonian()).mesh(1.0), "function of time"),
        (lambda: Body(Point((0, 0, 0))).surface_mesh(), "has no surface"),
    ],
)
def test_what_has_no_mesh_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()


def lambda_point():
    return Point(lambda t: (t, 0, 0))


@pytest.mark.parametrize("level", [1.0, 2.0])
def test_a_plate_that_leaves_its_own_surface(level):
    plate = gravity(rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0)), 1.0)
    assert plate.value((0.5, 0.5, 0.0)) < 2.0 < plate.value((0, 0, 0.01))
    found = plate.mesh(level, tolerance=0.02)
    assert closed(found)
    np.testing.assert_allclose(plate.value(found.vertices), level, rtol=1e-9)
