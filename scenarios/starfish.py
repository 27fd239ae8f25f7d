"""A starfish of seven arcs that beckons with its arms.

arms: number of arms
curl: how far they bend up and down, in radians
"""

import numpy as np

import fieldsim as fs


def arm(azimuth, curl, length=1.3, beat=4.0):
    """An arc from the middle outwards that bends upwards by up to `curl` radians, to and fro."""

    def bend(time):
        # Never straight: an arc has a radius.
        return 0.15 + 0.5 * curl * (1.0 + np.sin(2.0 * np.pi * time / beat + 3.0 * azimuth))

    return fs.Arc(
        center=lambda t: (0.0, 0.0, length / bend(t)),
        normal=(np.sin(azimuth), -np.cos(azimuth), 0.0),
        start=(0.0, 0.0, -1.0),
        radius=lambda t: length / bend(t),
        angle=bend,
    )


def build(arms: int = 7, curl: float = 1.2) -> fs.Scenario:
    skeleton = [arm(2.0 * np.pi * k / arms, curl) for k in range(arms)]
    skin = fs.Material("coral", radius=0.16, blobbiness=-2.5, specular=0.35)
    world = fs.World(background=fs.Background("#27546b", "#06121c", stars=0.0))
    world.add_body(fs.Body(skeleton, surface=skin))
    camera = fs.Camera.orbit(look_at=(0, 0, 0.25), radius=3.4, height=2.2, period=16.0, fov=44)
    return fs.Scenario(world, camera, duration=8.0, fps=30)


if __name__ == "__main__":
    fs.main(build)
