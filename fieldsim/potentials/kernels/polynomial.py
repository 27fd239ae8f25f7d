"""Kernels that are polynomials in w = 1 - r^2 / radius^2 within their radius."""

import dataclasses
import math
import typing

import numpy as np

from fieldsim.portable import Portable, hole, portable, real
from fieldsim.potentials.kernels.base import Compact

SQUARE = hole()
CUBE = hole()
OVER = hole()
profile = hole("w")


@portable
def _profile(w: real):
    """w^2 (SQUARE + CUBE w) / OVER and its first two derivatives, for w > 0."""
    if real(CUBE) == real(0.0):
        scale = real(SQUARE) / real(OVER)
        return w * w * scale, real(2.0) * scale * w, real(2.0) * scale
    return (
        w * w * (real(SQUARE) + real(CUBE) * w) / real(OVER),
        w * (real(2.0) * real(SQUARE) + real(3.0) * real(CUBE) * w) / real(OVER),
        (real(2.0) * real(SQUARE) + real(6.0) * real(CUBE) * w) / real(OVER),
    )


@portable
def _law(r2: real, radius: real, fold: real, times: real):
    w = real(1.0) - r2 / radius / radius
    if w <= real(0.0):
        return real(0.0), real(0.0), real(0.0)
    h, slope, bend = profile(w)
    return h, -slope / radius / radius, times / radius / radius * bend / radius / radius


@dataclasses.dataclass(frozen=True)
class Polynomial(Compact, abstract=True):
    """h = w^2 (square + cube w) / over with w = 1 - r^2 / radius^2, for w > 0; square, cube and over whole numbers.

    profile: portable (w) -> (h, dh/dw, d2h/dw2). Its law follows.
    """

    square: typing.ClassVar[int]
    cube: typing.ClassVar[int]
    over: typing.ClassVar[int]
    profile: typing.ClassVar[Portable]
    traits = ("square", "cube", "over", *Compact.traits)

    def __init_subclass__(cls, abstract: bool = False, **options):
        if all(isinstance(getattr(cls, name, None), int) for name in ("square", "cube", "over")):
            cls.profile = _profile.bind(SQUARE=cls.square, CUBE=cls.cube, OVER=cls.over)
            cls.law = _law.bind(profile=cls.profile)
        super().__init_subclass__(abstract=abstract, **options)

    @classmethod
    def inverse(cls, level: np.ndarray, radius: float) -> np.ndarray:
        """Where h falls to a level, by Newton's method in w, which from below only overshoots once."""
        level = np.minimum(level, 1.0)
        w = np.sqrt(level)
        for _ in range(8):
            miss = w * w * (cls.square + cls.cube * w) - cls.over * level
            w = w - miss / np.maximum(w * (2 * cls.square + 3 * cls.cube * w), 1e-300)
        return radius * np.sqrt(np.clip(1.0 - w, 0.0, 1.0))

    @classmethod
    def width_of(cls, radius: float, b: float) -> float:
        """Slope of log h at R that of the Gaussian: (1 - w)(2 square + 3 cube w) = b w (square + cube w)."""
        twice, bend = 2 * cls.square, 3 * cls.cube + cls.cube * b
        half = 0.5 * (cls.square * b + (twice - 3 * cls.cube))
        root = math.hypot(half, math.sqrt(twice * bend))
        # The root that does not cancel, for either sign of the middle coefficient.
        w = twice / (root + half) if half > 0.0 else (root - half) / bend
        return radius / math.sqrt(1.0 - w)

    @classmethod
    def coefficients(cls) -> tuple[float, float]:
        """Those of w^2 and of w^3."""
        return cls.square / cls.over, cls.cube / cls.over
