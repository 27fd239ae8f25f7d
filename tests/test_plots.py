"""Plots: figures with what was asked for, and pictures written whole or not at all."""

import imageio.v3 as imageio
import numpy as np
import pytest

from fieldsim import plots
from fieldsim.dynamics.diagnostics.energy_log import EnergyLog
from fieldsim.dynamics.simulation import Simulation
from fieldsim.errors import InputError
from fieldsim.orbits.lyapunov import Lyapunov
from fieldsim.world.world import World


def lines(figure):
    return [line.get_xydata() for line in figure.axes[0].get_lines()]


def test_the_drift_of_an_energy_log():
    log = EnergyLog(Simulation(World()))
    log.history.times, log.history.largest, log.history.rms = [0.0, 1.0], [1e-9, 2e-9], [1e-10, 1e-10]
    largest, rms = lines(plots.energy(log))
    np.testing.assert_array_equal(largest, [(0.0, 1e-9), (1.0, 2e-9)])
    np.testing.assert_array_equal(rms[:, 1], 1e-10)


def test_orbits_are_projected():
    positions = np.random.default_rng(0).normal(size=(5, 2, 3))
    one, two = lines(plots.orbits(positions, "xz"))
    np.testing.assert_array_equal(one, positions[:, 0, [0, 2]])
    np.testing.assert_array_equal(two, positions[:, 1, [0, 2]])
    with pytest.raises(InputError, match="plane is 'zx'"):
        plots.orbits(positions, "zx")


def test_exponents_against_time():
    (line,) = lines(plots.lyapunov(Lyapunov(np.array([1.0, 2.0]), np.array([[[0.5]], [[-0.25]]]))))
    np.testing.assert_array_equal(line, [(1.0, 0.5), (2.0, 0.25)])


def dots(size):
    return plots.section([0, 1], [2, 3], [0.0, 1.0], title="dots", size=size)


@pytest.mark.parametrize("kind", ["png", "svg", "pdf"])
def test_pictures_are_the_same_bytes_again(tmp_path, kind):
    for name in ("a", "b"):
        plots.Picture(dots).save(tmp_path / f"{name}.{kind}", (320, 240))
    assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()
    assert len(list(tmp_path.iterdir())) == 2


def test_a_picture_has_the_size_asked_for(tmp_path):
    plots.Picture(dots).save(tmp_path / "dots.png", (320, 240))
    assert imageio.imread(tmp_path / "dots.png").shape[:2] == (240, 320)


def test_bad_pictures_are_refused_before_they_are_drawn(tmp_path):
    def never(size):
        raise AssertionError

    with pytest.raises(InputError, match=r"ends in .png"):
        plots.Picture(never).save(tmp_path / "dots.mp4")
    with pytest.raises(InputError, match="does not exist"):
        plots.Picture(never).save(tmp_path / "nowhere" / "dots.png")
    with pytest.raises(InputError, match="draw is 3"):
        plots.Picture(3)
