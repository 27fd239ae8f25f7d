"""Primary rays of scenes made of bells: several samples side by side, see `lanes` and `lockstep`."""

# ruff: noqa: UP018, RUF046 - float(0.0) and int(0) make variables that Warp lets a loop change

import functools

import warp as wp

from fieldsim.render import hermite, lockstep
from fieldsim.render.bells import SHARE, Bells
from fieldsim.render.candidates import TILE, Candidates, View
from fieldsim.render.lanes import OPTIONS, cpp
from fieldsim.render.primary import OVERFLOW, nearest_ball
from fieldsim.render.shading import BALLS, Balls, Hits
from fieldsim.render.textures import color_at

# Rows of what is seen: material's colour, light factors, normal, depth, kernel's width, and the material itself.
_COLOR, _LIGHT, _NORMAL, _DEPTH, _WIDTH, _THING, _LOOK_ROWS = (wp.constant(k) for k in (0, 3, 7, 10, 11, 12, 13))
_TEXTURE = wp.constant(8)  # column of a material

# Unit directions through points of the picture, given as the two rows after the rays'.
_EXACT_DIRECTION = """
const D px = wide(load(rays.data, RAY_ROWS)), py = wide(load(rays.data, RAY_ROWS + 1));
D ex = view.corner[0] + px * view.across[0] + py * view.down[0];
D ey = view.corner[1] + px * view.across[1] + py * view.down[1];
D ez = view.corner[2] + px * view.across[2] + py * view.down[2];
const D per_length = 1.0 / exact_root(ex * ex + ey * ey + ez * ez);
ex *= per_length; ey *= per_length; ez *= per_length;
"""
_DIRECTIONS = """
store(rays.data, 3, narrow(ex));
store(rays.data, 4, narrow(ey));
store(rays.data, 5, narrow(ez));
"""

# Gradients summed, materials mixed by weight; the last steps to the root are Newton's, at exact places.
_DESCRIBE = """
const V found = load(rays.data, 7);
const V dx = narrow(ex), dy = narrow(ey), dz = narrow(ez);
const C hit = found >= 0.0f;
D t = wide(hit ? found : (V)0.0f);
V gx, gy, gz, width = 0.0f, thing = 0.0f;
bool textured = false;
for (int step = 0; step < 3; ++step) {
    V f = 1.0e-30f, greatest = -1.0f, light[7] = {};
    gx = gy = gz = (V)0.0f;
    textured = false;
    for (int j = 0; j < count; ++j) {
        const int i = chosen.data[j], m = owner.data[i];
        const double* const row = wp::address(exact, i, 0);
        const auto& c = table.center.data[i];
        const auto& axis = table.axis.data[i];
        D x = t * ex - row[5], y = t * ey - row[6], z = t * ez - row[7];
        V one = 1.0f, fall = 0.0f;
        if (SEGMENTS && axis[3] > 0.0f) {
            const D along = row[14] * x + row[15] * y + row[16] * z;
            x -= row[14] * along; y -= row[15] * along; z -= row[16] * along;
            const float a = sqrtf(c[3]);
            share(a * narrow(along), a * axis[3], table.height.data[i][2], one, fall);
            fall *= a;
        }
        const V rx = narrow(x), ry = narrow(y), rz = narrow(z);
        const V bell = exp(table.height.data[i][0] - c[3] * (rx * rx + ry * ry + rz * rz));
        one *= bell;
        fall *= bell;
        const V pull = -2.0f * c[3] * one;
        gx += pull * rx + fall * axis[0];
        gy += pull * ry + fall * axis[1];
        gz += pull * rz + fall * axis[2];
        f += one;
        const float* const material = wp::address(materials, m, 0);
        for (int k = 0; k < 7; ++k)
            light[k] += material[k] * one;
        textured |= material[TEXTURE] != 0.0f;
        thing = one > greatest ? (V)(float)m : thing;
        width = one > greatest ? (V)widths.data[i] : width;
        greatest = most(greatest, one);
        store(weights.data, j, one);
    }
    const V rise = gx * dx + gy * dy + gz * dz, steepness = root(gx * gx + gy * gy + gz * gz), per_f = 1.0f / f;
    for (int k = 0; k < 7; ++k)
        store(seen.data, k, per_f * light[k]);
    store(seen.data, 7, -gx / steepness);
    store(seen.data, 8, -gy / steepness);
    store(seen.data, 9, -gz / steepness);
    store(seen.data, 11, width);
    store(seen.data, 12, hit ? thing : (V)-1.0f);
    // Where the ray only grazes, a step is no use.
    const C steep = hit & (rise > GRAZING * steepness);
    const V limit = POLISH * width;
    V move = (1.0f - f) / rise;
    move = steep ? least(most(move, -limit), limit) : (V)0.0f;
    t += wide(move);
    if (!any(size(move) > 0.01f * limit))
        break;
}
store(seen.data, 10, narrow(t));
return textured;
"""


@functools.cache
def bells_kernel(segments, width):
    """The kernel that traces samples of scenes made of bells, `width` at a time."""
    first_hits = lockstep.first_hits_function(segments, width, shadow=False)
    rows = int(lockstep.RAY_ROWS)
    room = lockstep.ROOM
    constants = {"RAY_ROWS": rows, "TEXTURE": int(_TEXTURE), "SEGMENTS": segments, "GRAZING": 0.002, "POLISH": 0.01}

    @wp.func_native(cpp(width, _EXACT_DIRECTION + _DIRECTIONS, **constants))
    def directions(view: View, rays: wp.array(dtype=float)): ...

    @wp.func_native(cpp(width, _EXACT_DIRECTION + SHARE + _DESCRIBE, **constants))
    def describe(
        view: View,
        table: Bells,
        exact: wp.array2d(dtype=wp.float64),
        materials: wp.array2d(dtype=float),
        owner: wp.array(dtype=int),
        widths: wp.array(dtype=float),
        rays: wp.array(dtype=float),
        chosen: wp.array(dtype=int),
        count: int,
        weights: wp.array(dtype=float),
        seen: wp.array(dtype=float),
    ) -> bool: ...

    @wp.func
    def three(rows: wp.array(dtype=float), row: int, lane: int):
        return wp.vec3(rows[row * width + lane], rows[(row + 1) * width + lane], rows[(row + 2) * width + lane])

    @wp.func
    def mixed(
        p: wp.vec3,
        lane: int,
        scene: hermite.Scene,
        chosen: wp.array(dtype=int),
        count: int,
        weights: wp.array(dtype=float),
    ):
        """The colour at p of textures mixed by weight."""
        color = wp.vec3(0.0, 0.0, 0.0)
        f = float(0.0)
        for j in range(count):
            weight = weights[j * width + lane]
            color += weight * color_at(scene, scene.owner[chosen[j]], p)
            f += weight
        return color / f

    @wp.func
    def record(i: int, lane: int, seen: wp.array(dtype=float), hits: Hits):
        hits.thing[i] = int(seen[_THING * width + lane])
        hits.depth[i] = seen[_DEPTH * width + lane]
        hits.lift[i] = 2.0e-3 * seen[_WIDTH * width + lane]
        hits.normal[i] = three(seen, _NORMAL, lane)
        hits.color[i] = three(seen, _COLOR, lane)
        light = _LIGHT * width + lane
        hits.light[i] = wp.vec4(seen[light], seen[light + width], seen[light + 2 * width], seen[light + 3 * width])

    @wp.func
    def record_else(i: int, far: float, ball: int, balls: Balls, hits: Hits):
        """Sample i sees a particle, or nothing."""
        hits.depth[i] = hermite.NO_HIT
        hits.thing[i] = -1
        hits.normal[i] = wp.vec3(0.0, 0.0, 0.0)
        if ball >= 0:
            hits.depth[i] = far
            hits.thing[i] = BALLS + ball
            hits.normal[i] = wp.normalize(far * hits.direction[i] - balls.center[ball])
            hits.color[i] = balls.color[ball]
            hits.light[i] = wp.vec4(1.0, 0.9, 0.25, 40.0)
            hits.lift[i] = 1.0e-3 * balls.radius[ball]

    @wp.func
    def trace(
        begin: int,
        number: int,
        view: View,
        scene: hermite.Scene,
        table: Bells,
        lists: Candidates,
        balls: Balls,
        ball_lists: Candidates,
        samples: wp.array(dtype=wp.vec2),
        hits: Hits,
        rays: wp.array(dtype=float),
        chosen: wp.array(dtype=int),
        weights: wp.array(dtype=float),
        seen: wp.array(dtype=float),
    ):
        """Samples begin..begin + number, fewer than `width`."""
        for lane in range(width):
            s = samples[begin + wp.min(lane, number - 1)]
            rays[rows * width + lane] = s[0]
            rays[(rows + 1) * width + lane] = s[1]
        directions(view, rays)
        done = int(0)
        while done < number:
            # Samples of one tile at a time.
            x = int(rays[rows * width + done]) // TILE
            y = int(rays[(rows + 1) * width + done]) // TILE
            tile = y * view.tiles + x
            end = int(done)
            for lane in range(width):
                rays[lockstep.FAR * width + lane] = 0.0
            while end < number:
                same_x = int(rays[rows * width + end]) // TILE == x
                if not same_x or int(rays[(rows + 1) * width + end]) // TILE != y:
                    break
                d = three(rays, lockstep.DIRECTION, end)
                hits.direction[begin + end] = d
                far, ball = nearest_ball(d, tile, ball_lists, balls)
                rays[lockstep.FAR * width + end] = far
                record_else(begin + end, far, ball, balls, hits)
                end += 1
            first = lists.first[tile]
            last = lists.first[tile + 1]
            if first < last:
                count = first_hits(table, lists.ids, first, last, lists.near, rays, chosen)
                textured = False
                if count > 0:
                    textured = describe(
                        view, table, scene.exact, scene.materials, scene.owner, scene.width, rays, chosen, count,
                        weights, seen,
                    )  # fmt: skip
                for lane in range(done, end):
                    hit = rays[lockstep.HIT * width + lane]
                    if hit == lockstep.GIVEN_UP:
                        hits.thing[begin + lane] = OVERFLOW
                    elif hit >= 0.0:
                        record(begin + lane, lane, seen, hits)
                        if textured:
                            p = hits.depth[begin + lane] * hits.direction[begin + lane]
                            hits.color[begin + lane] = mixed(p, lane, scene, chosen, count, weights)
            done = end

    @wp.kernel(module="unique", enable_backward=False, module_options=OPTIONS)
    def trace_bells(
        start: int,
        group: int,
        view: View,
        scene: hermite.Scene,
        table: Bells,
        lists: Candidates,
        balls: Balls,
        ball_lists: Candidates,
        samples: wp.array(dtype=wp.vec2),
        hits: Hits,
    ):
        rays = wp.zeros(shape=wp.static((rows + 2) * width), dtype=float)
        chosen = wp.zeros(shape=room, dtype=int)
        weights = wp.zeros(shape=wp.static(room * width), dtype=float)
        seen = wp.zeros(shape=wp.static(int(_LOOK_ROWS) * width), dtype=float)
        first = (start + wp.tid()) * group
        last = wp.min(first + group, samples.shape[0])
        for i in range(first, last, width):
            number = wp.min(last - i, width)
            trace(
                i, number, view, scene, table, lists, balls, ball_lists, samples, hits, rays, chosen, weights, seen
            )

    return trace_bells
