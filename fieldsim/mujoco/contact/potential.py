"""Contact by a potential: every geom as a few ellipsoids, pushed out of the surface F = 1 where they reach into it.

An ellipsoid reaches in by depth = max over its points of log(F) / slope, about a length, and stores the energy
stiffness depth^3 / 3. The force is that of the deepest point alone, exactly: where that point lies changes the depth
only in second order. What is lost to damping and friction depends on the velocity there.

Rows of `balls`: see `mujoco.contact.rows`. `law` is (slope, damping, friction, whether gravcomp counts).
"""

import functools
import itertools
import math

import numpy as np

from fieldsim.mujoco.callback.evaluate import field_at, group_field, jet_at, maker, room_at, turns, vectors
from fieldsim.mujoco.callback.rows import SHIFT_X, TURN_X
from fieldsim.mujoco.contact.rows import CENTER_X, LARGE, RADIUS, SHAPE_XX, STIFFNESS

# The search ends when a step turns the direction by less than this (the depth then is right to its square).
CLOSE = 1e-8
STEPS = 40
# Curvatures count as at least this share of the greatest.
RIDGE = 1e-3
# Corners and faces of a cube: where a large ball's search may start.
_STARTS = np.array([d for d in itertools.product((-1, 0, 1), repeat=3) if np.abs(d).sum() in (1, 3)])
STARTS = tuple(map(tuple, (_STARTS / np.linalg.norm(_STARTS, axis=1)[:, None]).tolist()))


@functools.cache
def _uphill(native: bool):
    """Function (u, g, h): one step of Newton's method on the unit sphere towards the greatest value; (u, length)."""
    dot, cross, between = vectors(native)

    @maker(native)
    def unit(v):
        size = math.sqrt(dot(v, v))
        return v[0] / size, v[1] / size, v[2] / size

    @maker(native)
    def step(u, g, h):
        away = (1.0, 0.0, 0.0) if abs(u[0]) < 0.7 else (0.0, 1.0, 0.0)
        a = unit(cross(u, away))
        b = cross(u, a)
        ga, gb = dot(g, a), dot(g, b)
        steep = dot(g, u)
        aa, ab, bb = between(a, h, a) - steep, between(a, h, b), between(b, h, b) - steep
        # Make the curvatures negative and bound them away from 0, for an ascent step of bounded length, also along a
        # ridge.
        middle, half = 0.5 * (aa + bb), 0.5 * (aa - bb)
        radius = max(math.sqrt(half * half + ab * ab), 1e-300)
        least = max(RIDGE * (abs(middle) + radius), 1e-300)
        f, g = 1.0 / max(abs(middle - radius), least), 1.0 / max(abs(middle + radius), least)
        same, other = 0.5 * (f + g), 0.5 * (g - f) / radius
        da = same * ga + other * (half * ga + ab * gb)
        db = same * gb + other * (ab * ga - half * gb)
        length = math.sqrt(da * da + db * db)
        if length > 0.5:
            da, db = 0.5 * da / length, 0.5 * db / length
        return unit((u[0] + da * a[0] + db * b[0], u[1] + da * a[1] + db * b[1], u[2] + da * a[2] + db * b[2])), length

    return step


@functools.cache
def deepest(native: bool):
    """Function (centre, S, many, source, turns) -> the point of the ellipsoid with the greatest F, F, gradient.

    S: nine numbers by rows, world frame; many: start from many directions.
    """
    jet = jet_at(native)
    field = field_at(native)
    dot, _, between = vectors(native)
    step = _uphill(native)
    starts = STARTS

    @maker(native)
    def reached(c, s, u):
        return (
            c[0] + s[0] * u[0] + s[1] * u[1] + s[2] * u[2],
            c[1] + s[3] * u[0] + s[4] * u[1] + s[5] * u[2],
            c[2] + s[6] * u[0] + s[7] * u[1] + s[8] * u[2],
        )

    @maker(native)
    def begin(c, s, many, source, turned):
        """The direction to start in: up the gradient, or the best of many."""
        f, g = field(c, source, turned)
        x, y, z = (s[0], s[3], s[6]), (s[1], s[4], s[7]), (s[2], s[5], s[8])
        u = dot(x, g), dot(y, g), dot(z, g)
        size = math.sqrt(dot(u, u))
        if size > 0.0:
            u = u[0] / size, u[1] / size, u[2] / size
        else:
            u = 0.0, 0.0, -1.0
        if many:
            best, _ = field(reached(c, s, u), source, turned)
            for start in starts:
                f, _ = field(reached(c, s, start), source, turned)
                if f > best:
                    best, u = f, start
        return u

    @maker(native)
    def search(c, s, many, source, turned):
        x, y, z = (s[0], s[3], s[6]), (s[1], s[4], s[7]), (s[2], s[5], s[8])
        u = begin(c, s, many, source, turned)
        p = reached(c, s, u)
        f, g, _ = jet(p, source, turned)
        for _ in range(STEPS):
            p = reached(c, s, u)
            f, g, h = jet(p, source, turned)
            if not f > 0.0:
                break
            # Derivatives of log F by u.
            gu = dot(x, g) / f, dot(y, g) / f, dot(z, g) / f
            hu = (
                between(x, h, x) / f - gu[0] * gu[0],
                between(y, h, y) / f - gu[1] * gu[1],
                between(z, h, z) / f - gu[2] * gu[2],
                between(x, h, y) / f - gu[0] * gu[1],
                between(x, h, z) / f - gu[0] * gu[2],
                between(y, h, z) / f - gu[1] * gu[2],
            )
            u, turned_by = step(u, gu, hu)
            if turned_by < CLOSE:
                break
        return p, f, g

    return search


@functools.cache
def _ground(native: bool):
    """Function (point, source, turns) -> velocity of the surface's material there, weighted by the fields."""
    alone = group_field(native)
    _, cross, _ = vectors(native)

    @maker(native)
    def velocity(p, source, turned):
        motions = source.motions
        total, vx, vy, vz = 0.0, 0.0, 0.0, 0.0
        for g in range(motions.shape[0]):
            f, _ = alone(p, source, turned, g)
            x, y, z = cross((motions[g, TURN_X], motions[g, TURN_X + 1], motions[g, TURN_X + 2]), p)
            total += f
            vx += f * (x + motions[g, SHIFT_X])
            vy += f * (y + motions[g, SHIFT_X + 1])
            vz += f * (z + motions[g, SHIFT_X + 2])
        if total <= 0.0:
            return 0.0, 0.0, 0.0
        return vx / total, vy / total, vz / total

    return velocity


@functools.cache
def touch(native: bool):
    """Function (k, plan, views, turns) -> force, torque about the centre of mass, energy of a body's contacts."""
    search = deepest(native)
    field = field_at(native)
    room = room_at(native)
    ground = _ground(native)
    turn, _ = turns(native)
    dot, cross, _ = vectors(native)

    @maker(native)
    def matrix(views, b, balls, i):
        """The ball's S in the world's frame, by rows: its columns turned one by one."""
        x0, x1, x2 = turn(views.ximat, b, (balls[i, SHAPE_XX], balls[i, SHAPE_XX + 3], balls[i, SHAPE_XX + 6]))
        y0, y1, y2 = turn(views.ximat, b, (balls[i, SHAPE_XX + 1], balls[i, SHAPE_XX + 4], balls[i, SHAPE_XX + 7]))
        z0, z1, z2 = turn(views.ximat, b, (balls[i, SHAPE_XX + 2], balls[i, SHAPE_XX + 5], balls[i, SHAPE_XX + 8]))
        return x0, y0, z0, x1, y1, z1, x2, y2, z2

    @maker(native)
    def lost(k, plan, views, turned, p, n, push):
        """Force at p on top of the elastic `push` along n: damping and friction."""
        b = plan.bodies[k]
        r = plan.roots[b]
        origin, v = views.subtree_com, views.cvel
        arm = p[0] - origin[r, 0], p[1] - origin[r, 1], p[2] - origin[r, 2]
        wx, wy, wz = cross((v[b, 0], v[b, 1], v[b, 2]), arm)
        gx, gy, gz = ground(p, plan.surface, turned)
        v = v[b, 3] + wx - gx, v[b, 4] + wy - gy, v[b, 5] + wz - gz
        rising = dot(v, n)
        damped = -min(push, plan.law[1] * push * rising)
        along = v[0] - rising * n[0], v[1] - rising * n[1], v[2] - rising * n[2]
        speed = math.sqrt(dot(along, along))
        # Coulomb's law, limited so that a time step does not reverse the sliding.
        grip = min(plan.law[2] * (push + damped), 0.25 * views.mass[b] / views.timestep * speed) / max(speed, 1e-300)
        return (
            damped * n[0] - grip * along[0],
            damped * n[1] - grip * along[1],
            damped * n[2] - grip * along[2],
        )

    @maker(native)
    def push(k, plan, views, turned):
        b = plan.bodies[k]
        x, balls = views.xipos, plan.balls
        if room((x[b, 0], x[b, 1], x[b, 2]), plan.surface, turned) > plan.reach[k]:
            return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0
        fx, fy, fz, tx, ty, tz, u = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(plan.first_ball[k], plan.first_ball[k + 1]):
            arm = turn(views.ximat, b, (balls[i, CENTER_X], balls[i, CENTER_X + 1], balls[i, CENTER_X + 2]))
            p = x[b, 0] + arm[0], x[b, 1] + arm[1], x[b, 2] + arm[2]
            if room(p, plan.surface, turned) > balls[i, RADIUS]:
                continue
            if balls[i, RADIUS] > 0.0:
                p, f, g = search(p, matrix(views, b, balls, i), balls[i, LARGE] != 0.0, plan.surface, turned)
            else:
                f, g = field(p, plan.surface, turned)
            if not f > 1.0:
                continue
            depth = math.log(f) / plan.law[0]
            size = math.sqrt(dot(g, g))
            n = -g[0] / size, -g[1] / size, -g[2] / size
            strength = balls[i, STIFFNESS] * depth * depth * size / (f * plan.law[0])
            force = strength * n[0], strength * n[1], strength * n[2]
            if plan.law[1] > 0.0 or plan.law[2] > 0.0:
                more = lost(k, plan, views, turned, p, n, strength)
                force = force[0] + more[0], force[1] + more[1], force[2] + more[2]
            t = cross((p[0] - x[b, 0], p[1] - x[b, 1], p[2] - x[b, 2]), force)
            fx += force[0]
            fy += force[1]
            fz += force[2]
            tx += t[0]
            ty += t[1]
            tz += t[2]
            u += balls[i, STIFFNESS] * depth * depth * depth / 3.0
        return (fx, fy, fz), (tx, ty, tz), u

    return push
