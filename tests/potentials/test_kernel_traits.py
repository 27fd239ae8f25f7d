"""What kernels declare, held to their laws in many digits; laws as published; classes that lack a trait."""

import dataclasses
import itertools

import mpmath
import numpy as np
import pytest
from mpmath import mp, mpf

from fieldsim.errors import InputError
from fieldsim.portable import portable, real
from fieldsim.potentials import registry
from fieldsim.potentials.kernels.base import FINITE, Compact, Diverges, Kernel, PowerLaw, Whole
from fieldsim.potentials.kernels.cauchy import Cauchy
from fieldsim.potentials.kernels.gaussian import EXPONENT_LIMIT, Gaussian
from fieldsim.potentials.kernels.inverse_square import InverseSquare
from fieldsim.potentials.kernels.metaball import Metaball
from fieldsim.potentials.kernels.newtonian import Newtonian
from fieldsim.potentials.kernels.quartic import Quartic
from fieldsim.potentials.kernels.soft_object import SoftObject
from fieldsim.potentials.primitives import profile

KERNELS = registry.kernels()
FAMILIES = {family: [k for k in KERNELS if issubclass(k, family)] for family in (PowerLaw, Compact)}
WIDTHS = [0.03, 0.7, 1.0, 12.0]
LEVELS = [-0.4, -1.0, -4.0, -30.0]


def metaball(u):
    return 1 - 3 * u**2 if u <= mpf(1) / 3 else mpf(3) / 2 * (1 - u) ** 2


# h as published, within its support, as a function of (r, width).
PUBLISHED = {
    Cauchy: lambda r, s: 1 / (1 + s**2 * r**2) ** 2,
    Gaussian: lambda r, a: mp.exp(-(a**2) * r**2),
    Newtonian: lambda r, softening: 1 / mp.sqrt(r**2 + softening**2),
    InverseSquare: lambda r, softening: 1 / (r**2 + softening**2),
    Metaball: lambda r, radius: metaball(r / radius),
    SoftObject: lambda r, radius: 1 - (22 * (r / radius) ** 2 - 17 * (r / radius) ** 4 + 4 * (r / radius) ** 6) / 9,
    Quartic: lambda r, radius: (1 - (r / radius) ** 2) ** 2,
}
# Where a law has a kink: no derivative is asked for across it.
KINKS = {Metaball: [mpf(1) / 3]}

per_kernel = pytest.mark.parametrize("kernel", KERNELS, ids=lambda k: k.__name__)
per_width = pytest.mark.parametrize("width", WIDTHS)


@pytest.fixture(autouse=True)
def digits():
    with mpmath.workdps(40):
        yield


def unit(kernel, width):
    """The kernel's own length."""
    return 1.0 / width if kernel.reciprocal else width


def distances(kernel, width):
    shares = np.array([1e-9, 1e-3, 0.2, 0.33, 0.34, 0.7, 0.95, 0.999] + [3.0, 40.0] * (not kernel.compact))
    return unit(kernel, width) * shares


def published(kernel, width):
    return lambda r: PUBLISHED[kernel](mpf(r), mpf(width))


def test_every_kernel_is_held_to_what_is_published():
    assert set(KERNELS) == set(PUBLISHED)


@per_kernel
@per_width
def test_the_law_and_its_derivatives(kernel, width):
    h = published(kernel, width)
    for r in distances(kernel, width):
        expected = [
            mp.diff(lambda r2: h(mp.sqrt(r2)), mpf(r) ** 2, n, h=mpf(r) ** 2 * mpf(10) ** -12) for n in range(3)
        ]
        values = kernel.law(r * r, width, 0.0, 1.0)
        # Next to its end, what is left of 1 - u^2 has the rounding of 1.
        rounding = 1e-14 if kernel.compact else 4e-15
        rounding *= max(1.0, 2.0 * (kernel is Gaussian) * (width * r) ** 2)
        scale = [abs(e) for e in expected]
        if kernel.compact:
            floor = [1.0, 1.0 / width**2, 1.0 / width**4]
            scale = [max(s, 0.05 * f) for s, f in zip(scale, floor, strict=True)]
        for got, want, size in zip(values, expected, scale, strict=True):
            assert abs(got - want) <= rounding * size + 1e-300
        assert kernel.law(r * r, width, 0.0, r * r)[2] == pytest.approx(r * r * values[2], rel=1e-14)


@per_kernel
def test_nothing_is_left_beyond_the_end_and_nothing_nan_at_the_source(kernel):
    assert np.isfinite(kernel.law(0.0, 1.0, 0.0, 0.0)[1:]).all()
    if kernel.compact:
        assert kernel.law(1.0, 1.0, 0.0, 1.0) == kernel.law(25.0, 1.0, 0.0, 1.0) == (0.0, 0.0, 0.0)
        # It ends with its first derivative.
        value, slope, _bend = kernel.law((1.0 - 1e-8) ** 2, 1.0, 0.0, 1.0)
        assert abs(value) < 1e-14
        assert abs(slope) < 1e-6


@pytest.mark.parametrize("kernel", [Newtonian, InverseSquare])
def test_a_bare_source_is_infinite_and_pulls_nowhere(kernel):
    assert kernel.law(0.0, 0.0, 0.0, 0.0) == (np.inf, 0.0, 0.0)


def test_only_the_gaussian_folds():
    assert [k for k in KERNELS if k.folds] == [Gaussian]
    assert Gaussian.law(4.0, 3.0, 36.0, 1.0) == pytest.approx((1.0, -9.0, 81.0))
    assert Gaussian.law(0.0, 3.0, 256.0, 0.0)[0] == pytest.approx(np.exp(EXPONENT_LIMIT))


@per_kernel
@per_width
def test_the_inverse_of_the_law(kernel, width):
    r = distances(kernel, width)
    r = r[r > 0.1 * unit(kernel, width)]
    r = r[r < 5.0 * unit(kernel, width)]
    levels = np.array([kernel.law(x * x, width, 0.0, 0.0)[0] for x in r])
    assert kernel.inverse(levels, np.full(len(r), width)) == pytest.approx(r, rel=1e-13)


@per_kernel
def test_nowhere_above_its_greatest_level(kernel):
    top = kernel.law(0.0, 1.0, 0.0, 0.0)[0]
    assert kernel.inverse(np.array([1.5 * top, 1e3 * top]), np.ones(2)).tolist() == [0.0, 0.0]


@per_kernel
@pytest.mark.parametrize("blobbiness", LEVELS)
@pytest.mark.parametrize("radius", [0.05, 1.0, 30.0])
def test_the_width_is_the_documented_one(kernel, blobbiness, radius):
    b, width = -blobbiness, kernel.width_of(radius, -blobbiness)
    h = published(kernel, width)
    if kernel.compact:  # the Gaussian's slope of log h at R
        slope = mp.diff(lambda r: mp.log(h(r)), mpf(radius), h=mpf(radius) * mpf(10) ** -14)
        assert float(slope * radius) == pytest.approx(-2.0 * b, rel=1e-12)
    else:  # half its maximum where the Gaussian has that
        half = mpf(radius) * mp.sqrt(mp.log(2) / mpf(b))
        assert float(h(half) / h(0)) == pytest.approx(0.5, rel=1e-13)


def field_of_a_line(h, rho, end):
    return 2 * mp.quad(lambda q: h(mp.sqrt(q * q + rho * rho)), [0, rho, 4 * rho, end])


def field_of_a_plane(h, z, end):
    return 2 * mp.pi * mp.quad(lambda r: r * h(r), [z, 4 * z, 16 * z, end])


@per_kernel
@pytest.mark.parametrize(("trait", "whole"), [("line", field_of_a_line), ("plane", field_of_a_plane)])
def test_whole_lines_and_planes(kernel, trait, whole):
    declared, width = getattr(kernel, trait), 0.7
    h = published(kernel, width)
    if isinstance(declared, Diverges):
        # As the logarithm of the end at least.
        near, far = (whole(h, mpf(1), mpf(10) ** k) for k in (6, 12))
        assert far - near > 6
        return
    if declared is FINITE:
        assert kernel.compact
        return
    assert isinstance(declared, Whole)
    widths = np.array([width])
    factor = np.asarray(declared.factor(widths))[0]
    for rho in (0.4, 1.0, 2.5):
        value = whole(h, mpf(rho), mp.inf)
        assert declared.inverse(float(value) / np.array([factor]), widths)[0] == pytest.approx(rho, rel=1e-12)


@pytest.mark.parametrize("kernel", FAMILIES[PowerLaw], ids=lambda k: k.__name__)
def test_powers(kernel):
    width = 0.6
    softening, h = kernel.softening_of(width), published(kernel, width)
    ratio = (mpf(2) ** 2 + mpf(softening) ** 2) / (mpf(5) ** 2 + mpf(softening) ** 2)
    assert float(mp.log(h(5) / h(2)) / mp.log(ratio)) == pytest.approx(kernel.power / 2)
    # In units of length: a width in another unit changes h by that unit's power.
    scaled = published(kernel, width / 3 if kernel.reciprocal else width * 3)
    assert float(h(2) / scaled(6)) == pytest.approx(3.0**kernel.unit)


@pytest.mark.parametrize("kernel", [Newtonian, InverseSquare])
def test_the_slope_of_an_infinite_plane(kernel):
    # F' = -2 pi z h(z), whose greatest is looked for.
    h = published(kernel, 0.4)
    steepest = max(float(2 * mp.pi * z * h(z)) for z in np.geomspace(1e-3, 1e6, 4001))
    declared = kernel.plane.slope(1.0, 0.4)
    assert steepest <= declared * (1 + 1e-12)
    assert steepest >= declared * (1 - 1e-4)


def test_the_gaussians_bend():
    h = published(Gaussian, 1.3)
    assert float(-mp.diff(lambda r: mp.log(h(r)), mpf("0.7"), 2)) == pytest.approx(Gaussian.log_bend(1.3))


def greatest(function, kinks=()):
    """The greatest of a function of u in 0..1, by dense search, on either side of kinks and up to the ends."""
    ends = [mpf(0), *kinks, mpf(1)]
    tiny = mpf(10) ** -20
    places = []
    for a, b in itertools.pairwise(ends):
        places += [a + tiny, b - tiny, *(a + (b - a) * mpf(k) / 400 for k in range(1, 400))]
    near = max(places, key=function)
    left, right = max(near - mpf(1) / 400, tiny), min(near + mpf(1) / 400, 1 - tiny)
    inner = [x for x in (left + (right - left) * mpf(k) / 400 for k in range(401)) if all(x != y for y in kinks)]
    return max(map(function, [near, *inner]))


@pytest.mark.parametrize("kernel", FAMILIES[Compact], ids=lambda k: k.__name__)
def test_greatest_slopes_and_bends(kernel):
    h, kinks, step = published(kernel, 1), KINKS.get(kernel, ()), mpf(10) ** -25
    with mpmath.workdps(80):
        root = {n: lambda u, n=n: mp.diff(lambda x: mp.sqrt(h(x)), u, n, h=step) for n in (1, 2)}
        value = {n: lambda u, n=n: mp.diff(h, u, n, h=step) for n in (1, 2)}
        found = {
            "steepest": greatest(lambda u: -root[1](u), kinks),
            # Along a ray through the middle, and across one.
            "sharpest": max(greatest(lambda u: abs(value[2](u)), kinks), greatest(lambda u: -value[1](u) / u, kinks)),
            "root_bend": max(greatest(lambda u: -root[2](u), kinks), greatest(lambda u: -root[1](u) / u, kinks)),
        }
    for trait, most in found.items():
        declared = getattr(kernel, trait)
        assert declared >= float(most) * (1 - 1e-9)
        assert declared <= float(most) * 1.002


@pytest.mark.parametrize("kernel", FAMILIES[Compact], ids=lambda k: k.__name__)
def test_the_share_of_the_support_over_which_it_changes(kernel):
    # Of a Gaussian whose half maximum lies there, 1 / a is longer than that, by less than twice.
    half = kernel.inverse(np.array([0.5]), np.ones(1))[0]
    assert kernel.share <= half / np.sqrt(np.log(2.0)) <= 2.0 * kernel.share
    assert kernel.scale_of(3.0) == 3.0 * kernel.share


def test_what_profiles_may_exceed_their_probes_by():
    # Markov: |p'| <= 2 n^2 max|p| on 0..1, and half a step is left between probes.
    change = 2 * 12**2 * 0.5 * (profile._PROBES[1] - profile._PROBES[0])
    assert 1.0 / (1.0 - change) <= profile._BETWEEN


def test_short_reaches():
    assert [k for k in KERNELS if k(2.0).short_reach == np.inf] == FAMILIES[PowerLaw]
    assert Gaussian(4.0).short_reach == 0.25
    assert all(k(3.0).short_reach == 3.0 for k in FAMILIES[Compact])


# What fails when a class is defined.


@portable
def flat(r2: real, width: real, fold: real, times: real):
    """Nothing."""
    return real(0.0), real(0.0), real(0.0)


@portable
def short(r2: real, width: real):
    """Of too few arguments."""
    return real(0.0)


COMPLETE = {
    PowerLaw: dict(
        law=flat,
        inverse=staticmethod(lambda level, width: level),
        width_of=staticmethod(lambda radius, b: radius),
        line=Diverges(),
        plane=FINITE,
        power=2,
    ),
    Compact: dict(
        law=flat,
        inverse=staticmethod(lambda level, width: level),
        width_of=staticmethod(lambda radius, b: radius),
        steepest=1.0,
        sharpest=2,
        root_bend=3.0,
    ),
    Kernel: dict(
        law=flat,
        inverse=staticmethod(lambda level, width: level),
        width_of=staticmethod(lambda radius, b: radius),
        line=FINITE,
        plane=FINITE,
        log_bend=staticmethod(lambda width: 1.0),
        scale_of=staticmethod(lambda width: width),
    ),
}
CASES = [(family, trait) for family, traits in COMPLETE.items() for trait in traits]


@pytest.mark.parametrize("family", COMPLETE)
def test_a_class_that_declares_all(family):
    made = type("Odd", (family,), COMPLETE[family])
    assert not made.abstract
    assert made.unit == (2 if family is PowerLaw else 0)


@pytest.mark.parametrize(("family", "trait"), CASES)
def test_a_missing_trait_is_named_when_the_class_is_defined(family, trait):
    traits = {name: value for name, value in COMPLETE[family].items() if name != trait}
    # (A power of 0 is that of kernels that are none.)
    with pytest.raises(
        InputError, match=f"^Odd: the kernel declares no '{trait}'; give |^Odd: power is 0; give 1 or 2"
    ):
        type("Odd", (family,), traits)


@pytest.mark.parametrize(
    ("family", "trait", "wrong"),
    [
        (Compact, "law", short),
        (Compact, "law", lambda r2, width, fold, times: (0, 0, 0)),
        (Compact, "inverse", staticmethod(lambda level: level)),
        (Compact, "width_of", 3.0),
        (Compact, "steepest", "two"),
        (PowerLaw, "line", 1.0),
        (PowerLaw, "power", 1.5),
        (PowerLaw, "power", 3),
        (PowerLaw, "reciprocal", 1),
        (Kernel, "log_bend", 2.0),
    ],
)
def test_a_trait_of_a_wrong_shape_is_named_when_the_class_is_defined(family, trait, wrong):
    with pytest.raises(InputError, match=f"^Odd: {trait} is .*; give "):
        type("Odd", (family,), {**COMPLETE[family], trait: wrong})


def test_a_law_of_higher_power_has_a_height_of_its_own():
    assert type("Odd", (PowerLaw,), {**COMPLETE[PowerLaw], "power": 6, "reciprocal": True}).unit == 0


def test_families_are_no_kernels():
    for family in (Kernel, PowerLaw, Compact):
        assert family.abstract
        assert family not in KERNELS
    assert all(dataclasses.is_dataclass(k) and len(dataclasses.fields(k)) == 1 for k in KERNELS)
