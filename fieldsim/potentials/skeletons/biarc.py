"""Smooth curves as biarcs: pairs of circular arcs that share their tangent where they meet.

Between two points with tangents there is a pair of arcs, in space as in the plane, whose tangents' lengths are equal
(Bolton 1975; Sabin 1977). A piece of a curve is replaced by its biarc where that is close enough, and halved otherwise;
the error falls with the cube of the length, so that arcs are far fewer than segments would be.
"""

import math

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.primitives.segment import Segment

# Where a piece is measured against its biarc, in its parameter from 0 to 1; between these it errs by < 5 % more.
SAMPLES = np.linspace(0.0, 1.0, 18)
MARGIN = 0.95
# Pieces whose ends are closer than this part of their extent are halved.
OPEN = 1e-3
LONGER = 1.2
# Arcs that turn by less than this angle are segments: their centres would be too far away to be exact.
STRAIGHT = 1e-5
# Tangents that differ by less than this join smoothly.
SMOOTH = 1e-9
DEPTH = 40
# Primitives of one shape at most, and arcs after which their number is foreseen.
MOST_PRIMITIVES = 100_000
FORESEEN = 500


def fitted(position, velocity, start, end, tolerance):
    """Arcs and segments within `tolerance` of the curve `position`, of derivative `velocity`, over start..end."""
    result = []
    pieces = [(start, end, 0)]
    while pieces:
        t0, t1, depth = pieces.pop()
        if len(result) >= FORESEEN:
            # From the part done so far follows how many there will be.
            count = len(result) * (end - start) / (t0 - start)
            validate.bounded("curve", "arcs", count, MOST_PRIMITIVES, "give a larger tolerance, or a shorter curve")
        path = position(t0 + (t1 - t0) * SAMPLES)
        extent = np.linalg.norm(path - path[0], axis=1).max()
        if np.linalg.norm(path[-1] - path[0]) > OPEN * extent:
            primitives = _biarc(path[0], path[-1], *_tangents(velocity(np.array([t0, t1]))))
            if primitives and _follows(primitives, path, tolerance):
                result += primitives
                continue
            if extent < tolerance:
                # A cusp, or a piece too small to matter.
                result.append(Segment(path[0], path[-1]))
                continue
        if depth == DEPTH or not np.isfinite(extent):
            raise InputError(f"the curve is not smooth, or not finite, near the parameter {t0:g}; give a smooth one")
        middle = 0.5 * (t0 + t1)
        pieces += [(middle, t1, depth + 1), (t0, middle, depth + 1)]
    return tuple(result)


def _follows(primitives, path, tolerance):
    """Whether points of a path (M, 3) are within `tolerance` of primitives that are not much longer than it."""
    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    if sum(primitive.measure for primitive in primitives) > LONGER * length:
        return False
    return np.min([_distances(primitive, path) for primitive in primitives], axis=0).max() <= MARGIN * tolerance


def _tangents(velocities):
    """Unit vectors; zero where there is none."""
    sizes = np.linalg.norm(velocities, axis=1, keepdims=True)
    return np.divide(velocities, sizes, out=np.zeros_like(velocities), where=sizes > 0)


def _biarc(p, q, leave, arrive):
    """One or two primitives from p along `leave` to q along `arrive`; None where there are none."""
    if not leave.any() or not arrive.any():
        return None
    chord = q - p
    # One arc arrives along the mirror image of where it left.
    mirrored = 2 * (chord @ leave) / (chord @ chord) * chord - leave
    if np.linalg.norm(mirrored - arrive) < SMOOTH:
        return [_arc(p, q, leave)]
    lean = chord @ (leave + arrive)
    bend = 2 * (1 - leave @ arrive)
    root = math.sqrt(lean * lean + bend * (chord @ chord))
    if lean + root <= 0:
        return None
    # The positive root of bend r^2 + 2 lean r - chord^2 = 0, without cancellation.
    reach = (chord @ chord) / (lean + root)
    joint = 0.5 * (p + q + reach * (leave - arrive))
    if (joint == p).all() or (joint == q).all():
        return None
    along = joint - p
    turned = 2 * (along @ leave) / (along @ along) * along - leave
    return [_arc(p, joint, leave), _arc(joint, q, turned)]


def _arc(p, q, leave):
    """The arc from p along the unit tangent `leave` to q, or the segment where it hardly turns."""
    chord = q - p
    inward = chord - (chord @ leave) * leave
    inward -= (inward @ leave) * leave
    across = np.linalg.norm(inward)
    angle = 2 * math.atan2(across, chord @ leave)
    if angle < STRAIGHT:
        return Segment(p, q)
    inward /= across
    radius = 0.5 * (chord @ chord) / across
    return Arc(p + radius * inward, np.cross(leave, inward), -inward, radius, angle)


def _distances(primitive, points):
    """Distances of points (M, 3) from an arc or a segment."""
    if isinstance(primitive, Segment):
        start, end = np.array(primitive.start), np.array(primitive.end)
        share = np.clip((points - start) @ (end - start) / np.sum((end - start) ** 2), 0.0, 1.0)
        return np.linalg.norm(points - start - share[:, None] * (end - start), axis=1)
    normal, start = np.array(primitive.normal), np.array(primitive.start)
    aside = np.cross(normal, start)
    offset = points - primitive.center
    # Angles from the middle of the arc, kept within it.
    half = 0.5 * primitive.angle
    angles = np.arctan2(offset @ aside, offset @ start) - half
    angles = np.clip(np.remainder(angles + math.pi, 2 * math.pi) - math.pi, -half, half) + half
    nearest = primitive.radius * (np.cos(angles)[:, None] * start + np.sin(angles)[:, None] * aside)
    return np.linalg.norm(offset - nearest, axis=1)
