"""A user's script, for the type checker alone: what the README and scenarios do, and what NumPy gives and takes."""

import pathlib

import numpy as np

import fieldsim as fs


def world(pebbles: int = 400) -> fs.World:
    clay = fs.Material(color="terracotta", radius=np.float32(0.25), blobbiness=-4, kernel=fs.Gaussian)
    glow = fs.Material(color=lambda t: (t, 0.5, 0.5), radius=lambda t: 0.2 + t, level=None)
    ring = fs.Circle(center=[0, 0, 0], normal=np.array([0.0, 0.0, 1.0]), radius=1)
    arm = fs.Segment((0, 0, 0), lambda t: (1, t, 0))
    scene = fs.World(lights=[fs.PointLight((0, 0, 5), color="#fff4e6")], background=fs.Background(stars=0))
    scene.add_body(fs.Body(ring, gravity=fs.Newtonian(), mass=1, surface=clay))
    scene.add_body(fs.Body([arm], surface=glow, motion=fs.Spin(rate=2)))
    scene.add_body(fs.Body(fs.planets.cross(2), surface=clay, motion=fs.Keyframes([0, 1], [fs.Pose(), fs.Pose()])))
    scene.add_particles(**fs.sampling.shell(pebbles, radius=(2, 3), seed=1), radius=0.02, contact=fs.Bounce(0.6))
    scene.add_shape([fs.Ball(radius=0.1)], clay, motion=lambda t: (0, 0, t))
    return scene


def fields(ring: fs.Circle) -> float:
    field = 2 * fs.Field(ring, fs.Cauchy(s=2), strength=[1]) + fs.gravity(ring, mass=1.0, G=np.float64(1))
    slope: np.ndarray = field.gradient(np.zeros((5, 3)))
    here: float = field.value((0.0, 0.0, 1.0))
    x, y, z = ring.center
    return here + float(slope.max()) + x + y + z + ring.radius + ring.measure


def simulate(scene: fs.World) -> np.ndarray:
    simulation = fs.Simulation(scene, fs.BlanesMoan6(0.05), device="cpu")
    log = fs.EnergyLog(simulation)
    with fs.Recording("run.npz") as recording:
        for snapshot in simulation.snapshots(np.linspace(0, 1, 5)):
            recording.add(snapshot)
            log.record()
    print(log.report().largest, simulation.bounces, simulation.events.times.max())
    return fs.Recorded(pathlib.Path("run.npz")).replay(scene).snapshot().positions[0]


def build(pebbles: int = 400) -> fs.Scenario:
    camera = fs.Camera(eye=lambda t: (3, t, 2), look_at=(0, 0, 0), fov=38)
    return fs.Scenario(world(pebbles), camera, duration=8, fps=30, integrator="auto")


def pictures(scene: fs.World, scenario: fs.Scenario) -> None:
    with fs.Film("walk.mp4", fps=30) as film:
        film.write(fs.render(scene.at(0), scenario.camera, size=(640, 360)))
    report: fs.Report = fs.film(scenario, "donut.mp4", size=(320, 180), preview=True, watch=lambda done, count: None)
    print(report.seconds, report.energy)
    fall = fs.mujoco.Experiment(scene, scenario.camera, model="humanoid.xml", duration=8)
    run, ledger = fall.begin()
    run.advance(1.0)
    print(ledger.report(), run.snapshot().time, fs.mujoco.rollout.__name__)


if __name__ == "__main__":
    fs.main(build)
