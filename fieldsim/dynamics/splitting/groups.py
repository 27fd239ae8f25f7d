"""Groups of particles that are moved together: as many as a processor's instructions take numbers at once.

A group is a matrix of one column a particle, three rows each for its position, velocity, their rests and its
acceleration (see `State`), so that what is done to all becomes vector instructions. A thread of a GPU, which has
threads enough, moves a group of one particle.
"""

import functools
from typing import Any

import warp as wp

from fieldsim.dynamics.state import State
from fieldsim.launch import launch
from fieldsim.numerics.running_sums import added

# Particles of a group on a CPU, two vectors' worth, so that one is computed while the other waits; and on a GPU.
LANES = 16
ALONE = 1
# First rows of a group's vectors.
X, V, X_REST, V_REST, A = (wp.constant(3 * k) for k in range(5))
ROWS = 15


def lanes_of(device) -> int:
    """How many particles a group has on a device."""
    return ALONE if device.is_cuda else LANES


def launch_groups(kernel, count: int, inputs, outputs=(), *, device, threads=None) -> None:
    """Run a kernel over the groups of `count` particles (see `launch`)."""
    launch(kernel, -(-count // lanes_of(device)), inputs, outputs, device=device, grain=2, threads=threads)


@functools.cache
def vectors(lanes: int):
    """The Warp matrix (3, lanes) of one vector of each particle."""
    return wp.types.matrix((3, lanes), wp.float64)


@functools.cache
def group_of(lanes: int):
    """The Warp matrix of so many particles."""
    return wp.types.matrix((ROWS, lanes), wp.float64)


@functools.cache
def load_of(lanes: int):
    """Warp function (state, first, count) -> a group of the `count` particles from `first` on; the last fills it."""
    Group = group_of(lanes)

    @wp.func
    def load(state: State, first: int, count: int):
        group = Group()
        for k in range(wp.int32(lanes)):  # no constant, for which Warp would write the loop out
            i = first + wp.min(k, count - 1)
            x = state.x[i]
            v = state.v[i]
            x_rest = state.x_rest[i]
            v_rest = state.v_rest[i]
            a = state.a[i]
            for c in range(3):
                group[X + c, k] = x[c]
                group[V + c, k] = v[c]
                group[X_REST + c, k] = x_rest[c]
                group[V_REST + c, k] = v_rest[c]
                group[A + c, k] = a[c]
        return group

    return load


@functools.cache
def store_of(lanes: int):
    """Warp function (group, state, first, count): the particles of a group back to the state."""
    Group = group_of(lanes)

    @wp.func
    def store(group: Group, state: State, first: int, count: int):
        for k in range(count):
            i = first + k
            state.x[i] = column(group, X, k)
            state.v[i] = column(group, V, k)
            state.x_rest[i] = column(group, X_REST, k)
            state.v_rest[i] = column(group, V_REST, k)
            state.a[i] = column(group, A, k)

    return store


@wp.func
def column(group: Any, row: int, k: int):
    """A vector of particle k, which begins at a row."""
    return wp.vec3d(group[row, k], group[row + 1, k], group[row + 2, k])


@functools.cache
def rows_of(lanes: int):
    """Warp function (group, row) -> the vectors that begin at a row, (3, lanes)."""
    Group, matrix = group_of(lanes), vectors(lanes)

    @wp.func
    def rows(group: Group, row: int):
        found = matrix()
        for c in range(3):
            found[c] = group[row + c]
        return found

    return rows


@functools.cache
def replace_of(lanes: int):
    """Warp function (group, k, other) that makes particle k of a group that of another group."""
    Group = group_of(lanes)

    @wp.func
    def replace(group: wp.ref[Group], k: int, other: wp.ref[Group]):
        for c in range(wp.int32(ROWS)):
            group[c, k] = other[c, k]

    return replace


@functools.cache
def place_of(lanes: int):
    """Warp function (group, k, x, v, a) that gives particle k another motion, without rests."""
    Group = group_of(lanes)

    @wp.func
    def place(group: wp.ref[Group], k: int, x: wp.vec3d, v: wp.vec3d, a: wp.vec3d):
        for c in range(3):
            group[X + c, k] = x[c]
            group[V + c, k] = v[c]
            group[X_REST + c, k] = wp.float64(0.0)
            group[V_REST + c, k] = wp.float64(0.0)
            group[A + c, k] = a[c]

    return place


@functools.cache
def kicked_of(lanes: int):
    """Warp function (group, kick) -> the group with its velocities changed by (3, lanes)."""
    Group, matrix = group_of(lanes), vectors(lanes)
    rows = rows_of(lanes)

    @wp.func
    def kicked(group: Group, kick: matrix):
        v, v_rest = added(rows(group, V), rows(group, V_REST), kick)
        for c in range(3):
            group[V + c] = v[c]
            group[V_REST + c] = v_rest[c]
        return group

    return kicked
