"""Roots of polynomials, as Warp functions: of cubics between their ends, and of polynomials up to degree 6.

Laguerre's method with deflation finds all roots from any start (Adams 1967 for when to stop); each that counts is then
polished on the whole polynomial.
"""

import warp as wp

DEGREE = 6
Polynomial = wp.types.vector(length=DEGREE + 1, dtype=wp.float64)  # coefficients, of 1, u, u^2, ...
_DEGREE = wp.constant(DEGREE)
NOWHERE = wp.constant(wp.float64(9.0))  # the root of a polynomial that has none
_SLACK = wp.constant(wp.float64(1e-6))  # of a piece: roots so far beyond its ends count, or rounding could lose them
_REAL = wp.constant(wp.float64(1e-3))  # imaginary parts below this may be rounding, at a double root
_ROUNDING = wp.constant(wp.float64(1e-15))
_MOST = wp.constant(60)


@wp.func
def cubic_root(a: float, da: float, b: float, db: float):
    """A root in 0..1 of the cubic with values a < 0 <= b and slopes da, db at 0 and 1.

    Six of Newton's steps, each replaced by a bisection where it leaves the bracket, or rests. A guess for a search that
    goes on: the cubic there is mostly 0 to rounding, below 2 % of b - a nine times in ten, and never above 30 %.
    """
    c2 = 3.0 * (b - a) - 2.0 * da - db
    c3 = da + db - 2.0 * (b - a)
    low = float(0.0)  # noqa: UP018 - a variable to Warp, that a loop may change
    high = float(1.0)  # noqa: UP018
    u = a / (a - b)
    for _k in range(6):
        value = a + u * (da + u * (c2 + u * c3))
        slope = da + u * (2.0 * c2 + 3.0 * u * c3)
        if value < 0.0:
            low = u
        else:
            high = u
        if slope > 0.0:
            u -= value / slope
        if slope <= 0.0 or u <= low or u >= high:
            u = 0.5 * (low + high)
    return u


@wp.func
def product(a: Polynomial, b: Polynomial):
    """The product, of degree 6 at most."""
    c = Polynomial()
    for i in range(_DEGREE + 1):
        for j in range(_DEGREE + 1 - i):
            c[i + j] += a[i] * b[j]
    return c


@wp.func
def _times(a: wp.vec2d, b: wp.vec2d):
    """Product of complex numbers (re, im)."""
    return wp.vec2d(a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0])


@wp.func
def _over(a: wp.vec2d, b: wp.vec2d):
    """Quotient of complex numbers."""
    return _times(a, wp.vec2d(b[0], -b[1])) / wp.dot(b, b)


@wp.func
def _root_of(z: wp.vec2d):
    """Square root of a complex number."""
    half = wp.float64(0.5)
    size = wp.sqrt(half * (wp.length(z) + wp.abs(z[0])))
    if size == wp.float64(0.0):
        return z
    if z[0] >= wp.float64(0.0):
        return wp.vec2d(size, half * z[1] / size)
    return wp.vec2d(half * wp.abs(z[1]) / size, wp.copysign(size, z[1]))


@wp.func
def _laguerre(re: Polynomial, im: Polynomial, degree: int):
    """A root of a polynomial with complex coefficients."""
    x = wp.vec2d(wp.float64(0.5), wp.float64(0.0))
    n = wp.float64(degree)
    for k in range(_MOST):
        p = wp.vec2d(re[degree], im[degree])
        p1 = wp.vec2d(wp.float64(0.0), wp.float64(0.0))
        p2 = wp.vec2d(wp.float64(0.0), wp.float64(0.0))  # half the second derivative
        noise = wp.length(p)
        size = wp.length(x)
        for j in range(degree):
            i = degree - 1 - j
            p2 = _times(x, p2) + p1
            p1 = _times(x, p1) + p
            p = _times(x, p) + wp.vec2d(re[i], im[i])
            noise = wp.length(p) + size * noise
        if wp.length(p) <= _ROUNDING * noise:
            break
        g = _over(p1, p)
        g2 = _times(g, g)
        h = g2 - wp.float64(2.0) * _over(p2, p)
        root = _root_of((n - wp.float64(1.0)) * (n * h - g2))
        below = g + root
        if wp.dot(g, root) < wp.float64(0.0):
            below = g - root
        if wp.dot(below, below) == wp.float64(0.0):
            x += wp.vec2d(wp.float64(0.7), wp.float64(0.4))
            continue
        step = _over(wp.vec2d(n, wp.float64(0.0)), below)
        if k % 10 == 9:
            # Leave a cycle of iterates, should there be one.
            step *= wp.float64(0.6)
        x -= step
    return x


@wp.func
def _polished(p: Polynomial, x: wp.float64):
    """(A root of p near x by Newton's steps, the slope there)."""
    u = wp.float64(x)
    slope = wp.float64(0.0)
    for _k in range(4):
        value = wp.float64(0.0)
        slope = wp.float64(0.0)
        for j in range(_DEGREE + 1):
            slope = slope * u + value
            value = value * u + p[_DEGREE - j]
        if slope != wp.float64(0.0):
            u -= wp.clamp(value / slope, wp.float64(-0.01), wp.float64(0.01))
    return u, slope


@wp.func
def _highest(p: Polynomial):
    """The greatest Bezier control value on 0..1: p is nowhere above it."""
    highest = p[0]
    for k in range(1, _DEGREE + 1):
        value = wp.float64(0.0)
        share = wp.float64(1.0)  # binomial(k, j) / binomial(DEGREE, j)
        for j in range(k + 1):
            value += share * p[j]
            share *= wp.float64(k - j) / wp.float64(wp.max(_DEGREE - j, 1))
        highest = wp.max(highest, value)
    return highest


@wp.func
def first_rise(p: Polynomial):
    """The least u in 0..1 where p passes 0 upwards; greater than 1 for none."""
    greatest = wp.float64(0.0)
    for j in range(_DEGREE + 1):
        greatest = wp.max(greatest, wp.abs(p[j]))
    if _highest(p) < -_SLACK * greatest:
        return NOWHERE
    degree = int(_DEGREE)
    while degree > 0 and wp.abs(p[degree]) <= _ROUNDING * greatest:
        degree -= 1
    re = p
    im = Polynomial()
    first = wp.float64(NOWHERE)
    while degree > 0:
        x = _laguerre(re, im, degree)
        if wp.abs(x[1]) < _REAL and x[0] > wp.float64(-0.1) and x[0] < wp.float64(1.1):
            u, slope = _polished(p, x[0])
            if u >= -_SLACK and u <= wp.float64(1.0) + _SLACK and slope > wp.float64(0.0):
                first = wp.min(first, u)
        # Divide by u - x.
        carry = wp.vec2d(re[degree], im[degree])
        for j in range(degree):
            i = degree - 1 - j
            kept = wp.vec2d(re[i], im[i])
            re[i] = carry[0]
            im[i] = carry[1]
            carry = _times(x, carry) + kept
        degree -= 1
    return first
