"""fieldsim: convolution fields that pull, collide and are seen.

`import fieldsim as fs`; every public name is listed in `__all__`.
"""

import types as _types
import typing

from fieldsim import plots, sampling
from fieldsim.cli.program import main
from fieldsim.dynamics.auto import Auto, Choice
from fieldsim.dynamics.diagnostics.energy_log import EnergyLog, EnergyReport
from fieldsim.dynamics.diagnostics.invariants import Energy, angular_momentum, common_spin, energy, jacobi
from fieldsim.dynamics.diagnostics.totals import Drift
from fieldsim.dynamics.integrators.splittings import (
    BlanesMoan4,
    BlanesMoan6,
    BlanesMoan6B,
    Chin4,
    Integrator,
    KahanLi6,
    KahanLi8,
    Leapfrog,
    Omelyan4,
    Omelyan6,
    Omelyan8,
    SofroniouSpaletta10,
    Splitting,
    Suzuki4,
)
from fieldsim.dynamics.radau.radau import Radau
from fieldsim.dynamics.simulation import Simulation
from fieldsim.errors import (
    DeviceError,
    FieldsimError,
    FieldsimWarning,
    FilmError,
    InputError,
    OperandError,
    PortableError,
    ScenarioError,
)
from fieldsim.filming.film import film
from fieldsim.filming.report import Report
from fieldsim.orbits.lyapunov import Lyapunov, lyapunov
from fieldsim.orbits.poincare import Crossings, Section, poincare
from fieldsim.plots import Picture
from fieldsim.potentials.field import Field
from fieldsim.potentials.gravity import gravity
from fieldsim.potentials.kernels import Cauchy, Gaussian, InverseSquare, Metaball, Newtonian, Quartic, SoftObject
from fieldsim.potentials.meshes.mesh import TriangleMesh, mesh
from fieldsim.potentials.primitives import profile
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.primitives.circle import Circle
from fieldsim.potentials.primitives.face import Face
from fieldsim.potentials.primitives.plane import Plane
from fieldsim.potentials.primitives.point import Point
from fieldsim.potentials.primitives.profile import Profile, ProfiledArc, ProfiledSegment, profiled
from fieldsim.potentials.primitives.segment import Segment
from fieldsim.potentials.primitives.tapered import TaperedSegment
from fieldsim.potentials.primitives.triangle import Triangle
from fieldsim.potentials.skeletons import planets
from fieldsim.potentials.skeletons.shapes import bezier, box, catmull_rom, disc, polygon, polyline, rectangle
from fieldsim.potentials.skeletons.solid import solid, solid_faces
from fieldsim.recording.recording import Recorded, Recording
from fieldsim.render.camera import Camera
from fieldsim.render.output.video import Film
from fieldsim.render.renderer import Renderer, render
from fieldsim.scenario import Scenario, load
from fieldsim.world.body import Body
from fieldsim.world.contact import Absorb, Bounce, Repulsion, Status
from fieldsim.world.light import Background, DirectionalLight, Fog, PointLight
from fieldsim.world.material import Material
from fieldsim.world.motion import Keyframes, Pose, Spin, timeline
from fieldsim.world.particles import Particles
from fieldsim.world.rig import Bone, Rig
from fieldsim.world.rigid import Rigid
from fieldsim.world.shapes import Ball, Box, Capsule, Cylinder, Ellipsoid, Ground, ShapeGroup, TriangleSurface
from fieldsim.world.snapshot import Snapshot
from fieldsim.world.texture import Checker, Clouds, ImageTexture, Marble, SolidTexture, Texture, Wood
from fieldsim.world.world import World

if typing.TYPE_CHECKING:
    from fieldsim import mujoco as mujoco  # loaded when first asked for, below

__all__ = [
    "Absorb",
    "Arc",
    "Auto",
    "Background",
    "Ball",
    "BlanesMoan4",
    "BlanesMoan6",
    "BlanesMoan6B",
    "Body",
    "Bone",
    "Bounce",
    "Box",
    "Camera",
    "Capsule",
    "Cauchy",
    "Checker",
    "Chin4",
    "Choice",
    "Circle",
    "Clouds",
    "Crossings",
    "Cylinder",
    "DeviceError",
    "DirectionalLight",
    "Drift",
    "Ellipsoid",
    "Energy",
    "EnergyLog",
    "EnergyReport",
    "Face",
    "Field",
    "FieldsimError",
    "FieldsimWarning",
    "Film",
    "FilmError",
    "Fog",
    "Gaussian",
    "Ground",
    "ImageTexture",
    "InputError",
    "Integrator",
    "InverseSquare",
    "KahanLi6",
    "KahanLi8",
    "Keyframes",
    "Leapfrog",
    "Lyapunov",
    "Marble",
    "Material",
    "Metaball",
    "Newtonian",
    "Omelyan4",
    "Omelyan6",
    "Omelyan8",
    "OperandError",
    "Particles",
    "Picture",
    "Plane",
    "Point",
    "PointLight",
    "PortableError",
    "Pose",
    "Profile",
    "ProfiledArc",
    "ProfiledSegment",
    "Quartic",
    "Radau",
    "Recorded",
    "Recording",
    "Renderer",
    "Report",
    "Repulsion",
    "Rig",
    "Rigid",
    "Scenario",
    "ScenarioError",
    "Section",
    "Segment",
    "ShapeGroup",
    "Simulation",
    "Snapshot",
    "SofroniouSpaletta10",
    "SoftObject",
    "SolidTexture",
    "Spin",
    "Splitting",
    "Status",
    "Suzuki4",
    "TaperedSegment",
    "Texture",
    "Triangle",
    "TriangleMesh",
    "TriangleSurface",
    "Wood",
    "World",
    "angular_momentum",
    "bezier",
    "box",
    "catmull_rom",
    "common_spin",
    "disc",
    "energy",
    "film",
    "gravity",
    "jacobi",
    "load",
    "lyapunov",
    "main",
    "mesh",
    "planets",
    "plots",
    "poincare",
    "polygon",
    "polyline",
    "profile",
    "profiled",
    "rectangle",
    "render",
    "sampling",
    "solid",
    "solid_faces",
    "timeline",
]


def __getattr__(name: str) -> _types.ModuleType:
    """`fieldsim.mujoco`, loaded when first asked for."""
    if name == "mujoco":
        import importlib

        return importlib.import_module("fieldsim.mujoco")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
