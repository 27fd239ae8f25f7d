"""First hit of a ray with the surface F = 1: cubic Hermite pieces of log F, certified by the true field.

Along a ray, g = log F is sampled with its slope at nodes no further apart than the narrowest kernel that the ray is in,
and joined by cubics. (The logarithm of one Gaussian is a parabola, which a cubic follows exactly, whatever the
amplitude; F itself would need many more nodes.) A cubic whose Bezier control values stay below 0 by a margin is
skipped. A maximum near 0 becomes a node, so that grazing humps are seen by the true field. The first node above 0
closes a bracket, in which roots of ever shorter cubics converge on the true root. There is one place where the field is
evaluated; what follows depends on the mode.

Sherstyuk 1999, chapter 4; Nishimura et al. 1985.
"""

# ruff: noqa: UP018, RUF046 - float(0.0) and int(0) make variables that Warp lets a loop change

import functools

import warp as wp

from fieldsim.potentials import cells

FLOOR = wp.constant(1.0e-12)  # a field below counts as this, so that its logarithm exists
CEILING = wp.constant(1.0e30)  # a field above counts as this, with slope 0: Blinn's exp(256) is beyond float32
STEP = wp.constant(1.0)  # nodes per kernel width
MARGIN = wp.constant(0.15)  # of g; bounds the cubics' error where they decide to skip
CLOSE = wp.constant(1.0e-3)  # of g; from here one Newton step leaves an error far below float32's
ON_SURFACE = wp.constant(1.0e-4)  # of g
NO_HIT = wp.constant(-1.0)
FOREVER = wp.constant(1.0e30)

# What the evaluation is for: the first node after a gap, the next node or a suspected maximum, a root.
_ENTER, _NEXT, _STEP, _ROOT = (wp.constant(k) for k in range(4))
SPLITS = wp.constant(6)
TRIES = wp.constant(12)


@wp.struct
class Scene:
    """Elements relative to the eye; see `bounds.Bounded`.

    materials (M, 15): linear rgb, ambient, diffuse, specular, shininess, unused, and a texture's row (`Texture.row`).
    turns, shifts (M,): x -> turn x + shift takes a point to the frame of the material's body, in the world's units.
    work: for counted sweeps, of one ray: evaluations of the field so far, and of single elements.
    """

    rows: wp.array2d(dtype=float)
    kinds: wp.array(dtype=int)
    shape: wp.array(dtype=int)
    reach: wp.array(dtype=float)
    core: wp.array(dtype=float)
    width: wp.array(dtype=float)
    owner: wp.array(dtype=int)
    materials: wp.array2d(dtype=float)
    turns: wp.array(dtype=wp.mat33)
    shifts: wp.array(dtype=wp.vec3)
    work: wp.array(dtype=int)


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


@wp.func
def insert(
    ids: wp.array(dtype=int),
    t0s: wp.array(dtype=float),
    t1s: wp.array(dtype=float),
    count: int,
    i: int,
    t0: float,
    t1: float,
):
    """Insert an interval into the list sorted by entry; the list must have room."""
    k = int(count)
    while k > 0 and t0s[wp.max(k - 1, 0)] > t0:
        ids[k] = ids[k - 1]
        t0s[k] = t0s[k - 1]
        t1s[k] = t1s[k - 1]
        k -= 1
    ids[k] = i
    t0s[k] = t0
    t1s[k] = t1
    return count + 1


@wp.func
def keep_after(ids: wp.array(dtype=int), t0s: wp.array(dtype=float), t1s: wp.array(dtype=float), count: int, t: float):
    """Drop the intervals that end before t; returns how many are left."""
    left = int(0)
    for k in range(count):
        if t1s[k] > t:
            ids[left] = ids[k]
            t0s[left] = t0s[k]
            t1s[left] = t1s[k]
            left += 1
    return left


@wp.func
def _next_node(
    t: float,
    entered: int,
    count: int,
    ids: wp.array(dtype=int),
    t0s: wp.array(dtype=float),
    t1s: wp.array(dtype=float),
    width: wp.array(dtype=float),
):
    """(next node, head): elements before `head` have been entered by then. No element active: the next node is t."""
    head = int(entered)
    while head < count and t0s[wp.min(head, count - 1)] <= t:
        head += 1
    step = float(FOREVER)
    leave = float(t)
    for k in range(head):
        if t1s[k] > t:
            step = wp.min(step, STEP * width[ids[k]])
            leave = wp.max(leave, t1s[k])
    if leave <= t:
        return t, head
    node = t + step
    # Elements that come in before the node take part in it, unless they are narrow: then it moves to their entry.
    while head < count and t0s[wp.min(head, count - 1)] < node:
        node = wp.min(node, wp.max(t0s[head], t + STEP * width[ids[head]]))
        if t0s[head] >= node:
            break
        leave = wp.max(leave, t1s[head])
        head += 1
    # Far away float32 may not resolve a width.
    return wp.max(wp.min(node, leave), t + 1.0e-6 * wp.abs(t)), head


@wp.func
def _uncounted(scene: Scene, elements: int):
    pass


@wp.func
def _counted(scene: Scene, elements: int):
    scene.work[0] = scene.work[0] + 1
    scene.work[1] = scene.work[1] + elements


@functools.cache
def first_hit(kinds_used, counted=False):
    """The Warp function that sweeps a ray through sorted intervals, for the given cells.

    counted: it adds its evaluations to `Scene.work`.
    """
    count_work = _counted if counted else _uncounted
    element = cells.element_field(kinds_used).warp(wp.float32)

    @wp.func
    def total(
        scene: Scene,
        o: wp.vec3,
        d: wp.vec3,
        t: float,
        since: float,
        head: int,
        ids: wp.array(dtype=int),
        t1s: wp.array(dtype=float),
    ):
        """Log F and its slope at t, of the elements before `head` that have not ended at `since`."""
        p = o + t * d
        f = float(0.0)
        slope = float(0.0)
        active = int(0)
        for k in range(head):
            if t1s[k] > since:
                active += 1
                f_i, x, y, z = element(p[0], p[1], p[2], scene.rows, scene.kinds, ids[k])
                f += f_i
                slope += x * d[0] + y * d[1] + z * d[2]
        count_work(scene, active)
        if not (f < CEILING):
            return wp.log(CEILING), 0.0
        f = wp.max(f, FLOOR)
        return wp.log(f), slope / f

    @wp.func
    def sweep(
        scene: Scene,
        o: wp.vec3,
        d: wp.vec3,
        begin: float,
        end: float,
        known_side: float,
        ids: wp.array(dtype=int),
        t0s: wp.array(dtype=float),
        t1s: wp.array(dtype=float),
        count: int,
    ):
        """(t of the first hit in begin..end or NO_HIT, side).

        known_side: -1 outside, looking for the way in; 1 inside, looking for the way out; 0 unknown, the field tells.
        """
        hit = float(NO_HIT)
        side = float(known_side)
        t = float(begin)
        t_e = float(begin)
        node = float(begin)
        g = float(0.0)
        s = float(0.0)
        right = float(0.0)
        g_right = float(0.0)
        s_right = float(0.0)
        head = int(0)
        tries = int(0)
        mode = int(_ENTER)
        while True:
            if mode == _ENTER or mode == _NEXT:
                node, head = _next_node(t, head, count, ids, t0s, t1s, scene.width)
                if node == t:
                    # A gap: on to the next entry.
                    if head >= count or t0s[wp.min(head, count - 1)] >= end:
                        break
                    t = t0s[head]
                    mode = _ENTER
                    continue
                node = wp.min(node, end)
                tries = 0
                t_e = node
                if mode == _ENTER:
                    t_e = t
                else:
                    mode = _STEP
            g_e, s_e = total(scene, o, d, t_e, t, head, ids, t1s)
            if side == 0.0:
                side = wp.where(g_e < 0.0, -1.0, 1.0)
            g_e *= -side
            s_e *= -side
            if mode == _ENTER:
                # A ray that starts on the surface starts on its own side of it.
                g = wp.min(g_e, -ON_SURFACE)
                s = s_e
                t_e = node
                mode = _STEP
                continue
            if mode == _STEP:
                right = t_e
                g_right = g_e
                s_right = s_e
                if g_e >= 0.0:
                    mode = _ROOT
                    tries = 0
                else:
                    u = suspect(g, s * (right - t), g_right, s_right * (right - t))
                    # Splits too short to matter would never get on.
                    if u * (right - t) > 0.02 * (node - t) and tries < SPLITS:
                        tries += 1
                        t_e = t + u * (right - t)
                        continue
                    t = right
                    g = g_right
                    s = s_right
                    if t >= end:
                        break
                    mode = _NEXT
                    continue
            else:
                tries += 1
                if wp.abs(g_e) < CLOSE or tries == TRIES:
                    hit = t_e
                    if s_e > 0.0:
                        hit = wp.clamp(t_e - g_e / s_e, t, right)
                    break
                if g_e < 0.0:
                    t = t_e
                    g = g_e
                    s = s_e
                else:
                    right = t_e
                    g_right = g_e
                    s_right = s_e
            h = right - t
            t_e = t + h * cubic_root(g, s * h, g_right, s_right * h)
        return hit, side

    return sweep
