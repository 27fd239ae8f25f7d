"""A gymnasium environment: land a thruster body softly on a donut planet.

    import gymnasium
    env = gymnasium.make("fieldsim.mujoco.lander:FieldSim/DonutLander-v0")

Needs the extra `gym`: pip install fieldsim[gym].
"""

import functools
import math

import mujoco
import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.mujoco.contact.geoms import Contact
from fieldsim.mujoco.forces import FieldForces
from fieldsim.mujoco.scene.scene import Scene
from fieldsim.potentials.kernels import Newtonian
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.render.camera import Camera
from fieldsim.render.renderer import Renderer
from fieldsim.world.body import Body
from fieldsim.world.light import Background
from fieldsim.world.material import Material
from fieldsim.world.world import World

try:
    import gymnasium
    from gymnasium import spaces
except ImportError:
    raise InputError("DonutLander: gymnasium is not installed; pip install 'fieldsim[gym]'") from None

TUBE = 0.25
PLANET = Body(
    Circle((0, 0, 0), (0, 0, 1), 1.0),
    gravity=Newtonian(),
    mass=1.0,
    surface=Material(radius=TUBE, blobbiness=-8.0),
    name="donut",
)
# A squat ellipsoid that thrusts along its z axis and turns by reaction wheels.
MODEL = """
<mujoco>
  <option gravity="0 0 0" integrator="RK4" timestep="0.001"/>
  <worldbody>
    <body name="lander" pos="0 0 2">
      <freejoint/>
      <geom type="ellipsoid" size="0.06 0.06 0.04" mass="1" rgba="0.95 0.8 0.35 1"/>
      <site name="engine"/>
    </body>
  </worldbody>
  <actuator>
    <motor site="engine" gear="0 0 1 0 0 0" ctrlrange="0 1"/>
    <motor site="engine" gear="0 0 0 1 0 0" ctrlrange="-1 1"/>
    <motor site="engine" gear="0 0 0 0 1 0" ctrlrange="-1 1"/>
    <motor site="engine" gear="0 0 0 0 0 1" ctrlrange="-1 1"/>
  </actuator>
</mujoco>
"""
# Full thrust is about twice the weight on the tube; full torque turns the lander round in about a second.
THRUST, TORQUE = 2.0, 0.02
STEPS = 40
FUEL = 6.0
# Touching down faster than this is a crash; slower than the second for so many turns is a landing.
CRASH, REST, PATIENCE = 0.6, 0.05, 10
FAR = 4.0
VIEW = Camera((2.7, -3.9, 2.6), fov=44.0)
LAW = Contact(speed=1.0, depth=0.1, damping=1.5, friction=0.8)
# What observations stay within, in their order.
BOUNDS = np.repeat([10.0, 10.0, 1.0, 1.0, 1000.0, 100.0, 10.0, 1.0], [3, 3, 3, 3, 3, 3, 1, 1])


class DonutLander(gymnasium.Env):
    """Land softly on a donut planet, with little fuel.

    Action (4,) in -1..1: thrust along the lander's z axis (-1: none, 1: full), torques about its axes. Observation
    (20,): position, velocity, the lander's x and z axes, angular velocity, gravity at the lander (each 3, world frame),
    height over the surface, fuel left in 0..1. Reward: what is gained in height, speed and uprightness, fuel spent
    against it, 100 for a landing, -100 for a crash or for getting lost. A turn is 0.04 units of time.
    render_mode: "rgb_array" for ray-traced pictures, or None.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 25}  # noqa: RUF012 - gymnasium wants a plain dict

    def __init__(self, render_mode=None):
        if render_mode is not None:
            validate.choice("DonutLander", "render_mode", render_mode, ("rgb_array",))
        self.render_mode = render_mode
        self.model = mujoco.MjModel.from_xml_string(MODEL)
        self.data = mujoco.MjData(self.model)
        self.forces = FieldForces(self.model, self.data, PLANET, contact=LAW)
        self.action_space = spaces.Box(-1.0, 1.0, (4,), np.float32)
        self.observation_space = spaces.Box(-BOUNDS, BOUNDS, dtype=np.float64)
        self._fuel, self._still, self._score = FUEL, 0, 0.0

    def reset(self, *, seed=None, options=None):
        """Start nearly at rest, somewhere over the planet. seed: a whole number, for the same start again."""
        if seed is not None:
            seed = validate.whole("DonutLander.reset", "seed", seed, at_least=0)
        super().reset(seed=seed)
        random = self.np_random
        mujoco.mj_resetData(self.model, self.data)
        place = random.normal(size=3)
        self.data.qpos[:3] = random.uniform(1.9, 2.4) * place / np.linalg.norm(place)
        turn = random.normal(size=4)
        self.data.qpos[3:] = turn / np.linalg.norm(turn)
        self.data.qvel[:3] = random.normal(scale=0.15, size=3)
        self.data.qvel[3:] = random.normal(scale=0.3, size=3)
        self._fuel, self._still = FUEL, 0
        observation = self._observed()
        self._score = self._rated(observation)
        return observation, self._info()

    def step(self, action):
        """One turn: (observation, reward, terminated, truncated, info). Raises InputError for an action of nan."""
        action = np.clip(validate.numbers("DonutLander.step", "action", action, shape=(4,)), -1.0, 1.0)
        thrust = 0.5 * (action[0] + 1.0) if self._fuel > 0.0 else 0.0
        self.data.ctrl[:] = THRUST * thrust, *(TORQUE * action[1:])
        self.data.ctrl[0] = min(self.data.ctrl[0], THRUST)
        speed = float(np.linalg.norm(self.data.qvel[:3]))
        with self.forces.running():
            mujoco.mj_step(self.model, self.data, STEPS)
        burnt = THRUST * thrust * STEPS * self.model.opt.timestep
        self._fuel = max(0.0, self._fuel - float(burnt))
        observation = self._observed()
        score = self._rated(observation)
        reward, self._score = score - self._score - 0.1 * burnt, score
        height, now = float(observation[18]), float(np.linalg.norm(observation[3:6]))
        touching = height < 0.065
        self._still = self._still + 1 if touching and now < REST else 0
        landed, lost = self._still >= PATIENCE, np.linalg.norm(observation[:3]) > FAR
        crashed = touching and max(speed, now) > CRASH
        reward += 100.0 * landed - 100.0 * (crashed or lost)
        return observation, float(reward), bool(landed or crashed or lost), False, self._info(landed, crashed, lost)

    def render(self):
        """The picture of this moment, (240, 320, 3) uint8, ray traced; None without a render_mode."""
        if self.render_mode is None:
            return None
        mujoco.mj_kinematics(self.model, self.data)
        scene, renderer = self._picture
        return renderer.frame(scene.snapshot(self.data), VIEW)

    @functools.cached_property
    def _picture(self):
        world = World(background=Background(stars=0.1))
        world.add_body(PLANET)
        return Scene(world, self.model), Renderer((320, 240), "draft")

    def _observed(self):
        mujoco.mj_kinematics(self.model, self.data)
        x, turn = self.data.xpos[1], self.data.xmat[1].reshape(3, 3)
        force, _ = self.forces.wrenches()
        height = math.hypot(math.hypot(x[0], x[1]) - 1.0, x[2]) - TUBE
        spin = turn @ self.data.qvel[3:]
        parts = x, self.data.qvel[:3], turn[:, 0], turn[:, 2], spin, force[0], [height], [self._fuel / FUEL]
        return np.clip(np.concatenate(parts), -BOUNDS, BOUNDS)

    @staticmethod
    def _rated(observation):
        """Potential of the reward, whose gain is rewarded: greater if low, slow and upright."""
        gravity = observation[15:18]
        upright = -observation[9:12] @ gravity / max(np.linalg.norm(gravity), 1e-12)
        return -10.0 * observation[18] - 5.0 * np.linalg.norm(observation[3:6]) + upright

    def _info(self, landed=False, crashed=False, lost=False):
        return {"landed": bool(landed), "crashed": bool(crashed), "lost": bool(lost), "fuel": self._fuel}


gymnasium.register(id="FieldSim/DonutLander-v0", entry_point=f"{__name__}:DonutLander", max_episode_steps=1000)
