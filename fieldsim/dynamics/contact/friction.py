"""Slip and Coulomb friction, as Warp functions."""

import warp as wp

from fieldsim.dynamics.contact.particle_state import ContactParticle


@wp.func
def slip_of(v: wp.vec3d, spin: wp.vec3d, ground: wp.vec3d, normal: wp.vec3d, radius: wp.float64):
    """Slip velocity: of a ball's lowest point along the surface, relative to the material there."""
    slip = v - ground - radius * wp.cross(spin, normal)
    return slip - wp.dot(slip, normal) * normal


@wp.func
def after_friction(
    v: wp.vec3d, spin: wp.vec3d, slip: wp.vec3d, normal: wp.vec3d, ball: ContactParticle, press: wp.float64
):
    """Velocity and spin after friction under a normal impulse `press`: at most Coulomb's limit."""
    size = wp.length(slip)
    limit = ball.friction * press
    if limit > wp.float64(0.0) and size > wp.float64(0.0):
        impulse = -wp.min(limit / size, wp.float64(1.0) / ball.mobility) * slip
        v = v + impulse
        spin = spin - (ball.mobility - wp.float64(1.0)) / ball.radius * wp.cross(normal, impulse)
    return v, spin
