"""Two stars and the surfaces of equal potential around them: from two drops to one peanut.

ratio: mass of the smaller star, in units of the larger
softening: over which the stars are spread out
"""

import numpy as np

import fieldsim as fs

DISTANCE = 2.0


def build(ratio: float = 0.4, softening: float = 0.1) -> fs.Scenario:
    masses = np.array([1.0, ratio])
    shares = masses / masses.sum()
    places = np.array([-shares[1], shares[0]]) * DISTANCE
    # Where the pulls cancel, at R1 : R2 = 1 : sqrt(ratio), the two drops touch.
    touching = (1.0 + np.sqrt(ratio)) ** 2 / DISTANCE
    level = fs.Keyframes([0.0, 4.0, 8.0], [1.9 * touching, touching, 0.72 * touching])
    world = fs.World(background=fs.Background(stars=0.4))
    for mass, x, color in zip(masses, places, ("amber", "steelblue"), strict=True):
        star = fs.Material(color, level=level, specular=0.4)
        kernel = fs.Newtonian(softening=softening)
        world.add_body(fs.Body(fs.Point((x, 0, 0)), gravity=kernel, mass=float(mass), surface=star))
    camera = fs.Camera.orbit(radius=6.5, height=2.2, period=24.0, phase=-1.2, fov=40)
    return fs.Scenario(world, camera, duration=8.0, fps=30)


if __name__ == "__main__":
    fs.main(build)
