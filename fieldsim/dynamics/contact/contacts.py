"""Contacts of a sphere: what is known of them, and for how small a way it stays so, as Warp functions.

They are found in `search`.
"""

import functools

import warp as wp

from fieldsim.dynamics.contact.selection import MOST, Numbers, Vectors, entry, row
from fieldsim.sources.surface_velocity import screw

# Gaps in units of the surfaces' grain: the accuracy of a place of contact, and the greatest that counts as touching.
TOLERANCE = wp.constant(wp.float64(1e-10))
TOUCHING = wp.constant(wp.float64(1e-9))
# Rounding of a gap in units of the coordinates.
ROUNDING = wp.constant(wp.float64(4e-15))
# What is known of contacts serves after the ball has moved, if their normals turn by less than this: as a place where
# a search begins; and in place of a search, if the ball moves by less than this share of the grain along the surface.
FOLLOWED = wp.constant(wp.float64(0.1))
DISPLACED = wp.constant(wp.float64(1e-5))

# A symmetric matrix (xx, yy, zz, xy, xz, yz), and one of each contact.
Bend = wp.types.vector(6, wp.float64)
Bends = wp.types.matrix((MOST, 6), wp.float64)


@wp.struct
class Contacts:
    """Contacts of a sphere about `center` with gaps below `horizon`: `count` of them, in no order.

    gaps: distances of the sphere from the surface, negative where it reaches in; normals: outward from the body;
    points: of the surface; speeds: of the surface along the normal; turns, shifts: twists of the material per step;
    bends: how the normals turn as the centre moves (see `nearest.normal_turn`). stage, fraction: when that is. least:
    the least gap, or the horizon if that is less; which: whose it is.
    """

    count: wp.int32
    which: wp.int32
    least: wp.float64
    horizon: wp.float64
    center: wp.vec3d
    stage: wp.int32
    fraction: wp.float64
    gaps: Numbers
    speeds: Numbers
    normals: Vectors
    points: Vectors
    turns: Vectors
    shifts: Vectors
    bends: Bends


@wp.func
def copy_contacts(source: wp.ref[Contacts], target: wp.ref[Contacts]):
    """Make the target what the source is; what is assigned to a name, Warp copies once more where branches meet."""
    target = source  # noqa: F841


@wp.func
def tolerance(p: wp.vec3d, radius: wp.float64, grain: wp.float64):
    """The accuracy of gaps of a sphere at p, a length."""
    return wp.max(TOLERANCE * grain, ROUNDING * (wp.length(p) + radius))


@wp.func
def touching(p: wp.vec3d, radius: wp.float64, grain: wp.float64):
    """The greatest gap of a sphere at p that counts as touching, a length."""
    return wp.max(TOUCHING * grain, wp.float64(4.0) * ROUNDING * (wp.length(p) + radius))


@wp.func
def turned(contacts: wp.ref[Contacts], k: int, d: wp.vec3d):
    """How the normal of a contact turns, to first order, as the ball moves by d."""
    b = contacts.bends[k]
    return wp.vec3d(
        b[0] * d[0] + b[3] * d[1] + b[4] * d[2],
        b[3] * d[0] + b[1] * d[1] + b[5] * d[2],
        b[4] * d[0] + b[5] * d[1] + b[2] * d[2],
    )


@wp.func
def followed(contacts: wp.ref[Contacts], k: int, center: wp.vec3d, radius: wp.float64):
    """The point of a contact, to first order, after the ball has moved to a place."""
    point = row(contacts.points, k)
    d = center - contacts.center
    turn = turned(contacts, k, d)
    if not wp.length(turn) < FOLLOWED:
        return point
    n = row(contacts.normals, k)
    return point + d - wp.dot(n, d) * n - (entry(contacts.gaps, k) + radius) * turn


@functools.cache
def following(kinds_used):
    """Warp function (contacts, k, centre, radius, stage, fraction of a step after it): `followed`.

    Surfaces went on moving as they did.
    """

    @wp.func
    def still(contacts: wp.ref[Contacts], k: int, center: wp.vec3d, radius: wp.float64, stage: int,
            fraction: wp.float64):  # fmt: skip
        return followed(contacts, k, center, radius)

    @wp.func
    def moving(contacts: wp.ref[Contacts], k: int, center: wp.vec3d, radius: wp.float64, stage: int,
            fraction: wp.float64):  # fmt: skip
        # Whole steps apart, so that nothing depends on where a launch began.
        passed = wp.float64(stage - contacts.stage) + (fraction - contacts.fraction)
        turn = passed * row(contacts.turns, k)
        shift = passed * row(contacts.shifts, k)
        return screw(followed(contacts, k, screw(center, -turn, -shift), radius), turn, shift)

    return moving if kinds_used[1] else still


@functools.cache
def displace_over(kinds_used):
    """Warp function (contacts, centre, radius, grain) -> whether the contacts of a ball that moved there are known.

    They become those there, as right as a search's, if the ball has moved by so little that this is known.
    """

    @wp.func
    def moving(contacts: wp.ref[Contacts], center: wp.vec3d, radius: wp.float64, grain: wp.float64):
        return False

    @wp.func
    def still(contacts: wp.ref[Contacts], center: wp.vec3d, radius: wp.float64, grain: wp.float64):
        d = center - contacts.center
        for k in range(contacts.count):
            n = row(contacts.normals, k)
            along = wp.length(d - wp.dot(n, d) * n)
            if not (along <= DISPLACED * grain and wp.length(turned(contacts, k, d)) <= DISPLACED):
                return False
        contacts.center = center
        contacts.horizon = contacts.horizon - wp.length(d)
        contacts.least = contacts.horizon
        for k in range(contacts.count):
            turn = turned(contacts, k, d)
            n = row(contacts.normals, k)
            gap = entry(contacts.gaps, k) + wp.dot(n, d) + wp.float64(0.5) * wp.dot(turn, d)
            n = wp.normalize(n + turn)
            contacts.gaps[k] = gap
            contacts.normals[k] = n
            contacts.points[k] = center - (gap + radius) * n
            if gap < contacts.least:
                contacts.least = gap
                contacts.which = k
        return True

    return moving if kinds_used[1] else still
