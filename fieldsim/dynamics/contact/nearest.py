"""The nearest points of the surface F = 1 to a given one: Newton's method on the true field.

The point q is the nearest to c of all that lie around it on the surface where c - q is along the normal n, and where
1 + h k > 0 for both principal curvatures k (of a convex body positive) and the height h = (c - q) . n of c. In log F,
which is smooth and never steep, one step solves for both conditions together (Newton's method for the Lagrangian of
|q - c|^2 / 2 under log F = 0): it converges quadratically, from within the surface as from without. Along a direction
in which 1 + h k < 0 the step goes down all the same, away from the point that is the farthest along it.
"""

import math

from fieldsim.portable import portable, real

# No step along the surface is longer than this share of a radius of curvature.
LONGEST = 0.5
# 1 + h k counts as no less in size: on a medial axis it is 0.
FLATTEST = 1e-3
# After so many steps one that leads back over the last one is over a crease.
PATIENCE = 10


@portable
def beside(nx: real, ny: real, nz: real):
    """Two unit vectors across the unit vector n and each other, right-handed (Duff et al. 2017)."""
    sign = math.copysign(real(1.0), nz)
    a = real(-1.0) / (sign + nz)
    b = nx * ny * a
    return real(1.0) + sign * nx * nx * a, sign * b, -sign * nx, b, sign + ny * ny * a, -ny


@portable
def _between(ax: real, ay: real, az: real, bx: real, by: real, bz: real,
             xx: real, yy: real, zz: real, xy: real, xz: real, yz: real):  # fmt: skip
    """The product a . H b with the symmetric matrix H."""
    return ax * (xx * bx + xy * by + xz * bz) + ay * (xy * bx + yy * by + yz * bz) + az * (xz * bx + yz * by + zz * bz)


@portable
def _bends(f: real, fx: real, fy: real, fz: real,
           fxx: real, fyy: real, fzz: real, fxy: real, fxz: real, fyz: real):  # fmt: skip
    """Of the level surface of F > 0 through a point: normal, tangents a and b, curvatures, and |grad log F|.

    Returns (n, a, b) as nine numbers, the second fundamental form (aa, ab, bb), and the slope.
    """
    gradient = math.sqrt(fx * fx + fy * fy + fz * fz)
    # Divided, so that along an axis it is exactly 1.
    nx = -fx / gradient
    ny = -fy / gradient
    nz = -fz / gradient
    ax, ay, az, bx, by, bz = beside(nx, ny, nz)
    # Across the normal the Hessian of log F is that of F over F; over the slope it is minus the curvatures.
    back = real(-1.0) / gradient
    kaa = back * _between(ax, ay, az, ax, ay, az, fxx, fyy, fzz, fxy, fxz, fyz)
    kab = back * _between(ax, ay, az, bx, by, bz, fxx, fyy, fzz, fxy, fxz, fyz)
    kbb = back * _between(bx, by, bz, bx, by, bz, fxx, fyy, fzz, fxy, fxz, fyz)
    return nx, ny, nz, ax, ay, az, bx, by, bz, kaa, kab, kbb, gradient / f


@portable
def _principal(kaa: real, kab: real, kbb: real):
    """Cosine and sine of the first principal direction's angle from a, and the curvatures k1 >= k2."""
    half = real(0.5) * (kaa - kbb)
    radius = math.sqrt(half * half + kab * kab)
    middle = real(0.5) * (kaa + kbb)
    cosine = real(1.0)
    sine = real(0.0)
    if radius > real(0.0):
        if half >= real(0.0):
            cosine = math.sqrt(real(0.5) * (real(1.0) + half / radius))
            sine = real(0.5) * kab / (radius * cosine)
        else:
            sine = math.copysign(math.sqrt(real(0.5) * (real(1.0) - half / radius)), kab)
            cosine = real(0.5) * kab / (radius * sine)
    return cosine, sine, middle + radius, middle - radius


@portable
def curvatures(f: real, fx: real, fy: real, fz: real,
               fxx: real, fyy: real, fzz: real, fxy: real, fxz: real, fyz: real):  # fmt: skip
    """Of the level surface of F > 0 through a point, from the jet there: how it lies and how it bends.

    Returns the unit normal (nx, ny, nz) outward from greater F, the unit principal directions (ax, ay, az) and
    (bx, by, bz) with their curvatures k1 >= k2, of a convex body positive, and |grad log F|. The gradient must not be
    0.
    """
    nx, ny, nz, ax, ay, az, bx, by, bz, kaa, kab, kbb, slope = _bends(f, fx, fy, fz, fxx, fyy, fzz, fxy, fxz, fyz)
    cosine, sine, k1, k2 = _principal(kaa, kab, kbb)
    return (
        nx,
        ny,
        nz,
        cosine * ax + sine * bx,
        cosine * ay + sine * by,
        cosine * az + sine * bz,
        cosine * bx - sine * ax,
        cosine * by - sine * ay,
        cosine * bz - sine * az,
        k1,
        k2,
        slope,
    )


@portable
def _along(ra: real, rb: real, height: real, kaa: real, kab: real, kbb: real):
    """The step (ta, tb) along the surface for what is left (ra, rb), the least 1 + h k, its direction, and a radius.

    The direction (ea, eb) is right where 1 + h k < 0, and the radius is no greater than any of curvature.
    """
    maa = real(1.0) + height * kaa
    mab = height * kab
    mbb = real(1.0) + height * kbb
    trace = maa + mbb
    determinant = maa * mbb - mab * mab
    bend = math.sqrt(kaa * kaa + real(2.0) * (kab * kab) + kbb * kbb)
    if trace > real(0.0) and determinant > real(FLATTEST) * trace:
        # Both 1 + h k are well above 0: in most cases Newton's step is short enough, and no more needs to be known.
        ta = (mbb * ra - mab * rb) / determinant
        tb = (maa * rb - mab * ra) / determinant
        if (ta * ta + tb * tb) * (bend * bend) <= real(LONGEST) * real(LONGEST):
            return ta, tb, determinant / trace, real(1.0), real(0.0), real(1.0) / max(bend, real(1e-300))
    cosine, sine, k1, k2 = _principal(kaa, kab, kbb)
    m1 = real(1.0) + height * k1
    m2 = real(1.0) + height * k2
    t1 = (cosine * ra + sine * rb) / max(abs(m1), real(FLATTEST))
    t2 = (cosine * rb - sine * ra) / max(abs(m2), real(FLATTEST))
    if abs(t1 * k1) > real(LONGEST):
        t1 = math.copysign(real(LONGEST) / k1, t1)
    if abs(t2 * k2) > real(LONGEST):
        t2 = math.copysign(real(LONGEST) / k2, t2)
    ea = cosine
    eb = sine
    if m2 < m1:
        ea = -sine
        eb = cosine
    radius = real(1.0) / max(bend, real(1e-300))
    return cosine * t1 - sine * t2, sine * t1 + cosine * t2, min(m1, m2), ea, eb, radius


@portable
def nearest_step(ox: real, oy: real, oz: real, f: real, fx: real, fy: real, fz: real,
                 fxx: real, fyy: real, fzz: real, fxy: real, fxz: real, fyz: real, longest: real):  # fmt: skip
    """One step from a point q towards the nearest point of the surface to c, from the jet of F > 0 at q.

    o = c - q; longest: of a step along the normal. Returns the step (dx, dy, dz), the unit normal there (nx, ny, nz)
    outward from F > 1, to first order, the least 1 + h k (where that is above 0, a lower bound), the unit direction of
    its curvature (ex, ey, ez) where it is below, and a length no greater than any radius of curvature. The gradient
    must not be 0.
    """
    nx, ny, nz, ax, ay, az, bx, by, bz, kaa, kab, kbb, slope = _bends(f, fx, fy, fz, fxx, fyy, fzz, fxy, fxz, fyz)
    scale = real(1.0) / (f * slope)
    rise = min(max(math.log(f) / slope, -longest), longest)
    height = ox * nx + oy * ny + oz * nz
    # What is left of the offset along the surface, after the step along the normal.
    turned = height * rise * scale
    ra = turned * _between(ax, ay, az, nx, ny, nz, fxx, fyy, fzz, fxy, fxz, fyz) + (ox * ax + oy * ay + oz * az)
    rb = turned * _between(bx, by, bz, nx, ny, nz, fxx, fyy, fzz, fxy, fxz, fyz) + (ox * bx + oy * by + oz * bz)
    ta, tb, least, ea, eb, radius = _along(ra, rb, height, kaa, kab, kbb)
    dx = rise * nx + ta * ax + tb * bx
    dy = rise * ny + ta * ay + tb * by
    dz = rise * nz + ta * az + tb * bz
    # The normal turns with the gradient of log F.
    along = real(1.0) + slope * (nx * dx + ny * dy + nz * dz)
    ux = nx * along - scale * (fxx * dx + fxy * dy + fxz * dz)
    uy = ny * along - scale * (fxy * dx + fyy * dy + fyz * dz)
    uz = nz * along - scale * (fxz * dx + fyz * dy + fzz * dz)
    size = math.sqrt(ux * ux + uy * uy + uz * uz)
    return (
        dx,
        dy,
        dz,
        ux / size,
        uy / size,
        uz / size,
        least,
        ea * ax + eb * bx,
        ea * ay + eb * by,
        ea * az + eb * bz,
        radius,
    )


@portable
def normal_turn(ox: real, oy: real, oz: real, f: real, fx: real, fy: real, fz: real,
                fxx: real, fyy: real, fzz: real, fxy: real, fxz: real, fyz: real):  # fmt: skip
    """How the normal at the nearest point q turns as c moves: the symmetric matrix B of dn = B dc.

    o = c - q; the rest: the jet of F > 0 at q. Returns (xx, yy, zz, xy, xz, yz). With the height h = o . n of c the
    point moves by (1 - n n^T) dc - h B dc. On a medial axis, where 1 + h k = 0, B is not finite.
    """
    nx, ny, nz, ax, ay, az, bx, by, bz, kaa, kab, kbb, _slope = _bends(f, fx, fy, fz, fxx, fyy, fzz, fxy, fxz, fyz)
    height = ox * nx + oy * ny + oz * nz
    gauss = kaa * kbb - kab * kab
    determinant = real(1.0) + height * (kaa + kbb + height * gauss)
    # K (1 + h K)^-1 in the basis of the tangents.
    baa = (kaa + height * gauss) / determinant
    bab = kab / determinant
    bbb = (kbb + height * gauss) / determinant
    ux = baa * ax + bab * bx
    uy = baa * ay + bab * by
    uz = baa * az + bab * bz
    vx = bab * ax + bbb * bx
    vy = bab * ay + bbb * by
    vz = bab * az + bbb * bz
    return (
        ax * ux + bx * vx,
        ay * uy + by * vy,
        az * uz + bz * vz,
        ax * uy + bx * vy,
        ax * uz + bx * vz,
        ay * uz + by * vz,
    )


@portable
def shortened(size: real, before: real, back: real, most: real, share: real, done: int):
    """How long a step along the surface may be, and the share of its full length that this is: (most, share).

    Where the surface has a crease, as a profile with a kink makes one, steps lead from one side to the other and do not
    get shorter: each time they are halved. size: of the full step; before: of the full one before; back: their scalar
    product; most, share: of the one before, at first infinity and 1; done: steps so far.
    """
    if back < real(0.0):
        if done >= PATIENCE:
            most = real(0.5) * share * before
    elif size < real(0.5) * before:
        most = real(math.inf)
    share = real(1.0)
    if size > most:
        share = most / size
    return most, share
