"""Two satellites on a tether circle a ring: the tide pulls the tether taut and turns it towards the ring, to and fro.

length: of the tether
tilt: angle between the tether and the direction to the ring's centre at the start, in degrees
distance: of the orbit from the centre
"""

import math

import numpy as np

import fieldsim as fs

LINKS = 12
SATELLITE = """
<geom type="box" pos="{x} 0 0" size="0.06 0.06 0.06" mass="1" rgba="0.85 0.7 0.35 1"/>
<geom type="box" pos="{x} 0 0" size="0.015 0.25 0.05" mass="0.1" rgba="0.25 0.4 0.75 1"/>
"""


def tethered(length: float) -> str:
    """MJCF along x, its middle at the origin: a satellite, links hung each on the one before, the other satellite."""
    link = length / LINKS
    inner = f'<body pos="{link} 0 0"><joint type="ball"/>{SATELLITE.format(x=0.06)}</body>'
    for k in reversed(range(LINKS)):
        place = f"{link if k else 0} 0 0"
        line = f'<geom type="capsule" fromto="0 0 0 {link} 0 0" size="0.01" mass="0.004" rgba="0.95 0.9 0.8 1"/>'
        inner = f'<body pos="{place}"><joint type="ball"/>{line}{inner}</body>'
    return f'<body pos="{-length / 2} 0 0"><freejoint/>{SATELLITE.format(x=-0.06)}{inner}</body>'


def build(length: float = 0.6, tilt: float = 40.0, distance: float = 3.5) -> fs.Scenario:
    world = fs.World(background=fs.Background(stars=0.1))
    ring = fs.Circle(center=(0, 0, 0), normal=(0, 0, 1), radius=1.0)
    clay = fs.Material("terracotta", radius=0.25, blobbiness=-8)
    planet = world.add_body(fs.Body(ring, gravity=fs.Newtonian(), mass=14.0, surface=clay))
    turn = math.radians(tilt)
    middle, arm = np.array((distance, 0, 0)), np.array((math.cos(turn), math.sin(turn), 0)) * (length / 2 + 0.06)
    pulls = planet.gravity_field().gradient([middle - arm, middle + arm])
    rate = math.sqrt(-pulls[:, 0].mean() / distance)  # of a circular orbit

    def start(model, data):
        """On the orbit, turning once per round, as the tether does that points to the ring."""
        x, y, _ = -length / 2 / np.linalg.norm(arm) * arm
        data.qpos[:7] = distance + x, y, 0, math.cos(turn / 2), 0, 0, math.sin(turn / 2)
        data.qvel[:6] = -rate * y, rate * (distance + x), 0, 0, 0, rate

    option = '<option gravity="0 0 0" integrator="RK4" timestep="0.002"><flag contact="disable"/></option>'
    model = f"<mujoco>{option}<worldbody>{tethered(length)}</worldbody></mujoco>"

    def along(t, far, high):
        """A point above the orbit that goes round as the satellites do."""
        return far * math.cos(rate * t), far * math.sin(rate * t), high

    camera = fs.Camera(lambda t: along(t - 0.5, 1.6 * distance, 1.9), lambda t: along(t, 0.75 * distance, 0.1), fov=36)
    return fs.mujoco.Experiment(world, camera, model=model, start=start, duration=12.0)


if __name__ == "__main__":
    fs.main(build)
