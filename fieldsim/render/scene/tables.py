"""A scene's elements on a device, for the kernels that trace rays."""

import warp as wp

NO_HIT = wp.constant(-1.0)


FOREVER = wp.constant(1.0e30)


@wp.struct
class SceneTables:
    """Elements relative to the eye; see `bounds.Bounded`.

    exact: the rows in float64; tolerance: of the field, relative to its level.
    materials (M, ...), texels: see `materials.table` and `materials.mipmaps`; pixel: angular size of a pixel.
    optics (M,): shares of light reflected and transmitted, index of refraction, 0; visible (N,): bits of the rays that
    meet an element. turns, shifts (M,): x -> turn x + shift takes a point to the frame of the material's body, in the
    world's units.
    work (2,): counters of the cost layer, of one ray: evaluations of the field, evaluations of elements.
    """

    rows: wp.array2d(dtype=float)
    kinds: wp.array(dtype=int)
    shape: wp.array(dtype=int)
    reach: wp.array(dtype=float)
    core: wp.array(dtype=float)
    width: wp.array(dtype=float)
    bend: wp.array(dtype=float)
    order: wp.array(dtype=int)
    owner: wp.array(dtype=int)
    materials: wp.array2d(dtype=float)
    exact: wp.array2d(dtype=wp.float64)
    tolerance: float
    optics: wp.array(dtype=wp.vec4)
    visible: wp.array(dtype=int)
    turns: wp.array(dtype=wp.mat33)
    shifts: wp.array(dtype=wp.vec3)
    texels: wp.array(dtype=wp.vec3)
    pixel: float
    work: wp.array(dtype=int)
