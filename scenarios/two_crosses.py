"""Two rigid crosses circle each other, spin each other up by their tides, and bounce whenever their arms meet.

speed: of each at the start, in units of that of a circular orbit
spin: how fast they turn at the start, in radians per second
"""

import math

import fieldsim as fs


def cross(name, color, side, speed, spin):
    """A cross of two arms of length 2 on one side of the middle."""
    arms = [fs.Segment((-1, 0, 0), (1, 0, 0)), fs.Segment((0, -1, 0), (0, 1, 0))]
    motion = fs.Rigid(
        position=(1.6 * side, 0, 0.15 * side),
        rotation=fs.Pose.turned((1, side, 0.3), 0.9).rotation,
        velocity=(0, speed * side, 0),
        angular_velocity=(0.3 * spin, spin * side, 0.5 * spin),
        inertia="solid",
    )
    skin = fs.Material(color, radius=0.17, blobbiness=-12)
    return fs.Body(arms, gravity=fs.Newtonian(softening=0.1), mass=1.0, surface=skin, motion=motion, name=name)


def build(speed: float = 0.55, spin: float = 0.5) -> fs.Scenario:
    world = fs.World(background=fs.Background(stars=0.2))
    circular = math.sqrt(1.0 / (2 * 3.2))
    world.add_body(cross("blue", "cornflowerblue", 1, speed * circular, spin))
    world.add_body(cross("amber", "amber", -1, speed * circular, spin))
    camera = fs.Camera.orbit(look_at=(0, 0, 0), radius=5.4, height=2.2, period=120, fov=40)
    return fs.Scenario(world, camera, integrator=fs.Leapfrog(dt=1e-3), duration=24.0, fps=30)


if __name__ == "__main__":
    fs.main(build)
