"""From samples of a picture to linear colours: primary rays, shading, reflection and refraction, fog."""

import numpy as np
import warp as wp

from fieldsim.launch import launch
from fieldsim.render import layers
from fieldsim.render.scene.hits import Hits
from fieldsim.render.scene.intervals import CAMERA, REFLECTED, TRANSMITTED
from fieldsim.render.shading import lights, packet_shadows, reflection, subtle
from fieldsim.render.shading.fog import fog_kernel
from fieldsim.render.solvers.by_name import solver_named
from fieldsim.render.solvers.packet.packet_kernel import packet_kernel
from fieldsim.render.solvers.packet.simd import CPU_WIDTH, group_of
from fieldsim.render.solvers.primary import OVERFLOW, trace_kernel

_SCRATCH = 1 << 22  # intervals held in global memory at a time
_HIT_FIELDS = {
    "direction": wp.vec3,
    "depth": float,
    "thing": int,
    "normal": wp.vec3,
    "color": wp.vec3,
    "light": wp.vec4,
    "lift": float,
}


class Tracer:
    """Traces and shades rays, keeping buffers. solver: a name, see `solvers.by_name`; rays: number traced so far."""

    def __init__(self, device, solver: str):
        self.device = device
        self.solver = solver_named(solver)
        self.rays = 0
        self._simd_width = 1 if device.is_cuda else CPU_WIDTH
        self._hits = {}

    def colors(self, stage, samples, name) -> tuple[wp.array, Hits]:
        """(linear colours (N,), hits) of samples (N,) of the picture; buffers are kept under `name`."""
        hits = self.trace(stage, samples, name)
        weight = wp.full(samples.shape[0], 1.0, dtype=float, device=self.device) if stage.lighting.optical else None
        return self._lit(stage, hits, samples.shape[0], weight, 0), hits

    def trace(self, stage, samples, name, *, exact=False, layered=False) -> Hits:
        """Hits of samples (N,). exact: with the rounding rest of depths; layered: with the data of `layers`."""
        count = samples.shape[0]
        hits = self._buffers(name, count, stage, exact)
        options = {"layered": True} if layered else self.solver.options
        if layered:
            layers.make_room(hits, count, stage.elements.scene.materials.shape[0], self.device)
        elements, particles = stage.elements, [stage.particles.balls, stage.particles.lists]
        inputs = [stage.perspective.view, elements.scene, self.solver.lists(stage), *particles]
        if elements.packet_kind and not layered and self.solver.name == "hermite":
            kernel = packet_kernel(elements.packet_kind, self._simd_width)
            given = [stage.perspective.view, elements.scene, elements.packet, elements.lists, *particles]
            self._launch_groups(kernel, count, [*given, samples, hits])
        else:
            launch(trace_kernel(elements.kinds, **options), count, [*inputs, samples, hits], device=self.device)
        late = np.flatnonzero(hits.thing.numpy()[:count] == int(OVERFLOW))
        self._launch_late(trace_kernel(elements.kinds, True, **options), late, stage, inputs, [samples, hits])
        self.solver.finish(stage, samples, hits)
        return self._finished(stage, hits, count, CAMERA)

    def _onward(self, stage, hits, count, ray) -> Hits:
        """Hits of secondary rays (N,)."""
        inputs = [ray, stage.elements.scene, stage.tree, stage.particles.balls]
        launch(reflection.ray_kernel(stage.elements.kinds), count, [*inputs, hits], device=self.device)
        late = np.flatnonzero(hits.thing.numpy()[:count] == int(OVERFLOW))
        self._launch_late(reflection.ray_kernel(stage.elements.kinds, True), late, stage, inputs, [hits])
        return self._finished(stage, hits, count, ray)

    def _finished(self, stage, hits, count, ray):
        self.rays += count
        if stage.solids is not None:
            # With coloured or soft shadows, subtle.shade_kernel tests the hard shapes, so `overlay` need not.
            lighting, pixel = stage.lighting, stage.perspective.view.pixel
            stage.solids.overlay(hits, lighting.lights, pixel, count, ray, hide=not lighting.subtle)
        return hits

    def _lit(self, stage, hits, count, weight, depth):
        """Colours of hits. weight: their share of the pixel; depth: number of reflections and refractions so far."""
        parts = []
        if stage.lighting.optical:
            parts = [wp.empty(count, dtype=wp.vec3, device=self.device) for _ in range(2)]
            launch(reflection.part, count, [hits], parts, device=self.device)
        color = self._shade(stage, hits, count)
        if stage.lighting.optical and depth < reflection.DEEPEST:
            for ray, share in zip((REFLECTED, TRANSMITTED), parts, strict=True):
                self._reflect(stage, hits, count, ray, share, weight, depth, color)
        if stage.lighting.fog is not None:
            launch(fog_kernel, count, [*stage.lighting.fog, stage.lighting.sky, hits], [color], device=self.device)
        return color

    def _reflect(self, stage, hits, count, ray, share, weight, depth, color):
        """Trace the secondary rays of one kind whose weight matters, and add their colours."""
        slot = wp.empty(count, dtype=int, device=self.device)
        launch(reflection.worth, count, [share, weight], [slot], device=self.device)
        wp.utils.array_scan(slot, slot, inclusive=True)
        number = int(slot[count - 1 :].numpy()[0])
        if not number:
            return
        onward = self._buffers((ray, depth), number, stage)
        if onward.origin.shape[0] < number:
            onward.origin = wp.empty(onward.depth.shape[0], dtype=wp.vec3, device=self.device)
        onward_weight = wp.empty(number, dtype=float, device=self.device)
        launch(reflection.send, count, [ray, slot, share, weight, hits, onward], [onward_weight], device=self.device)
        self._onward(stage, onward, number, ray)
        found = self._lit(stage, onward, number, onward_weight, depth + 1)
        launch(reflection.bring_back, count, [slot, share, found], [color], device=self.device)

    def _shade(self, stage, hits, count):
        """Colours from the lights and the sky, without reflection and refraction."""
        color = wp.empty(count, dtype=wp.vec3, device=self.device)
        rays = wp.empty(count, dtype=int, device=self.device)
        kernel_of = subtle.shade_kernel if stage.lighting.subtle else lights.shade_kernel
        light = [stage.particles.balls, stage.shapes, stage.lighting.lights, stage.lighting.sky]
        if stage.elements.packet_kind and not stage.lighting.subtle:
            self._shade_packets(stage, hits, color, rays)
        else:
            inputs = [stage.elements.scene, stage.tree, *light, hits, color, rays]
            launch(kernel_of(stage.elements.kinds), count, inputs, device=self.device, parts=self._shadow_rays(stage))
        late = np.flatnonzero(rays.numpy() < 0)
        if len(late):
            # Reading stage.tree builds the tree.
            inputs = [stage.elements.scene, stage.tree, *light]
            parts = self._shadow_rays(stage)
            self._launch_late(kernel_of(stage.elements.kinds, True), late, stage, inputs, [hits, color, rays], parts)
        self.rays += int(rays.numpy().sum())
        return color

    @staticmethod
    def _shadow_rays(stage):
        """Greatest number of shadow rays of a sample."""
        if not stage.lighting.subtle:
            return 1
        lights = stage.lighting.lights
        return max(1, int((-(-lights.samples.numpy() // lights.share)).sum()))

    def _shade_packets(self, stage, hits, color, rays):
        """The same by packets, for scenes of Gaussian elements."""
        blockers, kind = stage.blockers, (stage.elements.packet_kind, self._simd_width)
        packet, light = stage.elements.packet, stage.lighting
        cell = wp.empty((blockers.light.shape[0], color.shape[0]), dtype=int, device=self.device)
        arguments = [packet, blockers, stage.particles.balls, light.lights, light.sky, hits, color, rays, cell]
        kernel = packet_shadows.shade_kernel(*kind, bool(blockers.tree))
        self._launch_groups(kernel, color.shape[0], arguments)
        if cell.shape[0]:
            key, ids = packet_shadows.by_cell(cell.flatten(), blockers.first.shape[0])
            arguments = [packet, blockers, light.lights, hits, key, ids, color, rays]
            self._launch_groups(packet_shadows.cells_kernel(*kind), key.shape[0], arguments)

    def _buffers(self, name, count, stage, exact=False) -> Hits:
        """Hits with room for `count` samples, kept under `name`."""
        hits = self._hits.get(name)
        if hits is None or hits.depth.shape[0] < count:
            # The number of rays varies from frame to frame: leave room to grow.
            count = count if name == "pixels" else int(1.25 * count)
            hits = Hits()
            for field, dtype in _HIT_FIELDS.items():
                setattr(hits, field, wp.empty(count, dtype=dtype, device=self.device))
            hits.origin = wp.empty(0, dtype=wp.vec3, device=self.device)
            hits.optics = wp.empty(0, dtype=wp.vec4, device=self.device)
            hits.rest = wp.empty(0, dtype=float, device=self.device)
            hits.blocked = wp.empty((0, 0), dtype=wp.uint8, device=self.device)
            self._hits[name] = hits
        if stage.solids is None:
            hits.blocked = wp.empty((0, 0), dtype=wp.uint8, device=self.device)
        for field, dtype, wanted in (("optics", wp.vec4, stage.lighting.optical), ("rest", float, exact)):
            room = hits.depth.shape[0] if wanted else 0
            if getattr(hits, field).shape[0] != room:
                setattr(hits, field, wp.empty(room, dtype=dtype, device=self.device))
        hits.rest.zero_()
        return hits

    def _launch_groups(self, kernel, count, arguments):
        """Launch a kernel whose items are groups of samples."""
        launch(kernel, -(-count // group_of(self._simd_width)), arguments, device=self.device, grain=64)

    def _launch_late(self, kernel, late, stage, inputs, outputs, parts=1):
        """Launch a kernel for the samples `late`, whose intervals did not fit, with global memory for them."""
        room = max(stage.elements.count, 1)
        step = max(1, _SCRATCH // room)
        for k in range(0, len(late), step):
            which = wp.array(late[k : k + step].astype(np.int32), dtype=int, device=self.device)
            scratch = [wp.empty((len(which), room), dtype=dtype, device=self.device) for dtype in (int, float, float)]
            given = [*inputs, which, *outputs, *scratch]
            launch(kernel, len(which), given, device=self.device, grain=1, parts=parts)
