"""What fast sums are made of: pieces in cells, cells that meet every other once, expansions that move exactly."""

import itertools

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.potentials.fast_summation import chebyshev, interactions, octree, translations
from fieldsim.potentials.fast_summation.crosses import crosses
from fieldsim.potentials.fast_summation.pieces import Pieces

CURVES = [
    fs.Segment((0.1, 0.2, -0.3), (1.0, 0.7, 0.4)),
    fs.TaperedSegment((0.1, 0.2, -0.3), (1.0, 0.7, 0.4), 2.0, 0.5),
    fs.Arc((0.1, 0, 0), (0.3, 0.2, 1.0), (1, 0, 0), 0.7, 4.0),
    fs.Circle((0.1, 0, 0), (0.3, 0.2, 1.0), 0.7),
]


def named(primitive):
    return type(primitive).__name__


@pytest.mark.parametrize("curve", CURVES, ids=named)
def test_parts_of_a_curve_make_it_up(curve):
    cuts = np.array([0.0, 0.13, 0.5, 0.9, 1.0])
    rows = np.tile(curve.packed, (len(cuts) - 1, 1))
    parts = curve.row_part(rows, cuts[:-1], cuts[1:])
    assert curve.part.row_measure(parts).sum() == pytest.approx(curve.measure, rel=1e-14)
    for place in (0.0, 0.3, 1.0):
        u = np.full((len(parts), 1), place)
        along = cuts[:-1] + place * np.diff(cuts)
        expected = curve.row_places(rows, along[:, None], along[:, None])
        np.testing.assert_allclose(curve.part.row_places(parts, u, u), expected, atol=1e-14)
    densities = curve.part.row_density(parts, np.full((len(parts), 1), 0.5))[:, 0] / np.diff(cuts)
    middles = curve.row_density(rows, 0.5 * (cuts[:-1] + cuts[1:])[:, None])[:, 0]
    np.testing.assert_allclose(densities, middles, rtol=1e-13)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("curve", CURVES, ids=named)
def test_curves_cross_planes_where_they_say(curve, axis):
    u = np.linspace(0.0, 1.0, 2001)[:, None]
    rows = np.tile(curve.packed, (len(u), 1))
    along = curve.row_places(rows, u, u)[:, axis]
    for share in (0.2, 0.7):
        plane = along.min() + share * np.ptp(along)
        sides = np.sign(along - plane)
        first = np.flatnonzero(sides[1:] != sides[:-1])[0]
        found = curve.row_crossing(rows[:1], axis, np.array([plane]), np.zeros(1), np.ones(1))
        assert u[first, 0] <= found[0] <= u[first + 1, 0]
        nowhere = curve.row_crossing(rows[:1], axis, np.array([plane]), found, found + 1e-3)
        assert np.isnan(nowhere[0])
    above = curve.row_crossing(rows[:1], axis, np.array([along.max() + 0.1]), np.zeros(1), np.ones(1))
    assert np.isnan(above[0])


def some_pieces(most=8):
    rng = np.random.default_rng(0)
    skeleton = [fs.Segment(p, p + 0.4 * rng.normal(size=3)) for p in rng.random((60, 3))]
    skeleton += [fs.Point(p) for p in rng.random((40, 3))] + CURVES[1:]
    field = fs.Field(skeleton, fs.Newtonian(), strength=rng.uniform(0.5, 1.0, len(skeleton)))
    return field, Pieces(field.elements, most)


def test_pieces_lie_in_their_cells_and_make_up_the_field():
    field, pieces = some_pieces()
    which, positions, _amounts = pieces.charges(np.full(len(pieces), 1.0), 20.0)
    for number, level in enumerate(pieces.tree.levels):
        half = 0.5 * pieces.tree.root.width * 0.5**number
        for cell in np.flatnonzero(level.leaves):
            inside = (which >= level.first[cell]) & (which < level.first[cell] + level.count[cell])
            middle = pieces.tree.root.centers(level.coordinates[cell], number)
            assert inside.any()
            assert (np.abs(positions[inside] - middle) <= half * (1.0 + 1e-5)).all()
    parts = fs.Field.of_elements(type(field.elements)(pieces.rows, pieces.kinds, np.arange(len(pieces))).grouped()[0])
    points = np.random.default_rng(1).random((30, 3))
    for one, other in zip(parts._evaluate(points, 2), field._evaluate(points, 2), strict=True):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-11 * np.abs(other).max())


def test_no_more_pieces_are_made_than_allowed(monkeypatch):
    monkeypatch.setattr("fieldsim.potentials.fast_summation.pieces.SHARE", 1)
    monkeypatch.setattr("fieldsim.potentials.fast_summation.pieces.SOME", 50)
    field, pieces = some_pieces()
    assert len(pieces) <= len(field.elements) + 50


def trees(seed, most=5):
    """Trees of clustered and of scattered items in one root."""
    rng = np.random.default_rng(seed)
    places = [
        np.concatenate([rng.random((80, 3)), 0.3 + 1e-3 * rng.normal(size=(60, 3)), np.tile([0.9, 0.1, 0.5], (9, 1))]),
        np.concatenate([rng.random((90, 3)), 0.31 + 1e-2 * rng.normal(size=(50, 3))]),
    ]
    root = octree.enclosing(np.zeros(3), np.ones(3))
    return places, [octree.built(root, len(p), lambda i, p=p: p[i], most, deepest=12) for p in places]


def test_cells_hold_their_items():
    places, found = trees(0)
    for place, tree in zip(places, found, strict=True):
        assert sorted(tree.order) == list(range(len(place)))
        for number, level in enumerate(tree.levels):
            half = 0.5 * tree.root.width * 0.5**number
            for cell in range(len(level)):
                own = place[tree.order[level.first[cell] : level.first[cell] + level.count[cell]]]
                assert (np.abs(own - tree.root.centers(level.coordinates[cell], number)) <= half).all()
                assert level.count[cell] <= 5 or not level.leaves[cell] or number == 12


def test_doubled_roots_hold_the_same_cells_and_what_lies_outside():
    place, (tree, _other) = trees(1)[0][0], trees(1)[1]
    outside = np.array([-7.3, 5.0, 0.2]), np.array([0.5, 40.0, 1.0])
    doubled = tree.below(octree.doublings(tree.root, *outside))
    for corner in outside:
        assert ((corner >= doubled.root.low) & (corner <= doubled.root.low + doubled.root.width)).all()
    shift = len(doubled.levels) - len(tree.levels)
    assert shift == 6
    for number, level in enumerate(tree.levels):
        np.testing.assert_array_equal(
            doubled.root.centers(doubled.levels[number + shift].coordinates, number + shift),
            tree.root.centers(level.coordinates, number),
        )
    assert place.shape[0] == doubled.levels[0].count[0]


@pytest.mark.parametrize("reach", [np.inf, 0.2])
@pytest.mark.parametrize("few", [0, 10**9])
def test_every_piece_acts_on_every_point_once(reach, few):
    (sources, targets), (one, other) = trees(2)
    found = interactions.interactions(one, other, reach, few)
    acts = np.zeros((len(sources), len(targets)), dtype=int)
    for number, pairs in enumerate(found.far):
        for a, b in zip(pairs.source, pairs.target, strict=True):
            acts[np.ix_(span(one, number, a), span(other, number, b))] += 1
            assert np.abs(one.levels[number].coordinates[a] - other.levels[number].coordinates[b]).max() in (2, 3)
    lists, begin, ranges = interactions.near_lists(one, other, found.near)
    for place, number in enumerate(lists):
        for first, end in ranges[begin[number] : begin[number + 1]]:
            acts[first:end, place] += 1
    assert acts.max() == 1
    distances = np.linalg.norm(sources[one.order][:, None] - targets[other.order][None], axis=-1)
    assert (acts[distances < reach] == 1).all()
    assert np.isfinite(reach) or any(len(pairs) for pairs in found.far) == (few == 0)


def span(tree, number, cell):
    level = tree.levels[number]
    return np.arange(level.first[cell], level.first[cell] + level.count[cell])


def test_the_basis_is_orthonormal_on_the_nodes_and_has_its_derivatives():
    order = 7
    matrix = chebyshev.from_values(order)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(order), atol=1e-14)
    x, step = np.linspace(-1.0, 1.0, 11), 1e-5
    value, slope, bend = chebyshev.basis_and_derivatives(x, order)
    before, after = chebyshev.basis(x - step, order), chebyshev.basis(x + step, order)
    np.testing.assert_allclose(slope, (after - before) / (2 * step), atol=1e-6)
    np.testing.assert_allclose(bend, (after - 2 * value + before) / step**2, atol=1e-3)


@pytest.mark.parametrize("octant", range(8))
def test_a_childs_moments_are_its_parents(octant):
    order, rng = 5, np.random.default_rng(octant)
    shift = octree.bits(np.array(octant)) - 0.5
    places = rng.uniform(-1.0, 1.0, (20, 3))

    def moments(x):
        one, two, three = (chebyshev.basis(x[:, k], order) for k in range(3))
        return np.einsum("na,nb,nc->abc", one, two, three)[None]

    raised = chebyshev.applied(moments(places), chebyshev.child(order, octant))
    np.testing.assert_allclose(raised, moments(0.5 * places + shift), atol=1e-12)


def test_crosses_give_a_kernel_to_the_error_asked_for():
    shift = np.array([4.0, 0.0, 2.0])
    left, right = crosses(lambda squares: squares**-0.5, shift, 6, 1e-8)
    points = chebyshev.grid(6)
    squares = ((points[:, None] + shift - points[None]) ** 2).sum(axis=-1)
    assert np.abs(left @ right.T - squares**-0.5).max() < 1e-7
    assert left.shape[1] < 90


@pytest.mark.parametrize("kernel", [fs.Newtonian(), fs.Cauchy(0.7)], ids=repr)
def test_translations_of_all_offsets_are_as_wrong_as_they_say(kernel):
    scaled = translations.Scaled(kernel, 1.0)
    rng = np.random.default_rng(3)
    x, y = rng.uniform(-1.0, 1.0, (2, 12, 3))
    for ring in translations.RINGS:
        made = translations.translations(scaled, ring, 1e-4)
        offsets = [t for t in itertools.product(range(-ring, ring + 1), repeat=3) if max(map(abs, t)) == ring]
        assert set(offsets) == set(made.before) == set(made.after)
        for offset in offsets:
            before, after = (np.concatenate(side[offset], axis=1) for side in (made.before, made.after))
            at_x, at_y = (made.projected(translations._products(p, made.order, (0, 0, 0))) for p in (x, y))
            found = at_x @ after @ before.T @ at_y.T
            away = x[:, None] + 2.0 * np.array(offset) - y[None]
            error = np.abs(found - scaled.values((away**2).sum(axis=-1))).max()
            assert error <= made.errors[tuple(sorted(map(abs, offset), reverse=True))][0]
            assert error < 1e-2
