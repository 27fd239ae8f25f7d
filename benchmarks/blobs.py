"""Blobs that are drawn beside POV-Ray: sphereflakes, a cross, a donut and a coral, as worlds and as POV-Ray scenes.

The pictures have the same camera, light, radii and colours. POV-Ray's density (1 - r^2/S^2)^2 has the same radius in
isolation as our Gaussian exp(-a^2 r^2) and falls as steeply there, so blends look alike without being equal. POV-Ray
knows no circles: its donut is a ring of 32 cylinders, with bulges where they meet.
"""

import dataclasses
import itertools

import numpy as np

import fieldsim as fs

CAMERA = fs.Camera(eye=(2.1, 1.3, 1.7), fov=45)
BLOBBINESS = -4.0
RING_PARTS = 32
_LIGHT = (50.0, -60.0, 80.0)


@dataclasses.dataclass(frozen=True)
class Layer:
    """Primitives with one radius and one colour."""

    primitives: list
    radius: float
    color: tuple[float, float, float]

    @property
    def material(self) -> fs.Material:
        """What the layer is made of."""
        return fs.Material(color=self.color, radius=self.radius, blobbiness=BLOBBINESS)


def world_of(layers: list[Layer]) -> fs.World:
    """The layers as bodies under one light."""
    light = fs.DirectionalLight(direction=tuple(-x for x in _LIGHT))
    world = fs.World(lights=(light,), background=fs.Background("black", "black", stars=0))
    for layer in layers:
        world.add_body(fs.Body(layer.primitives, surface=layer.material))
    return world


def flake(levels: int) -> list[Layer]:
    """Haines's sphereflake: a layer a level, lighter as the blobs get smaller; 10, 91, 820, 7381 for 1 to 4 levels."""
    return [
        Layer([fs.Point(tuple(center)) for center in centers], radius, _shade(level))
        for level, (centers, radius) in enumerate(sphereflake(levels))
    ]


def sphereflake(levels: int, radius: float = 0.5) -> list[tuple[np.ndarray, float]]:
    """(centres, radius) by level: each sphere carries 9, a third of its size."""
    # Six around the equator, three nearer to the top, 60 degrees turned.
    angles = [(k * np.pi / 3, 0.0) for k in range(6)] + [
        (np.pi / 6 + k * 2 * np.pi / 3, np.radians(54.7)) for k in range(3)
    ]
    offsets = np.array([(np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)) for a, b in angles])
    result = [(np.zeros((1, 3)), radius)]
    frames = [np.eye(3)]
    for _ in range(levels):
        centers, size = result[-1]
        turned = [offsets @ frame.T for frame in frames]
        result.append((np.concatenate([c + t * size * 4 / 3 for c, t in zip(centers, turned, strict=True)]), size / 3))
        frames = [_frame(up) for t in turned for up in t]
    return result


def _frame(up):
    """A rotation whose third column is `up`."""
    side = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    side /= np.linalg.norm(side)
    return np.stack([side, np.cross(up, side), up], axis=1)


def _shade(level):
    return tuple(np.array([0.55, 0.3, 0.2]) + level / 4 * np.array([0.4, 0.55, 0.6]))


def cross() -> list[Layer]:
    """Two crossed segments."""
    arms = [fs.Segment((-0.9, 0, 0), (0.9, 0, 0)), fs.Segment((0, 0, -0.9), (0, 0, 0.9))]
    return [Layer(arms, 0.25, _shade(1))]


def donut() -> list[Layer]:
    """One circle."""
    return [Layer([fs.Circle((0, 0, 0), (0, 0, 1), 0.8)], 0.25, _shade(1))]


def coral(seed: int = 1) -> list[Layer]:
    """A tree of 31 branches with 512 spikes."""
    rng = np.random.default_rng(seed)
    tips, branches = [(np.array([0, 0, -0.9]), np.array([0, 0, 1.0]))], []
    for level in range(5):
        grown = []
        for start, heading in tips:
            end = start + 0.5 * 0.8**level * heading
            branches.append((start, end))
            side = np.cross(heading, rng.normal(size=3))
            side /= np.linalg.norm(side)
            grown += [(end, 0.75 * heading + sign * 0.66 * side) for sign in (-1, 1)]
        tips = [(end, heading / np.linalg.norm(heading)) for end, heading in grown]
    spikes = []
    for k in range(512):
        start, end = branches[k % len(branches)]
        foot = start + rng.uniform() * (end - start)
        heading = np.cross(end - start, rng.normal(size=3))
        spikes.append((foot, foot + 0.17 * heading / np.linalg.norm(heading)))
    return [
        Layer([fs.Segment(tuple(a), tuple(b)) for a, b in parts], radius, _shade(level))
        for parts, radius, level in ((branches, 0.06, 1), (spikes, 0.018, 4))
    ]


def pov_scene(layers: list[Layer], *, shadows: bool) -> str:
    """The layers as one blob, as POV-Ray reads it."""
    parts = "\n".join(line for layer in layers for line in _pov_components(layer))
    camera = f"right x up y sky z angle {CAMERA.fov} look_at 0"
    return f"""
        #version 3.7; global_settings {{ assumed_gamma 1 }}
        camera {{ location {_vector(_mirrored(CAMERA.eye))} {camera} }}
        light_source {{ {_vector(_mirrored(_LIGHT))}, 1 parallel point_at 0 {"" if shadows else "shadowless"} }}
        #default {{ finish {{ ambient 0.03 diffuse 0.9 phong 0.25 }} }}
        blob {{ threshold 1
        {parts} }}
    """


def _pov_components(layer):
    # The logarithm's slope: 4 R / (S^2 - R^2) of (1 - r^2/S^2)^2, 2 |B| / R of the Gaussian.
    reach = (1 - 2 / BLOBBINESS) ** 0.5
    look = (
        f"{reach * layer.radius:.6f}, {(1 - 1 / reach**2) ** -2:.6f} pigment {{ rgb {_vector(layer.material.rgb)} }} }}"
    )
    for primitive in layer.primitives:
        for part in _pieces(primitive):
            shape = "sphere" if len(part) == 1 else "cylinder"
            yield f"{shape} {{ {', '.join(_vector(_mirrored(point)) for point in part)}, {look}"


def _pieces(primitive):
    """Points, or pairs of ends of cylinders."""
    if isinstance(primitive, fs.Point):
        return [(primitive.position,)]
    if isinstance(primitive, fs.Segment):
        return [(primitive.start, primitive.end)]
    angle = np.linspace(0, 2 * np.pi, RING_PARTS + 1)
    ring = primitive.radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    return list(itertools.pairwise(ring))


def _mirrored(point):
    """POV-Ray's axes are left-handed."""
    return (point[0], -point[1], point[2])


def _vector(values):
    return "<" + ", ".join(f"{v:.6f}" for v in values) + ">"
