"""State of particles in contact: law, status, spin, and the log of their events."""

import warp as wp

from fieldsim.world.contact import Status

MOVING = wp.constant(wp.int32(Status.MOVING))
RESTING = wp.constant(wp.int32(Status.RESTING))
ABSORBED = wp.constant(wp.int32(Status.ABSORBED))
ESCAPED = wp.constant(wp.int32(Status.ESCAPED))

# Contact laws, as numbers for kernels.
NOTHING, BOUNCE, ABSORB, REPULSION = (wp.constant(wp.int32(k)) for k in range(4))

# Kinds of events.
KINDS = ("bounce", "land", "absorb", "escape")
HIT, LAND, TAKEN, GONE = (wp.constant(wp.int32(k)) for k in range(len(KINDS)))


@wp.struct
class ContactParticle:
    """One particle: its law and numbers.

    mobility: how the velocity of its lowest point answers an impulse along the surface, 1 for a point mass, 7/2 for a
    solid sphere that turns. grain: see `ContactParticles`.
    """

    index: wp.int32
    law: wp.int32
    radius: wp.float64
    restitution: wp.float64
    friction: wp.float64
    mobility: wp.float64
    grain: wp.float64


@wp.struct
class ContactParticles:
    """All particles, (N,) each. What follows `mobilities` is written by kernels.

    stiffnesses, reaches: of those that are repelled. states: see `Status`. spins: angular velocities. bounces: contacts
    made. grain: the length over which the surfaces' fields vary little. escape2: the escape radius squared, or inf.
    begin, first: step k of a launch starts at begin + (first + k) dt.

    The log: a ring of `kept` events per particle, event j at [particle * kept + j mod kept], of `logged` (N,) made.
    """

    laws: wp.array(dtype=wp.int32)
    radii: wp.array(dtype=wp.float64)
    restitutions: wp.array(dtype=wp.float64)
    frictions: wp.array(dtype=wp.float64)
    mobilities: wp.array(dtype=wp.float64)
    stiffnesses: wp.array(dtype=wp.float64)
    reaches: wp.array(dtype=wp.float64)
    states: wp.array(dtype=wp.int32)
    spins: wp.array(dtype=wp.vec3d)
    bounces: wp.array(dtype=wp.int32)
    grain: wp.float64
    escape2: wp.float64
    begin: wp.float64
    first: wp.int32
    kept: wp.int32
    logged: wp.array(dtype=wp.int32)
    times: wp.array(dtype=wp.float64)
    kinds: wp.array(dtype=wp.int32)
    places: wp.array(dtype=wp.vec3d)
    impulses: wp.array(dtype=wp.vec3d)


# Arrays that kernels write.
WRITTEN = ("states", "spins", "bounces", "logged", "times", "kinds", "places", "impulses")


@wp.func
def contact_particle(balls: wp.ref[ContactParticles], i: int):
    """The ball of particle i."""
    ball = ContactParticle()
    ball.index = i
    ball.law = balls.laws[i]
    ball.radius = balls.radii[i]
    ball.restitution = balls.restitutions[i]
    ball.friction = balls.frictions[i]
    ball.mobility = balls.mobilities[i]
    ball.grain = balls.grain
    return ball


@wp.func
def makes_events(law: wp.int32):
    """Whether a contact law makes events at the surface (bounce, absorb)."""
    return law == BOUNCE or law == ABSORB


@wp.func
def step_start(balls: wp.ref[ContactParticles], step: int, dt: wp.float64):
    """Time at which a step of the launch begins: the same number however a run is cut into launches."""
    return balls.begin + wp.float64(balls.first + step) * dt


@wp.func
def log_event(balls: wp.ref[ContactParticles], i: int, time: wp.float64, kind: wp.int32, place: wp.vec3d,
              impulse: wp.vec3d):  # fmt: skip
    """Append an event to the log."""
    made = balls.logged[i]
    slot = i * balls.kept + made % balls.kept
    balls.times[slot] = time
    balls.kinds[slot] = kind
    balls.places[slot] = place
    balls.impulses[slot] = impulse
    balls.logged[i] = made + 1
