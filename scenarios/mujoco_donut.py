"""Boxes, capsules and a chain rain on a donut planet: MuJoCo's bodies in a field. Some fall through the hole.

boxes: number of boxes
capsules: number of capsules
links: links of the chain
friction: Coulomb's coefficient of the donut's surface
seed: seed of the rain
"""

import numpy as np

import fieldsim as fs

COLORS = {"box": ("0.95 0.75 0.3 1", "0.85 0.35 0.25 1"), "capsule": ("0.35 0.6 0.85 1", "0.55 0.75 0.45 1")}
SIZES = {"box": "0.07 0.05 0.035", "capsule": "0.035 0.06"}


def rain(kinds: list[str], seed: int) -> str:
    """MJCF of free bodies that hang above the donut, nowhere nearer to each other than they are long."""
    random, places, bodies = np.random.default_rng(seed), [], []
    while len(places) < len(kinds):
        place = random.uniform((-1.6, -1.6, 0.9), (1.6, 1.6, 0.9 + 0.035 * len(kinds)))
        if np.hypot(*place[:2]) < 1.6 and all(np.linalg.norm(place - other) > 0.22 for other in places):
            places.append(place)
    for k, (kind, (x, y, z)) in enumerate(zip(kinds, places, strict=True)):
        quat = " ".join(map(str, random.normal(size=4)))
        geom = f'<geom type="{kind}" size="{SIZES[kind]}" rgba="{COLORS[kind][k % 2]}"/>'
        bodies.append(f'<body pos="{x} {y} {z}" quat="{quat}"><freejoint/>{geom}</body>')
    return "".join(bodies)


def chain(links: int) -> str:
    """MJCF of a chain that hangs stretched across the tube."""
    geom = '<geom type="capsule" fromto="0.02 0 0 0.13 0 0" size="0.04" rgba="0.8 0.8 0.85 1"/>'
    inner = ""
    for _ in range(links - 1):
        inner = f'<body pos="0.15 0 0"><joint type="ball" damping="2e-5"/>{geom}{inner}</body>'
    return f'<body pos="0.1 -0.15 0.5"><freejoint/>{geom}{inner}</body>'


def build(boxes: int = 20, capsules: int = 20, links: int = 10, friction: float = 0.8, seed: int = 1) -> fs.Scenario:
    world = fs.World(background=fs.Background(stars=0.1))
    ring = fs.Circle(center=(0, 0, 0), normal=(0, 0, 1), radius=1.0)
    clay = fs.Material("terracotta", radius=0.25, blobbiness=-8)
    world.add_body(fs.Body(ring, gravity=fs.Newtonian(), mass=2.0, surface=clay))
    bodies = rain(["box"] * boxes + ["capsule"] * capsules, seed) + chain(links)
    option = '<option gravity="0 0 0" integrator="RK4" timestep="0.0004"/>'
    model = f"<mujoco>{option}<worldbody>{bodies}</worldbody></mujoco>"
    touch = fs.mujoco.Contact(speed=2.2, depth=0.2, damping=0.6, friction=friction)
    camera = fs.Camera.orbit(look_at=(0, 0, 0.1), radius=4.2, height=2.4, period=60, phase=-0.6, fov=40)
    return fs.mujoco.Experiment(world, camera, model=model, contact=touch, duration=8.0)


if __name__ == "__main__":
    fs.main(build)
