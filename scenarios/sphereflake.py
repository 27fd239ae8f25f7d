"""A sphereflake of blobs: every ball carries nine a third of its size, melting into it; the camera circles it.

levels: generations of balls; 1, 2, 3, 4 make 10, 91, 820, 7381 of them
blobbiness: how softly they melt together: -1 very, -10 hardly
"""

import numpy as np

import fieldsim as fs

# Six around the equator, three nearer to the top, as longitude and latitude.
PLACES = [(60 * k, 0.0) for k in range(6)] + [(30 + 120 * k, 54.7) for k in range(3)]
COLORS = ["#8c4d33", "#a57a60", "#bfa68c", "#d9d1b8", "#f2f2e0"]


def flake(levels: int):
    """(centres (N, 3), radius) of each generation."""
    lon, lat = np.radians(PLACES).T
    offsets = np.column_stack([np.cos(lon) * np.cos(lat), np.sin(lon) * np.cos(lat), np.sin(lat)])
    centers, frames, radius = np.zeros((1, 3)), np.eye(3)[None], 0.5
    yield centers, radius
    for _ in range(levels):
        ups = offsets @ np.swapaxes(frames, 1, 2)
        centers = (centers[:, None] + ups * radius * 4 / 3).reshape(-1, 3)
        ups = ups.reshape(-1, 3)
        aside = np.cross(ups, np.eye(3)[np.argmin(np.abs(ups), axis=1)])
        aside /= np.linalg.norm(aside, axis=1)[:, None]
        frames = np.stack([aside, np.cross(ups, aside), ups], axis=2)
        radius /= 3
        yield centers, radius


def build(levels: int = 3, blobbiness: float = -4.0) -> fs.Scenario:
    if not 0 <= levels <= 4:
        raise fs.InputError(f"levels is {levels}; give 0 to 4")
    world = fs.World()
    for (centers, radius), color in zip(flake(levels), COLORS, strict=False):
        skin = fs.Material(color=color, radius=radius, blobbiness=blobbiness)
        world.add_body(fs.Body([fs.Point(tuple(center)) for center in centers.tolist()], surface=skin))
    camera = fs.Camera.orbit(look_at=(0, 0, 0.05), radius=2.5, height=1.2, period=8.0, fov=42)
    return fs.Scenario(world, camera, duration=8.0, fps=30)


if __name__ == "__main__":
    fs.main(build)
