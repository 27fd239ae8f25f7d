"""Glass, mirrors and jelly under a wide sun: light that is bent, mirrored, tinted and softened.

Two blobs of jelly melt together and apart, and their colours with them; a ball swings through a ring of glass.

aperture: diameter of the lens, 0.1 for a background out of focus; it takes a minute a frame
sun: angle across which the sun is seen, in degrees
"""

import math

import fieldsim as fs

GLASS = fs.Material(
    color="#e4f4ee", radius=0.22, blobbiness=-3, transmission=0.96, ior=1.5, specular=0.6, shininess=200
)
SILVER = fs.Material(color="#f4f4f8", radius=0.42, reflection=0.88, specular=0.8, shininess=200)


def jelly(color: str) -> fs.Material:
    return fs.Material(color=color, radius=0.3, blobbiness=-1.5, transmission=0.8, ior=1.3, specular=0.7, shininess=90)


def build(aperture: float = 0.0, sun: float = 3.0) -> fs.Scenario:
    light = fs.DirectionalLight(direction=(-0.6, 0.5, -0.9), color="#fff2e0", angle=sun)
    sky = fs.Background(top="#3f7fc4", bottom="#b8cbdc", stars=0)
    world = fs.World(lights=[light], background=sky, fog=fs.Fog(0.02))
    floor = fs.Material(color="#d8d2c6", reflection=0.12, specular=0.1)
    world.add_shape(fs.Ground(checker="#2b3d52", tile=0.5), floor)

    world.add_body(fs.Body(fs.Circle((0, 0, 0.9), (0, 1, 0.25), 0.6), surface=GLASS))
    world.add_body(fs.Body(fs.Point((1.5, 0.9, 0.42)), surface=SILVER))
    for side, color in ((-1, "tomato"), (1, "gold")):
        apart, together = (-1.3 + 0.42 * side, 0.3, 0.32), (-1.3 + 0.2 * side, 0.3, 0.42)
        place = fs.Keyframes([0, 2, 4], [apart, together, apart], loop=True)
        world.add_body(fs.Body(fs.Point(place), surface=jelly(color)))
    world.add_shape(fs.Ball((0.55, -0.75, 0.16), 0.16), fs.Material(color="#4d8ee0", transmission=0.9))

    def swing(t):
        return 0, 0.9 * math.sin(math.pi * t / 2), 0.9

    world.add_shape(fs.Ball((0, 0, 0), 0.2), fs.Material(color="coral"), swing)
    camera = fs.Camera.orbit(look_at=(0, 0, 0.55), radius=4.6, height=1.3, period=48, phase=-1.9, fov=36,
                             aperture=aperture, focus=4.6, tone="filmic")  # fmt: skip
    return fs.Scenario(world, camera, duration=4.0, fps=24)


if __name__ == "__main__":
    fs.main(build)
