"""Impulses at all contacts of a ball together: none that approaches goes on to do so, and friction in Coulomb's cone.

Projected Gauss-Seidel (Moreau 1988, Jean 1999): contact by contact the impulse along the normal is set so that the ball
leaves at its target speed there, or to 0 where it leaves faster; then friction ends the slip, or goes to its limit. One
contact is solved in one sweep, several until nothing changes.
"""

import functools

import warp as wp

from fieldsim.dynamics.contact.contacts import Contacts, Numbers, Vectors
from fieldsim.dynamics.contact.laws import coulomb
from fieldsim.dynamics.contact.particle_state import ContactParticle
from fieldsim.dynamics.contact.selection import entry, row

# Sweeps end with changes below this share of the velocities, or after so many.
SETTLED = wp.constant(wp.float64(1e-15))
SWEEPS = wp.constant(1000)

_coulomb = coulomb.warp(wp.float64)


@wp.func
def grounds_of(contacts: wp.ref[Contacts], x: wp.vec3d, ball: wp.ref[ContactParticle], dt: wp.float64):
    """Velocities of the ground at each contact.

    For a ball that rolls, of the material at its point of contact. Other balls are assumed to rotate with the ground,
    so theirs is the velocity of the material extended to their centre.
    """
    grounds = Vectors()
    for k in range(contacts.count):
        p = x
        if ball.mobility != wp.float64(1.0):
            p = row(contacts.points, k)
        grounds[k] = (wp.cross(row(contacts.turns, k), p) + row(contacts.shifts, k)) / dt
    return grounds


@wp.func
def slip_of(v: wp.vec3d, spin: wp.vec3d, ground: wp.vec3d, normal: wp.vec3d, radius: wp.float64):
    """Slip velocity: of a ball's point of contact along the surface, relative to the material there."""
    slip = v - ground - radius * wp.cross(spin, normal)
    return slip - wp.dot(slip, normal) * normal


@wp.func
def rubbed(
    v: wp.vec3d,
    spin: wp.vec3d,
    ground: wp.vec3d,
    normal: wp.vec3d,
    ball: wp.ref[ContactParticle],
    total: wp.vec3d,
    press: wp.float64,
):
    """Velocity, spin and the sum of friction's impulses at a contact, `total` so far, under the impulse `press`."""
    slip = slip_of(v, spin, ground, normal, ball.radius)
    jx, jy, jz = _coulomb(slip[0], slip[1], slip[2], total[0], total[1], total[2], ball.mobility, ball.friction * press)
    impulse = wp.vec3d(jx, jy, jz) - total
    turned = (ball.mobility - wp.float64(1.0)) / ball.radius * wp.cross(normal, impulse)
    return v + impulse, spin - turned, total + impulse


@functools.cache
def settle(pressing: bool):
    """Warp function (v, spin, contacts, active, targets, presses, grounds, ball) that changes v and spin by impulses.

    active: 1 for those contacts that act; targets: least velocities along the normals afterwards; presses: the impulses
    along the normals, 0 at first. pressing: whether these are found; otherwise they are given, and there is friction
    alone.
    """

    @wp.func(inline=False)
    def impel(
        v: wp.ref[wp.vec3d],
        spin: wp.ref[wp.vec3d],
        contacts: wp.ref[Contacts],
        active: wp.ref[Numbers],
        targets: wp.ref[Numbers],
        presses: wp.ref[Numbers],
        grounds: wp.ref[Vectors],
        ball: wp.ref[ContactParticle],
    ):
        rubs = Vectors()
        alone = wp.dot(active, active) <= wp.float64(1.0)
        # First without friction, which would take for slip what presses the ball into a groove.
        for rubbing in range(wp.where(ball.friction > wp.float64(0.0), 2, 1)):
            for _ in range(SWEEPS):
                change = wp.float64(0.0)
                for k in range(contacts.count):
                    if entry(active, k) != wp.float64(0.0):
                        normal = row(contacts.normals, k)
                        before = wp.vec3d(v)
                        if wp.static(pressing):
                            press = wp.max(entry(presses, k) + entry(targets, k) - wp.dot(v, normal), wp.float64(0.0))
                            v = v + (press - entry(presses, k)) * normal
                            presses[k] = press
                        if rubbing == 1:
                            v, spin, total = rubbed(
                                v, spin, row(grounds, k), normal, ball, row(rubs, k), entry(presses, k)
                            )
                            rubs[k] = total
                        change = wp.max(change, wp.length(v - before))
                if alone or change <= SETTLED * (wp.length(v) + change):
                    break

    return impel
