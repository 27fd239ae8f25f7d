"""Three rings of moons around a spinning cigar: its turning field stirs the inner one and hardly moves the outer.

moons: number of moons in each ring
turns: turns of the cigar during the film
seed: seed of the moons
"""

import math

import fieldsim as fs


def build(moons: int = 160, turns: float = 3.0, seed: int = 2, duration: float = 12.0) -> fs.Scenario:
    cigar = fs.Segment((-1, 0, 0), (1, 0, 0))
    spin = fs.Spin(axis=(0, 0, 1), rate=2 * math.pi * turns / duration)
    copper = fs.Material(color="copper", radius=0.22)
    world = fs.World(background=fs.Background(stars=0.1))
    world.add_body(fs.Body(cigar, gravity=fs.Newtonian(), mass=2.0, motion=spin, surface=copper))
    for ring, color in enumerate(("amber", "bone", "ice")):
        inner = 1.45 + 0.45 * ring
        orbits = fs.sampling.orbits(moons, radius=(inner, inner + 0.12), tilt=0.05, mass=2.0, seed=seed + ring)
        world.add_particles(**orbits, radius=0.03, contact=fs.Bounce(0.8), color=color)
    camera = fs.Camera.orbit(look_at=(0, 0, 0), radius=5.0, height=3.6, period=60, fov=40)
    return fs.Scenario(world, camera, integrator=fs.Leapfrog(dt=2e-3), duration=duration, fps=30)


if __name__ == "__main__":
    fs.main(build)
