"""Secondary rays: the intervals in which they cross elements' bounding volumes, from a tree, and particles ahead."""

# ruff: noqa: UP018, RUF046 - int(0) makes a variable that Warp lets a loop change

import warp as wp

from fieldsim.render.scene.hits import Balls
from fieldsim.render.scene.rows import point_of
from fieldsim.render.scene.tables import FOREVER, SceneTables
from fieldsim.render.scene.volumes import pierce, pierce_sphere
from fieldsim.world.material import RAYS

CAMERA, SHADOW, REFLECTED, TRANSMITTED = (wp.constant(1 << k) for k in range(len(RAYS)))
FULL = wp.constant(-1)  # instead of a count: the intervals do not fit
BLOCKED = wp.constant(-2)  # one element alone exceeds the level


@wp.func
def collect_intervals(
    scene: SceneTables,
    tree: wp.uint64,
    o: wp.vec3,
    d: wp.vec3,
    far: float,
    ray: int,
    opaque: bool,
    ids: wp.array(dtype=int),
    t0s: wp.array(dtype=float),
    t1s: wp.array(dtype=float),
    room: int,
):
    """Collect the sorted intervals before `far` of elements visible to this kind of ray; returns their number or FULL.

    opaque: return BLOCKED at a point element that alone exceeds the level (valid if all strengths are positive).
    """
    if scene.kinds.shape[0] == 0:
        return 0
    count = int(0)
    query = wp.bvh_query_ray(tree, o, d)
    i = int(0)
    while wp.bvh_query_next(query, i, far):
        if (scene.visible[i] & ray) == 0:
            continue
        t0, t1 = pierce(o, d, scene.shape[i], scene.rows, i, scene.reach[i])
        if t1 > 0.0 and t0 < far and t0 < t1:
            if opaque:
                center = point_of(scene.rows, i)
                c0, c1 = pierce_sphere(o, d, center, scene.core[i])
                if c0 > 0.0 and c0 < far and c0 < c1:
                    return BLOCKED
            if count == room:
                return FULL
            count = insert(ids, t0s, t1s, count, i, t0, t1)
    return count


@wp.func
def ball_ahead(o: wp.vec3, d: wp.vec3, balls: Balls):
    """(t, index) of the first particle that a ray meets; FOREVER and -1 for none."""
    best = float(FOREVER)
    which = int(-1)
    if balls.radius.shape[0] > 0:
        query = wp.bvh_query_ray(balls.tree, o, d)
        i = int(0)
        while wp.bvh_query_next(query, i, best):
            t0, t1 = pierce_sphere(o, d, balls.center[i], balls.radius[i])
            if t0 > 0.0 and t0 < best and t0 < t1:
                best = t0
                which = i
    return best, which


@wp.func
def insert(
    ids: wp.array(dtype=int),
    t0s: wp.array(dtype=float),
    t1s: wp.array(dtype=float),
    count: int,
    i: int,
    t0: float,
    t1: float,
):
    """Insert an interval into the list sorted by entry; the list must have room."""
    k = int(count)
    while k > 0 and t0s[wp.max(k - 1, 0)] > t0:
        ids[k] = ids[k - 1]
        t0s[k] = t0s[k - 1]
        t1s[k] = t1s[k - 1]
        k -= 1
    ids[k] = i
    t0s[k] = t0
    t1s[k] = t1
    return count + 1


@wp.func
def keep_after(ids: wp.array(dtype=int), t0s: wp.array(dtype=float), t1s: wp.array(dtype=float), count: int, t: float):
    """Drop the intervals that end before t; returns how many are left."""
    left = int(0)
    for k in range(count):
        if t1s[k] > t:
            ids[left] = ids[k]
            t0s[left] = t0s[k]
            t1s[left] = t1s[k]
            left += 1
    return left
