"""Orbits under Radau with a full match in REBOUND: tadpoles of two circling masses, planets."""

import math
import time

import numpy as np

from benchmarks import rebound_peer
from fieldsim.dynamics.radau.radau import Radau
from fieldsim.dynamics.simulation import Simulation
from fieldsim.potentials.kernels import Newtonian
from fieldsim.potentials.primitives.point import Point
from fieldsim.world.body import Body
from fieldsim.world.world import World

# Of the lesser of the two masses that circle each other, at a distance of 1, in 2 pi.
SHARE = 1e-3
PEER = "REBOUND IAS15"
# Sun, Jupiter, Saturn, Uranus and Neptune: masses, places [AU] and velocities [AU / day] (Applegate et al. 1986).
GRAVITY = 0.01720209895**2
MASSES = np.array([1.00000597682, 1 / 1047.355, 1 / 3501.6, 1 / 22869.0, 1 / 19314.0])
PLACES = np.array(
    [
        [-4.06428567034226e-3, -6.08813756435987e-3, -1.66162304225834e-6],
        [3.40546614227466, 3.62978190075864, 3.42386261766577e-2],
        [6.60801554403466, 6.38084674585064, -1.36145963724542e-1],
        [11.1636331405597, 16.0373479057256, 3.61783279369958e-1],
        [-30.1777243405203, 1.91155314998064, -1.53887595621042e-1],
    ]
)
SPEEDS = np.array(
    [
        [6.69048890636161e-6, -6.33922479583593e-6, -3.13202145590767e-9],
        [-5.59797969310664e-3, 5.51815399480116e-3, -2.66711392865591e-6],
        [-4.17354020307064e-3, 3.99723751748116e-3, 1.67206320571441e-5],
        [-3.25884806151064e-3, 2.06438412905916e-3, -2.17699042180559e-5],
        [-2.17471785045538e-4, -3.11361111025884e-3, 3.58344705491441e-5],
    ]
)
JUPITER = 4332.6  # days


def rows(turns: int = 1000):
    """CPU seconds of so many orbits, and how well the planets keep their energy."""
    peers = rebound_peer.library() is not None
    yield from tadpole_rows(turns, peers)
    yield from planet_rows(turns, peers)


def tadpoles(count):
    """Positions and velocities of particles about the point L4."""
    angle = math.pi / 3 + np.linspace(-0.05, 0.1, count)
    x = np.stack([np.cos(angle) - SHARE, np.sin(angle), 0 * angle], axis=1)
    return x, np.stack([-np.sin(angle), np.cos(angle), 0.01 + 0 * angle], axis=1)


def tadpole_rows(turns, peers, count=5):
    """Tadpoles, the two masses moved by functions of time; the peer integrates these along."""

    def world():
        world = World()
        for radius, mass in ((-SHARE, 1 - SHARE), (1 - SHARE, SHARE)):
            motion = lambda t, r=radius: (r * math.cos(t), r * math.sin(t), 0.0)  # noqa: E731
            world.add_body(Body(Point((0, 0, 0)), gravity=Newtonian(), mass=mass, motion=motion))
        world.add_particles(*tadpoles(count))
        return world

    def peer():
        masses, radii = (1 - SHARE, SHARE), (-SHARE, 1 - SHARE)
        places = [[radius, 0, 0] for radius in radii], [[0, radius, 0] for radius in radii]
        return _peer(masses, *places, tadpoles(count))

    end = 2 * math.pi * turns
    yield _seconds(f"{count} tadpoles, {turns} orbits", lambda: _run(world(), end), peers and (peer, end))


def planet_rows(turns, peers):
    """Sun and outer planets, so many orbits of Jupiter."""

    def world():
        world = World()
        world.add_particles(PLACES, SPEEDS, gravity=Newtonian(), mass=MASSES, G=GRAVITY)
        return world

    def peer():
        return _peer(MASSES, PLACES, SPEEDS, g=GRAVITY)

    end, name = JUPITER * turns, f"Sun and outer planets, {turns} orbits of Jupiter"
    yield _seconds(name, lambda: _run(world(), end), peers and (peer, end))
    simulation = _run(world(), end)[0]
    start = energy(MASSES, PLACES, SPEEDS, GRAVITY)
    error = abs(energy(MASSES, simulation.positions[0], simulation.velocities[0], GRAVITY) / start - 1)
    row = {"name": f"{name}, energy", "value": float(error), "unit": "|dE/E|"}
    if peers:
        other = peer()
        other.integrate(end, exact_finish_time=0)
        states = ([getattr(p, name) for p in other.particles] for name in ("xyz", "vxyz"))
        row |= {"peer": PEER, "peer_value": float(abs(energy(MASSES, *map(np.array, states), GRAVITY) / start - 1))}
    yield row


def _run(world, end):
    """A simulation at its end, and the CPU seconds that it took."""
    simulation = Simulation(world, Radau(), threads=1)
    clock = time.process_time()
    simulation.advance(end)
    return simulation, time.process_time() - clock


def _seconds(name, run, peer, repeats=3):
    """The row of a run's CPU seconds, the best of some, kernels compiled beforehand."""
    run()
    row = {"name": name, "value": min(run()[1] for _ in range(repeats)), "unit": "s"}
    if peer:
        make, end = peer
        taken = []
        for _ in range(repeats):
            simulation, clock = make(), time.process_time()
            simulation.integrate(end)
            taken.append(time.process_time() - clock)
        row |= {"peer": PEER, "peer_value": min(taken)}
    return row


def _peer(masses, places, speeds, test_particles=((), ()), g=1.0):
    """A REBOUND simulation of masses that pull, and of test particles (positions, velocities)."""
    import rebound

    simulation = rebound.Simulation()
    simulation.integrator, simulation.G = "ias15", g
    for mass, x, v in zip(masses, places, speeds, strict=True):
        simulation.add(m=mass, **dict(zip(("x", "y", "z", "vx", "vy", "vz"), (*x, *v), strict=True)))
    simulation.N_active = len(masses)
    for x, v in zip(*test_particles, strict=True):
        simulation.add(**dict(zip(("x", "y", "z", "vx", "vy", "vz"), (*x, *v), strict=True)))
    return simulation


def energy(masses, x, v, g=1.0):
    """Of bare masses (N,) at x (N, 3) with velocities v (N, 3)."""
    i, j = np.triu_indices(len(masses), 1)
    pulls = g * masses[i] * masses[j] / np.linalg.norm(x[i] - x[j], axis=1)
    return 0.5 * masses @ np.einsum("ij,ij->i", v, v) - pulls.sum()
