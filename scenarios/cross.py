"""Orbits that hop between the arms of a cross-shaped planet.

hoppers: number of particles, each starting on an orbit around one arm
spread: how much their starting speeds differ
seed: seed of the starting places
"""

import numpy as np

import fieldsim as fs


def build(hoppers: int = 240, spread: float = 0.25, seed: int = 3) -> fs.Scenario:
    arms = [fs.Segment((-1.5, 0, 0), (1.5, 0, 0)), fs.Segment((0, -1.5, 0), (0, 1.5, 0))]
    cross = fs.Body(arms, gravity=fs.Newtonian(softening=0.05), mass=2.0, surface=fs.Material("slateblue", radius=0.16))
    world = fs.World(background=fs.Background(stars=0.1))
    world.add_body(cross)

    # Circles around an arm: the pull is towards it, speed^2 = distance * pull.
    rng = np.random.default_rng(seed)
    along, angle = rng.uniform(0.5, 1.2, hoppers), rng.uniform(0, 2 * np.pi, hoppers)
    radius = rng.uniform(0.35, 0.6, hoppers)
    outward = np.stack([np.zeros(hoppers), np.cos(angle), np.sin(angle)], axis=1)
    around = np.stack([np.zeros(hoppers), -np.sin(angle), np.cos(angle)], axis=1)
    places = radius[:, None] * outward + along[:, None] * (1, 0, 0)
    pull = -np.sum(cross.gravity_field().gradient(places) * outward, axis=1)
    speed = np.sqrt(radius * pull) * rng.uniform(1 - spread, 1 + spread, hoppers)
    for half, color in ((slice(0, None, 2), "amber"), (slice(1, None, 2), "ice")):
        side = 1 if color == "amber" else -1
        world.add_particles(
            places[half] * (side, 1, 1),
            (speed[:, None] * around)[half],
            radius=0.022,
            contact=fs.Bounce(0.9),
            color=color,
        )
    camera = fs.Camera.orbit(look_at=(0, 0, 0), radius=4.8, height=3.0, period=50, fov=40)
    return fs.Scenario(world, camera, integrator=fs.Leapfrog(dt=1e-3), duration=12.0, fps=30)


if __name__ == "__main__":
    fs.main(build)
