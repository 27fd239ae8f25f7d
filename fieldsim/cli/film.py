"""The command that films a scenario: its options, the work, the bar on the way and the report."""

import contextlib
import os
import pathlib
import warnings
from typing import Any

import click

from fieldsim import scenario as scenarios
from fieldsim.cli.types import Device, FilePath, IntegratorType, Positive, Size
from fieldsim.errors import FieldsimWarning, InputError, ScenarioError
from fieldsim.render.layers import LAYERS
from fieldsim.render.solids.skeleton import MODES


def _switch_debug(ctx, param, value):
    if value:
        os.environ["FIELDSIM_DEBUG"] = "1"
    return value or None


def film_options():
    """The options that every film has."""
    return [
        click.Option(
            ["--out"],
            type=FilePath(),
            metavar="FILE",
            help="Where to: .mp4, .gif, .png (last frame), folder/ or name_%04d.png; a plot: .png, .svg.",
        ),
        click.Option(["--size"], type=Size(), metavar="WxH", help="Pixels of a frame; default 640x360."),
        click.Option(["--fps"], type=Positive(), help="Frames per second; default the scenario's."),
        click.Option(["--duration"], type=Positive(), help="Seconds of film; default the scenario's."),
        click.Option(
            ["--device"], type=Device(), metavar="cpu|cuda", default="cpu", help="Where to compute; default cpu."
        ),
        click.Option(["--quality"], type=click.Choice(["draft", "final"]), help="draft is faster; default final."),
        click.Option(
            ["--record"],
            type=FilePath(),
            metavar="RUN.npz",
            help="Keep the snapshots, to be drawn again or read with NumPy.",
        ),
        click.Option(
            ["--replay"],
            type=FilePath(),
            metavar="RUN.npz",
            help="Draw a recording of this scenario instead of simulating.",
        ),
        click.Option(
            ["--integrator"],
            type=IntegratorType(),
            metavar="NAME[:NUMBER]",
            help="How things move: auto, radau, leapfrog:1e-3, blanesmoan6:0.05, ...; default the scenario's.",
        ),
        click.Option(
            ["--energy-plot"],
            type=FilePath(),
            metavar="FILE",
            help="Draw how well energy is kept: .png, .svg or .pdf.",
        ),
        click.Option(
            ["--mode"],
            type=click.Choice(MODES),
            help="Bodies as soft surfaces, as hard shapes, or as lines; default soft.",
        ),
        click.Option(
            ["--layer"],
            type=click.Choice(LAYERS),
            help="Not colours but depth, normals, weights of the bodies, or steps of the rays.",
        ),
        click.Option(["--preview"], is_flag=True, help="A quick look: half the width and height, draft, 10 frames/s."),
        click.Option(
            ["--debug"],
            is_flag=True,
            is_eager=True,
            callback=_switch_debug,
            help="Show Python's tracebacks.",
        ),
    ]


def scenario_option(parameter):
    """The option of one of `build`'s own parameters."""
    name = parameter.name.replace("_", "-")
    required = parameter.required
    shared: dict[str, Any] = {"required": required, "help": parameter.help or None}
    if not required and parameter.default is not None:
        shared |= {"default": parameter.default, "show_default": True}
    if parameter.kind is bool:
        return click.Option([f"--{name}/--no-{name}", parameter.name], **shared)
    kind = click.Choice(parameter.kind) if isinstance(parameter.kind, tuple) else parameter.kind
    return click.Option([f"--{name}", parameter.name], type=kind, **shared)


def own_values(own, options, values) -> dict:
    """The values of `build`'s parameters `own`; of those that share an option's name, its value, if it is given.

    Raises UsageError for one that has none.
    """
    shared = {option.name for option in options}
    given = {}
    for parameter in own:
        value = values[parameter.name]
        if parameter.name in shared and (value is None or value is False):
            if parameter.required:
                raise click.UsageError(f"Missing option '--{parameter.name}'.", click.get_current_context())
            continue
        if parameter.kind is int and value is not None and value != int(value):
            raise click.UsageError(f"--{parameter.name} is {value:g}; this scenario takes a whole number")
        given[parameter.name] = int(value) if parameter.kind is int and value is not None else value
    return given


def command_of(build, name: str, options, callback, **settings) -> click.Command:
    """A command with `options` and those of `build`'s own parameters; ScenarioError for one that cannot be both.

    callback: called with the values of `build`'s parameters and those of the options.
    """
    own, shared = scenarios.parameters(build), {option.name: option for option in options}
    for parameter in own:
        if parameter.name == "help" or not _can_share(parameter, shared.get(parameter.name)):
            raise ScenarioError(
                f"build: parameter {parameter.name!r} has the name of an option that means something else, "
                f"--{parameter.name}; give it another name"
            )

    def called(**values):
        callback(own_values(own, options, values), {key: values[key] for key in shared})

    params = [scenario_option(p) for p in own if p.name not in shared] + options
    _refuse_twins(params)
    return click.Command(name, callback=called, params=params, help=scenarios.description(build), **settings)


def _can_share(parameter, option):
    """Whether an option's value is one for the parameter of its name, too."""
    if option is None:
        return True
    if option.is_flag:
        return parameter.kind is bool
    if option.type.name in ("number", "float"):
        return parameter.kind in (int, float)
    is_text = parameter.kind is str or isinstance(parameter.kind, tuple)
    return is_text and option.type.name in ("text", "choice", "device") and not option.multiple


def _refuse_twins(params):
    """Refuse parameters whose options would be the same: a_b and a-b, or no_x beside a switch x."""
    seen = {}
    for param in params:
        for word in (*param.opts, *param.secondary_opts):
            if word in seen:
                raise ScenarioError(
                    f"build: parameters {seen[word]!r} and {param.name!r} would both be the option {word}; "
                    "give one of them another name"
                )
            seen[word] = param.name


def film_command(build, name: str, extra=(), prepare=None) -> click.Command:
    """The command that films what `build` gives: the options of every film and those of its own parameters.

    A parameter of `build` that is named like a film's option, such as `duration`, is given that option's value, where
    it is given.
    extra: options besides; prepare: a function of the name and the options' values that checks and takes out those of
    the extra ones, and returns the film's name and a function from the scenario to the one to be filmed and options of
    `film.film`.
    """

    def callback(given, options):
        del options["debug"]
        title, adapt = prepare(name, options) if prepare else (name, None)
        _film(build, title, adapt, given, options)

    return command_of(build, name, [*extra, *film_options()], callback, context_settings={"max_content_width": 120})


def _film(build, name, adapt, given, options):
    """Check what the machine and the disk say about the request, build, film or draw, report."""
    from fieldsim import plots
    from fieldsim.filming import film
    from fieldsim.launch import device_named
    from fieldsim.render.output.video import Film

    out, energy_plot = options.pop("out"), options.pop("energy_plot")
    with usage():
        _check_targets(out, energy_plot, options)
    device_named(options["device"])
    scenario = scenarios.call(build, given)
    if isinstance(scenario, plots.Picture):
        if energy_plot or adapt or any(options[key] for key in ("integrator", "record", "replay", "mode", "layer")):
            words = "models, --record, --replay, --mode, --layer, --integrator and --energy-plot are for films"
            raise click.UsageError(f"the scenario is a picture: {words}")
        _draw(scenario, out or f"{name}.png", options["size"])
        return
    out = out or f"{name}{'-preview' if options['preview'] else ''}.mp4"
    with usage():
        Film(out, options["size"])
    if adapt:
        scenario, more = adapt(scenario)
        options |= more
    with scenarios.here(), progress_of(scenario.title or name) as watch:
        report = film.film(scenario, out, watch=watch, **options)
    click.echo(str(report))
    if energy_plot:
        _draw_energy(report, energy_plot)


def _check_targets(out, energy_plot, options):
    """Raise InputError for a path that cannot be written to, before any work."""
    from fieldsim import plots
    from fieldsim.recording.recording import Recording
    from fieldsim.render.output.video import Film

    if energy_plot:
        plots.checked_path(energy_plot)
    if out and pathlib.Path(out).suffix.lower() in plots.KINDS:
        plots.checked_path(out)
    else:
        Film(out or "film.mp4", options["size"])
    if options["record"]:
        Recording(options["record"])
    if out and energy_plot and os.path.realpath(out) == os.path.realpath(energy_plot):
        raise InputError(f"--out and --energy-plot are one file, {out}; give two names")


def _draw_energy(report, path):
    """Draw the log of a film's energy, or warn that there is none."""
    from fieldsim import plots

    if report.log is None or not report.log.history.times:
        words = f"nothing is drawn to {path}: the film moves nothing whose energy is judged"
        warnings.warn(words, FieldsimWarning, stacklevel=2)
        return
    plots.Picture(lambda size: plots.energy(report.log, size)).save(path)
    click.echo(f"  {path}: how well energy was kept")


@contextlib.contextmanager
def usage():
    """Turn bad input into wrong usage."""
    try:
        yield
    except InputError as error:
        raise click.UsageError(str(error)) from None


def _draw(picture, out, size):
    """Draw a picture, with a sign of life on a terminal."""
    from rich import console, markup

    from fieldsim import plots

    with usage():
        plots.checked_path(out)
    terminal = console.Console(stderr=True)
    with (
        terminal.status(markup.escape(f"drawing {picture.title or out}"))
        if terminal.is_terminal
        else contextlib.nullcontext()
    ):
        picture.save(out, size)
    click.echo(str(out))


@contextlib.contextmanager
def progress_of(title):
    """A function (done, in all) that draws a bar with the time left on a terminal, and does nothing elsewhere."""
    from rich import console, progress, table

    from fieldsim import launch
    from fieldsim.filming.report import COMPILING

    class Doing(progress.ProgressColumn):
        max_refresh = 0.5

        def get_table_column(self):
            return table.Column(no_wrap=True)

        def render(self, task):
            compiling = launch.loading_for() > 0.1 and launch.load_seconds() + launch.loading_for() > COMPILING
            return progress.Text("compiling kernels (first run only)" if compiling else title)

    terminal = console.Console(stderr=True)
    columns = (
        Doing(),
        progress.BarColumn(bar_width=20),
        progress.MofNCompleteColumn(),
        progress.TextColumn("frames"),
        progress.TimeElapsedColumn(),
        progress.TextColumn("left"),
        progress.TimeRemainingColumn(),
    )
    bar = progress.Progress(*columns, console=terminal, transient=True, disable=not terminal.is_terminal)
    with bar, launch.told_elsewhere():
        task = bar.add_task(title, total=None)
        yield lambda done, count: bar.update(task, completed=done, total=count)
