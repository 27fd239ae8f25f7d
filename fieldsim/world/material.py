"""Materials: thickness and softness of a surface around its skeleton, and its look."""

import dataclasses
import difflib
import functools
from collections.abc import Iterable
from typing import TYPE_CHECKING

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials import calibration
from fieldsim.potentials.kernels import Gaussian, Kernel
from fieldsim.potentials.primitives.base import Primitive
from fieldsim.types import ColorLike, RealLike, Timed
from fieldsim.world.color import color_rgb
from fieldsim.world.texture import NAMED, Texture

# The kinds of rays: from the camera, towards lights, off mirrors, through what is transparent.
RAYS = ("camera", "shadow", "reflected", "transmitted")


def rays_named(owner: str, names) -> tuple[str, ...]:
    """Kinds of rays, one or several, each once and in the order of RAYS."""
    remedy = "give some of " + ", ".join(RAYS)
    names = (names,) if isinstance(names, str) else validate.instances(owner, "visible_to", names, str, remedy)
    for name in names:
        if name not in RAYS:
            near = difflib.get_close_matches(name, RAYS, n=1)
            hint = f"did you mean {near[0]!r}?" if near else remedy
            raise InputError(f"{owner}: visible_to has {validate.shown(name)}; {hint}")
    return tuple(ray for ray in RAYS if ray in names)


@dataclasses.dataclass(frozen=True)
class Material:
    """The surface around a skeleton: its thickness, softness and look. Every number may be a function of time.

    radius: distance R > 0 between the primitive in isolation and its surface F = T (a point: a sphere; a segment, arc
    or circle: the tube far from its ends; a triangle or plane: the slab over its middle). blobbiness: B < 0; near zero,
    neighbours melt together; strongly negative, they keep their shapes (Blinn 1982; Sherstyuk 1999, 3.3.2).
    kernel: any kernel's class, whose width follows from R and B (see `calibration`; Gaussian: a^2 = -B / R^2); or a
    kernel, whose width is its own, as fs.Newtonian() without any softening. The strength is the one that puts the
    surface at R exactly. Fields without end, as 1/r, add up over a skeleton: its surface lies farther out.
    threshold: T relative to the canonical 1: above 1 the body shrinks, below it swells.
    reflection: share of the light that a surface mirrors; transmission: share of the rest that it lets in, tinted by
    its colour and bent by the index of refraction `ior`, of which Fresnel's law mirrors its part; what is left is lit.
    Transmission 1 and ior 1.5 make glass, 1.33 water. These mix by weight as the others do.
    visible_to: the kinds of rays that meet the body, of RAYS. What they do not meet does not swell others either.
    level: draws an equipotential instead, where the body's own gravity comes to `level`, summed over all bodies drawn
    so; kernel, blobbiness and threshold then play no part, and radius only where free bodies touch.
    color: see `color_rgb`; or a texture such as `Marble` or `ImageTexture`; "checker", "clouds", "marble" and "wood"
    stand for those as they are by default. ambient, diffuse, specular: factors of the lighting; shininess: Blinn-Phong
    exponent.
    """

    color: ColorLike | Texture = "terracotta"
    radius: float = 0.25
    blobbiness: float = -4.0
    kernel: type[Kernel] | Kernel = Gaussian
    threshold: float = 1.0
    ambient: float = 1.0
    diffuse: float = 0.9
    specular: float = 0.25
    shininess: float = 40.0
    level: float | None = None
    reflection: float = 0.0
    transmission: float = 0.0
    ior: float = 1.5
    visible_to: tuple[str, ...] = RAYS

    if TYPE_CHECKING:

        def __init__(
            self,
            color: Timed[ColorLike | Texture] = ...,
            radius: Timed[RealLike] = ...,
            blobbiness: Timed[RealLike] = ...,
            kernel: type[Kernel] | Kernel = ...,
            threshold: Timed[RealLike] = ...,
            ambient: Timed[RealLike] = ...,
            diffuse: Timed[RealLike] = ...,
            specular: Timed[RealLike] = ...,
            shininess: Timed[RealLike] = ...,
            level: Timed[RealLike] | None = ...,
            reflection: Timed[RealLike] = ...,
            transmission: Timed[RealLike] = ...,
            ior: Timed[RealLike] = ...,
            visible_to: str | Iterable[str] = ...,
        ) -> None: ...

    def __post_init__(self):
        known = isinstance(self.kernel, type) and issubclass(self.kernel, Kernel) and not self.kernel.abstract
        if not known and not isinstance(self.kernel, Kernel):
            raise InputError(
                f"Material: kernel is {validate.shown(self.kernel)}; give a kernel, fs.Gaussian or fs.Quartic(2.0)"
            )
        object.__setattr__(self, "visible_to", rays_named("Material", self.visible_to))
        if not self.animated:
            self._check()

    @property
    def animated(self) -> bool:
        """Whether any parameter is a function of time."""
        return any(callable(getattr(self, f.name)) for f in dataclasses.fields(self) if f.name != "kernel")

    def at(self, time: float) -> "Material":
        """The material at `time`."""
        time = validate.number("Material", "time", time)
        if not self.animated:
            return self
        # A kernel may be a class, which is no function of time.
        values = {f.name: getattr(self, f.name) for f in dataclasses.fields(self) if f.name != "kernel"}
        return validate.at_time("Material", functools.partial(dataclasses.replace, self), values, time)

    def _check(self):
        validate.fields(self, validate.number, "radius", "threshold", "shininess", "ior", above=0.0)
        validate.fields(self, validate.number, "ambient", "diffuse", "specular", at_least=0.0)
        validate.fields(self, validate.number, "reflection", "transmission", at_least=0.0, at_most=1.0)
        validate.fields(self, validate.number, "blobbiness", below=0.0)
        if self.level is not None:
            validate.fields(self, validate.number, "level", above=0.0)
        if isinstance(self.color, str) and self.color.lower() in NAMED:
            object.__setattr__(self, "color", NAMED[self.color.lower()]())
        if not isinstance(self.color, Texture):
            color_rgb("Material", self.color, others=NAMED)

    @property
    def rgb(self) -> tuple[float, float, float]:
        """Linear RGB, of a texture the colour that stands for it."""
        return self.color.rgb if isinstance(self.color, Texture) else color_rgb("Material", self.color)

    @property
    def surface_kernel(self) -> Kernel:
        """The kernel of the surface field."""
        if isinstance(self.kernel, Kernel):
            return self.kernel
        return calibration.kernel_of(self.kernel, self.radius, self.blobbiness)

    def surface_strength(self, dimension: int) -> tuple[float, float]:
        """(strength, fold) of a point, line or plane (0, 1, 2), such that F = 1 is the surface; see `potentials.row`.

        Raises InputError for a line or plane whose field is infinite.
        """
        dimension = validate.whole("Material.surface_strength", "dimension", dimension, at_least=0, at_most=2)
        strength, fold = calibration.strength(self.surface_kernel, self.radius, dimension)
        return strength / self.threshold, fold

    def strength_on(self, primitive: Primitive) -> tuple[float, float]:
        """(strength, fold) of a primitive, also of one that is measured by itself; see `potentials.calibration`."""
        validate.instance("Material.strength_on", "primitive", primitive, Primitive, "give one such as fs.Segment(...)")
        strength, fold = calibration.strength_on(self.surface_kernel, self.radius, primitive)
        return strength / self.threshold, fold
