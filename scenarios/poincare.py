"""The ring problem's order and chaos: a Poincare section of orbits around a donut, all of one energy and spin.

Each orbit leaves a point where it rises through the ring's plane: distance from the axis, and speed away from it.
Regular orbits leave closed curves, chaotic ones dust. Colour: the largest Lyapunov exponent.

orbits: number of orbits
energy: energy of each, per unit mass
momentum: angular momentum about the axis, per unit mass
softening: softening length of the ring's pull, in its radii
duration: how long each is followed
"""

import numpy as np

import fieldsim as fs


def start(ring, orbits, energy, momentum):
    """Positions and velocities (orbits, 3) in the ring's plane, rising at several slopes, with the given invariants."""
    rho = np.linspace(0.01, 4.0, 4000)
    speed2 = 2 * (energy + ring.value(rho[:, None] * [1.0, 0.0, 0.0])) - (momentum / rho) ** 2
    allowed = rho[speed2 > 0]
    if not len(allowed):
        raise fs.InputError(f"no orbit has energy {energy:g} and momentum {momentum:g}; raise the energy")
    x = allowed[np.linspace(0, len(allowed) - 1, orbits).astype(int)]
    v = np.sqrt(np.interp(x, rho, speed2))
    slope = np.resize([0.0, 0.3, 0.6, 0.9], orbits)
    zero = np.zeros(orbits)
    return np.column_stack([x, zero, zero]), np.column_stack([v * slope, momentum / x, v * np.sqrt(1 - slope**2)])


def build(
    orbits: int = 60, energy: float = -0.4, momentum: float = 0.3, softening: float = 0.1, duration: float = 4000.0
) -> fs.Picture:
    ring = fs.Circle(center=(0, 0, 0), normal=(0, 0, 1), radius=1.0)
    kernel = fs.Newtonian(softening)
    world = fs.World()
    world.add_body(fs.Body(ring, gravity=kernel, mass=1.0))
    world.add_particles(*start(fs.gravity(ring, 1.0, kernel=kernel), orbits, energy, momentum))

    def draw(size):
        method = fs.BlanesMoan6(dt=0.04)
        chaos = fs.lyapunov(world, duration, method, samples=1).largest
        points = fs.poincare(world, fs.Section(normal=(0, 0, 1)), duration, method)
        (x, y, _), (vx, vy, _) = points.positions.T, points.velocities.T
        rho = np.hypot(x, y)
        colors = np.log10(np.maximum(chaos, 1e-4))[points.particles]
        labels = "distance from the axis", "speed away from the axis"
        title = f"Rising through the plane of a ring: E = {energy:g}, L = {momentum:g}"
        legend = "log10 of the largest Lyapunov exponent"
        outward = (x * vx + y * vy) / rho
        return fs.plots.section(rho, outward, colors, labels=labels, title=title, color_label=legend, size=size)

    return fs.Picture(draw, "a Poincare section")


if __name__ == "__main__":
    fs.main(build)
