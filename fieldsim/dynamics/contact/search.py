"""The search for all contacts of a sphere: the nearest points of the surface F = 1 to its centre, as Warp functions.

Around each of these points the surface is nowhere nearer; where it surrounds a ball, as a groove or the rim of a hole
does, there are several. The search begins at the *feet* of all elements near enough (the nearest points of their
primitives) and walks from there along the true surface, elements blended (see `nearest`).
"""

import functools

import warp as wp

from fieldsim.dynamics.contact.beginnings import beginning_at
from fieldsim.dynamics.contact.contacts import Bend, Contacts, following, tolerance, touching
from fieldsim.dynamics.contact.nearest import nearest_step, normal_turn, shortened
from fieldsim.dynamics.contact.selection import (
    MOST,
    Vectors,
    entry,
    even,
    face,
    known,
    least_of,
    nearest_of,
    place_for,
    spread,
)
from fieldsim.potentials.bounds.feet import most_feet
from fieldsim.sources.moments import Moment, SurfaceJet, fraction, surface_jet
from fieldsim.sources.stages import Stages

# Steps of a search. It ends with a step of this share of the length over which the surface bends; the error is about
# its square. Where the gap is CLEAR times as long as a step of that share of it, no more is to be known.
STEPS = wp.constant(120)
# Where the field is fainter a search first comes nearer to the foot, so often: steps from far out may lead to another
# part of the surface.
FAINT = wp.constant(wp.float64(0.3))
NEARING = wp.constant(6)
CLOSE = wp.constant(wp.float64(3e-6))
ROUGH = wp.constant(wp.float64(1e-3))
CLEAR = wp.constant(wp.float64(3.0))
# Points nearer to each other than this share of the grain are one.
SAME = wp.constant(wp.float64(1e-3))
# Where one search begins within this share of the grain of what another has found, it would find the same.
BASIN = wp.constant(wp.float64(0.25))
# Where 1 + h k is below, a point is the farthest along its line; the search goes on to both sides.
SADDLE = wp.constant(wp.float64(-1e-6))
ASIDE = wp.constant(wp.float64(0.1))
# Where the last step is shortened to less than this share, the search ends on a crease; it comes there to this share of
# a gap's accuracy, and the normal is the direction to the centre unless that is nearer than this share of the grain.
CREASED = wp.constant(wp.float64(1e-2))
SHARP = wp.constant(wp.float64(0.1))
NEAREST = wp.constant(wp.float64(1e-6))
TINY = wp.constant(wp.float64(1e-200))

_step = nearest_step.warp(wp.float64)
_turn = normal_turn.warp(wp.float64)
_shortened = shortened.warp(wp.float64)


@wp.struct
class Nearest:
    """What a search found: the point, its outward normal, the surface's speed along it, and the twist of the material.

    bend: how the normal turns as the centre moves (see `normal_turn`). found: 1 where it ended. aside, forked: where
    another search is to begin, if forked is 1.
    """

    found: wp.int32
    point: wp.vec3d
    normal: wp.vec3d
    bend: Bend
    speed: wp.float64
    turn: wp.vec3d
    shift: wp.vec3d
    forked: wp.int32
    aside: wp.vec3d


@wp.func
def bend_at(jet: wp.ref[SurfaceJet], o: wp.vec3d):
    """How the normal turns as the centre moves, o from the point of the jet."""
    g = jet.gradient
    h = jet.hessian
    xx, yy, zz, xy, xz, yz = _turn(
        o[0], o[1], o[2], jet.f, g[0], g[1], g[2], h[0, 0], h[1, 1], h[2, 2], h[0, 1], h[0, 2], h[1, 2]
    )
    return Bend(xx, yy, zz, xy, xz, yz)


@wp.func
def enter(result: wp.ref[Nearest], jet: wp.ref[SurfaceJet], q: wp.vec3d, d: wp.vec3d, n: wp.vec3d, dt: wp.float64):
    """Enter the point q with the normal n, to which the step d led from the point of the jet."""
    result.found = wp.int32(1)
    result.point = q
    result.normal = n
    result.turn = jet.turn
    result.shift = jet.shift
    # What growth adds to the material's speed along the normal, and what melting together does.
    u = wp.cross(jet.turn, q - d) + jet.shift
    grown = (jet.rate + wp.dot(jet.gradient, u)) / wp.length(jet.gradient)
    result.speed = (wp.dot(wp.cross(jet.turn, q) + jet.shift, n) + grown) / dt


@functools.cache
def nearest_from(kinds_used):
    """Warp function (start, foot, centre, radius, grain, surfaces, moment, time after it) -> Nearest.

    The search begins at `start`; where there is no field it goes towards the foot.
    """
    jet_of = surface_jet(kinds_used)

    @wp.func(inline=False)
    def search(
        start: wp.vec3d,
        foot: wp.vec3d,
        center: wp.vec3d,
        radius: wp.float64,
        grain: wp.float64,
        surfaces: wp.ref[Stages],
        moment: Moment,
        later: wp.float64,
    ):
        result = Nearest()
        q = start
        last = wp.vec3d()
        most = wp.float64(wp.inf)
        share = wp.float64(1.0)
        for k in range(STEPS):
            jet = jet_of(q, surfaces, moment, later)
            g = jet.gradient
            slope = wp.length(g)
            toward = wp.float64(0.5) * (foot - q)
            if not (jet.f > TINY and slope > TINY):
                q = q + toward
                if wp.length(toward) <= SAME * grain:
                    break
                continue
            if k < NEARING and jet.f < FAINT and wp.length(toward) > SAME * grain:
                q = q + toward
                continue
            o = center - q
            h = jet.hessian
            longest = wp.max(wp.float64(0.5) * wp.length(q - foot), wp.float64(0.5) * grain)
            dx, dy, dz, nx, ny, nz, least, ex, ey, ez, bend = _step(
                o[0], o[1], o[2], jet.f, g[0], g[1], g[2],
                h[0, 0], h[1, 1], h[2, 2], h[0, 1], h[0, 2], h[1, 2], longest,
            )  # fmt: skip
            d = wp.vec3d(dx, dy, dz)
            along = d - (wp.dot(d, g) / (slope * slope)) * g
            most, share = _shortened(wp.length(along), wp.length(last), wp.dot(along, last), most, share, k)
            last = along
            d = d - (wp.float64(1.0) - share) * along
            size = wp.length(d)
            scale = wp.min(bend, grain)
            close = CLOSE * scale
            if share < wp.float64(1.0):
                close = SHARP * tolerance(center, radius, grain)
            if least < SADDLE and result.forked == 0 and size <= ASIDE * scale:
                # The farthest point along its line: to both sides it is nearer.
                e = ASIDE * scale * wp.vec3d(ex, ey, ez)
                result.forked = wp.int32(1)
                result.aside = q - e
                q = q + e
                continue
            q = q + d
            clear = size <= ROUGH * scale and wp.abs(wp.length(center - q) - radius) > CLEAR * size
            if clear or size <= close:
                n = wp.vec3d(nx, ny, nz)
                if share < CREASED and wp.length(center - q) > NEAREST * grain:
                    n = wp.sign(wp.dot(center - q, n)) * wp.normalize(center - q)
                    result.bend = Bend(wp.float64(wp.nan))  # which nothing follows
                else:
                    result.bend = bend_at(jet, o)
                enter(result, jet, q, d, n, moment.dt)
                break
        return result

    return search


@wp.func
def place_of(contacts: wp.ref[Contacts], near: wp.ref[Nearest], gap: wp.float64, close: wp.float64, same: wp.float64):
    """Where there is place for what a search found, with its gap; -1 if nowhere, or if it is known.

    close: gaps that differ by no more are equal; same: points that near to each other are one.
    """
    if known(contacts.count, contacts.points, near.point, same):
        return wp.int32(-1)
    if contacts.count == MOST and even(contacts.gaps, gap, close):
        return spread(contacts.normals, near.normal)
    return place_for(gap, contacts.count, contacts.gaps)


@wp.func
def put(contacts: wp.ref[Contacts], place: int, near: wp.ref[Nearest], gap: wp.float64):
    """Put what a search found in a place."""
    contacts.count = wp.max(contacts.count, place + 1)
    contacts.gaps[place] = gap
    contacts.speeds[place] = near.speed
    contacts.normals[place] = near.normal
    contacts.points[place] = near.point
    contacts.turns[place] = near.turn
    contacts.shifts[place] = near.shift
    contacts.bends[place] = near.bend


@wp.func
def surface_within(jet: wp.ref[SurfaceJet], reach: wp.float64):
    """Whether log F, followed down its slope, comes to 0 within a reach."""
    if not jet.f > TINY:
        return False
    return wp.abs(wp.log(jet.f)) * jet.f <= reach * wp.length(jet.gradient)


@functools.cache
def exploring(kinds_used):
    """Warp function (start, foot, centre, radius, horizon, grain, surfaces, moment, time after it, contacts).

    It puts what a search from there finds into the contacts; returns 1 if that is seen through a body, else 0.
    """
    search = nearest_from(kinds_used)

    @wp.func(inline=False)
    def explore(
        start: wp.vec3d,
        foot: wp.vec3d,
        center: wp.vec3d,
        radius: wp.float64,
        horizon: wp.float64,
        grain: wp.float64,
        surfaces: wp.ref[Stages],
        moment: Moment,
        later: wp.float64,
        contacts: wp.ref[Contacts],
    ):
        through = wp.int32(0)
        # Once more where the first search forked.
        for _ in range(wp.int32(2)):
            near = search(start, foot, center, radius, grain, surfaces, moment, later)
            start = near.aside
            o = center - near.point
            gap = wp.length(o) - radius
            if wp.dot(o, near.normal) < wp.float64(0.0):
                gap = -wp.length(o) - radius
            if near.found == 1 and gap < horizon:
                place = place_of(contacts, near, gap, touching(center, radius, grain), SAME * grain)
                if place >= 0:
                    put(contacts, place, near, gap)
                    if gap + radius < wp.float64(0.0):
                        through = wp.int32(1)
            if near.forked == 0:
                break
        return through

    return explore


@functools.cache
def contacts_at(kinds_used):
    """Warp function (centre, radius, horizon, grain, surfaces, moment, time after it, contacts).

    It finds the contacts with gaps below the horizon. contacts: where they are put; searches begin from the points that
    are known there, of the same ball somewhere near.
    """
    feet = max(map(most_feet, kinds_used))
    begin = beginning_at(kinds_used)
    explore = exploring(kinds_used)
    jet_of = surface_jet(kinds_used)

    follow = following(kinds_used)

    # One copy of its code, not inlined: it is called in many places.
    @wp.func(inline=False)
    def find(
        center: wp.vec3d,
        radius: wp.float64,
        horizon: wp.float64,
        grain: wp.float64,
        surfaces: wp.ref[Stages],
        moment: Moment,
        later: wp.float64,
        contacts: wp.ref[Contacts],
    ):
        starts = Vectors()
        starting = contacts.count
        part = fraction(moment, later)
        for k in range(starting):
            starts[k] = follow(contacts, k, center, radius, moment.stage, part)
        contacts.center = center
        contacts.stage = moment.stage
        contacts.fraction = part
        contacts.count = wp.int32(0)
        contacts.which = wp.int32(0)
        contacts.horizon = horizon
        contacts.least = horizon
        through = wp.int32(0)
        elements = surfaces.kinds.shape[0] + surfaces.moving
        for i in range(elements):
            for which in range(wp.int32(feet)):  # no constant, for which Warp would write the loop out
                beginning = begin(i, which, center, radius + horizon, surfaces, moment, later)
                start = beginning.start
                if beginning.near == 1 and not known(contacts.count, contacts.points, start, BASIN * grain):
                    start = nearest_of(starting, starts, start, BASIN * grain)
                    through |= explore(
                        start, beginning.foot, center, radius, horizon, grain, surfaces, moment, later, contacts
                    )
        # Where tails of several elements make the surface, it may be nearest to a ball that no foot is near to.
        if elements > 1 and not known(contacts.count, contacts.points, center, radius + BASIN * grain):
            jet = jet_of(center, surfaces, moment, later)
            if surface_within(jet, radius + horizon + grain):
                through |= explore(center, center, center, radius, horizon, grain, surfaces, moment, later, contacts)
        if through == 1:
            # A centre outside sees the far side of a body through it: that is no contact.
            jet = jet_of(center, surfaces, moment, later)
            if jet.f < wp.float64(1.0):
                face(contacts.gaps, radius, horizon)
        if contacts.count > 0:
            contacts.which = least_of(contacts.count, contacts.gaps)
            contacts.least = entry(contacts.gaps, contacts.which)

    return find
