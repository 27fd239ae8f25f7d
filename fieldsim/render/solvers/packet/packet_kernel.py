"""Primary rays in scenes of Gaussian elements: several samples side by side, see `simd` and `packet_tracer`."""

# ruff: noqa: UP018, RUF046 - float(0.0) and int(0) make variables that Warp lets a loop change

import functools

import warp as wp

from fieldsim.potentials.row import AXIS_X, NORMAL_X, POINT_X
from fieldsim.render.materials.table import KIND
from fieldsim.render.materials.textures import color_at
from fieldsim.render.scene.candidates import TILE, Candidates, View
from fieldsim.render.scene.hits import Balls, Hits
from fieldsim.render.scene.tables import FOREVER, SceneTables
from fieldsim.render.solvers.packet import packet_tracer
from fieldsim.render.solvers.packet.gaussian_elements import BESSEL, SHARE, GaussianElements
from fieldsim.render.solvers.packet.simd import OPTIONS, cpp, group_of
from fieldsim.render.solvers.primary import OVERFLOW, nearest_ball, record_ball

# Rows after the rays': points of the picture, and their tiles.
_POINT, _TILE, _ROWS = int(packet_tracer.RAY_ROWS), int(packet_tracer.RAY_ROWS) + 2, int(packet_tracer.RAY_ROWS) + 3
# Rows of what is seen: material's colour (3), factors of light (4), normal (3), depth, kernel's width, the material
# itself, optics (4), what rounding leaves of the depth.
_LOOK_ROWS = 18

_EXACT_DIRECTION = """
const V px = load(rays.data, POINT), py = load(rays.data, POINT + 1);
D ex = view.corner[0] + wide(px) * view.across[0] + wide(py) * view.down[0];
D ey = view.corner[1] + wide(px) * view.across[1] + wide(py) * view.down[1];
D ez = view.corner[2] + wide(px) * view.across[2] + wide(py) * view.down[2];
const D per_length = 1.0 / exact_root(ex * ex + ey * ey + ez * ez);
ex *= per_length; ey *= per_length; ez *= per_length;
"""

# Rays through samples; their hits start as misses.
_LEAVE_POINTS = """
for (int lane = 0; lane < WIDTH; ++lane) {
    const auto& sample = samples.data[begin + (lane < number ? lane : number - 1)];
    rays.data[POINT * WIDTH + lane] = sample[0];
    rays.data[(POINT + 1) * WIDTH + lane] = sample[1];
}
"""
_LEAVE = """
store(rays.data, 3, narrow(ex));
store(rays.data, 4, narrow(ey));
store(rays.data, 5, narrow(ez));
store(rays.data, TILE_ROW, real(whole(py / (float)TILE)) * (float)view.tiles + real(whole(px / (float)TILE)));
const float* const d = rays.data + 3 * WIDTH;
for (int lane = 0; lane < number; ++lane) {
    hits.direction.data[begin + lane] = wp::vec_t<3, float>(d[lane], d[WIDTH + lane], d[2 * WIDTH + lane]);
    hits.normal.data[begin + lane] = wp::vec_t<3, float>(0.0f);
    hits.depth.data[begin + lane] = -1.0f;
    hits.thing.data[begin + lane] = -1;
}
"""

# Makes the rays active that share the tile of the first unfinished one, and no others; returns the index after them.
_SAME_TILE = """
const float* const tiles = rays.data + TILE_ROW * WIDTH;
int end = done;
while (end < number && tiles[end] == tiles[done])
    ++end;
for (int lane = 0; lane < WIDTH; ++lane)
    rays.data[FAR * WIDTH + lane] = lane >= done && lane < end ? FOREVER : 0.0f;
return end;
"""

_RECORD = """
for (int lane = first; lane < last; ++lane) {
    const float found = rays.data[HIT * WIDTH + lane];
    const float* const x = seen.data + lane;
    const int i = begin + lane;
    if (found == GIVEN_UP)
        hits.thing.data[i] = OVERFLOW;
    if (!(found >= 0.0f))
        continue;
    hits.color.data[i] = wp::vec_t<3, float>(x[0], x[WIDTH], x[2 * WIDTH]);
    hits.light.data[i] = wp::vec_t<4, float>(x[3 * WIDTH], x[4 * WIDTH], x[5 * WIDTH], x[6 * WIDTH]);
    hits.normal.data[i] = wp::vec_t<3, float>(x[7 * WIDTH], x[8 * WIDTH], x[9 * WIDTH]);
    hits.depth.data[i] = x[10 * WIDTH];
    if (hits.rest.shape[0] > 0)
        hits.rest.data[i] = x[17 * WIDTH];
    hits.lift.data[i] = 2.0e-3f * x[11 * WIDTH];
    hits.thing.data[i] = (int)x[12 * WIDTH];
    if (hits.optics.shape[0] > 0)
        hits.optics.data[i] = wp::vec_t<4, float>(x[13 * WIDTH], x[14 * WIDTH], x[15 * WIDTH], x[16 * WIDTH]);
}
"""

# Sums gradients and mixes materials by their fields; up to three Newton steps in float64 refine the root.
_DESCRIBE = """
const V found = load(rays.data, 7);
const V dx = narrow(ex), dy = narrow(ey), dz = narrow(ez);
const C hit = found >= 0.0f;
D t = wide(hit ? found : (V)0.0f);
V gx, gy, gz, width = 0.0f, thing = 0.0f;
const bool optical = hits.optics.shape[0] > 0;
bool textured = false;
for (int step = 0; step < 3; ++step) {
    V f = 1.0e-30f, greatest = -1.0f, light[7] = {}, optics[4] = {};
    gx = gy = gz = (V)0.0f;
    textured = false;
    for (int j = 0; j < count; ++j) {
        const int i = chosen.data[j], m = scene.owner.data[i];
        const double* const row = wp::address(scene.exact, i, 0);
        const auto& c = table.center.data[i];
        const auto& axis = table.axis.data[i];
        D x = t * ex - row[POINT_X], y = t * ey - row[POINT_X + 1], z = t * ez - row[POINT_X + 2];
        // log F falls by `pull` across and by `fall` along the axis.
        V one = 1.0f, fall = 0.0f, pull = 2.0f * c[3], log_f = table.height.data[i][0];
        if (SEGMENTS && axis[3] > 0.0f) {
            const D along = row[AXIS_X] * x + row[AXIS_X + 1] * y + row[AXIS_X + 2] * z;
            x -= row[AXIS_X] * along; y -= row[AXIS_X + 1] * along; z -= row[AXIS_X + 2] * along;
            const float a = sqrtf(c[3]);
            share(a * narrow(along), a * axis[3], table.height.data[i][2], one, fall);
            fall *= -a;
        }
        V height = 0.0f;
        if (RINGS && axis[3] < 0.0f) {
            const D above = row[NORMAL_X] * x + row[NORMAL_X + 1] * y + row[NORMAL_X + 2] * z;
            x -= row[NORMAL_X] * above; y -= row[NORMAL_X + 1] * above; z -= row[NORMAL_X + 2] * above;
            height = narrow(above);
        }
        const V rx = narrow(x), ry = narrow(y), rz = narrow(z);
        V near2 = rx * rx + ry * ry + rz * rz;
        if (RINGS && axis[3] < 0.0f) {
            const V rho = most(root(near2), (V)1.0e-12f), inner = rho + axis[3];
            V difference;
            bessel(-2.0f * c[3] * axis[3] * rho, one, difference);
            log_f = table.height.data[i][2];
            near2 = inner * inner + height * height;
            pull *= (inner - axis[3] * difference / one) / rho;
            fall = 2.0f * c[3] * height * one;
        }
        const V gauss = exp(log_f - c[3] * near2);
        one *= gauss;
        fall *= gauss;
        pull *= one;
        gx -= pull * rx + fall * axis[0];
        gy -= pull * ry + fall * axis[1];
        gz -= pull * rz + fall * axis[2];
        f += one;
        const float* const material = wp::address(scene.materials, m, 0);
        for (int k = 0; k < 7; ++k)
            light[k] += material[k] * one;
        for (int k = 0; optical && k < 4; ++k)
            optics[k] += scene.optics.data[m][k] * one;
        textured |= material[TEXTURE] != 0.0f;
        thing = one > greatest ? (V)(float)m : thing;
        width = one > greatest ? (V)scene.width.data[i] : width;
        greatest = most(greatest, one);
        store(weights.data, j, one);
    }
    const V rise = gx * dx + gy * dy + gz * dz, steepness = root(gx * gx + gy * gy + gz * gz), per_f = 1.0f / f;
    for (int k = 0; k < 7; ++k)
        store(seen.data, k, per_f * light[k]);
    for (int k = 0; optical && k < 4; ++k)
        store(seen.data, 13 + k, per_f * optics[k]);
    store(seen.data, 7, -gx / steepness);
    store(seen.data, 8, -gy / steepness);
    store(seen.data, 9, -gz / steepness);
    store(seen.data, 11, width);
    store(seen.data, 12, hit ? thing : (V)-1.0f);
    // At a grazing ray the slope is too small for a Newton step.
    const C steep = hit & (rise > GRAZING * steepness);
    const V limit = POLISH * width;
    V move = (1.0f - f) / rise;
    move = steep ? least(most(move, -limit), limit) : (V)0.0f;
    t += wide(move);
    if (!any(size(move) > 0.01f * limit))
        break;
}
store(seen.data, 10, narrow(t));
store(seen.data, 17, narrow(t - wide(narrow(t))));
return textured;
"""


@functools.cache
def packet_kernel(kind, width):
    """The kernel that traces samples of scenes of Gaussian elements, `width` at a time."""
    first_hits = packet_tracer.first_hits_function(kind, width, shadow=False)
    room = packet_tracer.ROOM
    group = group_of(width)
    leave, same_tile, describe, record = _natives(kind, width)

    @wp.func
    def clip_to_balls(
        begin: int,
        first: int,
        last: int,
        tile: int,
        balls: Balls,
        lists: Candidates,
        hits: Hits,
        rays: wp.array(dtype=float),
    ):
        """Let rays end at the nearest particle."""
        for lane in range(first, last):
            i = begin + lane
            far, ball = nearest_ball(hits.direction[i], tile, lists, balls)
            if ball >= 0:
                rays[packet_tracer.FAR * width + lane] = far
                record_ball(i, far, ball, balls, hits)

    @wp.func
    def mix_textures(
        begin: int,
        first: int,
        last: int,
        scene: SceneTables,
        hits: Hits,
        rays: wp.array(dtype=float),
        chosen: wp.array(dtype=int),
        count: int,
        weights: wp.array(dtype=float),
    ):
        """Colours of materials with textures, mixed by weight."""
        for lane in range(first, last):
            i = begin + lane
            if rays[packet_tracer.HIT * width + lane] >= 0.0:
                here = hits.depth[i] * hits.direction[i]
                color = wp.vec3(0.0, 0.0, 0.0)
                f = float(0.0)
                for j in range(count):
                    weight = weights[j * width + lane]
                    color += weight * color_at(scene, scene.owner[chosen[j]], chosen[j], here)
                    f += weight
                hits.color[i] = color / f

    @wp.func
    def trace(
        begin: int,
        number: int,
        view: View,
        scene: SceneTables,
        table: GaussianElements,
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
        """Write the hits of `number` samples, one tile's samples at a time."""
        leave(view, samples, begin, number, rays, hits)
        done = int(0)
        while done < number:
            tile = int(rays[wp.static(_TILE * width) + done])
            end = same_tile(rays, done, number)
            if balls.radius.shape[0] > 0:
                clip_to_balls(begin, done, end, tile, balls, ball_lists, hits, rays)
            if lists.first[tile] < lists.first[tile + 1]:
                count = first_hits(table, lists.ids, lists.first[tile], lists.first[tile + 1], lists.near, rays, chosen)
                textured = False
                if count > 0:
                    textured = describe(view, scene, table, rays, chosen, count, weights, seen, hits)
                record(begin, done, end, rays, seen, hits)
                if textured:
                    mix_textures(begin, done, end, scene, hits, rays, chosen, count, weights)
            done = end

    @wp.kernel(module="unique", enable_backward=False, module_options=OPTIONS)
    def trace_packets(
        start: int,
        view: View,
        scene: SceneTables,
        table: GaussianElements,
        lists: Candidates,
        balls: Balls,
        ball_lists: Candidates,
        samples: wp.array(dtype=wp.vec2),
        hits: Hits,
    ):
        rays = wp.zeros(shape=wp.static(_ROWS * width), dtype=float)
        chosen = wp.zeros(shape=room, dtype=int)
        weights = wp.zeros(shape=wp.static(room * width), dtype=float)
        seen = wp.zeros(shape=wp.static(_LOOK_ROWS * width), dtype=float)
        first = (start + wp.tid()) * group
        last = wp.min(first + group, samples.shape[0])
        for i in range(first, last, width):
            number = wp.min(last - i, width)
            trace(i, number, view, scene, table, lists, balls, ball_lists, samples, hits, rays, chosen, weights, seen)

    return trace_packets


def _natives(kind, width):
    """(leave, same_tile, describe, record): the parts of the kernel that work on `width` rays at once."""
    constants = {
        **packet_tracer.shapes(kind),
        "POINT": _POINT,
        "POINT_X": POINT_X,
        "AXIS_X": AXIS_X,
        "NORMAL_X": NORMAL_X,
        "TILE_ROW": _TILE,
        "TILE": TILE,
        "FAR": int(packet_tracer.FAR),
        "HIT": int(packet_tracer.HIT),
        "FOREVER": float(FOREVER),
        "GIVEN_UP": float(packet_tracer.GIVEN_UP),
        "OVERFLOW": int(OVERFLOW),
        "TEXTURE": int(KIND),
        "GRAZING": 0.002,  # sine of the angle at which a ray grazes
        "POLISH": 0.01,  # the longest step, in kernel widths
    }

    @wp.func_native(cpp(width, _LEAVE_POINTS + _EXACT_DIRECTION + _LEAVE, **constants))
    def leave(
        view: View, samples: wp.array(dtype=wp.vec2), begin: int, number: int, rays: wp.array(dtype=float), hits: Hits
    ): ...

    @wp.func_native(cpp(width, _SAME_TILE, **constants))
    def same_tile(rays: wp.array(dtype=float), done: int, number: int) -> int: ...

    @wp.func_native(cpp(width, _EXACT_DIRECTION + SHARE + BESSEL + _DESCRIBE, **constants))
    def describe(
        view: View,
        scene: SceneTables,
        table: GaussianElements,
        rays: wp.array(dtype=float),
        chosen: wp.array(dtype=int),
        count: int,
        weights: wp.array(dtype=float),
        seen: wp.array(dtype=float),
        hits: Hits,
    ) -> bool: ...

    @wp.func_native(cpp(width, _RECORD, **constants))
    def record(
        begin: int, first: int, last: int, rays: wp.array(dtype=float), seen: wp.array(dtype=float), hits: Hits
    ): ...

    return leave, same_tile, describe, record
