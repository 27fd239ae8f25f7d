"""What every primitive declares of itself, against samples of it that know nothing of rows.

A primitive that enters the registry is tested here once it has an example in `EXAMPLES`.
"""

import ast
import dataclasses
import math
import pathlib

import numpy as np
import pytest
from primitive_examples import (
    EXAMPLES,
    FINITE,
    NORMAL,
    TOUCHED,
    A,
    around,
    cells,
    named,
    on,
    row_of,
)

import fieldsim as fs
from fieldsim.potentials import registry
from fieldsim.potentials.primitives.base import Primitive, Volume
from fieldsim.potentials.row import ANGLE, CENTER, POSITIONS, RADIUS
from fieldsim.render.solvers.packet.gaussian_elements import KINDS


def test_every_primitive_has_an_example():
    assert {type(primitive) for primitive in EXAMPLES} == {kind for _, kind in registry.FORMULAS}


# Declaring


@pytest.mark.parametrize("name", Primitive.REQUIRED)
def test_a_class_without_a_trait_is_refused(name):
    traits = {trait: getattr(fs.Segment, trait) for trait in Primitive.REQUIRED}
    type("Whole", (Primitive,), traits)
    del traits[name]
    with pytest.raises(fs.InputError, match=f"class Half lacks the trait '{name}'; define {name}, "):
        type("Half", (Primitive,), traits)
    # What another primitive declares holds for what derives from it.
    type("Like", (fs.Segment,), traits)


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("points", "start"),
        ("dimension", 1.5),
        ("volume", "capsule"),
        ("distance", math.dist),
        ("feet", math.dist),
        ("straight", 1),
        ("nearby", "2"),
        ("corners", 2.0),
    ],
)
def test_a_trait_of_a_wrong_type_is_refused(name, wrong):
    traits = {trait: getattr(fs.Segment, trait) for trait in Primitive.REQUIRED}
    with pytest.raises(fs.InputError, match=f"class Odd: {name} is .*; give .*{Primitive.REQUIRED[name][:10]}"):
        type("Odd", (Primitive,), {**traits, name: wrong})


@pytest.mark.parametrize("primitive", EXAMPLES, ids=named)
def test_traits_are_of_their_kind(primitive):
    assert isinstance(primitive.volume, Volume)
    assert primitive.along_rays in ("", *KINDS)
    assert primitive.corners in (1, 2, 3)
    assert primitive.plain().profiled is False
    assert primitive.plain() == primitive or primitive.profiled
    fields = {field.name for field in dataclasses.fields(primitive)}
    assert {*primitive.points, *primitive.directions} <= fields


# Who builds skeletons, or says what it can do; what is known of primitives is declared by themselves.
USERS = {
    "dynamics/splitting/fast_pull.py",  # particles are points
    "mujoco/lander.py",
    "mujoco/scene/skins.py",
    "potentials/calibration.py",
    "potentials/meshes/mesh.py",
    "render/solvers/laguerre.py",
}


def test_no_other_room_names_primitives():
    package = pathlib.Path(fs.__file__).parent
    names = {kind.__name__ for _, kind in registry.FORMULAS}
    found = set()
    for path in package.rglob("*.py"):
        part = path.relative_to(package).as_posix()
        if part.startswith(tuple(f"potentials/{room}/" for room in ("primitives", "formulas", "skeletons"))):
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
        if any(names & {alias.name for alias in node.names} for node in imports):
            found.add(part)
        # A table keyed by names of classes.
        keys = [key for node in ast.walk(tree) if isinstance(node, ast.Dict) for key in node.keys]
        assert not names & {key.value for key in keys if isinstance(key, ast.Constant)}, part
    assert found == USERS | {"__init__.py"}


# Geometry


@pytest.mark.parametrize("primitive", FINITE, ids=named)
def test_places_of_rows_are_its_points(primitive):
    u, v = np.random.default_rng(1).uniform(0, 0.5, (2, 20))
    u[:3], v[:3] = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    rows = np.tile(row_of(primitive), (len(u), 1))
    np.testing.assert_allclose(primitive.row_places(rows, u[:, None], v[:, None]), on(primitive, u, v), atol=1e-14)


@pytest.mark.parametrize("primitive", FINITE, ids=named)
def test_measures_are_integrals(primitive):
    _, shares = cells(primitive)
    assert primitive.measure == pytest.approx(shares.sum(), rel=1e-6)
    assert primitive.row_measure(row_of(primitive)[None])[0] == pytest.approx(primitive.measure, rel=1e-14)
    rows = np.tile(row_of(primitive), (2, 3, 1)) if primitive.distance is not None else None
    if rows is not None:
        assert primitive.row_measure(rows).shape == (2, 3)


@pytest.mark.parametrize("primitive", FINITE, ids=named)
def test_boxes_hold_it(primitive):
    points, _ = cells(primitive)
    ends = on(primitive, np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    # An arc's box is that of its whole circle, a face's holds the solid's centre, but not its row's.
    whole = cells(dataclasses.replace(primitive, angle=math.tau))[0] if hasattr(primitive, "angle") else points
    held = np.vstack([points, primitive.center]) if hasattr(primitive, "reach") else whole
    row_box = [sides[0] for sides in primitive.row_box(row_of(primitive)[None])]
    for (low, high), tight in ((primitive.box, held), (row_box, whole)):
        for inner in (points, ends):
            assert (inner >= low - 1e-14).all()
            assert (inner <= high + 1e-14).all()
        np.testing.assert_allclose(tight.min(axis=0), low, atol=5e-3)
        np.testing.assert_allclose(tight.max(axis=0), high, atol=5e-3)


@pytest.mark.parametrize("primitive", FINITE, ids=named)
def test_straight_round_and_cornered_ones_are_so(primitive):
    points, _ = cells(primitive)
    row = row_of(primitive)
    spread = np.linalg.svd(points - points[0], compute_uv=False) > 1e-9
    surface = min(primitive.dimension, 2)
    assert primitive.straight == (surface > 0 and spread.sum() == surface)
    away = np.linalg.norm(points - row[CENTER], axis=1)
    assert primitive.round == (np.ptp(away) < 1e-12 and surface > 0)
    if primitive.round:
        np.testing.assert_allclose(away, row[RADIUS], rtol=1e-14)
    else:
        used = row[POSITIONS].reshape(3, 3)[: primitive.corners]
        together, wanted = (np.vstack([some.T, np.ones(len(some))]) for some in (used, points))
        weights, *_ = np.linalg.lstsq(together, wanted)
        np.testing.assert_allclose(together @ weights, wanted, atol=1e-12)
        assert (weights > -1e-12).all()


@pytest.mark.parametrize("primitive", EXAMPLES, ids=named)
def test_no_more_than_nearby_lies_within_a_ball(primitive):
    if primitive.endless:
        assert primitive.nearby == math.pi
        return
    if not primitive.uniform or primitive.dimension == 3:
        return
    points, shares = cells(primitive)
    greatest = 0.0
    for size in (0.05, 0.3, 0.71, 3.0):
        for center in np.vstack([around(primitive, 30, 0.01), np.atleast_2d(row_of(primitive)[CENTER])]):
            inside = shares[np.linalg.norm(points - center, axis=1) <= size].sum()
            assert inside <= 1.01 * primitive.nearby * size**primitive.dimension + 1e-3
            greatest = max(greatest, inside / size**primitive.dimension)
    # What is declared of arcs is so of whole turns.
    assert greatest > (0.3 if hasattr(primitive, "angle") else 0.95) * primitive.nearby


@pytest.mark.parametrize("primitive", EXAMPLES, ids=named)
def test_rows_scale_by_their_units(primitive):
    lengths = {*primitive.points, "radius", "reach"} & {field.name for field in dataclasses.fields(primitive)}
    grown = {name: tuple(2.0 * np.array(getattr(primitive, name))) if name in primitive.points else
             2.0 * getattr(primitive, name) for name in lengths}  # fmt: skip
    packed, twice = (one.packed for one in (primitive, dataclasses.replace(primitive, **grown)))
    assert twice[ANGLE] == pytest.approx(packed[ANGLE] * 2.0**primitive.second_unit, rel=1e-14)


# Distance


@pytest.mark.parametrize("primitive", TOUCHED, ids=named)
def test_distances_are_those_to_the_nearest_point(primitive):
    rows = row_of(primitive)[None]
    for x in around(primitive, 60, 1.0):
        found = primitive.distance(*x.tolist(), rows, 0)
        if primitive.endless:
            exact = abs(np.dot(x - primitive.point, primitive.normal))
            assert found == pytest.approx(exact, rel=1e-12)
            continue
        points, _ = cells(primitive)
        nearest = np.linalg.norm(points - x, axis=1).min()
        assert nearest - 1e-2 <= found <= nearest + 1e-12
        # Where no sample happens to be nearest, the distance changes by no more than the point moves.
        assert abs(primitive.distance(*(x + 1e-4).tolist(), rows, 0) - found) <= 1.7321e-4


@pytest.mark.parametrize("primitive", TOUCHED, ids=named)
def test_the_first_foot_is_the_nearest_point_and_all_are_on_it(primitive):
    rows = row_of(primitive)[None]
    for x in around(primitive, 60, 1.0):
        feet = np.array([foot(*x.tolist(), rows, 0) for foot in primitive.feet])
        assert np.linalg.norm(feet[0] - x) == pytest.approx(primitive.distance(*x.tolist(), rows, 0), rel=1e-12)
        for foot in feet.tolist():
            assert primitive.distance(*foot, rows, 0) <= 1e-12


@pytest.mark.parametrize("primitive", [one for one in TOUCHED if one.round and row_of(one)[ANGLE] < 6.28], ids=named)
def test_every_nearest_point_of_a_curve_begins_at_a_foot(primitive):
    """Walking down from the feet finds all points of an arc that are nearer than those around them."""
    rows = row_of(primitive)[None]
    places, u = np.linspace(0.0, 1.0, 20_001), np.zeros((20_001, 1))
    curve = primitive.row_places(np.repeat(rows, 20_001, axis=0), places[:, None], u)
    for x in around(primitive, 200, 2.0 * rows[0, RADIUS]):
        away = np.linalg.norm(curve - x, axis=1)
        beside = np.concatenate([[np.inf], away, [np.inf]])
        least = curve[(away < beside[:-2]) & (away < beside[2:])]
        feet = np.array([foot(*x.tolist(), rows, 0) for foot in primitive.feet])
        for point in least:
            assert np.linalg.norm(feet - point, axis=1).min() <= 2e-3 * rows[0, RADIUS]


@pytest.mark.parametrize("primitive", TOUCHED, ids=named)
def test_the_middle_is_on_it_and_beside_is_beside(primitive):
    rows = row_of(primitive)[None]
    middle = primitive.row_middle(rows[0])
    third = np.full(1, 1 / 3)
    expected = (
        primitive.point
        if primitive.endless
        else on(primitive, *((third, third) if primitive.corners == 3 else (np.full(1, 0.5), third)))[0]
    )
    np.testing.assert_allclose(middle, expected, atol=1e-14)
    assert primitive.distance(*map(float, middle), rows, 0) == pytest.approx(0.0, abs=1e-14)
    for radius in (1e-3, 0.3, 20.0):
        beside = primitive.beside(radius)
        assert np.linalg.norm(beside - middle) == pytest.approx(radius, rel=1e-12)
        assert primitive.distance(*map(float, beside), rows, 0) == pytest.approx(radius, rel=1e-12)


# Mass points


@pytest.mark.parametrize("primitive", FINITE, ids=named)
def test_mass_points_have_its_moments(primitive):
    samples, shares = cells(primitive)
    shares = shares / shares.sum()
    if primitive.dimension == 3:
        # The centroid of a cone is three quarters of the way out, and so on.
        out = samples - primitive.center
        centroid = np.array(primitive.center) + 0.75 * shares @ out
        second = 0.6 * np.einsum("n,ni,nj->ij", shares, out, out)
        origin = np.array(primitive.center)
    else:
        centroid, origin = shares @ samples, np.zeros(3)
        second = np.einsum("n,ni,nj->ij", shares, samples, samples)
    for count in (24,) if primitive.round else (3, 6):
        points, weights = primitive.mass_points(count)
        assert weights.sum() == pytest.approx(1.0, rel=1e-14)
        assert (weights > 0.0).all()
        offset = points - origin
        np.testing.assert_allclose(weights @ points, centroid, atol=1e-5)
        np.testing.assert_allclose(np.einsum("n,ni,nj->ij", weights, offset, offset), second, atol=1e-5)
    # To rounding, however many there are.
    few, many = (primitive.mass_points(count) for count in ((24, 30) if primitive.round else (3, 8)))
    np.testing.assert_allclose(few[1] @ few[0], many[1] @ many[0], atol=1e-14)


@pytest.mark.parametrize("primitive", [p for p in TOUCHED if not p.endless], ids=named)
@pytest.mark.parametrize("clearance", [0.1, 0.5])
def test_so_many_mass_points_as_needed_give_the_pull(primitive, clearance):
    rows = row_of(primitive)[None]
    count = math.ceil(primitive.mass_points_needed(clearance, math.log(1e8)))
    points, weights = primitive.mass_points(max(count, 1))
    many, even = primitive.mass_points(min(8 * count, 400))
    for x in around(primitive, 200, 1.0):
        if primitive.distance(*x.tolist(), rows, 0) >= clearance:
            near, exact = (w @ (1.0 / np.linalg.norm(p - x, axis=1)) for p, w in ((points, weights), (many, even)))
            # The bound holds for the integrand's greatest value, not for its mean.
            assert near == pytest.approx(exact, rel=1e-6)


def test_no_mass_points_on_a_plane():
    plane = fs.Plane(A, NORMAL)
    for ask in (lambda: plane.measure, lambda: plane.mass_points(3), lambda: plane.mass_points_needed(0.1, 8.0)):
        with pytest.raises(fs.InputError, match="of infinite area, where no mass can be spread"):
            ask()


# Profiles


@pytest.mark.parametrize("primitive", EXAMPLES, ids=named)
def test_factors_are_no_less_than_those_of_profiles(primitive):
    rows = row_of(primitive)[None]
    u = np.linspace(0, 1, 777)
    greatest = np.abs(0.5 + 2.0 * u - 3.0 * u * u).max() if primitive.profiled else 1.0
    assert greatest <= np.max(primitive.row_factor(rows)) <= 1.25 * greatest
    assert (np.max(primitive.row_factor_bend(rows)) > 0.0) == primitive.profiled
    flat = dataclasses.replace(primitive, profile=fs.profile.constant(2.0)) if primitive.profiled else primitive
    assert np.max(flat.row_factor_bend(row_of(flat)[None])) < 1e-20
