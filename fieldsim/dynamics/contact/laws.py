"""Laws of contact, written once for all who touch: particles, free bodies, geoms of MuJoCo.

Depths are lengths: how far a point lies within a surface. Along the normal a repulsion pushes out, and what is below a
restitution of 1 is lost to a damping that follows it; along the surface Coulomb's friction acts by impulses.
"""

import math

from fieldsim.portable import portable, real

# A restitution below this counts as this: without any rebound the damping would have no end.
LEAST_RESTITUTION = 1e-3
# From here on the damping of a restitution is taken from its series, which is exact to 1e-6 of it.
NEARLY_ELASTIC = 0.9999
THIRD = 1.0 / 3.0
TWELFTH = 1.0 / 12.0


@portable
def pressed(depth: real, stiffness: real):
    """(energy, force) of a repulsion at a depth: stiffness depth^3 / 3 and its derivative; both 0 outside.

    Twice continuously differentiable, so that an integrator keeps its order where contact begins and ends.
    """
    if depth <= real(0.0):
        return real(0.0), real(0.0)
    force = stiffness * depth * depth
    return force * depth * real(THIRD), force


@portable
def coulomb(
    slip_x: real,
    slip_y: real,
    slip_z: real,
    sum_x: real,
    sum_y: real,
    sum_z: real,
    mobility: real,
    limit: real,
):
    """The impulse of friction (x, y, z) that ends the slip, or what Coulomb's law allows of it.

    slip: velocity along the surface, relative to the ground, under the impulse `sum` so far; mobility: change of slip
    per impulse (1 / m of a point mass); limit: mu times the normal impulse. Repeated over the points of several
    contacts, each with its own sum, this is projected Gauss-Seidel's method.
    """
    x = sum_x - slip_x / mobility
    y = sum_y - slip_y / mobility
    z = sum_z - slip_z / mobility
    size = math.sqrt(x * x + y * y + z * z)
    if size > limit:
        share = max(limit, real(0.0)) / size
        return share * x, share * y, share * z
    return x, y, z


@portable
def joint_friction(one: real, other: real):
    """Coulomb's coefficient between two bodies: the geometric mean of their own."""
    return math.sqrt(one * other)


@portable
def joint_restitution(one: real, other: real):
    """Restitution between two bodies: that of the softer one."""
    return min(one, other)


@portable
def damping(restitution: real):
    """The number c of the force f (1 + c v / v0) with which what came at the speed v0 leaves at restitution v0.

    v: speed of approach; f: any elastic force, since v dv / (1 + c v / v0) = -f dx / m gives

        c - log(1 + c) = -e c - log(1 - e c)

    for every f. Hunt & Crossley 1975; the relation is exact. 0 at a restitution of 1, about 1 / e at small ones.
    """
    e = max(restitution, real(LEAST_RESTITUTION))
    if e > real(NEARLY_ELASTIC):
        return real(1.5) * (real(1.0) - e * e) / (real(1.0) + e * e * e)
    low = real(0.0)
    high = real(1.0)
    for _ in range(60):
        x = real(0.5) * (low + high)
        c = x / e
        if x < real(1.0) and c - math.log(real(1.0) + c) > -x - math.log(real(1.0) - x):
            low = x
        else:
            high = x
    return real(0.5) * (low + high) / e


@portable
def late_share(rate: real):
    """The share of the final speed in the mean on which damping acts over a time: 1/2 at slow, 1 at fast decay.

    rate: decay rate times the time. With the mean (1 - share) v_before + share v_after an impulse of damping is the
    exact one of v' = -rate (v - v_end): it never reverses the speed, however long the time.
    """
    if rate < real(1e-3):
        return real(0.5) + rate * real(TWELFTH)
    return real(1.0) / (real(1.0) - math.exp(-rate)) - real(1.0) / rate
