"""Rendering: sphereflakes, a cross, a donut and a coral beside POV-Ray where `povray` is installed; the donut film.

Frames are whole frames from a snapshot to a picture in memory; POV-Ray's time is its trace time, without parsing and
writing. Both are timed in turns, and the shortest time of each counts. With shadows and AA ours takes up to 16 samples
a pixel where its neighbours differ, POV-Ray's method 2 (+A0.1 +AM2 +R2) up to 25, shared with its neighbours.
"""

import re
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from unittest import mock

import numpy as np

import fieldsim as fs
from benchmarks import blobs
from fieldsim import launch

SIZE = (512, 512)
_TURNS = 4
_SCENES = {
    "sphereflake of 10": lambda: blobs.flake(1),
    "sphereflake of 91": lambda: blobs.flake(2),
    "sphereflake of 820": lambda: blobs.flake(3),
    "sphereflake of 7381": lambda: blobs.flake(4),
    "cross": blobs.cross,
    "donut": blobs.donut,
    "coral of 543": blobs.coral,
}


def rows():
    """The figures: frame times in seconds, smaller is better; ratio: to the peer's time."""
    for threads in sorted({1, launch.THREADS}):
        for what, shadows in (("primary rays", False), ("shadows and AA", True)):
            for name, layers in _SCENES.items():
                value, peer_value = times(layers(), shadows=shadows, threads=threads)
                yield row(f"{name}, {what}, {threads} thread{'s' * (threads > 1)}", value, peer_value)
    yield row("donut and 400 pebbles, 640x360, shadows and AA", donut_frame(), None)


def times(layers, *, shadows: bool, threads: int) -> tuple[float, float | None]:
    """Shortest times of ours and of POV-Ray's, taken in turns."""
    renderer = fs.Renderer(SIZE, "final", shadows=shadows, samples=16 if shadows else 1)
    snapshot = blobs.world_of(layers).at(0.0)
    ours, theirs = [], []
    with mock.patch.object(launch, "THREADS", threads), tempfile.TemporaryDirectory() as folder:
        Path(folder, "scene.pov").write_text(blobs.pov_scene(layers, shadows=shadows))
        for _ in range(_TURNS):
            ours.append(best_time(lambda: renderer.frame(snapshot, blobs.CAMERA), 3))
            theirs.append(povray(folder, shadows=shadows, threads=threads))
    return min(ours), min(theirs) if None not in theirs else None


def best_time(action, times: int = 5) -> float:
    """The shortest of several runs, in seconds, after one to warm up."""
    action()
    result = float("inf")
    for _ in range(times):
        start = time.perf_counter()
        action()
        result = min(result, time.perf_counter() - start)
    return result


def row(name: str, value: float, peer_value: float | None) -> dict:
    """One figure of the table."""
    peer = "POV-Ray" if peer_value else None
    return {"name": name, "value": value, "unit": "s/frame", "peer": peer, "peer_value": peer_value}


def donut_frame() -> float:
    """Seconds for a frame like the donut film's."""
    world = fs.World()
    ring = fs.Circle((0, 0, 0), (0, 0, 1), 1.0)
    world.add_body(fs.Body(ring, surface=fs.Material(radius=0.25, blobbiness=-4)))
    positions = np.random.default_rng(1).uniform((-1.2, -1.2, 0), (1.2, 1.2, 1.5), (400, 3))
    world.add_particles(positions, np.zeros_like(positions), radius=0.025)
    renderer = fs.Renderer((640, 360), "final")
    camera = fs.Camera((4.6, 0, 2.15), (0, 0, 0.15), fov=38)
    return best_time(lambda: renderer.frame(world.at(0.0), camera))


def povray(folder: str, *, shadows: bool, threads: int) -> float | None:
    """Seconds POV-Ray takes to trace scene.pov in a folder (tracing alone), or None without it."""
    if shutil.which("povray") is None:
        return None
    smooth = ["+A0.1", "+AM2", "+R2"] if shadows else ["-A"]
    size = [f"+W{SIZE[0]}", f"+H{SIZE[1]}", f"+WT{threads}"]
    command = ["povray", f"+I{folder}/scene.pov", f"+O{folder}/scene.png", "-D", *size, *smooth]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stderr
    return float(re.search(r"Trace Time:.*\(([\d.]+) seconds\)", said)[1])
