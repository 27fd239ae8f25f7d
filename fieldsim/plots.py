"""Plots of what was measured, as matplotlib figures (extra `plot`): save them with `figure.savefig(path)`."""

import dataclasses
import functools
import io
import pathlib
import typing
from collections.abc import Callable, Sequence

import numpy as np

from fieldsim import files, validate
from fieldsim.errors import InputError
from fieldsim.types import ArrayLike, PathLike, SizeLike

if typing.TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 100
SIZE = (960, 720)
COLORS = "turbo"
KINDS = (".png", ".svg", ".pdf")


class DriftOf(typing.Protocol):
    """What is drawn of one total: whose it is, and which quantity."""

    whose: str
    quantity: str

    @property
    def drifts(self) -> Sequence[float]:
        """Relative drift at each moment."""
        ...


class DriftHistory(typing.Protocol):
    """Moments, and the largest and rms relative drift over the particles at each, empty where none is judged."""

    @property
    def times(self) -> Sequence[float]:
        """The moments."""
        ...

    @property
    def largest(self) -> Sequence[float]:
        """Largest over the particles."""
        ...

    @property
    def rms(self) -> Sequence[float]:
        """Root of the mean square."""
        ...


class DriftLog(typing.Protocol):
    """How well a run kept its invariants, such as a `fs.EnergyLog`, for `energy`."""

    invariant: str

    @property
    def history(self) -> DriftHistory:
        """What the particles drifted by."""
        ...

    @property
    def totals(self) -> Sequence[DriftOf]:
        """What totals drifted by."""
        ...


class Exponents(typing.Protocol):
    """Times (T,) and exponents (T, N, ...) of a `fs.Lyapunov`, for `lyapunov`."""

    @property
    def times(self) -> np.ndarray:
        """Times, (T,)."""
        ...

    @property
    def exponents(self) -> np.ndarray:
        """Exponents, (T, N, K)."""
        ...


def figure(size: SizeLike = SIZE) -> "Figure":
    """A matplotlib Figure of size (width, height) pixels, for files only: no window, no global state."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise InputError("plots need matplotlib; install it with: pip install 'fieldsim[plot]'") from None
    width, height = validate.size("plots", size)
    return Figure(figsize=(width / DPI, height / DPI), dpi=DPI, layout="constrained")


def energy(log: DriftLog, size: SizeLike = SIZE) -> "Figure":
    """How what an `EnergyLog` follows drifted: largest and rms over the particles, and all totals, against time."""
    validate.having("plots.energy", "log", log, ("history", "totals", "invariant"), "give a fs.EnergyLog")
    history = log.history
    if not history.times:
        raise InputError(
            "plots.energy: the log holds no moment: nothing that moves is judged (see log.report()), or nothing was "
            "recorded; call log.record() now and then"
        )
    drawing, axes = _axes(size, "time", "relative drift")
    lines = [(total.drifts, f"{total.quantity}, {total.whose}") for total in log.totals]
    if history.largest:
        lines += [(history.largest, f"{log.invariant}, largest"), (history.rms, f"{log.invariant}, rms")]
    for drifts, label in lines:
        axes.semilogy(history.times, drifts, label=label)
    axes.legend()
    return drawing


def orbits(positions: ArrayLike, plane: str = "xy", size: SizeLike = SIZE) -> "Figure":
    """Paths of particles, positions (T, N, 3), projected on the plane "xy", "xz" or "yz"."""
    validate.choice("plots.orbits", "plane", plane, ("xy", "xz", "yz"))
    positions = validate.numbers("plots.orbits", "positions", positions, shape=(None, None, 3))
    first, second = ("xyz".index(letter) for letter in plane)
    drawing, axes = _axes(size, plane[0], plane[1])
    axes.plot(positions[:, :, first], positions[:, :, second], lw=0.6)
    axes.set_aspect("equal")
    return drawing


def section(
    x: ArrayLike,
    y: ArrayLike,
    colors: ArrayLike | None = None,
    *,
    labels: Sequence[str] = ("", ""),
    title: str = "",
    color_label: str = "",
    size: SizeLike = SIZE,
) -> "Figure":
    """Points of a Poincare section at (x, y), each (M,), coloured by `colors` (M,)."""
    owner = "plots.section"
    x = validate.numbers(owner, "x", x, shape=(None,))
    y = validate.numbers(owner, "y", y, shape=x.shape)
    colors = validate.optional(validate.numbers, owner, "colors", colors, shape=x.shape)
    remedy = "give two strings, for x and y"
    labels = validate.instances(owner, "labels", labels, str, remedy)
    if len(labels) != 2:
        raise InputError(f"{owner}: labels has {len(labels)} of them; {remedy}")
    validate.text(owner, "title", title)
    validate.text(owner, "color_label", color_label)
    drawing, axes = _axes(size, *labels)
    tones: dict[str, typing.Any] = {} if colors is None else {"c": colors, "cmap": COLORS}
    points = axes.scatter(x, y, **tones, s=1.2, lw=0, rasterized=True)
    axes.set_title(title)
    if color_label and tones:
        drawing.colorbar(points, label=color_label)
    return drawing


def lyapunov(result: Exponents, size: SizeLike = SIZE) -> "Figure":
    """How the largest exponents of a `Lyapunov` converge, one line per particle."""
    validate.having("plots.lyapunov", "result", result, ("times", "exponents"), "give what fs.lyapunov returned")
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

    draw: Callable[[tuple[int, int]], "Figure"]
    title: str = ""

    def __post_init__(self):
        remedy = "give a function of the size that returns a figure"
        validate.fields(self, validate.function, "draw", remedy=remedy)
        validate.fields(self, validate.text, "title")

    def save(self, path: PathLike, size: SizeLike | None = None) -> None:
        """Draw at `size` (default 960x720) and write to `path`, which ends in .png, .svg or .pdf.

        The file appears when it is complete. Raises InputError for a path that cannot be, before anything is drawn.
        """
        path = checked_path(path)
        size = SIZE if size is None else validate.size("Picture.save", size)
        drawing, data = validate.answer("Picture", "draw", self.draw, size), io.BytesIO()
        if not hasattr(drawing, "savefig"):
            raise InputError(f"Picture: draw gave {validate.shown(drawing)}; return a matplotlib Figure")
        # Without a date, and with names that are not random, the same picture is the same bytes.
        undated = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
        kind = path.suffix.lower()
        from matplotlib import rc_context

        with rc_context({"svg.hashsalt": "fieldsim"}):
            write = functools.partial(drawing.savefig, data, format=kind[1:], metadata=undated.get(kind))
            validate.answer("Picture", "what draw gave", write)
        files.write("Picture", path, data.getvalue())


def checked_path(path: PathLike) -> pathlib.Path:
    """The path of a picture; raises InputError for one that cannot be."""
    path = validate.path("Picture", "path", path)
    if path.suffix.lower() not in KINDS:
        raise InputError(f"Picture: path is {str(path)!r}; a picture ends in .png, .svg or .pdf")
    return files.checked_target("Picture", path)
