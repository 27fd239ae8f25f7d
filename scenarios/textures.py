"""A globe sinks into a donut of the same made-up earth and rises again, on a slice of wood, under a painted sky.

seed: seed of the earth
"""

import math

import numpy as np

import fieldsim as fs

DURATION = 8.0
V, U = (np.mgrid[:256, :512] + 0.5) * math.pi / 256
AROUND = np.stack([-np.cos(U) * np.sin(V), -np.sin(U) * np.sin(V), np.cos(V)], axis=-1)  # a ball's place for each pixel


def waves(places, seed):
    """A sum of random waves."""
    rng, total = np.random.default_rng(seed), np.zeros(places.shape[:-1])
    for k in range(48):
        octave = k // 8
        total += 0.28 * 0.55**octave * np.sin(1.5 * 2**octave * places @ rng.normal(size=3) + rng.uniform(0, 6.28))
    return total


def earth(seed):
    height = waves(AROUND, seed)
    colors = [(0.04, 0.16, 0.40), (0.10, 0.42, 0.66), (0.92, 0.84, 0.62), (0.42, 0.60, 0.28), (0.72, 0.60, 0.42)]
    land = [np.interp(height, (-0.9, -0.02, 0.02, 0.12, 0.9), channel) for channel in zip(*colors, strict=True)]
    return np.where((np.abs(AROUND) + 0.05 * height[..., None] > 0.93)[..., 2:], 0.97, np.stack(land, axis=-1))


def sky():
    up, clouds = AROUND[..., 2:], np.clip(waves(AROUND * (2, 2, 8), 5), 0, 1)[..., None]
    haze = np.exp(-5 * np.abs(up))
    air = haze * (1.0, 0.8, 0.6) + (1 - haze) * (0.22, 0.4, 0.7) + 0.5 * clouds * np.clip(4 * up, 0, 1)
    return np.where(up < 0, haze * (0.42, 0.36, 0.3) + (1 - haze) * (0.2, 0.17, 0.15), np.clip(air, 0, 1))


def build(seed: int = 4) -> fs.Scenario:
    sun = fs.DirectionalLight(direction=(-0.6, 0.7, -0.7), color="#fff0dd", intensity=0.9)
    world = fs.World(lights=(sun,), background=fs.Background(image=sky()))
    planet, turn = earth(seed), fs.Spin(rate=0.25, axis=(0, 0, 1))
    globe = fs.Point(lambda t: (0, 0, 0.98 + 0.42 * math.cos(2 * math.pi * t / DURATION)))
    for skeleton, radius, repeat in ((fs.Circle((0, 0, 0.34), (0, 0, 1), 0.8), 0.3, (2, 1)), (globe, 0.4, (1, 1))):
        skin = fs.Material(fs.ImageTexture(planet, repeat), radius=radius, blobbiness=-2)
        world.add_body(fs.Body(skeleton, surface=skin, motion=turn))
    cross = [fs.Segment((-0.4, 0, 0.75), (0.4, 0, 0.75)), fs.Segment((0, 0, 0.15), (0, 0, 1.2))]
    marble = fs.Material(fs.Marble("#f2efe8", "#5a6c80", 0.35), radius=0.15, blobbiness=-3, specular=0.5)
    world.add_body(fs.Body(cross, surface=marble, motion=fs.Pose.turned((0, 0, 1), 1.2, (-1.5, 0.8, 0))))
    wood = fs.Material(fs.Wood("#c39a68", "#9a6c40", 0.11), specular=0.1)
    world.add_shape(fs.Cylinder((0, 0, -0.3), (0, 0, 0), 2.4), wood)
    world.add_shape(fs.Ball((1.35, -0.95, 0.3), 0.3), fs.Material(fs.Marble("#3c5a50", "#d5e2d2", 0.25), specular=0.6))
    world.add_shape(fs.Box((0.5, 0.5, 0.5), (1.5, 0.7, 0.25)), fs.Material(fs.Checker("bone", "maroon", 0.125)))
    camera = fs.Camera.orbit(look_at=(0, 0, 0.62), radius=4.6, height=1.0, period=4 * DURATION, fov=42)
    return fs.Scenario(world, camera, duration=DURATION, fps=30)


if __name__ == "__main__":
    fs.main(build)
