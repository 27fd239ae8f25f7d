"""Sines, arctangents and integrals of the sine's powers against mpmath over log-uniform arguments, on every target."""

import functools
import math

import mpmath
import numpy as np
import on_targets
import pytest

from fieldsim.numerics.angles import arctangent, arctangent_and_rest, sine_cosine, turned
from fieldsim.numerics.sine_integrals import sine_powers, sine_sixth, sixth_power
from fieldsim.portable import portable, real

ACCEPTED = {
    "sine": (2, 2),
    "cosine": (2, 2),
    "arctangent": (3, 3),
    "rest": (3, 3),
    "sin2": (20, 20),
    "sin4": (60, 60),
    "sin6": (200, 200),
    "sixth_power": (3, 3),
}


@portable
def functions(x: real, y: real, angle: real):
    sin, cos = sine_cosine(x)
    _angle, rest = arctangent_and_rest(real(0.4) * abs(y), max(abs(x), abs(y)))
    sin2, sin4 = sine_powers(math.sin(angle), math.cos(angle), angle)
    sin6 = sine_sixth(math.sin(angle), math.cos(angle), sin4)
    return sin, cos, arctangent(y, x), rest, sin2, sin4, sin6, sixth_power(min(abs(y), real(1.0)))


def true(x, y, angle):
    with mpmath.workdps(80):
        x, y, angle = mpmath.mpf(x), mpmath.mpf(y), mpmath.mpf(angle)
        t = mpmath.mpf(0.4) * abs(y) / max(abs(x), abs(y))
        rest = (mpmath.atan(t) - t) / t**3
        phi = 2 * mpmath.atan(mpmath.sqrt(min(abs(y), 1)))
        sixth = 6 * _sine_integrals(phi)[2] / (mpmath.sin(phi) ** 6 * mpmath.tan(phi / 2))
        powers = _sine_integrals(angle)
        return on_targets.relative(mpmath.sin(x), mpmath.cos(x), mpmath.atan2(y, x), rest, *powers, sixth)


def _sine_integrals(angle):
    """Integrals of sin^2, sin^4 and sin^6 from 0."""
    s, c = mpmath.sin(angle), mpmath.cos(angle)
    sin2 = (angle - s * c) / 2
    sin4 = (3 * sin2 - s**3 * c) / 4
    return sin2, sin4, (5 * sin4 - s**5 * c) / 6


@functools.cache
def arguments():
    """x in -pi/2..pi/2, also close to 0 and to pi/2; y in 1e-6..1e3 of both signs; angle in 1e-4..pi."""
    rng = np.random.default_rng(14)
    near = 10 ** rng.uniform(-6, 0, 150)
    x = np.concatenate([rng.uniform(-1.57, 1.57, 100), near, math.pi / 2 - near]) * rng.choice([-1, 1], 400)
    y = 10 ** rng.uniform(-6, 3, 400) * rng.choice([-1, 1], 400)
    angle = np.concatenate([10 ** rng.uniform(-4, 0, 200), rng.uniform(0, math.pi, 200)])
    asked = on_targets.exactly_held(x, y, angle)
    return asked, [true(*column) for column in asked.T]


@pytest.mark.parametrize("target", on_targets.EPS)
def test_functions_meet_mpmath(target):
    on_targets.check(target, functions, *arguments(), ACCEPTED)


def test_every_digit_close_to_the_axes():
    rng = np.random.default_rng(14)
    near = 10 ** rng.uniform(-15, 0, 200)
    with mpmath.workdps(40):
        for x in [0.0, *near, *(math.pi / 2 - near)]:
            sin, cos = sine_cosine(float(x))
            assert abs(sin - mpmath.sin(x)) <= 4e-16 * abs(mpmath.sin(x))
            # Of pi/2 itself 1e-22 is left over.
            assert abs(cos - mpmath.cos(x)) <= 4e-16 * abs(mpmath.cos(x)) + 1e-22
        for y, x in zip(10 ** rng.uniform(-12, 3, 300), rng.normal(size=300), strict=True):
            exact = mpmath.atan2(y, x)
            assert abs(arctangent(float(y), float(x)) - exact) <= 6e-16 * exact


def test_special_angles():
    assert arctangent(0.0, 0.0) == arctangent(-0.0, 0.0) == 0.0
    assert arctangent(0.0, -2.0) == math.pi
    assert arctangent(-3.0, 0.0) == -math.pi / 2


def test_sums_of_angles_take_one_arctangent():
    rng = np.random.default_rng(1)
    for _ in range(20):
        angles = rng.uniform(-3.1, 3.1, 6)
        x, y, turns = 1.0, 0.0, 0.0
        for angle in angles:
            scale = rng.uniform(0.1, 10.0)
            x, y, turns = turned(x, y, turns, scale * math.cos(angle), scale * math.sin(angle))
        assert arctangent(y, x) + 2 * math.pi * turns == pytest.approx(angles.sum(), abs=1e-14)


@pytest.mark.parametrize("angle", [1e-9, 1e-3, 0.3, 0.523, 0.524, 1.0, 2.0, 3.1])
def test_sine_sixth(angle):
    with mpmath.workdps(30):
        exact = angle**7 * mpmath.quad(lambda t: (mpmath.sin(angle * t) / angle) ** 6, [0, 1])
    _, fourth = sine_powers(math.sin(angle), math.cos(angle), angle)
    assert abs(sine_sixth(math.sin(angle), math.cos(angle), fourth) / exact - 1) < 1e-15 * (1 + 50 * (angle > 0.5))
