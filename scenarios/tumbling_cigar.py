"""A rigid cigar falls through a donut's hole, to and fro; the tide makes it tumble, and the tube throws it back.

height: how far above the donut it starts
tilt: angle between the cigar and the axis of the donut, in degrees
aside: how far beside the axis it starts
"""

import math

import fieldsim as fs


def build(height: float = 1.3, tilt: float = 70.0, aside: float = 0.5) -> fs.Scenario:
    world = fs.World(background=fs.Background(stars=0.1))
    ring = fs.Circle(center=(0, 0, 0), normal=(0, 0, 1), radius=1.0)
    clay = fs.Material("terracotta", radius=0.25, blobbiness=-10)
    world.add_body(fs.Body(ring, gravity=fs.Newtonian(), mass=3.0, surface=clay))
    turned = fs.Pose.turned(axis=(0.2, 1, 0), angle=math.radians(tilt))
    start = fs.Rigid(
        position=(aside, 0, height), rotation=turned.rotation, angular_velocity=(0.4, 0.2, 0.3), inertia="solid"
    )
    cigar = fs.Segment((0, 0, -0.35), (0, 0, 0.35))
    leaf = fs.Material("gold", radius=0.09, blobbiness=-10)
    world.add_body(fs.Body(cigar, mass=0.01, surface=leaf, motion=start, name="cigar"))
    camera = fs.Camera.orbit(look_at=(0, 0, 0), radius=3.9, height=2.0, period=60, fov=40)
    return fs.Scenario(world, camera, integrator=fs.Leapfrog(dt=5e-4), duration=14.0, fps=30)


if __name__ == "__main__":
    fs.main(build)
