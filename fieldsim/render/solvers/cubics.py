"""Cubics on 0..1, given by values and slopes at both ends: their maximum, and their root."""

# ruff: noqa: UP018 - float(0.0) makes a variable that Warp lets a loop change

import warp as wp

MARGIN = wp.constant(0.15)  # of log F; bounds the cubics' error where they decide to skip


@wp.func
def cubic(a: float, da: float, b: float, db: float, u: float):
    """Value at u of the cubic on 0..1 with values a, b and slopes da, db at the ends."""
    c2 = 3.0 * (b - a) - 2.0 * da - db
    c3 = da + db - 2.0 * (b - a)
    return a + u * (da + u * (c2 + u * c3))


@wp.func
def cubic_peak(a: float, da: float, b: float, db: float):
    """Where in 0..1 that cubic has its inner maximum; negative if it has none."""
    # Slope da + 2 c2 u + 3 c3 u^2; of its two roots, the maximum's, in the form that does not cancel.
    c2 = 3.0 * (b - a) - 2.0 * da - db
    c3 = da + db - 2.0 * (b - a)
    rest = c2 * c2 - 3.0 * c3 * da
    if rest <= 0.0:
        return -1.0
    root = wp.sqrt(rest)
    if c2 <= 0.0:
        return da / (root - c2)
    if c3 == 0.0:
        return -1.0
    return -(c2 + root) / (3.0 * c3)


@wp.func
def suspect(a: float, da: float, b: float, db: float):
    """Where in 0..1 that cubic, a, b < 0, has an inner maximum that may reach 0; 0 if it has none."""
    # Its Bezier control values bound a cubic.
    if wp.max(a + da / 3.0, b - db / 3.0) < -MARGIN:
        return 0.0
    u = cubic_peak(a, da, b, db)
    if u < 0.005 or u > 0.995 or cubic(a, da, b, db, u) < -MARGIN:
        return 0.0
    return u


@wp.func
def cubic_root(a: float, da: float, b: float, db: float):
    """A root in 0..1 of that cubic, a < 0 <= b: Newton's steps, safeguarded by bisection."""
    c2 = 3.0 * (b - a) - 2.0 * da - db
    c3 = da + db - 2.0 * (b - a)
    low = float(0.0)
    high = float(1.0)
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
