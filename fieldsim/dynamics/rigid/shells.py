"""Surfaces of bodies as kernels read them: points spread over them, and their elements."""

import warp as wp


@wp.struct
class Shells:
    """Surfaces of B free bodies, in their principal frames.

    points, weights: surface points and their area times stiffness. blocks: centres and radii of spheres around the
    points of each block, which end at block_end; those of body b begin at first_block[b]. rows, kinds: elements of the
    surface fields with their reach (see `sources.margins`), those of body b from first_row[b]. reach (B,): radius about
    the centre of mass that holds the surface. grains (B + 1,): lengths over which the bodies' fields vary, and at the
    end that of the prescribed ones. stiffness, spacing (B,): of contacts, and the distance between points.
    apart: 1 where free bodies are not to touch each other.
    """

    points: wp.array(dtype=wp.vec3d)
    weights: wp.array(dtype=wp.float64)
    blocks: wp.array(dtype=wp.vec4d)
    block_end: wp.array(dtype=wp.int32)
    first_block: wp.array(dtype=wp.int32)
    rows: wp.array2d(dtype=wp.float64)
    kinds: wp.array(dtype=wp.int32)
    first_row: wp.array(dtype=wp.int32)
    reach: wp.array(dtype=wp.float64)
    grains: wp.array(dtype=wp.float64)
    stiffness: wp.array(dtype=wp.float64)
    spacing: wp.array(dtype=wp.float64)
    apart: int


@wp.struct
class Thin:
    """Points on those prescribed surfaces that are thinner than free bodies' points are apart, in the world's frame.

    points (stages, n), areas (n,). blocks (stages, m): spheres as in `Shells`, block_end (m,). width (m,): the least
    radius of a block's surface. moving: 1 if there is a row for each stage of a launch, 0 if there is one for all.
    """

    points: wp.array2d(dtype=wp.vec3d)
    areas: wp.array(dtype=wp.float64)
    blocks: wp.array2d(dtype=wp.vec4d)
    block_end: wp.array(dtype=wp.int32)
    width: wp.array(dtype=wp.float64)
    moving: int


@wp.func
def begin_of(block_end: wp.array(dtype=wp.int32), block: int):
    """Where the points of a block begin."""
    begin = wp.int32(0)
    if block > 0:
        begin = block_end[block - 1]
    return begin
