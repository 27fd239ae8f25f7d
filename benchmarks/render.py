"""Rendering: frames of sphereflakes and of the donut film, beside POV-Ray's blobs where `povray` is installed."""

import re
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

import fieldsim as fs

SIZE = (512, 512)
_CAMERA = fs.Camera(eye=(2.1, 1.3, 1.7), fov=45)
_BLOBBINESS = -4.0


def sphereflake(levels: int, radius: float = 0.5) -> list[list[tuple[np.ndarray, float]]]:
    """Haines's sphereflake as (centre, radius) by level: each sphere carries 9, a third of its size.

    1, 10, 91, 820 or 7381 spheres for 0 to 4 levels.
    """
    # Six around the equator, three nearer to the top, 60 degrees turned.
    angles = [(k * np.pi / 3, 0.0) for k in range(6)] + [
        (np.pi / 6 + k * 2 * np.pi / 3, np.radians(54.7)) for k in range(3)
    ]
    offsets = np.array([(np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)) for a, b in angles])
    result = [[(np.zeros(3), radius)]]
    frames = [np.eye(3)]
    for _ in range(levels):
        spheres, turned = [], []
        for (center, size), frame in zip(result[-1], frames, strict=True):
            for offset in offsets @ frame.T:
                spheres.append((center + offset * size * 4 / 3, size / 3))
                turned.append(_frame(offset))
        result.append(spheres)
        frames = turned
    return result


def _frame(up):
    """A rotation whose third column is `up`."""
    side = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    side /= np.linalg.norm(side)
    return np.stack([side, np.cross(up, side), up], axis=1)


def flake_world(levels: int) -> fs.World:
    """The sphereflake of blobs: one body and one material a level, lighter as they get smaller."""
    world = fs.World(background=fs.Background(stars=0))
    for level, spheres in enumerate(sphereflake(levels)):
        material = fs.Material(color=_shade(level), radius=spheres[0][1], blobbiness=_BLOBBINESS)
        world.add_body(fs.Body([fs.Point(tuple(center)) for center, _ in spheres], surface=material))
    return world


def _shade(level):
    return tuple(np.array([0.55, 0.3, 0.2]) + level / 4 * np.array([0.4, 0.55, 0.6]))


def best_time(action, times: int = 5) -> float:
    """The shortest of several runs, in seconds, after one to warm up."""
    action()
    result = float("inf")
    for _ in range(times):
        start = time.perf_counter()
        action()
        result = min(result, time.perf_counter() - start)
    return result


def rows():
    """The figures: frame times in seconds, smaller is better; ratio: to the peer's time."""
    for levels, count in ((1, 10), (2, 91), (3, 820), (4, 7381)):
        snapshot = flake_world(levels).at(0.0)
        for what, options in (("primary rays", {"shadows": False, "samples": 1}), ("shadows and AA", {})):
            renderer = fs.Renderer(SIZE, "final", **options)
            value = best_time(lambda r=renderer, s=snapshot: r.frame(s, _CAMERA))
            peer = povray(sphereflake(levels), plain=bool(options))
            yield row(f"sphereflake of {count} blobs, 512x512, {what}", value, peer)
    yield row("donut and 400 pebbles, 640x360, shadows and AA", donut_frame(), None)


def row(name: str, value: float, peer_value: float | None) -> dict:
    """One figure of the table."""
    ratio = value / peer_value if peer_value else None
    peer = "POV-Ray" if peer_value else None
    return {"name": name, "value": value, "unit": "s/frame", "peer": peer, "peer_value": peer_value, "ratio": ratio}


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


def povray(levels, *, plain: bool) -> float | None:
    """Seconds POV-Ray takes to trace the same flake as one blob of spheres (tracing alone), or None without it."""
    if shutil.which("povray") is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder, "flake.pov")
        scene.write_text(_pov_scene(levels, plain))
        options = ["+W512", "+H512", "-D", f"+O{folder}/out.png", "-A" if plain else "+A0.1 +AM2 +R2"]
        command = ["povray", f"+I{scene}", *" ".join(options).split()]
        said = [subprocess.run(command, check=True, capture_output=True, text=True).stderr for _ in range(3)]
        return min(float(re.search(r"Trace Time:.*\(([\d.]+) seconds\)", text)[1]) for text in said)


def _pov_scene(levels, plain):
    """A blob of spheres with the same radii, its quartics falling as steeply there as the Gaussians do."""
    right, up = 2.0, 2.0
    eye = _vector(_CAMERA.eye)
    # The logarithm's slope: 4 R / (S^2 - R^2) of (1 - r^2/S^2)^2, 2 |B| / R of the Gaussian.
    reach = (1 - 2 / _BLOBBINESS) ** 0.5
    strength = 1.0 / (1 - 1 / reach**2) ** 2
    colors = [_vector(_shade(level)) for level in range(len(levels))]
    parts = "\n".join(
        f"sphere {{ {_vector(center)}, {reach * radius:.6f}, {strength:.6f} pigment {{ rgb {colors[level]} }} }}"
        for level, spheres in enumerate(levels)
        for center, radius in spheres
    )
    light = "shadowless" if plain else ""
    angle = _CAMERA.fov
    return f"""
        #version 3.7; global_settings {{ assumed_gamma 1 }}
        camera {{ location {eye} right x*{right / 2} up z*{up / 2} sky z angle {angle} look_at 0 }}
        light_source {{ <50, -60, 80>, 1 parallel point_at 0 {light} }}
        blob {{ threshold 1
        {parts}
        finish {{ diffuse 0.9 phong 0.25 }} }}
    """


def _vector(values):
    return "<" + ", ".join(f"{v:.6f}" for v in values) + ">"
