"""Hard shapes in the picture: a pass that replaces hits by nearer ones on hard shapes, and finds their shadows.

It runs after the tracing of the soft surfaces, by any solver, and before the shading, which does not distinguish hits
on shapes from others; `Hits.blocked` says which lights are hidden by shapes.
"""

# ruff: noqa: UP018, RUF046 - float(0.0) and int(0) make variables that Warp lets a loop change

import weakref

import numpy as np
import warp as wp

from fieldsim.launch import launch
from fieldsim.render.materials import table
from fieldsim.render.materials.table import RGB, factors, triple
from fieldsim.render.materials.textures import beneath, carved, is_picture, pictured
from fieldsim.render.scene.hits import SOLIDS, Hits, Lights, above, origin_of, towards, write_rest
from fieldsim.render.scene.intervals import CAMERA, SHADOW
from fieldsim.render.scene.tables import FOREVER
from fieldsim.render.scene.volumes import pierce_sphere
from fieldsim.render.solids import intersection as geometry
from fieldsim.render.solids.extents import boxes, smallest
from fieldsim.render.solids.packing import Solids
from fieldsim.render.solids.textures import checkered, on_shape
from fieldsim.world import shapes

_BALL, _ELLIPSOID, _CYLINDER, _CAPSULE, _BOX, _TUBE, _PRISM, _SLAB, _MESH = (
    wp.constant(kind)
    for kind in (
        shapes.BALL,
        shapes.ELLIPSOID,
        shapes.CYLINDER,
        shapes.CAPSULE,
        shapes.BOX,
        shapes.TUBE,
        shapes.PRISM,
        shapes.SLAB,
        shapes.MESH,
    )
)
_LIFT = wp.constant(1.0e-4)  # of a shape's size: how far above it shadow rays start
_ROUNDING = wp.constant(2.0e-6)  # of the depth, likewise


@wp.struct
class Shapes:
    """Hard shapes relative to the eye; bounded shapes first.

    origin; turn: rotation into the shape's own frame; sizes: see `world.shapes`; size: its smallest length; mesh: id of
    a wp.Mesh; label: number in the snapshot; owner: number of its material; checker: linear; optics: as in `Hits`;
    visible: bits of the rays that meet it; bounded: number of bounded shapes; tree: a wp.Bvh of those; materials,
    texels: see `materials.table`; unit: a length in the world's units; stuff_turn, stuff_shift: x -> turn x + shift
    takes a point from the shape's own frame to its solid texture's, in the world's units.
    """

    kind: wp.array(dtype=int)
    origin: wp.array(dtype=wp.vec3)
    turn: wp.array(dtype=wp.mat33)
    sizes: wp.array(dtype=wp.vec4)
    size: wp.array(dtype=float)
    mesh: wp.array(dtype=wp.uint64)
    smooth: wp.array(dtype=int)
    label: wp.array(dtype=int)
    owner: wp.array(dtype=int)
    checker: wp.array(dtype=wp.vec3)
    optics: wp.array(dtype=wp.vec4)
    visible: wp.array(dtype=int)
    bounded: int
    tree: wp.uint64
    materials: wp.array2d(dtype=float)
    texels: wp.array(dtype=wp.vec3)
    unit: float
    stuff_turn: wp.array(dtype=wp.mat33)
    stuff_shift: wp.array(dtype=wp.vec3)


@wp.func
def shape_crossing(o: wp.vec3, d: wp.vec3, far: float, shapes: Shapes, i: int):
    """Distance at which a ray from o first crosses shape i; at least `far`, or FOREVER, if not before `far`."""
    q = shapes.turn[i] * (o - shapes.origin[i])
    e = shapes.turn[i] * d
    s = shapes.sizes[i]
    kind = shapes.kind[i]
    t0 = float(1.0)
    t1 = float(0.0)
    if kind == _SLAB:
        return geometry.slab_crossing(q, e, s[0], s[1], s[2])
    if kind == _TUBE:
        return geometry.tube_crossing(q, e, s[0], s[1], s[2])
    if kind == _MESH:
        found = wp.mesh_query_ray(shapes.mesh[i], q / s[0], e, wp.min(far / s[0], FOREVER))
        return wp.where(found.result, found.t * s[0], FOREVER)
    if kind == _BALL:
        t0, t1 = pierce_sphere(q, e, wp.vec3(0.0, 0.0, 0.0), s[0])
    elif kind == _BOX:
        t0, t1 = geometry.box_span(q, e, wp.vec3(s[0], s[1], s[2]))
    elif kind == _CAPSULE:
        t0, t1 = geometry.capsule_span(q, e, s[0], s[1])
    elif kind == _CYLINDER:
        t0, t1 = geometry.cylinder_span(q, e, s[0], s[1])
    elif kind == _ELLIPSOID:
        t0, t1 = geometry.ellipsoid_span(q, e, wp.vec3(s[0], s[1], s[2]))
    else:
        t0, t1 = geometry.prism_span(q, e, wp.vec3(s[0], 0.0, 0.0), wp.vec3(s[1], s[2], 0.0), s[3])
    return geometry.ahead(t0, t1)


@wp.func
def nearest_shape(o: wp.vec3, d: wp.vec3, far: float, ray: int, shapes: Shapes):
    """(t, i) of the first shape that this kind of ray meets before `far`; i = -1 for none."""
    best = float(far)
    which = int(-1)
    if shapes.bounded > 0:
        query = wp.bvh_query_ray(shapes.tree, o, d)
        i = int(0)
        while wp.bvh_query_next(query, i, best):
            if (shapes.visible[i] & ray) != 0:
                t = shape_crossing(o, d, best, shapes, i)
                if t < best:
                    best = t
                    which = i
    for j in range(shapes.bounded, shapes.kind.shape[0]):
        if (shapes.visible[j] & ray) != 0:
            t = shape_crossing(o, d, best, shapes, j)
            if t < best:
                best = t
                which = j
    return best, which


@wp.func
def shape_shadow(o: wp.vec3, d: wp.vec3, far: float, left_out: int, shapes: Shapes):
    """Whether a shape other than `left_out` blocks a ray."""
    if shapes.bounded > 0:
        query = wp.bvh_query_ray(shapes.tree, o, d)
        i = int(0)
        while wp.bvh_query_next(query, i, far):
            if i != left_out and (shapes.visible[i] & SHADOW) != 0:
                if shape_crossing(o, d, far, shapes, i) < far:
                    return True
    for j in range(shapes.bounded, shapes.kind.shape[0]):
        if j != left_out and (shapes.visible[j] & SHADOW) != 0:
            if shape_crossing(o, d, far, shapes, j) < far:
                return True
    return False


@wp.func
def _tint(o: wp.vec3, d: wp.vec3, far: float, shapes: Shapes, i: int):
    """Share of white light, by colour, that shape i transmits."""
    if (shapes.visible[i] & SHADOW) == 0 or shape_crossing(o, d, far, shapes, i) >= far:
        return wp.vec3(1.0, 1.0, 1.0)
    optics = shapes.optics[i]
    return (1.0 - optics[0]) * optics[1] * triple(shapes.materials, shapes.owner[i], RGB)


@wp.func
def shape_light(o: wp.vec3, d: wp.vec3, far: float, shapes: Shapes):
    """Share of white light, by colour, that hard shapes transmit along a ray."""
    light = wp.vec3(1.0, 1.0, 1.0)
    if shapes.bounded > 0:
        query = wp.bvh_query_ray(shapes.tree, o, d)
        i = int(0)
        while wp.bvh_query_next(query, i, far):
            light = wp.cw_mul(light, _tint(o, d, far, shapes, i))
    for j in range(shapes.bounded, shapes.kind.shape[0]):
        light = wp.cw_mul(light, _tint(o, d, far, shapes, j))
    return light


@wp.func
def normal_at(o: wp.vec3, d: wp.vec3, t: float, shapes: Shapes, i: int):
    """Where a ray meets shape i, in the shape's own frame: (normal to shade with, true normal, place)."""
    q = shapes.turn[i] * (o - shapes.origin[i])
    e = shapes.turn[i] * d
    p = q + t * e
    s = shapes.sizes[i]
    kind = shapes.kind[i]
    n = wp.vec3(0.0, 0.0, 1.0)
    if kind == _BALL:
        n = wp.normalize(p)
    elif kind == _ELLIPSOID:
        radii = wp.vec3(s[0], s[1], s[2])
        n = wp.normalize(wp.cw_div(wp.cw_div(p, radii), radii) * (s[0] * s[0]))
    elif kind == _BOX:
        n = geometry.box_normal(p, wp.vec3(s[0], s[1], s[2]))
    elif kind == _CYLINDER:
        n = geometry.cylinder_normal(p, s[0], s[1])
    elif kind == _CAPSULE:
        n = wp.normalize(p - wp.vec3(0.0, 0.0, wp.clamp(p[2], -s[1], s[1])))
    elif kind == _TUBE:
        n = geometry.tube_normal(p, s[0], s[2])
    elif kind == _PRISM:
        n = geometry.prism_normal(p, wp.vec3(s[0], 0.0, 0.0), wp.vec3(s[1], s[2], 0.0))
    elif kind == _MESH:
        # A little before the hit, so that rounding does not lose it.
        found = wp.mesh_query_ray(shapes.mesh[i], q / s[0], e, 1.001 * t / s[0] + 1.0e-3)
        n = found.normal
        if shapes.smooth[i] == 1:
            return wp.normalize(wp.mesh_eval_velocity(shapes.mesh[i], found.face, found.u, found.v)), n, p
    elif p[2] < 0.0:
        n = -n
    return n, n, p


@wp.func
def shape_color(p: wp.vec3, n: wp.vec3, e: wp.vec3, across: float, shapes: Shapes, i: int):
    """Colour of shape i at p in its own frame; n: normal there, e: direction of the ray, with the width of a pixel."""
    m = shapes.owner[i]
    if is_picture(shapes.materials, m):
        # Lengths in the world's units; the sizes of a tube hold an angle.
        s = shapes.unit * shapes.sizes[i]
        if shapes.kind[i] == _TUBE:
            s[2] = shapes.sizes[i][2]
        spot, ends = on_shape(shapes.kind[i], shapes.unit * p, n, s)
        slant = wp.sqrt(wp.max(wp.abs(wp.dot(n, e)), 1.0e-3))
        return pictured(shapes.materials, shapes.texels, m, spot, ends, shapes.unit * across / slant)
    if shapes.kind[i] == _SLAB and shapes.sizes[i][0] == 0.0:
        # A plane looks the same from both sides.
        p = wp.vec3(p[0], p[1], 0.0)
        n = wp.vec3(0.0, 0.0, 1.0)
    # Read the texture a little beneath the surface: on a face itself rounding would mottle a checker.
    p = shapes.unit * p - beneath(shapes.materials, m) * n
    return carved(shapes.materials, m, shapes.stuff_turn[i] * p + shapes.stuff_shift[i])


@wp.func
def _describe(i: int, t: float, which: int, d: wp.vec3, pixel: float, shapes: Shapes, hits: Hits):
    """Record a hit on a shape; returns the shape that cannot shadow it: itself if convex, else -1."""
    n, flat, p = normal_at(origin_of(i, hits), d, t, shapes, which)
    e = shapes.turn[which] * d
    kind = shapes.kind[which]
    m = shapes.owner[which]
    color = shape_color(p, flat, e, t * pixel, shapes, which)
    tile = shapes.sizes[which][3]
    if kind == _SLAB and tile > 0.0:
        share = checkered(p, e, t, pixel, tile)
        color = share * color + (1.0 - share) * shapes.checker[which]
    within = wp.dot(flat, e) > 0.0
    # From within, and from behind a plane or a face, its other side is seen.
    if within:
        n = -n
    hits.depth[i] = t
    write_rest(i, 0.0, hits)
    hits.thing[i] = SOLIDS + shapes.label[which]
    hits.normal[i] = wp.transpose(shapes.turn[which]) * n
    hits.color[i] = color
    hits.light[i] = factors(shapes.materials, m)
    hits.lift[i] = _LIFT * shapes.size[which] + _ROUNDING * t
    thin = kind == _SLAB and shapes.sizes[which][0] == 0.0
    if hits.optics.shape[0] > 0:
        optics = shapes.optics[which]
        optics[3] = wp.where(within, 1.0, 0.0)
        if thin:
            # Nothing lies between its two sides.
            optics[2] = 1.0
        hits.optics[i] = optics
    if thin or not (within or kind == _TUBE or kind == _MESH or kind == _SLAB):
        return which
    return -1


@wp.kernel(enable_backward=False)
def _overlay(
    start: int,
    pixel: float,
    ray: int,
    shapes: Shapes,
    lights: Lights,
    hits: Hits,
    blocked: wp.array2d(dtype=wp.uint8),
):
    i = start + wp.tid()
    d = hits.direction[i]
    far = float(FOREVER)
    if hits.thing[i] != -1:
        far = hits.depth[i]
    t, which = nearest_shape(origin_of(i, hits), d, far, ray, shapes)
    left_out = int(-1)
    if which >= 0:
        left_out = _describe(i, t, which, d, pixel, shapes, hits)
    elif hits.thing[i] == -1:
        return
    if blocked.shape[0] == 0:
        return
    p = above(i, hits)
    for k in range(lights.where.shape[0]):
        toward, end = towards(p, lights.where[k])
        blocked[i, k] = wp.uint8(0)
        if lights.shadows[k] == 1 and wp.dot(toward, hits.normal[i]) > 0.0:
            if shape_shadow(p, toward, end, left_out, shapes):
                blocked[i, k] = wp.uint8(1)


class SolidStage:
    """Hard shapes on a device, as seen from `eye`, in units of `unit`."""

    def __init__(self, solids: Solids, eye, unit: float, device):
        endless = (solids.kinds == shapes.SLAB) & (solids.sizes[:, 1] == 0.0)
        order = np.argsort(endless, kind="stable")
        self.device = device
        self.bounded = int(np.count_nonzero(~endless))
        # Angles and tiles' numbers aside, all sizes are lengths; a mesh is in units of its own.
        sizes = solids.sizes[order] / unit
        tubes = solids.kinds[order] == shapes.TUBE
        sizes[tubes, 2] = solids.sizes[order][tubes, 2]
        origins = (solids.origins[order] - eye) / unit
        self.shapes = self._uploaded(solids, order, origins, sizes)
        self.shapes.unit = unit
        turns, shifts = _stuff(solids)
        self.shapes.stuff_turn = wp.array(turns[order], dtype=wp.mat33, device=device)
        self.shapes.stuff_shift = wp.array(shifts[order], dtype=wp.vec3, device=device)
        low, high = boxes(solids, order[: self.bounded], sizes)
        self._tree = None
        self.shapes.tree = wp.uint64(0)
        if self.bounded:
            turned = np.abs(solids.axes[order[: self.bounded]])
            middle = np.einsum("nij,nj->ni", solids.axes[order[: self.bounded]], 0.5 * (low + high))
            middle += origins[: self.bounded]
            half = np.einsum("nij,nj->ni", turned, 0.5 * (high - low))
            # float32 rounds; a box without thickness would be missed.
            half += 1e-6 * (np.abs(middle) + half.max(axis=1, keepdims=True))
            ends = [wp.array(x, dtype=wp.vec3, device=device) for x in (middle - half, middle + half)]
            self._tree = wp.Bvh(*ends)
            self.shapes.tree = self._tree.id

    def overlay(self, hits: Hits, lights: Lights, pixel: float, count: int, ray=CAMERA, *, hide=True):
        """Overlay the shapes on the first `count` hits of rays of a kind; hide: also find the lights they hide."""
        shape = (hits.depth.shape[0], max(lights.where.shape[0], 1)) if hide else (0, 0)
        if hits.blocked.shape != shape:
            hits.blocked = wp.empty(shape, dtype=wp.uint8, device=self.device)
        launch(_overlay, count, [pixel, ray, self.shapes, lights, hits, hits.blocked], device=self.device)

    def _uploaded(self, solids, order, origins, sizes):
        device = self.device
        self._meshes = [solids.surfaces[k] and uploaded_mesh(solids.surfaces[k], device) for k in order]
        result = Shapes()
        result.kind = wp.array(solids.kinds[order], dtype=int, device=device)
        result.origin = wp.array(origins, dtype=wp.vec3, device=device)
        result.turn = wp.array(np.swapaxes(solids.axes[order], 1, 2), dtype=wp.mat33, device=device)
        result.sizes = wp.array(sizes, dtype=wp.vec4, device=device)
        result.size = wp.array(smallest(solids.kinds[order], sizes), dtype=float, device=device)
        result.mesh = wp.array([m.id if m else 0 for m in self._meshes], dtype=wp.uint64, device=device)
        smooth = [int(bool(s and s.smooth)) for s in (solids.surfaces[k] for k in order)]
        result.smooth = wp.array(smooth, dtype=int, device=device)
        result.label = wp.array(order.astype(np.int32), dtype=int, device=device)
        result.owner = wp.array(solids.owner[order], dtype=int, device=device)
        result.checker = wp.array(solids.checkers[order], dtype=wp.vec3, device=device)
        owner = solids.owner[order]
        result.optics = wp.array(table.optics(solids.materials)[owner], dtype=wp.vec4, device=device)
        visible = [table.rays_that_meet(solids.materials[k]) for k in owner]
        result.visible = wp.array(visible, dtype=int, device=device)
        result.materials, result.texels = table.table(solids.materials, device)
        result.bounded = self.bounded
        return result


def _stuff(solids):
    """Turns (N, 3, 3) and shifts (N, 3) from the shapes' own frames to those of their solid textures."""
    turns, shifts = np.tile(np.eye(3), (len(solids), 1, 1)), np.zeros((len(solids), 3))
    for number, pose in enumerate(solids.poses):
        if pose is not None:
            where = solids.owner == number
            turns[where] = pose.matrix.T @ solids.axes[where]
            shifts[where] = (solids.origins[where] - pose.position) @ pose.matrix
    return turns, shifts


_MESHES = weakref.WeakKeyDictionary()


def uploaded_mesh(surface: shapes.TriangleSurface, device) -> wp.Mesh:
    """The mesh on a device, about its middle, in its own unit of length; kept as long as `surface` lives."""
    kept = _MESHES.setdefault(surface, {})
    if device.alias not in kept:
        points = (surface.mesh.vertices - surface.box[0]) / surface.sizes[0]
        # Vertex normals are stored as the mesh's velocities, which Warp interpolates.
        kept[device.alias] = wp.Mesh(
            points=wp.array(points, dtype=wp.vec3, device=device),
            indices=wp.array(surface.mesh.faces.ravel().astype(np.int32), dtype=int, device=device),
            velocities=wp.array(_vertex_normals(surface.mesh), dtype=wp.vec3, device=device),
        )
    return kept[device.alias]


def _vertex_normals(mesh):
    """Mean normals (V, 3) of the faces around each vertex, weighted by area."""
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    areas = np.cross(b - a, c - a)
    normals = np.zeros_like(mesh.vertices)
    for corner in range(3):
        np.add.at(normals, mesh.faces[:, corner], areas)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
