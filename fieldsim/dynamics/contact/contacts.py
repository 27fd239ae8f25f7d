"""All contacts of a sphere: the nearest points of the surface F = 1 to its centre, as Warp functions.

Around each of these points the surface is nowhere nearer; where it surrounds a ball, as a groove or the rim of a hole
does, there are several. The search begins at the *feet* of all elements near enough (the nearest points of their
primitives) and walks from there along the true surface, elements blended (see `nearest`).
"""

import functools

import warp as wp

from fieldsim.dynamics.contact.nearest import nearest_step
from fieldsim.potentials import registry
from fieldsim.sources.moments import Moment, fraction, surface_jet
from fieldsim.sources.rows import ALONE, REACH, shift_of, turn_of
from fieldsim.sources.stages import Stages
from fieldsim.sources.surface_velocity import screw

# Contacts of one sphere: the nearest are kept.
MOST = 6
Numbers = wp.types.vector(MOST, wp.float64)
Vectors = wp.types.matrix((MOST, 3), wp.float64)
# Gaps in units of the surfaces' grain: the accuracy of a place of contact, and the greatest that counts as touching.
TOLERANCE = wp.constant(wp.float64(1e-11))
TOUCHING = wp.constant(wp.float64(1e-9))
# Rounding of a gap in units of the coordinates.
ROUNDING = wp.constant(wp.float64(4e-15))
# Steps of a search. It ends with a step of this share of the length over which the surface bends; the error is about
# its square.
STEPS = wp.constant(60)
CLOSE = wp.constant(wp.float64(1e-6))
# Points nearer to each other than this share of the grain are one.
SAME = wp.constant(wp.float64(1e-3))
# Where one search begins within this share of the grain of what another has found, it would find the same.
BASIN = wp.constant(wp.float64(0.25))
# Where 1 + h k is below, a point is the farthest along its line; the search goes on to both sides.
SADDLE = wp.constant(wp.float64(-1e-6))
ASIDE = wp.constant(wp.float64(0.1))
TINY = wp.constant(wp.float64(1e-200))

_step = nearest_step.warp(wp.float64)


@wp.struct
class Nearest:
    """What a search found: the point, its outward normal, the surface's speed along it, and the twist of the material.

    found: 1 where it ended. aside, forked: where another search is to begin, if forked is 1.
    """

    found: wp.int32
    point: wp.vec3d
    normal: wp.vec3d
    speed: wp.float64
    turn: wp.vec3d
    shift: wp.vec3d
    forked: wp.int32
    aside: wp.vec3d


@wp.struct
class Contacts:
    """Contacts of a sphere with gaps below `horizon`: `count` of them, in no order.

    gaps: distances of the sphere from the surface, negative where it reaches in; normals: outward from the body;
    points: of the surface; speeds: of the surface along the normal; turns, shifts: twists of the material per step.
    least: the least gap, or the horizon if that is less; which: whose it is.
    """

    count: wp.int32
    which: wp.int32
    least: wp.float64
    horizon: wp.float64
    gaps: Numbers
    speeds: Numbers
    normals: Vectors
    points: Vectors
    turns: Vectors
    shifts: Vectors


@wp.func
def tolerance(p: wp.vec3d, radius: wp.float64, grain: wp.float64):
    """The accuracy of gaps of a sphere at p, a length."""
    return wp.max(TOLERANCE * grain, ROUNDING * (wp.length(p) + radius))


@wp.func
def touching(p: wp.vec3d, radius: wp.float64, grain: wp.float64):
    """The greatest gap of a sphere at p that counts as touching, a length."""
    return wp.max(TOUCHING * grain, wp.float64(4.0) * ROUNDING * (wp.length(p) + radius))


@wp.func
def normal_of(contacts: Contacts, k: int):
    """Normal of contact k."""
    return wp.vec3d(contacts.normals[k, 0], contacts.normals[k, 1], contacts.normals[k, 2])


@wp.func
def point_of(contacts: Contacts, k: int):
    """Point of contact k."""
    return wp.vec3d(contacts.points[k, 0], contacts.points[k, 1], contacts.points[k, 2])


@wp.func
def twist_of(contacts: Contacts, k: int):
    """(turn, shift) per step of the material at contact k."""
    turn = wp.vec3d(contacts.turns[k, 0], contacts.turns[k, 1], contacts.turns[k, 2])
    shift = wp.vec3d(contacts.shifts[k, 0], contacts.shifts[k, 1], contacts.shifts[k, 2])
    return turn, shift


@functools.cache
def nearest_from(kinds_used):
    """Warp function (start, foot, centre, grain, surfaces, moment, time after it) -> Nearest.

    The search begins at `start`; where there is no field it goes towards the foot.
    """
    jet_of = surface_jet(kinds_used)

    @wp.func
    def search(
        start: wp.vec3d,
        foot: wp.vec3d,
        center: wp.vec3d,
        grain: wp.float64,
        surfaces: Stages,
        moment: Moment,
        later: wp.float64,
    ):
        result = Nearest()
        q = start
        for _ in range(STEPS):
            jet = jet_of(q, surfaces, moment, later)
            g = jet.gradient
            slope = wp.length(g)
            if not (jet.f > TINY and slope > TINY):
                toward = wp.float64(0.5) * (foot - q)
                q = q + toward
                if wp.length(toward) <= SAME * grain:
                    break
                continue
            o = center - q
            h = jet.hessian
            longest = wp.max(wp.float64(0.5) * wp.length(q - foot), wp.float64(0.5) * grain)
            dx, dy, dz, nx, ny, nz, least, ex, ey, ez, bend = _step(
                o[0], o[1], o[2], jet.f, g[0], g[1], g[2],
                h[0, 0], h[1, 1], h[2, 2], h[0, 1], h[0, 2], h[1, 2], longest,
            )  # fmt: skip
            d = wp.vec3d(dx, dy, dz)
            size = wp.length(d)
            scale = wp.min(bend, grain)
            if least < SADDLE and result.forked == 0 and size <= ASIDE * scale:
                # The farthest point along its line: to both sides it is nearer.
                e = ASIDE * scale * wp.vec3d(ex, ey, ez)
                result.forked = wp.int32(1)
                result.aside = q - e
                q = q + e
                continue
            q = q + d
            if size <= CLOSE * scale:
                result.found = wp.int32(1)
                result.point = q
                n = wp.vec3d(nx, ny, nz)
                result.normal = n
                result.turn = jet.turn
                result.shift = jet.shift
                # What growth adds to the material's speed along the normal, and what melting together does.
                u = wp.cross(jet.turn, q - d) + jet.shift
                grown = (jet.rate + wp.dot(g, u)) / slope
                result.speed = (wp.dot(wp.cross(jet.turn, q) + jet.shift, n) + grown) / moment.dt
                break
        return result

    return search


@wp.func
def added_contact(
    contacts: Contacts,
    near: Nearest,
    center: wp.vec3d,
    radius: wp.float64,
    grain: wp.float64,
):
    """The contacts with one more, unless it is there already or farther than all that there is room for."""
    o = center - near.point
    distance = wp.length(o)
    if wp.dot(o, near.normal) < wp.float64(0.0):
        distance = -distance
    gap = distance - radius
    if not gap < contacts.horizon:
        return contacts
    place = contacts.count
    for k in range(contacts.count):
        if wp.length(point_of(contacts, k) - near.point) <= SAME * grain:
            return contacts
    if place == MOST:
        farthest = gap
        for k in range(MOST):
            if contacts.gaps[k] > farthest:
                farthest = contacts.gaps[k]
                place = k
        if place == MOST:
            return contacts
    else:
        contacts.count = place + 1
    contacts.gaps[place] = gap
    contacts.speeds[place] = near.speed
    contacts.normals[place] = near.normal
    contacts.points[place] = near.point
    contacts.turns[place] = near.turn
    contacts.shifts[place] = near.shift
    if gap < contacts.least:
        contacts.least = gap
        contacts.which = place
    return contacts


@wp.func
def known_nearby(contacts: Contacts, p: wp.vec3d, within: wp.float64):
    """Whether some contact's point is that near to p."""
    for k in range(contacts.count):
        if wp.length(point_of(contacts, k) - p) <= within:
            return True
    return False


@wp.func
def direction_from(foot: wp.vec3d, center: wp.vec3d):
    """Unit vector from a foot to the centre, and their distance; on the skeleton itself, some direction."""
    away = center - foot
    size = wp.length(away)
    if size > wp.float64(0.0):
        return away / size, size
    return wp.vec3d(wp.float64(0.0), wp.float64(0.0), wp.float64(1.0)), size


@functools.cache
def _feet_of(kinds: tuple[int, ...]):
    """Portables (x, y, z, rows, kinds, i) -> a foot of row i: the first feet of all primitives, the second, ..."""
    primitives = {formula.kind: formula.primitive for formula in registry.FORMULAS.values()}
    used = [kind for kind in kinds or (min(primitives),) if primitives[kind].feet]
    most = max((len(primitives[kind].feet) for kind in used), default=1)
    # Who has fewer gives the first once more; what a search from there would find is known then.
    return [
        registry.by_kind({kind: (primitives[kind].feet * most)[0 if which >= len(primitives[kind].feet) else which]
                          for kind in used})
        for which in range(most)
    ]  # fmt: skip


@functools.cache
def _foot_of(kinds: tuple[int, ...]):
    """Warp function (point, rows, kinds, i, which) -> foot number `which` of row i; and how many there are."""
    feet = _feet_of(kinds)
    first, second, third = ((feet * 3)[k].warp(wp.float64) for k in range(3))

    @wp.func
    def foot(p: wp.vec3d, rows: wp.array2d(dtype=wp.float64), kinds: wp.array(dtype=wp.int32), i: int, which: int):
        if which == 1:
            x1, y1, z1 = second(p[0], p[1], p[2], rows, kinds, i)
            return wp.vec3d(x1, y1, z1)
        if which == 2:
            x2, y2, z2 = third(p[0], p[1], p[2], rows, kinds, i)
            return wp.vec3d(x2, y2, z2)
        x, y, z = first(p[0], p[1], p[2], rows, kinds, i)
        return wp.vec3d(x, y, z)

    return foot, len(feet)


@functools.cache
def contacts_at(kinds_used):
    """Warp function (centre, radius, horizon, grain, surfaces, moment, time after it) -> Contacts nearer than that."""
    fixed_kinds, moving_kinds = kinds_used
    foot_fixed, feet_fixed = _foot_of(fixed_kinds)
    foot_moving, feet_moving = _foot_of(moving_kinds)
    search = nearest_from(kinds_used)
    jet_of = surface_jet(kinds_used)

    @wp.func
    def from_foot(
        contacts: Contacts,
        foot: wp.vec3d,
        alone: wp.float64,
        center: wp.vec3d,
        radius: wp.float64,
        grain: wp.float64,
        surfaces: Stages,
        moment: Moment,
        later: wp.float64,
    ):
        """The contacts with what is found from a foot of an element whose surface alone lies `alone` from it."""
        u, _size = direction_from(foot, center)
        start = foot + alone * u
        if known_nearby(contacts, start, BASIN * grain):
            return contacts
        near = search(start, foot, center, grain, surfaces, moment, later)
        if near.found == 1:
            contacts = added_contact(contacts, near, center, radius, grain)
        if near.forked == 1:
            near = search(near.aside, foot, center, grain, surfaces, moment, later)
            if near.found == 1:
                contacts = added_contact(contacts, near, center, radius, grain)
        return contacts

    @wp.func
    def from_fixed(
        contacts: Contacts,
        center: wp.vec3d,
        radius: wp.float64,
        grain: wp.float64,
        surfaces: Stages,
        moment: Moment,
        later: wp.float64,
    ):
        for i in range(surfaces.kinds.shape[0]):
            for which in range(feet_fixed):
                foot = foot_fixed(center, surfaces.rows, surfaces.kinds, i, which)
                if wp.length(foot - center) - surfaces.rows[i, REACH] < radius + contacts.horizon:
                    contacts = from_foot(
                        contacts, foot, surfaces.rows[i, ALONE], center, radius, grain, surfaces, moment, later
                    )
        return contacts

    @wp.func
    def from_moving(
        contacts: Contacts,
        center: wp.vec3d,
        radius: wp.float64,
        grain: wp.float64,
        surfaces: Stages,
        moment: Moment,
        later: wp.float64,
    ):
        s = fraction(moment, later)
        rows = surfaces.moving_rows
        first = moment.stage * surfaces.moving
        for i in range(first, first + surfaces.moving):
            turn = s * turn_of(rows, i)
            shift = s * shift_of(rows, i)
            back = screw(center, -turn, -shift)
            for which in range(feet_moving):
                foot = foot_moving(back, rows, surfaces.moving_kinds, i, which)
                if wp.length(foot - back) - rows[i, REACH] < radius + contacts.horizon:
                    foot = screw(foot, turn, shift)
                    contacts = from_foot(contacts, foot, rows[i, ALONE], center, radius, grain, surfaces, moment, later)
        return contacts

    @wp.func
    def facing(contacts: Contacts, center: wp.vec3d, radius: wp.float64, surfaces: Stages, moment: Moment,
               later: wp.float64):  # fmt: skip
        """The contacts without far sides: what a centre outside would see through the body."""
        through = wp.int32(0)
        for k in range(contacts.count):
            if contacts.gaps[k] + radius < wp.float64(0.0):
                through = wp.int32(1)
        if through == 0:
            return contacts
        jet = jet_of(center, surfaces, moment, later)
        if jet.f >= wp.float64(1.0):
            return contacts
        kept = Contacts()
        kept.horizon = contacts.horizon
        kept.least = contacts.horizon
        for k in range(contacts.count):
            if contacts.gaps[k] + radius >= wp.float64(0.0):
                j = kept.count
                kept.gaps[j] = contacts.gaps[k]
                kept.speeds[j] = contacts.speeds[k]
                kept.normals[j] = contacts.normals[k]
                kept.points[j] = contacts.points[k]
                kept.turns[j] = contacts.turns[k]
                kept.shifts[j] = contacts.shifts[k]
                if kept.gaps[j] < kept.least:
                    kept.least = kept.gaps[j]
                    kept.which = j
                kept.count = j + 1
        return kept

    @wp.func
    def contacts(
        center: wp.vec3d,
        radius: wp.float64,
        horizon: wp.float64,
        grain: wp.float64,
        surfaces: Stages,
        moment: Moment,
        later: wp.float64,
    ):
        result = Contacts()
        result.horizon = horizon
        result.least = horizon
        if wp.static(len(fixed_kinds) > 0):
            result = from_fixed(result, center, radius, grain, surfaces, moment, later)
        if wp.static(len(moving_kinds) > 0):
            result = from_moving(result, center, radius, grain, surfaces, moment, later)
        return facing(result, center, radius, surfaces, moment, later)

    return contacts
