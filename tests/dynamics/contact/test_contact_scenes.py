"""First touches in random scenes against the surface itself, as `contact_oracle` knows it."""

import contact_verdicts
import numpy as np
import pytest
from contact_scenes import FAMILIES, make_scene
from contact_surface import Surface

import fieldsim as fs
from fieldsim import launch

# Few families, since each compiles its own kernels; `python -m benchmarks contact` has them all.
SCENES = {
    "Gaussian points and polylines": 8,
    "Metaball points and segments": 8,
    "Newtonian and tapered segments, moving": 1,
}


@pytest.fixture(autouse=True)
def one_thread(monkeypatch):
    """What is small goes faster without a pool of threads."""
    monkeypatch.setattr(launch, "THREADS", 1)


# One in which searches that begin far out, where the field is faint, lead to another part of the surface.
FAR_OUT = "Cauchy triangles and segments", 53


@pytest.mark.parametrize(
    ("name", "number"), [*((name, number) for name, count in SCENES.items() for number in range(count)), FAR_OUT]
)
def test_balls_of_any_size_touch_first_where_and_when_the_surface_says(name, number):
    family = next(family for family in FAMILIES if family.full_name == name)
    verdict = contact_verdicts.judge_family(family, number)
    assert not verdict.overruled.any()
    assert not np.flatnonzero(verdict.missed).size
    assert not np.flatnonzero(verdict.false).size
    # A surface that moves is known at the ends of each step, and between them to second order: some 1e-7 of a
    # feature, and the smallest balls are a hundredth of one.
    assert verdict.worst < (1e-3 if family.moving else 1e-6)
    assert verdict.judged.sum() >= 5


def test_a_small_ball_touches_what_the_tails_of_rings_make_together():
    """Where it comes to the surface, searches from the feet of all elements end elsewhere."""
    family = next(family for family in FAMILIES if family.full_name == "Gaussian circles and arcs")
    bodies = make_scene(family, 1).bodies
    world = fs.World()
    world.add_body(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(0.5), mass=1.0))
    for body in bodies:
        world.add_body(body)
    world.add_particles([(0.4772, 0.3191, -0.2632)], [(0, 0, 0)], radius=0.0023, contact=fs.Bounce(1.0))
    simulation = fs.Simulation(world, fs.Leapfrog(1e-3))
    before = fs.energy(simulation.snapshot()).total
    simulation.advance(1.0)
    assert simulation.bounces == 1
    value, _ = Surface(bodies).value_and_gradient(simulation.events.positions, 0.0)
    assert value[0] == pytest.approx(1.0, abs=1e-8)
    np.testing.assert_allclose(fs.energy(simulation.snapshot()).total, before, rtol=1e-5)
