"""A triangle's field far away: 36 points of the definition, exact there to rounding."""

from fieldsim.portable import portable, real


@portable
def _abscissa(k: int):
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
def _radius(k: int):
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
def far_away(ax: real, ay: real, bx: real, by: real, cx: real, cy: real, z: real, area: real, k: real, fold: real):
    """Jet in the triangle's frame by the conical rule of 36 points, degree 11 (Stroud 1971)."""
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
    ring = int(0)  # noqa: UP018, RUF046 - a variable to Warp, where a bare 0 would be a constant
    place = int(0)  # noqa: UP018, RUF046
    for _ in range(36):  # one loop, which Warp does not unroll as it would two of 6
        s, weight = _radius(ring)
        t, share = _abscissa(place)
        place += 1
        if place == 6:
            place = 0
            ring += 1
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
