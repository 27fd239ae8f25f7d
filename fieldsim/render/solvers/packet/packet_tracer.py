"""First hits of a packet of rays with the surface F = 1 of Gaussian elements.

Each ray has a bracket in which the surface may be. The search goes from node to node with cubic Hermite pieces of log
F. All rays evaluate their fields in lockstep, each at its own place, until the last one is done. The steps are not
certified: elements are cut where they fall below CUT, and a cubic that stays MARGIN below the level counts as free of a
surface. `simd` explains the C++.
"""

import functools

import warp as wp

from fieldsim.render.scene.tables import FOREVER, NO_HIT
from fieldsim.render.solvers import hermite
from fieldsim.render.solvers.packet.gaussian_elements import BESSEL, CUT, KINDS, LEVEL, SHARE, GaussianElements
from fieldsim.render.solvers.packet.simd import cpp

GIVEN_UP = wp.constant(-2.0)  # instead of a distance: a ray that may start inside, or meets more than ROOM elements
# Rows of what goes in and out: a ray's start, its direction, how far it goes (0: nowhere), and its hit.
START, DIRECTION, FAR, HIT, RAY_ROWS = (wp.constant(k) for k in (0, 3, 6, 7, 8))
ROOM = 96  # elements that a packet of rays may meet

_CONSTANTS = {
    "ROOM": ROOM,
    "LEVEL": LEVEL,
    "CUT": CUT,
    "FLOOR": 1.0e-12,  # added to F, so that its logarithm exists
    "ABSENT": -1.0e30,  # the q of an element that a ray does not meet
    "NO_FALL": 1.0e-30,  # the k of an element whose bound is constant (circles)
    "FOREVER": float(FOREVER),
    "NO_HIT": float(NO_HIT),
    "GIVEN_UP": float(GIVEN_UP),
    "ON_SURFACE": float(hermite.ON_SURFACE),
    "MARGIN": 0.15,  # of log F; bounds the cubics' error where they decide to skip
    "CLOSE": 0.01,  # of log F; one Newton step from here leaves an error of its square
    "TRIES": 12,
    "SPLITS": 6,
    "MOST": 400,  # evaluations
}

# Gathers the elements that the rays meet. Columns: q, k, m, start, end, (later) the greatest value in the bracket; for
# segments also the position along the segment and its slope, times a; for circles, whose k is 0, taken where the ray is
# nearest to the centre: height above the circle's plane, its slope, and the squared distance to the centre.
_GATHER = """
constexpr int STRIDE = RINGS ? 9 : SEGMENTS ? 8 : 6;
int ids[ROOM];
V element[ROOM * STRIDE];
int count = 0;
const V ox = load(rays.data, 0), oy = load(rays.data, 1), oz = load(rays.data, 2);
const V dx = load(rays.data, 3), dy = load(rays.data, 4), dz = load(rays.data, 5);
const V far = load(rays.data, 6);
V opaque = far;
// Where low <= along + slope t <= high.
auto slab = [&](V along, V slope, float low, float high, V& s0, V& s1) {
    V safe = size(slope) < 1.0e-6f ? (V)1.0e-6f : slope;
    V a = (low - along) / safe, b = (high - along) / safe;
    s0 = least(a, b);
    s1 = most(a, b);
};
for (int at = first; at < last; ++at) {
    const int i = list.data[at];
    if (!SHADOW && near.data[i] >= top(opaque))
        break;
    const auto& c = table.center.data[i];
    const auto& h = table.height.data[i];
    const auto& axis = table.axis.data[i];
    const bool line = SEGMENTS && axis[3] > 0.0f, ring = RINGS && axis[3] < 0.0f;
    V tx = c[0] - ox, ty = c[1] - oy, tz = c[2] - oz;
    V ex = dx, ey = dy, ez = dz, along = 0.0f, slope = 0.0f, k = c[3], per_k = 1.0f / c[3];
    V m = tx * ex + ty * ey + tz * ez;
    if (line) {
        // Across the segment's axis.
        along = -(axis[0] * tx + axis[1] * ty + axis[2] * tz);
        slope = axis[0] * dx + axis[1] * dy + axis[2] * dz;
        tx += axis[0] * along; ty += axis[1] * along; tz += axis[2] * along;
        ex -= axis[0] * slope; ey -= axis[1] * slope; ez -= axis[2] * slope;
        k = c[3] * most(ex * ex + ey * ey + ez * ez, (V)1.0e-12f);
        per_k = 1.0f / k;
        m = c[3] * per_k * (tx * ex + ty * ey + tz * ez);
    }
    const V rx = tx - m * ex, ry = ty - m * ey, rz = tz - m * ez;
    const V r2 = rx * rx + ry * ry + rz * rz;
    V q = h[0] - c[3] * r2;
    V half = root((q + LEVEL) * per_k);
    if (ring) {
        along = -(axis[0] * rx + axis[1] * ry + axis[2] * rz);
        slope = axis[0] * dx + axis[1] * dy + axis[2] * dz;
        half = root((h[3] - axis[3]) * (h[3] - axis[3]) - r2);
        q = h[0];
        k = NO_FALL;
    }
    V low = most(m - half, (V)0.0f), high = least(m + half, opaque);
    if (line) {
        const float reach = sqrtf((h[0] + LEVEL) / c[3]);
        V s0, s1;
        slab(along, slope, -reach, axis[3] + reach, s0, s1);
        low = most(low, s0);
        high = least(high, s1);
    }
    if (ring) {
        V s0, s1;
        slab(along - m * slope, slope, -h[3], h[3], s0, s1);
        low = most(low, s0);
        high = least(high, s1);
    }
    const C met = low < high;
    if (!any(met))
        continue;
    if (count == ROOM) {
        count = -1;
        break;
    }
    const V certain = q + h[1];
    if (!ring && any(met & (certain > 0.0f))) {
        const V inner = root(certain * per_k);
        V c0 = m - inner, c1 = m + inner;
        if (line) {
            V a0, a1;
            slab(along, slope, 0.0f, axis[3], a0, a1);
            c0 = most(c0, a0);
            c1 = least(c1, a1);
        }
        opaque = ((certain > 0.0f) & (c0 > 0.0f) & (c0 < c1)) ? least(opaque, c0) : opaque;
        if (SHADOW && !any((opaque >= far) & (far > 0.0f)))
            break;
    }
    ids[count] = i;
    V* const b = element + count * STRIDE;
    b[0] = met ? q : (V)ABSENT;
    b[1] = k;
    b[2] = m;
    b[3] = low;
    b[4] = met ? high : (V)-FOREVER;
    if (ring) {
        b[6] = along;
        b[7] = slope;
        b[8] = r2;
    } else if (SEGMENTS) {
        const float a = sqrtf(c[3]);
        b[6] = met ? a * along : (V)(0.5f * a * axis[3]);
        b[7] = met ? a * slope : (V)0.0f;
    }
    ++count;
}
"""

# total: log F, its slope, its second derivative (for guesses only), and a bound of F on the rest of the ray.
# longest: the longest step, a kernel's width or the distance to the start of the next element.
_FIELD = """
// A ray's position relative to a circle: distance from the axis, height above the plane.
auto around = [&](const V* b, V u, V& rho, V& z) {
    z = b[6] + u * b[7];
    rho = root(b[8] + u * u - z * z);
};
auto total = [&](V t, V& g, V& s, V& bend, V& rest) {
    V f = FLOOR, slope = 0.0f, change = 0.0f;
    rest = 0.0f;
    for (int j = 0; j < count; ++j) {
        const V* const b = element + j * STRIDE;
        const V u = t - b[2], ku = b[1] * u;
        V one = exp(b[0] - ku * u), fall = -2.0f * ku, sharp = b[1];
        const float length = SEGMENTS ? table.axis.data[ids[j]][3] : 0.0f;
        // Ahead of its peak an element counts with its greatest value; circles always, as their field may rise again.
        rest += (u < 0.0f | length < 0.0f) ? b[5] : one;
        if (RINGS && length < 0.0f) {
            const float a2 = table.center.data[ids[j]][3];
            const auto& h = table.height.data[ids[j]];
            V rho, z, i0, difference;
            around(b, u, rho, z);
            bessel(-2.0f * a2 * length * rho, i0, difference);
            const V inner = rho + length, along = (u - z * b[7]) / most(rho, (V)FLOOR);
            one = exp(b[0] - h[0] + h[2] - a2 * (inner * inner + z * z)) * i0;
            fall = -2.0f * a2 * ((inner - length * difference / i0) * along + z * b[7]);
            sharp = a2 * (along * along + b[7] * b[7]);
        }
        if (length > 0.0f) {
            V part, end;
            share(b[6] + b[7] * t, sqrtf(table.center.data[ids[j]][3]) * length, table.height.data[ids[j]][2],
                part, end);
            fall += b[7] * end / most(part, (V)FLOOR);
            one *= part;
        }
        f += one;
        slope += fall * one;
        change += (fall * fall - 2.0f * sharp) * one;
    }
    g = log(f);
    s = slope / f;
    bend = change / f - s * s;
};
auto longest = [&](V t) {
    V far = FOREVER;
    for (int j = 0; j < count; ++j) {
        const V low = element[j * STRIDE + 3], high = element[j * STRIDE + 4];
        V ahead = most(low - t, (V)(1.0f / sqrtf(table.center.data[ids[j]][3])));
        const float radius = RINGS ? -table.axis.data[ids[j]][3] : 0.0f;
        if (radius > 0.0f) {
            V rho, z;
            around(element + j * STRIDE, t - element[j * STRIDE + 2], rho, z);
            ahead = most(ahead, root((rho - radius) * (rho - radius) + z * z) - table.height.data[ids[j]][1]);
        }
        far = ((low < high) & (t < high)) ? least(far, ahead) : far;
    }
    return most(far, 1.0e-6f * t);
};
"""

# Cubics on 0..1 with values a, b and slopes da, db at the ends.
_CUBICS = """
auto cubic_root = [&](V a, V da, V b, V db) {
    const V c2 = 3.0f * (b - a) - 2.0f * da - db, c3 = da + db - 2.0f * (b - a);
    V low = 0.0f, high = 1.0f, u = a / (a - b);
    for (int k = 0; k < 3; ++k) {
        const V value = a + u * (da + u * (c2 + u * c3)), slope = da + u * (2.0f * c2 + 3.0f * u * c3);
        low = value < 0.0f ? u : low;
        high = value < 0.0f ? high : u;
        const V next = u - value / slope;
        u = ((slope > 0.0f) & (next > low) & (next < high)) ? next : 0.5f * (low + high);
    }
    return u;
};
auto suspect = [&](V a, V da, V b, V db) {
    const V bound = most(a + da * (1.0f / 3.0f), b - db * (1.0f / 3.0f));
    const V c2 = 3.0f * (b - a) - 2.0f * da - db, c3 = da + db - 2.0f * (b - a);
    const V rest = root(c2 * c2 - 3.0f * c3 * da);
    const V u = c2 > 0.0f ? (-c2 - rest) / (3.0f * c3) : da / (rest - c2);
    const V value = a + u * (da + u * (c2 + u * c3));
    return ((u > 0.005f) & (u < 0.995f) & (bound > -MARGIN) & (value > -MARGIN)) ? u : (V)0.0f;
};
"""

# Shrinks [t, end] to where the first hit can be; t > end on return if there is no such place. Where F >= 1, at least
# one of n elements is at least 1/n, and each is at least 1 less the sum of the other peaks.
_BRACKET = """
const C blocked = opaque < far;
auto bracket = [&](V& t, V& end) {
    V number_met = 0.0f, peaks = 0.0f, begin = FOREVER, last = -1.0f;
    for (int j = 0; j < count; ++j) {
        V* const b = element + j * STRIDE;
        const V u = b[2] - least(most(b[2], t), end);
        b[5] = exp(b[0] - b[1] * u * u);
        peaks += b[5];
        number_met += ((b[3] <= end) & (b[4] >= t)) ? (V)1.0f : (V)0.0f;
    }
    const V equal_part = 1.0f / most(number_met, (V)1.0f);
    for (int j = 0; j < count; ++j) {
        const V* const b = element + j * STRIDE;
        const V part = least(most(equal_part, 1.0f + b[5] - peaks), (V)1.0f);
        const V half = root((b[0] - log(part)) / b[1]);
        const V low = most(most(b[2] - half, b[3]), t), high = least(least(b[2] + half, b[4]), end);
        begin = low < high ? least(begin, low) : begin;
        last = low < high ? most(last, high) : last;
    }
    const C possible = blocked | (peaks >= 1.0f - CUT);
    // The ray ends where one element alone exceeds the level.
    t = possible ? (blocked ? least(begin, end) : begin) : (V)FOREVER;
    end = blocked ? end : last;
};
V t = 0.0f, end = opaque, hit = NO_HIT;
bracket(t, end);
C looking = (t <= end) & (far > 0.0f);
if (SHADOW) {
    hit = blocked ? opaque : hit;
    looking = looking & !blocked;
}
t = looking ? t : (V)0.0f;
end = looking ? end : (V)0.0f;
// Keep the elements above the cut in the bracket; the sharpest bounds the second derivative.
int left = 0;
float sharpness = 0.0f;
for (int j = 0; any(looking) && j < count; ++j) {
    const V* const b = element + j * STRIDE;
    if (!any(looking & (b[3] < b[4]) & (b[3] <= end) & (b[4] >= t)))
        continue;
    ids[left] = ids[j];
    for (int k = 0; k < STRIDE; ++k)
        element[left * STRIDE + k] = b[k];
    const float k = table.center.data[ids[j]][3];
    sharpness = k > sharpness ? k : sharpness;
    ++left;
}
count = left;
"""

_SEARCH = """
// From the node t, where F < 1, to the next node t_e; if `fresh`, there is no node before t_e.
V g = 0.0f, s = 0.0f, bend = 0.0f, length = FOREVER, t_e = t, tries = 0.0f;
V right = t, g_right = 0.0f, s_right = 0.0f;
C fresh = looking, rooting = looking & !looking, ends = blocked;
for (int k = 0; k < MOST && any(looking); ++k) {
    V g_e, s_e, bend_e, rest;
    total(t_e, g_e, s_e, bend_e, rest);
    // The end of a blocked ray is inside by construction: override rounding.
    g_e = (ends & (t_e >= end)) ? most(g_e, (V)0.0f) : g_e;
    // A shadow ray starts outside, at least ON_SURFACE below the level.
    g_e = (fresh & (t_e <= 0.0f) & (far < (SHADOW ? 2.0f * FOREVER : -1.0f))) ? least(g_e, (V)-ON_SURFACE) : g_e;
    // The bracket's edge is on the surface (one element alone), or the ray starts inside.
    const C edge = looking & fresh & (g_e >= -CUT);
    hit = edge ? (t_e > 0.0f ? t_e : (V)GIVEN_UP) : hit;
    looking = looking & !edge;
    const C below = g_e < 0.0f;
    // The step may have crossed a surface and left it again (if F < 1 at t_e), or crossed it three times (if F rises).
    C passed = looking & !rooting & below;
    if (!SHADOW)
        passed = looking & !rooting & (below | (s_e > 0.0f));
    C split = passed & !passed;
    V between = t_e;
    if (any(passed & !fresh)) {
        const V h = t_e - t, u = suspect(g, s * h, g_e, s_e * h);
        split = passed & !fresh & (u * h > 0.02f * length) & (tries < (float)SPLITS);
        between = t + u * h;
    }
    const C on = passed & below & !split;
    // A root is certain to be close: the second derivative of log F is at least -2 sharpness.
    const C sure = (s_e > 0.0f) & (s_e * s_e > 4.0f * sharpness * size(g_e)) & !split & !fresh;
    const C near_root = looking & ((sure & (size(g_e) < CLOSE)) | (rooting & (tries > (float)TRIES)));
    // The nearer root of the parabola; at a grazing ray a Newton step would be too short.
    const V parabola = -2.0f * g_e / most(s_e + root(s_e * s_e - 2.0f * g_e * bend_e), (V)1.0e-20f);
    const V last = least(most(t_e + parabola, t), rooting ? right : end);
    hit = near_root ? (s_e > 0.0f ? last : t_e) : hit;
    looking = looking & !near_root & !(on & ((t_e >= end) | ((rest < 1.0f - CUT) & !ends)));
    // Move the left or the right end of the bracket to t_e.
    const C forward = on | (rooting & below);
    t = forward ? t_e : t;
    g = forward ? g_e : g;
    s = forward ? s_e : s;
    bend = forward ? bend_e : bend;
    const C behind = !below & !split;
    right = behind ? t_e : right;
    g_right = behind ? g_e : g_right;
    s_right = behind ? s_e : s_right;
    tries = (split | rooting) ? tries + 1.0f : (V)0.0f;
    rooting = rooting | behind;
    end = (split & !below) ? t_e : end;
    ends = ends | (split & !below);
    t_e = split ? between : t_e;
    fresh = fresh & !fresh;
    if (any(looking & rooting)) {
        const V h = right - t;
        t_e = rooting ? t + h * cubic_root(g, s * h, g_right, s_right * h) : t_e;
    }
    if (any(looking & on)) {
        // Step to where a parabola reaches 0, at most as far as the cubics hold.
        const V inner = s * s - 2.0f * g * bend;
        const V up = ((s > 0.0f) & (inner > 0.0f)) ? -2.0f * g / (s + root(inner)) : (V)FOREVER;
        length = on ? longest(t) : length;
        t_e = on ? least(t + least(length, up), end) : t_e;
        if (k % 2 == 1) {
            V begin = t, last_end = end;
            bracket(begin, last_end);
            end = (on & !ends) ? last_end : end;
            looking = looking & !(on & (begin > end) & !ends);
            fresh = on & (begin > t_e);
            t_e = on ? least(most(begin, t_e), end) : t_e;
        }
    }
}
store(rays.data, 7, hit);
for (int j = 0; !SHADOW && j < count; ++j)
    chosen.data[j] = ids[j];
return count;
"""
_OVERFLOW = """
if (count < 0) {
    store(rays.data, 7, far > 0.0f ? (V)GIVEN_UP : (V)NO_HIT);
    return 0;
}
"""


def shapes(kind):
    """Constants that say which primitives occur, so that the compiler drops the code of others."""
    return {"SEGMENTS": KINDS.index(kind) >= 1, "RINGS": KINDS.index(kind) >= 2}


@functools.cache
def first_hits_function(kind, width, shadow):
    """The Warp function that finds the first hits of `width` rays with elements of a kind (one of KINDS).

    shadow: any hit counts, and rays start outside.
    """
    body = _GATHER + _OVERFLOW + SHARE + BESSEL + _FIELD + _CUBICS + _BRACKET + _SEARCH

    @wp.func_native(cpp(width, body, SHADOW=shadow, **shapes(kind), **_CONSTANTS))
    def first_hits(
        table: GaussianElements,
        list: wp.array(dtype=int),
        first: int,
        last: int,
        near: wp.array(dtype=float),
        rays: wp.array(dtype=float),
        chosen: wp.array(dtype=int),
    ) -> int: ...

    return first_hits
