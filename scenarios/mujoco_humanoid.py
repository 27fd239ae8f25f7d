"""A ragdoll tumbles round a cigar: MuJoCo moves humanoid.xml, and a soft skin blends its geoms into one body.

skin: draw it soft; --no-skin shows the geoms
push: speed at which it starts, across the cigar
friction: Coulomb's coefficient of the cigar's surface
"""

import pathlib

import mujoco

import fieldsim as fs

MODEL = pathlib.Path(__file__).with_name("humanoid.xml")


def build(skin: bool = True, push: float = 1.1, friction: float = 0.35) -> fs.Scenario:
    world = fs.World(background=fs.Background(stars=0.1))
    cigar = fs.Segment((-1.1, 0, 0), (1.1, 0, 0))
    copper = fs.Material("copper", radius=0.35, blobbiness=-6)
    world.add_body(fs.Body(cigar, gravity=fs.Newtonian(), mass=3.0, surface=copper))
    model = mujoco.MjModel.from_xml_path(str(MODEL))

    def start(model, data):
        """Above the cigar, on its way across, head over heels."""
        data.qpos[:7] = -0.3, -0.35, 1.2, 0.9, 0.4, 0.1, 0.2
        data.qvel[:6] = 0.12, push, 0, 2.5, 1.0, 0.5

    camera = fs.Camera.orbit(look_at=(0, 0, 0.1), radius=3.5, height=1.5, period=90, phase=-1.5, fov=40)
    return fs.mujoco.Experiment(
        world,
        camera,
        model=model,
        skins=[fs.mujoco.skin(model)] if skin else [],
        start=start,
        contact=fs.mujoco.Contact(speed=2.4, depth=0.35, damping=0.4, friction=friction),
        duration=10.0,
    )


if __name__ == "__main__":
    fs.main(build)
