"""Planets as geoms for MuJoCo's own contact solver."""

import dataclasses
import re
from collections.abc import Sequence

import mujoco
import numpy as np

from fieldsim import validate
from fieldsim.errors import FieldsimError, InputError
from fieldsim.mujoco.callback.tables import sources_of
from fieldsim.mujoco.models import alike, named_body
from fieldsim.potentials.meshes.mesh import TriangleMesh
from fieldsim.types import ArrayLike, RealLike, WholeLike
from fieldsim.world.body import Body
from fieldsim.world.motion import pose_at

KINDS = ("sdf", "mesh")
# The first version that makes a signed distance field of a mesh by itself.
SDF_SINCE = (3, 3, 5)
# A mesh lies inside a round surface: averaged over a face, by this share of the distance at its middle.
MEAN_OF_MIDDLE = 0.75


@dataclasses.dataclass(frozen=True, eq=False)
class PlanetGeom:
    """The MJCF of a planet: `asset` goes into <asset>, and `body` (or `geom` alone, at its frame) into <worldbody>.

    name: of body, geom, mesh and material. mocap: the body is a mocap body, which `follow` moves. mesh: the triangles.
    """

    name: str
    asset: str
    geom: str
    body: str
    mocap: bool
    source: Body
    mesh: TriangleMesh

    def __post_init__(self):
        for name in ("name", "asset", "geom", "body"):
            validate.text("PlanetGeom", name, getattr(self, name))
        validate.flag("PlanetGeom", "mocap", self.mocap)
        validate.instance("PlanetGeom", "source", self.source, Body, "give a fs.Body")
        validate.instance("PlanetGeom", "mesh", self.mesh, TriangleMesh, "give a fs.TriangleMesh")


def planet_geom(
    body: Body,
    *,
    name: str = "",
    kind: str = "sdf",
    resolution: WholeLike | None = None,
    tolerance: RealLike | None = None,
    friction: ArrayLike = (1.0, 0.005, 0.0001),
    mocap: bool | None = None,
    time: RealLike = 0.0,
) -> PlanetGeom:
    """The surface of `body` as a geom that MuJoCo's own solver collides with.

    name: default the body's own, or "planet". kind: "sdf", a signed distance field, true to any shape; or "mesh",
    which MuJoCo collides with as its convex hull, and is quicker. resolution, tolerance: of the mesh, as of
    `Body.surface_mesh`; MuJoCo's distance field adds its own error of about half a cell in 128 of its longest side's
    curvature. friction: sliding, torsional, rolling. mocap: whether motion may move it, default if the body moves.
    The shape is that at `time`; MuJoCo's geoms do not deform. Raises InputError for a body without a surface, and
    FieldsimError for "sdf" with a MuJoCo before 3.3.5.
    """
    validate.instance("planet_geom", "body", body, Body, "give a fs.Body")
    sources_of(body)  # refuses free ones
    validate.choice("planet_geom", "kind", kind, KINDS)
    time = validate.number("planet_geom", "time", time)
    mocap = body.moving if mocap is None else validate.flag("planet_geom", "mocap", mocap)
    if kind == "sdf" and mujoco_version() < SDF_SINCE:
        raise FieldsimError(
            f"planet_geom: MuJoCo {mujoco.__version__} makes no signed distance field of a mesh; install 3.3.5 or "
            "later, give kind='mesh', or use FieldForces(contact=...)"
        )
    name = _checked_name(body.name or "planet" if isinstance(name, str) and not name else name)
    friction = _friction(friction)
    mesh = _centered_between(body, time, body.surface_mesh(time, resolution=resolution, tolerance=tolerance))
    asset = (
        f'<material name="{name}" {_look(_surface(body, time))}/>\n'
        f'<mesh name="{name}" vertex="{_words(mesh.vertices)}" face="{" ".join(map(str, mesh.faces.ravel()))}"/>'
    )
    geom = f'<geom name="{name}" type="{kind}" mesh="{name}" material="{name}" friction="{friction}"/>'
    pose = pose_at(body.motion, time)
    flag = ' mocap="true"' if mocap else ""
    place = f'pos="{_words(pose.position)}" quat="{_words(pose.rotation)}"'
    return PlanetGeom(name, asset, geom, f'<body name="{name}"{flag} {place}>{geom}</body>', mocap, body, mesh)


def follow(model: mujoco.MjModel, data: mujoco.MjData, planets: Sequence[PlanetGeom]) -> None:
    """Put the mocap bodies of `planets` (PlanetGeoms) where their sources are at data.time; call it before each step.

    MuJoCo knows a mocap body's place but not its velocity: it pushes, but drags nothing along by friction.
    Raises InputError for what is no PlanetGeom, for data of another model, and a model without its mocap body.
    """
    validate.instance("follow", "model", model, mujoco.MjModel, "give a mujoco.MjModel")
    remedy = "give fs.mujoco.planet_geom(body, mocap=True)"
    for planet in validate.instances("follow", "planets", planets, PlanetGeom, remedy):
        _follow(model, data, planet)


def _follow(model, data, planet):
    body = named_body(model, planet.name)
    if body < 0 or model.body_mocapid[body] < 0:
        raise InputError(
            f"follow: the model has no mocap body {planet.name!r}; put planet_geom(..., mocap=True).body into it"
        )
    alike(model, data, "follow")
    pose = pose_at(planet.source.motion, data.time)
    data.mocap_pos[model.body_mocapid[body]] = pose.position
    data.mocap_quat[model.body_mocapid[body]] = pose.rotation


def _centered_between(body, time, mesh):
    """The mesh moved outwards until it lies as far outside the surface as inside it, on average."""
    field = body.surface_field(time)
    middles = mesh.corners.mean(axis=1)
    value, gradient = field.value_and_gradient(middles)
    areas = np.linalg.norm(np.cross(*(mesh.corners[:, k] - mesh.corners[:, 0] for k in (1, 2))), axis=1)
    inside = np.average((value - 1.0) / np.linalg.norm(gradient, axis=1), weights=areas)
    _, slope = field.value_and_gradient(mesh.vertices)
    outward = -slope / np.linalg.norm(slope, axis=1)[:, None]
    return TriangleMesh(mesh.vertices + MEAN_OF_MIDDLE * inside * outward, mesh.faces)


def _surface(body, time):
    """The material of the body's surface, which has just been meshed."""
    assert body.surface is not None
    return body.surface.at(time)


def _look(material):
    red, green, blue = (np.asarray(material.rgb) ** (1 / 2.2)).clip(0.0, 1.0)
    specular, shine = min(1.0, material.specular), min(1.0, material.shininess / 128.0)
    return f'rgba="{red:.4g} {green:.4g} {blue:.4g} 1" specular="{specular:.4g}" shininess="{shine:.4g}"'


def _friction(friction):
    numbers = np.atleast_1d(validate.numbers("planet_geom", "friction", friction))
    if numbers.ndim > 1 or not 1 <= len(numbers) <= 3 or (numbers < 0.0).any():
        raise InputError(
            f"planet_geom: friction is {validate.shown(friction)}; give sliding, torsional and rolling friction, of at "
            "least 0"
        )
    return _words(numbers)


def _words(numbers):
    return " ".join(f"{x:.12g}" for x in np.ravel(numbers))


def _checked_name(name):
    if not isinstance(name, str) or not name.isprintable() or re.search(r"[\"<>&]", name):
        raise InputError(
            f"planet_geom: name is {validate.shown(name)}; give a text without quotes, <, >, & and breaks of lines"
        )
    return name


def mujoco_version():
    """The installed version of MuJoCo, three numbers."""
    return tuple(int(part) for part in re.findall(r"\d+", mujoco.__version__)[:3])
