"""Every formula of the registry, on every target, against 50-digit quadrature of the definition."""

import dataclasses
import itertools

import numpy as np
import pytest
import reference_cases
import targets

from fieldsim.potentials import kernels, registry
from fieldsim.potentials.elements import pack
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.face import Face
from fieldsim.potentials.primitives.plane import Plane
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.profile import ProfiledArc, ProfiledSegment
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.primitives.tapered import TaperedSegment
from fieldsim.potentials.primitives.triangle import Triangle

REFERENCE = reference_cases.reference()


def leaves(base):
    """Classes below `base` that have none below them."""
    return [leaf for c in base.__subclasses__() for leaf in (leaves(c) or [c]) if c.__module__.startswith("fieldsim")]


def name(formula):
    return f"{formula.kernel.__name__}-{formula.primitive.__name__}"


def packed(cases):
    return pack([c.primitive for c in cases], [c.kernel for c in cases], 1.0), np.array([c.point for c in cases])


def errors(result, expected):
    return np.abs(result[0] - expected[0]), np.linalg.norm(result[1] - expected[1], axis=1)


@pytest.mark.parametrize("target", ["warp64", "numba"])
@pytest.mark.parametrize("formula", REFERENCE, ids=name)
def test_formula_meets_reference(formula, target):
    cases = REFERENCE[formula]
    expected = np.array([c.value for c in cases]), np.array([c.gradient for c in cases])
    value, gradient = errors(targets.evaluate(target, *packed(cases)), expected)
    assert (value <= [c.value_accepted for c in cases]).all()
    assert (gradient <= [c.gradient_accepted for c in cases]).all()


@pytest.mark.parametrize("formula", REFERENCE, ids=name)
def test_formula_in_single_precision(formula):
    cases = REFERENCE[formula]
    elements, points = packed(cases)
    # What rounding the question to float32 costs is not the formulas' doing: both answer the rounded question.
    elements = dataclasses.replace(elements, rows=elements.rows.astype(np.float32).astype(float))
    points = points.astype(np.float32).astype(float)
    expected = targets.evaluate("warp64", elements, points)
    value, gradient = errors(targets.evaluate("warp32", elements, points), expected)
    assert (value <= [c.value_accepted_single for c in cases]).all()
    assert (gradient <= [c.gradient_accepted_single for c in cases]).all()


def test_every_kernel_on_every_primitive_is_registered_and_in_the_reference():
    charted = (Arc, Circle, Plane, Point, Segment, Triangle)
    assert set(REFERENCE) == {registry.FORMULAS[key] for key in itertools.product(leaves(kernels.Kernel), charted)}
    # The others are made of these; their own tests hold them.
    others = {formula.primitive for formula in registry.FORMULAS.values()} - set(charted)
    assert others == {Face, ProfiledArc, ProfiledSegment, TaperedSegment}
