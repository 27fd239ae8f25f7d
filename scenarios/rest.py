"""Pebbles rain onto a donut planet and stay where friction holds them; without it they would slide to its inner side.

pebbles: how many fall.
friction: Coulomb's coefficient; the steepest slope that it holds is its arc tangent.
"""

import numpy as np

import fieldsim as fs

COLORS = ("bone", "sand", "basalt", "ice", "moss", "amber")


def build(pebbles: int = 1500, friction: float = 0.9, seed: int = 3) -> fs.Scenario:
    ring = fs.Circle(center=(0, 0, 0), normal=(0, 0, 1), radius=1.0)
    clay = fs.Material(color="terracotta", radius=0.3, blobbiness=-4)
    world = fs.World(escape_radius=20.0)
    world.add_body(fs.Body(ring, gravity=fs.Newtonian(), mass=2.0, surface=clay))

    # Let go over the tube's upper and outer side, each colour over its own arc and a little higher than the last.
    rng = np.random.default_rng(seed)
    for index, color in enumerate(COLORS):
        count = pebbles // len(COLORS)
        around = 2 * np.pi * (index + rng.uniform(0.0, 1.0, count)) / len(COLORS)
        over = np.radians(rng.uniform(-30.0, 80.0, count))
        height = 0.4 + 0.08 * index + rng.uniform(0.0, 0.3, count)
        radius = 1.0 + height * np.cos(over)
        start = np.column_stack([radius * np.cos(around), radius * np.sin(around), height * np.sin(over)])
        law = fs.Bounce(0.5, friction=friction)
        world.add_particles(start, np.zeros((count, 3)), radius=0.02, contact=law, color=color)

    camera = fs.Camera(eye=(2.7, -2.7, 2.2), look_at=(0, 0, 0), fov=36)
    return fs.Scenario(world, camera, integrator=fs.Leapfrog(dt=2e-3), duration=5.0, fps=30)


if __name__ == "__main__":
    fs.main(build)
