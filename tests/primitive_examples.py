"""An example of every primitive, and samples of it that know nothing of rows."""

import math

import numpy as np
from scipy.spatial.transform import Rotation

import fieldsim as fs
from fieldsim.potentials import registry
from fieldsim.potentials.row import FIRST, KERNEL_WIDTH, ROW_WIDTH

A, B, C = (0.4, -0.3, 0.2), (1.6, 0.5, -0.4), (-0.2, 1.1, 0.9)
NORMAL, START = (0.3, -0.5, 0.8), (1.0, 0.2, 0.1)
PROFILE = fs.profile.polynomial(0.5, 2.0, -3.0)
EXAMPLES = [
    fs.Point(A),
    fs.Segment(A, B),
    fs.TaperedSegment(A, B, 0.5, 2.0),
    fs.ProfiledSegment(A, B, PROFILE),
    fs.Arc(A, NORMAL, START, 0.7, 4.0),
    fs.Arc(A, NORMAL, START, 0.7, 0.9),
    fs.ProfiledArc(A, NORMAL, START, 0.7, 2.0, PROFILE),
    fs.Circle(A, NORMAL, 0.7),
    fs.Triangle(A, B, C),
    fs.Face(A, B, C, (0.1, 0.2, -0.8), 2.0),
    fs.Plane(A, NORMAL),
]
FINITE = [primitive for primitive in EXAMPLES if not primitive.endless]
TOUCHED = [primitive for primitive in EXAMPLES if primitive.distance is not None]
# Steps along each parameter of the samples.
STEPS = {0: 1, 1: 4000, 2: 300}


def named(primitive):
    return type(primitive).__name__


def kernel_of(primitive):
    """A kernel that the primitive has a formula for."""
    kernel = next(kernel for kernel, kind in registry.FORMULAS if kind is type(primitive))
    return kernel() if kernel is fs.Newtonian else kernel(1.0)


def row_of(primitive):
    row = np.full(ROW_WIDTH, np.nan)
    row[KERNEL_WIDTH] = 0.0
    primitive.pack(row)
    return row


def on(primitive, u, v):
    """Points (N, 3) of a primitive at parameters (N,), from its fields alone."""
    u, v = u[:, None], v[:, None]
    if hasattr(primitive, "position"):
        return np.broadcast_to(primitive.position, (len(u), 3))
    if hasattr(primitive, "end"):
        return (1 - u) * primitive.start + u * np.array(primitive.end)
    if hasattr(primitive, "radius"):
        start = np.array(primitive.start) if hasattr(primitive, "start") else row_of(primitive)[FIRST]
        turns = Rotation.from_rotvec(u * getattr(primitive, "angle", math.tau) * primitive.normal)
        return primitive.center + primitive.radius * turns.apply(start)
    a, b, c = (np.array(corner) for corner in (primitive.a, primitive.b, primitive.c))
    return a + u * (b - a) + v * (c - a)


def cells(primitive):
    """Samples (N, 3) at the middles of equal shares of the parameters, and what part of the measure each stands for."""
    dimension = 2 if hasattr(primitive, "a") else primitive.dimension
    steps = STEPS[dimension]
    middles = (np.arange(steps) + 0.5) / steps
    u, v = (side.ravel() for side in np.meshgrid(middles, middles if dimension == 2 else [0.0], indexing="ij"))
    # A triangle narrows along u.
    narrow = 1.0 - u
    points = on(primitive, u, narrow * v)
    if dimension == 0:
        return points, np.ones(1)
    if dimension == 1:
        ends = on(primitive, np.linspace(0, 1, steps + 1), np.zeros(steps + 1))
        shares = np.linalg.norm(np.diff(ends, axis=0), axis=1)
        if hasattr(primitive, "start_density"):
            shares *= primitive.start_density + u * (primitive.end_density - primitive.start_density)
        return points, shares
    a, b, c = (np.array(corner) for corner in (primitive.a, primitive.b, primitive.c))
    across = np.cross(b - a, c - a)
    if hasattr(primitive, "center"):
        # Of a solid: cones from the centre.
        return points, (points - primitive.center) @ across * narrow / 3.0 / len(points)
    return points, np.linalg.norm(across) * narrow / len(points)


def around(primitive, count, size, seed=3):
    """Points (count, 3) from very near to some `size` away from random places on a primitive."""
    rng = np.random.default_rng(seed)
    u, v = rng.random((2, count))
    u, v = np.where(u + v > 1.0, (1.0 - u, 1.0 - v), (u, v))
    places = np.broadcast_to(A, (count, 3)) if primitive.endless else on(primitive, u, v)
    return places + size * rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-2, 0, (count, 1))
