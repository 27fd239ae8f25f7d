"""Soft skins: a MuJoCo body tree as an animated skeleton, drawn as one blended convolution surface."""

import dataclasses
import math

import mujoco
import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.mujoco.models import ModelLike, color_of, counts, label, model_of, named_body, seen_geoms
from fieldsim.numerics import quaternion
from fieldsim.potentials.primitives.base import Primitive
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.primitives.triangle import Triangle
from fieldsim.types import RealLike, WholeLike
from fieldsim.world.body import Body
from fieldsim.world.material import Material
from fieldsim.world.motion import Pose

Kind = mujoco.mjtGeom
# A half size that exceeds the smallest by less than this share of it counts as equal to it.
EQUAL = 0.1
# Default blobbiness of a skin in the geoms' own colours.
BLOBBINESS = -2.5


@dataclasses.dataclass(frozen=True, eq=False)
class Skin:
    """The soft bodies that stand for bodies of a model: one per geom, in the frame of its MuJoCo body.

    bodies: without gravity; owners: the number of each one's MuJoCo body; geoms: the geoms that they stand for.
    counts: of the model's things (see `models.counts`), by which another model is refused.
    """

    bodies: tuple[Body, ...]
    owners: tuple[int, ...]
    geoms: tuple[int, ...]
    counts: tuple[int, ...] = ()

    def __post_init__(self):
        object.__setattr__(self, "bodies", validate.instances("Skin", "bodies", self.bodies, Body, "give fs.Body(...)"))
        for name in ("owners", "geoms"):
            items = validate.listed("Skin", name, getattr(self, name), "give numbers")
            numbers = tuple(validate.whole("Skin", f"{name}[{k}]", n, at_least=0) for k, n in enumerate(items))
            object.__setattr__(self, name, numbers)
        if not len(self.bodies) == len(self.owners) == len(self.geoms):
            raise InputError("Skin: bodies, owners and geoms are not alike in number; make it with fs.mujoco.skin")

    def refuse_other(self, model: mujoco.MjModel, owner: str) -> None:
        """Refuse a model that it was not made of, or of a copy."""
        if self.counts and self.counts != counts(model):
            raise InputError(f"{owner} is of another model; make it of this one: fs.mujoco.skin(model)")

    def poses(self, data: mujoco.MjData) -> tuple[Pose, ...]:
        """Where the bodies are in an MjData whose kinematics are up to date. Raises InputError for another model's."""
        validate.instance("Skin.poses", "data", data, mujoco.MjData, "give a mujoco.MjData of the model")
        self.refuse_other(data.model, "Skin.poses: the skin")
        return tuple(Pose(tuple(data.xpos[b].tolist()), tuple(data.xquat[b].tolist())) for b in self.owners)


def skin(
    model: ModelLike,
    root: str | WholeLike | None = None,
    *,
    material: Material | None = None,
    blobbiness: RealLike | None = None,
    swell: RealLike = 1.0,
) -> Skin:
    """The body tree from `root` (a name or number; None: all bodies that move) as a soft, blended surface.

    Every geom that is seen becomes the point, segment or plate (two triangles) that has the geom's extents when it is
    thickened by its smallest half size: a sphere a point, a capsule, a cylinder or a cigar of an ellipsoid a segment, a
    flat box a plate; half sizes within a tenth of the smallest count as equal to it. Of a mesh it is the box around it.
    material: for all, but that each geom gives its own radius, times `swell`; None: every geom in its own colour.
    blobbiness: default the material's, or -2.5. Blending has its price: the softer, the more the surface draws in
    at the ends of parts by themselves, and bulges where parts meet; and it melts into surfaces of the world's bodies
    where it touches them, as these do into each other. Planes and height fields have no skin. Sizes and colours are
    those that the model has now: of what is changed later make another skin.
    Raises InputError for a body that is not there and for a tree without geoms to be seen.
    """
    model = model_of(model)
    swell = validate.number("skin", "swell", swell, above=0.0)
    if material is not None:
        remedy = "give a fs.Material, or None for the geoms' own colours"
        validate.instance("skin", "material", material, Material, remedy)
    if blobbiness is None:
        blobbiness = material.blobbiness if material else BLOBBINESS
    tree = _tree(model, root)
    geoms = [g for g in seen_geoms(model) if model.geom_bodyid[g] in tree and _half_sizes(model, g) is not None]
    if not geoms:
        where = "the model" if root is None else f"the tree of body {root!r}"
        raise InputError(f"skin: {where} has no geom to be seen that moves; give its bodies geoms of groups 0 to 2")
    bodies = tuple(_soft(model, geom, material, blobbiness, swell) for geom in geoms)
    return Skin(bodies, tuple(int(model.geom_bodyid[g]) for g in geoms), tuple(geoms), counts(model))


def _tree(model, root):
    """Numbers of the bodies of a tree."""
    if root is None:
        return {b for b in range(1, model.nbody) if model.body_weldid[b] != 0}
    found = named_body(model, root) if isinstance(root, str) else root
    if isinstance(found, bool) or not isinstance(found, int | np.integer) or not 0 <= found < model.nbody:
        names = ", ".join(repr(model.body(b).name) for b in range(1, model.nbody) if model.body(b).name)
        raise InputError(f"skin: the model has no body {validate.shown(root)}; it has {names or 'none with a name'}")
    tree = {int(found)}
    for body in range(int(found) + 1, model.nbody):
        if model.body_parentid[body] in tree:
            tree.add(body)
    return tree


def _half_sizes(model, geom):
    """Middle (3,) in the geom's frame and half sizes (3,) of the box around a geom; None for one without an end."""
    kind, size = Kind(int(model.geom_type[geom])), model.geom_size[geom]
    if kind in (Kind.mjGEOM_PLANE, Kind.mjGEOM_HFIELD):
        return None
    if kind == Kind.mjGEOM_SPHERE:
        return np.zeros(3), size[[0, 0, 0]]
    if kind == Kind.mjGEOM_CAPSULE:
        return np.zeros(3), np.array([size[0], size[0], size[0] + size[1]])
    if kind == Kind.mjGEOM_CYLINDER:
        return np.zeros(3), size[[0, 0, 1]]
    if kind in (Kind.mjGEOM_ELLIPSOID, Kind.mjGEOM_BOX):
        return np.zeros(3), size.copy()
    return model.geom_aabb[geom, :3].copy(), model.geom_aabb[geom, 3:].copy()


def _soft(model, geom, material, blobbiness, swell):
    """One geom as a Body in the frame of its MuJoCo body."""
    middle, half = _half_sizes(model, geom)
    turn = quaternion.matrices(model.geom_quat[geom])
    middle = model.geom_pos[geom] + turn @ middle
    primitives, radius = medial(half)
    placed = [dataclasses.replace(p, **{n: _moved(getattr(p, n), turn, middle) for n in p.points}) for p in primitives]
    look = material or Material(tuple(color_of(model, geom)[:3].tolist()))
    look = dataclasses.replace(look, radius=swell * radius, blobbiness=blobbiness)
    return Body(placed, surface=look, name=f"skin of geom {label(model, geom)}")


def _moved(point, turn, middle):
    return tuple((middle + turn @ np.asarray(point)).tolist())


def medial(half) -> tuple[tuple[Primitive, ...], float]:
    """What has the half sizes (3,) when thickened by a radius: a point, a segment or a plate; and that radius."""
    radius = float(min(half))
    over = [float(h) - radius if h > (1.0 + EQUAL) * radius else 0.0 for h in half]
    long = [axis for axis in range(3) if over[axis] > 0.0]
    if not long:
        return (Point((0.0, 0.0, 0.0)),), math.prod(map(float, half)) ** (1 / 3)
    along = np.diag(over)
    if len(long) == 1:
        end = along[long[0]]
        return (Segment(tuple((-end).tolist()), tuple(end.tolist())),), radius
    a, b = along[long[0]], along[long[1]]
    corners = [tuple((s * a + t * b).tolist()) for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return (Triangle(*corners[:3]), Triangle(corners[0], *corners[2:])), radius
