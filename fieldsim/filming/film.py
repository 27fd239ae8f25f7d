"""From a scenario to a film, and the report on it."""

import os
import warnings
from collections.abc import Callable

from fieldsim import interrupts, validate
from fieldsim.dynamics.integrators.splittings import Integrator
from fieldsim.errors import FieldsimWarning
from fieldsim.filming.options import FilmOptions, plan_of
from fieldsim.filming.pipeline import make_film
from fieldsim.filming.report import Report
from fieldsim.scenario import Scenario


@interrupts.obeyed()
def film(
    scenario: Scenario,
    out: str | os.PathLike,
    *,
    integrator: Integrator | str | None = None,
    size: tuple[int, int] | None = None,
    fps: float | None = None,
    duration: float | None = None,
    device: str | None = None,
    quality: str | None = None,
    preview: bool = False,
    record: str | os.PathLike | None = None,
    replay: str | os.PathLike | None = None,
    mode: str | None = None,
    layer: str | None = None,
    beside: Callable | None = None,
    watch: Callable[[int, int], object] | None = None,
) -> Report:
    """Film `scenario` into `out` (see `Film` for what its ending means) and say what it took.

    size: (width, height), by default 640x360; fps, duration, integrator: by default the scenario's.
    quality: "draft" or "final", the default. mode: how bodies are drawn, by default "soft", see `Renderer`; layer:
    instead of colours, "depth", "normal", "weights" or "steps".
    preview: a quick look: half the default width and height, draft quality, at most 10 frames per second, unless these
    are given. A camera's shutter takes more of them while it is open; a replay and a layer are sharp.
    record: path of a `Recording` to keep of the snapshots; replay: path of one to film instead of simulating, at its
    own times and as far as it goes unless duration ends before, with another camera or size, say. A warning names the
    parameters that are not those of its run, and what has no effect on what moves.
    beside: a function of the size that gives what else draws every frame: its `frame(snapshot, camera)` stands to the
    right, and the film is twice as wide.
    watch: called with (frames done, frames in all) as the work goes on. A path that ends in .png gets the last frame.
    A film that fails or is interrupted under way keeps the frames and snapshots so far, beside what was there before
    (see `Film` and `Recording`), and the error says where.
    """
    validate.instance("film", "scenario", scenario, Scenario, "give a fs.Scenario")
    options = FilmOptions(
        integrator=integrator,
        size=size,
        fps=fps,
        duration=duration,
        device=device,
        quality=quality,
        preview=preview,
        record=record,
        replay=replay,
        mode=mode,
        layer=layer,
        beside=beside,
        watch=watch,
    )
    plan = plan_of(scenario, out, options)
    for words in plan.warnings:
        # The caller's line is behind this function and the decorator's.
        warnings.warn(words, FieldsimWarning, stacklevel=3)
    return make_film(plan)
