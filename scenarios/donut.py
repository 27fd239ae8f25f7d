"""Pebbles fall through the hole of a donut planet; those that miss it bounce on the tube.

pebbles: number of pebbles in the cloud
restitution: share of the normal speed that a bounce keeps (0..1)
seed: seed of the cloud
"""

import fieldsim as fs


def build(pebbles: int = 400, restitution: float = 0.7, seed: int = 1) -> fs.Scenario:
    ring = fs.Circle(center=(0, 0, 0), normal=(0, 0, 1), radius=1.0)
    clay = fs.Material(color="terracotta", radius=0.25, blobbiness=-4)
    world = fs.World(background=fs.Background(stars=0.1))
    world.add_body(fs.Body(ring, gravity=fs.Newtonian(), mass=2.5, surface=clay))
    cloud = fs.sampling.shell(pebbles, radius=(1.7, 2.7), seed=seed)
    world.add_particles(**cloud, radius=0.03, contact=fs.Bounce(restitution), color="bone")
    camera = fs.Camera.orbit(look_at=(0, 0, 0), radius=5.6, height=3.0, period=40, fov=38)
    return fs.Scenario(world, camera, integrator=fs.Leapfrog(dt=1e-3), duration=6.0, fps=30)


if __name__ == "__main__":
    fs.main(build)
