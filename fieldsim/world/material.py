"""Materials: how thick and soft the tissue on a skeleton is, and how it looks."""

import dataclasses
import math

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials.kernels import Cauchy, Gaussian
from fieldsim.world.color import color_rgb
from fieldsim.world.motion import value_at
from fieldsim.world.texture import Texture

# Half width of (1 + s^2 r^2)^-2 equals that of exp(-a^2 r^2) when s = CAUCHY_PER_GAUSSIAN a.
CAUCHY_PER_GAUSSIAN = math.sqrt((math.sqrt(2.0) - 1.0) / math.log(2.0))


@dataclasses.dataclass(frozen=True)
class Material:
    """The soft tissue on a skeleton and its look. Every number may be a function of time.

    radius: distance R > 0 between the primitive in isolation and its surface F = T (a point: a sphere; a segment, arc
    or circle: the tube far from its ends). blobbiness: B < 0; near zero, neighbours melt together; strongly negative,
    they keep their shapes (Blinn 1982; Sherstyuk 1999, 3.3.2). kernel: Gaussian or Cauchy. For the Gaussian
    a^2 = -B / R^2; the Cauchy takes the width that has the same half maximum. The strength is the one that puts the
    surface at R exactly.
    threshold: T relative to the canonical 1: above 1 the body shrinks, below it swells.
    color: see `color_rgb`, or a solid texture such as `Marble`. ambient, diffuse, specular: factors of the lighting;
    shininess: Blinn-Phong exponent.
    """

    color: object = "terracotta"
    radius: float = 0.25
    blobbiness: float = -4.0
    kernel: type = Gaussian
    threshold: float = 1.0
    ambient: float = 1.0
    diffuse: float = 0.9
    specular: float = 0.25
    shininess: float = 40.0

    def __post_init__(self):
        if self.kernel not in (Gaussian, Cauchy):
            raise InputError(f"Material: kernel is {self.kernel!r}; give fs.Gaussian or fs.Cauchy (the class)")
        if not self.animated:
            self._check()

    @property
    def animated(self) -> bool:
        """Whether any parameter is a function of time."""
        return any(callable(getattr(self, f.name)) for f in dataclasses.fields(self) if f.name != "kernel")

    def at(self, time: float) -> "Material":
        """The material at `time`."""
        if not self.animated:
            return self
        return dataclasses.replace(
            self,
            **{f.name: value_at(getattr(self, f.name), time) for f in dataclasses.fields(self) if f.name != "kernel"},
        )

    def _check(self):
        for name in ("radius", "threshold", "shininess"):
            object.__setattr__(self, name, validate.number("Material", name, getattr(self, name), above=0.0))
        for name in ("ambient", "diffuse", "specular"):
            object.__setattr__(self, name, validate.number("Material", name, getattr(self, name), at_least=0.0))
        blobbiness = validate.number("Material", "blobbiness", self.blobbiness)
        if not blobbiness < 0:
            raise InputError(f"Material: blobbiness is {blobbiness:g}; give a negative number, such as -4")
        object.__setattr__(self, "blobbiness", blobbiness)
        if not isinstance(self.color, Texture):
            color_rgb("Material", self.color)

    @property
    def rgb(self) -> tuple[float, float, float]:
        """Linear RGB, of a texture its first colour."""
        return color_rgb("Material", self.color.color if isinstance(self.color, Texture) else self.color)

    @property
    def texture_row(self) -> tuple[float, ...]:
        """See `Texture.row`; a kind of 0 for a plain colour."""
        return self.color.row if isinstance(self.color, Texture) else (0.0,) * 7

    @property
    def surface_kernel(self) -> Gaussian | Cauchy:
        """The kernel of the surface field."""
        a = math.sqrt(-self.blobbiness) / self.radius
        return Gaussian(a) if self.kernel is Gaussian else Cauchy(CAUCHY_PER_GAUSSIAN * a)

    def surface_strength(self, dimension: int) -> tuple[float, float]:
        """(strength, fold) of a primitive of the given dimension, such that F = 1 is the surface; see `cells`."""
        kernel = self.surface_kernel
        if isinstance(kernel, Gaussian):
            # A line's field is sqrt(pi)/a exp(-a^2 rho^2), a plane's pi/a^2 exp(-a^2 z^2).
            return (kernel.a / math.sqrt(math.pi)) ** dimension / self.threshold, -self.blobbiness
        q = 1.0 + (kernel.s * self.radius) ** 2
        isolated = (q**-2, math.pi / (2 * kernel.s) * q**-1.5, math.pi / kernel.s**2 / q)[dimension]
        return 1.0 / (isolated * self.threshold), 0.0
