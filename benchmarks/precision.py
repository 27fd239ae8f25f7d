"""What precision costs: energy errors, wall time to reach them, and how they grow; REBOUND beside them.

`python -m benchmarks precision [--full]` writes docs/motion.md with its pictures docs/precision.png and docs/energy.png
from the same figures. Times are CPU time of one core, kernels compiled beforehand.
"""

import dataclasses
import time

import numpy as np

from benchmarks import celestial, motion_page, rebound_peer
from fieldsim.dynamics.integrators.splittings import Splitting
from fieldsim.dynamics.radau.radau import Radau
from fieldsim.dynamics.simulation import Simulation
from fieldsim.potentials.kernels import Newtonian
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.world.body import Body
from fieldsim.world.world import World

BODIES = {
    "star": Body(Point((0, 0, 0)), gravity=Newtonian()),
    "needle": Body(Segment((-1, 0, 0), (1, 0, 0)), gravity=Newtonian(0.1)),
    "donut": Body(Circle((0, 0, 0), (0, 0, 1), 1.0), gravity=Newtonian()),
}
SPAN = 50.0
PERIOD = 2 * np.pi * 2.5**1.5
# Steps of the long runs around the donut, and of the work-precision curves.
STEP = 0.05
LONG = ("Radau(1e-09)", "Leapfrog(0.05)", "Omelyan6(0.05)", "BlanesMoan6(0.05)")
FIXED_STEPS = (0.4, 0.2, 0.1, 0.05, 0.025, 0.0125)
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)


PEER = "REBOUND IAS15, C force"


def methods():
    """Every integrator of fixed steps, by name."""
    return {method.__name__: method for method in Splitting.__subclasses__()}


def rows(full: bool = False):
    """Time to precision, growth of errors; full: 1e5 orbits of the donut, too. Writes docs/motion.md."""
    yield from kepler_rows()
    yield from needle_rows()
    yield from celestial.rows()
    runs = growth_runs(1000)
    yield from growth_rows(runs)
    long = growth_runs(100_000, LONG) if full else {}
    yield from growth_rows(long)
    motion_page.write(curves(), runs, long)


def directions(count, seed=0):
    """Pairs of perpendicular unit vectors."""
    rng = np.random.default_rng(seed)
    u = rng.normal(size=(count, 3))
    u /= np.linalg.norm(u, axis=1)[:, None]
    w = np.cross(u, rng.normal(size=(count, 3)))
    return u, w / np.linalg.norm(w, axis=1)[:, None], rng


def orbits(count):
    """Starts of inclined, mildly eccentric orbits, 2 to 3.5 from the origin."""
    u, w, rng = directions(count)
    radius = rng.uniform(2.0, 3.5, (count, 1))
    return radius * u, rng.uniform(0.85, 1.1, (count, 1)) * w / np.sqrt(radius)


def ours(name, starts, integrator):
    """A simulation, its kernels compiled."""
    simulations = []
    for _ in range(2):
        world = World()
        world.add_body(BODIES[name])
        world.add_particles(*starts)
        simulations.append(Simulation(world, integrator, threads=1))
    simulations[0].advance(1e-3)
    return simulations[1]


def energies(name, x, v):
    """Energies per mass, (N,)."""
    x, v = np.asarray(x), np.asarray(v)
    field = -1 / np.linalg.norm(x, axis=1) if name == "star" else -BODIES[name].gravity_field().value(x)
    return 0.5 * np.einsum("ij,ij->i", v, v) + field


def history(name, starts, times, integrator):
    """Relative energy errors (times, N) of a run and the CPU seconds of each particle, (errors, seconds)."""
    start, errors, seconds = energies(name, *starts), [], 0.0
    simulation = ours(name, starts, integrator)
    for moment in times:
        clock = time.process_time()
        simulation.advance(moment)
        seconds += time.process_time() - clock
        errors.append(energies(name, simulation.positions[0], simulation.velocities[0]) / start - 1)
    return np.array(errors), seconds / len(start)


def peer_history(name, starts, times, integrator="ias15", dt=1e-2):
    """The same of REBOUND, which stops at its own steps after each time."""
    errors = []
    seconds = 0.0
    for x, v in zip(*starts, strict=True):
        # The force follows one particle at a time, so that each has a simulation of its own.
        simulation = rebound_peer.orbit(name, x, v, integrator, dt)
        states = [rebound_peer.state(simulation)]
        for moment in times:
            clock = time.process_time()
            simulation.integrate(moment, exact_finish_time=0)
            seconds += time.process_time() - clock
            states.append(rebound_peer.state(simulation))
        values = energies(name, *map(np.array, zip(*states, strict=True)))
        errors.append(values[1:] / values[0] - 1)
    return np.array(errors).T, seconds / len(errors)


def kepler_rows(count=4, turns=1000):
    """Largest energy errors over 1000 orbits about a star, of one along the axes and some turned anyhow."""
    times = 2 * np.pi * turns * np.arange(1, 201) / 200 * 0.9997
    u, w, _ = directions(count)
    u[0], w[0] = (1, 0, 0), (0, 1, 0)
    for e in (0.0, 0.5, 0.9):
        starts = (1 - e) * u, np.sqrt((1 + e) / (1 - e)) * w
        largest = np.abs(history("star", starts, times, Radau())[0]).max(axis=0)
        peer = [None] * 2
        if rebound_peer.library():
            errors = np.abs(peer_history("star", starts, times)[0]).max(axis=0)
            peer = [float(errors[0]), float(errors.max())]
        for kind, value, other in zip(
            ("along the axes", f"largest of {count}"), (largest[0], largest.max()), peer, strict=True
        ):
            row = {"name": f"Kepler, e = {e}, {turns} orbits, {kind}", "value": float(value), "unit": "|dE/E|"}
            yield row | ({"peer": "REBOUND IAS15", "peer_value": other} if other else {})


def needle_rows(count=64, repeats=5):
    """CPU time of an orbit about the softened needle at errors of rounding."""
    starts = orbits(count)
    peer = {}
    if rebound_peer.library():
        runs = [peer_history("needle", [s[:16] for s in starts], [SPAN]) for _ in range(3)]
        peer = {"peer": PEER, "peer_value": 1e6 * min(seconds for _, seconds in runs)}
        peer_error = float(np.sqrt(np.mean(runs[0][0] ** 2)))
    for tolerance in (1e-9, 1e-8):
        runs = [history("needle", starts, [SPAN], Radau(tolerance)) for _ in range(repeats)]
        name = f"needle, orbit to T = {SPAN:g}, Radau({tolerance:g})"
        yield {"name": name, "value": 1e6 * min(seconds for _, seconds in runs), "unit": "us"} | peer
        row = {"name": f"{name}, rms", "value": float(np.sqrt(np.mean(runs[0][0] ** 2))), "unit": "|dE/E|"}
        yield row | ({"peer": peer["peer"], "peer_value": peer_error} if peer else {})


@dataclasses.dataclass(frozen=True)
class Run:
    """Orbits of the donut: when they were looked at, relative energy errors (times, N), CPU seconds of each."""

    times: np.ndarray
    errors: np.ndarray
    seconds: float

    @property
    def turns(self):
        """Orbits so far, at each look."""
        return self.times / PERIOD

    @property
    def sizes(self):
        """Median error over the orbits: one or two come close to the wire, where energy itself is known less well."""
        return np.maximum(np.median(np.abs(self.errors), axis=1), 1e-17)

    @property
    def summary(self):
        """Median error over the last half of the time, its power of time, microseconds an orbit."""
        late = self.times > self.times[-1] / 100
        power = np.polyfit(np.log(self.times[late]), np.log(self.sizes[late]), 1)[0]
        last = float(np.median(self.sizes[self.times > self.times[-1] / 2]))
        return last, float(power), 1e6 * self.seconds * PERIOD / self.times[-1]


def growth_runs(turns, names=None, count=8):
    """Many orbits of the donut under the integrators of these names (default all) and under the peer, by name."""
    times = PERIOD * np.unique(np.geomspace(1, turns, 40).round())
    starts = orbits(count)
    chosen = {f"Radau({tolerance:g})": Radau(tolerance) for tolerance in (1e-9, 1e-8)}
    chosen |= {f"{name}({STEP})": method(STEP) for name, method in methods().items()}
    chosen = {name: method for name, method in chosen.items() if names is None or name in names}
    runs = {name: Run(times, *history("donut", starts, times, method)) for name, method in chosen.items()}
    if rebound_peer.library():
        runs[PEER] = Run(times, *peer_history("donut", starts, times))
    return runs


def growth_rows(runs):
    """Energy errors after many orbits of the donut, the power of time with which they grow, and their cost."""
    peer = runs[PEER].summary if PEER in runs else (None,) * 3
    kinds = (("size", "|dE/E|"), ("growth", "power of time"), ("cost", "us/orbit"))
    for name, run in runs.items():
        if name != PEER:
            for value, other, (key, unit) in zip(run.summary, peer, kinds, strict=True):
                row = {"name": f"donut, {run.turns[-1]:.0f} orbits, {name}, {key}", "value": value, "unit": unit}
                yield row | ({"peer": PEER, "peer_value": other} if other else {})


def curves(count=128):
    """Work-precision curves on the needle: {name: [(us an orbit, rms error at the end), ...]}."""
    starts, times = orbits(count), [SPAN]

    def point(errors, seconds):
        return 1e6 * seconds, float(np.sqrt(np.mean(errors**2)))

    result = {"Radau": [point(*history("needle", starts, times, Radau(tolerance))) for tolerance in TOLERANCES]}
    for name, method in methods().items():
        result[name] = [point(*history("needle", starts, times, method(dt))) for dt in FIXED_STEPS]
    if rebound_peer.library():
        few = [s[:16] for s in starts]
        result[PEER] = [point(*peer_history("needle", few, times))]
        result["REBOUND leapfrog, C force"] = [
            point(*peer_history("needle", few, times, "leapfrog", dt)) for dt in FIXED_STEPS
        ]
    return result
