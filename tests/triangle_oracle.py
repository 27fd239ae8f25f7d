"""Field, gradient and Hessian of a triangle by quadrature along its edges, in as many digits as wanted.

Independent of the package's closed forms: only the divergence theorem in the triangle's plane is used, F = sum over
edges of the integral of (H(r) - H(|z|)) d / (d^2 + t^2) dt with H' = r h, and its derivatives under the integral.
"""

import functools
import itertools

import mpmath as mp

from fieldsim.potentials.kernels import Cauchy, Gaussian, InverseSquare, Newtonian, Quartic, SoftObject

NODES = 30


def profile(kernel):
    """h, dh/dq and an integral of h/2 as functions of q = r^2; radii where they are not smooth; the kernel's width."""
    width = mp.mpf(kernel.width)
    w2 = width**2
    if isinstance(kernel, Cauchy):
        return (
            lambda q: (1 + w2 * q) ** -2,
            lambda q: -2 * w2 * (1 + w2 * q) ** -3,
            lambda q: -1 / (2 * w2 * (1 + w2 * q)),
            [],
            1 / width,
        )
    if isinstance(kernel, Gaussian):
        return (
            lambda q: mp.exp(-w2 * q),
            lambda q: -w2 * mp.exp(-w2 * q),
            lambda q: -mp.exp(-w2 * q) / (2 * w2),
            [],
            1 / width,
        )
    if isinstance(kernel, Newtonian):
        return (
            lambda q: 1 / mp.sqrt(q + w2),
            lambda q: -(mp.sqrt(q + w2) ** -3) / 2,
            lambda q: mp.sqrt(q + w2),
            [],
            width,
        )
    if isinstance(kernel, InverseSquare):
        return lambda q: 1 / (q + w2), lambda q: -((q + w2) ** -2), lambda q: mp.log(q + w2) / 2, [], width
    if isinstance(kernel, Quartic | SoftObject):
        c2, c3 = (mp.mpf(5) / 9, mp.mpf(4) / 9) if isinstance(kernel, SoftObject) else (mp.mpf(1), mp.mpf(0))

        def y(q):
            return max(1 - q / w2, mp.mpf(0))

        return (
            lambda q: c2 * y(q) ** 2 + c3 * y(q) ** 3,
            lambda q: -(2 * c2 * y(q) + 3 * c3 * y(q) ** 2) / w2,
            lambda q: -w2 / 2 * (c2 * y(q) ** 3 / 3 + c3 * y(q) ** 4 / 4),
            [width],
            width,
        )
    return *_metaball(width), [width, width / 3], width


def _metaball(radius):
    """Nishimura's kernel as 3/2 of the cone-like (1 - u)^2 minus half of the one of a third of the radius."""

    def v(q, n):
        return max(1 - n * mp.sqrt(q) / radius, mp.mpf(0))

    def cone(q, n):
        return -(v(q, n) ** 3) * (1 + 3 * n * mp.sqrt(q) / radius) * (radius / n) ** 2 / 12

    def slope(q):
        if 9 * q <= radius**2:
            return -3 / radius**2
        return -mp.mpf(3) / 2 * v(q, 1) / (radius * mp.sqrt(q))

    return (
        lambda q: mp.mpf(3) / 2 * v(q, 1) ** 2 - v(q, 3) ** 2 / 2,
        slope,
        lambda q: mp.mpf(3) / 2 * cone(q, 1) - cone(q, 3) / 2,
    )


@functools.cache
def _rule(digits):
    jacobi = mp.zeros(NODES)
    for i in range(NODES - 1):
        jacobi[i, i + 1] = jacobi[i + 1, i] = (i + 1) / mp.sqrt(mp.mpf(4 * (i + 1) ** 2 - 1))
    nodes, vectors = mp.eigsy(jacobi)
    return [(nodes[i], 2 * vectors[0, i] ** 2) for i in range(NODES)]


def _integral(f, points):
    total = mp.mpf(0)
    for a, b in itertools.pairwise(points):
        half = (b - a) / 2
        total += half * mp.fsum(weight * f(a + half * (1 + node)) for node, weight in _rule(mp.mp.dps))
    return total


def _pieces(start, end, scales, radii, step):
    """start..end cut where the integrands bend: in octaves about 0, at radii and at steps of a Gaussian's width."""
    cuts = {start, end, mp.mpf(0)} | {s * r for r in radii for s in (1, -1)}
    for scale in scales:
        cuts |= {s * scale * mp.mpf(4) ** j for j in range(62) for s in (1, -1)}
    if step:
        cuts |= {step * j for j in range(-40, 41)}
    return sorted(c for c in cuts if start <= c <= end)


def exact(kernel, corners, point):
    """(F, gradient, Hessian) at `point`, in current precision; None on an unsoftened sheet, where they are singular."""
    h, slope, primitive, radii, width = profile(kernel)
    point = [x if isinstance(x, mp.mpf) else mp.mpf(float(x)) for x in point]
    a, b, c = ([mp.mpf(float(x)) for x in corner] for corner in corners)
    a, b, c, p = (mp.matrix(v) for v in (a, b, c, point))
    normal = _cross(b - a, c - a)
    normal /= mp.norm(normal)
    z = _dot(p - a, normal)
    z2 = z * z
    # Never quite above an edge or corner, where angles would jump.
    foot = p - z * normal + mp.mpf("3e-26") * (b - a) + mp.mpf("2.1e-26") * (c - a)
    edges = [(v, w, (w - v) / mp.norm(w - v)) for v, w in ((a, b), (b, c), (c, a))]
    inside = all(_dot(v - foot, _cross(u, normal)) > 0 for v, _, u in edges)
    if inside and z == 0 and isinstance(kernel, Newtonian | InverseSquare) and kernel.softening == 0:
        return None
    top, h_top, slope_top = (primitive(z2), h(z2), slope(z2)) if inside else (0, 0, 0)
    f, gradient, hessian = mp.mpf(0), mp.zeros(3, 1), mp.zeros(3, 3)
    for v, w, u in edges:
        out = _cross(u, normal)
        d, start, end = _dot(v - foot, out), _dot(v - foot, u), _dot(w - foot, u)
        g2 = d * d + z2
        chords = [mp.sqrt(r * r - g2) for r in radii if r * r > g2]
        scales = [s for s in (abs(d), mp.sqrt(g2), mp.sqrt(g2 + width**2)) if s > 0]
        cuts = _pieces(start, end, scales, chords, width if isinstance(kernel, Gaussian) else 0)
        segment = _integral(lambda t: h(g2 + t * t), cuts)  # noqa: B023 - called at once
        across = _integral(lambda t: slope(g2 + t * t), cuts)  # noqa: B023
        rise = h(g2 + start**2) - h(g2 + end**2)
        gradient -= out * segment
        hessian -= out * (rise * u - 2 * d * across * out + 2 * z * across * normal).T
        hessian -= 2 * z * across * normal * out.T

        def over_angle(g, top, cuts=cuts, d=d, g2=g2):
            return _integral(lambda t: (g(g2 + t * t) - top) * d / (d * d + t * t), cuts)

        lift = over_angle(h, h_top)
        f += over_angle(primitive, top)
        gradient += z * lift * normal
        hessian += (lift + 2 * z2 * over_angle(slope, slope_top)) * normal * normal.T
    return f, gradient, (hessian + hessian.T) / 2


def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a, b):
    return mp.matrix([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
