"""The command that films a MuJoCo model in the fields of a scenario."""

import pathlib

import click

from fieldsim.cli.film import film_command, film_options, usage
from fieldsim.cli.types import Positive
from fieldsim.errors import InputError

# Defaults of a contact: how deep a hit goes, its damping and friction.
DEPTH, DAMPING, FRICTION = 0.1, 0.5, 0.5


def _own_options():
    """The options that a model has besides those of every film."""
    return [
        click.Option(["--skin"], is_flag=True, help="Draw the model as one soft surface on its geoms."),
        click.Option(["--no-contact"], is_flag=True, help="Let the bodies pass through the planets."),
        click.Option(["--speed"], type=Positive(), help="Fastest hit on a planet to expect; default from the fall."),
        click.Option(["--depth"], type=Positive(), help=f"How deep that goes, in radii; default {DEPTH:g}."),
        click.Option(
            ["--timestep"],
            type=Positive(),
            help="MuJoCo's step; default the model's, or less where contact needs it.",
        ),
        click.Option(["--damping"], type=float, help=f"What hits lose, 0 for nothing; default {DAMPING:g}."),
        click.Option(["--friction"], type=float, help=f"Coulomb's coefficient on planets; default {FRICTION:g}."),
        click.Option(
            ["--keep-gravity"], is_flag=True, help="Keep the model's own gravity, which is switched off by default."
        ),
        click.Option(
            ["--beside"], is_flag=True, help="MuJoCo's own picture of the model alone to the right; needs OpenGL."
        ),
    ]


def model_options():
    """The options of a model's film."""
    return [*_own_options(), *film_options()]


def model_command(build, name: str) -> click.Command:
    """The command that films the model, which the command above this one takes, in what `build` gives."""
    return film_command(build, name, _own_options(), _prepared)


def _prepared(name, options):
    """Load the model; the film's name, and how to make an experiment of a scenario."""
    from fieldsim.mujoco.models import model_of

    group = click.get_current_context().parent
    assert group is not None  # the command `mujoco`, which takes the model
    path = group.params["model"]
    own = {option.name: options.pop(option.name) for option in _own_options()}
    own["model"] = pathlib.Path(path).name
    with usage():
        if own["beside"] and options["replay"]:
            raise InputError("--beside draws what is simulated, not a recording; leave out --replay")
        model = model_of(pathlib.Path(path))
    return f"{pathlib.Path(path).stem}-{name}", lambda scenario: _adapted(scenario, model, name, own)


def _adapted(scenario, model, name, own):
    from fieldsim.mujoco.contact.impact import resolving_timestep
    from fieldsim.mujoco.experiment import Experiment
    from fieldsim.mujoco.scene.mujoco_renderer import MujocoRenderer
    from fieldsim.mujoco.scene.skins import skin

    if isinstance(scenario, Experiment):
        raise InputError(f"{name} has a model of its own; film it with: fieldsim run {name}")
    contact = _contact(scenario.world, model, own)
    # The model is this command's own, read from its file.
    model.opt.timestep = own["timestep"] or resolving_timestep(scenario.world, model, contact)
    options = {"keep_gravity": own["keep_gravity"], "skins": skin(model) if own["skin"] else ()}
    # What moves depends on these, too: a recording names them.
    moving = {key: value for key, value in own.items() if key not in ("skin", "beside") and value not in (None, False)}
    options["parameters"] = scenario.parameters | moving
    experiment = Experiment.of(scenario, model, contact=contact, **options)
    return experiment, {"beside": lambda size: MujocoRenderer(experiment.model, size)} if own["beside"] else {}


def _contact(world, model, own):
    """The law of contact with the planets, or None where nothing can be touched."""
    from fieldsim.mujoco.contact.geoms import Contact
    from fieldsim.mujoco.contact.impact import hit_speed

    if own["no_contact"] or all(body.surface is None for body in world.bodies):
        return None
    given = {key: own[key] for key in ("depth", "damping", "friction") if own[key] is not None}
    speed = own["speed"] or hit_speed(world, model)
    return Contact(speed, **{"depth": DEPTH, "damping": DAMPING, "friction": FRICTION, **given})
