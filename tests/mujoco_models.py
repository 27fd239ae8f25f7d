"""MuJoCo models that the tests share: a donut planet, a box and a ball, an arm on a base that moves."""

import mujoco

import fieldsim as fs

DONUT = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)
PLANET = fs.Body(DONUT, gravity=fs.Newtonian(), mass=1.0)
SURFACE = fs.Body(DONUT, gravity=fs.Newtonian(), motion=fs.Spin(rate=0.4), surface=fs.Material(radius=0.25))

BOX = '<body name="box" pos="2 0.3 0.4" quat="1 0.2 0.3 0.1"><freejoint/><geom type="box" size="0.3 0.2 0.1"/></body>'
BALL = '<body name="ball" pos="-2.5 0 0.2"><freejoint/><geom size="0.1"/></body>'
# Hinges, a slide and a ball joint on a base that moves: what Jacobians are made of.
ARM = """
<body name="base" pos="0 2 0.5"><freejoint/><geom type="capsule" size="0.05 0.2"/>
  <body name="upper" pos="0.1 0 0.3"><joint axis="0 1 0"/><joint type="slide" axis="0 1 1" pos="0 0 0.1"/>
    <geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.03"/>
    <body name="lower" pos="0.4 0 0"><joint type="ball"/>
      <geom type="cylinder" size="0.05 0.1" pos="0.1 0 0" euler="20 30 40"/></body>
  </body>
</body>
"""


def model_of(bodies, *, options="", integrator="RK4", timestep=0.01):
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 0" integrator="{integrator}" timestep="{timestep}" {options}/>'
        f"<worldbody>{bodies}</worldbody></mujoco>"
    )


def at_start(model):
    """The model with data that are up to date."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def passive(model, data):
    """The passive forces now."""
    mujoco.mj_forward(model, data)
    return data.qfrc_passive.copy()
