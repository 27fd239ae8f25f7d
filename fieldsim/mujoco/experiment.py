"""Experiments: scenarios in which a MuJoCo model moves through the fields of a world."""

import copy
import dataclasses
import functools
import warnings
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from fieldsim import validate
from fieldsim.dynamics.auto import Choice, IntegratorLike
from fieldsim.dynamics.diagnostics.energy_log import EnergyReport, History
from fieldsim.dynamics.diagnostics.totals import Drift, Total
from fieldsim.dynamics.integrators.splittings import Leapfrog
from fieldsim.errors import FieldsimError, FieldsimWarning, InputError
from fieldsim.mujoco import checks
from fieldsim.mujoco.contact.geoms import Contact
from fieldsim.mujoco.forces import ACCURACIES, FieldForces
from fieldsim.mujoco.models import ModelLike, model_of
from fieldsim.mujoco.scene.planet import PlanetGeom, follow
from fieldsim.mujoco.scene.scene import ModelSnapshot, Scene
from fieldsim.mujoco.scene.skins import Skin
from fieldsim.render.camera import Camera
from fieldsim.scenario import RunLog, Scenario, ScenarioRun
from fieldsim.types import RealLike
from fieldsim.world.world import World

# MuJoCo's warnings of a state that is NaN, infinite or huge.
BAD = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)

# Greatest number of steps of a run; steps between two checks for an interrupt.
MOST_STEPS, AT_ONCE = 10**9, 1000


@dataclasses.dataclass(frozen=True, kw_only=True)
class Experiment(Scenario):
    """A scenario with a MuJoCo model in the fields of its world's bodies; see `FieldForces` for how it feels them.

        fs.mujoco.Experiment(world, camera, model="humanoid.xml", contact=fs.mujoco.Contact(speed=3), duration=8)

    model: an MjModel, or MJCF: its text, or the path of a file. Bodies of the model do not pull. Particles of the world
    move as in any scenario, by `integrator`, and do not meet the model; its own integrator and step are its <option>'s.
    accuracy, contact, keep_gravity: as of FieldForces; with False, `model` is a copy without gravity. planets: the
    PlanetGeoms in the model, which follow their bodies. skins: drawn in place of the geoms that they stand for (see
    `skin`).
    start: a function of (model, data) that sets the state to begin with, on top of the model's own; control: one that
    is called before every step, to set data.ctrl, say. A frame shows the step nearest to its time.
    """

    model: mujoco.MjModel
    accuracy: str = "points"
    contact: Contact | None = None
    keep_gravity: bool | None = None
    planets: tuple[PlanetGeom, ...] = ()
    skins: tuple[Skin, ...] = ()
    start: Callable[[mujoco.MjModel, mujoco.MjData], object] | None = None
    control: Callable[[mujoco.MjModel, mujoco.MjData], object] | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            world: World,
            camera: Camera,
            *,
            duration: RealLike,
            fps: RealLike = ...,
            integrator: IntegratorLike | None = ...,
            title: str = ...,
            name: str = ...,
            parameters: dict[str, Any] = ...,
            model: ModelLike,
            accuracy: str = ...,
            contact: Contact | None = ...,
            keep_gravity: bool | None = ...,
            planets: PlanetGeom | Sequence[PlanetGeom] = ...,
            skins: Skin | Sequence[Skin] = ...,
            start: Callable[[mujoco.MjModel, mujoco.MjData], object] | None = ...,
            control: Callable[[mujoco.MjModel, mujoco.MjData], object] | None = ...,
        ) -> None: ...

    def __post_init__(self):
        super().__post_init__()
        if self.keep_gravity is not None:
            validate.flag("Experiment", "keep_gravity", self.keep_gravity)
        object.__setattr__(self, "model", self._without_gravity(model_of(self.model)))
        if self.integrator != Leapfrog() and not self.world.particles:
            raise InputError(
                f"Experiment: integrator is {self.integrator}, which moves particles, and there are none; the model's "
                "own is told by its <option integrator=... timestep=...>"
            )
        validate.choice("Experiment", "accuracy", self.accuracy, ACCURACIES)
        if self.contact is not None:
            validate.instance("Experiment", "contact", self.contact, Contact, "give a fs.mujoco.Contact, or None")
        for name in ("start", "control"):
            if getattr(self, name) is not None:
                remedy = "give a function of (model, data), or None"
                validate.function("Experiment", name, getattr(self, name), remedy)
        self.scene  # noqa: B018 - refuses what it cannot draw now, not when it is filmed

    def _without_gravity(self, model):
        """A copy without gravity of its own, where it shall not be kept: energies are computed between steps, too."""
        if self.keep_gravity is False:
            model = copy.copy(model)
            model.opt.gravity[:] = 0.0
        return model

    @classmethod
    def of(cls, scenario: Scenario, model: ModelLike, **options: Any) -> "Experiment":
        """The experiment of a model in a scenario: its world, camera, times and integrator; options: as above."""
        validate.instance("Experiment.of", "scenario", scenario, Scenario, "give a fs.Scenario")
        given = {field.name: getattr(scenario, field.name) for field in dataclasses.fields(Scenario)}
        if not scenario.world.particles:
            del given["integrator"]
        return cls(**given | {"model": model} | options)

    @functools.cached_property
    def scene(self) -> Scene:
        """What its frames show."""
        return Scene(self.world, self.model, skins=self.skins, planets=self.planets)

    @property
    def shown(self) -> World:
        """The world that its snapshots are of."""
        return self.scene.world

    def begin(self, device: str | None = None) -> tuple["Run", "ModelLog"]:
        """A `Run` from the start, and the log of its energy."""
        run = Run(self, *super().begin(device))
        return run, run.log


class Run:
    """An experiment under way: `advance(time)`, `snapshot()`; data: its MjData; forces: its FieldForces."""

    counted = "MuJoCo steps"  # for the report on a film
    choice: Choice | None = None

    def __init__(self, experiment: Experiment, others: ScenarioRun | None = None, log: RunLog | None = None):
        model = experiment.model
        self.experiment, self._others = experiment, others
        self.data = mujoco.MjData(model)
        self._moving = [planet for planet in experiment.scene.planets if planet.mocap]
        follow(model, self.data, self._moving)
        if experiment.start:
            validate.answer("Experiment", "start", experiment.start, model, self.data)
        if self.data.time != 0.0:
            raise InputError(
                f"Experiment: start leaves data.time at {self.data.time:g}, but a run begins at 0; set data.time = 0"
            )
        self._refuse_timestep()
        mujoco.mj_forward(model, self.data)
        options = {name: getattr(experiment, name) for name in ("accuracy", "contact", "keep_gravity")}
        self.forces = FieldForces(model, self.data, experiment.world, **options)
        self.time, self.steps_done, self._warned = 0.0, 0, False
        name = mujoco.mjtIntegrator(model.opt.integrator).name.removeprefix("mjINT_")
        self.integrator = f"{name} of {model.opt.timestep:g}"
        self.log = ModelLog(self, log)

    def _refuse_timestep(self):
        model, duration = self.experiment.model, self.experiment.duration
        checks.timestep(model, backwards=False)
        steps = duration / model.opt.timestep
        if not 1.0 <= steps <= MOST_STEPS:
            raise InputError(
                f"Experiment: duration is {duration:g} and the model's timestep {model.opt.timestep:g}, so it would be "
                f"{steps:.3g} steps; give a timestep of 1 to {MOST_STEPS:g} steps"
            )

    @property
    def bounces(self) -> int:
        """Contacts of particles."""
        return self._others.bounces if self._others else 0

    def advance(self, until: float) -> None:
        """Run to the step nearest to the time `until`. Raises FieldsimError for a motion that blows up."""
        model, data = self.experiment.model, self.data
        count = round(until / model.opt.timestep) - self.steps_done
        with warnings.catch_warnings():
            if self._warned:  # what is said on entering the field is said once
                warnings.simplefilter("ignore", FieldsimWarning)
            self._warned = True
            with self.forces.running():
                self._step(count)
        if any(data.warning[kind].number for kind in BAD):
            raise FieldsimError(
                f"between times {self.time:g} and {until:g} the model's motion blew up; give it a timestep below "
                f"{model.opt.timestep:g}, a softer Contact, or a softened kernel of gravity"
            )
        if abs(data.time - until) > 0.501 * model.opt.timestep:
            raise FieldsimError(
                f"Experiment: at time {until:g} of the run data.time is {data.time:g}; let control neither set it, nor "
                "step or reset the data, nor change the timestep"
            )
        mujoco.mj_kinematics(model, data)
        if self._others:
            self._others.advance(until)
        self.time, self.steps_done = until, self.steps_done + count

    def _step(self, count):
        experiment, model, data = self.experiment, self.experiment.model, self.data
        if not (self._moving or experiment.control):
            for done in range(0, count, AT_ONCE):
                mujoco.mj_step(model, data, min(AT_ONCE, count - done))
            return
        for _ in range(count):
            follow(model, data, self._moving)
            if experiment.control:
                validate.answer("Experiment", "control", experiment.control, model, data)
            mujoco.mj_step(model, data)

    def snapshot(self) -> ModelSnapshot:
        """The present moment."""
        base = self._others.snapshot() if self._others else self.experiment.world.at(self.time)
        return self.experiment.scene.snapshot(self.data, base)


class ModelLog:
    """Follows the total energy of an experiment's model, and the invariants of the world's particles if there are any.

    What contacts, damping and motors take or give shows as drift, as it should; what was gained is reported besides,
    for without motors, and planets that move, there should be none.
    """

    def __init__(self, run: Run, others: RunLog | None):
        self._run, self._others = run, others
        self.invariant = others.invariant if others else ""
        self.history = others.history if others else History()
        self._first: float | None = None
        self._gain = 0.0
        self._own = Total("the MuJoCo model", "total energy", self._measured)
        self.totals = [*(others.totals if others else ()), self._own]

    def _measured(self):
        energy = self._run.forces.energy()
        scale = energy.kinetic + sum(map(abs, (energy.model, energy.field, energy.contact)))
        self._first = energy.total if self._first is None else self._first
        self._gain = max(self._gain, (energy.total - self._first) / max(scale, np.finfo(float).tiny))
        return np.float64(energy.total), scale

    def record(self) -> None:
        """Take the present moment into account."""
        if self._others:
            self._others.record()
        self._own.record()
        if len(self.history.times) < len(self._own.drifts):
            self.history.times.append(self._run.time)

    def report(self) -> EnergyReport:
        """The drift over all moments recorded so far."""
        others = self._others.report() if self._others else EnergyReport("", 0.0, 0.0, 0, 0)
        gained = Drift(self._own.whose, "gains of it", self._gain)
        return dataclasses.replace(others, totals=(*others.totals, self._own.drift, gained))
