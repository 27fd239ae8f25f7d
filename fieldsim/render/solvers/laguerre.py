"""Points under polynomial kernels: along a ray their field is a polynomial, solved exactly (Wyvill & Trotman 1990)."""

import functools

import warp as wp

from fieldsim.numerics.roots import Polynomial, product
from fieldsim.portable import Table, hole, portable, real
from fieldsim.potentials import registry
from fieldsim.potentials.kernels.polynomial import Polynomial as PolynomialKernel
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.row import KERNEL_WIDTH, STRENGTH
from fieldsim.render.scene.rows import point_of
from fieldsim.render.scene.tables import SceneTables
from fieldsim.render.solvers.polynomials import polynomial_sweep

SQUARE = hole()
CUBE = hole()
OVER = hole()


def known() -> list[tuple[type, type]]:
    """The kernels and primitives that it solves."""
    return [key for key in registry.FORMULAS if issubclass(key[0], PolynomialKernel) and key[1] is Point]


@portable
def _coefficients(x: real, y: real, z: real, rows: Table, i: int):
    return real(SQUARE), real(CUBE), real(OVER)


@functools.cache
def first_hit(kinds_used):
    """The Warp function that sweeps a ray through sorted intervals, for points under polynomial kernels."""
    kernels = {kind: formula.kernel for kind, formula in registry.formulas_of(kinds_used).items()}
    bound = {kind: _coefficients.bind(SQUARE=k.square, CUBE=k.cube, OVER=k.over) for kind, k in kernels.items()}
    # Whole numbers, which float32 holds.
    coefficients = registry.by_kind(bound).warp(wp.float32)

    @wp.func
    def piece(scene: SceneTables, o: wp.vec3, d: wp.vec3, begin: float, end: float, i: int, t0: float, t1: float):
        # w = 1 - r^2 / radius^2 is a parabola in u.
        from_center = o + begin * d - point_of(scene.rows, i)
        along = (end - begin) * d
        radius2 = wp.float64(scene.rows[i, KERNEL_WIDTH]) * wp.float64(scene.rows[i, KERNEL_WIDTH])
        w = Polynomial()
        w[0] = wp.float64(1.0) - _dot(from_center, from_center) / radius2
        w[1] = -wp.float64(2.0) * _dot(from_center, along) / radius2
        w[2] = -_dot(along, along) / radius2
        h = product(w, w)
        square, cube, over = coefficients(0.0, 0.0, 0.0, scene.rows, scene.kinds, i)
        factor = wp.float64(cube) * w
        factor[0] += wp.float64(square)
        h = product(h, factor) / wp.float64(over)
        return wp.float64(scene.rows[i, STRENGTH]) * h

    return polynomial_sweep(piece)


@wp.func
def _dot(a: wp.vec3, b: wp.vec3):
    return (
        wp.float64(a[0]) * wp.float64(b[0]) + wp.float64(a[1]) * wp.float64(b[1]) + wp.float64(a[2]) * wp.float64(b[2])
    )
