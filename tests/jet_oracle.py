"""Value, gradient and Hessian by 34-digit quadrature of the definition, sharing nothing with the package's formulas.

Panels of Gauss-Legendre nodes are halved until none is longer than its distance from the integrand's complex
singularities asks for; the edges of compact kernels are panel ends.
"""

import functools
import itertools

import mpmath as mp
import numpy as np

from fieldsim.potentials.primitives.plane import Plane
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment

DIGITS = 34
NODES = 24


def jet(kernel, primitive, point, pieces=8):
    """The ten numbers (mpf) of a kernel on a primitive at a point.

    pieces: the least number of an arc's panels; a Gaussian whose exponent falls by hundreds asks for more.
    """
    with mp.workdps(DIGITS):
        profile, edges, softening = _profile(type(kernel).__name__, mp.mpf(kernel.width))
        x = _vector(point)
        if isinstance(primitive, Point):
            return _terms(profile, _minus(x, _vector(primitive.position)))
        if isinstance(primitive, Segment):
            return _segment(profile, edges, softening, _vector(primitive.start), _vector(primitive.end), x)
        if isinstance(primitive, Plane):
            return _plane(kernel, profile, edges, primitive, x)
        return _arc(profile, edges, softening, primitive, x, pieces)


def _profile(name, w):
    """t = r^2 -> h and its derivatives by t; the radii where h has kinks; the distance of its poles from the line."""
    t2 = w * w
    if name == "Cauchy":
        return lambda t: ((u := 1 / (1 + t2 * t)) ** 2, -2 * t2 * u**3, 6 * t2**2 * u**4), [], 1 / w
    if name == "Gaussian":
        return lambda t: ((h := mp.exp(-t2 * t)), -t2 * h, t2**2 * h), [], mp.inf
    if name == "Newtonian":
        return lambda t: ((h := 1 / mp.sqrt(t + t2)), -(h**3) / 2, 3 * h**5 / 4), [], w
    if name == "InverseSquare":
        return lambda t: ((h := 1 / (t + t2)), -(h**2), 2 * h**3), [], w
    if name == "Metaball":
        return functools.partial(_metaball, w=w), [w / 3, w], mp.mpf(0)
    coefficients = {"Quartic": (1, 0), "SoftObject": (mp.mpf(5) / 9, mp.mpf(4) / 9)}[name]
    return functools.partial(_polynomial, t2=t2, coefficients=coefficients), [w], mp.inf


def _metaball(t, w):
    r = mp.sqrt(t)
    if r >= w:
        return mp.mpf(0), mp.mpf(0), mp.mpf(0)
    if 3 * r <= w:
        return 1 - 3 * t / w**2, -3 / w**2, mp.mpf(0)
    return 3 * (1 - r / w) ** 2 / 2, -3 / (2 * w) * (1 / r - 1 / w), 3 / (4 * w * r**3)


def _polynomial(t, t2, coefficients):
    a, b = coefficients
    w = 1 - t / t2
    if w <= 0:
        return mp.mpf(0), mp.mpf(0), mp.mpf(0)
    return a * w**2 + b * w**3, -(2 * a * w + 3 * b * w**2) / t2, (2 * a + 6 * b * w) / t2**2


def _plane(kernel, profile, edges, primitive, x):
    """F = pi times the integral of h over t = r^2 from z^2 on, or in its gauge; the derivatives are h itself."""
    name, w = type(kernel).__name__, mp.mpf(kernel.width)
    normal = _unit(_vector(primitive.normal))
    z = _dot(_minus(x, _vector(primitive.point)), normal)
    h, slope, _ = profile(z * z)
    if name == "Newtonian":
        f = -2 * mp.pi * (mp.sqrt(z * z + w * w) - w)
    elif name == "InverseSquare":
        f = -mp.pi * mp.log(z * z + w * w)
    elif name == "Gaussian":
        f = mp.pi * h / w**2
    elif name == "Cauchy":
        f = mp.pi / (w**2 * (1 + w**2 * z * z))
    else:
        ends = [z * z, *(r * r for r in edges if r * r > z * z)]
        f = mp.pi * mp.quad(lambda t: profile(t)[0], ends) if len(ends) > 1 else mp.mpf(0)
    # For the bare Newtonian kernel both terms cancel, exactly.
    bend = -2 * mp.pi * (w**2 * h**3 if name == "Newtonian" else h + 2 * z * z * slope)
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    return [f, *(-2 * mp.pi * z * h * n for n in normal), *(bend * normal[i] * normal[j] for i, j in pairs)]


def _segment(profile, edges, softening, a, b, x):
    axis = _minus(b, a)
    length = mp.sqrt(_dot(axis, axis))
    axis = [c / length for c in axis]
    q0 = _dot(_minus(x, a), axis)
    across = [s - q0 * c for s, c in zip(_minus(x, a), axis, strict=True)]
    rho2 = _dot(across, across)
    cuts = [q0 + sign * mp.sqrt(r * r - rho2) for r in edges if r * r > rho2 for sign in (-1, 1)]
    poles = []
    if softening < mp.inf:
        poles = [mp.mpc(q0, sign * mp.sqrt(rho2 + softening**2)) for sign in (-1, 1)]
    elif not edges:
        # A Gaussian: no poles, but nothing far from its foot.
        cuts += [q0 + k * length / 4 for k in range(-8, 9)]

    def integrand(q):
        return _terms(profile, [s + (q0 - q) * c for s, c in zip(across, axis, strict=True)])

    return _integral(integrand, length, cuts, poles)


def _arc(profile, edges, softening, primitive, x, pieces):
    row = np.zeros(20)
    primitive.pack(row)
    radius, normal, start = mp.mpf(row[2]), _unit(_vector(row[17:20])), _vector(row[14:17])
    start = _unit([s - _dot(start, normal) * n for s, n in zip(start, normal, strict=True)])
    binormal = [normal[i - 2] * start[i - 1] - normal[i - 1] * start[i - 2] for i in range(3)]
    angle = mp.mpf(row[3]) if row[3] < 2 * np.pi else 2 * mp.pi
    d = _minus(x, _vector(primitive.center))
    rho, z = mp.hypot(_dot(d, start), _dot(d, binormal)), _dot(d, normal)
    phi = mp.atan2(_dot(d, binormal), _dot(d, start))
    cuts, poles = [angle * k / pieces for k in range(1, pieces)], []
    if rho > 0:

        def cosine(r2):
            return (rho**2 + z**2 + radius**2 - r2) / (2 * rho * radius)

        turns = [phi + 2 * mp.pi * k for k in (-1, 0, 1, 2)]
        for edge in edges:
            if -1 < cosine(edge**2) < 1:
                cuts += [t + sign * mp.acos(cosine(edge**2)) for t in turns for sign in (-1, 1)]
        if softening < mp.inf:
            height = mp.acosh(max(mp.mpf(1), cosine(-(softening**2))))
            poles = [mp.mpc(t, sign * height) for t in turns for sign in (-1, 1)]

    def integrand(t):
        offset = zip(d, start, binormal, strict=True)
        offset = [c - radius * (mp.cos(t) * s + mp.sin(t) * b) for c, s, b in offset]
        return [radius * value for value in _terms(profile, offset)]

    return _integral(integrand, angle, cuts, poles)


def _integral(integrand, length, cuts, poles):
    ends = sorted({mp.mpf(0), length, *(c for c in cuts if 0 < c < length)})
    panels = list(itertools.pairwise(ends))
    total = [mp.mpf(0)] * 10
    while panels:
        low, high = panels.pop()
        middle, half = (low + high) / 2, (high - low) / 2
        if any(abs(middle - pole) < 2.2 * half for pole in poles) and half > mp.mpf(10) ** -28 * length:
            panels += [(low, middle), (middle, high)]
            continue
        if all(value == 0 for value in integrand(middle)):
            continue
        for node, weight in _nodes():
            values = integrand(middle + half * node)
            total = [t + half * weight * v for t, v in zip(total, values, strict=True)]
    return total


@functools.cache
def _nodes():
    """Gauss-Legendre nodes and weights on [-1, 1], by Newton's method on the three-term recurrence."""
    result = []
    for k in range(1, NODES + 1):
        r = mp.cos(mp.pi * (k - mp.mpf(1) / 4) / (NODES + mp.mpf(1) / 2))
        for _ in range(8):
            before, here = mp.mpf(1), r
            for j in range(2, NODES + 1):
                before, here = here, ((2 * j - 1) * r * here - (j - 1) * before) / j
            slope = NODES * (r * here - before) / (r * r - 1)
            r -= here / slope
        result.append((r, 2 / ((1 - r * r) * slope * slope)))
    return result


def _terms(profile, d):
    h, slope, bend = profile(_dot(d, d))
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    return [h, *(2 * slope * c for c in d), *((2 * slope if i == j else 0) + 4 * bend * d[i] * d[j] for i, j in pairs)]


def _vector(values):
    return [v if isinstance(v, mp.mpf) else mp.mpf(float(v)) for v in values]


def _dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def _minus(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


def _unit(a):
    return [x / mp.sqrt(_dot(a, a)) for x in a]
