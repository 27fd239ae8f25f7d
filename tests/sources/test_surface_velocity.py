"""How fast material moves: exact for spins and keyframes, against mpmath; to the promised error for other functions."""

import mpmath as mp
import numpy as np
import pytest

import fieldsim as fs
from fieldsim.sources.surface_velocity import STEP, twist_rate, twists

SPIN = fs.Spin((1, 2, 2), rate=0.7, phase=0.3, center=(0.5, -1.0, 2.0))
TURN = 0.7 * np.array(SPIN.axis)
SPUN = np.concatenate([TURN, -np.cross(TURN, SPIN.center)])
TIMES = [0.0, 1.0, 2.5, 3.0, 4.0]


def poses(loop):
    rng = np.random.default_rng(7)
    made = [fs.Pose(tuple(rng.normal(size=3)), tuple(rng.normal(size=4))) for _ in range(4)]
    return [*made, made[0] if loop else fs.Pose((1, 2, 3), (1, 1, 0, 0))]


def test_what_stands_still_has_no_twist():
    for motion in (fs.Pose((1, 2, 3)), fs.Keyframes([0], [(1, 2, 3)]), fs.Keyframes([0, 1], [(0, 0, 0)] * 2)):
        np.testing.assert_array_equal(twist_rate(motion, 0.5), np.zeros(6))


def test_spins_are_exact_and_functions_of_time_keep_their_promise():
    np.testing.assert_allclose(twist_rate(SPIN, 1.7), SPUN, rtol=1e-15)
    # A screw through both moments is a spin's own motion: only the poses' roundings are left.
    np.testing.assert_allclose(twist_rate(lambda time: SPIN(time), 1.7), SPUN, atol=1e-10)
    wave = twist_rate(lambda time: (np.sin(3.0 * time), 0.0, 0.0), 0.4)
    np.testing.assert_allclose(wave, [0, 0, 0, 3.0 * np.cos(1.2), 0, 0], atol=27.0 * STEP**2 / 6 + 1e-15 / STEP)


def test_keyframes_of_a_uniform_turn_turn_uniformly():
    keys = fs.Keyframes(TIMES, [fs.Pose.turned((1, 2, 3), 0.9 * t, (2 * t, 0, 1)) for t in TIMES])
    velocity, turn = keys.rates(1.7)
    np.testing.assert_allclose(velocity, (2, 0, 0), atol=1e-14)
    np.testing.assert_allclose(turn, 0.9 * np.array((1, 2, 3)) / 14**0.5, atol=1e-14)


def product(p, q):
    w = p[0] * q[0] - sum(p[k] * q[k] for k in (1, 2, 3))
    pairs = ((1, 2, 3), (2, 3, 1), (3, 1, 2))
    return [w, *(p[0] * q[i] + q[0] * p[i] + p[j] * q[k] - p[k] * q[j] for i, j, k in pairs)]


def turned(vector, weight):
    """The turn by `weight` times a rotation vector."""
    angle = weight * mp.sqrt(sum(c * c for c in vector)) / 2
    return [mp.cos(angle), *(mp.sinc(angle) * weight * c / 2 for c in vector)]


def placed(keys, k, u):
    """Rotation and position on a span, at 40 digits: the formulas of `Keyframes` in their own numbers."""
    step = keys.times[k + 1] - keys.times[k]
    if keys.interpolation == "linear":
        parts = [(u, keys._turns[k])]
        place = [(1 - u) * mp.mpf(p) + u * mp.mpf(q) for p, q in zip(keys.values[k], keys.values[k + 1], strict=True)]
    else:
        vectors = [vector for _, vector in keys._bezier(k, 0.5, step)]
        parts = zip((1 - (1 - u) ** 3, u * u * (3 - 2 * u), u**3), vectors, strict=True)
        ends = zip(*keys._slopes(k, np.diff(keys.values, axis=0)), *keys.values[k : k + 2], strict=True)
        place = [
            (1 + 2 * u) * (1 - u) ** 2 * mp.mpf(p)
            + u * (1 - u) ** 2 * step * mp.mpf(s)
            + u * u * (3 - 2 * u) * mp.mpf(q)
            + u * u * (u - 1) * step * mp.mpf(t)
            for s, t, p, q in ends
        ]
    rotation = [mp.mpf(float(c)) for c in keys.rotations[k]]
    for weight, vector in parts:
        rotation = product(rotation, turned([mp.mpf(float(c)) for c in vector], weight))
    return rotation, place


@pytest.mark.parametrize("loop", [False, True])
@pytest.mark.parametrize("interpolation", ["cubic", "linear"])
@pytest.mark.parametrize("k", range(4))
def test_keyframes_are_exact(interpolation, loop, k):
    keys = fs.Keyframes(TIMES, poses(loop), interpolation=interpolation, loop=loop)
    step, u = TIMES[k + 1] - TIMES[k], 0.375
    velocity, turn = keys.rates(TIMES[k] + u * step)
    with mp.workdps(40):
        here = mp.mpf(u)
        derivative = lambda part, c: mp.diff(lambda v: placed(keys, k, v)[part][c], here) / step  # noqa: E731
        rotation, _ = placed(keys, k, here)
        back = [rotation[0], *(-c for c in rotation[1:])]
        wanted = [float(2 * c) for c in product([derivative(0, c) for c in range(4)], back)[1:]]
        moved = [float(derivative(1, c)) for c in range(3)]
    np.testing.assert_allclose(turn, wanted, rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(velocity, moved, rtol=1e-13, atol=1e-14)
    # After each key the rates of the span that begins there.
    after = keys.rates(TIMES[k])
    np.testing.assert_allclose(after[0], keys.rates(TIMES[k] + 1e-9)[0], atol=1e-7)
    np.testing.assert_allclose(after[1], keys.rates(TIMES[k] + 1e-9)[1], atol=1e-7)


def test_keyframes_rest_outside_and_where_they_step():
    keys = fs.Keyframes(TIMES, poses(False))
    for time in (-1.0, 4.0, 9.0):
        np.testing.assert_array_equal(np.concatenate(keys.rates(time)), np.zeros(6))
    steps = fs.Keyframes(TIMES, poses(False), interpolation="step")
    np.testing.assert_array_equal(np.concatenate(steps.rates(1.5)), np.zeros(6))
    growth, turn = fs.Keyframes([0, 2], [0.0, 4.0], interpolation="linear").rates(1.0)
    assert (float(growth), *turn) == (2.0, 0.0, 0.0, 0.0)


def test_a_rate_is_the_limit_of_twists_between_moments():
    keys = fs.Keyframes(TIMES, poses(False))
    moments = [keys(1.3 + side * 1e-4) for side in (-1, 1)]
    between = twists(*(np.array([[getattr(pose, n)] for pose in moments]) for n in ("matrix", "position")))
    np.testing.assert_allclose(between[0, 0] / 2e-4, twist_rate(keys, 1.3), atol=1e-6)
