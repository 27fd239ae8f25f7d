"""The surface F = 1 of bodies that may move, sampled on the host: nothing of `fieldsim.dynamics` is used."""

import numpy as np
from contact_scenes import PATCH, skeleton_points

import fieldsim as fs

# Distance between samples, in radii of the material; samples of a plane lie farther apart.
SPACING, PLANE_SPACING = 0.25, 1.25
# Newton's method on log F: greatest number of steps, and how small log F is at its end.
PROJECTIONS, ON_SURFACE = 12, 1e-9


class Surface:
    """The surface F = 1 of all bodies together, at any time."""

    def __init__(self, bodies, seed=0):
        self.bodies = [body for body in bodies if body.surface is not None]
        self.fields = [body.surface_field() for body in self.bodies]
        self._poses = {}
        self.moving = any(body.moving for body in self.bodies)
        self.feature = min(body.surface.radius for body in self.bodies)
        self.seeds = [_seeds(body, np.random.default_rng([seed, k])) for k, body in enumerate(self.bodies)]
        self.owners = np.repeat(np.arange(len(self.seeds)), [len(s) for s in self.seeds])

    def _pose(self, k, time):
        """Rotation (3, 3) and position (3,) of body k."""
        if not self.bodies[k].moving:
            time = 0.0
        if (k, time) not in self._poses:
            pose = self.bodies[k].pose_at(time)
            self._poses[k, time] = pose.matrix, np.array(pose.position)
        return self._poses[k, time]

    def poses(self, k, times):
        """Rotations (N, 3, 3) and positions (N, 3) of body k at times (N,)."""
        unique, inverse = np.unique(times, return_inverse=True)
        matrices, positions = zip(*(self._pose(k, float(t)) for t in unique), strict=True)
        return np.array(matrices)[inverse], np.array(positions)[inverse]

    def value_and_gradient(self, points, times):
        """F (N,) and its gradient (N, 3) at points (N, 3) and times, (N,) or a number."""
        value, gradient = np.zeros(len(points)), np.zeros((len(points), 3))
        for k, field in enumerate(self.fields):
            if self.bodies[k].moving and np.ndim(times):
                turn, place = self.poses(k, times)
                own = np.einsum("nji,nj->ni", turn, points - place)
                f, g = field.value_and_gradient(own)
                g = np.einsum("nij,nj->ni", turn, g)
            else:
                turn, place = self._pose(k, float(times) if np.ndim(times) == 0 else 0.0)
                f, g = field.value_and_gradient((points - place) @ turn)
                g = g @ turn.T
            value += f
            gradient += g
        return value, gradient

    def logarithm(self, points, times):
        """log F (N,), -inf where F = 0, and unit gradients of F with their lengths over F."""
        value, gradient = self.value_and_gradient(points, times)
        size = np.linalg.norm(gradient, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.log(value), gradient / np.maximum(size, 1e-300)[:, None], size / value

    def projected(self, points, time, steps=PROJECTIONS, exact=ON_SURFACE):
        """Which of the points (N, 3) end on the surface by Newton's method along the gradient, and where all end."""
        points = np.array(points)
        active = np.ones(len(points), dtype=bool)
        found = np.zeros(len(points), dtype=bool)
        for _ in range(steps):
            index = np.flatnonzero(active)
            if not len(index):
                break
            log, normal, slope = self.logarithm(points[index], time)
            known = np.isfinite(log) & (slope > 0)
            good = known & (np.abs(log) < exact)
            found[index[good]] = True
            active[index[good | ~known]] = False
            go = known & ~good
            step = np.clip(log[go] / slope[go], -self.feature, self.feature)
            points[index[go]] -= step[:, None] * normal[go]
        return found, points

    def samples(self, time):
        """Samples (N, 3) of the surface at a time, with the index of the seed that each is of (N,)."""
        found, points = self.projected(self.placed(time), time)
        return points[found], np.flatnonzero(found)

    def placed(self, time):
        """The seeds (N, 3) in the world at a time."""
        poses = [self._pose(k, float(time)) for k in range(len(self.bodies))]
        return np.concatenate([s @ turn.T + place for s, (turn, place) in zip(self.seeds, poses, strict=True)])

    def around(self, point, reach, time, rng, count=64):
        """Samples of the surface within about `reach` of a point of it."""
        return self.projected(np.concatenate([[point], point + reach * rng.uniform(-1, 1, (count, 3))]), time)


def _seeds(body, rng):
    """Points spread about a body's skeleton, in its frame: most end on its surface, some between it and others'."""
    radius = body.surface.radius
    field = body.surface_field()
    kept = []
    for primitive in body.skeleton:
        endless = isinstance(primitive, fs.Plane)
        step = (PLANE_SPACING if endless else SPACING) * radius
        measure = PATCH**2 if endless else primitive.measure
        dimension = primitive.dimension
        area = {0: 0.0, 1: 2 * np.pi * radius * measure, 2: 2 * measure}[dimension] + 4 * np.pi * radius**2
        count = int(8 * area / step**2)
        places = skeleton_points(primitive, rng.random(count), rng.random(count))
        if endless:
            aside = np.array(primitive.normal) * rng.choice([-1.0, 1.0], count)[:, None]
        else:
            aside = rng.normal(size=(count, 3))
            aside /= np.linalg.norm(aside, axis=1)[:, None]
        points = places + radius * rng.uniform(0.7, 1.1, count)[:, None] * aside
        alone = Surface.__new__(Surface)
        alone.bodies, alone.fields, alone._poses = [fs.Body(body.skeleton, surface=body.surface)], [field], {}
        alone.feature = radius
        found, on = alone.projected(points, 0.0, exact=1e-6)
        kept.append(_thinned(on[found], step))
        # Where bodies melt together the surface lies where each alone has less than 1.
        beyond = places + radius * rng.uniform(1.0, 2.0, count)[:, None] * aside
        kept.append(_thinned(beyond, 2.0 * step))
    return np.concatenate(kept)


def _thinned(points, spacing):
    """One of the points of each cell of a grid."""
    if not len(points):
        return points
    cells = np.unique(np.floor(points / spacing).astype(np.int64), axis=0, return_index=True)[1]
    return points[cells]
