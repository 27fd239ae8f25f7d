"""Balls that touch at several places at once: wider than a donut's hole, on two rails, between a planet and its ring.

restitution: the factor on the speed with which they leave what they hit.
friction: Coulomb's coefficient.
"""

import numpy as np

import fieldsim as fs

# Far below: what pulls all balls down, nearly in parallel.
DEPTH = 1000.0


def build(restitution: float = 0.5, friction: float = 0.3) -> fs.Scenario:
    world = fs.World()
    world.add_body(fs.Body(fs.Point((0, 0, -DEPTH)), gravity=fs.Newtonian(), mass=DEPTH**2))

    def body(skeleton, color, radius):
        world.add_body(fs.Body(skeleton, surface=fs.Material(color=color, radius=radius)))

    body(fs.Circle((-3.4, 0, 0), (0, 0, 1), 1.0), "terracotta", 0.25)
    body([fs.Segment((x, -1.6, 0.7), (x, 1.6, -0.1)) for x in (-0.3, 0.3)], "sand", 0.08)
    body(fs.Point((3.2, 0, -0.2)), "ice", 0.8)
    body(fs.Circle((3.2, 0, 0.1), (0, 0, 1), 1.2), "amber", 0.05)

    law = fs.Bounce(restitution, friction=friction, rolling=True)
    world.add_particles([(-3.4, 0.01, 1.6)], [(0, 0, 0)], radius=0.9, contact=law, color="bone")
    world.add_particles([(0.005, -1.2, 1.18)], [(0, 0, 0)], radius=0.5, contact=law, color="moss")
    around = 2 * np.pi * np.arange(9) / 9
    start = np.column_stack([3.2 + 1.05 * np.cos(around), 1.05 * np.sin(around), 1.2 + 0.1 * np.arange(9)])
    world.add_particles(start, np.zeros((9, 3)), radius=0.2, contact=law, color="basalt")

    world.add_shape(fs.Ground(-1.4), fs.Material("white"))
    camera = fs.Camera(eye=(0.4, -9.0, 4.2), look_at=(0, 0, 0), fov=36)
    return fs.Scenario(world, camera, integrator=fs.Leapfrog(dt=2e-3), duration=6.0, fps=30)


if __name__ == "__main__":
    fs.main(build)
