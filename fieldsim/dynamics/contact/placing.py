"""Where a ball touches: moved out of what it reaches into, or back to what it has left, as Warp functions."""

import functools

import warp as wp

from fieldsim.dynamics.contact.contacts import Contacts, tolerance, touching
from fieldsim.dynamics.contact.event_detection import REFINEMENTS
from fieldsim.dynamics.contact.particle_state import ContactParticle
from fieldsim.dynamics.contact.search import contacts_at
from fieldsim.dynamics.contact.selection import entry, row
from fieldsim.sources.moments import Moment
from fieldsim.sources.stages import Stages


@wp.func
def violated(contacts: wp.ref[Contacts], radius: wp.float64):
    """The contact to leave by: of a centre within the body the nearest way out, else where the ball reaches deepest."""
    found = contacts.which
    out = wp.float64(-wp.inf)
    for k in range(contacts.count):
        gap = entry(contacts.gaps, k)
        if gap + radius < wp.float64(0.0) and gap > out:
            out = gap
            found = k
    return found


@functools.cache
def push_out(kinds_used):
    """Warp function (centre, ball, surfaces, moment, time after it) -> the centre from where the ball only touches."""
    find = contacts_at(kinds_used)

    @wp.func
    def push(p: wp.vec3d, ball: wp.ref[ContactParticle], surfaces: wp.ref[Stages], moment: Moment, later: wp.float64):
        there = Contacts()
        for _ in range(REFINEMENTS):
            horizon = touching(p, ball.radius, ball.grain)
            there.count = wp.int32(0)
            find(p, ball.radius, horizon, ball.grain, surfaces, moment, later, there)
            if not there.least < wp.float64(0.0):
                break
            k = violated(there, ball.radius)
            outside = ball.radius + wp.float64(0.5) * tolerance(p, ball.radius, ball.grain)
            p = row(there.points, k) + outside * row(there.normals, k)
        return p

    return push


@functools.cache
def set_down(kinds_used):
    """Warp function (centre, ball, surfaces, moment, time after it, horizon, contacts) -> the centre where it touches.

    horizon: from how far it is moved there; what is farther stays. contacts: become those there.
    """
    find = contacts_at(kinds_used)
    push = push_out(kinds_used)

    @wp.func
    def down(
        p: wp.vec3d,
        ball: wp.ref[ContactParticle],
        surfaces: wp.ref[Stages],
        moment: Moment,
        later: wp.float64,
        horizon: wp.float64,
        contacts: wp.ref[Contacts],
    ):
        find(p, ball.radius, horizon, ball.grain, surfaces, moment, later, contacts)
        close = tolerance(p, ball.radius, ball.grain)
        if contacts.count > 0 and (contacts.least > close or contacts.least < wp.float64(0.0)):
            if contacts.least > close:
                outside = ball.radius + wp.float64(0.5) * close
                p = row(contacts.points, contacts.which) + outside * row(contacts.normals, contacts.which)
            p = push(p, ball, surfaces, moment, later)
            find(p, ball.radius, horizon, ball.grain, surfaces, moment, later, contacts)
        return p

    return down
