"""Contact: what it costs, whether first touches are those of the surface itself, and what is known in closed form.

- cost: rest against free motion; small pebbles that fall on the donut and bounce to rest, 2,000 and 100,000 of them.
- first touches in random scenes (see `first_touch`), energy and closed forms (see `contact_laws`).
"""

import time

import numpy as np

from benchmarks import contact_laws, first_touch
from benchmarks.motion import CLAY, DONUT, DT
from benchmarks.progress import progress
from fieldsim import sampling
from fieldsim.dynamics.integrators.splittings import Leapfrog
from fieldsim.dynamics.simulation import Simulation
from fieldsim.launch import THREADS
from fieldsim.potentials.field import Field
from fieldsim.potentials.kernels import Newtonian
from fieldsim.world.body import Body
from fieldsim.world.contact import Bounce
from fieldsim.world.motion import Spin
from fieldsim.world.world import World

PEBBLES = (2_000, 100_000)
RADIUS = 0.02
# Simulated times: of all runs, and of the one of many pebbles where the run is not a full one.
FALL, SHORT_FALL = 10.0, 1.0
# F may exceed 1 by so much at the lowest point of a ball that counts as outside: ten times what contact allows.
TOLERANCE = 1e-8
# Pieces in which the pebbles' time is run, so that progress can be told.
PIECES = 50


def rows(full: bool = False, repeats: int = 3):
    """Closed forms; ratios to free motion, measured in turn; the pebbles; energy; random scenes."""
    yield from contact_laws.closed_forms()
    yield from _rest(repeats)
    few, many = PEBBLES
    yield from _pebbles(few, FALL)
    yield from _pebbles(many, FALL if full else SHORT_FALL)
    yield from contact_laws.energy_rows(full)
    yield from first_touch.rows(full)


def _donut(positions, velocities, law, **options):
    world = World()
    world.add_body(Body(DONUT, gravity=Newtonian(), mass=1.0, surface=CLAY, **options))
    world.add_particles(positions, velocities, radius=RADIUS, contact=law)
    return world


def _rest(repeats):
    angle = np.linspace(0.0, 2 * np.pi, 1000, endpoint=False)
    rim = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(1000)])
    orbits = 2.5 * rim, 0.6 * np.cross((0.0, 0.0, 1.0), rim)
    settled = 1.3 * rim, np.zeros((1000, 3))
    worlds = {
        "free": _donut(*orbits, None),
        "far from the surface": _donut(*orbits, Bounce(0.2)),
        "at rest without friction": _donut(*settled, Bounce(0.2)),
        "at rest with friction": _donut(*settled, Bounce(0.2, friction=0.5)),
        "at rest with friction on a spinning donut": _donut(*settled, Bounce(0.2, friction=0.5), motion=Spin(rate=0.1)),
    }
    runs = {name: Simulation(world, Leapfrog(DT), threads=1) for name, world in worlds.items()}
    for simulation in runs.values():
        simulation.advance(2.0)
    best = dict.fromkeys(runs, 0.0)
    for _ in range(repeats):
        for name, simulation in runs.items():
            before, start = simulation.steps_done, time.perf_counter()
            simulation.advance(simulation.time + 1.0)
            best[name] = max(best[name], (simulation.steps_done - before) / (time.perf_counter() - start))
    for name, speed in best.items():
        yield {
            "name": f"pebbles {name}, 1000 particles x 1000 steps, 1 core",
            "value": speed,
            "unit": "particle-steps/s",
            "peer": "free",
            "peer_value": best["free"],
        }


def _pebbles(count, until):
    """Pebbles from a shell around the donut, at rest at first: bounces, friction, rest."""
    start = sampling.shell(count, radius=(1.4, 2.0), seed=1)
    world = _donut(start["positions"], start["velocities"], Bounce(0.5, friction=0.5))
    simulation = Simulation(world, Leapfrog(4e-3))
    inside_at_start = int(np.sum(_inside(world, simulation.positions[0])))
    simulation.advance(4e-3)
    before, begun = simulation.steps_done, time.perf_counter()
    for moment in progress(np.linspace(4e-3, until, PIECES), f"{count} pebbles, pieces of their time"):
        simulation.advance(moment)
    speed = (simulation.steps_done - before) / (time.perf_counter() - begun)
    census = simulation.census()
    name = f"{count} pebbles on the donut until t = {until:g}"
    cores = "1 core" if THREADS == 1 else f"{THREADS} cores"
    yield {"name": f"{name}, {cores}", "value": speed, "unit": "particle-steps/s"}
    figures = {
        "contacts": simulation.bounces,
        "inside at the start": inside_at_start,
        f"inside by more than {TOLERANCE:g} at the end": int(np.sum(_inside(world, simulation.positions[0]))),
        "in": count,
        "out": sum(census.values()),
        **{f"{state} at the end": number for state, number in census.items()},
    }
    for what, value in figures.items():
        yield {"name": f"{name}: {what}", "value": value, "unit": "pebbles" if what != "contacts" else "contacts"}


def _inside(world, centers):
    """Which balls reach into the surface by more than the tolerance, (N,)."""
    body = world.bodies[0]
    strength, fold = body.surface.surface_strength(1)
    field = Field(DONUT, body.surface.surface_kernel, strength * np.exp(fold))
    gradient = field.gradient(centers)
    size = np.maximum(np.linalg.norm(gradient, axis=1), np.finfo(float).tiny)
    return field.value(centers + RADIUS / size[:, None] * gradient) > 1.0 + TOLERANCE
