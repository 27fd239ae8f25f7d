"""Feet of a point on elements, where searches for the nearest points of the surface begin; and the surface's weight."""

import math

from fieldsim.mujoco.callback.rows import REACH, WEIGHT
from fieldsim.portable import Indices, Portable, Table, hole, portable, real
from fieldsim.potentials import registry
from fieldsim.potentials.bounds.feet import foot_of

foot = hole("x, y, z, rows, kinds, i, which")
field = hole("x, y, z, rows, kinds, i")


@portable
def _near_foot(x: real, y: real, z: real, rows: Table, kinds: Indices, i: int, which: int):
    px, py, pz = foot(x, y, z, rows, kinds, i, which)
    dx = x - px
    dy = y - py
    dz = z - pz
    return px, py, pz, math.sqrt(dx * dx + dy * dy + dz * dz) - rows[i, REACH]


def near_foot_of(kinds: tuple[int, ...]) -> Portable:
    """Portable (x, y, z, rows, kinds, i, which) -> that one of the feet of element i, its distance minus the reach."""
    return _near_foot.bind(foot=foot_of(kinds))


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
