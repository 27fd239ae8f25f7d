"""Scenes on which the tracers are held against the referee: every primitive and kernel, and the views that hurt."""

import dataclasses
import math

import numpy as np

import fieldsim as fs

KERNELS = (fs.Gaussian, fs.Cauchy, fs.Newtonian, fs.InverseSquare, fs.Metaball, fs.SoftObject, fs.Quartic)

STILL_LIFE = (
    fs.Point((0.0, -0.75, 0.45)),
    fs.Segment((-0.9, -0.5, -0.4), (0.9, -0.6, 0.1)),
    fs.Arc((0.0, 0.0, 0.0), (0.3, 0.0, 1.0), (1.0, 0.0, 0.0), 0.8, 3.5),
    fs.Circle((-0.2, 0.3, 0.4), (0.2, 1.0, 0.3), 0.4),
    fs.Triangle((0.2, 0.5, -0.4), (0.9, 0.7, 0.0), (0.3, 0.9, 0.5)),
)
CROSS = (fs.Segment((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)), fs.Segment((0.0, -1.0, 0.0), (0.0, 1.0, 0.0)))
STARFISH = tuple(
    fs.Arc(
        (math.cos(a), math.sin(a), 0.0), (math.sin(a), -math.cos(a), 0.3), (-math.cos(a), -math.sin(a), 0.0), 0.9, 1.6
    )
    for a in np.arange(7) * math.tau / 7
)


@dataclasses.dataclass(frozen=True)
class Scene:
    """Bodies as (skeleton, material), seen by a camera."""

    bodies: tuple
    camera: fs.Camera

    def snapshot(self) -> fs.Snapshot:
        """The world at time 0."""
        world = fs.World()
        for skeleton, material in self.bodies:
            world.add_body(fs.Body(skeleton, surface=material))
        return world.at(0.0)

    def from_anywhere(self, rng) -> fs.Camera:
        """A camera at the same distance in a random direction, looking nearly at the same point."""
        look_at = np.array(self.camera.look_at)
        distance = np.linalg.norm(np.array(self.camera.eye) - look_at)
        eye, aside = rng.normal(size=(2, 3))
        eye = look_at + distance * eye / np.linalg.norm(eye)
        return fs.Camera(tuple(eye), tuple(look_at + 0.05 * distance * aside), fov=self.camera.fov)


def _scene(skeleton, camera, **material):
    return Scene(((skeleton, fs.Material(**material)),), camera)


def _points(seed, count):
    return [fs.Point(tuple(p)) for p in np.random.default_rng(seed).uniform(-0.9, 0.9, (count, 3))]


def _sizes():
    """Bodies of three very different radii."""
    points = _points(7, 24)
    return tuple(
        (points[8 * k : 8 * k + 8], fs.Material(radius=r, blobbiness=b))
        for k, (r, b) in enumerate(((0.4, -2), (0.15, -4), (0.05, -8)))
    )


_FRONT = fs.Camera((1.2, -3.4, 1.6), fov=36)


def scenes() -> dict:
    """Functions by name that make a Scene each; they raise InputError where a surface cannot be."""
    made = {
        # Fields of 1/r add up over a skeleton; a higher level keeps them near it.
        f"still life, {k.__name__}": lambda k=k: _scene(
            STILL_LIFE, _FRONT, radius=0.2, kernel=k, threshold=2.0 if k is fs.Newtonian else 1.0
        )
        for k in KERNELS
    }
    for kernel in (fs.Gaussian, fs.Cauchy):
        made |= {
            f"{name}, {kernel.__name__}": lambda kernel=kernel, f=f: f(kernel)
            for name, f in {
                # The thesis's bad case: rays along an arm have long intervals (figures 4.3 to 4.5).
                "cross, front": lambda k: _scene(CROSS, fs.Camera((0.4, 0.3, 4.0), fov=36), radius=0.2, kernel=k),
                "cross, side": lambda k: _scene(CROSS, fs.Camera((4.0, 0.15, 0.1), fov=36), radius=0.2, kernel=k),
                "cross, along an arm": lambda k: _scene(
                    CROSS, fs.Camera((4.0, 0.0, 0.0), fov=30), radius=0.2, kernel=k
                ),
                "circle edge-on": lambda k: _scene(
                    fs.Circle((0, 0, 0), (0, 0, 1), 1.0), fs.Camera((4.0, 0.0, 0.0), fov=36), radius=0.2, kernel=k
                ),
                "blobs": lambda k: _scene(_points(1, 60), _FRONT, radius=0.2, blobbiness=-2.0, kernel=k),
            }.items()
        }
    return made | {
        "arcs edge-on": lambda: _scene(STARFISH, fs.Camera((5.0, 0.3, 0.0), fov=32), radius=0.15),
        "starfish": lambda: _scene(STARFISH, fs.Camera((2.0, -2.0, 5.0), fov=36), radius=0.2, blobbiness=-2.0),
        "long cigar, grazed": lambda: _scene(
            fs.Segment((0, 0, 0), (8, 0, 0)), fs.Camera((-0.5, 0.0, 0.23), (8.0, 0.0, 0.15), fov=40), radius=0.2
        ),
        "hard blobs": lambda: _scene(_points(2, 40), _FRONT, radius=0.2, blobbiness=-256.0),
        "soft blobs": lambda: _scene(_points(3, 200), _FRONT, radius=0.15, blobbiness=-0.5, threshold=2.0),
        "large and small": lambda: Scene(_sizes(), _FRONT),
        "camera within": lambda: _scene(
            STILL_LIFE[:4], fs.Camera((0.0, -0.75, 0.45), (0.0, 0.3, 0.2), fov=80), radius=0.2
        ),
        "from afar": lambda: _scene(STILL_LIFE[:4], fs.Camera((20.0, -56.0, 26.0), fov=2.2), radius=0.2),
        "through a ring": lambda: _scene(
            [fs.Circle((0, 0, 0), (0, 0, 1), 1.0), fs.Point((0, 0, -1))],
            fs.Camera((0.55, 0, 2.4), (0.2, 0, 0)),
            radius=0.3,
        ),
    }
