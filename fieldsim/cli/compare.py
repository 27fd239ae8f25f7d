"""The command that compares two solvers on a frame of a scenario."""

import click

from fieldsim import scenario as scenarios
from fieldsim.cli.film import command_of, film_options, usage
from fieldsim.cli.types import FilePath
from fieldsim.errors import InputError


def compare_options():
    """The options of a comparison."""
    shared = [option for option in film_options() if option.name in ("size", "device", "debug")]
    return [
        click.Option(["--solver"], multiple=True, metavar="NAME", help="Two of them; default hermite and referee."),
        click.Option(["--time"], type=float, help="Moment of the scenario; default its start."),
        click.Option(["--out"], type=FilePath(), metavar="FILE", help="The picture of differences, .png or .svg."),
        *shared,
    ]


def compare_command(build, name):
    """The command that compares two solvers on a frame of what `build` gives."""
    return command_of(build, name, compare_options(), lambda given, options: _compare(build, name, given, options))


def _compare(build, name, given, options):
    from fieldsim import plots
    from fieldsim.filming import comparing
    from fieldsim.launch import device_named
    from fieldsim.render.solvers.by_name import solver_named

    out = options["out"] or f"{name}-compare.png"
    names = options["solver"] or ("hermite", "referee")
    with usage():
        plots.checked_path(out)
        for solver in names:
            solver_named(solver)
        if len(names) != 2:
            raise InputError(f"--solver was given {len(names)} times; give it twice")
    device_named(options["device"])
    scenario = scenarios.call(build, given)
    if isinstance(scenario, plots.Picture):
        raise InputError(f"{name} draws a plot; there is nothing to compare")
    result = comparing.compare(
        scenario, names, time=options["time"] or 0.0, size=options["size"] or comparing.SIZE, device=options["device"]
    )
    plots.Picture(lambda _size: result.draw()).save(out)
    click.echo(f"{out}\n{result}")
