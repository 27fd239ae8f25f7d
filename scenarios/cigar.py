"""Orbits around a spinning cigar: a still cloud of moons is stirred by the turning field.

moons: number of moons, on circles of 1.6 to 3 cigar half-lengths
turns: turns of the cigar during the film
seed: seed of the moons
"""

import math

import fieldsim as fs


def build(moons: int = 300, turns: float = 2.0, seed: int = 2, duration: float = 12.0) -> fs.Scenario:
    cigar = fs.Segment((-1, 0, 0), (1, 0, 0))
    spin = fs.Spin(axis=(0, 0, 1), rate=2 * math.pi * turns / duration)
    world = fs.World()
    world.add_body(
        fs.Body(cigar, gravity=fs.Newtonian(), mass=1.0, motion=spin, surface=fs.Material(color="copper", radius=0.22))
    )
    orbits = fs.sampling.orbits(moons, radius=(1.6, 3.0), tilt=0.35, mass=1.0, seed=seed)
    world.add_particles(**orbits, radius=0.03, contact=fs.Bounce(0.8), color="ice")
    camera = fs.Camera.orbit(look_at=(0, 0, 0), radius=6.0, height=3.2, period=60, fov=42)
    return fs.Scenario(world, camera, integrator=fs.Leapfrog(dt=2e-3), duration=duration, fps=30)


if __name__ == "__main__":
    fs.main(build)
