"""A snapshot on a device, as one camera sees it."""

import dataclasses
import functools
import math

import numpy as np
import warp as wp

from fieldsim.render.camera import Camera
from fieldsim.render.materials import table
from fieldsim.render.scene import bounds
from fieldsim.render.scene.candidates import TILE, Candidates, View, candidates, capsules
from fieldsim.render.scene.hits import Balls, Lights
from fieldsim.render.scene.intervals import CAMERA
from fieldsim.render.scene.tables import SceneTables
from fieldsim.render.shading import packet_shadows
from fieldsim.render.shading.fog import fog_of
from fieldsim.render.shading.lights import lights_of
from fieldsim.render.shading.sky import Sky, sky_of
from fieldsim.render.solids.overlay import Shapes, SolidStage
from fieldsim.render.solids.skeleton import drawn
from fieldsim.render.solvers.packet import gaussian_elements
from fieldsim.sources.elements import Surface
from fieldsim.world.material import RAYS
from fieldsim.world.world import Snapshot


@dataclasses.dataclass(frozen=True)
class Band:
    """Some rows of a picture that is `width` by `whole` pixels: `height` of them from `top` on."""

    width: int
    height: int
    top: int
    whole: int


@dataclasses.dataclass(frozen=True, eq=False)
class Perspective:
    """Where a picture is taken from. eye (3,): world position; unit: the length in which the device counts; view: rays.

    On the device all positions are relative to the eye, in units of `unit`.
    """

    camera: Camera
    eye: np.ndarray
    view: View
    unit: float


@dataclasses.dataclass(frozen=True, eq=False)
class SurfaceElements:
    """The elements of the surface field F = 1.

    surface: the field, its materials and poses; bounded: bounds of each element; scene: all of that on the device;
    lists: the elements that each tile of the picture may see. packet_kind: which of the packet tracer's kinds they are,
    "" if it cannot take them, see `gaussian_elements.kind_of`; packet: what it reads.
    """

    surface: Surface
    bounded: bounds.Bounded
    scene: SceneTables
    lists: Candidates
    packet_kind: str
    packet: "gaussian_elements.GaussianElements | None"

    @property
    def count(self) -> int:
        """Number of elements."""
        return len(self.surface.elements)

    @property
    def kinds(self) -> tuple[int, ...]:
        """The registry's numbers of the formulas in use, which a kernel must hold."""
        return self.surface.elements.kinds_used


@dataclasses.dataclass(frozen=True, eq=False)
class Particles:
    """Particles as balls on the device; lists: those that each tile of the picture may see; bvh: keeps their tree."""

    balls: Balls
    lists: Candidates
    bvh: wp.Bvh | None


@dataclasses.dataclass(frozen=True, eq=False)
class Lighting:
    """What light does. fog: the first arguments of its kernel, or None.

    optical: whether something reflects or transmits; shadows: whether any light casts them; subtle: whether light can
    be partly transmitted: coloured or soft shadows, or bodies that cast none.
    """

    lights: Lights
    sky: Sky
    fog: list | None
    optical: bool
    shadows: bool
    subtle: bool

    @property
    def secondary(self) -> bool:
        """Whether there are rays that begin on surfaces."""
        return self.shadows or self.optical


@dataclasses.dataclass(frozen=True, eq=False)
class Stage:
    """A snapshot on the device, as one camera sees it; see `stage_of`. solids: hard shapes, None without any."""

    device: wp.Device
    perspective: Perspective
    elements: SurfaceElements
    particles: Particles
    solids: SolidStage | None
    lighting: Lighting

    @property
    def shapes(self) -> Shapes:
        """The hard shapes on the device, maybe none."""
        return self.solids.shapes if self.solids else Shapes()

    @functools.cached_property
    def _bvh(self):
        bounded = self.elements.bounded
        return _tree(bounded.start, bounded.end, bounded.radius, self.device) if self.lighting.secondary else None

    @property
    def tree(self) -> wp.uint64:
        """The bounding-volume tree of all elements, for secondary rays; built when it is first asked for."""
        return _id(self._bvh)

    @functools.cached_property
    def blockers(self) -> packet_shadows.Blockers:
        """What the packet tracer's shadow rays may meet."""
        return packet_shadows.blockers_of(self.lighting.lights, self.elements.bounded, self, self.device)


def stage_of(snapshot: Snapshot, camera: Camera, renderer, lens: tuple[float, float] = (0.0, 0.0)) -> Stage:
    """A snapshot on the renderer's device, as one camera sees it.

    lens: where on the camera's lens the eye is: distance from its middle, relative to its radius, and angle.
    Raises InputError for a surface that the renderer's solver cannot do.
    """
    device, tolerance = renderer.device, renderer.tolerance
    centers, radii, colors = snapshot.spheres
    aside = _place_on_lens(camera, *lens)
    eye = np.asarray(camera.eye) + aside
    view = _view(camera, aside, renderer.band)
    surface, solids = drawn(snapshot, renderer.mode, eye, view.pixel)
    renderer.solver.check(surface.elements)
    unit = bounds.unit_of(surface.elements, radii if len(radii) else solids.lengths)
    perspective = Perspective(camera, eye, view, unit)
    materials = [*surface.materials, *solids.materials]
    lighting = _lighting(snapshot.world, materials, perspective, renderer.shadows, device)
    return Stage(
        device,
        perspective,
        _surface_elements(surface, perspective, tolerance, device),
        _particles((centers - eye) / unit, radii / unit, colors, view, lighting.secondary, device),
        SolidStage(solids, eye, unit, device) if len(solids) else None,
        lighting,
    )


def _surface_elements(surface, perspective, tolerance, device):
    bounded = bounds.bound(surface.elements, perspective.eye, perspective.unit, tolerance)
    scene = _scene(bounded, surface, perspective, tolerance, device)
    packet_kind = gaussian_elements.kind_of(bounded)
    packet = gaussian_elements.elements_of(bounded, device) if packet_kind else None
    # A radius of minus infinity keeps elements that the camera does not see out of all tiles.
    seen = np.where(scene.visible.numpy() & int(CAMERA), bounded.radius, -np.inf)
    lists = candidates(perspective.view, capsules(bounded.start, bounded.end, seen, device), device)
    return SurfaceElements(surface, bounded, scene, lists, packet_kind, packet)


def _particles(centers, radii, colors, view, secondary, device):
    shapes = capsules(centers, centers, radii, device)
    bvh = _tree(centers, centers, radii, device) if secondary else None
    balls = Balls()
    balls.center, balls.radius = shapes.start, shapes.radius
    balls.color = wp.array(colors, dtype=wp.vec3, device=device)
    balls.tree = _id(bvh)
    return Particles(balls, candidates(view, shapes, device), bvh)


def _lighting(world, materials, perspective, shadows, device):
    lights = lights_of(world.lights, perspective.eye, perspective.unit, shadows, device)
    shadows = shadows and any(light.shadows for light in world.lights)
    wide = bool((lights.size.numpy() > 0.0).any())
    return Lighting(
        lights,
        sky_of(world.background, perspective.view.pixel, device),
        fog_of(world.fog, perspective.unit),
        optical=any(m.reflection or m.transmission for m in materials),
        shadows=shadows,
        subtle=shadows and (wide or any(m.transmission or m.visible_to != RAYS for m in materials)),
    )


def _tree(start, end, radius, device):
    """A bounding-volume tree of capsules (N,), or None without any."""
    if not len(start):
        return None
    low = np.minimum(start, end) - radius[:, None]
    high = np.maximum(start, end) + radius[:, None]
    return wp.Bvh(wp.array(low, dtype=wp.vec3, device=device), wp.array(high, dtype=wp.vec3, device=device))


def _id(bvh):
    return wp.uint64(0) if bvh is None else bvh.id


def _scene(bounded, surface, perspective, tolerance, device) -> SceneTables:
    scene = SceneTables()
    scene.pixel = perspective.view.pixel
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
    shifts = [turn @ (perspective.eye - pose.position) for turn, pose in zip(turns, surface.poses, strict=True)]
    turns = perspective.unit * np.array(turns).reshape(-1, 3, 3)
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
