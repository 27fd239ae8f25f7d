"""FieldForces: a MuJoCo model in fields of this package."""

import contextlib
import functools
import operator
import secrets
import sys
import warnings
from collections.abc import Generator, Sequence
from typing import TypeAlias

import mujoco
import numpy as np

from fieldsim import validate
from fieldsim.arrays import read_only
from fieldsim.copies import ThreadLock, Uncopied, shallow
from fieldsim.errors import FieldsimWarning, InputError
from fieldsim.mujoco import checks, notices, sensors
from fieldsim.mujoco.callback import entries, layout, memory, ownership
from fieldsim.mujoco.callback.field_callbacks import LENGTHS
from fieldsim.mujoco.callback.rows import CONTACT_ENERGY, FIELD_ENERGY, FOUND_WIDTH
from fieldsim.mujoco.callback.tables import SourcesLike, SourceTable, given_sources, sources_of
from fieldsim.mujoco.contact.geoms import Contact, warn_of_untouched
from fieldsim.mujoco.energy import ModelEnergy, copy_state, own_energies, subtree_wrenches
from fieldsim.mujoco.evaluator import Evaluator
from fieldsim.mujoco.planning import at_centers, plan_of
from fieldsim.mujoco.watch import Watch
from fieldsim.potentials.field import Field
from fieldsim.types import ArrayLike, RealLike, WholeLike
from fieldsim.world.world import World

# Names or numbers of bodies: one or several.
BodiesLike: TypeAlias = str | WholeLike | Sequence[str | WholeLike] | np.ndarray

ACCURACIES = ("points", "geoms", "torque")
# Attributes that are set when the field is made, and cannot be changed.
FIXED = ("model", "data", "sources", "bodies", "accuracy", "contact", "keep_gravity", "native")
# Marks gravity that was switched off: a zero that differs in its bits from one that a user sets.
OFF = -0.0


class FieldForces(Uncopied):
    """Gravity, and optionally contact, of fields on the bodies of a MuJoCo model, as a context manager.

        with fs.mujoco.FieldForces(model, data, planet):
            mujoco.mj_step(model, data)

    Within it MuJoCo's passive forces of every data of this model, and of copies that are made of it from now on
    (copy, deepcopy, pickle, `mujoco.rollout`, `mujoco.batch`), at every stage of a step, include those of the fields;
    other models are left alone, and may be in fields of their own at the same time, in threads of their own too.

    sources: a Field, a Body or a World, or several; Bodies may move (Pose, Spin, Keyframes, functions of time) and
    deform. bodies: names or numbers of the bodies that feel them, default all that have mass and move.
    accuracy: "points": the pull on six mass points with the body's inertia, right to the fourth order in its size over
    its distance; "geoms": on points all over the geoms; "torque": the pull at the centre of mass and the torque of its
    gradient, at a third of the cost of "points", but without the tide's pull, so that the energy is not kept.
    contact: a `Contact`, for the surfaces of sources that are Bodies. keep_gravity: what to do with the model's own
    gravity where it is on: True keeps it, False switches it off while in the field (copies made within stay without).
    native: run as native code, without Python or its lock; False runs the same in Python, slowly, to debug. Where a
    source moves or deforms by a function of time, that function is called in Python at every stage.

    Numbers of the model may be changed at any time (masses, inertias, frames and sizes of geoms, what touches, the time
    step): the next stage of a step sees it, as does every question; vertices of meshes are seen by questions, and
    when entered, or after `refresh()`. Of a body with gravcomp that share of the field's gravity is compensated.
    Copies may have other masses, and inertias, and for accuracy "geoms" or contact nothing else than the model.
    What was given here stays: sources, bodies, accuracy, contact and the others refuse to be set.

    To MuJoCo the field is a passive force: `mujoco.mj_inverse` takes it off as it does springs, but data.energy, the
    bias forces of `mj_rne` and some sensors leave it out. `energy()` has all energies, `readings()` what sensors read;
    a FieldsimWarning names the sensors (see `sensors`).

    Raises InputError for what cannot be (see `checks`), when made or when entered. What was there as MuJoCo's callback
    runs first, and is put back at the end; a callback, and gravity, that are set within outlive it. A FieldsimWarning
    tells at the end where the field was off: another callback was set, passive forces were disabled, or the model was
    compiled anew, as by MjSpec.recompile.
    """

    _remedy = "make one in each process, of a copy of the model"
    bodies: np.ndarray
    _own_gravity: np.ndarray | None
    _failure: Exception | None

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        sources: SourcesLike,
        *,
        bodies: BodiesLike | None = None,
        accuracy: str = "points",
        contact: Contact | None = None,
        keep_gravity: bool | None = None,
        native: bool = True,
    ):
        checks.model_and_data(model, data)
        self.model, self.data = model, data
        given = given_sources(sources)
        self.sources = sources_of(given)
        self._worlds = [(world, world.bodies) for world in given if isinstance(world, World)]
        chosen = checks.bodies(model, bodies)
        self._chosen, self._weighing = None if bodies is None else chosen.tolist(), False
        self.accuracy = validate.choice("FieldForces", "accuracy", accuracy, ACCURACIES)
        if contact is not None:
            validate.instance("FieldForces", "contact", contact, Contact, "give a fs.mujoco.Contact(speed), or None")
        self.contact, self.native = contact, validate.flag("FieldForces", "native", native)
        self.keep_gravity = None if keep_gravity is None else validate.flag("FieldForces", "keep_gravity", keep_gravity)
        checks.gravity(model, keep_gravity)
        checks.timestep(model, backwards=contact is None)
        checks.state(data)
        self._gravity = SourceTable(self.sources, "gravity", data.time, (), native, accuracy)
        self._surface = SourceTable(self.sources if contact else (), "surface", data.time, LENGTHS, native)
        checks.something_acts(self._gravity, self._surface, contact is not None)
        self._own_gravity = self._failure = None
        # Guards what one evaluation at a time may use: sources that Python moves, tables, and room to work in.
        self._lock = ThreadLock()
        # Other data of the model, for questions between steps.
        self._scratch, self._sensed = mujoco.MjData(model), mujoco.MjData(model)
        layout.check(data, memory.PLACES)
        self._evaluator = Evaluator(accuracy, contact is not None, native, self._gravity, self._surface)
        # Copies of the model keep the mark, by which they are known.
        self.mark = secrets.randbits(32) | 1
        # Tables that were given up, while another thread may be at work on them.
        self._outgrown = []
        # How often copies of the model were unlike it, and how often they had gravity of their own.
        self._told = np.zeros(2, dtype=np.int64)
        self._renew()
        sensors.warn(model, contact is not None)
        if contact and bodies is None:
            warn_of_untouched(model, self.bodies)

    def __setattr__(self, name, value):
        if name in FIXED and name in self.__dict__:
            raise InputError(f"FieldForces: {name} stays as it is, as tables are made of it; make another FieldForces")
        super().__setattr__(name, value)

    def refresh(self) -> None:
        """See numbers of the model that were changed; steps, questions and entering do so by themselves.

        Raises InputError for numbers that cannot be, and for a World that was given and has got other bodies.
        """
        for now, before in self._other_bodies():
            raise InputError(
                f"FieldForces: its world has other bodies ({now}) than when it was made ({before}); make another "
                "FieldForces"
            )
        if self._watch.changed():
            self._renew()

    def _other_bodies(self):
        """How many bodies each given world has and had, of those that got other ones."""
        return [
            (len(world.bodies), len(bodies))
            for world, bodies in self._worlds
            if len(world.bodies) != len(bodies) or not all(map(operator.is_, world.bodies, bodies))
        ]

    def _renew(self):
        """Make all tables of what the model is now."""
        with self._lock:
            touching = self.contact is not None
            checks.numbers(self.model, touching or self.accuracy == "geoms")
            self.__dict__["bodies"] = read_only(self._those_that_feel())
            watch = Watch(self.model, self.accuracy, touching)
            self._evaluator.take(self.model, self._planned())
            self._watch = watch
            self._introduce()
        if ownership.active(self):
            self._warn_of_long_steps()

    def _those_that_feel(self):
        if self._weighing and self._chosen is None:
            return np.flatnonzero(self.model.body_mass > 0.0).astype(np.int64)
        return checks.bodies(self.model, self._chosen)

    def _introduce(self):
        """Make the entry by which native code knows it."""
        act, watched = self._evaluator.native, self._watch.rows
        flags = {"weightless": self.keep_gravity is False, "touching": self.contact is not None}
        self.entry = entries.entry_of(self.model, self.mark, *act, watched, self._told, **flags)
        self._outgrown.append((self._watch, self._evaluator.plan, self._evaluator.head, self.entry))
        entries.set_mark(self.model._address, self.mark)
        if ownership.renew(self):
            del self._outgrown[:-1]

    def _planned(self):
        tables = self._gravity, self._surface
        return plan_of(self.model, self.bodies, self.accuracy, self.contact, *tables, weighing=self._weighing)

    # As a context

    def __enter__(self) -> "FieldForces":
        model = self.model
        checks.own_data(model, self.data)
        checks.state(self.data)
        checks.options(model)
        checks.timestep(model, backwards=self.contact is None)
        checks.gravity(model, self.keep_gravity)
        self.refresh()
        found = self._surveyed(self.data)
        checks.finite(model, self.bodies, np.hstack([found, self._at_centers()]))
        self._warn_of_long_steps()
        self._warn_of_start_inside(found)
        try:
            ownership.begin(self)
            if self.keep_gravity is False:
                self._own_gravity = model.opt.gravity.copy()
                model.opt.gravity[:] = OFF
        except InputError:
            raise
        except BaseException:  # an interrupt: there will be no exit
            self.__exit__(*sys.exc_info())
            raise
        return self

    def warn_of_start(self) -> None:
        """Tell of what is inside of a surface now: its data was reset."""
        self._warn_of_start_inside(self._surveyed(self.data))

    def _warn_of_start_inside(self, found):
        words = notices.start_inside(self.model, self._evaluator.plan, found, self.contact)
        if words:
            warnings.warn(f"FieldForces: {words}", FieldsimWarning, stacklevel=3)

    def _warn_of_long_steps(self):
        words = notices.too_long_steps(self.model, self._evaluator.plan, self.contact)
        if words:
            warnings.warn(f"FieldForces: {words}", FieldsimWarning, stacklevel=3)

    def __exit__(self, *failure: object) -> None:
        gravity = self.model.opt.gravity
        if self._own_gravity is not None:
            # Unless the user set another one within.
            if not gravity.any() and np.signbit(gravity).all():
                gravity[:] = self._own_gravity
            self._own_gravity = None
        found = ownership.end(self)
        (unlike, heavy), self._told[:] = self._told.tolist(), 0
        failed, self._failure = self._failure, None
        if failed and not any(failure):
            raise failed
        if not any(failure):
            displaced, twins, heirs = found
            others, strangers = bool(self._other_bodies()), bool(twins or heirs)
            off = notices.field_off(self.model, displaced=displaced, others=others, strangers=strangers)
            for words in [off, *notices.unlike_copies(unlike, heavy)]:
                if not words:
                    continue
                warnings.warn(f"FieldForces: {words}", FieldsimWarning, stacklevel=2)

    @contextlib.contextmanager
    def running(self) -> Generator["FieldForces", None, None]:
        """Active within, whether or not it was already."""
        if ownership.active(self):
            self.refresh()
            yield self
        else:
            with self:
                yield self

    # For the callback

    @property
    def running_natively(self) -> bool:
        """Whether it is active now without any Python."""
        return ownership.active(self) and ownership.is_native(self)

    @property
    def free_of_python(self) -> bool:
        """Whether native code alone can do it."""
        return self._evaluator.free_of_python

    def act(self, data: mujoco.MjData) -> None:
        """Add the forces to data.qfrc_passive; positions and velocities must be up to date. MuJoCo's stages do this."""
        data = self._own(data)
        self.act_at(data.model._address, data._address)

    def act_at(self, model: int, data: int) -> None:
        """The same for the addresses of its model, or a copy, and the data; sees what was changed."""
        with self._lock:
            if model != self.model._address:
                self._told[0] += self._watch.differs(model)
            elif self._watch.changed(thorough=False):
                self._renew()
            self._evaluator.add(model, data)

    def act_apart(self, model: int, data: int) -> None:
        """The same in a thread of MuJoCo's, where an error ends the process: the state blows up, the block fails."""
        try:
            self.act_at(model, data)
        except Exception as reason:
            self._failure = reason
            self._evaluator.spoil(model, data)

    # Questions

    def _surveyed(self, data, plan=None):
        """What is found of the bodies, (n, FOUND_WIDTH), at the state of `data`; brings the scratch there."""
        with self._lock:
            self.refresh()
            model = data.model
            self._refuse_unlike(model)
            self._scratch = _of_model(model, self._scratch)
            copy_state(model, data, self._scratch)
            found = np.full((len(self.bodies), FOUND_WIDTH), np.nan)
            self._evaluator.add(model._address, self._scratch._address, found, plan)
            return found

    def _refuse_unlike(self, model):
        if model._address != self.model._address and self._watch.differs(model._address):
            raise InputError(
                "FieldForces: this data's model is a copy with other masses or shapes; make a FieldForces of it"
            )

    def _at_centers(self):
        """The same with every body's mass at its centre, now: points around it may miss a field singular there."""
        self.refresh()
        return self._surveyed(self.data, at_centers(self._evaluator.plan))

    def wrenches(self, data: mujoco.MjData | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Forces (n, 3) and torques about the centres of mass (n, 3), world frame, on `bodies` now."""
        found = self._surveyed(self._own(data))
        return found[:, :3].copy(), found[:, 3:6].copy()

    def potential_energy(self, data: mujoco.MjData | None = None) -> float:
        """Potential energy of the bodies in the fields and their contacts, now."""
        return float(self._surveyed(self._own(data))[:, [FIELD_ENERGY, CONTACT_ENERGY]].sum())

    def energy(self, data: mujoco.MjData | None = None) -> ModelEnergy:
        """All energies now."""
        data = self._own(data)
        with self._lock:
            found = self._surveyed(data)
            kinetic, own = own_energies(data.model, self._scratch)
        return ModelEnergy(data.time, kinetic, own, *found[:, [FIELD_ENERGY, CONTACT_ENERGY]].sum(axis=0).tolist())

    def readings(self, data: mujoco.MjData | None = None) -> np.ndarray:
        """What the model's sensors read (nsensordata,) now, with the field as gravity, as `mujoco.mj_forward` would.

        Accelerometers and the linear accelerations of frames have the field's at their place taken off, force and
        torque sensors its pull and its surfaces' push on what they hold; a potential energy counts both. Sensors
        that cannot be corrected (see the warning) read what MuJoCo gives. mj_step leaves in data.sensordata what
        was read at its beginning. With `bodies` given, sensors on others read without the field.
        """
        data = self._own(data)
        with self._lock:
            self.refresh()
            self._refuse_unlike(data.model)
            self._sensed = _of_model(data.model, self._sensed)
            return sensors.readings(self, data, self._sensed)

    def gravity_at(self, points: ArrayLike, time: RealLike | None = None) -> np.ndarray:
        """Accelerations (N, 3) by the field's gravity at points (N, 3) of the world, default at data.time."""
        points = validate.points("FieldForces.gravity_at", "points", points)
        if not len(self._gravity):
            return np.zeros_like(points)
        time = self.data.time if time is None else validate.number("FieldForces.gravity_at", "time", time)
        return Field.of_elements(self._gravity.elements(time)).gradient(points)

    def felt_by(self, body: int) -> bool:
        """Whether a body, or what is fixed to it, feels the field; unless chosen, every one does."""
        welds = self.model.body_weldid
        return self._chosen is None or bool(np.any(welds[self.bodies] == welds[body]))

    def hanging(self, data: mujoco.MjData) -> np.ndarray:
        """Torque and force (nbody, 6) of field and contact on each body and all that hangs on it.

        World frame, about the centre of mass of the whole tree, as MuJoCo's cfrc_int; what gravcomp compensates counts.
        """
        return subtree_wrenches(data, self._whole.bodies, self._whole._surveyed(data))

    @functools.cached_property
    def _whole(self):
        """The same forces on all that has mass, also where it is fixed or compensated: its weight."""
        whole = shallow(self)
        whole._weighing, whole._outgrown, whole._evaluator = True, [], shallow(self._evaluator)
        whole._renew()
        return whole

    def _own(self, data):
        """The data meant: its own, or one of this model or of a copy, with a finite state."""
        data = self.data if data is None else data
        if not (isinstance(data, mujoco.MjData) and entries.is_copy(self.entry, data.model._address)):
            checks.own_data(self.model, data)
        checks.state(data)
        return data


def _of_model(model, data):
    """The data, if it is of the model, or another one that is."""
    return data if data.model._address == model._address else mujoco.MjData(model)
