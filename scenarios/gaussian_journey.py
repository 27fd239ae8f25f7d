"""A traveller falls to the centre of a Gaussian planet and finds itself weightless.

The planet pulls with the gradient of a Gaussian: the needle that the traveller carries shows its weight, and shrinks to
nothing at the centre, where the field is flat. With antigravity the planet is a hill: thrown in with just too little
speed, the traveller hangs near the top, weightless too, and is driven out again.

depth: distance from the centre at which the journey starts
antigravity: whether the planet pushes
"""

import numpy as np

import fieldsim as fs


def build(depth: float = 1.6, antigravity: bool = False) -> fs.Scenario:
    heart = fs.Point((0, 0, 0))
    planet = fs.Body(heart, gravity=fs.Gaussian(a=1.0), mass=-2.0 if antigravity else 2.0)
    # The speed that carries the traveller up to 0.002 from the top.
    speed = 2 * np.sqrt(np.exp(-(0.002**2)) - np.exp(-(depth**2))) if antigravity else 0.0

    # Shadows of the cage's bars on each other would hide its far side.
    sun = fs.DirectionalLight(direction=(-0.5, 0.6, -0.8), shadows=False)
    world = fs.World(background=fs.Background(stars=0.1), lights=[sun])
    world.add_body(planet)
    world.add_particles([(0, 0, depth)], [(0, 0, -speed)], radius=0.09, color="amber")

    # The traveller's way, and the pull along it, found once; the needle follows them.
    times = fs.timeline(9.0, fps=30)
    journey = list(fs.Simulation(world, fs.Leapfrog(dt=1e-3)).snapshots(times))
    places = np.array([snapshot.positions[0][0] for snapshot in journey])
    weights = planet.gravity_field().gradient(places)
    foot, tip = fs.Keyframes(times, places), fs.Keyframes(times, places + 0.45 * weights + (0, 0, 1e-6))
    world.add_body(fs.Body(fs.Segment(foot, tip), surface=fs.Material(color="crimson", radius=0.035)))

    # A cage of meridians lets us look inside.
    cage = [fs.Circle((0, 0, 0), (np.cos(k), np.sin(k), 0), 1.0) for k in np.arange(6) * np.pi / 6]
    cage += [fs.Circle((0, 0, z), (0, 0, 1), np.sqrt(1 - z * z)) for z in (-0.5, 0.0, 0.5)]
    world.add_body(fs.Body(cage, surface=fs.Material(color="steelblue", radius=0.04)))
    camera = fs.Camera.orbit(look_at=(0, 0, 0), radius=5.0, height=1.0, period=48, fov=40)
    return fs.Scenario(world, camera, integrator=fs.Leapfrog(dt=1e-3), duration=9.0, fps=30)


if __name__ == "__main__":
    fs.main(build)
