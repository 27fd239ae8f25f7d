"""What a ball on a straight line touches first, by geometry alone: nothing of `fieldsim.dynamics` is used.

The surface F = 1 of all bodies is sampled by Newton's method on log F from points about their skeletons. For a surface
that stays, the time at which a moving ball meets each sample is known in closed form; the locally earliest ones start
Newton's method on the conditions of first touch,

    p = c(t) + r n(p, t),  log F(p, t) = 0,  n = grad F / |grad F|,

in the four unknowns p and t, with differences for its Jacobian, so that the result is exact to rounding. Where that
fails, samples are refined around the earliest one. Where bodies move, samples are taken at times that lie closer than
the balls' distances over the speeds, and the locally nearest ones start the same method.

A touch is *grazing* if the ball's path is within GRAZING of the tangent plane there, and *doubtful* if samples say that
there is an earlier one which was not found to rounding: what a simulation finds there is not judged.
"""

import dataclasses

import numpy as np
from contact_scenes import Scene
from contact_surface import SPACING, Surface
from scipy.spatial import cKDTree

# How far any point of a surface is from the next sample at most, in radii of its material.
COVER = 0.3
# Candidates that are refined, of each ball; neighbours that a candidate must not be later than.
CANDIDATES, NEIGHBOURS = 10, 10
# Steps of differences, in radii of the smallest material and in units of time.
DIFFERENCE, MOMENT = 1e-5, 1e-6
# Residual of Newton's method, relative to the ball and the scene; greatest number of steps, and
# from samples at a time close to that of the touch.
EXACT, STEPS, FEW_STEPS = 1e-13, 30, 12
# How small log F is where samples are projected roughly.
ROUGH = 1e-2
# Sine of the angle between a path and the surface below which a touch is grazing.
GRAZING = 3e-3


@dataclasses.dataclass(frozen=True)
class Touches:
    """First touches of N balls: times (N,), inf where there is none; places (N, 3); grazing and doubtful (N,) bool.

    clearances (N,): of balls that touch nothing, how far samples of the surface stay away from them; inf if unknown.
    """

    times: np.ndarray
    places: np.ndarray
    grazing: np.ndarray
    doubtful: np.ndarray
    clearances: np.ndarray


class Paths:
    """Balls on straight lines: starts, velocities (N, 3), radii (N,)."""

    def __init__(self, starts, velocities, radii):
        self.starts, self.velocities, self.radii = starts, velocities, radii

    def __getitem__(self, which):
        return Paths(self.starts[which], self.velocities[which], self.radii[which])

    def __len__(self):
        return len(self.radii)

    def at(self, times):
        """Centres (N, 3) at times (N,)."""
        return self.starts + np.multiply(times, self.velocities.T).T

    def meeting(self, ball, points, pad=0.0):
        """When a ball, `pad` thicker, meets still points (n, 3), and where it passes by all, how far beside its path.

        Returns (times, inf where it passes by; distances from its surface to points that it passes by, else 0), (n,).
        """
        velocity, apart = self.velocities[ball], points - self.starts[ball]
        speed = np.linalg.norm(velocity)
        along = apart @ velocity / speed
        beside = np.linalg.norm(apart - along[:, None] * (velocity / speed), axis=1)
        radius = self.radii[ball] + pad
        depth = np.sqrt(np.maximum((radius - beside) * (radius + beside), 0.0))
        times = (along - depth) / speed
        met = (beside <= radius) & (times >= 0.0)
        return np.where(met, times, np.inf), np.where(beside <= radius, 0.0, beside - radius)


def exact_touches(surface: Surface, paths: Paths, points, times, steps=STEPS):
    """First touches by Newton's method from M points and times: (times, points, which are found)."""
    points, times = np.array(points), np.array(times)
    found = np.zeros(len(times), dtype=bool)
    small = DIFFERENCE * surface.feature
    active = np.arange(len(times))
    for _ in range(steps):
        if not len(active):
            break
        some = paths[active]
        with np.errstate(invalid="ignore"):  # where fields end
            defect, slopes = _defect_and_slopes(surface, some, points[active], times[active], small)
        size = np.linalg.norm(defect, axis=1)
        good = size < EXACT * (10.0 * some.radii + 0.5)
        found[active[good]] = True
        go = np.isfinite(size) & np.isfinite(slopes).all(axis=(1, 2)) & ~good
        active, defect, slopes, some = active[go], defect[go], slopes[go], some[go]
        if not len(active):
            break
        step = -(np.linalg.pinv(slopes) @ defect[:, :, None])[:, :, 0]
        speed = np.linalg.norm(some.velocities, axis=1)
        length = np.maximum(np.linalg.norm(step[:, :3], axis=1), speed * np.abs(step[:, 3]))
        step *= np.minimum(1.0, 0.3 * surface.feature / np.maximum(length, 1e-300))[:, None]
        points[active] += step[:, :3]
        times[active] += step[:, 3]
    return times, points, found & (times >= 0.0)


def _defect_and_slopes(surface, paths, points, times, small):
    """By how much the conditions of first touch fail, (M, 4), and the derivatives of that, (M, 4, 4)."""

    def defects(points, times):
        log, normal, _ = surface.logarithm(points, times)
        repeat = len(points) // len(paths)
        balls = Paths(*(np.concatenate([a] * repeat) for a in (paths.starts, paths.velocities, paths.radii)))
        toward = points - balls.at(times) - balls.radii[:, None] * normal
        return np.concatenate([toward, surface.feature * log[:, None]], axis=1)

    count = len(points)
    moved, then = [points], [times]
    for k in range(3):
        for sign in (1.0, -1.0):
            moved.append(points + sign * small * np.eye(3)[k])
            then.append(times)
    if surface.moving:
        for sign in (1.0, -1.0):
            moved.append(points)
            then.append(times + sign * MOMENT)
    all_of_them = defects(np.concatenate(moved), np.concatenate(then)).reshape(-1, count, 4)
    slopes = np.zeros((count, 4, 4))
    for k in range(3):
        slopes[:, :, k] = (all_of_them[2 * k + 1] - all_of_them[2 * k + 2]) / (2 * small)
    if surface.moving:
        slopes[:, :, 3] = (all_of_them[7] - all_of_them[8]) / (2 * MOMENT)
    else:
        slopes[:, :3, 3] = -paths.velocities
    return all_of_them[0], slopes


def _lowest(values, neighbours, most=CANDIDATES):
    """Indices of the lowest of the finite local minima of values (n,) over neighbours (n, k)."""
    least = np.flatnonzero(np.isfinite(values) & (values <= values[neighbours].min(axis=1)))
    return least[np.argsort(values[least])[:most]]


def first_touches(scene: Scene) -> Touches:
    """What each ball of a scene touches first."""
    surface, paths = Surface(scene.bodies), Paths(scene.starts, scene.velocities, scene.radii)
    find = _touches_of_moving if surface.moving else _touches_of_still
    times, places, doubtful, clearances = find(surface, paths, scene.duration)
    return Touches(times, places, _grazing(surface, paths, times, places), doubtful, clearances)


def _grazing(surface, paths, times, places):
    """Whether the path of each ball is nearly along the surface where they touch."""
    touched = np.isfinite(times)
    result = np.zeros(len(paths), dtype=bool)
    if touched.any():
        t, p, some = times[touched], places[touched], paths[touched]
        _, normal, slope = surface.logarithm(p, t)
        later, _, _ = surface.logarithm(p, t + MOMENT)
        earlier, _, _ = surface.logarithm(p, t - MOMENT)
        closing = np.einsum("ij,ij->i", normal, some.velocities) + (later - earlier) / (2 * MOMENT) / slope
        result[touched] = closing < GRAZING * np.linalg.norm(some.velocities, axis=1)
    return result


def _touches_of_still(surface, paths, duration):
    points, _ = surface.samples(0.0)
    neighbours = cKDTree(points).query(points, NEIGHBOURS + 1)[1]
    pad = COVER * max(body.surface.radius for body in surface.bodies)
    balls, guesses, moments = [], [], []
    for ball in range(len(paths)):
        time, _ = paths.meeting(ball, points, pad)
        chosen = _lowest(time, neighbours)
        balls += [ball] * len(chosen)
        guesses.append(points[chosen])
        moments.append(time[chosen])
    balls, guesses, moments = np.array(balls, dtype=int), np.concatenate(guesses), np.concatenate(moments)
    exact_times, exact_points, found = exact_touches(surface, paths[balls], guesses, moments)
    # Newton's method may stray from a grazing touch to a later one.
    kept = found & (np.linalg.norm(exact_points - guesses, axis=1) < surface.feature)
    count = len(paths)
    times, places, doubtful, clearances = _nothing(count)
    for ball in range(count):
        own = np.flatnonzero((balls == ball) & found)
        if len(own):
            first = own[np.argmin(exact_times[own])]
            times[ball], places[ball] = exact_times[first], exact_points[first]
        lost = np.flatnonzero((balls == ball) & ~kept & (moments < times[ball]))
        for one in lost[:4]:
            time, place, met, clear = _by_sampling(surface, paths, ball, guesses[one])
            if time < times[ball]:
                times[ball], places[ball] = time, place
                doubtful[ball] = not met
            clearances[ball] = min(clearances[ball], clear)
        # Nothing may be met before the first touch.
        earliest = paths.meeting(ball, points)[0].min()
        doubtful[ball] |= earliest < times[ball] - 1e-8 * surface.feature / np.linalg.norm(paths.velocities[ball])
        if times[ball] > duration:
            times[ball], places[ball] = np.inf, np.nan
    return times, places, doubtful, clearances


def _nothing(count):
    """Times, places, doubts and clearances of balls that touch nothing."""
    return np.full(count, np.inf), np.full((count, 3), np.nan), np.zeros(count, dtype=bool), np.full(count, np.inf)


def _by_sampling(surface, paths, ball, start):
    """First touch near a sample by ever closer samples, then Newton's method: (time, place, exact, clearance)."""
    rng = np.random.default_rng(ball)
    best, reach = start, SPACING * surface.feature
    rank = np.inf, np.inf
    for _ in range(30):
        found, points = surface.around(best, reach, 0.0, rng)
        points = points[found]
        if len(points):
            time, beside = paths.meeting(ball, points)
            first = np.lexsort((time, beside))[0]
            if (beside[first], time[first]) < rank:
                rank, best = (beside[first], time[first]), points[first]
        reach *= 0.6
    if not np.isfinite(rank[1]):
        return np.inf, best, False, rank[0]
    times, points, found = exact_touches(surface, paths[[ball]], best[None], np.array([rank[1]]))
    if found[0] and times[0] <= rank[1] * (1 + 1e-9):
        return times[0], points[0], True, np.inf
    return rank[1], best, False, np.inf


def _touches_of_moving(surface, paths, duration):
    times, places, doubtful, clearances = _nothing(len(paths))
    thickest = max(body.surface.radius for body in surface.bodies)
    bounds = np.linalg.norm(paths.velocities, axis=1) + _greatest_speed(surface, duration)
    margin = 2.0 * thickest + _greatest_shift(surface)
    open_balls, time = np.arange(len(paths)), 0.0
    while len(open_balls) and time <= duration:
        step = 0.3 * surface.feature / bounds[open_balls].max()
        free, hits = _near_samples(surface, paths, open_balls, time, margin, thickest)
        clearances[open_balls] = np.minimum(clearances[open_balls], free)
        if hits:
            balls = np.repeat([ball for ball, _ in hits], [len(points) for _, points in hits])
            guesses = np.concatenate([points for _, points in hits])
            then, there, exact = exact_touches(surface, paths[balls], guesses, np.full(len(balls), time), FEW_STEPS)
            for ball, moment, place in zip(balls[exact], then[exact], there[exact], strict=True):
                if moment < times[ball]:
                    times[ball], places[ball] = moment, place
        inside = surface.value_and_gradient(paths.at(np.full(len(paths), time))[open_balls], time)[0] > 1.0
        doubtful[open_balls] |= ((free < -1e-6 * surface.feature) | inside) & (times[open_balls] > time)
        ahead = max(step, np.min((free - COVER * thickest) / bounds[open_balls]))
        open_balls = open_balls[(times[open_balls] > time) & ~doubtful[open_balls]]
        time += ahead
    late = times > duration
    times[late], places[late] = np.inf, np.nan
    return times, places, doubtful, clearances


def _near_samples(surface, paths, balls, time, margin, thickest):
    """How far samples are from some balls at a time, (n,), and the locally nearest of those that may touch.

    Far away the distance is that to the seeds less the margin, which seeds lie from the surface at most. Returns
    (distances, list of pairs (ball, samples)).
    """
    placed = surface.placed(time)
    centers = paths.starts[balls] + time * paths.velocities[balls]
    apart = np.linalg.norm(placed[:, None] - centers, axis=2) - paths.radii[balls]
    free, hits = apart.min(axis=0) - margin, []
    close = np.flatnonzero(free < COVER * thickest)
    if not len(close):
        return free, hits
    # All that may be near is projected roughly, what is next to the nearest to the end.
    found, landed = surface.projected(placed[(apart[:, close] < 2.0 * margin).any(axis=1)], time, exact=ROUGH)
    landed = landed[found]
    for k in close:
        gap = np.linalg.norm(landed - centers[k], axis=1) - paths.radii[balls[k]]
        least = gap.min(initial=np.inf)
        if least > thickest:
            free[k] = max(free[k], min(least, margin) - 0.5 * thickest)
            continue
        near = np.flatnonzero(gap < least + 0.5 * thickest)
        found, points = surface.projected(landed[near], time, exact=1e-7)
        points = points[found]
        gap = np.linalg.norm(points - centers[k], axis=1) - paths.radii[balls[k]]
        free[k] = gap.min()
        if free[k] < COVER * thickest:
            neighbours = cKDTree(points).query(points, min(NEIGHBOURS + 1, len(points)))[1].reshape(len(points), -1)
            hits.append((balls[k], points[_lowest(gap, neighbours, 5)]))
    return free, hits


def _greatest_speed(surface, duration):
    """How fast any seed moves, from differences, with some to spare."""
    moments = np.linspace(0.0, duration, 101)
    placed = np.array([surface.placed(t) for t in moments])
    return 1.2 * np.linalg.norm(np.diff(placed, axis=0), axis=2).max() / moments[1]


def _greatest_shift(surface):
    """How far seeds lie from the surface at the start."""
    placed = surface.placed(0.0)
    found, points = surface.projected(placed, 0.0)
    return np.linalg.norm(points - placed, axis=1)[found].max()
