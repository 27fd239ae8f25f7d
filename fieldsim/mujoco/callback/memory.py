"""Arrays of plans and of MuJoCo's structs, found by native code at the addresses it is handed.

A plan's arrays are listed in a *head*: one row (address, length, length of a row) per array, in the order of `Plan`;
those of a source are followed by three rows with the addresses of its sums.
"""

import ctypes
import functools

import numba
import numpy as np
from numba import types

from fieldsim.dynamics.contact.laws import coulomb, pressed
from fieldsim.dynamics.contact.nearest import curvatures, nearest_step, shortened
from fieldsim.mujoco.callback import layout
from fieldsim.mujoco.callback.addresses import address_of, allocate, doubles, halves, library, release, words
from fieldsim.mujoco.callback.generalised_forces import actor
from fieldsim.mujoco.callback.rows import BODY_WIDTH, FOUND_WIDTH, PLACED_WIDTH, PULL_WIDTH, TURNED_WIDTH
from fieldsim.mujoco.callback.tables import WORDS, Plan, Room, Source, Views
from fieldsim.mujoco.contact.rows import CONTACT, HIT
from fieldsim.native import NativeFunction, inner, native_function, place_of
from fieldsim.numerics.rotations import rotation

PLACES = layout.offsets()
_TIME, _XIPOS, _XIMAT, _SUBTREE_COM, _CDOF, _CVEL, _QFRC_PASSIVE = (PLACES[name] for name in layout.FIELDS)
_MASS, _INERTIA, _GRAVCOMP = (PLACES[name] for name in layout.MODEL_FIELDS[3:])
_TIMESTEP = PLACES["timestep"]
_HIT_WIDTH, _CONTACT_WIDTH = HIT.width, CONTACT.width

# `acting`'s function for Python: it holds on to the lock that guards Python's tables.
LOCKED = ctypes.PYFUNCTYPE(None, *[ctypes.c_void_p] * 4)


@inner
def _table(head, i):
    return numba.carray(doubles(head[i, 0]), (head[i, 1], head[i, 2]))


@inner
def _column(head, i):
    return numba.carray(doubles(head[i, 0]), (head[i, 1],))


@inner
def _indices(head, i):
    return numba.carray(words(head[i, 0]), (head[i, 1],))


@inner
def _numbers(head, i):
    return numba.carray(words(head[i, 0]), (head[i, 1], head[i, 2]))


@inner
def _kinds(head, i):
    return numba.carray(halves(head[i, 0]), (head[i, 1],))


@inner
def _source(head, i):
    sums = head[i + 4]
    more = head[i + 5]
    last = head[i + 6]
    return Source(
        _table(head, i),
        _kinds(head, i + 1),
        _numbers(head, i + 2),
        _table(head, i + 3),
        sums[0],
        sums[1],
        sums[2],
        more[0],
        more[1],
        more[2],
        last[0],
    )


HEAD = 30


@inner
def plan_at(address):
    """The plan whose head is at an address."""
    head = numba.carray(words(address), (HEAD, 3))
    return Plan(
        _indices(head, 0),
        _indices(head, 1),
        _indices(head, 2),
        _indices(head, 3),
        _indices(head, 4),
        _indices(head, 5),
        _table(head, 6),
        _kinds(head, 7),
        _indices(head, 8),
        _table(head, 9),
        _table(head, 10),
        _table(head, 11),
        _column(head, 12),
        _column(head, 13),
        _indices(head, 14),
        _indices(head, 15),
        _source(head, 16),
        _source(head, 23),
    )


@inner
def word(address):
    """The whole number at an address."""
    return numba.carray(words(address), (1,))[0]


@inner
def double(address):
    """The number at an address."""
    return numba.carray(doubles(address), (1,))[0]


@inner
def _array(struct, place, shape):
    """The array whose pointer a struct keeps at a place."""
    return numba.carray(doubles(word(struct + place)), shape)


@inner
def views_of(model, data, bodies, dofs):
    """`views_at` for native code."""
    return Views(
        double(data + _TIME),
        _array(data, _XIPOS, (bodies, 3)),
        _array(data, _XIMAT, (bodies, 9)),
        _array(data, _SUBTREE_COM, (bodies, 3)),
        _array(data, _CDOF, (dofs, 6)),
        _array(data, _CVEL, (bodies, 6)),
        _array(data, _QFRC_PASSIVE, (dofs,)),
        _array(model, _MASS, (bodies,)),
        _array(model, _INERTIA, (bodies, 3)),
        _array(model, _GRAVCOMP, (bodies,)),
        double(model + _TIMESTEP),
        model,
        data,
    )


def views_at(model: int, data: int, bodies: int, dofs: int) -> Views:
    """Views of the structs at two addresses, of so many bodies and degrees of freedom, for Python."""

    def array(address, *shape):
        return np.ctypeslib.as_array(ctypes.cast(ctypes.c_void_p.from_address(address), _DOUBLES), shape)

    return Views(
        ctypes.c_double.from_address(data + _TIME).value,
        array(data + _XIPOS, bodies, 3),
        array(data + _XIMAT, bodies, 9),
        array(data + _SUBTREE_COM, bodies, 3),
        array(data + _CDOF, dofs, 6),
        array(data + _CVEL, bodies, 6),
        array(data + _QFRC_PASSIVE, dofs),
        array(model + _MASS, bodies),
        array(model + _INERTIA, bodies, 3),
        array(model + _GRAVCOMP, bodies),
        ctypes.c_double.from_address(model + _TIMESTEP).value,
        model,
        data,
    )


_DOUBLES = ctypes.POINTER(ctypes.c_double)


def head_of(plan: Plan) -> np.ndarray:
    """The head (HEAD, 3) of a plan, which keeps the arrays alive."""
    rows = [_row(array) for array in plan[:-2]]
    for source in (plan.gravity, plan.surface):
        rows += [*map(_row, source[:4]), source[4:7], source[7:10], (source[10], 0, 0)]
    return np.array(rows, dtype=np.int64)


def _row(array):
    return array.ctypes.data, array.shape[0], array.shape[1] if array.ndim == 2 else 1


@functools.cache
def acting(accuracy: str, contact: bool) -> NativeFunction:
    """C function (addresses of a head, an mjModel, an mjData, and of a place for what is found, or 0); see `actor`."""
    place_of("mj_solveM", address_of(library().mj_solveM))
    name = f"{'touching' if contact else 'pulling'}-{accuracy}"
    return native_function(
        name,
        lambda: _acting(accuracy, contact),
        _SIGNATURE,
        folders=layout.FOLDERS,
        portables=PORTABLES,
        takes=layout.taken(),
    )


# The portable functions in it.
PORTABLES = coulomb, curvatures, nearest_step, pressed, rotation, shortened
_SIGNATURE = types.void(types.intp, types.intp, types.intp, types.intp)


def _acting(accuracy, contact):
    act = actor(accuracy, contact, True)

    def function(head, model, data, place):
        plan = plan_at(head)
        found = numba.carray(doubles(place), (plan.bodies.shape[0] if place else 0, FOUND_WIDTH))
        bodies, dofs = plan.places.shape[0], plan.first_dof[-1]
        # Arrays of numba's own would cost more than a body's force: they are counted and found again one by one.
        work = allocate(_room_in(0, plan, bodies, dofs)[1])
        act(plan, views_of(model, data, bodies, dofs), _room_in(work, plan, bodies, dofs)[0], found)
        release(work)

    return function


@inner
def _rows_of(work, count, width):
    """The next rows of the memory at an address, and where those after them begin."""
    return numba.carray(doubles(work), (count, width)), work + 8 * count * width


@inner
def _room_in(work, plan, bodies, dofs):
    """A `Room` in the memory at an address, and where it ends."""
    gravity_turns, work = _rows_of(work, plan.gravity.groups.shape[0], TURNED_WIDTH)
    surface_turns, work = _rows_of(work, plan.surface.groups.shape[0], TURNED_WIDTH)
    frames, work = _rows_of(work, plan.bodies.shape[0], BODY_WIDTH)
    pulls, work = _rows_of(work, plan.bodies.shape[0], PULL_WIDTH)
    placed, work = _rows_of(work, PLACED_WIDTH, plan.points.shape[1])
    pulled, work = _rows_of(work, PULL_WIDTH, plan.points.shape[1])
    calling, work = numba.carray(words(work), (WORDS,)), work + 8 * WORDS
    subtree_wrench, work = _rows_of(work, bodies, 6)
    pushes, work = _rows_of(work, plan.bodies.shape[0], FOUND_WIDTH)
    hits, work = _rows_of(work, plan.most[0], _HIT_WIDTH)
    contacts, work = _rows_of(work, plan.most[1], _CONTACT_WIDTH)
    loads = numba.carray(doubles(work), (bodies,))
    efforts = numba.carray(doubles(work + 8 * bodies), (dofs,))
    answers = numba.carray(doubles(work + 8 * (bodies + dofs)), (dofs,))
    turns, parts = (gravity_turns, surface_turns), (frames, pulls, placed, pulled, calling)
    room = Room(*turns, *parts, subtree_wrench, pushes, hits, contacts, loads, efforts, answers)
    return room, work + 8 * (bodies + 2 * dofs)


def time_of(data: int) -> float:
    """The time of the mjData at an address."""
    return ctypes.c_double.from_address(data + _TIME).value
