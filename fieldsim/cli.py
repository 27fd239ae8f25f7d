"""The command line: `fieldsim run SCENARIO`, `fieldsim info`, and the same options for a script run by itself."""

import contextlib
import os
import pathlib
import signal
import sys
import warnings

import click

from fieldsim import scenario as scenarios
from fieldsim.cli_types import Device, Integrator, Positive, Size
from fieldsim.errors import FieldsimError, FieldsimWarning, InputError
from fieldsim.render.layers import LAYERS
from fieldsim.render.solids_skeleton import MODES

OK, FAILURE, USAGE, INTERRUPTED = 0, 1, 2, 130

EXAMPLES = """
\b
Examples:
  fieldsim run donut                       donut.mp4, 640x360
  fieldsim run donut --preview             a quick look first
  fieldsim run donut --pebbles 2000 --size 1280x720 --out big.mp4
  fieldsim run donut --out donut.png       only the last frame
  fieldsim run my_planet.py --help         the options of a script of your own
"""


def main(build=None, argv=None) -> None:
    """Run the command `fieldsim`, or, with `build`, the command of the script that calls this.

    A scenario ends with `if __name__ == "__main__": fs.main(build)`, and `python scenario.py --out film.mp4` works.
    Ends the process: status 0, 1 after a failure, 2 for wrong usage, 130 after an interrupt.
    """
    if build is not None and scenarios.being_loaded():
        return
    with contextlib.suppress(ValueError):  # not the main thread
        # A polite end, as at the keyboard: nothing half-written stays.
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    sys.exit(_status(build, sys.argv[1:] if argv is None else list(argv)))


def _status(build, argv):
    """Run the command and return its exit status, with one clear message for whatever went wrong."""
    program = "fieldsim" if build is None else f"python {sys.argv[0]}"
    try:
        with _plain_warnings():
            command = cli if build is None else film_command(build, _stem_of(build))
            command.main(argv, prog_name=program, standalone_mode=False)
        return OK
    except click.exceptions.NoArgsIsHelpError as error:
        error.show()
        return USAGE
    except click.UsageError as error:
        help_at = f"\n({error.ctx.command_path} --help tells more)" if error.ctx else ""
        _say(error.format_message() + help_at)
        return USAGE
    except (click.Abort, KeyboardInterrupt):
        _say("interrupted; nothing was written")
        return INTERRUPTED
    except Exception as error:
        if os.environ.get("FIELDSIM_DEBUG", "0") not in ("", "0"):
            raise
        known = isinstance(error, FieldsimError)
        _say(str(error) if known else f"unexpected {type(error).__name__}: {error} (--debug shows where)")
        return FAILURE


def _say(message):
    click.echo(f"fieldsim: {message}", err=True)


@contextlib.contextmanager
def _plain_warnings():
    """Show fieldsim's own warnings as one line each."""
    with warnings.catch_warnings():
        show = warnings.showwarning

        def plain(message, category, *where):
            if issubclass(category, FieldsimWarning):
                _say(f"warning: {message}")
            else:
                show(message, category, *where)

        warnings.showwarning = plain
        warnings.simplefilter("always", FieldsimWarning)
        yield


def _stem_of(build):
    return pathlib.Path(build.__code__.co_filename).stem


def _switch_debug(ctx, param, value):
    if value:
        os.environ["FIELDSIM_DEBUG"] = "1"


def _film_options():
    """The options that every film has."""
    return [
        click.Option(
            ["--out"],
            metavar="FILE",
            help="Where to: .mp4, .gif, .png (last frame), folder/ or name_%04d.png; a plot: .png, .svg.",
        ),
        click.Option(["--size"], type=Size(), metavar="WxH", help="Pixels of a frame; 640x360 unless told."),
        click.Option(["--fps"], type=Positive(), help="Frames per second; the scenario's unless told."),
        click.Option(["--duration"], type=Positive(), help="Seconds of film; the scenario's unless told."),
        click.Option(
            ["--device"], type=Device(), metavar="cpu|cuda", default="cpu", help="Where to compute; cpu unless told."
        ),
        click.Option(["--quality"], type=click.Choice(["draft", "final"]), help="draft is faster; final unless told."),
        click.Option(["--record"], metavar="RUN.npz", help="Keep the snapshots, to be drawn again or read with NumPy."),
        click.Option(["--replay"], metavar="RUN.npz", help="Draw a recording of this scenario instead of simulating."),
        click.Option(
            ["--integrator"],
            type=Integrator(),
            metavar="NAME[:NUMBER]",
            help="How things move: auto, radau, leapfrog:1e-3, blanesmoan6:0.05, ...; the scenario's unless told.",
        ),
        click.Option(["--energy-plot"], metavar="FILE", help="Draw how well energy is kept: .png, .svg or .pdf."),
        click.Option(
            ["--mode"],
            type=click.Choice(MODES),
            help="Bodies as soft surfaces, as hard shapes, or as lines; soft unless told.",
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
            expose_value=False,
            callback=_switch_debug,
            help="Show Python's tracebacks.",
        ),
    ]


def _scenario_option(parameter):
    """The option of one of `build`'s own parameters."""
    name = parameter.name.replace("_", "-")
    required = parameter.required
    shared = {"required": required, "help": parameter.help or None}
    if not required and parameter.default is not None:
        shared |= {"default": parameter.default, "show_default": True}
    if parameter.kind is bool:
        return click.Option([f"--{name}/--no-{name}", parameter.name], **shared)
    kind = click.Choice(parameter.kind) if isinstance(parameter.kind, tuple) else parameter.kind
    return click.Option([f"--{name}", parameter.name], type=kind, **shared)


def film_command(build, name: str) -> click.Command:
    """The command that films what `build` gives: the options of every film and those of its own parameters.

    A parameter of `build` that is named like a film's option, such as `duration`, is given that option's value, where
    it is told.
    """
    film = _film_options()
    taken = {option.name for option in film}
    own = scenarios.parameters(build)

    def callback(**values):
        told = {p.name: values[p.name] for p in own if p.name not in taken or values[p.name] is not None}
        _film(build, name, told, {key: values[key] for key in taken if key in values})

    return click.Command(
        name,
        callback=callback,
        params=[_scenario_option(p) for p in own if p.name not in taken] + film,
        help=scenarios.description(build),
        context_settings={"max_content_width": 120},
    )


def _film(build, name, told, options):
    """Check what the machine and the disk say about the request, build, film or draw, report."""
    from fieldsim import filming, plots
    from fieldsim.launch import device_named
    from fieldsim.render.video import Film

    out, energy_plot = options.pop("out"), options.pop("energy_plot")
    with _usage():
        if energy_plot:
            plots.checked_path(energy_plot)
        if out and pathlib.Path(out).suffix.lower() in plots.KINDS:
            plots.checked_path(out)
        else:
            Film(out or "film.mp4", options["size"])
    device_named(options["device"])
    scenario = scenarios.call(build, told)
    if isinstance(scenario, plots.Picture):
        if energy_plot or options["integrator"]:
            raise click.UsageError("the scenario is a picture: --integrator and --energy-plot are for films")
        _draw(scenario, out or f"{name}.png", options["size"])
        return
    out = out or f"{name}{'-preview' if options['preview'] else ''}.mp4"
    with _usage():
        Film(out, options["size"])
    with _progress(scenario.title or name) as watch:
        report = filming.film(scenario, out, watch=watch, **options)
    click.echo(str(report))
    if energy_plot:
        _draw_energy(report, energy_plot)


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
def _usage():
    """Turn bad input into wrong usage."""
    try:
        yield
    except InputError as error:
        raise click.UsageError(str(error)) from None


def _draw(picture, out, size):
    """Draw a picture, with a sign of life on a terminal."""
    from rich import console

    from fieldsim import plots

    with _usage():
        plots.checked_path(out)
    terminal = console.Console(stderr=True)
    with terminal.status(f"drawing {picture.title or out}") if terminal.is_terminal else contextlib.nullcontext():
        picture.save(out, size)
    click.echo(str(out))


@contextlib.contextmanager
def _progress(title):
    """A function (done, in all) that draws a bar with the time left on a terminal, and does nothing elsewhere."""
    from rich import console, progress, table

    from fieldsim import launch
    from fieldsim.filming import COMPILING

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
    with progress.Progress(*columns, console=terminal, transient=True, disable=not terminal.is_terminal) as bar:
        task = bar.add_task(title, total=None)
        yield lambda done, count: bar.update(task, completed=done, total=count)


class _Run(click.Group):
    """A group whose commands are the scenario scripts: those of the folder `scenarios`, and any by its path."""

    options = staticmethod(_film_options)
    command_of = staticmethod(film_command)

    def list_commands(self, ctx):
        return [path.stem for path in scenarios.available()]

    def get_command(self, ctx, name):
        if ctx.resilient_parsing:
            return None
        try:
            path = scenarios.find(name)
        except FieldsimError as error:
            raise click.UsageError(str(error), ctx) from None
        return self.command_of(scenarios.load(path), path.stem)

    def format_commands(self, ctx, formatter):
        rows = [(path.stem, scenarios.summary(path)) for path in scenarios.available()]
        if rows:
            with formatter.section("Scenarios here"):
                formatter.write_dl(rows)

    def parse_args(self, ctx, args):
        """Let the command's options stand before the scenario, too."""
        valued = {name for option in self.options() if not option.is_flag for name in option.opts}
        place = 0
        while place < len(args) and args[place].startswith("-") and args[place] != "--help":
            place += 2 if args[place] in valued else 1
        if place < len(args) and args[place] != "--help":
            args = [args[place], *args[:place], *args[place + 1 :]]
        return super().parse_args(ctx, args)


def _compare_options():
    """The options of a comparison."""
    shared = [option for option in _film_options() if option.name in ("size", "device", "debug")]
    return [
        click.Option(["--solver"], multiple=True, metavar="NAME", help="Two of them; hermite and referee unless told."),
        click.Option(["--time"], type=float, default=0.0, help="Moment of the scenario; its start unless told."),
        click.Option(["--out"], metavar="FILE", help="The picture of differences, .png or .svg."),
        *shared,
    ]


def _compare_command(build, name):
    """The command that compares two solvers on a frame of what `build` gives."""
    options = _compare_options()
    taken = {option.name for option in options}
    own = scenarios.parameters(build)

    def callback(**values):
        told = {p.name: values[p.name] for p in own if p.name not in taken}
        _compare(build, name, told, {key: values[key] for key in taken if key in values})

    params = [_scenario_option(p) for p in own if p.name not in taken] + options
    return click.Command(name, callback=callback, params=params, help=scenarios.description(build))


def _compare(build, name, told, options):
    from fieldsim import comparing, plots
    from fieldsim.launch import device_named
    from fieldsim.render.solvers import solver_named

    out = options["out"] or f"{name}-compare.png"
    names = options["solver"] or ("hermite", "referee")
    with _usage():
        plots.checked_path(out)
        for solver in names:
            solver_named(solver)
        if len(names) != 2:
            raise InputError(f"--solver was given {len(names)} times; give it twice")
    device_named(options["device"])
    scenario = scenarios.call(build, told)
    if isinstance(scenario, plots.Picture):
        raise InputError(f"{name} draws a plot; there is nothing to compare")
    result = comparing.compare(
        scenario, names, time=options["time"], size=options["size"] or comparing.SIZE, device=options["device"]
    )
    plots.Picture(lambda _size: result.draw()).save(out)
    click.echo(f"{out}\n{result}")


class _Compare(_Run):
    """As `_Run`, for comparisons."""

    options = staticmethod(_compare_options)
    command_of = staticmethod(_compare_command)


def _version(ctx, param, value):
    if value and not ctx.resilient_parsing:
        from importlib.metadata import version

        click.echo(f"fieldsim {version('fieldsim')}")
        ctx.exit()


@click.group(context_settings={"max_content_width": 100}, epilog=EXAMPLES)
@click.option("--version", is_flag=True, is_eager=True, expose_value=False, callback=_version, help="Show the version.")
def cli():
    """Films of worlds whose planets are fields: cigars, crosses, donuts.

    A scenario is a Python script that builds a world and a camera; fieldsim simulates it, ray traces it and writes the
    film.
    """


@cli.command("run", cls=_Run, short_help="Film a scenario.", subcommand_metavar="SCENARIO [OPTIONS]", epilog=EXAMPLES)
def run():
    """Film a scenario: a name in the folder scenarios, or the path of a script.

    `fieldsim run SCENARIO --help` shows the options of every film and the scenario's own.
    """


@cli.command("compare", cls=_Compare, short_help="Compare solvers.", subcommand_metavar="SCENARIO [OPTIONS]")
def compare():
    """Render a scenario's frame with two solvers and show where they differ.

    `fieldsim compare cross --solver hermite --solver referee` writes cross-compare.png and prints figures.
    """


@cli.command(short_help="Versions, devices, kernel cache.")
def info():
    """Versions, devices and the kernel cache: what to tell when reporting a problem."""
    from fieldsim.about import report

    click.echo(report())
