"""Diagnostic layers of a picture: depth, normals, owners, the share of each body, and the cost of each ray.

| layer | array | content |
|---|---|---|
| depth | (H, W) | distance along the ray through the pixel's centre, inf for a miss |
| normal | (H, W, 3) | unit normal, world frame, towards the eye; 0 for a miss |
| weights | (H, W, bodies) | share of each body of the world in the field at the hit, adding up to 1; 0 off surfaces |
| steps | (H, W) | evaluations of the surface field on the way |
| evaluations | (H, W) | evaluations of single elements on the way: `steps` times how many were summed |
| thing | (H, W) | what is seen: NOTHING, BODY, PARTICLE or SHAPE |
| owner | (H, W) | which one: index of a body (the one that weighs most), a particle or a hard shape; -1 for a miss |
"""

import numpy as np
import warp as wp

from fieldsim.errors import InputError
from fieldsim.render.scene.hits import BALLS, SOLIDS, Hits, exact_depth
from fieldsim.render.solids.packing import solids_of
from fieldsim.sources.elements import surface_of

LAYERS = ("depth", "normal", "weights", "steps")
NOTHING, BODY, PARTICLE, SHAPE = range(4)

# Grey of particles and hard shapes among the colours of weights.
_PARTICLE, _SHAPE = 0.75, 0.45
# Black, violet, red, orange, light yellow: the anchors of the heat map.
_HEAT = np.array([(0, 0, 0), (0.30, 0.07, 0.43), (0.73, 0.21, 0.33), (0.98, 0.55, 0.04), (0.99, 1.0, 0.75)])
_GAMMA = 2.2
_SLANT = np.array((0.36, -0.48, 0.8))


def make_room(hits: Hits, count: int, materials: int, device) -> None:
    """Room in `hits` for what a layered tracing adds up."""
    hits.work = wp.zeros((count, 2), dtype=int, device=device)
    hits.weights = wp.zeros((count, max(materials, 1)), dtype=float, device=device)


def collect(hits: Hits, slot, size, unit: float, snapshot) -> dict[str, np.ndarray]:
    """The layers of a picture of width and height `size` from hits, of which pixel k has the number slot[k]."""
    width, height = size
    of_pixels = lambda array: array.numpy()[slot]  # noqa: E731
    depth, raw = exact_depth(hits, len(slot))[slot], of_pixels(hits.thing)
    bodies = np.array([k for k, body in enumerate(snapshot.world.bodies) if body.surface is not None], dtype=int)
    thing, owner = _owners(raw, bodies, snapshot)
    fields = of_pixels(hits.weights)[:, : len(bodies)]
    weights = np.zeros((len(raw), len(snapshot.world.bodies)), dtype=np.float32)
    soft = (raw >= 0) & (raw < int(BALLS))
    weights[np.ix_(soft, bodies)] = fields[soft] / fields[soft].sum(axis=1, keepdims=True)
    hard = (thing == BODY) & ~soft
    weights[hard, owner[hard]] = 1.0
    work = of_pixels(hits.work)
    layers = {
        "depth": np.where(thing == NOTHING, np.inf, depth * unit),
        "normal": np.where((thing == NOTHING)[:, None], 0.0, of_pixels(hits.normal)),
        "weights": weights,
        "steps": work[:, 0],
        "evaluations": work[:, 1],
        "thing": thing,
        "owner": owner,
    }
    return {name: array.reshape(height, width, *array.shape[1:]) for name, array in layers.items()}


def _owners(raw, bodies, snapshot):
    """(thing, owner) of the numbers that hits carry; hard pieces of a skeleton count as their bodies."""
    thing = np.select([raw < 0, raw < int(BALLS), raw < int(SOLIDS)], [NOTHING, BODY, PARTICLE], SHAPE)
    owner = np.select([raw < 0, raw < int(BALLS), raw < int(SOLIDS)], [-1, raw, raw - int(BALLS)], raw - int(SOLIDS))
    pieces = (thing == SHAPE) & (owner >= len(solids_of(snapshot)))
    if pieces.any():
        owner[pieces] = surface_of(snapshot).owner[owner[pieces] - len(solids_of(snapshot))]
        thing[pieces] = BODY
    where = thing == BODY
    owner[where] = bodies[owner[where]]
    return thing, owner


def _palette(count):
    """Colours (count, 3), neighbours far apart: hues in steps of the golden section."""
    hue = np.arange(count)[:, None] * 0.618034 + np.array((0.02, 0.69, 0.35))
    return 0.55 + 0.38 * np.cos(2.0 * np.pi * hue)


class LayerPictures:
    """Pictures of one layer, frame by frame: what `Renderer.frame` is for colours.

    layer: "depth" (near is bright), "normal" (x, y, z as red, green, blue), "weights" (a colour for each body, mixed)
    or "steps" (a heat map: bright rays took many evaluations of the field). The first frame sets the range of depths
    and steps, so that brightness means the same in all of a film.
    """

    def __init__(self, renderer, layer: str):
        if layer not in LAYERS:
            raise InputError(f"layer is {layer!r}; give one of {', '.join(LAYERS)}")
        renderer.solver.check_layers()
        self.renderer, self.layer = renderer, layer
        self._range = None

    def frame(self, snapshot, camera) -> np.ndarray:
        """The picture of a snapshot, (height, width, 3) uint8."""
        layers = self.renderer.layers(snapshot, camera)
        color = getattr(self, f"_{self.layer}")(layers)
        return np.rint(255.0 * np.clip(color, 0.0, 1.0)).astype(np.uint8)

    def _depth(self, layers):
        depth = layers["depth"]
        seen = np.isfinite(depth)
        if self._range is None:
            self._range = (depth[seen].min(), depth[seen].max()) if seen.any() else (0.0, 1.0)
        near, far = self._range
        # Brightness is linear in 1 / depth, so that a ground up to the horizon does not use up the range.
        share = (near / np.where(seen, depth, far) - near / far) / max(1.0 - near / far, 1e-9)
        return np.repeat(np.where(seen, 0.15 + 0.85 * share, 0.0)[..., None], 3, axis=2)

    def _normal(self, layers):
        seen = layers["thing"] != NOTHING
        return np.where(seen[..., None], 0.5 + 0.5 * layers["normal"], 0.0)

    def _weights(self, layers):
        weights, thing = layers["weights"], layers["thing"]
        color = weights @ _palette(weights.shape[2])
        grey = np.select([thing == PARTICLE, thing == SHAPE], [_PARTICLE, _SHAPE], 0.0)
        # Shade a little by the normal, to show the shape.
        relief = 0.55 + 0.45 * np.abs(layers["normal"] @ _SLANT)
        return (color + grey[..., None]) * relief[..., None]

    def _steps(self, layers):
        steps = layers["steps"]
        if self._range is None:
            self._range = max(int(steps.max()), 1)
        heat = np.clip(steps / self._range, 0.0, 1.0) ** (1.0 / _GAMMA)
        anchors = np.linspace(0.0, 1.0, len(_HEAT))
        return np.stack([np.interp(heat, anchors, _HEAT[:, channel]) for channel in range(3)], axis=2)
