"""Starting particles: even over the volume, across the radius, the same for the same seed."""

import numpy as np
import pytest

from fieldsim import sampling
from fieldsim.errors import InputError

COUNT = 20_000
# Means of COUNT uniform numbers in 0..1 scatter by 0.29 / sqrt(COUNT) = 0.002; five times that never fails by chance.
CHANCE = 0.01


def test_shell_is_even_over_its_volume():
    positions = sampling.shell(COUNT, radius=(1.0, 2.0), seed=1)["positions"]
    distance = np.linalg.norm(positions, axis=1)
    assert (distance >= 1.0).all()
    assert (distance <= 2.0).all()
    # Shares of volume and of each coordinate's half space.
    assert ((distance**3 - 1) / 7).mean() == pytest.approx(0.5, abs=CHANCE)
    np.testing.assert_allclose((positions > 0).mean(axis=0), 0.5, atol=2 * CHANCE)
    # Archimedes: the height of a point on a sphere is uniform.
    assert np.abs(positions[:, 2] / distance).mean() == pytest.approx(0.5, abs=CHANCE)


def test_ball_and_disk_are_even():
    inside = np.linalg.norm(sampling.ball(COUNT, radius=3.0, seed=2)["positions"], axis=1)
    assert ((inside / 3) ** 3).mean() == pytest.approx(0.5, abs=CHANCE)
    disk = sampling.disk(COUNT, radius=(1, 2), thickness=0.5, normal=(1, 0, 0), center=(5, 0, 0), seed=3)["positions"]
    across2 = (disk[:, 1:] ** 2).sum(axis=1)
    assert ((across2 - 1) / 3).mean() == pytest.approx(0.5, abs=CHANCE)
    assert disk[:, 0].min() == pytest.approx(4.75, abs=CHANCE)
    assert disk[:, 0].max() == pytest.approx(5.25, abs=CHANCE)


def test_speeds_are_across_the_radius():
    circular = sampling.shell(50, radius=(1, 4), speed=lambda r: r**-0.5, seed=4)
    positions, velocities = circular["positions"], circular["velocities"]
    np.testing.assert_allclose(np.einsum("ij,ij->i", positions, velocities), 0.0, atol=1e-14)
    np.testing.assert_allclose((velocities**2).sum(axis=1), 1 / np.linalg.norm(positions, axis=1))


def test_disk_turns_right_handed_about_its_normal():
    ring = sampling.disk(50, radius=2.0, speed=3.0, velocity=(0, 0, 1), seed=5)
    np.testing.assert_allclose(np.linalg.norm(ring["positions"], axis=1), 2.0)
    spin = np.cross(ring["positions"], ring["velocities"] - (0, 0, 1))
    np.testing.assert_allclose(spin, np.tile((0, 0, 6), (50, 1)), atol=1e-13)


def test_cylinder_stands_upright():
    positions = sampling.cylinder(COUNT, radius=1.5, height=(1.2, 2.2), center=(0, 0, 1), seed=7)["positions"]
    assert ((positions[:, :2] ** 2).sum(axis=1) / 1.5**2).mean() == pytest.approx(0.5, abs=CHANCE)
    assert positions[:, 2].min() == pytest.approx(2.2, abs=CHANCE)
    assert positions[:, 2].max() == pytest.approx(3.2, abs=CHANCE)


def test_orbits_are_circular_and_tilted():
    start = sampling.orbits(500, radius=(1, 3), mass=2.0, G=3.0, tilt=0.4, normal=(0, 1, 0), center=(1, 1, 1), seed=8)
    positions, velocities = start["positions"] - 1, start["velocities"]
    distance = np.linalg.norm(positions, axis=1)
    np.testing.assert_allclose(np.einsum("ij,ij->i", positions, velocities), 0.0, atol=1e-13)
    np.testing.assert_allclose((velocities**2).sum(axis=1), 6.0 / distance)
    axes = np.cross(positions, velocities) / (distance * np.linalg.norm(velocities, axis=1))[:, None]
    assert np.arccos(axes[:, 1]).max() == pytest.approx(0.4, abs=0.01)
    # A cap is filled evenly where the cosine of the tilt is uniform.
    assert axes[:, 1].mean() == pytest.approx((1 + np.cos(0.4)) / 2, abs=0.005)


def test_box_fills_its_corners():
    start = sampling.box(COUNT, low=(0, 0, -1), high=(1, 2, -1), velocity=(1, 2, 3), seed=6)
    np.testing.assert_allclose(start["positions"].mean(axis=0), (0.5, 1.0, -1.0), atol=2 * CHANCE)
    assert (start["velocities"] == (1, 2, 3)).all()


def test_seeds_repeat_and_differ():
    one, again, other = (sampling.shell(5, radius=(1, 2), seed=s)["positions"] for s in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    assert not np.array_equal(one, other)


def test_no_particles():
    assert sampling.shell(0, radius=1, seed=1)["positions"].shape == (0, 3)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: sampling.shell(-1, radius=1, seed=1), "count is -1"),
        (lambda: sampling.shell(2.5, radius=1, seed=1), r"count is 2\.5"),
        (lambda: sampling.shell(5, radius=(2, 1), seed=1), r"radius is \(2, 1\); give the lower number first"),
        (lambda: sampling.shell(5, radius=(1, 2, 3), seed=1), "give two numbers, the lower first"),
        (lambda: sampling.shell(5, radius=-1, seed=1), "radius is -1"),
        (lambda: sampling.shell(5, radius=1, seed="x"), "seed is 'x'"),
        (lambda: sampling.shell(5, radius=1, speed="fast", seed=1), "speed is 'fast'"),
        (lambda: sampling.shell(5, radius=2, speed=lambda r: r * np.nan, seed=1), "speed is nan at distance 2"),
        (lambda: sampling.ball(5, radius=0, seed=1), "radius is 0"),
        (lambda: sampling.cylinder(5, radius=1, height=2, seed=1), "height is 2; give two numbers"),
        (lambda: sampling.orbits(5, radius=1, mass=-1, seed=1), "mass is -1"),
        (lambda: sampling.box(5, low=(1, 0, 0), high=(0, 1, 1), seed=1), "swap the coordinates"),
    ],
)
def test_bad_input_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
