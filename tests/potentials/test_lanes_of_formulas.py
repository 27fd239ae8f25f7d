"""Every formula in lanes: against 50-digit quadrature, against Warp's scalar code, and where nothing is smooth.

Those of CHOSEN are compiled by default, one of each kind of loop and branch; the others with `--all`.
"""

import dataclasses

import numpy as np
import pytest
import reference_cases
import targets
from primitive_examples import EXAMPLES
from test_jets import JETS, hard_elements, hard_places, norms, random_cases, scales

from fieldsim.potentials import registry
from fieldsim.potentials.elements import pack
from fieldsim.potentials.primitives.face import Face

CHOSEN = {
    ("Newtonian", "Segment"), ("Gaussian", "Segment"), ("Quartic", "Segment"), ("Gaussian", "Arc"), ("Metaball", "Arc"),
    ("InverseSquare", "Triangle"), ("Metaball", "Triangle"), ("Newtonian", "Circle"),
}  # fmt: skip
SINGLE = {("Newtonian", "Arc"), ("Gaussian", "Triangle")}
# Parts of a field that are rounding: both compilers' functions and fused operations round differently, and the
# formulas' own conditioning is below 100.
AGREE, AGREE_SINGLE = 1e-13, 3e-5


def keys(chosen, among):
    """Registered pairs as parameters, those that are not chosen marked full."""
    return [
        pytest.param(key, id="-".join(names), marks=() if names in chosen else pytest.mark.full)
        for key in among
        for names in [(key[0].__name__, key[1].__name__)]
    ]


@pytest.mark.parametrize("key", keys(CHOSEN, [(f.kernel, f.primitive) for f in reference_cases.reference()]))
def test_a_formula_meets_reference(key):
    cases = reference_cases.reference()[registry.FORMULAS[key]]
    elements, points = (
        pack([c.primitive for c in cases], [c.kernel for c in cases], 1.0),
        np.array([c.point for c in cases]),
    )
    # Each lane a primitive of its own.
    value, gradient = targets.evaluate("lanes64", elements, points)
    check_reference(cases, value, gradient)
    # The same primitive in all lanes, once for each, the point among others.
    for k, case in enumerate(cases):
        one = dataclasses.replace(elements, rows=elements.rows[[k] * 11], kinds=elements.kinds[[k] * 11])
        value, gradient = targets.evaluate("lanes64", one, points[np.r_[k, :10]])
        check_reference([case], value[:1], gradient[:1])


def check_reference(cases, value, gradient):
    assert (np.abs(value - [c.value for c in cases]) <= [c.value_accepted for c in cases]).all()
    error = np.linalg.norm(gradient - [c.gradient for c in cases], axis=1)
    assert (error <= [c.gradient_accepted for c in cases]).all()


@pytest.mark.parametrize("key", keys(CHOSEN, JETS))
def test_lanes_and_scalar_code_agree(key):
    primitives, kernels, points = random_cases(key, 2000)
    kinds, rows = targets.rows_of(primitives, kernels)
    lanes, warp = (targets.jets(target, kinds, rows, points) for target in ("lanes64", "warp64"))
    accepted = AGREE * norms(warp) + 1e-14 * scales(primitives, kernels)
    assert (norms(lanes - warp)[:, :2] <= accepted[:, :2]).all()


@pytest.mark.parametrize("key", keys(CHOSEN, JETS))
def test_hard_places_have_no_nan(key):
    for primitive, kernel in hard_elements(key):
        points = hard_places(primitive, kernel.width if key[0].compact else 1.0)
        kinds, rows = targets.rows_of([primitive], [kernel])
        jets = targets.jets("lanes64", np.tile(kinds, len(points)), np.tile(rows, (len(points), 1)), points)
        assert not np.isnan(jets).any()
        # Only what is on a bare source is infinite, and only the value.
        if key[0].compact or kernel.width > 0.0:
            assert np.isfinite(jets).all()
        warp = targets.jets("warp64", np.tile(kinds, len(points)), np.tile(rows, (len(points), 1)), points)
        assert (np.isinf(jets) == np.isinf(warp)).all()


def by_example():
    """(key, primitive) of all that the registry has an example for."""
    return [(key, p) for key in registry.FORMULAS for p in EXAMPLES if type(p) is key[1]]


@pytest.mark.parametrize("target", ["lanes64", pytest.param("lanes32", marks=pytest.mark.full)])
@pytest.mark.parametrize("key", keys(CHOSEN, dict.fromkeys(key for key, _ in by_example())))
def test_value_gradient_and_hessian_are_those_of_scalar_code(key, target):
    compare(key, target)


@pytest.mark.parametrize("key", keys(SINGLE, dict.fromkeys(key for key, _ in by_example())))
def test_single_precision_is_that_of_scalar_code(key):
    compare(key, "lanes32")


def compare(key, target):
    rng = np.random.default_rng(3)
    points = rng.normal(size=(203, 3)) * 10.0 ** rng.uniform(-1, 1, (203, 1)) + (0.7, 0.1, -0.1)
    tolerance = AGREE if target == "lanes64" else AGREE_SINGLE
    for primitive in [p for other, p in by_example() if other == key]:
        # A solid takes no softening.
        for width in (0.0,) if isinstance(primitive, Face) else (0.4, 1.7):
            kinds, rows = targets.rows_of([primitive], [key[0](width)])
            rows, kinds = np.tile(rows, (len(points), 1)), np.tile(kinds, len(points))
            lanes, warp = (targets.jets(t, kinds, rows, points) for t in (target, target.replace("lanes", "warp")))
            top = np.abs(warp).max(axis=0) if key[0].compact else np.abs(warp)
            top = np.stack([top[..., 0], top[..., 1:4].max(axis=-1), top[..., 4:].max(axis=-1)], axis=-1)
            error = np.abs(lanes - warp)
            error = np.stack([error[:, 0], error[:, 1:4].max(axis=1), error[:, 4:].max(axis=1)], axis=1)
            assert (error <= tolerance * top + 1e-14 * (tolerance / AGREE)).all(), (error / top).max(axis=0)
