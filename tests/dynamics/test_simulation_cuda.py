"""Kernels of motion compile for CUDA on machines without a GPU; with one, they give what the CPU gives."""

import functools

import numpy as np
import pytest
import warp as wp

from fieldsim.dynamics.contact.release import release_kernel
from fieldsim.dynamics.integrators.splittings import Leapfrog
from fieldsim.dynamics.radau.kernels import dense_kernel, radau_kernel
from fieldsim.dynamics.simulation import Simulation
from fieldsim.dynamics.splitting.groups import ALONE
from fieldsim.dynamics.splitting.kernels import contact_kernel, splitting_kernel
from fieldsim.potentials.kernels import Newtonian
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.sources.elements import Sources
from fieldsim.sources.field import _field_kernel
from fieldsim.world.body import Body
from fieldsim.world.contact import Bounce
from fieldsim.world.material import Material
from fieldsim.world.motion import Spin
from fieldsim.world.world import World


def spinning_donut_with_a_bar():
    world = World()
    clay = Material(radius=0.2)
    world.add_body(Body(Circle((0, 0, 0), (0, 0, 1), 1.0), gravity=Newtonian(), surface=clay))
    world.add_body(Body(Segment((-1, 0, 0), (1, 0, 0)), gravity=Newtonian(), surface=clay, motion=Spin(rate=0.5)))
    rng = np.random.default_rng(0)
    start = rng.normal(size=(500, 3))
    start *= (rng.uniform(1.6, 2.5, 500) / np.linalg.norm(start, axis=1))[:, None]
    world.add_particles(start, 0.2 * rng.normal(size=(500, 3)), contact=Bounce(0.5))
    return world


# Of the kinds of formulas in the roles of gravity and of a surface.
KERNELS = {
    "splitting": lambda gravity, surface: splitting_kernel(gravity, False, ALONE),
    "force gradients": lambda gravity, surface: splitting_kernel(gravity, True, ALONE),
    "contact": lambda gravity, surface: contact_kernel(gravity, surface, False, ALONE),
    "contact, force gradients": lambda gravity, surface: contact_kernel(gravity, surface, True, ALONE),
    "release": lambda gravity, surface: release_kernel(surface),
    "field": lambda gravity, surface: _field_kernel(gravity),
    "radau": lambda gravity, surface: radau_kernel(gravity, ALONE),
    "dense radau": lambda gravity, surface: dense_kernel(gravity, ALONE),
}


@functools.cache
def kinds_of(role):
    return Sources(spinning_donut_with_a_bar(), role, 0.0).kinds_used


@pytest.mark.parametrize("name", KERNELS)
def test_every_kernel_compiles_for_cuda(name, compiles_for_cuda):
    compiles_for_cuda(KERNELS[name](kinds_of("gravity"), kinds_of("surface")).module)


@pytest.mark.skipif(not wp.is_cuda_available(), reason="no CUDA device")
def test_cuda_gives_what_the_cpu_gives():
    ends = []
    for device in ("cpu", "cuda"):
        simulation = Simulation(spinning_donut_with_a_bar(), Leapfrog(2e-3), device=device)
        simulation.advance(1.0)
        ends.append(simulation)
    # Before a bounce amplifies rounding; most particles have not bounced yet.
    free = (ends[0].bounce_counts[0] == 0) & (ends[1].bounce_counts[0] == 0)
    assert free.sum() > 100
    np.testing.assert_allclose(ends[0].positions[0][free], ends[1].positions[0][free], atol=1e-10)
    assert abs(ends[0].bounces - ends[1].bounces) <= 5
