"""From a snapshot and a camera to a picture."""

import functools
import math
import warnings
from collections.abc import Iterable
from typing import Any

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.copies import shallow
from fieldsim.errors import FieldsimWarning, InputError
from fieldsim.launch import device_named, launch
from fieldsim.render import layers
from fieldsim.render.antialiasing import Smoother
from fieldsim.render.camera import Camera
from fieldsim.render.device_scene import Band, stage_of
from fieldsim.render.scene import bounds
from fieldsim.render.scene.candidates import TILE
from fieldsim.render.scene.hits import BALLS, exact_depth
from fieldsim.render.solids.skeleton import MODES
from fieldsim.render.tracer import Tracer
from fieldsim.types import RealLike, SizeLike, WholeLike
from fieldsim.world.snapshot import Snapshot

_TONES = 1 << 14  # of the table that turns linear values into bytes
_MOST_PIXELS = 1 << 23  # in memory at a time: two thirds of a gigabyte
QUALITIES = {"draft": 4, "final": 16}
MOST_EXPOSURES = 4096
EXPOSURES = {"draft": 8, "final": 32}
# Powers of the root of x^5 = x + 1: points that fill a four-dimensional box evenly, however many (Roberts 2018).
_SPREAD = 1.1673039782614187 ** -np.arange(1.0, 5.0)
SNAPSHOT = "give world.at(time) or simulation.snapshot()"


def render(
    snapshot: Snapshot | Iterable[Snapshot],
    camera: Camera,
    *,
    size: SizeLike = (640, 360),
    quality: str = "final",
    device: str | None = None,
) -> np.ndarray:
    """The picture of a snapshot: (height, width, 3) uint8, sRGB. See `Renderer`, which serves many frames better."""
    size, quality = validate.size("render", size), validate.choice("render", "quality", quality, QUALITIES)
    return Renderer(size, quality, device)._frame("render", snapshot, camera)


class Renderer:
    """Renders frames, keeping buffers between them.

    size: (width, height) in pixels. quality: "draft" (edges get 4 samples a pixel) or "final" (up to 16).
    device: "cpu", "cuda", ... shadows, samples: switch shadows off, and set the greatest number of samples a pixel: 1,
    4 or 16. exposures: how many sharp pictures make one that a lens or a shutter blurs: 8, 32 if final.
    tolerance: of the field, relative to its level, for the Hermite solver: the contribution of distant elements that
    may be neglected, and how far a maximum of the field at a grazing ray may rise above the level without a hit. Scenes
    of Gaussian points, segments and circles of positive strength are traced by packets of rays, where `tolerance` has
    no effect: they neglect tails below 2e-6 of the level (see docs/pictures.md). rays: number traced so far. A camera
    in a body sees the surface from within. mode: how bodies are drawn: "soft", as their surfaces; "hard", each
    primitive by itself as what lies within the material's radius: balls, capsules, arc tubes, slabs; "skeleton", as
    thin lines. solver: how primary rays find surfaces, see `solvers.by_name`. Raises InputError for a size, a quality,
    a mode or a solver that cannot be, and for a surface that the solver cannot do.
    """

    def __init__(
        self,
        size: SizeLike = (640, 360),
        quality: str = "final",
        device: str | None = None,
        *,
        shadows: bool = True,
        samples: WholeLike | None = None,
        exposures: WholeLike | None = None,
        tolerance: RealLike = 1e-5,
        mode: str = "soft",
        solver: str = "hermite",
    ):
        self.size = validate.size("Renderer", size)
        validate.choice("Renderer", "quality", quality, QUALITIES)
        samples = QUALITIES[quality] if samples is None else samples
        self.samples = validate.whole("Renderer", "samples", samples, at_least=1, at_most=16)
        if self.samples not in (1, 4, 16):
            raise InputError(f"Renderer: samples is {self.samples}; give 1, 4 or 16")
        exposures = EXPOSURES[quality] if exposures is None else exposures
        self.exposures = validate.whole("Renderer", "exposures", exposures, at_least=1, at_most=MOST_EXPOSURES)
        self.mode = validate.choice("Renderer", "mode", mode, MODES)
        self.device = device_named(device)
        self.shadows = validate.flag("Renderer", "shadows", shadows)
        self._tracer = Tracer(self.device, solver)
        self.solver = self._tracer.solver
        self.tolerance = validate.number("Renderer", "tolerance", tolerance, above=0.0)
        self._checked_empty = False
        self.band = Band(*self.size, 0, self.size[1])
        self._slot: Any = None

    def __reduce__(self):
        # A copy has the options, and buffers of its own.
        names = ("shadows", "samples", "exposures", "tolerance", "mode")
        options = {name: getattr(self, name) for name in names}
        options |= {"device": self.device.alias, "solver": self.solver.name}
        return functools.partial(Renderer, self.size, **options), ()

    def frame(self, snapshot: Snapshot | Iterable[Snapshot], camera: Camera) -> np.ndarray:
        """The picture of a snapshot, (height, width, 3) uint8, sRGB.

        Several snapshots, of times at which the shutter is open, blur what moves; `Camera.shutter` is for films.
        """
        return self._frame("Renderer.frame", snapshot, camera)

    def _frame(self, owner, snapshot, camera):
        one = isinstance(snapshot, Snapshot)
        snapshots = (snapshot,) if one else validate.instances(owner, "snapshot", snapshot, Snapshot, SNAPSHOT)
        if not snapshots:
            raise InputError(f"{owner}: no snapshots; give one, or those of times at which the shutter is open")
        validate.instance(owner, "camera", camera, Camera, "give a fs.Camera")
        if self.size[0] * self.size[1] > _MOST_PIXELS:
            return self._in_bands(snapshots, camera)
        return self._picture(snapshots, camera)

    def _picture(self, snapshots, camera):
        self._layout()
        cameras = [camera.at(snapshot.time) for snapshot in snapshots]
        if len(snapshots) > 1 or cameras[0].aperture > 0.0:
            color = self._blurred(snapshots, cameras)
        else:
            stage = stage_of(snapshots[0], cameras[0], self)
            color, hits = self._developed(stage, self._grid, "pixels")
            if self.samples > 1:
                shade = functools.partial(self._supersampled, stage)
                self._smoother.smooth(self.samples, hits, color, shade)
            self._warn_if_empty(stage, hits)
        picture = wp.empty((self.size[1], self.size[0], 3), dtype=wp.uint8, device=self.device)
        width, height = self.size
        slot = self._slot.reshape((height, width))
        launch(_print, height, [slot, color, self._tones], [picture], device=self.device, grain=16)
        return picture.numpy()

    def depth_and_normals(self, snapshot: Snapshot, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
        """Distances along the rays through pixel centres (inf for a miss), (H, W), and unit normals, (H, W, 3)."""
        _check_one("Renderer.depth_and_normals", snapshot, camera)
        self._layout()
        stage = stage_of(snapshot, camera.at(snapshot.time), self)
        hits = self._tracer.trace(stage, self._grid, "pixels", exact=True)
        slot = self._slot.numpy()
        width, height = self.size
        depth = exact_depth(hits, len(slot))[slot].reshape(height, width) * stage.perspective.unit
        return np.where(depth < 0, np.inf, depth), hits.normal.numpy()[slot].reshape(height, width, 3)

    def layers(self, snapshot: Snapshot, camera: Camera) -> dict[str, np.ndarray]:
        """Diagnostic layers of the rays through pixel centres: arrays by the names of `layers.LAYERS`, and `owner`.

        Raises InputError for a solver that gives none.
        """
        _check_one("Renderer.layers", snapshot, camera)
        self.solver.check_layers()
        self._layout()
        stage = stage_of(snapshot, camera.at(snapshot.time), self)
        hits = self._tracer.trace(stage, self._grid, "layers", exact=True, layered=True)
        return layers.collect(hits, self._slot.numpy(), self.size, stage.perspective.unit, snapshot)

    @property
    def rays(self) -> int:
        """Rays traced so far."""
        return self._tracer.rays

    def _in_bands(self, snapshots, camera):
        """`_picture` in bands of rows, as the buffers of all pixels at once may not fit into memory."""
        width, height = self.size
        rows = max(_MOST_PIXELS // width, 1)
        picture = np.empty((height, width, 3), dtype=np.uint8)
        for top in range(0, height, rows):
            # Antialiasing compares a pixel with its neighbours: one more row on each side.
            first, last = max(top - 1, 0), min(top + rows + 1, height)
            part = shallow(self)
            part.size = width, last - first
            part.band = Band(width, last - first, first, height)
            part._slot = None
            picture[top : top + rows] = part._picture(snapshots, camera)[top - first :][:rows]
            self._checked_empty = part._checked_empty
        return picture

    def _developed(self, stage, samples, name):
        """(linear colours after exposure and tone, hits) of samples of the picture."""
        color, hits = self._tracer.colors(stage, samples, name)
        camera = stage.perspective.camera
        if camera.exposure != 0.0 or camera.tone != "clip":
            filmic = int(camera.tone == "filmic")
            launch(_expose, samples.shape[0], [2.0**camera.exposure, filmic], [color], device=self.device)
        return color, hits

    def _blurred(self, snapshots, cameras):
        """The mean of pictures from many places on the lens at many times, each sharp, with one sample a pixel."""
        total = wp.zeros(self._grid.shape[0], dtype=wp.vec3, device=self.device)
        count = max(self.exposures, len(snapshots))
        grid = self._grid.numpy()
        for k in range(count):
            moment = k * len(snapshots) // count
            # Times are in order; any few consecutive points on the lens and in a pixel are spread evenly.
            u, v, x, y = np.modf(0.5 + (k + 1) * _SPREAD)[0]
            stage = stage_of(snapshots[moment], cameras[moment], self, lens=(math.sqrt(u), math.tau * v))
            stage.lighting.lights.share, stage.lighting.lights.seed = count, k
            samples = wp.array(grid + np.array((x - 0.5, y - 0.5)), dtype=wp.vec2, device=self.device)
            color, _hits = self._developed(stage, samples, "pixels")
            launch(_add, total.shape[0], [1.0 / count, color], [total], device=self.device)
        return total

    def _layout(self):
        """Pixel centres in the order of tiles, and where each pixel is in that order; once."""
        if self._slot is not None:
            return
        width, height = self.size
        y, x = np.divmod(np.arange(width * height), width)
        order = np.lexsort((x, y, x // TILE, y // TILE))
        slot = np.empty(width * height, dtype=np.int32)
        slot[order] = np.arange(width * height, dtype=np.int32)
        centers = np.stack([x[order] + 0.5, y[order] + 0.5], axis=1)
        self._grid = wp.array(centers, dtype=wp.vec2, device=self.device)
        self._slot = wp.array(slot, dtype=int, device=self.device)
        self._tones = wp.array(_tones(), dtype=wp.uint8, device=self.device)
        self._smoother = Smoother(self._slot.reshape((height, width)), self._grid)

    def _supersampled(self, stage, samples, share):
        """Colours of samples within pixels, `share` of them in each."""
        stage.lighting.lights.share = share
        return self._developed(stage, samples, "samples")[0]

    def _warn_if_empty(self, stage, hits):
        """Warn once, at the first picture of bodies, if no pixel shows one because the field stays below the level."""
        if self._checked_empty or not stage.elements.count:
            return
        self._checked_empty = True
        things = hits.thing.numpy()
        if ((things >= 0) & (things < int(BALLS))).any():
            return
        if not bounds.reaches_level(stage.elements.bounded):
            warnings.warn(
                "nothing to see: the surface field stays below its level even on the skeleton; lower the materials' "
                "threshold or raise their radius",
                FieldsimWarning,
                stacklevel=3,
            )


def _check_one(owner, snapshot, camera):
    validate.instance(owner, "snapshot", snapshot, Snapshot, SNAPSHOT)
    validate.instance(owner, "camera", camera, Camera, "give a fs.Camera")


@wp.kernel(enable_backward=False)
def _expose(start: int, exposure: float, filmic: int, color: wp.array(dtype=wp.vec3)):
    """Brighten linear colours, and roll off what is brighter than white; white stays just below it."""
    i = start + wp.tid()
    c = exposure * color[i]
    if filmic == 1:
        for k in range(3):
            x = wp.max(c[k], 0.0)
            c[k] = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)
    color[i] = c


@wp.kernel(enable_backward=False)
def _add(start: int, share: float, color: wp.array(dtype=wp.vec3), total: wp.array(dtype=wp.vec3)):
    i = start + wp.tid()
    total[i] = total[i] + share * wp.min(color[i], wp.vec3(1.0, 1.0, 1.0))


def _tones() -> np.ndarray:
    """The sRGB bytes of linear values spread evenly over 0..1, so finely that neighbours differ by one at most."""
    x = np.linspace(0.0, 1.0, _TONES + 1)
    x = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1.0 / 2.4) - 0.055)
    return np.floor(255.0 * x + 0.5).astype(np.uint8)


@wp.kernel(enable_backward=False)
def _print(
    start: int,
    slot: wp.array2d(dtype=int),
    color: wp.array(dtype=wp.vec3),
    tones: wp.array(dtype=wp.uint8),
    picture: wp.array3d(dtype=wp.uint8),
):
    """Rows of the picture."""
    y = start + wp.tid()
    for x in range(slot.shape[1]):
        c = color[slot[y, x]]
        for channel in range(3):
            tone = wp.clamp(c[channel], 0.0, 1.0) * wp.static(float(_TONES)) + 0.5
            picture[y, x, channel] = tones[int(tone)]
