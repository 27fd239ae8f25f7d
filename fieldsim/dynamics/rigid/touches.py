"""What touches: surface points within other surfaces, gathered into patches, as Warp functions.

Friction and damping need more of a contact than its energy: which points touch, where, how hard, and what was there at
the moment before. So the points are listed as the energy is summed, always in one order, by which a list finds again
what the one before it knew. Neighbours with one direction make a *patch*, on which damping acts as a whole: a ball that
rolls approaches the ground before its patch's middle and leaves it behind, and loses nothing by that.
"""

import functools

import warp as wp

from fieldsim.sources.stages import Stages
from fieldsim.sources.surface_velocity import twist_at

# The other body, where it is what is prescribed.
PRESCRIBED = wp.constant(wp.int32(-1))
# Normals of one patch differ by less than the angle with this cosine.
ALIGNED = wp.constant(wp.float64(0.7))
NEW = wp.constant(wp.float64(-1.0))


@wp.struct
class Touches:
    """At most C points that touch, in two lists: that of now, `now[0]`, and the one before it.

    counts (2,). bodies, others, points (2, C): the free body that is pushed along the normal, the one that pushes it or
    PRESCRIBED, and which point; in ascending order. speeds (2, C): of approach when the patch first met, or NEW;
    rubs (2, C): force of friction. Of the list of now alone, (C,): places, normals, depths; presses: elastic force;
    grounds: velocity of what is prescribed there; patches: the first point of the patch that it belongs to; heads: room
    for these; deepest: the greatest depth in a patch. ranges (B,): how far a patch extends.
    """

    now: wp.array(dtype=wp.int32)
    counts: wp.array(dtype=wp.int32)
    bodies: wp.array2d(dtype=wp.int32)
    others: wp.array2d(dtype=wp.int32)
    points: wp.array2d(dtype=wp.int32)
    speeds: wp.array2d(dtype=wp.float64)
    rubs: wp.array2d(dtype=wp.vec3d)
    depths: wp.array(dtype=wp.float64)
    places: wp.array(dtype=wp.vec3d)
    normals: wp.array(dtype=wp.vec3d)
    presses: wp.array(dtype=wp.float64)
    grounds: wp.array(dtype=wp.vec3d)
    patches: wp.array(dtype=wp.int32)
    heads: wp.array(dtype=wp.int32)
    deepest: wp.array(dtype=wp.float64)
    ranges: wp.array(dtype=wp.float64)


@wp.func
def ignored(
    touches: Touches,
    body: int,
    other: int,
    point: int,
    p: wp.vec3d,
    normal: wp.vec3d,
    depth: wp.float64,
    press: wp.float64,
):
    """What touches is not listed."""
    return


@wp.func
def listed(
    touches: Touches,
    body: int,
    other: int,
    point: int,
    p: wp.vec3d,
    normal: wp.vec3d,
    depth: wp.float64,
    press: wp.float64,
):
    """List a point that touches; what the list cannot hold is counted alone."""
    now = touches.now[0]
    i = touches.counts[now]
    touches.counts[now] = i + 1
    if i < touches.places.shape[0]:
        touches.bodies[now, i] = body
        touches.others[now, i] = other
        touches.points[now, i] = point
        touches.depths[i] = depth
        touches.places[i] = p
        touches.normals[i] = normal
        touches.presses[i] = press


@wp.func
def begun(touches: Touches):
    """Begin another list."""
    now = 1 - touches.now[0]
    touches.now[0] = now
    touches.counts[now] = 0


@wp.func
def length_of(touches: Touches, which: int):
    """How many points a list holds."""
    return wp.min(touches.counts[which], touches.places.shape[0])


@wp.func
def compared(touches: Touches, one: int, i: int, two: int, j: int):
    """Whether entry i of a list comes before (-1), with (0) or after (1) entry j of the other."""
    d = touches.bodies[one, i] - touches.bodies[two, j]
    if d == 0:
        d = touches.others[one, i] - touches.others[two, j]
    if d == 0:
        d = touches.points[one, i] - touches.points[two, j]
    return wp.clamp(d, -1, 1)


@wp.func
def remembered(touches: Touches):
    """Give each entry of the list of now what the one before knew of it."""
    now = touches.now[0]
    before = 1 - now
    count = length_of(touches, before)
    j = wp.int32(0)
    for i in range(length_of(touches, now)):
        touches.speeds[now, i] = NEW
        touches.rubs[now, i] = wp.vec3d()
        while j < count and compared(touches, before, j, now, i) < 0:
            j = j + 1
        if j < count and compared(touches, before, j, now, i) == 0:
            touches.speeds[now, i] = touches.speeds[before, j]
            touches.rubs[now, i] = touches.rubs[before, j]


@wp.func
def patched(touches: Touches):
    """Gather the points into patches: each joins the first that begins near it."""
    now = touches.now[0]
    count = wp.int32(0)
    for i in range(length_of(touches, now)):
        body = touches.bodies[now, i]
        other = touches.others[now, i]
        if count > 0:
            j = touches.heads[0]
            if touches.bodies[now, j] != body or touches.others[now, j] != other:
                count = 0  # these are patches of another pair
        found = wp.int32(-1)
        for n in range(count):
            j = touches.heads[n]
            near = wp.length(touches.places[j] - touches.places[i]) < touches.ranges[body]
            if found < 0 and near and wp.dot(touches.normals[j], touches.normals[i]) > ALIGNED:
                found = j
        if found < 0:
            found = wp.int32(i)
            touches.heads[count] = i
            count = count + 1
        touches.patches[i] = found


@wp.func
def levelled(touches: Touches):
    """Move the places, along their normals, to the depth of their patch's deepest point.

    Where they are, a ball that rolls would slip at all points but the lowest, which is farther from its centre.
    """
    count = length_of(touches, touches.now[0])
    for i in range(count):
        k = touches.patches[i]
        touches.deepest[k] = wp.max(wp.where(i == k, wp.float64(0.0), touches.deepest[k]), touches.depths[i])
    for i in range(count):
        lower = touches.deepest[touches.patches[i]] - touches.depths[i]
        touches.places[i] = touches.places[i] - lower * touches.normals[i]


@functools.cache
def met(surface_kinds):
    """Warp function (stage, surfaces, touches) -> None: what a new list needs, once it is full."""
    twist = twist_at(surface_kinds)

    @wp.func
    def meet(stage: int, surfaces: Stages, touches: Touches):
        remembered(touches)
        patched(touches)
        levelled(touches)
        now = touches.now[0]
        for i in range(length_of(touches, now)):
            ground = wp.vec3d()
            if touches.others[now, i] == PRESCRIBED:
                p = touches.places[i]
                turn, shift = twist(p, surfaces, stage)
                ground = wp.cross(turn, p) + shift
            touches.grounds[i] = ground

    return meet
