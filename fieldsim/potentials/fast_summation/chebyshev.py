"""Chebyshev polynomials on cubes: what moments and local expansions of a fast summation are made of.

On -1..1, with p nodes, the basis is T~_k = sqrt((2 - [k = 0]) / p) T_k for k < p: orthonormal on the nodes, so that
coefficients have the norm of the values at the nodes. On a cube it is their products, p^3 of them.
"""

import functools

import numpy as np


@functools.cache
def nodes(order: int) -> np.ndarray:
    """The zeros of T_order, (order,)."""
    return np.cos(np.pi * (np.arange(order) + 0.5) / order)


@functools.cache
def scales(order: int) -> np.ndarray:
    """What makes T_k orthonormal on the nodes, (order,)."""
    return np.sqrt(np.where(np.arange(order) == 0, 1.0, 2.0) / order)


def basis(x: np.ndarray, order: int) -> np.ndarray:
    """The basis at x (...,), a little beyond -1..1 too: (..., order)."""
    return _polynomials(x, order)[0]


def basis_and_derivatives(x: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The basis at x (...,), its first and its second derivatives, each (..., order)."""
    return _polynomials(x, order, 2)


def _polynomials(x, order, derivatives=0):
    """By the recurrence T_(k+1) = 2 x T_k - T_(k-1), differentiated."""
    found = np.zeros((derivatives + 1, order, *x.shape))
    found[0, 0] = 1.0
    if order > 1:
        found[0, 1] = x
        found[1:2, 1] = 1.0
    twice = 2.0 * x
    for k in range(1, order - 1):
        for d in range(derivatives + 1):
            np.multiply(twice, found[d, k], out=found[d, k + 1])
            found[d, k + 1] -= found[d, k - 1]
            if d:
                found[d, k + 1] += (2.0 * d) * found[d - 1, k]
    found *= scales(order).reshape(-1, *(1,) * x.ndim)
    return tuple(np.moveaxis(found, 1, -1))


@functools.cache
def from_values(order: int) -> np.ndarray:
    """The orthogonal matrix (order, order) that takes values at the nodes to coefficients."""
    return basis(nodes(order), order).T


@functools.cache
def grid(order: int) -> np.ndarray:
    """The nodes of the cube, (order^3, 3)."""
    one = nodes(order)
    return np.stack(np.meshgrid(one, one, one, indexing="ij"), axis=-1).reshape(-1, 3)


@functools.cache
def halves(order: int) -> np.ndarray:
    """(2, order, order): the basis on the lower and upper half of -1..1, as coefficients on that half.

    T~_k((x + side) / 2) = sum over l of halves[side, k, l] T~_l(x).
    """
    return np.stack([basis(0.5 * (nodes(order) + side), order).T @ from_values(order).T for side in (-1.0, 1.0)])


@functools.cache
def child(order: int, octant: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The matrices of `halves` along x, y and z of a cube's octant 0..7 (x is bit 2, z bit 0)."""
    lower, upper = halves(order)
    return tuple(upper if octant >> bit & 1 else lower for bit in (2, 1, 0))


def applied(tensors: np.ndarray, matrices) -> np.ndarray:
    """Tensors (N, p, p, p) with a matrix (q, p) applied along each axis: (N, q, q, q)."""
    for matrix in matrices:
        tensors = _turned(tensors, matrix)
    return tensors


def _turned(tensors, matrix):
    """One matrix applied along the first axis, which becomes the last."""
    count, first = tensors.shape[0], tensors.shape[1]
    flat = tensors.reshape(count, first, tensors.shape[2] * tensors.shape[3])
    return np.matmul(flat.transpose(0, 2, 1), matrix.T).reshape(count, *tensors.shape[2:], len(matrix))


@functools.cache
def kept(order: int) -> np.ndarray:
    """The products of a Euclidean degree of at most `order`, (K,); the others add nothing (Trefethen 2017)."""
    k = np.arange(order)
    squares = k[:, None, None] ** 2 + k[None, :, None] ** 2 + k[None, None, :] ** 2
    return np.flatnonzero(squares.ravel() <= order * order)


@functools.cache
def parities(order: int) -> tuple[np.ndarray, ...]:
    """The kept products by the parities of their degrees: eight indices; x's parity is bit 2, z's bit 0."""
    k = np.stack(np.unravel_index(kept(order), (order,) * 3)) % 2
    which = 4 * k[0] + 2 * k[1] + k[2]
    return tuple(kept(order)[which == parity] for parity in range(8))
