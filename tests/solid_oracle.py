"""Solid polyhedra in many digits: Werner & Scheeres' (1997) edge and face dyads, which fieldsim does not use."""

import mpmath as mp
import numpy as np


def jet(corners, point, digits=60):
    """(V, gradient, Hessian) of the integral of 1/r over the solid with face corners (F, 3, 3), as ten floats.

    Off the surface; its cancellation far away is met by digits.
    """
    with mp.workdps(digits):
        x = mp.matrix([mp.mpf(float(c)) for c in point])
        value, gradient, hessian = mp.mpf(0), mp.zeros(3, 1), mp.zeros(3, 3)
        for face in corners:
            a, b, c = (mp.matrix([mp.mpf(float(v)) for v in corner]) - x for corner in face)
            normal = _cross(b - a, c - a)
            normal /= mp.norm(normal)
            omega = _solid_angle(a, b, c)
            lean = -omega * (normal * normal.T)
            for p, q in ((a, b), (b, c), (c, a)):
                length = mp.norm(q - p)
                outward = _cross((q - p) / length, normal)
                around = mp.norm(p) + mp.norm(q)
                lean += mp.log((around + length) / (around - length)) * (normal * outward.T)
            r = a  # any point of the face
            # lean = n (x) (sum of n_e L - n omega); n_e r_e differs between edges, so it is summed in `_pull`.
            pull = _pull(a, b, c, normal, omega)
            value += (normal.T * r)[0] * pull / 2
            gradient -= normal * pull
            hessian += lean
        h = (hessian + hessian.T) / 2
        six = [h[0, 0], h[1, 1], h[2, 2], h[0, 1], h[0, 2], h[1, 2]]
        return np.array([float(v) for v in (value, *gradient, *six)])


def _pull(a, b, c, normal, omega):
    """The integral of 1/r over a face."""
    total = -(normal.T * a)[0] * omega
    for p, q in ((a, b), (b, c), (c, a)):
        length = mp.norm(q - p)
        around = mp.norm(p) + mp.norm(q)
        outward = _cross((q - p) / length, normal)
        total += (outward.T * p)[0] * mp.log((around + length) / (around - length))
    return total


def _solid_angle(a, b, c):
    """Van Oosterom & Strackee (1983), positive seen from inside."""
    ra, rb, rc = mp.norm(a), mp.norm(b), mp.norm(c)
    up = (a.T * _cross(b, c))[0]
    right = ra * rb * rc + (a.T * b)[0] * rc + (a.T * c)[0] * rb + (b.T * c)[0] * ra
    return 2 * mp.atan2(up, right)


def _cross(p, q):
    return mp.matrix([p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]])
