"""What a simulation makes of the scenes of `contact_scenes`, held against what `contact_oracle` knows.

A simulation *misses* a touch if it finds none, or one so late that the ball is in the solid by more than a tenth of its
radius or of the feature, whichever is smaller, and finds a *false* one if there is none, or one earlier by as much.
Of all others the errors of time (times speed) and place count, in the ball's radii. Touches that are grazing or
doubtful are not judged. A false touch whose place is on the surface and on the ball is the oracle's fault.
"""

import dataclasses

import numpy as np
from contact_oracle import Surface, first_touches
from contact_scenes import Family, Scene, make_scene

import fieldsim as fs

# Steps: where bodies move, their surfaces are interpolated over a step.
STILL_STEP, MOVING_STEP = 1e-2, 1e-3
SLACK = 0.1
# How well a place must lie on surface and ball to overrule the oracle, in radii of the ball.
EVIDENT = 1e-6


@dataclasses.dataclass(frozen=True)
class Verdict:
    """Of the N balls of a scene, each (N,): judged, touching, missed, false and overruled, bool; errors in ball radii.

    time_errors, place_errors: of the balls that are judged and touch, neither missed nor false; else nan.
    """

    scene: Scene
    judged: np.ndarray
    touching: np.ndarray
    missed: np.ndarray
    false: np.ndarray
    overruled: np.ndarray
    time_errors: np.ndarray
    place_errors: np.ndarray

    @property
    def worst(self) -> float:
        """The greatest error, in ball radii; infinite where a touch is missed or false."""
        if self.missed.any() or self.false.any():
            return np.inf
        return float(np.nanmax([self.time_errors, self.place_errors, np.zeros(len(self.judged))]))


def simulated_touches(scene: Scene, law=None, dt: float | None = None):
    """First touches as a simulation finds them: times (N,), inf where there is none, and places (N, 3)."""
    moving = any(body.moving for body in scene.bodies)
    step = dt or (MOVING_STEP if moving else STILL_STEP)
    simulation = fs.Simulation(scene.world(law), fs.Leapfrog(step), threads=1, log=1 if law is None else 1000)
    simulation.advance(scene.duration)
    events = simulation.events
    times, places = np.full(len(scene.radii), np.inf), np.full((len(scene.radii), 3), np.nan)
    # Sorted by time: the first of each particle.
    particles, first = np.unique(events.particles, return_index=True)
    times[particles], places[particles] = events.times[first], events.positions[first]
    return times, places


def judge(scene: Scene, law=None, dt: float | None = None) -> Verdict:
    """A simulation of a scene, judged."""
    truth = first_touches(scene)
    times, places = simulated_touches(scene, law, dt)
    speeds, radii = np.linalg.norm(scene.velocities, axis=1), scene.radii
    judged = ~truth.grazing & ~truth.doubtful
    touching, touched = np.isfinite(truth.times), np.isfinite(times)
    slack = SLACK * np.minimum(radii, scene.features) / speeds
    with np.errstate(invalid="ignore"):
        late = np.where(touching, times - truth.times, -np.inf)
        early = np.where(touched, truth.times - times, -np.inf)
    missed, false = judged & (late > slack), judged & (early > slack)
    # A ball that passes by within rounding may as well touch.
    false &= touching | (truth.clearances > EVIDENT * radii)
    overruled = false & _evident(scene, times, places)
    fine = judged & touching & touched & ~missed & ~false
    time_errors = np.where(fine, np.abs(np.where(fine, late, 0.0)) * speeds / radii, np.nan)
    place_errors = np.where(fine, np.linalg.norm(places - truth.places, axis=1) / radii, np.nan)
    return Verdict(
        scene, judged & ~overruled, touching, missed, false & ~overruled, overruled, time_errors, place_errors
    )


def _evident(scene, times, places):
    """Which balls' centres are a radius from the place of touch, where that lies on the surface, (N,) bool."""
    result = np.zeros(len(times), dtype=bool)
    some = np.flatnonzero(np.isfinite(times))
    if len(some):
        log, _, slope = Surface(scene.bodies).logarithm(places[some], times[some])
        apart = places[some] - scene.starts[some] - times[some, None] * scene.velocities[some]
        off = np.abs(np.linalg.norm(apart, axis=1) - scene.radii[some])
        result[some] = np.maximum(off, np.abs(log / slope)) < EVIDENT * scene.radii[some]
    return result


def judge_family(family: Family, seed: int, balls: int = 8) -> Verdict:
    """The scene of a family and a number, judged."""
    return judge(make_scene(family, seed, balls))
