"""Bounding volumes of primitives hold all within reach, and hard solids are of the same shape."""

import dataclasses

import numpy as np
import pytest
import warp as wp
from primitive_examples import EXAMPLES, TOUCHED, A, around, kernel_of, named

import fieldsim as fs
from fieldsim.potentials.elements import pack
from fieldsim.render.scene import bounds
from fieldsim.render.scene.volumes import pierce
from fieldsim.render.solids.skeleton import offset_solids
from fieldsim.sources.elements import surface_of
from fieldsim.world import shapes


@wp.kernel(module="unique", enable_backward=False)
def _pierce(
    origin: wp.array(dtype=wp.vec3),
    direction: wp.array(dtype=wp.vec3),
    shape: int,
    rows: wp.array2d(dtype=float),
    reach: float,
    spans: wp.array(dtype=wp.vec2),
):
    i = wp.tid()
    t0, t1 = pierce(origin[i], direction[i], shape, rows, 0, reach)
    spans[i] = wp.vec2(t0, t1)


def pierced(primitive, rows, origins, directions, reach):
    """Where rays enter and leave the volume of a row, (N,) and (N,)."""
    spans = wp.full(len(origins), wp.vec2(np.nan, np.nan), dtype=wp.vec2, device="cpu")
    arrays = [wp.array(values, dtype=wp.vec3, device="cpu") for values in (origins, directions)]
    table = wp.array(rows, dtype=float, device="cpu")
    inputs = [*arrays, int(primitive.volume), table, reach]
    wp.launch(_pierce, len(origins), inputs, [spans], device="cpu", block_dim=1)
    return spans.numpy().T


@pytest.mark.parametrize("primitive", TOUCHED, ids=named)
def test_bounding_volumes_hold_all_within_reach(primitive):
    elements = pack([primitive], [kernel_of(primitive)], [1.0])
    bounded = bounds.bound(elements, np.zeros(3), 1.0)
    reach = 0.2
    points = around(primitive, 3000, 0.2)
    away = np.array([primitive.distance(*x.tolist(), elements.rows, 0) for x in points])
    inside = points[away <= 0.999 * reach]
    assert len(inside) > 500
    # The capsule around all of it.
    start, end = bounded.start[0], bounded.end[0]
    along = end - start
    share = np.clip((inside - start) @ along / max(along @ along, 1e-300), 0.0, 1.0)
    far = np.linalg.norm(inside - start - share[:, None] * along, axis=1)
    assert (far <= bounded.radius[0] - bounded.reach[0] + reach).all()
    # The volume itself: rays through points within reach are inside it there.
    directions = np.random.default_rng(4).normal(size=inside.shape)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    t0, t1 = pierced(primitive, elements.rows, inside - 3.0 * directions, directions, reach)
    assert (t0 <= 3.0).all()
    assert (t1 >= 3.0).all()
    # And a ray that passes by misses it.
    if not primitive.endless:
        aside = np.cross(directions, (0.6, 0.0, 0.8))
        aside *= 4.0 / np.linalg.norm(aside, axis=1, keepdims=True)
        t0, t1 = pierced(primitive, elements.rows, A + aside - 3.0 * directions, directions, reach)
        assert (t0 > t1).all()


def solid_of(primitive):
    """What all within a distance of it is drawn as."""
    if primitive.endless:
        return shapes.SLAB
    return shapes.TUBE if primitive.round else {1: shapes.BALL, 2: shapes.CAPSULE, 3: shapes.PRISM}[primitive.corners]


@pytest.mark.parametrize("primitive", EXAMPLES, ids=named)
def test_it_is_drawn_hard_as_its_volume(primitive):
    kernel = kernel_of(primitive)
    skeleton = [primitive, dataclasses.replace(primitive)]
    # A solid's pull is its surface's field, at a level.
    pull = isinstance(kernel, fs.Newtonian)
    material = fs.Material(level=1.0) if pull else fs.Material(radius=0.2, kernel=type(kernel))
    world = fs.World()
    world.add_body(fs.Body(skeleton, gravity=kernel if pull else None, surface=material))
    solids = offset_solids(surface_of(world.at(0.0)), np.array([0.1, 0.2]))
    assert solids.kinds.tolist() == [solid_of(primitive)] * 2
    assert solids.owner.tolist() == [0, 0]
