"""A triangle's field far away: so many points of the definition that the rest is rounding."""

from fieldsim.numerics.precision import is_single
from fieldsim.numerics.quadrature import (
    unit_jacobi_2,
    unit_jacobi_4,
    unit_jacobi_6,
    unit_legendre_2,
    unit_legendre_4,
    unit_legendre_6,
)
from fieldsim.portable import hole, portable, real

# In single precision 16 points do from so many sizes, from where the closed forms lose more by cancelling.
FAR_SINGLE = 3.0
# Beyond so many sizes (squared) 16 points do, and beyond so many 4.
FEWER = 24.0**2
FEWEST = 1500.0**2


@portable
def points_a_side(sizes2: real, far: real):
    """How many points a side `far_away` takes at a squared distance of `sizes2` squared sizes; 0 nearer than `far`."""
    if sizes2 > real(FEWEST):
        return 2
    if is_single():
        if sizes2 > real(FAR_SINGLE) * real(FAR_SINGLE):
            return 4
        return 0
    if sizes2 > real(FEWER):
        return 4
    if sizes2 > far * far:
        return 6
    return 0


# The kernel and its first two derivatives in r^2; nodes and weights of the rule, of count^2 points.
law = hole("r2, width, fold, times")
radius = hole("k")
abscissa = hole("k")
count = hole()


@portable
def _conical(ax: real, ay: real, bx: real, by: real, cx: real, cy: real, z: real, area: real, k: real, fold: real):
    """Jet in the triangle's frame by the conical rule of count^2 points, degree 2 count - 1 (Stroud 1971)."""
    f = real(0.0)
    fx = real(0.0)
    fy = real(0.0)
    level = real(0.0)
    bend = real(0.0)
    fxx = real(0.0)
    fyy = real(0.0)
    fxy = real(0.0)
    fxz = real(0.0)
    fyz = real(0.0)
    ring = int(0)  # noqa: UP018, RUF046 - a variable to Warp, which so unrolls only the inner loop
    while ring < count:
        s, share = radius(ring)
        ring += 1
        for place in range(count):
            t, weight = abscissa(place)
            weight *= share * area
            dx = -(ax + s * ((bx - ax) + t * (cx - bx)))
            dy = -(ay + s * ((by - ay) + t * (cy - by)))
            h, slope, curve = law(dx * dx + dy * dy + z * z, k, fold, real(1.0))
            f += weight * h
            slope *= real(2.0) * weight
            curve *= real(4.0) * weight
            fx += slope * dx
            fy += slope * dy
            level += slope
            bend += curve
            fxx += curve * dx * dx
            fyy += curve * dy * dy
            fxy += curve * dx * dy
            fxz += curve * dx
            fyz += curve * dy
    return f, fx, fy, level * z, fxx + level, fyy + level, bend * z * z + level, fxy, fxz * z, fyz * z


few = hole("ax, ay, bx, by, cx, cy, z, area, k, fold")
some = hole("ax, ay, bx, by, cx, cy, z, area, k, fold")
many = hole("ax, ay, bx, by, cx, cy, z, area, k, fold")


@portable
def _far_away(
    side: int,
    ax: real,
    ay: real,
    bx: real,
    by: real,
    cx: real,
    cy: real,
    z: real,
    area: real,
    k: real,
    fold: real,
):
    """Jet in the triangle's frame by side^2 points of the definition; side is 2, 4 or 6."""
    if side == 2:
        return few(ax, ay, bx, by, cx, cy, z, area, k, fold)
    if side == 4:
        return some(ax, ay, bx, by, cx, cy, z, area, k, fold)
    return many(ax, ay, bx, by, cx, cy, z, area, k, fold)


def far_away(law):
    """Portable (side, corners, z, area, k, fold) -> jet, for a kernel's law."""
    return _far_away.bind(
        few=_conical.bind(law=law, count=2, radius=unit_jacobi_2, abscissa=unit_legendre_2),
        some=_conical.bind(law=law, count=4, radius=unit_jacobi_4, abscissa=unit_legendre_4),
        many=_conical.bind(law=law, count=6, radius=unit_jacobi_6, abscissa=unit_legendre_6),
    )
