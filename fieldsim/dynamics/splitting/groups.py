"""Groups of particles that are moved together: as many as a processor's instructions take numbers at once.

A group's vectors stand as three rows of coordinates, one column a particle, so that what is done to all of them
becomes vector instructions. A thread of a GPU, which has threads enough, moves a group of one particle.
"""

import functools
from typing import Any

import warp as wp

from fieldsim.dynamics.state import State
from fieldsim.launch import launch
from fieldsim.numerics.running_sums import added

# Particles of a group on a CPU, and on a GPU.
LANES = 8
ALONE = 1


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
    """Warp struct of so many particles of a `State`."""
    matrix = vectors(lanes)

    @wp.struct
    class Group:
        x: matrix
        v: matrix
        x_rest: matrix
        v_rest: matrix
        a: matrix

    return Group


@wp.struct
class Particle:
    """One particle of a `State`."""

    x: wp.vec3d
    v: wp.vec3d
    x_rest: wp.vec3d
    v_rest: wp.vec3d
    a: wp.vec3d


@functools.cache
def load_of(lanes: int):
    """Warp function (state, first, count) -> a group of the `count` particles from `first` on; the last fills it."""
    Group = group_of(lanes)

    @wp.func
    def load(state: State, first: int, count: int):
        group = Group()
        for k in range(lanes):
            i = first + wp.min(k, count - 1)
            x = state.x[i]
            v = state.v[i]
            x_rest = state.x_rest[i]
            v_rest = state.v_rest[i]
            a = state.a[i]
            for c in range(3):
                group.x[c, k] = x[c]
                group.v[c, k] = v[c]
                group.x_rest[c, k] = x_rest[c]
                group.v_rest[c, k] = v_rest[c]
                group.a[c, k] = a[c]
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
            state.x[i] = column(group.x, k)
            state.v[i] = column(group.v, k)
            state.x_rest[i] = column(group.x_rest, k)
            state.v_rest[i] = column(group.v_rest, k)
            state.a[i] = column(group.a, k)

    return store


@wp.func
def column(vectors: Any, k: int):
    """The vector of particle k."""
    return wp.vec3d(vectors[0, k], vectors[1, k], vectors[2, k])


@functools.cache
def particle_of(lanes: int):
    """Warp function (group, k) -> its particle k."""
    Group = group_of(lanes)

    @wp.func
    def particle(group: Group, k: int):
        p = Particle()
        p.x = column(group.x, k)
        p.v = column(group.v, k)
        p.x_rest = column(group.x_rest, k)
        p.v_rest = column(group.v_rest, k)
        p.a = column(group.a, k)
        return p

    return particle


@functools.cache
def replaced_of(lanes: int):
    """Warp function (group, k, particle) -> the group with another particle k."""
    Group = group_of(lanes)

    @wp.func
    def replaced(group: Group, k: int, p: Particle):
        for c in range(3):
            group.x[c, k] = p.x[c]
            group.v[c, k] = p.v[c]
            group.x_rest[c, k] = p.x_rest[c]
            group.v_rest[c, k] = p.v_rest[c]
            group.a[c, k] = p.a[c]
        return group

    return replaced


@functools.cache
def kicked_of(lanes: int):
    """Warp function (group, kick) -> the group with its velocities changed."""
    Group, matrix = group_of(lanes), vectors(lanes)

    @wp.func
    def kicked(group: Group, kick: matrix):
        v, v_rest = added(group.v, group.v_rest, kick)
        group.v = v
        group.v_rest = v_rest
        return group

    return kicked
