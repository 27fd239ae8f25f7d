"""A triangle's field far away: so many points of the definition that the rest is rounding."""

from fieldsim.numerics.precision import is_single
from fieldsim.portable import portable, real

# In single precision 16 points do from so many sizes, from where the closed forms lose more by cancelling.
FAR_SINGLE = 3.0
# Beyond so many sizes (squared) 16 points do, and beyond so many 4.
FEWER = 24.0**2
FEWEST = 1500.0**2


@portable
def _abscissa_6(k: int):
    """Gauss-Legendre node and weight k of 6 on 0..1."""
    if k == 0:
        return real(0.03376524289842399), real(0.08566224618958518)
    if k == 1:
        return real(0.16939530676686773), real(0.1803807865240693)
    if k == 2:
        return real(0.38069040695840156), real(0.23395696728634552)
    if k == 3:
        return real(0.6193095930415985), real(0.23395696728634552)
    if k == 4:
        return real(0.8306046932331322), real(0.1803807865240693)
    return real(0.966234757101576), real(0.08566224618958518)


@portable
def _radius_6(k: int):
    """Gauss-Jacobi node and weight k of 6 for the weight 2 s on 0..1."""
    if k == 0:
        return real(0.07305432868025888), real(0.017476603627219065)
    if k == 1:
        return real(0.2307661379699455), real(0.08791033110101795)
    if k == 2:
        return real(0.44132848122844986), real(0.19732230178131052)
    if k == 3:
        return real(0.6630153097188457), real(0.2815851075763979)
    if k == 4:
        return real(0.8519214003315158), real(0.27108499446303724)
    return real(0.9706835728402151), real(0.14462066145101737)


@portable
def _abscissa_4(k: int):
    """Gauss-Legendre node and weight k of 4 on 0..1."""
    if k == 0:
        return real(0.06943184420297371), real(0.17392742256872692)
    if k == 1:
        return real(0.33000947820757187), real(0.32607257743127305)
    if k == 2:
        return real(0.6699905217924281), real(0.32607257743127305)
    return real(0.9305681557970263), real(0.17392742256872692)


@portable
def _radius_4(k: int):
    """Gauss-Jacobi node and weight k of 4 for the weight 2 s on 0..1."""
    if k == 0:
        return real(0.13975986434378054), real(0.06236194190001616)
    if k == 1:
        return real(0.41640956763108317), real(0.2596950952164649)
    if k == 2:
        return real(0.7231569863618762), real(0.4069291360205427)
    return real(0.9428958038854823), real(0.27101382686297626)


@portable
def _abscissa_2(k: int):
    """Gauss-Legendre node and weight k of 2 on 0..1."""
    if k == 0:
        return real(0.2113248654051871), real(0.5)
    return real(0.7886751345948129), real(0.5)


@portable
def _radius_2(k: int):
    """Gauss-Jacobi node and weight k of 2 for the weight 2 s on 0..1."""
    if k == 0:
        return real(0.3550510257216822), real(0.36391723651204566)
    return real(0.8449489742783178), real(0.6360827634879543)


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
    while ring < count:  # noqa: F821 - bound below
        s, share = radius(ring)  # noqa: F821 - bound below
        ring += 1
        for place in range(count):  # noqa: F821
            t, weight = abscissa(place)  # noqa: F821 - bound below
            weight *= share * area
            dx = -(ax + s * ((bx - ax) + t * (cx - bx)))
            dy = -(ay + s * ((by - ay) + t * (cy - by)))
            h, slope, curve = point(dx * dx + dy * dy + z * z, k, fold)  # noqa: F821 - bound by the kernel
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
        return few(ax, ay, bx, by, cx, cy, z, area, k, fold)  # noqa: F821 - bound below
    if side == 4:
        return some(ax, ay, bx, by, cx, cy, z, area, k, fold)  # noqa: F821
    return many(ax, ay, bx, by, cx, cy, z, area, k, fold)  # noqa: F821


def far_away(point):
    """Portable (side, corners, z, area, k, fold) -> jet, for a kernel's `point`."""
    return _far_away.bind(
        few=_conical.bind(point=point, count=2, radius=_radius_2, abscissa=_abscissa_2),
        some=_conical.bind(point=point, count=4, radius=_radius_4, abscissa=_abscissa_4),
        many=_conical.bind(point=point, count=6, radius=_radius_6, abscissa=_abscissa_6),
    )
