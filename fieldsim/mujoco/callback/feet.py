"""Feet of a point on elements, where searches for the nearest points of the surface begin; and the surface's weight."""

import math

from fieldsim.mujoco.callback.rows import REACH, WEIGHT
from fieldsim.portable import Indices, Portable, Table, hole, portable, real
from fieldsim.potentials import registry

foot_0 = hole("x, y, z, rows, kinds, i")
foot_1 = hole("x, y, z, rows, kinds, i")
foot_2 = hole("x, y, z, rows, kinds, i")
field = hole("x, y, z, rows, kinds, i")


@portable
def _foot(x: real, y: real, z: real, rows: Table, kinds: Indices, i: int, which: int):
    px, py, pz = foot_0(x, y, z, rows, kinds, i)
    if which == 1:
        px, py, pz = foot_1(x, y, z, rows, kinds, i)
    if which == 2:
        px, py, pz = foot_2(x, y, z, rows, kinds, i)
    dx = x - px
    dy = y - py
    dz = z - pz
    return px, py, pz, math.sqrt(dx * dx + dy * dy + dz * dz) - rows[i, REACH]


def foot_of(kinds: tuple[int, ...]) -> Portable:
    """Portable (x, y, z, rows, kinds, i, which) -> that one of the feet of element i, its distance minus the reach."""
    feet = {kind: formula.primitive.feet for kind, formula in registry.formulas_of(kinds).items()}
    chosen = [registry.by_kind({kind: one[min(k, len(one) - 1)] for kind, one in feet.items()}) for k in range(3)]
    return _foot.bind(**{f"foot_{k}": one for k, one in enumerate(chosen)})


@portable
def _weight(x: real, y: real, z: real, rows: Table, kinds: Indices, first: int, count: int):
    w = real(0.0)
    wx = real(0.0)
    wy = real(0.0)
    wz = real(0.0)
    for i in range(first, first + count):
        f, fx, fy, fz = field(x, y, z, rows, kinds, i)
        w += rows[i, WEIGHT] * f
        wx += rows[i, WEIGHT] * fx
        wy += rows[i, WEIGHT] * fy
        wz += rows[i, WEIGHT] * fz
    return w, wx, wy, wz


def weight_of(kinds: tuple[int, ...]) -> Portable:
    """Portable (x, y, z, rows, kinds, first, count) -> sum of WEIGHT times F, and its gradient."""
    return _weight.bind(field=registry.element_field(tuple(kinds)))
