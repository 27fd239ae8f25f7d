"""From a snapshot and a camera to a picture."""

# ruff: noqa: UP018 - bool(False) makes a variable that Warp lets a branch change

import functools
import math
import warnings

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.errors import FieldsimWarning, InputError
from fieldsim.launch import device_named, launch
from fieldsim.render import bells, bounds, layers, materials, shadows
from fieldsim.render.camera import Camera
from fieldsim.render.candidates import TILE, View, candidates, capsules
from fieldsim.render.hermite import Scene
from fieldsim.render.primary import OVERFLOW, bells_kernel, trace_kernel
from fieldsim.render.shading import BALLS, Balls, Hits, lights_of, shade_kernel
from fieldsim.render.sky import sky_of
from fieldsim.render.solids import SolidStage
from fieldsim.render.solids_skeleton import MODES, drawn
from fieldsim.render.solvers import solver_named

# Samples of a pixel on a 4 x 4 grid: four with no two in a row or column, then the other twelve.
_ROOKS = ((0, 1), (1, 3), (2, 0), (3, 2))
_REST = tuple((x, y) for y in range(4) for x in range(4) if (x, y) not in _ROOKS)
_SCRATCH = 1 << 22  # intervals held in global memory at a time
CONTRAST = wp.constant(0.1)  # of square roots of linear colours, from which pixels are given more samples
QUALITIES = {"draft": 4, "final": 16}


def render(snapshot, camera: Camera, *, size=(640, 360), quality="final", device=None) -> np.ndarray:
    """The picture of a snapshot: (height, width, 3) uint8, sRGB. See `Renderer`, which serves many frames better."""
    return Renderer(size, quality, device).frame(snapshot, camera)


class Renderer:
    """Renders frames, keeping buffers between them.

    size: (width, height) in pixels. quality: "draft" (edges get 4 samples a pixel) or "final" (up to 16).
    device: "cpu", "cuda", ... shadows, samples: switch shadows off, and set the greatest number of samples a pixel: 1,
    4 or 16. tolerance: of the field, relative to its level: what of distant elements may be left out, and how far a
    hump that only grazes a ray may rise unseen. rays: traced so far. A camera in a body sees the surface from within.
    mode: how bodies are drawn: "soft", as their surfaces; "hard", each primitive by itself as what lies within the
    material's radius: balls, capsules, arc tubes, slabs; "skeleton", as thin lines.
    solver: how primary rays find surfaces, see `solvers`.
    Raises InputError for a size, a quality, a mode or a solver that cannot be, and for a surface that the solver cannot
    do.
    """

    def __init__(
        self,
        size=(640, 360),
        quality="final",
        device=None,
        *,
        shadows=True,
        samples=None,
        tolerance=1e-5,
        mode="soft",
        solver="hermite",
    ):
        self.size = _checked_size(size)
        if quality not in QUALITIES:
            raise InputError(f"Renderer: quality is {quality!r}; give 'draft' or 'final'")
        self.samples = QUALITIES[quality] if samples is None else samples
        if self.samples not in (1, 4, 16):
            raise InputError(f"Renderer: samples is {samples!r}; give 1, 4 or 16")
        if mode not in MODES:
            raise InputError(f"Renderer: mode is {mode!r}; give 'soft', 'hard' or 'skeleton'")
        self.mode = mode
        self.device = device_named(device)
        self.shadows = shadows
        self.solver = solver_named(solver)
        self.tolerance = validate.number("Renderer", "tolerance", tolerance, above=0.0)
        self.rays = 0
        self._hits = {}
        self._warned = False
        self._layout()

    def frame(self, snapshot, camera: Camera) -> np.ndarray:
        """The picture of a snapshot, (height, width, 3) uint8, sRGB."""
        stage = Stage(snapshot, camera.at(snapshot.time), self)
        hits = self._trace(stage, self._grid, "pixels")
        color = self._shade(stage, hits, self._grid.shape[0])
        if self.samples > 1:
            self._smooth(stage, hits, color)
        picture = wp.empty((self.size[1], self.size[0], 3), dtype=wp.uint8, device=self.device)
        launch(_develop, self._slot.shape[0], [self._slot, color], [picture.flatten()], device=self.device)
        self._look_for_surface(stage, hits)
        return picture.numpy()

    def depth_and_normals(self, snapshot, camera: Camera):
        """Distances along the rays through pixel centres (inf for a miss), (H, W), and unit normals, (H, W, 3)."""
        stage = Stage(snapshot, camera.at(snapshot.time), self)
        hits = self._trace(stage, self._grid, "pixels")
        slot = self._slot.numpy()
        width, height = self.size
        depth = hits.depth.numpy()[slot].reshape(height, width) * stage.unit
        return np.where(depth < 0, np.inf, depth), hits.normal.numpy()[slot].reshape(height, width, 3)

    def layers(self, snapshot, camera: Camera) -> dict[str, np.ndarray]:
        """What the rays through pixel centres find: arrays by the names of `layers.LAYERS`, and `owner`."""
        stage = Stage(snapshot, camera.at(snapshot.time), self)
        hits = self._trace(stage, self._grid, "layers", layered=True)
        return layers.collect(hits, self._slot.numpy(), self.size, stage.unit, snapshot)

    def _layout(self):
        """Pixel centres in the order of tiles, and where each pixel is in that order."""
        width, height = self.size
        y, x = np.divmod(np.arange(width * height), width)
        order = np.lexsort((x, y, x // TILE, y // TILE))
        slot = np.empty(width * height, dtype=np.int32)
        slot[order] = np.arange(width * height, dtype=np.int32)
        centers = np.stack([x[order] + 0.5, y[order] + 0.5], axis=1)
        self._pixels = np.stack([x[order], y[order]], axis=1)
        self._grid = wp.array(centers, dtype=wp.vec2, device=self.device)
        self._slot = wp.array(slot, dtype=int, device=self.device)
        self._edge = wp.empty(width * height, dtype=wp.uint8, device=self.device)

    def _buffers(self, name, count) -> Hits:
        """Hits with room for `count` samples, kept under `name`."""
        hits = self._hits.get(name)
        if hits is None or hits.depth.shape[0] < count:
            count = int(1.25 * count) if name == "samples" else count
            hits = Hits()
            for field, dtype in _HIT_FIELDS.items():
                setattr(hits, field, wp.empty(count, dtype=dtype, device=self.device))
            hits.blocked = wp.empty((0, 0), dtype=wp.uint8, device=self.device)
            self._hits[name] = hits
        return hits

    def _trace(self, stage, samples, name, layered=False) -> Hits:
        count = samples.shape[0]
        hits = self._buffers(name, count)
        options = {"layered": True} if layered else self.solver.options
        if layered:
            layers.prepare(hits, count, stage.scene.materials.shape[0], self.device)
        inputs = [stage.view, stage.scene, self.solver.lists(stage), stage.balls, stage.ball_lists]
        if stage.bells and not layered and self.solver.name == "hermite":
            kernel = bells_kernel(stage.kinds, stage.bells == "segments")
            given = [stage.view, stage.scene, stage.table, stage.lists, stage.balls, stage.ball_lists]
            self._launch_groups(kernel, count, [*given, samples, hits])
        else:
            launch(trace_kernel(stage.kinds, **options), count, [*inputs, samples, hits], device=self.device)
        self.rays += count
        late = np.flatnonzero(hits.thing.numpy()[:count] == int(OVERFLOW))
        for which, scratch in self._scratch(late, stage):
            launch(
                trace_kernel(stage.kinds, True, **options),
                len(which),
                [*inputs, which, samples, hits, *scratch],
                device=self.device,
                grain=1,
            )
        self.solver.finish(stage, samples, hits)
        if stage.solids is not None:
            stage.solids.overlay(hits, stage.lights, stage.view.pixel, count)
        return hits

    def _launch_groups(self, kernel, count, arguments):
        """Launch a kernel whose items are groups of samples: a tile on a CPU, single samples on a GPU."""
        group = 1 if self.device.is_cuda else TILE * TILE
        launch(kernel, -(-count // group), [group, *arguments], device=self.device, grain=4)

    def _shade(self, stage, hits, count):
        color = wp.empty(count, dtype=wp.vec3, device=self.device)
        rays = wp.empty(count, dtype=int, device=self.device)
        inputs = [stage.balls, stage.lights, stage.sky]
        if stage.bells:
            kernel = shadows.shade_kernel(stage.bells == "segments")
            self._launch_groups(kernel, count, [stage.table, stage.blockers, *inputs, hits, color, rays])
        else:
            inputs = [stage.scene, stage.tree, *inputs]
            launch(shade_kernel(stage.kinds), count, [*inputs, hits, color, rays], device=self.device)
        cast = rays.numpy()
        late = np.flatnonzero(cast < 0)
        for which, scratch in self._scratch(late, stage):
            launch(
                shade_kernel(stage.kinds, True),
                len(which),
                [stage.scene, stage.tree, *inputs[-3:], which, hits, color, rays, *scratch],
                device=self.device,
                grain=1,
            )
        self.rays += int(rays.numpy().sum())
        return color

    def _scratch(self, late, stage):
        """Batches of samples whose intervals do not fit into local memory, with global memory for them."""
        room = max(stage.count, 1)
        step = max(1, _SCRATCH // room)
        for k in range(0, len(late), step):
            which = wp.array(late[k : k + step].astype(np.int32), dtype=int, device=self.device)
            shape = (len(which), room)
            yield which, [wp.empty(shape, dtype=dtype, device=self.device) for dtype in (int, float, float)]

    def _smooth(self, stage, hits, color):
        """Give more samples to pixels that differ from their neighbours, and more still where those differ."""
        width, height = self.size
        launch(_edges, width * height, [width, height, self._slot, hits, color], [self._edge], device=self.device)
        edges = np.flatnonzero(self._edge.numpy())
        seen = self._supersample(stage, edges, _ROOKS)
        if self.samples > 4 and len(edges):
            perceived = np.sqrt(np.maximum(seen, 0.0))
            spread = (perceived.max(axis=1) - perceived.min(axis=1)).max(axis=1) > CONTRAST
            edges_more = edges[spread]
            more = self._supersample(stage, edges_more, _REST)
            self._put(color, edges_more, np.concatenate([seen[spread], more], axis=1).mean(axis=1))
            edges, seen = edges[~spread], seen[~spread]
        self._put(color, edges, seen.mean(axis=1))

    def _supersample(self, stage, pixels, pattern):
        """Colours (N, len(pattern), 3) in 0..1 of samples within pixels."""
        if not len(pixels):
            return np.zeros((0, len(pattern), 3), dtype=np.float32)
        offsets = (np.array(pattern) + 0.5) / 4.0
        points = (self._pixels[pixels][:, None, :] + offsets).reshape(-1, 2)
        samples = wp.array(points, dtype=wp.vec2, device=self.device)
        hits = self._trace(stage, samples, "samples")
        color = self._shade(stage, hits, len(points)).numpy()
        # Brighter than white counts as white, or highlights would have ragged edges.
        return np.minimum(color, 1.0).reshape(len(pixels), len(pattern), 3)

    def _put(self, color, pixels, values):
        if len(pixels):
            which = wp.array(pixels.astype(np.int32), dtype=int, device=self.device)
            values = wp.array(values, dtype=wp.vec3, device=self.device)
            launch(_scatter, len(pixels), [which, values], [color], device=self.device)

    def _look_for_surface(self, stage, hits):
        """Warn, once, where no pixel sees a surface because the field nowhere reaches the level."""
        things = hits.thing.numpy()
        if self._warned or not stage.count or ((things >= 0) & (things < int(BALLS))).any():
            return
        self._warned = True
        if not bounds.reaches_level(stage.bounded):
            warnings.warn(
                "nothing to see: the surface field stays below its level even on the skeleton; lower the materials' "
                "threshold or raise their radius",
                FieldsimWarning,
                stacklevel=3,
            )


class Stage:
    """A snapshot on the device, as one camera sees it: lengths relative to the eye, in units of `unit`."""

    def __init__(self, snapshot, camera, renderer):
        self.device = device = renderer.device
        centers, radii, colors = snapshot.spheres
        self.eye = eye = np.asarray(camera.eye)
        self.view = _view(camera, renderer.size)
        self.surface, solids = drawn(snapshot, renderer.mode, eye, self.view.pixel)
        surface = self.surface
        renderer.solver.check(surface.elements)
        self.count = len(surface.elements)
        self.kinds = surface.elements.kinds_used
        self.unit = bounds.unit_of(surface.elements, radii if len(radii) else solids.lengths)
        self.bounded = bounded = bounds.bound(surface.elements, eye, self.unit, renderer.tolerance)
        self.scene = _scene(bounded, surface, eye, self.unit, renderer.tolerance, device)
        self.scene.pixel = self.view.pixel
        self.bells = bells.kind_of(bounded)
        self.table = bells.bells_of(bounded, device) if self.bells else None
        shapes = capsules(bounded.start, bounded.end, bounded.radius, device)
        self.lists = candidates(self.view, shapes, device)
        centers, radii = (centers - eye) / self.unit, radii / self.unit
        ball_shapes = capsules(centers, centers, radii, device)
        self.ball_lists = candidates(self.view, ball_shapes, device)
        self.lights = lights_of(snapshot.world.lights, eye, self.unit, renderer.shadows, device)
        self.sky = sky_of(snapshot.world.background, self.view.pixel, device)
        self.solids = SolidStage(solids, eye, self.unit, device) if len(solids) else None
        self._bvhs = []
        self.shadows = needed = renderer.shadows and any(light.shadows for light in snapshot.world.lights)
        if self.bells:
            self.blockers = shadows.blockers_of(self.lights, bounded, self, device)
        self.balls = Balls()
        self.balls.center = ball_shapes.start
        self.balls.radius = ball_shapes.radius
        self.balls.color = wp.array(colors, dtype=wp.vec3, device=device)
        self.balls.tree = self._tree(centers, centers, radii, device) if needed else wp.uint64(0)

    @functools.cached_property
    def tree(self):
        """A tree of all elements, for rays that come from anywhere."""
        bounded = self.bounded
        if not self.shadows:
            return wp.uint64(0)
        return self._tree(bounded.start, bounded.end, bounded.radius, self.device)

    def _tree(self, start, end, radius, device):
        if not len(start):
            return wp.uint64(0)
        low = np.minimum(start, end) - radius[:, None]
        high = np.maximum(start, end) + radius[:, None]
        tree = wp.Bvh(wp.array(low, dtype=wp.vec3, device=device), wp.array(high, dtype=wp.vec3, device=device))
        self._bvhs.append(tree)
        return tree.id


_HIT_FIELDS = {
    "direction": wp.vec3,
    "depth": float,
    "thing": int,
    "normal": wp.vec3,
    "color": wp.vec3,
    "light": wp.vec4,
    "lift": float,
}


def _scene(bounded, surface, eye, unit, tolerance, device) -> Scene:
    scene = Scene()
    scene.rows = wp.array(bounded.rows, dtype=float, ndim=2, device=device)
    scene.kinds = wp.array(bounded.kinds, dtype=int, device=device)
    scene.shape = wp.array(bounded.shape, dtype=int, device=device)
    scene.reach = wp.array(bounded.reach, dtype=float, device=device)
    scene.core = wp.array(bounded.core, dtype=float, device=device)
    scene.width = wp.array(bounded.width, dtype=float, device=device)
    scene.bend = wp.array(bounded.bend, dtype=float, device=device)
    scene.order = wp.array(bounded.order, dtype=int, device=device)
    scene.exact = wp.array(bounded.rows, dtype=wp.float64, ndim=2, device=device)
    scene.tolerance = tolerance
    scene.owner = wp.array(surface.owner, dtype=int, device=device)
    scene.materials, scene.texels = materials.table(surface.materials, device)
    turns = [pose.matrix.T for pose in surface.poses]
    shifts = [turn @ (eye - pose.position) for turn, pose in zip(turns, surface.poses, strict=True)]
    turns = unit * np.array(turns).reshape(-1, 3, 3)
    scene.turns = wp.array(turns, dtype=wp.mat33, device=device)
    scene.shifts = wp.array(np.array(shifts).reshape(-1, 3), dtype=wp.vec3, device=device)
    return scene


def _view(camera, size) -> View:
    width, height = size
    right, up, forward = camera.axes()
    pixel = 2.0 * math.tan(math.radians(camera.fov) / 2.0) / height
    view = View()
    view.across, view.down = wp.vec3d(*(pixel * right)), wp.vec3d(*(-pixel * up))
    view.corner = wp.vec3d(*(forward - 0.5 * width * pixel * right + 0.5 * height * pixel * up))
    view.right, view.up, view.forward = wp.vec3(*right), wp.vec3(*up), wp.vec3(*forward)
    view.width, view.height, view.tiles, view.pixel = width, height, -(-width // TILE), pixel
    return view


def _checked_size(size):
    try:
        width, height = size
        fits = int(width) == width and int(height) == height and width > 0 and height > 0
    except (TypeError, ValueError):
        fits = False
    if not fits:
        raise InputError(f"Renderer: size is {size!r}; give (width, height), two whole numbers above 0")
    return int(width), int(height)


@wp.func
def _differ(a: int, b: int, hits: Hits, color: wp.array(dtype=wp.vec3)):
    """Whether the picture changes so much between two neighbouring pixels that they need more samples."""
    if hits.thing[a] == -1 and hits.thing[b] == -1:
        return False
    if hits.thing[a] < 0 or hits.thing[b] < 0:
        return True
    # Square roots stand in for what the eye sees.
    for k in range(3):
        if wp.abs(_seen(color[a][k]) - _seen(color[b][k])) > CONTRAST:
            return True
    return wp.dot(hits.normal[a], hits.normal[b]) < 0.5


@wp.func
def _seen(linear: float):
    return wp.sqrt(wp.clamp(linear, 0.0, 1.0))


@wp.kernel(enable_backward=False)
def _edges(
    start: int,
    width: int,
    height: int,
    slot: wp.array(dtype=int),
    hits: Hits,
    color: wp.array(dtype=wp.vec3),
    edge: wp.array(dtype=wp.uint8),
):
    k = start + wp.tid()
    x = k % width
    y = k // width
    i = slot[k]
    found = bool(False)
    if x > 0:
        found = _differ(i, slot[k - 1], hits, color)
    if x < width - 1 and not found:
        found = _differ(i, slot[k + 1], hits, color)
    if y > 0 and not found:
        found = _differ(i, slot[k - width], hits, color)
    if y < height - 1 and not found:
        found = _differ(i, slot[k + width], hits, color)
    edge[i] = wp.uint8(wp.where(found, 1, 0))


@wp.kernel(enable_backward=False)
def _scatter(start: int, which: wp.array(dtype=int), values: wp.array(dtype=wp.vec3), color: wp.array(dtype=wp.vec3)):
    k = start + wp.tid()
    color[which[k]] = values[k]


@wp.func
def _srgb(linear: float):
    """A linear value as an sRGB byte."""
    x = wp.clamp(linear, 0.0, 1.0)
    if x <= 0.0031308:
        x = 12.92 * x
    else:
        x = 1.055 * wp.pow(x, 1.0 / 2.4) - 0.055
    return wp.uint8(int(255.0 * x + 0.5))


@wp.kernel(enable_backward=False)
def _develop(start: int, slot: wp.array(dtype=int), color: wp.array(dtype=wp.vec3), picture: wp.array(dtype=wp.uint8)):
    k = start + wp.tid()
    c = color[slot[k]]
    for channel in range(3):
        picture[3 * k + channel] = _srgb(c[channel])
