"""The command line: `fieldsim run SCENARIO`, `mujoco`, `compare`, `info`, and the options of a script run by itself."""

import contextlib
import os
import signal
import sys
import warnings
from collections.abc import Callable, Sequence

import click

from fieldsim import files, interrupts, validate
from fieldsim import scenario as scenarios
from fieldsim.cli.compare import compare_command, compare_options
from fieldsim.cli.film import film_command, film_options
from fieldsim.cli.mujoco import model_command, model_options
from fieldsim.errors import FieldsimError, FieldsimWarning

OK, FAILURE, USAGE = 0, 1, 2

EXAMPLES = """
\b
Examples:
  fieldsim run donut                       donut.mp4, 640x360
  fieldsim run donut --preview             a quick look first
  fieldsim run donut --pebbles 2000 --size 1280x720 --out big.mp4
  fieldsim run donut --out donut.png       only the last frame
  fieldsim run my_planet.py --help         the options of a script of your own
"""


MODELS = """
\b
Examples:
  fieldsim mujoco humanoid.xml donut                    humanoid-donut.mp4, 640x360
  fieldsim mujoco humanoid.xml cigar --skin             as one soft surface
  fieldsim mujoco boxes.xml cross --speed 3 --friction 1 --out boxes.mp4
"""


def main(build: scenarios.Build | None = None, argv: Sequence[str] | None = None) -> None:
    """Run the command `fieldsim`, or, with `build`, the command of the script that calls this.

    A scenario ends with `if __name__ == "__main__": fs.main(build)`, and `python scenario.py --out film.mp4` works.
    Ends the process: status 0, 1 after a failure, 2 for wrong usage, 130 after an interrupt, 143 and 129 after SIGTERM
    and SIGHUP, which end a run in the same way.
    """
    validate.optional(validate.function, "main", "build", build)
    argv = validate.optional(validate.instances, "main", "argv", argv, str, "give a list of strings")
    if build is not None and scenarios.being_loaded():
        return
    with interrupts.heard("SIGINT", "SIGTERM", "SIGHUP"):
        status = _status(build, sys.argv[1:] if argv is None else list(argv))
    sys.exit(status)


def _status(build, argv):
    """Run the command and return its exit status, with one clear message for whatever went wrong."""
    try:
        with _plain_warnings():
            _run_command(build, argv)
        return OK
    except click.exceptions.NoArgsIsHelpError as error:
        error.show()
        return USAGE
    except click.UsageError as error:
        help_at = f"\n({error.ctx.command_path} --help tells more)" if error.ctx else ""
        _say(error.format_message() + help_at)
        return USAGE
    except BaseException as error:
        return _failed(error.__cause__ if isinstance(error, click.Abort) and error.__cause__ else error)


def _run_command(build, argv):
    """Run the command, and see that what it says arrives."""
    program = "fieldsim" if build is None else f"python {sys.argv[0]}"
    command = cli if build is None else film_command(build, scenarios.source_of(build).stem)
    output = sys.stdout
    try:
        command.main(argv, prog_name=program, standalone_mode=False)
        if output is not None:
            output.flush()
    except (BrokenPipeError, SystemExit) as error:
        # Whoever reads what we say has had enough, as `head` has: click puts another output in place, and exits.
        if isinstance(error, SystemExit) and sys.stdout is output:
            raise
        sys.stdout = open(os.devnull, "w")  # Python would complain when it ends


def _failed(error):
    """Say what ended the command, and return its status."""
    kept = "; ".join(_notes(error))
    signalled = interrupts.come()
    if signalled is not None or isinstance(error, KeyboardInterrupt):
        whole = "; ".join(f"{path} is whole" for path in files.appeared)
        _say("; ".join(filter(None, ("interrupted", whole, kept))) + ("" if whole or kept else "; nothing was written"))
        return 128 + (signalled or signal.SIGINT)
    if os.environ.get("FIELDSIM_DEBUG", "0") not in ("", "0"):
        raise error
    words = str(error) if isinstance(error, FieldsimError) else _unexpected(error)
    _say(f"{words}; {kept}" if kept else words)
    return FAILURE


def _notes(error):
    """What was said of files that were kept, of this error and of those that it came in the way of."""
    return [*(_notes(error.__context__) if error.__context__ else ()), *getattr(error, "__notes__", ())]


def _unexpected(error):
    if isinstance(error, SystemExit):
        return f"a function of the scenario ended the run, by sys.exit({error.code!r})"
    return f"unexpected {type(error).__name__}: {error} (--debug shows where)"


def _say(message):
    with contextlib.suppress(OSError):  # the terminal is closed: nobody to tell
        click.echo(f"fieldsim: {message}", err=True)


@contextlib.contextmanager
def _plain_warnings():
    """Show fieldsim's own warnings as one line each."""
    with warnings.catch_warnings():
        show = warnings.showwarning

        def plain(message, category, filename, lineno, file=None, line=None):
            if issubclass(category, FieldsimWarning):
                _say(f"warning: {message}")
            else:
                show(message, category, filename, lineno, file, line)

        warnings.showwarning = plain
        warnings.simplefilter("always", FieldsimWarning)
        yield


class _Run(click.Group):
    """A group whose commands are the scenario scripts: those of the folder `scenarios`, and any by its path."""

    # How many names stand before the options: of the scenario, and of what the group itself takes before it.
    names = 1
    options: Callable[[], list[click.Option]] = staticmethod(film_options)
    command_of: Callable[..., click.Command] = staticmethod(film_command)

    def list_commands(self, ctx):
        return [path.stem for path in scenarios.available()]

    def get_command(self, ctx, cmd_name):
        if ctx.resilient_parsing:
            return None
        try:
            path = scenarios.find(cmd_name)
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
        for count in range(self.names if args else 0):
            place = count
            while place < len(args) and args[place].startswith("-") and args[place] != "--help":
                place += 2 if args[place] in valued else 1
            if place >= len(args):
                missing = "a SCENARIO" if count == self.names - 1 else "MODEL.xml and a SCENARIO"
                raise click.UsageError(f"name {missing} besides the options", ctx)
            if args[place] == "--help":
                args = ["--help"]
                break
            args = [*args[:count], args[place], *args[count:place], *args[place + 1 :]]
        return super().parse_args(ctx, args)


class _Compare(_Run):
    """As `_Run`, for comparisons."""

    options = staticmethod(compare_options)
    command_of = staticmethod(compare_command)


class _Mujoco(_Run):
    """As `_Run`, for a MuJoCo model in a scenario."""

    names = 2
    options = staticmethod(model_options)
    command_of = staticmethod(model_command)


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

    A run that fails or is interrupted keeps what it has: under its name if there was nothing before, else as
    NAME.partial.mp4 beside it.

    `fieldsim run SCENARIO --help` shows the options of every film and the scenario's own.
    """


@cli.command("compare", cls=_Compare, short_help="Compare solvers.", subcommand_metavar="SCENARIO [OPTIONS]")
def compare():
    """Render a scenario's frame with two solvers and show where they differ.

    `fieldsim compare cross --solver hermite --solver referee` writes cross-compare.png and prints figures.
    """


@cli.command(
    "mujoco",
    cls=_Mujoco,
    short_help="Film a MuJoCo model in a scenario.",
    subcommand_metavar="SCENARIO [OPTIONS]",
    epilog=MODELS,
)
@click.argument("model", metavar="MODEL.xml")
def mujoco(model):
    """Film a MuJoCo model in the fields of a scenario.

    MODEL.xml gives the bodies, the SCENARIO its planets, camera and lights. The planets pull the bodies and stop them
    at their surfaces; the bodies collide with each other as MuJoCo does it, and all is in one ray-traced picture.

    `fieldsim mujoco MODEL.xml SCENARIO --help` shows all options.
    """


@cli.command(short_help="Versions, devices, kernel cache.")
def info():
    """Versions, devices and the kernel cache: what to tell when reporting a problem."""
    from fieldsim.cli.about import report

    click.echo(report())
