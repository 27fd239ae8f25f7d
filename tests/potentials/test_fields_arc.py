"""Arcs and circles where it is hard: on the axis, 1e-9 off the wire, in the gap, far away; shortest and nearly full."""

import dataclasses
import functools
import itertools
import math

import mpmath
import numpy as np
import pytest
import targets

from fieldsim.errors import InputError
from fieldsim.potentials.elements import pack
from fieldsim.potentials.kernels import Cauchy, Gaussian, Newtonian
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.primitives.circle import Circle

CENTER, NORMAL, START = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
KERNELS = {
    "cauchy": [Cauchy(0.2), Cauchy(1.5), Cauchy(20.0)],
    "gaussian": [Gaussian(0.2), Gaussian(1.5), Gaussian(8.0)],
    "newtonian": [Newtonian(0.0), Newtonian(0.05), Newtonian(1.0)],
}
ANGLES = [1e-6, 1e-3, 1.0, math.pi, 5.0, 2 * math.pi - 1e-3, 2 * math.pi - 1e-6]


@functools.cache
def rule():
    """Nodes and weights of 20-point Gauss-Legendre quadrature on -1..1."""
    nodes = [mpmath.findroot(lambda t: mpmath.legendre(20, t), x) for x in np.polynomial.legendre.leggauss(20)[0]]
    return [(t, 2 * (1 - t * t) / (20 * mpmath.legendre(19, t)) ** 2) for t in nodes]


def h_and_slope(kernel, d2):
    """h and dh/d(r^2) at squared distance d2."""
    width = mpmath.mpf(kernel.width)
    if isinstance(kernel, Cauchy):
        q = 1 / (1 + width**2 * d2)
        return q**2, -2 * width**2 * q**3
    if isinstance(kernel, Gaussian):
        h = mpmath.exp(-(width**2) * d2)
        return h, -(width**2) * h
    h = 1 / mpmath.sqrt(d2 + width**2)
    return h, -(h**3) / 2


def quadrature(kernel, angle, point):
    """F and its gradient of the arc of radius 1 about the origin, 30 digits, by panels that halve towards the query."""
    with mpmath.workdps(30):
        x, y, z = (mpmath.mpf(float(c)) for c in point)
        rho, phi, end = mpmath.hypot(x, y), mpmath.atan2(y, x), mpmath.mpf(angle)
        step, marks = mpmath.hypot(rho - 1, z), [end * k / 32 for k in range(33)]
        while step < 4:
            marks += [phi + k * 2 * mpmath.pi + sign * step for k in (-1, 0, 1) for sign in (-1, 0, 1)]
            step *= 2
        marks = sorted({m for m in marks if 0 <= m <= end})
        total = [mpmath.mpf(0)] * 4
        for left, right in itertools.pairwise(marks):
            for node, weight in rule():
                theta = (left + right) / 2 + (right - left) / 2 * node
                h, slope = h_and_slope(kernel, (rho - 1) ** 2 + z**2 + 4 * rho * mpmath.sin((theta - phi) / 2) ** 2)
                pull = 2 * slope
                terms = h, pull * (x - mpmath.cos(theta)), pull * (y - mpmath.sin(theta)), pull * z
                total = [t + (right - left) / 2 * weight * term for t, term in zip(total, terms, strict=True)]
        return float(total[0]), np.array([float(t) for t in total[1:]])


@dataclasses.dataclass
class Question:
    """One query: an arc of radius 1 in the plane z = 0 that starts on the x axis."""

    kernel: object
    angle: float
    point: np.ndarray

    @property
    def primitive(self):
        return Arc(CENTER, NORMAL, START, 1.0, self.angle)

    @property
    def distance(self):
        """Distance over which the field changes: from the arc's nearest point, blurred by the kernel's width."""
        x, y, _ = self.point
        phi = math.atan2(y, x) % (2 * math.pi)
        ends = [0.0, self.angle]
        theta = phi if phi < self.angle else min(ends, key=lambda t: 1 - math.cos(t - phi))
        distance = math.dist((math.cos(theta), math.sin(theta), 0.0), self.point)
        width = self.kernel.width if isinstance(self.kernel, Newtonian) else 1 / self.kernel.width
        return max(math.hypot(distance, width), 1e-30)


@functools.cache
def questions(family, count=42):
    """Random queries of every sort, with the quadrature's answers."""
    rng = np.random.default_rng([7, *map(ord, family)])
    result = []
    for index in range(count):
        angle = ANGLES[index % len(ANGLES)]
        kernel = KERNELS[family][rng.integers(3)]
        off = 10 ** rng.uniform(-9, 0)
        where = index // len(ANGLES) % 6
        if where == 0:  # exactly above or below the middle of the start, so that 1e-9 is 1e-9
            point = (1.0, 0.0, off)
        elif where == 1:  # beside the wire, at any azimuth, also in the gap
            turn, tilt = rng.uniform(0, 2 * math.pi, 2)
            rho = 1 + off * math.cos(tilt)
            point = (rho * math.cos(turn), rho * math.sin(turn), off * math.sin(tilt))
        elif where == 2:  # close to the axis, in the plane
            point = (off / 8 * math.cos(index), off / 8 * math.sin(index), 0.0)
        elif where == 3:  # on the wire's circle, just before the start
            gap = off * min(1.0, 2 * math.pi - angle) / 2
            point = (math.cos(gap), -math.sin(gap), 0.0)
        elif where == 4:
            point = tuple(rng.uniform(-1.5, 1.5, 3))
        else:
            point = tuple(rng.normal(size=3) * (3.0 if family == "gaussian" else 1e3))
        result.append((Question(kernel, angle, np.array(point)), *quadrature(kernel, angle, point)))
    return result


def asked(family):
    everything, values, gradients = zip(*questions(family), strict=True)
    elements = pack([q.primitive for q in everything], [q.kernel for q in everything], 1.0)
    assert (elements.order == np.arange(len(everything))).all()
    return everything, elements, np.array([q.point for q in everything]), np.array(values), np.array(gradients)


@pytest.mark.parametrize("family", KERNELS)
def test_arcs_meet_quadrature_in_hard_places(family):
    everything, elements, points, value, gradient = asked(family)
    norm = np.linalg.norm(gradient, axis=1)
    # Rounding of rho alone moves the query by 1e-16 of its size: that much of the next derivative is owed to everyone.
    blur = 4e-16 * np.linalg.norm(points, axis=1) / [q.distance for q in everything]
    floor = np.array([2e-15 * min(q.angle, 4 / q.kernel.a) if family == "gaussian" else 0.0 for q in everything])
    got_value, got_gradient = targets.evaluate("warp64", elements, points)
    accepted = (1e-12 + blur) * value + floor
    assert (np.abs(got_value - value) <= accepted).all()
    steep = np.array([1 / q.distance for q in everything])
    error = np.linalg.norm(got_gradient - gradient, axis=1)
    assert (error <= 1e-12 * norm + blur * (norm + value * steep) + floor * steep).all()


@pytest.mark.parametrize("family", KERNELS)
def test_targets_agree(family):
    _, elements, points, _, _ = asked(family)
    exact = targets.evaluate("warp64", elements, points)
    twin = targets.evaluate("numba", elements, points)
    np.testing.assert_allclose(twin[0], exact[0], rtol=1e-14, atol=1e-300)
    error = np.linalg.norm(twin[1] - exact[1], axis=1)
    assert (error <= 1e-12 * np.linalg.norm(exact[1], axis=1) + 1e-15 * exact[0]).all()


@pytest.mark.parametrize("family", KERNELS)
def test_single_precision(family):
    everything, elements, points, _, _ = asked(family)
    points = points.astype(np.float32).astype(float)
    elements = dataclasses.replace(elements, rows=elements.rows.astype(np.float32).astype(float))
    value, gradient = targets.evaluate("warp64", elements, points)
    single = targets.evaluate("warp32", elements, points)
    assert np.isfinite(single[0]).all()
    # As in double precision, with float32's rounding of rho.
    near = np.array([q.distance for q in everything])
    blur = 2e-7 * np.maximum(1, np.linalg.norm(points, axis=1)) / near
    usable = blur < 0.1
    assert usable.sum() > 25
    floor = np.array([5e-6 * min(q.angle, 4 / q.kernel.a) if family == "gaussian" else 0.0 for q in everything])
    accepted = (5e-6 + blur) * value + floor
    assert (np.abs(single[0] - value) <= accepted)[usable].all()
    error = np.linalg.norm(single[1] - gradient, axis=1)
    accepted = (5e-6 + blur) * (np.linalg.norm(gradient, axis=1) + value / near) + floor / near
    assert (error <= accepted)[usable].all()


def random_frames(rng, count):
    normals = rng.normal(size=(count, 3))
    starts = np.cross(normals, rng.normal(size=(count, 3)))
    return rng.normal(size=(count, 3)), normals, starts, 10 ** rng.uniform(-1, 1, count)


def every_kernel(count):
    kernels = [kernel for family in KERNELS.values() for kernel in family]
    return [kernels[index % len(kernels)] for index in range(count)]


def fields(primitives, kernels, points, target="warp64", folds=None):
    elements = pack(primitives, kernels, 1.0, folds)
    value, gradient = targets.evaluate(target, elements, np.asarray(points, dtype=float)[elements.order])
    back = np.argsort(elements.order)
    return value[back], gradient[back]


def test_two_halves_add_up():
    rng = np.random.default_rng(11)
    kernels = every_kernel(180)
    centers, normals, starts, radii = random_frames(rng, len(kernels))
    points = centers + radii[:, None] * rng.normal(size=(len(kernels), 3))
    parts = [[], [], []]
    for center, normal, start, radius in zip(centers, normals, starts, radii, strict=True):
        angle = rng.uniform(0.1, 2 * math.pi)
        cut = angle * rng.uniform(0.05, 0.95)
        n = normal / np.linalg.norm(normal)
        middle = math.cos(cut) * start + math.sin(cut) * np.cross(n, start)
        parts[0].append(Arc(center, normal, start, radius, angle))
        parts[1].append(Arc(center, normal, start, radius, cut))
        parts[2].append(Arc(center, normal, middle, radius, angle - cut))
    whole, first, second = (fields(part, kernels, points) for part in parts)
    # The second half's start is rounded, which a narrow Gaussian's tail magnifies.
    np.testing.assert_allclose(first[0] + second[0], whole[0], rtol=1e-12, atol=1e-40)
    scale = np.linalg.norm(whole[1], axis=1) + whole[0] / radii
    assert (np.linalg.norm(first[1] + second[1] - whole[1], axis=1) <= 1e-12 * scale + 1e-40).all()


@pytest.mark.parametrize("target", ["warp64", "warp32", "numba"])
def test_a_full_arc_is_a_circle(target):
    rng = np.random.default_rng(12)
    kernels = every_kernel(90)
    centers, normals, starts, radii = random_frames(rng, len(kernels))
    points = centers + radii[:, None] * rng.normal(size=(len(kernels), 3)) * 10 ** rng.uniform(-2, 1, (90, 1))
    frames = list(zip(centers, normals, starts, radii, strict=True))
    arcs = fields([Arc(c, n, s, r, 2 * math.pi) for c, n, s, r in frames], kernels, points, target)
    circles = fields([Circle(c, n, r) for c, n, s, r in frames], kernels, points, target)
    # The two take rho from the point in different ways; a narrow Gaussian's tail magnifies that rounding.
    eps = 1e-5 if target == "warp32" else 2e-14
    np.testing.assert_allclose(arcs[0], circles[0], rtol=eps, atol=1e-30)
    scale = np.linalg.norm(circles[1], axis=1) + circles[0] / radii
    assert (np.linalg.norm(arcs[1] - circles[1], axis=1) <= eps * scale + 1e-30).all()


@pytest.mark.parametrize("target", ["warp64", "warp32", "numba"])
def test_bare_wire_is_infinite_and_never_nan(target):
    on_arc, end, gap = (0.0, 1.0, 0.0), START, (0.0, -1.0, 0.0)
    shapes = [Circle(CENTER, NORMAL, 1.0)] + [Arc(CENTER, NORMAL, START, 1.0, 3.0)] * 3
    value, gradient = fields(shapes, [Newtonian()] * 4, [on_arc, on_arc, end, gap], target)
    assert (value[[0, 2]] == math.inf).all()
    assert (gradient[[0, 2]] == 0.0).all()
    # The frame's rounding may move a point off the wire by 1e-16 of the radius, never to NaN.
    assert value[1] > 10.0
    assert np.isfinite(gradient).all()
    assert 0 < value[3] < 10


@pytest.mark.parametrize(("target", "reach"), [("warp64", 12), ("warp32", 6), ("numba", 12)])
def test_no_overflow_at_any_distance_or_size(target, reach):
    rng = np.random.default_rng(13)
    count = 270
    kernels = every_kernel(count)
    sizes = 10 ** rng.uniform(-reach, reach, count)
    points = rng.normal(size=(count, 3)) * 10 ** rng.uniform(-reach, reach, (count, 1))
    angles = rng.choice([1e-6, 1.0, 4.0, 2 * math.pi], count)
    shapes = [Arc(CENTER, NORMAL, START, size, angle) for size, angle in zip(sizes, angles, strict=True)]
    shapes[::3] = [Circle(CENTER, NORMAL, size) for size in sizes[::3]]
    value, gradient = fields(shapes, kernels, points, target)
    assert np.isfinite(value).all()
    assert np.isfinite(gradient).all()
    assert (value >= 0).all()


@pytest.mark.parametrize("target", ["warp64", "warp32"])
def test_folded_exponent_survives_the_inside_of_a_hard_body(target):
    # Blobbiness -256: exp(256) on the wire; the tube's surface at distance 0.25 is where the field is h = 1 wide.
    a = 16 / 0.25
    shapes = [Circle(CENTER, NORMAL, 2.0), Arc(CENTER, NORMAL, START, 2.0, 3.0)] * 2
    points = [(0.0, 2.0, 0.0)] * 2 + [(0.0, 2.0, 0.25)] * 2
    value, gradient = fields(shapes, [Gaussian(a)] * 4, points, target, folds=256.0)
    assert np.isfinite(value).all()
    assert np.isfinite(gradient).all()
    assert (value[:2] > 1e20).all()
    # A line's field there is sqrt(pi) / a; the curved wire adds 1 / (16 (a R)^2) and less.
    np.testing.assert_allclose(value[2:], math.sqrt(math.pi) / a, rtol=1e-4)
    np.testing.assert_allclose(value[2], value[3], rtol=1e-5)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Circle(CENTER, NORMAL, 0), "Circle: radius is 0; give a number above 0"),
        (lambda: Circle(CENTER, CENTER, 1), "Circle: normal is \\(0, 0, 0\\); give a direction"),
        (lambda: Arc(CENTER, NORMAL, START, -1, 1), "Arc: radius is -1; give a number above 0"),
        (lambda: Arc(CENTER, NORMAL, START, 1, 0), "Arc: angle is 0; give a number above 0"),
        (lambda: Arc(CENTER, NORMAL, START, 1, 7), "Arc: angle is 7; give radians in \\(0, 2 pi\\]"),
        (lambda: Arc(CENTER, NORMAL, (0, 0, -2), 1, 1), "Arc: start .* is parallel to normal"),
    ],
)
def test_bad_arcs_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_arcs_are_normalised_measured_and_animated():
    arc = Arc(CENTER, (0, 0, 3), (2, 0, 5), 2.0, math.pi)
    assert arc.normal == NORMAL
    assert arc.start == START
    assert arc.measure == pytest.approx(2 * math.pi)
    assert Circle(CENTER, NORMAL, 2.0).measure == pytest.approx(4 * math.pi)
    growing = Circle(CENTER, NORMAL, lambda time: 1 + time)
    assert growing.animated
    assert growing.at(1.0) == Circle(CENTER, NORMAL, 2.0)
