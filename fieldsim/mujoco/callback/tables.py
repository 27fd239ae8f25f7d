"""What the callback works on: plain arrays, the same for its native and its Python form."""

import dataclasses
import functools
import math
import typing
from collections.abc import Callable, Sequence

import numpy as np

from fieldsim import validate
from fieldsim.dynamics.refusals import refuse
from fieldsim.errors import InputError
from fieldsim.mujoco.callback.field_callbacks import LENGTHS, pull_sums, sum_of, values_of
from fieldsim.mujoco.callback.pulls import INPUTS
from fieldsim.mujoco.callback.rows import (
    AXIS,
    BODY_WIDTH,
    CENTER,
    FEET,
    FOUND_WIDTH,
    INSIDE,
    MOTION,
    PHASE,
    PLACED_WIDTH,
    PULL_WIDTH,
    RADIUS,
    RATE,
    REACH,
    SHIFT,
    SPINS,
    STARTS,
    TOUCHED,
    TURN,
    TURNED_WIDTH,
    WEIGHT,
)
from fieldsim.mujoco.contact.rows import CONTACT, HIT
from fieldsim.mujoco.contact.starts import starts_of
from fieldsim.portable.lanes.words import length_of
from fieldsim.potentials import registry
from fieldsim.potentials.bounds.reach import reach
from fieldsim.potentials.elements import Elements, concatenate
from fieldsim.potentials.field import Field
from fieldsim.sources.elements import elements_of
from fieldsim.sources.surface_velocity import twist_rate
from fieldsim.world.body import Body
from fieldsim.world.motion import Pose, Spin, pose_at
from fieldsim.world.world import World

# Words of a call of the pull in lanes, with the one that is the others' address.
WORDS = 1 + length_of(INPUTS)
# What a user gives as sources: one or several.
SourcesLike: typing.TypeAlias = Field | Body | World | Sequence[Field | Body | World]


class Source(typing.NamedTuple):
    """Elements in one role.

    rows (N, >= ROW_WIDTH), kinds (N,): see `potentials.elements`. groups (G, 3), of rows that move together,
    and motions (G, 14), how: see `mujoco.callback.rows`.
    field, jet, margin, weight, foot, pull, force: addresses of C functions, see `field_callbacks` (0: not needed).
    """

    rows: np.ndarray
    kinds: np.ndarray
    groups: np.ndarray
    motions: np.ndarray
    field: int | Callable
    jet: int | Callable
    margin: int | Callable
    weight: int | Callable
    foot: int | Callable
    pull: int | Callable
    force: int | Callable


class Plan(typing.NamedTuple):
    """Which bodies feel what.

    bodies (n,): their ids. Of every body (nbody,): places, where it is among those, or -1; roots, of its tree; parents;
    first_dof (nbody + 1,): its own degrees of freedom are first_dof[b] to first_dof[b + 1] - 1.
    points (4, P): places in the bodies' inertial frames (of accuracy "points" in units of the spread of their mass) and
    shares of the mass, those of body k from first_point[k], which point_bodies (P,) has at each; the last is repeated
    until there are as many as whole vectors take.
    geoms, samples and faces: see `mujoco.contact.rows`, the geoms of body k from first_geom[k]; reach (n,): of all of
    them, from the centre of mass; law: see `mujoco.callback.rows`. Of every body (nbody,): alone, whether it moves
    freely and nothing is joined to it. most (2,): how many hits there may be, and contacts of one geom.
    """

    bodies: np.ndarray
    places: np.ndarray
    roots: np.ndarray
    parents: np.ndarray
    first_dof: np.ndarray
    first_point: np.ndarray
    points: np.ndarray
    point_bodies: np.ndarray
    first_geom: np.ndarray
    geoms: np.ndarray
    samples: np.ndarray
    faces: np.ndarray
    reach: np.ndarray
    law: np.ndarray
    alone: np.ndarray
    most: np.ndarray
    gravity: Source
    surface: Source


class Views(typing.NamedTuple):
    """The parts of an mjData and its mjModel that the callback reads (qfrc_passive it writes), seen live."""

    time: float
    xipos: np.ndarray
    ximat: np.ndarray
    subtree_com: np.ndarray
    cdof: np.ndarray
    cvel: np.ndarray
    qfrc_passive: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    gravcomp: np.ndarray
    timestep: float
    model: int
    data: int


class Room(typing.NamedTuple):
    """Scratch of one evaluation.

    gravity_turns, surface_turns (G, TURNED_WIDTH): of the groups. frames (n, BODY_WIDTH), pulls (n, PULL_WIDTH), placed
    (PLACED_WIDTH, P), pulled (PULL_WIDTH, P): of bodies and points, see `mujoco.callback.rows`; words (WORDS,): of the
    pull in lanes. subtree_wrench (nbody, 6): torque and force on each body's subtree. pushes (n, FOUND_WIDTH): what
    contacts do to each body. hits and contacts: see `mujoco.contact.rows`. loads (nbody,): of contacts, by root.
    efforts, answers (nv,): generalised forces, and accelerations by them.
    """

    gravity_turns: np.ndarray
    surface_turns: np.ndarray
    frames: np.ndarray
    pulls: np.ndarray
    placed: np.ndarray
    pulled: np.ndarray
    words: np.ndarray
    subtree_wrench: np.ndarray
    pushes: np.ndarray
    hits: np.ndarray
    contacts: np.ndarray
    loads: np.ndarray
    efforts: np.ndarray
    answers: np.ndarray


def room_shapes(plan: "Plan", bodies: int, dofs: int) -> tuple[tuple[int, ...], ...]:
    """Shapes of the arrays of a `Room`."""
    return (
        (len(plan.gravity.groups), TURNED_WIDTH),
        (len(plan.surface.groups), TURNED_WIDTH),
        (len(plan.bodies), BODY_WIDTH),
        (len(plan.bodies), PULL_WIDTH),
        (PLACED_WIDTH, plan.points.shape[1]),
        (PULL_WIDTH, plan.points.shape[1]),
        (WORDS,),
        (bodies, 6),
        (len(plan.bodies), FOUND_WIDTH),
        (int(plan.most[0]), HIT.width),
        (int(plan.most[1]), CONTACT.width),
        (bodies,),
        (dofs,),
        (dofs,),
    )


@dataclasses.dataclass(frozen=True)
class _Part:
    """One source in one role: its elements at a time, and its motion."""

    elements: Callable[[float], Elements]
    motion: Pose | Callable[[float], Pose]
    deforming: bool
    radius: Callable[[float], float] = lambda time: math.nan

    @property
    def spins(self):
        return isinstance(self.motion, Spin) and not self.deforming

    @property
    def timed(self):
        """Whether only Python knows how it moves."""
        return self.deforming or (callable(self.motion) and not self.spins)

    def placed(self, time):
        """Its elements in the world's frame; of one that spins, in its own."""
        return self.elements(time) if self.spins else self.in_world(time)

    def in_world(self, time):
        """Its elements in the world's frame, also of one that spins."""
        local, pose = self.elements(time), pose_at(self.motion, time)
        return local.placed(pose.matrix, pose.position)


class SourceTable:
    """The sources in one role ("gravity" or "surface"), as arrays that stay where they are.

    needs: names of its sums; accuracy: of its pull, if it is to have one. `at(time)` renews, in place, the rows of
    those that only Python can move.
    """

    def __init__(self, sources, role: str, time: float, needs=(), native: bool = True, accuracy=None):
        self.role = role
        parts = [part for part in (_part(source, role) for source in sources) if part and len(part.elements(time))]
        # What neither moves nor needs Python, as one group; then what spins; then what Python moves.
        self._parts = parts
        still = [part for part in parts if not (part.spins or part.timed)]
        spinning = [part for part in parts if part.spins]
        self._timed = [part for part in parts if part.timed]
        chunks = [part.placed(time) for part in still]
        radii = [np.full(len(chunk), part.radius(time)) for part, chunk in zip(still, chunks, strict=True)]
        if still:
            whole, by = concatenate(chunks).grouped()
            chunks, radii = [whole], [np.concatenate(radii)[by]]
        chunks += [part.placed(time) for part in (*spinning, *self._timed)]
        radii += [np.full(len(part.elements(time)), part.radius(time)) for part in (*spinning, *self._timed)]
        whole = concatenate(chunks)
        self._total = len(whole)
        sums = [sum_of(name, whole.kinds_used, native) if name in needs and self._total else 0 for name in LENGTHS]
        self.arrays = Source(
            self._bounded(whole.rows, whole.kinds, np.concatenate([np.zeros(0), *radii])),
            whole.kinds,
            *_groups(chunks, spinning, bool(still)),
            *sums,
            *(pull_sums(accuracy, whole.kinds_used, native) if accuracy and self._total else (0, 0)),
        )
        for first, count, _ in self.arrays.groups.tolist():
            self._start_inside(first, count)
        self._time = None
        self.at(time)

    def __len__(self) -> int:
        return self._total

    @property
    def timed(self) -> bool:
        """Whether some rows are functions of time that only Python knows."""
        return bool(self._timed)

    def elements(self, time: float):
        """All of them in the world's frame at `time`."""
        return concatenate([part.in_world(time) for part in self._parts])

    def _bounded(self, rows, kinds, radius):
        """Rows with their reach, radius and feet where contact needs them."""
        if self.role != "surface":
            return rows
        table = np.zeros((len(rows), TOUCHED.width))
        table[:, : rows.shape[1]] = rows
        table[:, REACH] = reach(rows, kinds, 1.0 / max(self._total, 1))
        table[:, RADIUS], table[:, WEIGHT] = radius, radius**-3.0
        for formula, which in registry.parts_of(kinds) if len(kinds) else ():
            table[which, FEET] = len(formula.primitive.feet)
        return table

    def _start_inside(self, first, count):
        """Write into the rows of a group where searches begin inside its elements."""
        if self.role != "surface":
            return
        rows, kinds = self.arrays.rows[first : first + count], self.arrays.kinds[first : first + count]
        total = values_of(self.arrays.field, self.arrays.rows, self.arrays.kinds, first, count)
        rows[:, STARTS], places = starts_of(rows, kinds, total)
        rows[:, INSIDE] = places.reshape(count, -1)

    def at(self, time: float) -> None:
        """Bring the rows that only Python can move to `time`."""
        if not self._timed or time == self._time:
            return
        self._time = None  # where a motion fails, the rows are of no time
        groups, motions = (table[-len(self._timed) :] for table in (self.arrays.groups, self.arrays.motions))
        for part, (first, count, _), motion in zip(self._timed, groups.tolist(), motions, strict=True):
            placed = part.placed(time)
            if not np.array_equal(placed.kinds, self.arrays.kinds[first : first + count]):
                raise InputError(
                    f"FieldForces: a source has other elements at time {time:g} ({len(placed)}) than at first "
                    f"({count}); give one that keeps them, such as with strengths that go to 0"
                )
            radius = np.full(count, part.radius(time))
            self.arrays.rows[first : first + count] = self._bounded(placed.rows, placed.kinds, radius)
            self._start_inside(first, count)
            motion[TURN.start : SHIFT.stop] = twist_rate(part.motion, time)
        self._time = time


def _part(source, role):
    """A source's part in a role, or None where it has none."""
    if isinstance(source, Field):
        if role != "gravity":
            return None
        return _Part(lambda time: source.at(time).elements, pose_at((0, 0, 0), 0.0), source.animated)
    if (source.gravity if role == "gravity" else source.surface) is None:
        return None
    elements = functools.partial(elements_of, source, role)
    if role == "gravity":
        return _Part(elements, source.motion, source.deforming)
    return _Part(elements, source.motion, source.deforming, lambda time: source.surface.at(time).radius)


def _groups(chunks, spinning, first):
    """Tables of groups (G, 3) and their motions (G, 14); see `Source`. first: of those that spin."""
    counts = [len(chunk) for chunk in chunks]
    groups = np.column_stack([np.cumsum([0, *counts])[:-1], counts, np.zeros(len(chunks))]).astype(np.int64)
    motions = np.zeros((len(chunks), MOTION.width))
    groups[first : first + len(spinning), SPINS] = 1
    for motion, part in zip(motions[first:], spinning, strict=False):
        spin = part.motion
        motion[AXIS], motion[CENTER] = spin.axis, spin.center
        motion[RATE], motion[PHASE] = spin.rate, spin.phase
        motion[TURN.start : SHIFT.stop] = twist_rate(spin, 0.0)
    return groups, motions


def given_sources(sources: SourcesLike) -> tuple:
    """What a user gave as sources: one or several."""
    remedy = "give a fs.Field, fs.Body or fs.World, or a list of them"
    single = isinstance(sources, Field | Body | World)
    return (sources,) if single else validate.listed("FieldForces", "sources", sources, remedy)


def sources_of(sources: SourcesLike) -> tuple:
    """Fields and bodies of what a user gave as sources: one or a sequence of Field, Body and World."""
    found = []
    for index, source in enumerate(given_sources(sources)):
        if isinstance(source, World):
            refuse("FieldForces", "MuJoCo", source)
            found += source.bodies
        elif isinstance(source, Field | Body):
            found.append(source)
        else:
            raise InputError(
                f"FieldForces: sources[{index}] is {validate.shown(source)}; give a fs.Field, fs.Body or fs.World"
            )
    if not found:
        raise InputError("FieldForces: there are no sources; give at least one fs.Field or fs.Body")
    for source in found:
        if isinstance(source, Body) and source.free:
            raise InputError(
                f"FieldForces: {source.name or 'a body'} has the motion fs.Rigid, which only fs.Simulation can move; "
                "give a fs.Pose, fs.Spin, fs.Keyframes or a function of time, or make it a body of the MuJoCo model"
            )
    return tuple(found)
