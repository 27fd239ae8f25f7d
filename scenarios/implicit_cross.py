"""A cross of two segments seen along its arms: rays that run inside the field for the whole length of a skeleton.

radius: of the arms
kernel: cauchy, gaussian, quartic, metaball, soft_object
"""

import fieldsim as fs

KERNELS = {
    "cauchy": fs.Cauchy,
    "gaussian": fs.Gaussian,
    "quartic": fs.Quartic,
    "metaball": fs.Metaball,
    "soft_object": fs.SoftObject,
}


def build(radius: float = 0.18, kernel: str = "cauchy") -> fs.Scenario:
    if kernel not in KERNELS:
        raise fs.InputError(f"kernel is {kernel!r}; give one of {', '.join(KERNELS)}")
    arms = [fs.Segment((-2, 0, 0), (2, 0, 0)), fs.Segment((0, -1.2, 0), (0, 1.2, 0))]
    jade = fs.Material("mediumseagreen", radius=radius, kernel=KERNELS[kernel], specular=0.5)
    world = fs.World(background=fs.Background(stars=0.0))
    world.add_body(fs.Body(arms, surface=jade))
    # From the front to the very end of the long arm, and on along it.
    eye = fs.Keyframes([0.0, 3.0, 5.0, 6.0], [(0.6, -5.5, 2.5), (4.6, -2.6, 0.9), (5.6, -0.25, 0.1), (5.6, 0.0, 0.0)])
    return fs.Scenario(world, fs.Camera(eye=eye, fov=32), duration=6.0, fps=30)


if __name__ == "__main__":
    fs.main(build)
