"""Kernels of compact support on points, and their polynomials in w = 1 - r^2 / radius^2."""

import math

from fieldsim.portable import hole, portable, real
from fieldsim.potentials.formulas.point import point_jet
from fieldsim.potentials.kernels import Metaball, Quartic, SoftObject
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.registry import register


@portable
def quartic(w: real):
    """h, dh/dw, d2h/dw2 of the quartic kernel, h = w^2, inside its support."""
    return w * w, real(2.0) * w, real(2.0)


@portable
def soft_object(w: real):
    """h, dh/dw, d2h/dw2 of the soft object's kernel, h = w^2 (5 + 4 w) / 9, inside its support."""
    h = w * w * (real(5.0) + real(4.0) * w) / real(9.0)
    return h, w * (real(10.0) + real(12.0) * w) / real(9.0), (real(10.0) + real(24.0) * w) / real(9.0)


# The kernel as a polynomial in w = 1 - r^2 / radius^2, with its first two derivatives.
profile = hole("w")


@portable
def _polynomial_point(r2: real, radius: real, fold: real):
    share = r2 / radius / radius
    w = real(1.0) - share
    if w <= real(0.0):
        return real(0.0), real(0.0), real(0.0)
    h, slope, bend = profile(w)
    return h, -real(2.0) * slope / radius / radius, real(4.0) * share * bend / radius / radius


@portable
def metaball_point(r2: real, radius: real, fold: real):
    """h(r), h' / r and h'' - h' / r of the metaball."""
    u = math.sqrt(r2) / radius
    v = real(1.0) - u
    if v <= real(0.0):
        return real(0.0), real(0.0), real(0.0)
    scale = real(3.0) / radius / radius
    if real(3.0) * u <= real(1.0):
        return real(1.0) - real(3.0) * u * u, -real(2.0) * scale, real(0.0)
    return real(1.5) * v * v, -scale * v / u, scale / u


register(SoftObject, Point, point_jet.bind(kernel=_polynomial_point.bind(profile=soft_object)))
register(Quartic, Point, point_jet.bind(kernel=_polynomial_point.bind(profile=quartic)))
register(Metaball, Point, point_jet.bind(kernel=metaball_point))
