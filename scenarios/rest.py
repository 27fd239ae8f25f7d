"""Pebbles rain onto a donut planet and stay where friction holds them.

pebbles: how many fall.
friction: Coulomb's coefficient; the slope that it holds is its arc tangent.
"""

import numpy as np

import fieldsim as fs


def build(pebbles: int = 900, friction: float = 0.8, seed: int = 3) -> fs.Scenario:
    ring = fs.Circle(center=(0, 0, 0), normal=(0, 0, 1), radius=1.0)
    clay = fs.Material(color="terracotta", radius=0.3, blobbiness=-4)
    world = fs.World(escape_radius=20.0)
    world.add_body(fs.Body(ring, gravity=fs.Newtonian(), mass=2.0, surface=clay))

    # Seven handfuls let go over the tube, one after the other: each a column of pebbles.
    rng = np.random.default_rng(seed)
    for handful, color in enumerate(("bone", "sand", "basalt", "ice", "moss", "copper", "amber")):
        count = pebbles // 7
        angle = 2 * np.pi * (handful / 7 + 0.03 * rng.normal(size=count))
        radius = 1.0 + 0.1 * rng.normal(size=count)
        height = 0.5 + 0.1 * handful + rng.uniform(0.0, 1.0, count)
        start = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
        law = fs.Bounce(0.45, friction=friction)
        world.add_particles(start, np.zeros((count, 3)), radius=0.022, contact=law, color=color)

    camera = fs.Camera(eye=(2.6, -2.6, 2.6), look_at=(0, 0, 0.1), fov=36)
    return fs.Scenario(world, camera, integrator=fs.Leapfrog(dt=2e-3), duration=8.0, fps=30)


if __name__ == "__main__":
    fs.main(build)
