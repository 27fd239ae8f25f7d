"""The gate itself: values that hide what they are, have no end, or fail when they are asked."""

import decimal
import fractions
import itertools
import warnings

import numpy as np
import pytest

import fieldsim as fs
from fieldsim.validate import arrays

LOOP = []
LOOP.append(LOOP)


class Mute:
    """Fails whatever attribute is asked for."""

    def __getattr__(self, name):
        if name in ("__name__", "pytestmark"):  # of which pytest asks
            raise AttributeError(name)
        raise RuntimeError(name)


class Path:
    def __fspath__(self):
        raise RuntimeError("no path")


class Odd(list):
    def __iter__(self):
        raise KeyError("no items")


@pytest.mark.parametrize(
    ("item", "words"),
    [
        (True, "holds True"),
        (np.True_, "holds "),
        (np.datetime64("NaT"), "holds "),
        (np.datetime64("2020-01-01"), "holds "),
        (np.timedelta64(1, "s"), "holds "),
        (LOOP, "lists within lists"),
        (Mute(), "cannot be read as numbers"),
        (itertools.count(), r"count\(0\)"),
    ],
)
@pytest.mark.parametrize("kind", [list, tuple])
def test_one_item_of_a_vector_that_is_no_number(kind, item, words):
    with pytest.raises(fs.InputError, match=rf"Point: position .*{words}.*; give three numbers"):
        fs.Point(kind([0.0, 1.0, item]))


@pytest.mark.parametrize("value", [LOOP, Mute(), Odd([1.0, 2.0, 3.0]), [[[0.0]] * 2] * 2, range(10**12)])
def test_odd_values_end_in_one_kind_of_error(value):
    for call in (fs.Point, fs.Leapfrog, fs.timeline, fs.gravity(fs.Point((0, 0, 0)), mass=1.0).value):
        with pytest.raises(fs.InputError, match="; give"):
            call(value)


def test_lists_without_end_are_refused_by_their_size(monkeypatch):
    monkeypatch.setattr(arrays, "MOST_ITEMS", 1000)
    endless = (fs.Point((0, 0, 0)) for _ in itertools.count())
    with pytest.raises(fs.InputError, match="more than 1,000 items"):
        fs.gravity(endless, mass=1.0)
    with pytest.raises(fs.InputError, match="more than 1,000"):
        fs.Point(range(1001))


def test_one_number_seen_as_many_is_refused_before_memory_is_taken():
    many = np.broadcast_to(1.0, (10**6, 10**6))
    for call in (fs.Pose().apply, fs.Ground, fs.timeline):
        with pytest.raises(fs.InputError, match="; give"):
            call(many)
    with pytest.raises(fs.InputError, match="million pixels"):
        fs.ImageTexture(np.broadcast_to(0.5, (10**5, 10**5)))


def test_numbers_beyond_floats_are_refused_without_a_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for value in (np.longdouble("1e4000"), 10**5000):
            with pytest.raises(fs.InputError, match="; give"):
                fs.Leapfrog(value)


def test_paths_and_logs_that_fail_when_asked():
    with pytest.raises(fs.InputError, match="give the path of a file"):
        fs.Film(Path())
    with pytest.raises(fs.InputError, match="give the path of a file"):
        fs.mesh(Path(), [[0, 1, 2]])
    with pytest.raises(fs.InputError, match=r"give a fs\.EnergyLog"):
        fs.plots.energy(Mute())


def test_nothing_is_subtracted_from_a_number():
    field = fs.gravity(fs.Point((0, 0, 0)), mass=1.0)
    for other in (3.0, "x", np.ones(3)):
        with pytest.raises(fs.OperandError, match=r"give another fs\.Field"):
            _ = other - field


@pytest.mark.parametrize(
    "make",
    [
        lambda: fs.box((0, 0, 0), (1, 1, 1e308)),
        lambda: fs.polygon([(0, 0, 1), (0, 1, 0), (1, 0, 1e308)]),
        lambda: fs.rectangle((0, 0, 0), (0, 0, 1e308), (1, 0, 0)),
        lambda: fs.Triangle((0, 0, 0), (1e200, 0, 0), (0, 1e200, 0)),
        lambda: fs.bezier([(0, 0, 1), (0, 1, 0), (1, 0, 0), (1, 1, 1e308)], tolerance=0.1),
        lambda: fs.planets.knot(center=(0, 0, 1e308)),
    ],
)
def test_lengths_whose_powers_are_no_numbers_are_named_as_such(make):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(fs.InputError, match=r"at most 1e\+60"):
            make()


def _one_frame(beside, tmp_path):
    world = fs.World()
    world.add_shape(fs.Ball())
    scenario = fs.Scenario(world, fs.Camera((0, -5, 1)), duration=0.1, fps=10)
    return fs.film(scenario, tmp_path / "a.png", size=(4, 4), quality="draft", beside=beside)


@pytest.mark.parametrize("gives", [lambda size: size, lambda size: "x", lambda size: np.ones((4, 3))])
def test_what_stands_beside_a_film_is_checked(gives, tmp_path):
    with pytest.raises(fs.InputError, match="what beside gave"):
        _one_frame(gives, tmp_path)


def test_what_is_drawn_beside_a_film_is_checked(tmp_path):
    class Other:
        def frame(self, snapshot, camera):
            return np.zeros((3, 4, 3), np.uint8)

    with pytest.raises(fs.InputError, match=r"what beside drew has shape \(3, 4, 3\)"):
        _one_frame(lambda size: Other(), tmp_path)


@pytest.mark.parametrize("three", [3.0, np.float16(3), fractions.Fraction(3), decimal.Decimal(3), np.array(3.0)])
def test_whole_numbers_of_any_type_sample_the_same(three):
    for draw in (
        lambda n: fs.sampling.box(n, low=(0, 0, 0), high=(1, 1, 1), seed=n),
        lambda n: fs.sampling.orbits(n, radius=1, mass=1, seed=n),
        lambda n: fs.sampling.shell(n, radius=1, seed=n),
        lambda n: fs.sampling.cylinder(n, radius=1, height=(0, 1), seed=n),
    ):
        wanted, found = draw(3), draw(three)
        assert all(np.array_equal(wanted[name], found[name]) for name in wanted)


def test_boxes_of_points_without_height_or_without_end():
    flat = fs.sampling.box(2, low=(0.0, 0.0, 0.0), high=(1.0, 1.0, -0.0), seed=1)
    assert (flat["positions"][:, 2] == 0.0).all()
    with pytest.raises(fs.InputError, match=r"^box: low.*; give "):
        fs.sampling.box(2, low=(-1e308, 0, 0), high=(1e308, 1, 1), seed=1)


def test_a_figure_that_cannot_be_drawn_is_told_of(tmp_path):
    def draw(size):
        figure = fs.plots.figure(size)
        figure.suptitle(r"$\frac{1$")
        return figure

    pytest.importorskip("matplotlib")
    with pytest.raises(fs.InputError, match="Picture: what draw gave"):
        fs.Picture(draw).save(tmp_path / "a.png", (40, 40))
    assert not list(tmp_path.iterdir())
