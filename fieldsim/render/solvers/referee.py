"""The referee: the first point of a ray on the surface F = 1, found in float64 by steps that cannot cross it.

It evaluates the true field of all elements, without interpolants, bounding volumes or candidate lists: the reference
for the fast tracers. At each point of the ray it takes the longer of two steps: the longest of a few for which the
elements' bounds (see `bounds.safe_step`) exclude a crossing, and the one that follows from the field's slope and
greatest curvature, which converges to the surface quadratically. Hart 1996 traces rays by such bounds.
"""

# ruff: noqa: UP018, RUF046 - int(0) makes a variable that Warp lets a loop change

import functools
import warnings

import numpy as np
import warp as wp

from fieldsim.errors import FieldsimWarning
from fieldsim.launch import launch
from fieldsim.potentials import registry
from fieldsim.potentials.bounds import safe_step
from fieldsim.potentials.elements import Elements
from fieldsim.potentials.row import POSITIONS, SIZE, STRENGTH
from fieldsim.render.materials.table import factors
from fieldsim.render.materials.textures import color_at
from fieldsim.render.scene.hits import Hits, origin_of, write_rest
from fieldsim.render.scene.tables import SceneTables

TOLERANCE = wp.constant(wp.float64(1e-12))  # of the level
NOTHING = wp.constant(wp.float64(1e-18))  # of the level: elements that contribute less are left out
MISS, UNDECIDED = wp.constant(wp.float64(-1.0)), wp.constant(wp.float64(-2.0))
HORIZON = 1e4  # in sizes of the scene: a plane ends at this distance

_MOST_STEPS = wp.constant(20000)
_RUNGS = wp.constant(8)
# The steps tried are the last one times these: 8, 2.4, 0.72, ...
_LONGEST, _SHORTER = wp.constant(wp.float64(8.0)), wp.constant(wp.float64(0.3))
_Worst = wp.types.vector(length=8, dtype=wp.float64)


@functools.cache
def march_kernel(kinds_used):
    """The kernel that marches along rays by safe steps."""
    element = registry.element_field(kinds_used).warp(wp.float64)
    distances = {kind: formula.primitive.distance for kind, formula in registry.formulas_of(kinds_used).items()}
    distance = registry.by_kind(distances).warp(wp.float64)
    ceiling = safe_step.ceiling.warp(wp.float64)
    rise = safe_step.rise.warp(wp.float64)
    fall = safe_step.fall.warp(wp.float64)
    one = wp.constant(wp.float64(1.0))
    zero = wp.constant(wp.float64(0.0))

    @wp.func
    def survey(
        p: wp.vec3d,
        d: wp.vec3d,
        last: wp.float64,
        out: wp.float64,
        rows: wp.array2d(dtype=wp.float64),
        kinds: wp.array(dtype=int),
    ):
        """(F, its gradient, bounds of F after each of the steps); out: 1 where F < 1 and may rise, -1 where F > 1."""
        f = wp.float64(0.0)
        gradient = wp.vec3d(zero, zero, zero)
        worst = _Worst()
        for i in range(kinds.shape[0]):
            away = distance(p[0], p[1], p[2], rows, kinds, i)
            if ceiling(wp.max(away - _LONGEST * last, zero), rows, i) < NOTHING:
                continue
            f_i, x, y, z = element(p[0], p[1], p[2], rows, kinds, i)
            f += f_i
            gradient += wp.vec3d(x, y, z)
            sign = wp.where(rows[i, STRENGTH] < zero, -one, one)
            slope = sign * (x * d[0] + y * d[1] + z * d[2])
            step = _LONGEST * last
            for k in range(_RUNGS):
                if sign * out > zero:
                    worst[k] += sign * rise(sign * f_i, slope, away, step, rows, i)
                else:
                    worst[k] += sign * fall(sign * f_i, slope, away, step, rows, i)
                step *= _SHORTER
        return f, gradient, worst

    @wp.kernel(module="unique", enable_backward=False)
    def march(
        start: int,
        rows: wp.array2d(dtype=wp.float64),
        kinds: wp.array(dtype=int),
        bend: wp.float64,
        eye: wp.vec3d,
        directions: wp.array(dtype=wp.vec3d),
        spans: wp.array(dtype=wp.vec2d),
        depths: wp.array(dtype=wp.float64),
        gradients: wp.array(dtype=wp.vec3d),
        steps: wp.array(dtype=int),
    ):
        n = start + wp.tid()
        d = directions[n]
        t = wp.float64(spans[n][0])
        end = spans[n][1]
        last = wp.max(wp.float64(1.0e-3) * (end - t), wp.float64(1.0e-12))
        found = wp.float64(MISS)
        out = wp.float64(0.0)
        count = int(0)
        while t < end:
            if count == _MOST_STEPS:
                found = UNDECIDED
                break
            f, gradient, worst = survey(eye + t * d, d, last, out, rows, kinds)
            gradients[n] = gradient
            count += 1
            if out == zero:
                # The first evaluation only determines the side.
                out = wp.where(f < one, one, -one)
                continue
            gap = out * (one - f)
            if gap <= TOLERANCE:
                found = t
                break
            step = _LONGEST * last
            k = int(0)
            while k < _RUNGS and not (out * (worst[wp.min(k, _RUNGS - 1)] - one) <= zero):
                step *= _SHORTER
                k += 1
            last = step
            if k == _RUNGS:
                # No step was safe: try shorter ones.
                step = zero
            # `gap` falls by no more than slope s + bend s^2 / 2 within s.
            slope = out * wp.dot(gradient, d)
            root = wp.sqrt(slope * slope + wp.float64(2.0) * bend * gap)
            tangent = wp.float64(0.0)
            if slope >= zero:
                tangent = wp.float64(2.0) * gap / (slope + root)
            elif root < wp.float64(1.0e150):
                tangent = (root - slope) / bend
            if tangent > step:
                step = tangent
                last = step
            if t + last == t:
                # As close as floating point allows.
                found = t
                break
            t += step
        depths[n] = found
        steps[n] = count

    return march


@wp.struct
class _RefereeTables:
    """Elements in the world's frame, in float64; see `tables.SceneTables`."""

    rows: wp.array2d(dtype=wp.float64)
    kinds: wp.array(dtype=int)


@functools.cache
def describe_kernel(kinds_used):
    """The kernel that records hits: normals, and materials mixed by weight."""
    element = registry.element_field(kinds_used).warp(wp.float64)

    @wp.kernel(module="unique", enable_backward=False)
    def describe(
        start: int,
        scene: _RefereeTables,
        seen: SceneTables,
        points: wp.array(dtype=wp.vec3d),
        depths: wp.array(dtype=wp.float64),
        normals: wp.array(dtype=wp.vec3),
        which: wp.array(dtype=int),
        hits: Hits,
    ):
        n = start + wp.tid()
        i = which[n]
        p = points[n]
        depth = float(depths[n])
        here = origin_of(i, hits) + depth * hits.direction[i]
        f = wp.float64(0.0)
        slope = wp.vec3d()
        color = wp.vec3(0.0, 0.0, 0.0)
        light = wp.vec4(0.0, 0.0, 0.0, 0.0)
        optics = wp.vec4(0.0, 0.0, 0.0, 0.0)
        most = wp.float64(-1.0)
        for k in range(scene.kinds.shape[0]):
            f_k, x, y, z = element(p[0], p[1], p[2], scene.rows, scene.kinds, k)
            m = seen.owner[k]
            weight = float(f_k)
            f += f_k
            slope += wp.vec3d(x, y, z)
            color += weight * color_at(seen, m, k, here)
            light += weight * factors(seen.materials, m)
            optics += weight * seen.optics[m]
            if f_k > most:
                most = f_k
                hits.thing[i] = m
                hits.lift[i] = 2.0e-3 * seen.width[k]
        hits.depth[i] = depth
        write_rest(i, float(depths[n] - wp.float64(depth)), hits)
        hits.normal[i] = normals[n]
        hits.color[i] = color / float(f)
        hits.light[i] = light / float(f)
        if hits.optics.shape[0] > 0:
            # From within, the normal faces the ray and so points the way that the field grows.
            within = wp.where(wp.dot(slope, wp.vec3d(normals[n])) > wp.float64(0.0), 1.0, 0.0)
            hits.optics[i] = optics / float(f) + wp.vec4(0.0, 0.0, 0.0, within)

    return describe


class Referee:
    """Surface elements in float64 on a device, whose surface F = 1 rays meet.

    Raises InputError for a formula whose field's growth has no known bound. steps: evaluations of the field for the
    last rays, (N,).
    """

    def __init__(self, elements: Elements, device=None):
        self.device = device
        self.kinds = elements.kinds_used
        rows, self.bend = safe_step.with_bounds(elements)
        self.rows = wp.array(rows, dtype=wp.float64, ndim=2, device=device)
        self.elements = wp.array(elements.kinds, dtype=int, device=device)
        self.steps = np.zeros(0, dtype=np.int32)
        self._ball = _ball(elements, rows)

    def first_hits(self, eye, directions) -> tuple[np.ndarray, np.ndarray]:
        """Depths (N,), inf for a miss, and unit normals (N, 3), facing the eye, of rays from `eye`.

        directions: (N, 3), of any length; depths are in units of the world. Warns of rays that need too many steps;
        their depth is NaN.
        """
        directions = np.asarray(directions, dtype=float)
        count = len(directions)
        if not count or not len(self.elements):
            return np.full(count, np.inf), np.zeros((count, 3))
        directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        eye = np.asarray(eye, dtype=float)
        outputs = [wp.empty(count, dtype=dtype, device=self.device) for dtype in (wp.float64, wp.vec3d, int)]
        rays = [
            wp.vec3d(*eye),
            wp.array(directions, dtype=wp.vec3d, device=self.device),
            wp.array(self._spans(eye, directions), dtype=wp.vec2d, device=self.device),
        ]
        scene = [self.rows, self.elements, wp.float64(self.bend)]
        launch(march_kernel(self.kinds), count, [*scene, *rays], outputs, device=self.device, grain=16)
        depths, gradients, self.steps = (output.numpy() for output in outputs)
        depths = _checked_depths(depths)
        return depths, _facing(gradients, directions, np.isfinite(depths))

    def _spans(self, eye, directions):
        """Where rays enter and leave the ball outside of which there is no surface, (N, 2)."""
        center, radius = self._ball
        if center is None:
            far = HORIZON * (radius + np.abs(eye).max())
            return np.broadcast_to([0.0, far], (len(directions), 2))
        middle = directions @ (center - eye)
        across = center - eye - middle[:, None] * directions
        half2 = radius**2 - np.einsum("ij,ij->i", across, across)
        half = np.sqrt(np.maximum(half2, 0.0))
        spans = np.maximum(np.stack([middle - half, middle + half], axis=1), 0.0)
        return np.where(half2[:, None] > 0.0, spans, 0.0)

    def describe(self, hits: Hits, which, depths, normals, points, stage) -> None:
        """Write hits of the samples `which` (K,): depths in the stage's units, normals and world points (K, 3)."""
        scene = _RefereeTables()
        scene.rows, scene.kinds = self.rows, self.elements
        arrays = [
            wp.array(values, dtype=dtype, device=self.device)
            for values, dtype in ((points, wp.vec3d), (depths, wp.float64), (normals, wp.vec3), (which, int))
        ]
        launch(
            describe_kernel(self.kinds), len(which), [scene, stage.elements.scene, *arrays, hits], device=self.device
        )


def _ball(elements, rows):
    """(centre, radius) of a ball that holds the surface; (None, size of the scene) where planes have none."""
    if not len(elements):
        return None, 0.0
    primitives = {kind: formula.primitive for kind, formula in registry.formulas_of(elements.kinds_used).items()}
    corners = elements.rows[:, POSITIONS].reshape(-1, 3, 3)
    used = np.array([primitives[kind].corners for kind in elements.kinds.tolist()])
    center = 0.5 * (corners[:, 0].min(axis=0) + corners[:, 0].max(axis=0))
    away = np.linalg.norm(corners - center, axis=2)
    away[np.arange(3) >= used[:, None]] = 0.0
    round_ones = np.array([primitives[kind].round for kind in elements.kinds.tolist()])
    size = (away.max(axis=1) + np.where(round_ones, elements.rows[:, SIZE], 0.0)).max()
    if any(primitive.endless for primitive in primitives.values()):
        return None, size
    return center, size + safe_step.reach(rows)


def _checked_depths(depths):
    """Depths as `first_hits` returns them; warns of undecided rays."""
    undecided = depths == float(UNDECIDED)
    if undecided.any():
        warnings.warn(
            f"the referee could not decide {undecided.sum()} of {len(depths)} rays; their depth is NaN",
            FieldsimWarning,
            stacklevel=4,
        )
    return np.where(undecided, np.nan, np.where(depths == float(MISS), np.inf, depths))


def _facing(gradients, directions, hit):
    """Unit normals of the rays that hit, from gradients, facing the eye."""
    normals = np.zeros_like(gradients)
    length = np.linalg.norm(gradients[hit], axis=1, keepdims=True)
    normals[hit] = gradients[hit] / np.maximum(length, 1e-300)
    away = np.einsum("ij,ij->i", normals, directions) > 0.0
    normals[away] *= -1.0
    return normals
