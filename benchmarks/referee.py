"""The default tracer against the referee, 512x512: pixels that differ, errors of depth, and dropouts from anywhere.

Scenes: tests/referee_scenes.py. Figures of a scene: pixels where one hits and the other misses; those of them away from
silhouettes; the largest difference of depth away from silhouettes, in units of the smallest radius; the seconds for the
primary rays, with the referee's as the peer's. With --full: dropouts in VIEWS random views of each.
"""

import pathlib
import sys

import numpy as np

import fieldsim as fs
from fieldsim.filming.comparing import compare_depths

sys.path.append(str(pathlib.Path(__file__).parent.parent / "tests"))

SIZE = (512, 512)
VIEWS, VIEW_SIZE = 100, (64, 64)


def rows(full: bool = False):
    """The figures, scene by scene; all but the times ought to be 0, or next to it."""
    from referee_scenes import scenes

    for name, make in scenes().items():
        scene = make()
        snapshot = scene.snapshot()
        seen = compare_depths(snapshot, scene.camera, size=SIZE)
        yield _row(name, "differ in hit or miss", int(seen.mismatched.sum()), "pixels")
        yield _row(name, "differ away from silhouettes", seen.dropouts, "pixels")
        yield _row(name, "depth error", seen.inner_error, "radii")
        own, referee = seen.seconds
        yield _row(name, "primary rays", own, "s") | {"peer": "referee", "peer_value": referee}
        if full:
            yield _row(name, f"dropouts in {VIEWS} random views", _dropouts(scene, snapshot), "pixels")


def _row(scene, what, value, unit):
    return {"name": f"{scene}: {what}", "value": value, "unit": unit}


def _dropouts(scene: object, snapshot: fs.Snapshot) -> int:
    """Pixels in all the random views that differ away from silhouettes, in hit or miss or in which surface is hit."""
    rng = np.random.default_rng(1)
    views = (scene.from_anywhere(rng) for _ in range(VIEWS))
    seen = (compare_depths(snapshot, camera, size=VIEW_SIZE) for camera in views)
    return sum(one.dropouts + one.leaps for one in seen)
