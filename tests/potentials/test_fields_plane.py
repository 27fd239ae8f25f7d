"""Planes: derivatives in 40 digits, hard places."""

import jets
import mpmath as mp
import numpy as np
import pytest
import reference_cases

from fieldsim.errors import InputError
from fieldsim.potentials import registry
from fieldsim.potentials.kernels import Cauchy, Gaussian, InverseSquare, Metaball, Newtonian, Quartic, SoftObject
from fieldsim.potentials.primitives.plane import Plane

FORMULAS = [
    (Cauchy(1.7), lambda z: mp.pi / (mp.mpf(1.7) ** 2 * (1 + (mp.mpf(1.7) * z) ** 2))),
    (Gaussian(1.3), lambda z: mp.pi / mp.mpf(1.3) ** 2 * mp.exp(-((mp.mpf(1.3) * z) ** 2))),
    (Newtonian(0.25), lambda z: -2 * mp.pi * (mp.sqrt(z * z + mp.mpf(0.25) ** 2) - mp.mpf(0.25))),
    (InverseSquare(0.25), lambda z: -mp.pi * mp.log(z * z + mp.mpf(0.25) ** 2)),
    (Quartic(1.5), lambda z: tail(lambda u: (1 - u * u) ** 2, z, 1.5, [])),
    (SoftObject(1.5), lambda z: tail(lambda u: 1 - (22 * u**2 - 17 * u**4 + 4 * u**6) / mp.mpf(9), z, 1.5, [])),
    (Metaball(1.5), lambda z: tail(nishimura, z, 1.5, [mp.mpf(1) / 3])),
]


def tail(h, z, radius, breaks):
    u = abs(z) / mp.mpf(radius)
    if u >= 1:
        return mp.mpf(0)
    return 2 * mp.pi * mp.mpf(radius) ** 2 * mp.quad(lambda v: v * h(v), [u, *(b for b in breaks if b > u), 1])


def nishimura(u):
    return 1 - 3 * u * u if 3 * u <= 1 else mp.mpf(3) / 2 * (1 - u) ** 2


@pytest.mark.parametrize(("kernel", "formula"), FORMULAS, ids=lambda x: type(x).__name__)
def test_value_and_both_derivatives(kernel, formula):
    heights = [1e-9, 1e-3, 0.3, 0.51, 1.1, 1.49999]
    if not isinstance(kernel, Metaball | Quartic | SoftObject):
        heights += [40.0, 1e6]
    points = np.array([(7.0, -3.0, sign * z) for z in heights for sign in (1, -1)])
    rows = np.array([jets.row(kernel, Plane((0, 0, 0), (0, 0, 2)))] * len(points))
    f, g, hessian = jets.evaluate("numba", (type(kernel), Plane), points, rows)
    floor, width = jets.scale(kernel)
    for z, value, slope, bend in zip(points[:, 2], f, g[:, 2], hessian[:, 2, 2], strict=True):
        with mp.workdps(60):
            expected = [formula(mp.mpf(z)), *(mp.diff(formula, mp.mpf(z), n) for n in (1, 2))]
        for got, want, power in zip((value, slope, bend), expected, (0, 1, 2), strict=True):
            assert abs(got - want) <= 1e-12 * abs(want) + 2e-15 * floor / width**power
    assert not g[:, :2].any()
    assert not hessian[:, :2].any()


@pytest.mark.parametrize("kernel", [k for k, p in registry.FORMULAS if p is Plane], ids=lambda k: k.__name__)
def test_single_precision(kernel):
    cases = reference_cases.reference()[registry.FORMULAS[kernel, Plane]]
    kinds, planes, points = [c.kernel for c in cases], [c.primitive for c in cases], np.array([c.point for c in cases])
    rows = np.array([jets.row(k, p) for k, p in zip(kinds, planes, strict=True)]).astype(np.float32).astype(float)
    points = points.astype(np.float32).astype(float)
    expected = jets.evaluate("numba", (kernel, Plane), points, rows)
    result = jets.evaluate("warp32", (kernel, Plane), points, rows)
    floor, width = np.array([jets.scale(k) for k in kinds]).T
    # A height is a difference of coordinates: its rounding is no formula's doing.
    lost = 4 * np.finfo(np.float32).eps * np.linalg.norm(points - [p.point for p in planes], axis=1)
    norms = [np.linalg.norm(e.reshape(len(points), -1), axis=1) for e in expected]
    for power, (got, want) in enumerate(zip(result, expected, strict=True)):
        error = np.linalg.norm((got - want).reshape(len(points), -1), axis=1)
        slope = norms[min(power + 1, 2)] if power < 2 else 10 * norms[2] / np.maximum(lost, 0.01)
        assert (error <= 5e-6 * (norms[power] + 1 + floor / width**power) + lost * slope).all()


@pytest.mark.parametrize("softening", [0.0, 1e-200])
def test_on_an_unsoftened_plane_nothing_is_nan(softening):
    plane = Plane((1, 2, 3), (0, 0, 1))
    for kernel in (Newtonian(softening), InverseSquare(softening)):
        f, g, hessian = jets.evaluate("numba", (type(kernel), Plane), [(0, 0, 3)], [jets.row(kernel, plane)])
        assert not np.isnan([*f, *hessian.ravel()]).any()
        assert not g.any()
    assert f == np.inf or softening


def test_bad_planes():
    with pytest.raises(InputError, match=r"Plane: normal is \(0, 0, 0\)"):
        Plane((0, 0, 0), (0, 0, 0))
    with pytest.raises(InputError, match="infinite area"):
        _ = Plane((0, 0, 0), (0, 0, 1)).measure


@pytest.mark.parametrize(("single", "accepted"), [(False, 1e-13), (True, 5e-6)])
def test_a_tilted_plane_keeps_the_digits_of_small_heights(single, accepted):
    rng = np.random.default_rng(2)
    target, kind = ("warp32", np.float32) if single else ("warp64", np.float64)
    planes = [Plane(rng.normal(size=3), rng.normal(size=3)) for _ in range(40)]
    rows = np.array([jets.row(Cauchy(0.7), plane) for plane in planes]).astype(kind).astype(float)
    # The height is known to 2^-34 of the offset in single precision, to 2^-76 in double.
    heights = 10 ** rng.uniform(-4 if single else -9, -1, (40, 1))
    sideways = rng.normal(size=(40, 3))
    sideways -= np.sum(sideways * rows[:, 17:20], axis=1)[:, None] * rows[:, 17:20]
    points = (rows[:, 5:8] + sideways + heights * rows[:, 17:20]).astype(kind).astype(float)
    _, gradient, _ = jets.evaluate(target, (Cauchy, Plane), points, rows)
    for row, point, got in zip(rows, points, gradient, strict=True):
        with mp.workdps(40):
            z = mp.fsum(
                mp.mpf(n) * (mp.mpf(x) - mp.mpf(p)) for n, x, p in zip(row[17:20], point, row[5:8], strict=True)
            )
            slope = -2 * mp.pi * z / (1 + mp.mpf(row[1]) ** 2 * z * z) ** 2
            error = mp.norm(mp.matrix([g - slope * n for g, n in zip(got, row[17:20], strict=True)]))
            assert error <= accepted * abs(slope)
