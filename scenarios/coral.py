"""A coral sways in the sea: 31 branches, each splitting in two, and 512 spikes, one blended convolution surface.

sway: how far the twigs bend, in radians
seed: seed of its growth
"""

import math

import numpy as np

import fieldsim as fs

LEVELS, SPIKES = 5, 512


def grow(rng, sway):
    """Rig of branches, each a bone at the tip of its parent, and their lengths."""
    bones, lengths, turn = [], {}, 0.0
    for level in range(LEVELS):
        for k in range(2**level):
            length = 0.55 * 0.85**level
            turn = rng.uniform(0, 2 * math.pi) if k % 2 == 0 else turn + math.pi  # twins part opposite ways
            lean = rng.uniform(0.45, 0.8) if level else 0.0
            axis = (math.cos(turn), math.sin(turn), 0.0)
            phase = rng.uniform(0, 2 * math.pi)
            parent, base = (f"{level - 1}.{k // 2}", lengths.get(f"{level - 1}.{k // 2}")) if level else (None, 0.0)

            def swing(t, axis=axis, lean=lean, level=level, phase=phase):
                return fs.Pose.turned(axis, lean + sway * level / LEVELS * math.sin(math.pi / 2 * t + phase))

            bones.append(fs.Bone(f"{level}.{k}", parent, fs.Pose((0, 0, base)), swing))
            lengths[f"{level}.{k}"] = length
    return fs.Rig(bones), lengths


def build(sway: float = 0.12, seed: int = 3) -> fs.Scenario:
    rng = np.random.default_rng(seed)
    rig, lengths = grow(rng, sway)
    branches = [rig.carry(name, fs.Segment((0, 0, 0), (0, 0, length))) for name, length in lengths.items()]
    names = list(lengths)
    spikes = []
    for k in range(SPIKES):
        name = names[k % len(names)]
        start = np.array([0, 0, lengths[name] * rng.uniform(0.15, 1.0)])
        direction = np.append(rng.normal(size=2), rng.uniform(0.2, 1.0))
        tip = start + 0.11 * direction / np.linalg.norm(direction)
        spikes.append(rig.carry(name, fs.Segment(tuple(start), tuple(tip))))
    world = fs.World(background=fs.Background(top="#1d5f7a", bottom="#04202e", stars=0))
    world.add_body(fs.Body(branches, surface=fs.Material("#d8564a", radius=0.055, blobbiness=-2)))
    world.add_body(fs.Body(spikes, surface=fs.Material("#f7d9b0", radius=0.016, blobbiness=-2)))
    camera = fs.Camera.orbit(look_at=(0, 0, 1.0), radius=3.0, height=0.5, period=24, fov=42)
    return fs.Scenario(world, camera, duration=8.0, fps=30)


if __name__ == "__main__":
    fs.main(build)
