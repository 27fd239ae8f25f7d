"""How fast particles move: particle-steps a second of wall time, float64, kernels compiled beforehand."""

import math
import time

import numpy as np

from benchmarks import rebound_peer
from fieldsim.dynamics.integrators.splittings import BlanesMoan6, Leapfrog, Omelyan4, Omelyan6
from fieldsim.dynamics.simulation import Simulation
from fieldsim.launch import THREADS
from fieldsim.potentials.kernels import Newtonian
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.world.body import Body
from fieldsim.world.contact import Bounce
from fieldsim.world.material import Material
from fieldsim.world.motion import Spin
from fieldsim.world.world import World

DONUT = Circle((0, 0, 0), (0, 0, 1), 1.0)
CIGAR = Segment((-1, 0, 0), (1, 0, 0))
DT = 1e-3
CLAY = Material(radius=0.25, blobbiness=-4.0)


def rows(repeats: int = 3):
    """Particle-steps a second, the best of `repeats` runs."""
    every = f"{THREADS} cores"
    free = [
        (name, count, steps, threads, {"skeleton": skeleton})
        for name, skeleton in (("donut", DONUT), ("cigar", CIGAR))
        for count, steps in ((1000, 1000), (100_000, 20))
        for threads in (1, THREADS)
    ]
    for name, count, steps, threads, options in (
        *free,
        ("spinning cigar", 1000, 1000, 1, {"skeleton": CIGAR, "motion": Spin()}),
        ("donut with bounces", 1000, 1000, 1, {"skeleton": DONUT, "surface": CLAY}),
        ("donut with bounces", 1000, 1000, THREADS, {"skeleton": DONUT, "surface": CLAY}),
    ):
        simulation = _simulation(count, threads, options)
        cores = "1 core" if threads == 1 else every
        yield {
            "name": f"{name}, {count} particles x {steps} steps, {cores}",
            "value": _speed(simulation, steps, repeats),
            "unit": "particle-steps/s",
        }
    for method in (Leapfrog, BlanesMoan6, Omelyan4, Omelyan6):
        simulation = _simulation(1000, 1, {"skeleton": DONUT}, method)
        yield {
            "name": f"donut, {method.__name__}, order {method.order}, 1000 particles x 200 steps, 1 core",
            "value": method.evaluations * _speed(simulation, 200, repeats),
            "unit": "evaluations/s",
        }
    yield from _beside_rebound(repeats)
    simulation = _settled(1000)
    yield {
        "name": "pebbles at rest on the donut, 1000 particles x 1000 steps, 1 core",
        "value": _speed(simulation, 1000, repeats),
        "unit": "particle-steps/s",
    }


def _beside_rebound(repeats):
    """Time of REBOUND, with a force in C, over ours, in turns on one core."""
    if not rebound_peer.library():
        return
    for name, skeleton in (("donut", DONUT), ("needle", CIGAR)):
        for count, steps in ((1000, 1000), (100_000, 10)):
            ours = _simulation(count, 1, {"skeleton": skeleton})
            theirs = rebound_peer.swarm(name, ours.positions[0], ours.velocities[0], DT)
            yield {
                "name": f"{name}, leapfrog, {count} particles: REBOUND's time with a force in C over ours",
                "value": _ratio(theirs.steps, ours, steps, repeats),
                "unit": "x",
            }
    positions, velocities = np.random.default_rng(0).normal(size=(2, 1000, 3))
    world = World()
    world.add_particles(positions, 0.1 * velocities, gravity=Newtonian(0.05), mass=1e-3)
    theirs = rebound_peer.cluster(positions, 0.1 * velocities, 1e-3, 0.05, DT)
    yield {
        "name": "1000 particles that pull each other, leapfrog: REBOUND's time over ours",
        "value": _ratio(theirs.steps, Simulation(world, Leapfrog(DT), threads=1), 20, repeats),
        "unit": "x",
    }


def _ratio(theirs, simulation, steps, repeats):
    """The least time in which `theirs` takes `steps` steps over that of a simulation, in turns."""
    simulation.advance(simulation.time + DT)  # compiles
    best = [math.inf, math.inf]
    for _ in range(repeats):
        for k, run in enumerate((theirs, lambda n: simulation.advance(simulation.time + n * DT))):
            start = time.process_time()
            run(steps)
            best[k] = min(best[k], time.process_time() - start)
    return best[0] / best[1]


def falling(count):
    """Places and velocities (N, 3) of particles that fall from a shell of radii 2 to 3."""
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    positions = directions * rng.uniform(2.0, 3.0, (count, 1))
    return positions, 0.2 * np.cross(positions, (0, 0, 1))


def _simulation(count, threads, options, method=Leapfrog):
    """Particles that fall around one body; they bounce if it has a surface."""
    world = World()
    world.add_body(Body(gravity=Newtonian(), mass=1.0, **options))
    contact = Bounce(0.6) if "surface" in options else None
    world.add_particles(*falling(count), contact=contact)
    return Simulation(world, method(DT), threads=threads)


def _settled(count):
    """Pebbles that lie along the outer equator of the donut, where its pull is straight down."""
    angle = np.linspace(0.0, 2 * np.pi, count, endpoint=False)
    rim = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(count)])
    world = World()
    world.add_body(Body(DONUT, gravity=Newtonian(), mass=1.0, surface=CLAY))
    world.add_particles(1.3 * rim, np.zeros((count, 3)), contact=Bounce(0.2))
    simulation = Simulation(world, Leapfrog(DT), threads=1)
    simulation.advance(2.0)
    return simulation


def _speed(simulation, steps, repeats):
    simulation.advance(simulation.time + DT)  # compiles
    best = 0.0
    for _ in range(repeats):
        before, start = simulation.steps_done, time.perf_counter()
        simulation.advance(simulation.time + steps * DT)
        best = max(best, (simulation.steps_done - before) / (time.perf_counter() - start))
    return best
