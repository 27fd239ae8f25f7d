"""fieldsim: convolution fields that pull, collide and are seen.

`import fieldsim as fs`; every public name is listed in `__all__`.
"""

from fieldsim import sampling
from fieldsim.cli import main
from fieldsim.dynamics.diagnostics import (
    Energy,
    EnergyLog,
    EnergyReport,
    angular_momentum,
    common_spin,
    energy,
    jacobi,
)
from fieldsim.dynamics.integrators import Leapfrog
from fieldsim.dynamics.simulation import Simulation
from fieldsim.errors import (
    DeviceError,
    FieldsimError,
    FieldsimWarning,
    FilmError,
    InputError,
    PortableError,
    ScenarioError,
)
from fieldsim.filming import Report, film
from fieldsim.potentials import planets, profile
from fieldsim.potentials.arc import Arc
from fieldsim.potentials.circle import Circle
from fieldsim.potentials.field import Field, gravity
from fieldsim.potentials.kernels import Cauchy, Gaussian, InverseSquare, Metaball, Newtonian, Quartic, SoftObject
from fieldsim.potentials.mesh import TriangleMesh, mesh
from fieldsim.potentials.plane import Plane
from fieldsim.potentials.point import Point
from fieldsim.potentials.profile import Profile, ProfiledArc, ProfiledSegment, profiled
from fieldsim.potentials.segment import Segment
from fieldsim.potentials.shapes import bezier, box, catmull_rom, disc, polygon, polyline, rectangle
from fieldsim.potentials.solid import Face, solid, solid_faces
from fieldsim.potentials.tapered import TaperedSegment
from fieldsim.potentials.triangle import Triangle
from fieldsim.render.camera import Camera
from fieldsim.render.image import Renderer, render
from fieldsim.render.video import Film
from fieldsim.scenario import Scenario, load
from fieldsim.world.body import Body, Bounce, Particles
from fieldsim.world.light import Background, DirectionalLight, PointLight
from fieldsim.world.material import Material
from fieldsim.world.motion import Keyframes, Pose, Spin, timeline
from fieldsim.world.rigid import Rigid
from fieldsim.world.world import Snapshot, World

__all__ = [
    "Arc",
    "Background",
    "Body",
    "Bounce",
    "Camera",
    "Cauchy",
    "Circle",
    "DeviceError",
    "DirectionalLight",
    "Energy",
    "EnergyLog",
    "EnergyReport",
    "Face",
    "Field",
    "FieldsimError",
    "FieldsimWarning",
    "Film",
    "FilmError",
    "Gaussian",
    "InputError",
    "InverseSquare",
    "Keyframes",
    "Leapfrog",
    "Material",
    "Metaball",
    "Newtonian",
    "Particles",
    "Plane",
    "Point",
    "PointLight",
    "PortableError",
    "Pose",
    "Profile",
    "ProfiledArc",
    "ProfiledSegment",
    "Quartic",
    "Renderer",
    "Report",
    "Rigid",
    "Scenario",
    "ScenarioError",
    "Segment",
    "Simulation",
    "Snapshot",
    "SoftObject",
    "Spin",
    "TaperedSegment",
    "Triangle",
    "TriangleMesh",
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
    "main",
    "mesh",
    "planets",
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
