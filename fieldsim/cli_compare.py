"""The command that compares two solvers on a frame of a scenario."""

import click

from fieldsim import scenario as scenarios
from fieldsim.cli_film import film_options, scenario_option, usage
from fieldsim.errors import InputError


def compare_options():
    """The options of a comparison."""
    shared = [option for option in film_options() if option.name in ("size", "device", "debug")]
    return [
        click.Option(["--solver"], multiple=True, metavar="NAME", help="Two of them; hermite and referee unless told."),
        click.Option(["--time"], type=float, default=0.0, help="Moment of the scenario; its start unless told."),
        click.Option(["--out"], metavar="FILE", help="The picture of differences, .png or .svg."),
        *shared,
    ]


def compare_command(build, name):
    """The command that compares two solvers on a frame of what `build` gives."""
    options = compare_options()
    taken = {option.name for option in options}
    own = scenarios.parameters(build)

    def callback(**values):
        told = {p.name: values[p.name] for p in own if p.name not in taken}
        _compare(build, name, told, {key: values[key] for key in taken if key in values})

    params = [scenario_option(p) for p in own if p.name not in taken] + options
    return click.Command(name, callback=callback, params=params, help=scenarios.description(build))


def _compare(build, name, told, options):
    from fieldsim import comparing, plots
    from fieldsim.launch import device_named
    from fieldsim.render.solvers import solver_named

    out = options["out"] or f"{name}-compare.png"
    names = options["solver"] or ("hermite", "referee")
    with usage():
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
