"""Models, planets and cameras that the tests of MuJoCo in pictures share."""

import pathlib

import mujoco
import numpy as np

import fieldsim as fs
from fieldsim.mujoco.models import model_of

SCENARIOS = pathlib.Path(__file__).parents[1] / "scenarios"
HUMANOID = SCENARIOS / "humanoid.xml"
DONUT = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)
CLAY = fs.Material(radius=0.25, blobbiness=-8.0)
PLANET = fs.Body(DONUT, gravity=fs.Newtonian(), mass=1.0, surface=CLAY, name="donut")
CAMERA = fs.Camera((2.5, -3.5, 2.0), fov=45.0)
SIZE = (96, 72)

# One geom of every type that is drawn, each turned.
ALL_KINDS = """
<mujoco>
  <option gravity="0 0 0"/>
  <asset>
    <mesh name="tent" vertex="0 0 0  .6 0 0  0 .6 0  .6 .6 0  .3 .3 .5"
      face="0 2 1  1 2 3  0 1 4  1 3 4  3 2 4  2 0 4"/>
    <material name="gold" rgba="1 .8 .2 1" specular=".7" shininess=".5"/>
  </asset>
  <worldbody>
    <geom name="floor" type="plane" pos="0 0 -.8" size="3 2 1" euler="4 5 0"/>
    <geom type="sphere" pos="-1.4 0 0" size=".3" material="gold"/>
    <body pos="-.7 .3 .4" euler="30 40 10"><freejoint/><geom type="capsule" size=".15 .3" euler="20 0 0"/></body>
    <body pos="0 0 .5" euler="10 50 70"><freejoint/><geom type="ellipsoid" size=".4 .25 .15" rgba="1 0 0 1"/></body>
    <body pos=".8 .2 .1" euler="60 20 10"><freejoint/>
      <geom type="cylinder" size=".2 .3" material="gold" rgba="0 1 0 1"/></body>
    <body pos="0 -.9 -.2" euler="15 25 35"><freejoint/><geom type="box" size=".3 .2 .15"/></body>
    <body pos="1.2 -.9 .3" euler="15 35 5"><freejoint/><geom type="mesh" mesh="tent"/></body>
    <body pos="0 0 1.2"><freejoint/><geom size=".3" group="3"/><geom size=".2" rgba="1 1 1 0"/></body>
  </worldbody>
</mujoco>
"""


def posed(mjcf):
    model = model_of(mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data


def pixel_rays(camera, size):
    """Unit directions (H, W, 3) through the pixels' centres."""
    right, up, forward = camera.axes()
    width, height = size
    top = np.tan(np.radians(camera.fov) / 2)
    y, x = np.mgrid[:height, :width] + 0.5
    away = forward + top * ((2 * x - width) / height)[..., None] * right - top * (2 * y / height - 1)[..., None] * up
    return away / np.linalg.norm(away, axis=2, keepdims=True)


CHECKERED = """
<mujoco><asset>
  <texture name="grid" type="2d" builtin="checker" rgb1="1 0 0" rgb2="0 0 1" width="64" height="64"/>
  <material name="floor" texture="grid" texrepeat="4 4" texuniform="{uniform}" rgba="1 1 .5 1" specular="0"/>
</asset><worldbody>
  <geom type="plane" size="2 2 1" material="floor"/><geom size=".1" pos="0 0 1" material="floor"/>
</worldbody></mujoco>
"""

BALL = """
<mujoco><option gravity="{gravity}" integrator="RK4" timestep="0.005"/><worldbody>
  <body name="ball" pos="2 0 0.3"><freejoint/><geom size="0.1"/></body>
</worldbody></mujoco>
"""


def ball_experiment(gravity="0 0 0", **options):
    world = fs.World()
    world.add_body(PLANET)
    return fs.mujoco.Experiment(world, CAMERA, model=BALL.format(gravity=gravity), **{"duration": 0.5, **options})
