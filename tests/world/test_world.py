"""Motions, materials, bodies and snapshots: plain values with the promises that their docstrings make."""

import math

import numpy as np
import pytest

from fieldsim.errors import InputError
from fieldsim.potentials import registry
from fieldsim.potentials.elements import Elements, pack, place
from fieldsim.potentials.kernels import Cauchy, Gaussian, Newtonian
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.plane import Plane
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.primitives.triangle import Triangle
from fieldsim.sources.elements import surface_of
from fieldsim.world.body import Body
from fieldsim.world.contact import Bounce
from fieldsim.world.light import DirectionalLight, PointLight
from fieldsim.world.material import Material
from fieldsim.world.motion import Keyframes, Pose, Spin, pose_at, timeline
from fieldsim.world.particles import Particles
from fieldsim.world.rig import Bone, Rig
from fieldsim.world.world import World

ORIGIN = (0.0, 0.0, 0.0)


def field_at(elements, point):
    """F and its gradient, by plain Python."""
    total = registry.field_sum(elements.kinds_used)
    return np.array(total(*map(float, point), elements.rows, elements.kinds, 0, len(elements)))


# Keyframes


def test_cubic_keyframes_pass_through_the_keys_and_keep_uniform_motion():
    times = [0.0, 1.0, 2.5, 3.0, 4.0]
    line = Keyframes(times, [(2 * t, -t, 1.0) for t in times])
    for t in times:
        np.testing.assert_allclose(line(t), (2 * t, -t, 1.0), atol=1e-15)
    # Inner spans know both neighbours; the end spans ease in and out.
    np.testing.assert_allclose(line(1.7), (3.4, -1.7, 1.0), atol=1e-14)


@pytest.mark.parametrize("loop", [False, True])
def test_cubic_keyframes_have_no_kink(loop):
    curve = Keyframes([0, 1, 2, 3], [0.0, 2.0, -1.0, 0.0], loop=loop)
    h = 1e-6
    for t in (1.0, 2.0) + ((3.0,) if loop else ()):
        before, after = (curve(t) - curve(t - h)) / h, (curve(t + h) - curve(t)) / h
        assert before == pytest.approx(after, abs=1e-4)


def test_keyframes_hold_outside_and_wrap_when_looping():
    assert Keyframes([1, 2], [3.0, 4.0])(0.0) == 3.0
    assert Keyframes([1, 2], [3.0, 4.0])(9.0) == 4.0
    looped = Keyframes([0, 1, 2], [0.0, 1.0, 0.0], loop=True)
    assert looped(0.25) == pytest.approx(looped(4.25), abs=1e-14)


def test_linear_and_step_keyframes():
    assert Keyframes([0, 2], [0.0, 4.0], interpolation="linear")(0.5) == 1.0
    assert Keyframes([0, 2], [0.0, 4.0], interpolation="step")(1.99) == 0.0


@pytest.mark.parametrize(
    ("times", "values", "words"),
    [
        ([0, 1], [1.0], "2 times for 1 values"),
        ([0, 0], [1.0, 2.0], "do not increase"),
        ([0, math.nan], [1.0, 2.0], "times is .*nan"),
        ([0, 1], [1.0, math.inf], "values is .*inf"),
        ([0, 1], [(1, 2), (1, 2, 3)], "all of one shape"),
        ([], [], "0 times"),
    ],
)
def test_bad_keyframes_are_refused(times, values, words):
    with pytest.raises(InputError, match=words):
        Keyframes(times, values)


def test_keyframes_of_poses_keep_uniform_rotation_and_pass_through_the_keys():
    times = [0.0, 1.0, 2.5, 3.0, 4.0]
    poses = [Pose.turned((1, 2, 3), 0.9 * t, (2 * t, 0, 1)) for t in times]
    curve = Keyframes(times, poses)
    for time, pose in zip(times, poses, strict=True):
        np.testing.assert_allclose(curve(time).matrix, pose.matrix, atol=1e-15)
    np.testing.assert_allclose(curve(1.7).matrix, Pose.turned((1, 2, 3), 0.9 * 1.7).matrix, atol=1e-14)
    np.testing.assert_allclose(curve(1.7).position, (3.4, 0, 1), atol=1e-14)
    linear = Keyframes([0, 2], [Pose(), Pose.turned((0, 0, 1), 2.0)], interpolation="linear")
    np.testing.assert_allclose(linear(0.5).matrix, Pose.turned((0, 0, 1), 0.5).matrix, atol=1e-15)


@pytest.mark.parametrize("loop", [False, True])
def test_keyframes_of_poses_turn_without_a_jerk(loop):
    turns = np.random.default_rng(3).normal(size=(4, 4))
    poses = [Pose((0, 0, 0), turn) for turn in turns]
    curve = Keyframes([0, 1, 2.5, 3, 4], [*poses, poses[0]], loop=loop)
    h = 1e-6
    for t in (1.0, 2.5, 3.0) + ((4.0,) if loop else ()):
        before, here, after = (curve(t + d).matrix for d in (-h, 0.0, h))
        np.testing.assert_allclose((here - before) / h, (after - here) / h, atol=1e-4)


def test_a_pose_among_numbers_is_refused():
    with pytest.raises(InputError, match=r"values\[1\] is 2.0; give a fs.Pose"):
        Keyframes([0, 1], [Pose(), 2.0])


# Rigs


def arm():
    """Upper arm and forearm of length 1; the shoulder turns about y, the elbow turns back."""
    return Rig(
        [Bone("upper", motion=Spin((0, 1, 0), 1.0)), Bone("fore", "upper", Pose((0, 0, -1)), Spin((0, 1, 0), -1))]
    )


def test_bones_hang_on_their_parents():
    forearm = arm().carry("fore", Segment((0, 0, 0), (0, 0, -1)))
    elbow = (-math.sin(0.5), 0.0, -math.cos(0.5))
    np.testing.assert_allclose(forearm.at(0.5).start, elbow, atol=1e-15)
    np.testing.assert_allclose(forearm.at(0.5).end, np.add(elbow, (0, 0, -1)), atol=1e-15)


PIECES = [
    Point((1, 2, 3)),
    Segment((1, 2, 3), (0, 1, 0)),
    Circle((1, 0, 0), (0, 1, 1), 0.5),
    Arc((1, 0, 0), (0, 1, 1), (1, 0, 0), 0.5, 2.0),
    Triangle((0, 0, 0), (1, 0, 0), (0, 1, 1)),
    Plane((1, 0, 0), (1, 1, 1)),
    Segment(lambda t: (1 + t, 2, 3), (0, 1, 0)),
]


@pytest.mark.parametrize("piece", PIECES, ids=lambda piece: type(piece).__name__)
def test_every_piece_is_carried_as_its_rows_are_placed(piece):
    rig, time = arm(), 0.7
    pose = rig.pose("fore", time)
    packed = pack([piece.at(time)], [Newtonian()], [1.0])
    rows = place(packed.rows, pose.matrix, np.array(pose.position))
    carried = pack([rig.carry("fore", piece).at(time)], [Newtonian()], [1.0])
    wanted = field_at(Elements(rows, packed.kinds, packed.order), (0.3, -2.0, 1.0))
    np.testing.assert_allclose(field_at(carried, (0.3, -2.0, 1.0)), wanted, rtol=1e-13, atol=1e-14)


def test_bad_rigs_are_refused():
    with pytest.raises(InputError, match="'shin' hangs on 'thigh', which is not among the bones before it: there are"):
        Rig([Bone("shin", "thigh")])
    with pytest.raises(InputError, match="two bones are called 'a'"):
        Rig([Bone("a"), Bone("a")])
    with pytest.raises(InputError, match="no bone is called 'leg'; there are upper, fore"):
        arm().carry("leg", Point(ORIGIN))


# Poses


def test_spin_turns_about_its_center():
    spin = Spin(axis=(0, 0, 2), rate=math.pi, center=(1, 0, 0))
    pose = spin(0.5)
    np.testing.assert_allclose(pose.matrix @ (2, 0, 0) + pose.position, (1, 1, 0), atol=1e-15)
    np.testing.assert_allclose(pose.matrix @ (1, 0, 7) + pose.position, (1, 0, 7), atol=1e-15)


def test_a_motion_may_give_positions():
    assert pose_at(lambda t: (t, 0, 0), 2.0) == Pose((2, 0, 0))
    assert pose_at(Pose((1, 2, 3)), 5.0) == Pose((1, 2, 3))


def test_rotation_matrix_is_orthogonal_and_right_handed():
    matrix = Pose.turned((1, 2, -1), 0.7).matrix
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(matrix) == pytest.approx(1.0)


def test_timeline_counts_frames():
    times = timeline(2.0, fps=30)
    assert len(times) == 60
    assert times[:2] == [0.0, 1 / 30]
    with pytest.raises(InputError, match="seconds is -1"):
        timeline(-1)


# Materials


@pytest.mark.parametrize("kernel", [Gaussian, Cauchy])
@pytest.mark.parametrize("blobbiness", [-0.5, -4.0, -256.0])
def test_surface_lies_at_the_radius_in_isolation(kernel, blobbiness):
    material = Material(radius=0.3, blobbiness=blobbiness, kernel=kernel)
    # A segment much longer than the kernel is wide is a line, to 1e-13 for the Gaussian; the Cauchy falls as x^-3.
    tolerance = {"abs": 1e-12} if kernel is Gaussian else {"abs": 1e-9}
    for primitive, tol in ((Point(ORIGIN), {"abs": 1e-12}), (Segment((-900, 0, 0), (900, 0, 0)), tolerance)):
        elements = Body(primitive, surface=material).surface_elements(0.0)
        assert field_at(elements, (0, 0, 0.3))[0] == pytest.approx(1.0, **tol)


def test_cauchy_has_the_gaussians_half_width():
    gaussian, cauchy = Material().surface_kernel, Material(kernel=Cauchy).surface_kernel
    half = math.sqrt(math.log(2.0)) / gaussian.a
    assert (1 + (cauchy.s * half) ** 2) ** -2 == pytest.approx(0.5)


def test_threshold_shrinks_and_swells():
    thin = Body(Point(ORIGIN), surface=Material(radius=1.0, blobbiness=-4, threshold=math.e)).surface_elements(0.0)
    # exp(4 - 4 r^2) = e where r^2 = 3/4.
    assert field_at(thin, (math.sqrt(0.75), 0, 0))[0] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"radius": 0}, "radius is 0"),
        ({"blobbiness": 1.0}, "blobbiness is 1"),
        ({"threshold": -1}, "threshold is -1"),
        ({"kernel": "gaussian"}, r"kernel is 'gaussian'.*fs\.Gaussian"),
        ({"level": 0.0}, "level is 0"),
        ({"color": "terracota"}, "did you mean 'terracotta'"),
        ({"color": (2, 0, 0)}, r"in 0\.\.1"),
        ({"radius": math.nan}, "radius is nan"),
    ],
)
def test_bad_materials_are_refused(options, words):
    with pytest.raises(InputError, match=words):
        Material(**options)


def test_an_animated_material_is_checked_when_it_is_used():
    material = Material(radius=lambda t: 1.0 - t)
    assert material.at(0.5).radius == 0.5
    with pytest.raises(InputError, match="radius is 0"):
        material.at(1.0)


# Bodies, particles, worlds


def test_placed_surface_equals_the_body_frame_field():
    pose = Pose.turned((1, 1, 0), 0.8, position=(0.3, -2.0, 1.0))
    skeleton = [Segment((-1, 0, 0), (1, 0.5, 0)), Point((0, 0, 1))]
    world = World()
    body = world.add_body(Body(skeleton, surface=Material(), motion=pose))
    local = np.array([0.4, 0.2, 0.3])
    inside = field_at(body.surface_elements(0.0), local)
    outside = field_at(world.at(0.0).surface_field().elements, pose.matrix @ local + pose.position)
    assert outside[0] == pytest.approx(inside[0], rel=1e-13)
    np.testing.assert_allclose(outside[1:], pose.matrix @ inside[1:], rtol=1e-12)


def test_snapshot_groups_formulas_and_keeps_owners():
    world = World()
    world.add_body(Body([Segment(ORIGIN, (1, 0, 0)), Point(ORIGIN)], surface=Material(color="red")))
    world.add_body(Body(Point((5, 0, 0)), surface=Material(color="blue")))
    world.add_body(Body(Point((9, 0, 0)), gravity=Newtonian()))
    surface = surface_of(world.at(0.0))
    assert len(surface.elements) == 3
    assert (np.diff(surface.elements.kinds) >= 0).all()
    owner_of_five = surface.owner[surface.elements.rows[:, 5] == 5.0]
    assert [surface.materials[i].color for i in owner_of_five] == ["blue"]


def test_animated_skeleton_moves_gravity_and_surface_alike():
    body = Body(Point(lambda t: (t, 0, 0)), gravity=Newtonian(), mass=lambda t: 1 + t, surface=Material())
    assert body.deforming
    assert body.gravity_elements(2.0).rows[0, 5] == body.surface_elements(2.0).rows[0, 5] == 2.0
    assert body.gravity_elements(2.0).rows[0, 0] == 3.0


def test_mass_is_spread_over_the_measure():
    body = Body([Segment(ORIGIN, (1, 0, 0)), Segment(ORIGIN, (0, 3, 0))], gravity=Newtonian(), mass=2.0, G=3.0)
    np.testing.assert_allclose(body.gravity_elements(0.0).rows[:, 0], 6.0 / 4.0)


def test_bad_bodies_and_particles_are_refused():
    with pytest.raises(InputError, match="mixes points, curves"):
        Body([Point(ORIGIN), Segment(ORIGIN, (1, 0, 0))], gravity=Newtonian())
    with pytest.raises(InputError, match="skeleton is empty"):
        Body([])
    with pytest.raises(InputError, match="gravity is 1"):
        Body(Point(ORIGIN), gravity=1.0)
    with pytest.raises(InputError, match=r"positions\[1\] is \(nan, 0.0, 0.0\)"):
        Particles([(0, 0, 0), (math.nan, 0, 0)], np.zeros((2, 3)))
    with pytest.raises(InputError, match=r"shape \(2, 2\)"):
        Particles(np.zeros((2, 2)), np.zeros((2, 2)))
    with pytest.raises(InputError, match="one velocity per position"):
        Particles(np.zeros((2, 3)), np.zeros((3, 3)))
    with pytest.raises(InputError, match=r"restitution is 1\.5"):
        Bounce(1.5)


def test_lights_are_checked():
    with pytest.raises(InputError, match="direction is"):
        DirectionalLight(direction=(0, 0, 0))
    with pytest.raises(InputError, match="intensity is -1"):
        PointLight(position=ORIGIN, intensity=-1)
    with pytest.raises(InputError, match=r"lights\[0\]"):
        World(lights=["sun"])


def test_particles_start_as_given_and_are_copied():
    positions = np.zeros((2, 3))
    world = World()
    world.add_particles(positions, np.ones((2, 3)), radius=0.5, color=(1, 0, 0))
    positions[:] = 9.0
    centers, radii, colors = world.at(0.0).spheres
    assert not centers.any()
    assert radii.tolist() == [0.5, 0.5]
    np.testing.assert_allclose(colors, [(1, 0, 0)] * 2)
