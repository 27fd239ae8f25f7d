"""Two solvers on one frame: pictures side by side, where they differ, and figures (Sherstyuk 1999, figures 4.3-4.5)."""

import dataclasses
import functools
from time import perf_counter

import numpy as np

from fieldsim import plots
from fieldsim.errors import InputError
from fieldsim.filming.pipeline import snapshot_at
from fieldsim.render.camera import Camera
from fieldsim.render.renderer import Renderer
from fieldsim.scenario import Scenario
from fieldsim.world.snapshot import Snapshot

SIZE = (512, 512)


@dataclasses.dataclass(frozen=True, eq=False)
class Comparison:
    """What two solvers see through the pixels' centres; the second one is the measure.

    solvers: their names; depths: (H, W) each, inf for a miss; seconds: that each took for them; radius: the scene's
    smallest; pictures: (H, W, 3) uint8 each.
    """

    solvers: tuple[str, str]
    depths: tuple[np.ndarray, np.ndarray]
    seconds: tuple[float, float]
    radius: float
    pictures: tuple[np.ndarray, np.ndarray] | None = None

    @functools.cached_property
    def error(self) -> np.ndarray:
        """(H, W): differences of depth in units of the smallest radius; NaN where not both hit."""
        seen, true = self.depths
        with np.errstate(invalid="ignore"):
            return np.where(np.isfinite(seen) & np.isfinite(true), np.abs(seen - true), np.nan) / self.radius

    @functools.cached_property
    def mismatched(self) -> np.ndarray:
        """(H, W): where one hits and the other misses."""
        seen, true = (np.isfinite(depth) for depth in self.depths)
        return seen != true

    @functools.cached_property
    def silhouette(self) -> np.ndarray:
        """(H, W): pixels beside which the measure's depth leaps by more than the radius, or begins or ends."""
        # A number for a miss that is far from every depth.
        depth = np.where(np.isfinite(self.depths[1]), self.depths[1] / self.radius, -1e9)
        padded = np.pad(depth, 1, mode="edge")
        height, width = depth.shape
        around = [padded[y : y + height, x : x + width] for y in range(3) for x in range(3)]
        return np.max(around, axis=0) - np.min(around, axis=0) > 1.0

    @property
    def inner_error(self) -> float:
        """The largest error away from silhouettes, where both hit; 0 where nothing is to compare."""
        inner = self.error[~self.silhouette]
        return float(np.nanmax(inner, initial=0.0))

    @property
    def dropouts(self) -> int:
        """Pixels that differ in hit or miss away from silhouettes: holes, or surface where there is none."""
        return int((self.mismatched & ~self.silhouette).sum())

    @property
    def leaps(self) -> int:
        """Pixels away from silhouettes where both hit, but a hundredth of the radius apart: not the same surface."""
        return int((self.error[~self.silhouette] > 0.01).sum())

    def __str__(self):
        both = self.error[np.isfinite(self.error)]
        largest, median = (both.max(), np.median(both)) if len(both) else (0.0, 0.0)
        seen, true = (int(np.isfinite(depth).sum()) for depth in self.depths)
        times = ", ".join(f"{name} {seconds:.3g} s" for name, seconds in zip(self.solvers, self.seconds, strict=True))
        return (
            f"hits: {seen} and {true} of {self.error.size} pixels; {self.mismatched.sum()} differ, {self.dropouts} of "
            f"them away from silhouettes\n"
            f"depth difference in units of the smallest radius, {self.radius:g}: largest {largest:.2g} "
            f"({self.inner_error:.2g} away from silhouettes), median {median:.2g}\n"
            f"primary rays: {times}"
        )

    def draw(self, size=None):
        """A matplotlib Figure: both pictures, and a map of the depths' differences."""
        from matplotlib.colors import LogNorm

        height, width = self.error.shape
        drawing = plots.figure(size or (3 * width, height + 80))
        panels = drawing.subplots(1, 3)
        for axes, picture, name in zip(panels, self.pictures or (), self.solvers, strict=False):
            axes.imshow(picture)
            axes.set_title(name)
        # Below the rounding of float32 there is nothing to see.
        shown = panels[2].imshow(np.maximum(self.error, 1e-8), norm=LogNorm(1e-7, 1.0), cmap=plots.COLORS)
        panels[2].set_title(f"{int(self.mismatched.sum())} pixels differ (black)")
        panels[2].set_facecolor("0.85")
        rows, columns = np.nonzero(self.mismatched)
        panels[2].plot(columns, rows, "ks", markersize=2)
        drawing.colorbar(shown, ax=panels[2], label="depth difference / smallest radius", shrink=0.8)
        for axes in panels:
            axes.set_xticks([])
            axes.set_yticks([])
        return drawing


def compare_depths(
    snapshot: Snapshot, camera: Camera, solvers=("hermite", "referee"), *, size=SIZE, device=None
) -> Comparison:
    """What two solvers see of a snapshot."""
    return _compared(snapshot, camera, solvers, size, device, pictures=False)


def compare(
    scenario: Scenario, solvers=("hermite", "referee"), *, time: float = 0.0, size=SIZE, device=None
) -> Comparison:
    """What two solvers see of a scenario at `time`, with their pictures."""
    return _compared(snapshot_at(scenario, time, device), scenario.camera, solvers, size, device, pictures=True)


def _compared(snapshot, camera, solvers, size, device, *, pictures):
    solvers = tuple(solvers)
    if len(solvers) != 2:
        raise InputError(f"compare: solvers are {solvers}; give two, such as 'hermite' and 'referee'")
    materials = [body.surface.at(snapshot.time) for body in snapshot.world.bodies if body.surface is not None]
    if not materials:
        raise InputError("compare: no body has a surface; give one a surface=fs.Material()")
    renderers = [Renderer(size, device=device, solver=name) for name in solvers]
    depths, seconds = [], []
    for renderer in renderers:
        # A small picture first, to load kernels.
        Renderer((8, 8), device=device, solver=renderer.solver.name).depth_and_normals(snapshot, camera)
        start = perf_counter()
        depths.append(renderer.depth_and_normals(snapshot, camera)[0])
        seconds.append(perf_counter() - start)
    radius = min(material.radius for material in materials)
    first, second = renderers
    drawn = (first.frame(snapshot, camera), second.frame(snapshot, camera)) if pictures else None
    return Comparison(solvers, tuple(depths), tuple(seconds), radius, drawn)
