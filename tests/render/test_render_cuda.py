"""Kernels of the ray tracer compile for CUDA on machines without a GPU; with one, pictures are the CPU's."""

import numpy as np
import pytest
import warp as wp

from fieldsim.potentials import registry
from fieldsim.potentials.kernels import Gaussian, SoftObject
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.primitives.tapered import TaperedSegment
from fieldsim.render.camera import Camera
from fieldsim.render.renderer import render
from fieldsim.render.shading import subtle
from fieldsim.render.shading.lights import shade_kernel
from fieldsim.render.shading.reflection import ray_kernel
from fieldsim.render.solvers.by_name import SOLVERS
from fieldsim.render.solvers.primary import trace_kernel
from fieldsim.render.solvers.referee import describe_kernel, march_kernel
from fieldsim.world.body import Body
from fieldsim.world.material import Material
from fieldsim.world.world import World

# Every primitive and every kernel; all pairs would take minutes.
KINDS = tuple(
    formula.kind
    for formula in registry.FORMULAS.values()
    if formula.primitive is Point or (formula.kernel is Gaussian) or formula.primitive is TaperedSegment
)


@pytest.mark.parametrize("kernel_of", [trace_kernel, shade_kernel, ray_kernel, subtle.shade_kernel])
@pytest.mark.parametrize("in_scratch", [False, True])
def test_tracing_and_shading_compile_for_cuda(kernel_of, in_scratch, compiles_for_cuda):
    # In scratch only where the intervals live differs; few formulas show that.
    kinds = KINDS[:1] if in_scratch else KINDS
    compiles_for_cuda(kernel_of(kinds, in_scratch).module)


@pytest.mark.parametrize("solver", sorted(SOLVERS.keys() - {"hermite", "referee"}))
def test_solvers_compile_for_cuda(solver, compiles_for_cuda):
    kinds = (registry.FORMULAS[SoftObject, Point].kind,)  # which all of them know
    compiles_for_cuda(trace_kernel(kinds, **SOLVERS[solver].options).module)


@pytest.mark.parametrize("kernel_of", [march_kernel, describe_kernel])
def test_the_referee_compiles_for_cuda(kernel_of, compiles_for_cuda):
    # One formula shows it; the formulas themselves compile above, and in float64 where fields are tested.
    compiles_for_cuda(kernel_of(KINDS[:1]).module)


@pytest.mark.parametrize(
    "name", ["scene.candidates", "renderer", "shading.reflection", "shading.fog", "solids.overlay"]
)
def test_kernels_of_modules_compile_for_cuda(name, compiles_for_cuda):
    compiles_for_cuda(f"fieldsim.render.{name}")


@pytest.mark.skipif(not wp.is_cuda_available(), reason="no CUDA device")
def test_cuda_draws_what_the_cpu_draws():
    world = World()
    world.add_body(Body([Segment((-1, 0, 0), (1, 0, 0)), Point((0, 0.5, 0.6))], surface=Material()))
    world.add_particles([(0.3, -0.8, 0.5)], [(0, 0, 0)], radius=0.1)
    camera = Camera(eye=(1.0, -4.0, 1.5))
    pictures = [render(world.at(0.0), camera, size=(160, 120), device=device).astype(int) for device in ("cpu", "cuda")]
    different = np.abs(pictures[0] - pictures[1]).max(axis=2) > 8
    assert different.mean() < 0.002
