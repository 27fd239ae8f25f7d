"""Every formula of the registry against what its kernel and its primitive declare: the law, summed over mass points.

A new kernel or primitive is tested here without a line written for it (a primitive needs a specimen).
"""

import math

import numpy as np
import pytest
import targets

import fieldsim as fs
from fieldsim.potentials import registry

# One of every primitive whose field is that of what is spread over it evenly, or by its density.
SPECIMENS = (
    fs.Point((0.1, -0.2, 0.3)),
    fs.Segment((-0.4, 0.1, 0.0), (0.5, 0.2, -0.3)),
    fs.Arc((0.1, 0.0, -0.1), (0.2, -0.3, 1.0), (1.0, 0.2, 0.0), 0.6, 2.2),
    fs.Circle((0.1, 0.0, -0.1), (0.2, -0.3, 1.0), 0.5),
    fs.Triangle((-0.4, -0.3, 0.0), (0.5, -0.2, 0.1), (0.0, 0.4, -0.2)),
    fs.TaperedSegment((-0.4, 0.1, 0.0), (0.5, 0.2, -0.3), 1.5, 0.5),
)
# What goes on for ever, what a factor multiplies that is no density, and what alone has no meaning.
OTHERS = {"Plane", "ProfiledSegment", "ProfiledArc", "Face"}
BY_CLASS = {type(specimen): specimen for specimen in SPECIMENS}
ENTRIES = [key for key in registry.FORMULAS if key[1] in BY_CLASS]
# Places at which all of a specimen is smooth to look at, for many nodes.
PLACES = np.array([(0.9, 0.8, 0.7), (-1.1, 0.2, 0.9), (0.2, -1.3, 0.5), (0.3, 0.4, 1.6)])
# Widths: a compact kernel is smooth on all of a specimen from everywhere; others are as wide as one.
WIDE, MIDDLING = 9.0, 0.8
# Of both sides; neither has any other error there: the rule for mass points has converged.
ROUNDING = 1e-13


def name(key):
    return f"{key[0].__name__}-{key[1].__name__}"


def summed(kernel, primitive, place, count=48):
    """(F, gradient, Hessian) at a place by the kernel's law on the primitive's mass points."""
    points, weights = primitive.mass_points(count)
    value, gradient, hessian = 0.0, np.zeros(3), np.zeros((3, 3))
    for point, weight in zip(np.atleast_2d(points), np.atleast_1d(weights) * primitive.measure, strict=True):
        away = place - point
        h, slope, bend = kernel.law(float(away @ away), kernel.width, 0.0, 1.0)
        value += weight * h
        gradient += weight * 2.0 * slope * away
        hessian += weight * (2.0 * slope * np.eye(3) + 4.0 * bend * np.outer(away, away))
    return value, gradient, hessian


def test_every_primitive_has_a_specimen_or_a_reason():
    assert {primitive.__name__ for _, primitive in registry.FORMULAS} == {c.__name__ for c in BY_CLASS} | OTHERS


@pytest.mark.parametrize("key", ENTRIES, ids=name)
def test_formulas_are_the_declared_law_on_the_declared_mass_points(key):
    kernel_type, primitive_type = key
    kernel = kernel_type(WIDE if kernel_type.compact else MIDDLING)
    primitive = BY_CLASS[primitive_type]
    kinds, rows = targets.rows_of([primitive] * len(PLACES), [kernel] * len(PLACES))
    jets = targets.jets("warp64", kinds, rows, PLACES)
    hessians = targets.hessians(jets)
    for k, place in enumerate(PLACES):
        value, gradient, hessian = summed(kernel, primitive, place)
        size = abs(value) / math.dist(place, (0.0, 0.0, 0.0)) ** np.arange(3)
        assert abs(jets[k, 0] - value) < ROUNDING * size[0]
        assert np.abs(jets[k, 1:4] - gradient).max() < ROUNDING * (size[1] + np.abs(gradient).max())
        assert np.abs(hessians[k] - hessian).max() < ROUNDING * (size[2] + np.abs(hessian).max())
