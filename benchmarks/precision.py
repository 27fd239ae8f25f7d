"""What precision costs: energy errors, wall time to reach them, and how they grow; REBOUND beside them.

`python -m benchmarks precision [--full]`; `python -m benchmarks.precision` draws docs/precision.png. Times are CPU time
of one core, kernels compiled beforehand.
"""

import dataclasses
import pathlib
import time

import numpy as np

from benchmarks import rebound_peer
from fieldsim.dynamics import integrators
from fieldsim.dynamics.radau import Radau
from fieldsim.dynamics.simulation import Simulation
from fieldsim.potentials.circle import Circle
from fieldsim.potentials.kernels import Newtonian
from fieldsim.potentials.point import Point
from fieldsim.potentials.segment import Segment
from fieldsim.world.body import Body
from fieldsim.world.world import World

BODIES = {
    "star": Body(Point((0, 0, 0)), gravity=Newtonian()),
    "needle": Body(Segment((-1, 0, 0), (1, 0, 0)), gravity=Newtonian(0.1)),
    "donut": Body(Circle((0, 0, 0), (0, 0, 1), 1.0), gravity=Newtonian()),
}
SPAN = 50.0
PERIOD = 2 * np.pi * 2.5**1.5
FIXED_STEPS = (0.4, 0.2, 0.1, 0.05, 0.025, 0.0125)
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)


def methods():
    """Every integrator of fixed steps, by name."""
    found = {}
    for name, thing in vars(integrators).items():
        fields = {f.name for f in dataclasses.fields(thing)} if dataclasses.is_dataclass(thing) else ()
        if "dt" in fields and isinstance(getattr(thing, "order", None), int):
            found[name] = thing
    return found


def rows(full: bool = False):
    """Kepler orbits, time to precision, growth of errors; full: 1e5 orbits of the donut."""
    yield from kepler_rows()
    yield from needle_rows()
    yield from growth_rows(100_000 if full else 1000)


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
    start, errors = energies(name, *starts), []
    simulation = ours(name, starts, integrator)
    clock = time.process_time()
    for moment in times:
        simulation.advance(moment)
        errors.append(energies(name, simulation.positions[0], simulation.velocities[0]) / start - 1)
    return np.array(errors), (time.process_time() - clock) / len(start)


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
        peer = {"peer": "REBOUND IAS15, C force", "peer_value": 1e6 * min(seconds for _, seconds in runs)}
        peer_error = float(np.sqrt(np.mean(runs[0][0] ** 2)))
    for tolerance in (1e-9, 1e-8):
        runs = [history("needle", starts, [SPAN], Radau(tolerance)) for _ in range(repeats)]
        name = f"needle, orbit to T = {SPAN:g}, Radau({tolerance:g})"
        yield {"name": name, "value": 1e6 * min(seconds for _, seconds in runs), "unit": "us"} | peer
        row = {"name": f"{name}, rms", "value": float(np.sqrt(np.mean(runs[0][0] ** 2))), "unit": "|dE/E|"}
        yield row | ({"peer": peer["peer"], "peer_value": peer_error} if peer else {})


def growth_rows(turns, count=8):
    """Energy errors after many orbits of the donut, the power of time with which they grow, and their cost.

    Medians over the orbits: one or two come close to the wire, where the energy itself is known less well.
    """
    times = PERIOD * np.unique(np.geomspace(1, turns, 40).round())
    starts = orbits(count)
    chosen = {"Radau(1e-09)": Radau(), "Radau(1e-08)": Radau(1e-8)}
    chosen |= {f"{name}(0.05)": method(0.05) for name, method in methods().items()}
    peer = {}
    if rebound_peer.library():
        peer = dict(zip(("size", "growth", "cost"), _growth(*peer_history("donut", starts, times), times), strict=True))
    for name, method in chosen.items():
        found = _growth(*history("donut", starts, times, method), times)
        for value, (key, unit) in zip(
            found, (("size", "|dE/E|"), ("growth", "power of time"), ("cost", "us/orbit")), strict=True
        ):
            row = {"name": f"donut, {turns} orbits, {name}, {key}", "value": value, "unit": unit}
            yield row | ({"peer": "REBOUND IAS15, C force", "peer_value": peer[key]} if peer else {})


def _growth(errors, seconds, times):
    """Median error over the last half of the time, its power of time, microseconds an orbit."""
    size = np.maximum(np.median(np.abs(errors), axis=1), 1e-17)
    late = times > times[-1] / 100
    power = np.polyfit(np.log(times[late]), np.log(size[late]), 1)[0]
    last = float(np.median(size[times > times[-1] / 2]))
    return last, float(power), 1e6 * seconds * PERIOD / times[-1]


def curves(count=16):
    """Work-precision curves on the needle: {name: [(us an orbit, largest rms error on the way), ...]}."""
    starts, times = orbits(count), np.linspace(0.0, SPAN, 11)[1:]

    def point(errors, seconds):
        return 1e6 * seconds, float(np.sqrt(np.mean(errors**2, axis=1)).max())

    result = {"Radau": [point(*history("needle", starts, times, Radau(tolerance))) for tolerance in TOLERANCES]}
    for name, method in methods().items():
        result[name] = [point(*history("needle", starts, times, method(dt))) for dt in FIXED_STEPS]
    if rebound_peer.library():
        few = [s[:8] for s in starts]
        result["REBOUND IAS15 (C force)"] = [point(*peer_history("needle", few, times))]
        result["REBOUND leapfrog (C force)"] = [
            point(*peer_history("needle", few, times, "leapfrog", dt)) for dt in FIXED_STEPS
        ]
    return result


def picture(path):
    """Draw the work-precision diagram."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(8, 5.5), dpi=110)
    for name, points in curves().items():
        axes.loglog(*zip(*points, strict=True), "s--" if "REBOUND" in name else "o-", ms=4, lw=1.2, label=name)
    axes.set(xlabel="CPU time an orbit to T = 50 [us], one core", ylabel="energy error, rms over orbits")
    axes.set_title("Orbits about a softened needle: work and precision")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7, ncols=2)
    figure.tight_layout()
    figure.savefig(path)


if __name__ == "__main__":
    picture(pathlib.Path(__file__).parents[1] / "docs" / "precision.png")
