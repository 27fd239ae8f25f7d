"""A snapshot on a device, as one camera sees it."""

import dataclasses
import functools
import math

import numpy as np
import warp as wp

from fieldsim.render.materials import table
from fieldsim.render.scene import bounds
from fieldsim.render.scene.candidates import TILE, View, candidates, capsules
from fieldsim.render.scene.hits import Balls
from fieldsim.render.scene.intervals import CAMERA
from fieldsim.render.scene.tables import Scene
from fieldsim.render.shading import packet_shadows
from fieldsim.render.shading.fog import fog_of
from fieldsim.render.shading.lights import lights_of
from fieldsim.render.shading.sky import sky_of
from fieldsim.render.solids.overlay import Shapes, SolidStage
from fieldsim.render.solids.skeleton import drawn
from fieldsim.render.solvers.packet import gaussian_elements
from fieldsim.world.material import RAYS


@dataclasses.dataclass(frozen=True)
class Band:
    """Some rows of a picture that is `width` by `whole` pixels: `height` of them from `top` on."""

    width: int
    height: int
    top: int
    whole: int


class Stage:
    """A snapshot on the device, as one camera sees it: lengths relative to the eye, in units of `unit`.

    lens: where on the camera's lens the eye is: distance from its middle, relative to its radius, and angle.
    """

    def __init__(self, snapshot, camera, renderer, lens=(0.0, 0.0)):
        self.camera = camera
        self.device = device = renderer.device
        centers, radii, colors = snapshot.spheres
        aside = _place_on_lens(camera, *lens)
        self.eye = eye = np.asarray(camera.eye) + aside
        self.view = _view(camera, aside, renderer.band)
        self.surface, solids = drawn(snapshot, renderer.mode, eye, self.view.pixel)
        surface = self.surface
        renderer.solver.check(surface.elements)
        self.count = len(surface.elements)
        self.kinds = surface.elements.kinds_used
        self.unit = bounds.unit_of(surface.elements, radii if len(radii) else solids.lengths)
        self.bounded = bounded = bounds.bound(surface.elements, eye, self.unit, renderer.tolerance)
        self.scene = _scene(bounded, surface, eye, self.unit, renderer.tolerance, device)
        self.scene.pixel = self.view.pixel
        self.packet_kind = gaussian_elements.kind_of(bounded)
        self.table = gaussian_elements.elements_of(bounded, device) if self.packet_kind else None
        # A radius of minus infinity keeps elements that the camera does not see out of all tiles.
        seen = np.where(self.scene.visible.numpy() & int(CAMERA), bounded.radius, -np.inf)
        shapes = capsules(bounded.start, bounded.end, seen, device)
        self.lists = candidates(self.view, shapes, device)
        centers, radii = (centers - eye) / self.unit, radii / self.unit
        ball_shapes = capsules(centers, centers, radii, device)
        self.ball_lists = candidates(self.view, ball_shapes, device)
        self.lights = lights_of(snapshot.world.lights, eye, self.unit, renderer.shadows, device)
        self.sky = sky_of(snapshot.world.background, self.view.pixel, device)
        self.solids = SolidStage(solids, eye, self.unit, device) if len(solids) else None
        self.shapes = self.solids.shapes if self.solids else Shapes()
        self._bvhs = []
        self.fog = fog_of(snapshot.world.fog, self.unit)
        all_materials = [*surface.materials, *solids.materials]
        self.optical = any(m.reflection or m.transmission for m in all_materials)
        wide = bool((self.lights.size.numpy() > 0.0).any())
        self.shadows = renderer.shadows and any(light.shadows for light in snapshot.world.lights)
        # True if light can be partly transmitted: coloured or soft shadows, or bodies that cast none.
        self.subtle = self.shadows and (wide or any(m.transmission or m.visible_to != RAYS for m in all_materials))
        # True if there are secondary rays.
        self._secondary = self.shadows or self.optical
        if self.packet_kind and not self.subtle:
            self.blockers = packet_shadows.blockers_of(self.lights, bounded, self, device)
        self.balls = Balls()
        self.balls.center = ball_shapes.start
        self.balls.radius = ball_shapes.radius
        self.balls.color = wp.array(colors, dtype=wp.vec3, device=device)
        self.balls.tree = self._tree(centers, centers, radii, device) if self._secondary else wp.uint64(0)

    @functools.cached_property
    def tree(self):
        """The bounding-volume tree of all elements, for secondary rays."""
        bounded = self.bounded
        if not self._secondary:
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
    scene.optics = wp.array(table.optics(surface.materials), dtype=wp.vec4, device=device)
    masks = np.array([table.rays_that_meet(m) for m in surface.materials], dtype=np.int32)
    scene.visible = wp.array(masks[surface.owner], dtype=int, device=device)
    scene.owner = wp.array(surface.owner, dtype=int, device=device)
    scene.materials, scene.texels = table.table(surface.materials, device)
    turns = [pose.matrix.T for pose in surface.poses]
    shifts = [turn @ (eye - pose.position) for turn, pose in zip(turns, surface.poses, strict=True)]
    turns = unit * np.array(turns).reshape(-1, 3, 3)
    scene.turns = wp.array(turns, dtype=wp.mat33, device=device)
    scene.shifts = wp.array(np.array(shifts).reshape(-1, 3), dtype=wp.vec3, device=device)
    return scene


def _place_on_lens(camera, out, angle) -> np.ndarray:
    """A point of the lens relative to its middle, (3,)."""
    right, up, _forward = camera.axes()
    return 0.5 * camera.aperture * out * (math.cos(angle) * right + math.sin(angle) * up)


def _view(camera, aside, band) -> View:
    """The view from a point of the lens, `aside` its offset from the middle; points in focus keep their pixels."""
    right, up, forward = camera.axes()
    pixel = 2.0 * math.tan(math.radians(camera.fov) / 2.0) / band.whole
    focus = camera.focus or float(np.linalg.norm(np.subtract(camera.look_at, camera.eye)))
    x = 0.5 * band.width + right @ aside / (focus * pixel)
    y = 0.5 * band.whole - up @ aside / (focus * pixel) - band.top
    view = View()
    view.across, view.down = wp.vec3d(*(pixel * right)), wp.vec3d(*(-pixel * up))
    view.corner = wp.vec3d(*(forward - x * pixel * right + y * pixel * up))
    view.right, view.up, view.forward = wp.vec3(*right), wp.vec3(*up), wp.vec3(*forward)
    view.width, view.height, view.tiles, view.pixel = band.width, band.height, -(-band.width // TILE), pixel
    view.center = wp.vec2(x, y)
    return view
