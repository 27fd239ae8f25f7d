"""Signed distances of hard shapes in float64, written from what the shapes are, not from how rays meet them."""

import numpy as np


def ball(p, radius):
    return np.linalg.norm(p, axis=-1) - radius


def ellipsoid(p, radii):
    """First order near the surface: the implicit function over its slope."""
    radii = np.asarray(radii)
    k = np.linalg.norm(p / radii, axis=-1)
    return k * (k - 1.0) / np.linalg.norm(p / radii**2, axis=-1)


def box(p, half):
    q = np.abs(p) - half
    return np.linalg.norm(np.maximum(q, 0.0), axis=-1) + np.minimum(q.max(axis=-1), 0.0)


def cylinder(p, radius, half):
    return box(np.stack([np.linalg.norm(p[..., :2], axis=-1), p[..., 2]], axis=-1), np.array([radius, half]))


def segment(p, start, end, radius):
    start, along = np.asarray(start), np.subtract(end, start)
    u = np.clip((p - start) @ along / (along @ along), 0.0, 1.0)
    return np.linalg.norm(p - start - u[..., None] * along, axis=-1) - radius


def arc(p, ring, angle, radius):
    """Arc about z from angle 0 on the x axis."""
    middle = 0.5 * angle
    theta = (np.arctan2(p[..., 1], p[..., 0]) - middle + np.pi) % (2 * np.pi) - np.pi
    theta = middle + np.clip(theta, -middle, middle)
    nearest = ring * np.stack([np.cos(theta), np.sin(theta), 0 * theta], axis=-1)
    return np.linalg.norm(p - nearest, axis=-1) - radius


def triangle(p, a, b, c, radius):
    a, b, c = map(np.asarray, (a, b, c))
    edges = np.minimum(segment(p, a, b, 0.0), np.minimum(segment(p, b, c, 0.0), segment(p, c, a, 0.0)))
    # Barycentric coordinates of the projection tell whether it lies inside.
    uv = np.linalg.lstsq(np.stack([b - a, c - a], axis=1), (p - a).reshape(-1, 3).T, rcond=None)[0]
    inside = ((uv > 0).all(axis=0) & (uv.sum(axis=0) < 1)).reshape(p.shape[:-1])
    normal = np.cross(b - a, c - a)
    return np.where(inside, np.abs((p - a) @ normal) / np.linalg.norm(normal), edges) - radius


def plane(p, half):
    return np.abs(p[..., 2]) - half


def placed(distance, pose):
    """The distance to a shape that has a pose."""
    return lambda p: distance((p - np.asarray(pose.position)) @ pose.matrix)


def gradient(distance, p, step=1e-5):
    """Unit gradients (..., 3) by central differences."""
    offsets = step * np.eye(3)
    slopes = np.stack([distance(p + e) - distance(p - e) for e in offsets], axis=-1)
    return slopes / np.linalg.norm(slopes, axis=-1, keepdims=True)
