"""Hessians of circles and arcs under the Cauchy, Gaussian and Newtonian kernels where it is hard, and identities."""

import math

import jet_oracle
import mpmath as mp
import numpy as np
import pytest
import targets

from fieldsim.potentials.kernels import Cauchy, Gaussian, InverseSquare, Metaball, Newtonian
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.primitives.circle import Circle

CENTER, NORMAL, START = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
KERNELS = [Newtonian(0.0), Newtonian(0.3), Cauchy(0.2), Cauchy(3.0), Gaussian(0.5), Gaussian(4.0)]
ANGLES = [1e-6, 1e-3, 1.0, math.pi, 5.0, 2 * math.pi - 1e-3, 2 * math.pi - 1e-6]
PLACES = ["wire", "gap", "before the start", "axis", "above the centre", "far", "far above", "anywhere"]


def norms(jets):
    """Norms (N, 3) of value, gradient and Hessian."""
    hessian = np.sqrt((jets[:, 4:7] ** 2).sum(axis=1) + 2.0 * (jets[:, 7:] ** 2).sum(axis=1))
    return np.stack([np.abs(jets[:, 0]), np.linalg.norm(jets[:, 1:4], axis=1), hessian], axis=1)


def unit(rng):
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def evaluate(primitives, kernels, points, target="warp64"):
    return targets.jets(target, *targets.rows_of(primitives, kernels), np.asarray(points))


def on_circle(turn):
    return np.array([math.cos(turn), math.sin(turn), 0.0])


def query(place, angle, rng):
    """A query of the arc in standard position."""
    off = 10 ** rng.uniform(-9, -1)
    if place == "wire":
        # The wire's own points are inexact but at the quarters.
        return on_circle(0.0) + np.array([0.0, 0.0, off]) if angle < 2 else np.array([0.0, 1.0 - off, off])
    if place == "gap":
        return on_circle(angle + (2 * math.pi - angle) * rng.uniform(0.2, 0.8)) + 1e-3 * off * unit(rng)
    if place == "before the start":
        # A circle has no start; a point on it up to rounding would have no defined distance.
        gap = 2 * math.pi - angle
        return on_circle(-min(1e-3, gap / 2) * rng.random()) + np.array([0.0, 0.0, 0.0 if gap else off])
    if place == "axis":
        return off * unit(rng) * [1.0, 1.0, 0.1]
    if place == "above the centre":
        return np.array([0.0, 0.0, 10 * off])
    if place == "far":
        return 10 ** rng.uniform(1, 6) * unit(rng)
    if place == "far above":
        return np.array([off, 0.0, 10 ** rng.uniform(1, 6)])
    return rng.uniform(-2, 2, 3)


@pytest.mark.parametrize("place", PLACES)
def test_hard_places_meet_quadrature(place):
    rng = np.random.default_rng([3, *map(ord, place)])
    cases = [(kernel, angle) for kernel in KERNELS for angle in [*rng.choice(ANGLES, 3, replace=False), 2 * math.pi]]
    points = np.array([query(place, angle, rng) for _, angle in cases])
    shapes = [
        Circle(CENTER, NORMAL, 1.0) if angle == 2 * math.pi else Arc(CENTER, NORMAL, START, 1.0, angle)
        for _, angle in cases
    ]
    jets = evaluate(shapes, [kernel for kernel, _ in cases], points)
    exact = [jet_oracle.jet(k, s, x) for (k, _), s, x in zip(cases, shapes, points, strict=True)]
    error = norms(
        np.array([[float(g - e) for g, e in zip(*pair, strict=True)] for pair in zip(jets, exact, strict=True)])
    )
    size = norms(np.array(exact, dtype=float))
    accepted = 1e-12 * size
    # An end is where the angle's last digit puts it: 1e-16 against the distance from it, which counts beside 1e-6 gaps.
    if place in ("gap", "before the start"):
        nearest = [
            min(np.linalg.norm(x - on_circle(0.0)), np.linalg.norm(x - on_circle(a)))
            for x, (_, a) in zip(points, cases, strict=True)
        ]
        blur = 4e-16 / np.array(nearest)
        open_ends = np.array([a < 2 * math.pi for _, a in cases])
        accepted = accepted + np.where(open_ends, blur, 0.0)[:, None] * size * [1.0, 2.0, 3.0]
    width = np.array([2.0 / k.width if isinstance(k, Gaussian) else 1.0 for k, _ in cases])
    tail = np.array(
        [min(s.measure, 2.0 * w) * isinstance(k, Gaussian) for (k, _), s, w in zip(cases, shapes, width, strict=True)]
    )
    accepted += 2e-15 * tail[:, None] / width[:, None] ** np.arange(3)
    if place == "above the centre":
        # What pulls a closed ring's centre is 0; quadrature leaves 1e-34.
        accepted[:, 1] += 1e-30
    assert (error <= accepted).all()


def circle_in_closed_form(kernel, rho, z):
    """(F_rr, F_r / r, F_zz, F_rz) of the unit circle, by differences of the potential in 120 digits."""
    with mp.workdps(120):
        w = mp.mpf(kernel.width)

        def field(r, h):
            if isinstance(kernel, Newtonian):
                far2 = (r + 1) ** 2 + h**2 + w**2
                return 4 * mp.ellipk(4 * r / far2) / mp.sqrt(far2)
            if isinstance(kernel, Gaussian):
                return 2 * mp.pi * mp.exp(-(w**2) * (r**2 + h**2 + 1)) * mp.besseli(0, 2 * w**2 * r)
            a = 1 + w**2 * (r**2 + h**2 + 1)
            return 2 * mp.pi * a / mp.sqrt(a**2 - 4 * w**4 * r**2) ** 3

        r, h = mp.mpf(rho), mp.mpf(z)
        step = mp.mpf(10) ** -30 * mp.hypot(r - 1, h)
        middle, up, down = field(r, h), field(r, h + step), field(r, h - step)
        right, left = field(r + step, h), field(r - step, h)
        corners = field(r + step, h + step) + field(r - step, h - step)
        corners -= field(r + step, h - step) + field(r - step, h + step)
        rr, zz = (right - 2 * middle + left) / step**2, (up - 2 * middle + down) / step**2
        return [float(v) for v in (rr, (right - left) / (2 * step * r), zz, corners / (4 * step**2))]


@pytest.mark.parametrize("kernel", KERNELS, ids=repr)
def test_circles_meet_closed_forms(kernel):
    rng = np.random.default_rng(4)
    reach = 1e6 if not isinstance(kernel, Gaussian) else 4.0 / kernel.width
    rho_z = [
        (1.0, 1e-9),
        (1.0, -1e-4),
        (1.0 - 2.0**-30, 2.0**-31),
        (1e-9, 0.5),
        (1e-3, 0.0),
        (1e-6, reach),
        (reach, 1.0),
    ]
    rho_z += [tuple(rng.uniform(0.1, 2.0, 2)) for _ in range(6)]
    jets = evaluate([Circle(CENTER, NORMAL, 1.0)] * len(rho_z), [kernel] * len(rho_z), [(0.0, r, z) for r, z in rho_z])
    exact = np.zeros((len(rho_z), 10))
    for row, (r, z) in zip(exact, rho_z, strict=True):
        row[5], row[4], row[6], row[9] = circle_in_closed_form(kernel, r, z)
    jets[:, :4] = 0.0
    assert (norms(jets - exact)[:, 2] <= 1e-12 * norms(exact)[:, 2]).all()


def shapes_and_points(count, seed):
    """Circles and arcs in any position, and points at log-uniform distances from them."""
    rng = np.random.default_rng(seed)
    shapes, points = [], []
    for index in range(count):
        center, normal, start = rng.normal(size=3), unit(rng), unit(rng)
        angle = rng.choice([rng.uniform(0.1, 6.2), 10 ** rng.uniform(-4, 0), 2 * math.pi - 10 ** rng.uniform(-4, 0)])
        arc = Arc(center, normal, start, 1.0, angle)
        u, n = np.array(arc.start), np.array(arc.normal)
        turn = angle * rng.random()
        foot = center + math.cos(turn) * u + math.sin(turn) * np.cross(n, u)
        shapes.append(Circle(center, normal, 1.0) if index % 3 == 0 else arc)
        points.append(foot + 10 ** rng.uniform(-7, 5) * unit(rng))
    return shapes, np.array(points)


def test_bare_newtonian_hessian_has_no_trace():
    shapes, points = shapes_and_points(1500, 5)
    jets = evaluate(shapes, [Newtonian()] * len(shapes), points)
    assert (np.abs(jets[:, 4:7].sum(axis=1)) <= 1e-13 * norms(jets)[:, 2]).all()


@pytest.mark.parametrize("softening", [0.01, 0.4, 3.0])
def test_softened_newtonian_trace_is_that_of_the_blurred_source(softening):
    rng = np.random.default_rng(6)
    angles = [0.3, 3.0, 6.0, 2 * math.pi]
    shapes = [Arc(CENTER, NORMAL, START, 1.0, a) if a < 6.1 else Circle(CENTER, NORMAL, 1.0) for a in angles]
    points = rng.uniform(-1.3, 1.3, (4, 3))
    jets = evaluate(shapes, [Newtonian(softening)] * 4, points)
    for angle, (x, y, z), jet in zip(angles, points, jets, strict=True):
        # The nodes are even in the angle from the nearest point, as fine as the softening asks for.
        nodes, weights = np.polynomial.legendre.leggauss(40)
        edges = np.linspace(0.0, angle, 300)
        middle, half = (edges[1:] + edges[:-1]) / 2, np.diff(edges) / 2
        t = middle[:, None] + half[:, None] * nodes
        d2 = (x - np.cos(t)) ** 2 + (y - np.sin(t)) ** 2 + z * z + softening**2
        trace = -3 * softening**2 * (d2**-2.5 * weights * half[:, None]).sum()
        assert abs(jet[4:7].sum() - trace) <= 1e-12 * abs(trace) + 1e-14 * norms(jet[None])[0, 2]


@pytest.mark.parametrize("target", ["warp64", "warp32", "numba"])
def test_a_bare_wire_has_no_derivatives(target):
    shapes = [Circle(CENTER, NORMAL, 1.0)] * 2 + [Arc(CENTER, NORMAL, START, 1.0, 3.0)] * 2
    jets = evaluate(shapes, [Newtonian()] * 4, [(0.0, 1.0, 0.0), (0.0, -1.0, 0.0), START, START], target)
    assert (jets[:, 0] == math.inf).all()
    assert (jets[:, 1:] == 0.0).all()


@pytest.mark.parametrize("target", ["warp64", "numba"])
def test_a_full_arc_is_a_circle(target):
    rng = np.random.default_rng(7)
    normals, starts = [unit(rng) for _ in range(90)], [unit(rng) for _ in range(90)]
    points, kernels = rng.normal(size=(90, 3)), KERNELS * 15
    arcs = evaluate(
        [Arc(CENTER, n, s, 1.0, 2 * math.pi) for n, s in zip(normals, starts, strict=True)], kernels, points, target
    )
    circles = evaluate([Circle(CENTER, n, 1.0) for n in normals], kernels, points, target)
    assert (norms(arcs - circles) <= 1e-13 * (norms(circles) + 30 * norms(circles)[:, :1])).all()


def test_pieces_add_up():
    rng = np.random.default_rng(8)
    wholes, firsts, seconds = [], [], []
    for _ in range(120):
        normal, start, angle, share = unit(rng), unit(rng), rng.uniform(0.1, 2 * math.pi), rng.uniform(0.02, 0.98)
        whole = Arc(CENTER, normal, start, 1.0, angle)
        u, n = np.array(whole.start), np.array(whole.normal)
        turned = math.cos(share * angle) * u + math.sin(share * angle) * np.cross(n, u)
        wholes.append(whole)
        firsts.append(Arc(CENTER, normal, start, 1.0, share * angle))
        seconds.append(Arc(CENTER, normal, turned, 1.0, (1 - share) * angle))
    points, kernels = rng.normal(size=(120, 3)), KERNELS * 20
    whole, first, second = (evaluate(shapes, kernels, points) for shapes in (wholes, firsts, seconds))
    scale = norms(first) + norms(second) + norms(whole)[:, :1]
    assert (norms(first + second - whole) <= 1e-12 * scale).all()


def beside_ends(count, nearest):
    """Arcs in any position, and queries around their ends at log-uniform distances, in parts of the radius."""
    rng = np.random.default_rng(9)
    shapes, points = [], []
    for index in range(count):
        angle = [rng.uniform(0.1, 6.2), 10 ** rng.uniform(-4, 0), 2 * math.pi - 10 ** rng.uniform(-4, 0)][index % 3]
        arc = Arc(rng.normal(size=3), unit(rng), unit(rng), 10 ** rng.uniform(-1, 1), angle)
        with mp.workdps(30):
            # To the last digit of a coordinate, so that the smallest distances are what they say.
            turn = mp.mpf(angle) * (index // 3 % 2)
            n, u = mp.matrix(arc.normal), mp.matrix(arc.start)
            n /= mp.norm(n)
            u -= n * (n.T * u)[0]
            u /= mp.norm(u)
            v = [n[k - 2] * u[k - 1] - n[k - 1] * u[k - 2] for k in range(3)]
            foot = [arc.center[k] + arc.radius * (mp.cos(turn) * u[k] + mp.sin(turn) * v[k]) for k in range(3)]
            off = arc.radius * 10 ** rng.uniform(nearest, -1) * unit(rng)
            points.append([float(f + d) for f, d in zip(foot, off, strict=True)])
        shapes.append(arc)
    return shapes, np.array(points)


@pytest.mark.parametrize("kernel", [Newtonian(), InverseSquare()], ids=repr)
def test_bare_arcs_keep_their_digits_beside_their_ends(kernel):
    shapes, points = beside_ends(12, -10)
    jets = evaluate(shapes, [kernel] * len(shapes), points)
    exact = [jet_oracle.jet(kernel, s, x) for s, x in zip(shapes, points, strict=True)]
    error = np.array([[float(g - e) for g, e in zip(*pair, strict=True)] for pair in zip(jets, exact, strict=True)])
    assert (norms(error) <= 1e-12 * norms(np.array(exact, dtype=float))).all()


@pytest.mark.parametrize("kernel", [Newtonian(), InverseSquare()], ids=repr)
def test_bare_arcs_beside_their_ends_in_single_precision(kernel):
    shapes, points = beside_ends(600, -4)
    kinds, rows = targets.rows_of(shapes, [kernel] * len(shapes))
    rows, points = rows.astype(np.float32).astype(float), points.astype(np.float32).astype(float)
    single, double = (targets.jets(target, kinds, rows, points) for target in ("warp32", "warp64"))
    # Rounding a query may put it on the wire, next to which the smallest offsets mean little.
    size, radius = norms(double), np.array([s.radius for s in shapes])
    clear = size[:, 1] * radius < 1e4 * size[:, 0]
    assert clear.sum() > 550
    assert (norms(single - double)[clear] <= 5e-6 * size[clear]).all()


@pytest.mark.parametrize(("angle", "a"), [(6.03, 18.0), (5.2, 15.0), (3.4, 8.3), (2.6, 4.4), (0.5, 4.0)])
def test_gaussian_arcs_whose_ends_are_alike_on_the_far_side(angle, a):
    # Both ends, the nearest points, have an exponent of about -80, the middle down to -2000.
    phi = angle / 2 + math.pi
    rho = math.sqrt(80.0 / a**2 - math.sin(angle / 2) ** 2) + math.cos(angle / 2 - math.pi)
    x = np.array([rho * math.cos(phi), rho * math.sin(phi), 0.03])
    arc = Arc(CENTER, NORMAL, START, 1.0, angle)
    got = evaluate([arc], [Gaussian(a)], [x])
    exact = jet_oracle.jet(Gaussian(a), arc, x, pieces=128)
    error = np.array([[float(g - e) for g, e in zip(got[0], exact, strict=True)]])
    assert 1e-38 < exact[0] < 1e-35
    # Of the force's and of its slope's scale: the pulls of the two ends cancel in part.
    assert (norms(error)[0] <= 1e-13 * got[0, 0] * (2 * a**2 * (1 + rho)) ** np.arange(3)).all()


@pytest.mark.parametrize("angle", [0.1, 1.8e-3, 1e-5, 1e-7])
@pytest.mark.parametrize("width", [6.6, 8.657, 30.0])
def test_short_metaball_arcs_on_the_far_side_keep_their_digits(angle, width):
    """Their circles lie within the support, or within its inner ball: no end of a piece is an end of the kernel."""
    arc = Arc((0.1, -0.2, 0.3), (0.2688, -0.655, -0.7061), (-0.798, -0.5619, 0.2174), 1.0, angle)
    start, normal = np.array(arc.start), np.array(arc.normal)
    across, rng = np.cross(normal, start), np.random.default_rng(8)
    points = []
    for _ in range(6):
        turn, rho = math.pi + angle * rng.uniform(), rng.uniform(0.3, 3.0)
        offset = rho * (math.cos(turn) * start + math.sin(turn) * across) + rng.uniform(-0.5, 0.5) * normal
        points.append(np.array(arc.center) + offset)
    kernel = Metaball(width)
    got = evaluate([arc] * len(points), [kernel] * len(points), points)
    exact = np.array([jet_oracle.jet(kernel, arc, x) for x in points], dtype=float)
    assert (norms(got - exact)[:, :2] <= 1e-13 * norms(exact)[:, :2]).all()
