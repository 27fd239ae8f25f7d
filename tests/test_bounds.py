"""Requests without end are refused by their size, before they take memory or time."""

import numpy as np
import pytest

import fieldsim as fs
from fieldsim import sampling

CORNERS = [(0, 0, 0), (1, 2, 0), (3, -1, 0), (4, 0, 1)]
BALL = fs.Body(fs.Point((0, 0, 0)), surface=fs.Material())


def running(**options):
    world = fs.World()
    world.add_body(BALL)
    world.add_particles([(2.0, 0, 0)], [(0, 0, 0)], contact=fs.Bounce())
    return fs.Simulation(world, fs.Leapfrog(0.001), **options)


@pytest.mark.parametrize(
    "request_",
    [
        lambda: fs.timeline(1e12),
        lambda: fs.timeline(1.0, fps=1e300),
        lambda: fs.disc((0, 0, 0), (0, 0, 1), 1.0, 1e-12),
        lambda: fs.planets.pancake(1e9, tolerance=1e-9),
        lambda: fs.planets.asterisk(10**8),
        lambda: fs.planets.star(10**8),
        lambda: fs.planets.spiral(turns=1e9),
        lambda: fs.planets.helix(turns=1e12, height=1.0),
        lambda: fs.planets.knot(tolerance=1e-19),
        lambda: fs.bezier(CORNERS, tolerance=1e-19),
        lambda: fs.catmull_rom(CORNERS, tolerance=1e-19),
        lambda: sampling.ball(10**12, radius=1.0, seed=0),
        lambda: sampling.box(10**12, low=(0, 0, 0), high=(1, 1, 1), seed=0),
        lambda: fs.Renderer((10**6, 10**6)),
        lambda: fs.Renderer(exposures=10**9),
        lambda: fs.PointLight(position=(0, 0, 1), samples=10**9),
        lambda: BALL.surface_mesh(resolution=10**6),
        lambda: BALL.surface_mesh(tolerance=1e-12),
        lambda: fs.Film("film.mp4", fps=1e300),
        lambda: running(log=10**9),
        lambda: running().advance(1e300),
        lambda: fs.lyapunov(fs.World(), 1.0, samples=10**9),
    ],
)
def test_refused_by_size(request_):
    with pytest.raises(fs.InputError):
        request_()


def test_large_ones_are_served():
    assert len(fs.timeline(3600.0, fps=100)) == 360_000
    assert len(fs.disc((0, 0, 0), (0, 0, 1), 1.0, 1e-7)) > 1000
    turns = fs.planets.helix(turns=300, height=100.0)
    assert len(turns) > 500
    assert sum(arc.measure for arc in turns) == pytest.approx(np.hypot(300 * np.pi, 100.0), rel=1e-3)
