"""Whatever is given to the MuJoCo tools is taken, or refused by fieldsim's own error."""

import warnings

import mujoco
import numpy as np
import pytest

import fieldsim as fs

RING = fs.Body(fs.Circle((0, 0, 0), (0, 0, 1), 1.0), gravity=fs.Newtonian(), surface=fs.Material(radius=0.25))
WORLD = fs.World()
WORLD.add_body(RING)
MODEL = mujoco.MjModel.from_xml_string(
    '<mujoco><option gravity="0 0 0"/><worldbody><body name="a" pos="2 0 .3"><freejoint/>'
    '<geom size=".1"/><site name="s"/>'
    '</body></worldbody><actuator><motor site="s"/></actuator></mujoco>'
)
OTHER = mujoco.MjModel.from_xml_string("<mujoco><worldbody><body><joint/><geom size='1'/></body></worldbody></mujoco>")
DATA, OTHERS = mujoco.MjData(MODEL), mujoco.MjData(OTHER)
mujoco.mj_forward(MODEL, DATA)
VALUES = [
    *(None, True, -1, 0.5, 10**400, float("nan"), np.inf, 1e300, 2 + 3j, "x", "", b"x", "\0", "a\nb"),
    *([], [1], [None], [[1], [1, 2]], {1: 2}, np.zeros((2, 2)), np.array(["a"]), np.array([1, None], dtype=object)),
    *(np.ma.masked_array([1.0, 2.0], [0, 1]), np.datetime64("2020-01-01"), object(), lambda *_: 1 / 0, int),
    *(MODEL, DATA, OTHERS, RING, WORLD),
]


def options(call, **fixed):
    """Calls by the name of each option: of one value, the others as they are in `fixed`."""
    return {f"{call.__qualname__}({name}=)": lambda value, name=name: call(**fixed | {name: value}) for name in fixed}


def calls():
    tools = fs.mujoco
    camera = fs.Camera((3, 0, 0))
    model, data, skin = MODEL, DATA, tools.skin(MODEL)
    planet = tools.planet_geom(RING, kind="mesh", resolution=10)
    forces = tools.FieldForces(model, data, RING, native=False)
    scene = tools.Scene(WORLD, model)
    experiment = {"world": WORLD, "camera": camera, "model": model, "duration": 1.0, "fps": 30.0, "title": ""}
    experiment |= {"accuracy": "points", "contact": None, "keep_gravity": None, "start": None, "control": None}
    given = {"model": model, "data": data, "sources": RING, "bodies": None, "accuracy": "points", "contact": None}
    starts = tools.state_of(model, data)
    found = {
        **options(tools.Experiment, **experiment, planets=(), skins=()),
        **options(tools.Scene, world=WORLD, model=model, skins=(), planets=()),
        **options(scene.snapshot, data=data, base=None),
        **options(tools.skin, model=model, root=None, material=None, blobbiness=None, swell=1.0),
        **options(tools.Skin, bodies=skin.bodies, owners=skin.owners, geoms=skin.geoms),
        **options(tools.Contact, speed=1.0, depth=0.1, damping=0.0, friction=0.0),
        **options(tools.Contact(1.0).stiffness, mass=1.0, size=1.0),
        **options(tools.follow, model=model, data=data, planets=[]),
        **options(tools.PlanetGeom, **vars(planet)),
        **options(tools.FieldForces, **given, keep_gravity=None, native=False),
        **options(forces.gravity_at, points=[(0, 0, 0)], time=0.0),
        **options(tools.rollout, forces=forces, starts=starts, steps=1, controls=None, threads=1),
        **options(tools.state_of, model=model, data=data),
        **options(tools.state_size, model=model),
        **{question: getattr(forces, question) for question in ("wrenches", "energy", "readings", "act")},
    }
    # Whatever else is given, no mesh is made.
    planets = {"name": "", "kind": "none", "friction": 1.0, "mocap": None, "time": 0.0}
    return found | options(tools.planet_geom, body=RING, **planets)


def test_no_value_ends_in_an_error_of_another_kind():
    raw, tried = [], 0
    for name, call in calls().items():
        for value in VALUES:
            tried += 1
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", fs.FieldsimWarning)
                try:
                    call(value)
                except fs.FieldsimError:
                    continue
                except Exception as error:
                    raw.append(f"{name} of {value!r}: {type(error).__name__}: {error}"[:150])
    assert not raw, "\n".join(raw)
    assert tried > 1000
    assert mujoco.get_mjcb_passive() is None


@pytest.mark.parametrize("name", ["\ud800", "no\0body", "x" * 5000, 10**5000], ids=["half", "zero", "long", "huge"])
def test_names_that_mujoco_cannot_take(name):
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>"
    )
    planet = fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian())
    with pytest.raises(fs.InputError, match=r"FieldForces: .*(bodies has|has no body)"):
        fs.mujoco.FieldForces(model, mujoco.MjData(model), planet, bodies=[name])
    with pytest.raises(fs.InputError, match="skin: the model has no body"):
        fs.mujoco.skin(model, name)
    with pytest.raises(fs.InputError, match="model"):
        fs.mujoco.Scene(fs.World(), name)
