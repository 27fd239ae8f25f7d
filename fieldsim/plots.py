"""Plots of what was measured, as matplotlib figures (extra `plot`): save them with `figure.savefig(path)`."""

import dataclasses
import io
import pathlib

import numpy as np

from fieldsim import files, validate
from fieldsim.errors import InputError

DPI = 100
SIZE = (960, 720)
COLORS = "turbo"
KINDS = (".png", ".svg", ".pdf")


def figure(size=SIZE):
    """A matplotlib Figure of size (width, height) pixels, for files only: no window, no global state."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise InputError("plots need matplotlib; install it with: pip install 'fieldsim[plot]'") from None
    return Figure(figsize=(size[0] / DPI, size[1] / DPI), dpi=DPI, layout="constrained")


def energy(log, size=SIZE):
    """How what an `EnergyLog` follows drifted: largest and rms over the particles, and all totals, against time."""
    drawing, axes = _axes(size, "time", "relative drift")
    history = log.history
    lines = [(total.drifts, f"{total.quantity}, {total.whose}") for total in log.totals]
    if history.largest:
        lines += [(history.largest, f"{log.invariant}, largest"), (history.rms, f"{log.invariant}, rms")]
    for drifts, label in lines:
        axes.semilogy(history.times, drifts, label=label)
    if lines:
        axes.legend()
    return drawing


def orbits(positions, plane: str = "xy", size=SIZE):
    """Paths of particles, positions (T, N, 3), projected on the plane "xy", "xz" or "yz"."""
    if plane not in ("xy", "xz", "yz"):
        raise InputError(f"plots.orbits: plane is {plane!r}; give 'xy', 'xz' or 'yz'")
    positions = np.asarray(positions, dtype=float)
    first, second = ("xyz".index(letter) for letter in plane)
    drawing, axes = _axes(size, plane[0], plane[1])
    axes.plot(positions[:, :, first], positions[:, :, second], lw=0.6)
    axes.set_aspect("equal")
    return drawing


def section(x, y, colors=None, *, labels=("", ""), title="", color_label="", size=SIZE):
    """Points of a Poincare section at (x, y), each (M,), coloured by `colors` (M,)."""
    drawing, axes = _axes(size, *labels)
    points = axes.scatter(x, y, c=colors, cmap=COLORS, s=1.2, lw=0, rasterized=True)
    axes.set_title(title)
    if color_label:
        drawing.colorbar(points, label=color_label)
    return drawing


def lyapunov(result, size=SIZE):
    """How the largest exponents of a `Lyapunov` converge, one line per particle."""
    drawing, axes = _axes(size, "time", "largest Lyapunov exponent so far")
    axes.loglog(result.times, np.abs(result.exponents[:, :, 0]), lw=0.8)
    return drawing


def _axes(size, x, y):
    drawing = figure(size)
    axes = drawing.add_subplot()
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(alpha=0.3)
    return drawing, axes


@dataclasses.dataclass(frozen=True)
class Picture:
    """What a scenario's `build` returns to have a picture drawn rather than a film.

    draw: a function of `size` (width, height in pixels) that returns a matplotlib Figure; title: for the progress.
    """

    draw: object
    title: str = ""

    def __post_init__(self):
        if not callable(self.draw):
            raise InputError(f"Picture: draw is {self.draw!r}; give a function of the size that returns a figure")

    def save(self, path, size=None) -> None:
        """Draw at `size` (960x720 unless told) and write to `path`, which ends in .png, .svg or .pdf.

        The file appears when it is complete. Raises InputError for a path that cannot be, before anything is drawn.
        """
        path = checked_path(path)
        drawing, data = self.draw(size or SIZE), io.BytesIO()
        # Without a date, and with names that are not random, the same picture is the same bytes.
        undated = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
        kind = path.suffix.lower()
        from matplotlib import rc_context

        with rc_context({"svg.hashsalt": "fieldsim"}):
            drawing.savefig(data, format=kind[1:], metadata=undated.get(kind))
        files.write("Picture", path, data.getvalue())


def checked_path(path) -> pathlib.Path:
    """The path of a picture; raises InputError for one that cannot be."""
    path = validate.path("Picture", "path", path)
    if path.suffix.lower() not in KINDS:
        raise InputError(f"{path}: a picture ends in .png, .svg or .pdf")
    return files.checked_target("Picture", path)
