"""The laws of contact: energy and force, Coulomb's limit, and the damping that belongs to a restitution."""

import math

import numba
import numpy as np
import pytest
import warp as wp

from fieldsim.dynamics.contact import laws


def test_the_force_of_repulsion_is_the_derivative_of_its_energy():
    for depth in (0.01, 0.3, 2.0):
        low, high = laws.pressed(depth - 1e-6, 7.0)[0], laws.pressed(depth + 1e-6, 7.0)[0]
        assert laws.pressed(depth, 7.0) == pytest.approx((7.0 * depth**3 / 3.0, (high - low) / 2e-6), rel=1e-6)
    assert laws.pressed(-0.1, 7.0) == (0.0, 0.0)


def test_friction_ends_a_slip_within_the_limit_and_else_opposes_it():
    slip, mass = np.array([0.3, -0.4, 0.0]), 2.0
    np.testing.assert_allclose(laws.coulomb(*slip, 0, 0, 0, 1 / mass, 9.0), -mass * slip)
    np.testing.assert_allclose(laws.coulomb(*slip, 0, 0, 0, 1 / mass, 0.25), -0.5 * slip)
    # What has been given before counts: only their sum is limited, and may be taken back.
    np.testing.assert_allclose(laws.coulomb(*slip, 1.0, 0, 0, 1 / mass, 9.0), (0.4, 0.8, 0))
    np.testing.assert_array_equal(laws.coulomb(*slip, 1.0, 0, 0, 1 / mass, 0.0), (0, 0, 0))


def rebound(c, power, steps=20_000):
    """Speed with which a unit mass leaves after it came at speed 1: v dv = -k d^power (1 + c v) dd, by Runge-Kutta."""
    dt = 12.0 / steps

    def rate(d, v):
        return v, -(max(d, 0.0) ** power) * max(1.0 + c * v, 0.0)

    d, v = 0.0, 1.0
    for _ in range(steps):
        one = rate(d, v)
        two = rate(d + 0.5 * dt * one[0], v + 0.5 * dt * one[1])
        three = rate(d + 0.5 * dt * two[0], v + 0.5 * dt * two[1])
        four = rate(d + dt * three[0], v + dt * three[1])
        d += dt / 6.0 * (one[0] + 2.0 * two[0] + 2.0 * three[0] + four[0])
        v += dt / 6.0 * (one[1] + 2.0 * two[1] + 2.0 * three[1] + four[1])
        if d < 0.0:
            break
    return -v


@pytest.mark.parametrize("restitution", [0.3, 0.6, 0.9, 0.99995, 1.0])
@pytest.mark.parametrize("power", [1, 3])
def test_damping_gives_the_restitution_whatever_the_force(restitution, power):
    assert rebound(laws.damping(restitution), power) == pytest.approx(restitution, abs=1e-5)


def test_damping_at_the_ends():
    assert laws.damping(1.0) == 0.0
    assert laws.damping(0.0) == pytest.approx(1.0 / laws.LEAST_RESTITUTION)
    assert laws.damping(0.9999) == pytest.approx(laws.damping(0.9998) / 2.0, rel=1e-3)
    values = [laws.damping(e) for e in np.linspace(0.0, 1.0, 101)]
    assert (np.diff(values) < 0.0).all()


@pytest.mark.parametrize("rate", [1e-9, 0.9e-3, 1.1e-3, 0.5, 3.0, 80.0])
def test_damping_over_a_time_is_exact(rate):
    """v' = -rate v over a time of 1, from 1: the mean that gives the change."""
    share = laws.late_share(rate)
    after = (1.0 - rate * (1.0 - share)) / (1.0 + rate * share)
    assert after == pytest.approx(math.exp(-rate), abs=1e-12)


def test_mixtures():
    assert laws.joint_friction(0.5, 0.0) == 0.0
    assert laws.joint_friction(0.4, 0.4) == pytest.approx(0.4)
    assert laws.joint_restitution(0.3, 1.0) == 0.3


def test_compiled_laws_are_the_same():
    calls = {
        "pressed": (0.3, 7.0),
        "coulomb": (0.3, -0.4, 0.1, 1.0, 0.2, 0.0, 0.5, 0.25),
        "joint_friction": (0.3, 0.7),
        "joint_restitution": (0.3, 0.7),
        "damping": (0.4,),
        "late_share": (0.7,),
    }
    for name, arguments in calls.items():
        law = getattr(laws, name)
        assert isinstance(law.numba, numba.core.registry.CPUDispatcher)
        np.testing.assert_allclose(law.numba(*arguments), law(*arguments), rtol=1e-14)
    np.testing.assert_allclose(in_warp(), laws.damping(0.4), rtol=1e-14)


def in_warp():
    """`damping` in a kernel of Warp."""
    damping = laws.damping.warp(wp.float64)

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate(values: wp.array(dtype=wp.float64)):
        values[0] = damping(values[0])

    values = wp.array([0.4], dtype=wp.float64, device="cpu")
    wp.launch(evaluate, 1, inputs=[values], device="cpu")
    return values.numpy()[0]
