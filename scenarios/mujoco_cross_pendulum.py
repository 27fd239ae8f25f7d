"""A double pendulum hung on a cross swings in the field of its arms, in front of them, and keeps its energy.

first: angle of the upper rod from straight down at the start, in degrees
second: angle of the lower rod
"""

import math

import numpy as np

import fieldsim as fs

MODEL = """
<mujoco>
  <option gravity="0 0 0" integrator="RK4" timestep="0.001"><flag contact="disable"/></option>
  <default><geom rgba="0.75 0.78 0.85 1"/></default>
  <worldbody>
    <geom type="cylinder" fromto="0 0 1.2 0 -0.42 1.2" size="0.03" rgba="0.3 0.32 0.36 1"/>
    <body name="upper" pos="0 -0.34 1.2">
      <joint name="shoulder" axis="0 1 0"/>
      <geom type="cylinder" fromto="0 -0.04 0 0 0.04 0" size="0.06" mass="0.05"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.55" size="0.022" mass="0.1"/>
      <geom type="sphere" pos="0 0 -0.55" size="0.07" mass="0.4" rgba="0.85 0.4 0.3 1"/>
      <body name="lower" pos="0 -0.1 -0.55">
        <joint name="elbow" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0.1 0 0 0 0" size="0.03" mass="0.02"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.45" size="0.018" mass="0.08"/>
        <geom type="sphere" name="bob" pos="0 0 -0.45" size="0.1" mass="1" rgba="0.95 0.72 0.25 1"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def build(first: float = 100.0, second: float = 140.0) -> fs.Scenario:
    world = fs.World(background=fs.Background(stars=0.1))
    arms = [fs.Segment((-1.2, 0, 0), (1.2, 0, 0)), fs.Segment((0, 0, -1.2), (0, 0, 1.2))]
    stone = fs.Material("slategray", radius=0.16, blobbiness=-4)
    world.add_body(fs.Body(arms, gravity=fs.Newtonian(), mass=4.0, surface=stone))

    def start(model, data):
        """Bent aside; the elbow's angle counts from the upper rod."""
        data.qpos[:] = np.radians((first, second - first))

    camera = fs.Camera(lambda t: (1.6 * math.sin(0.15 * t) + 0.5, -4.4, 1.3), look_at=(0, -0.2, 0.45), fov=39)
    return fs.mujoco.Experiment(world, camera, model=MODEL, start=start, duration=12.0)


if __name__ == "__main__":
    fs.main(build)
