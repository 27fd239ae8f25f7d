"""Fields: skeletons convolved with kernels, evaluated on the host or on a device."""

import dataclasses
import functools
import numbers

import numpy as np
import warp as wp

from fieldsim import launch, validate
from fieldsim.errors import InputError
from fieldsim.potentials import cells
from fieldsim.potentials.kernels import Kernel, Newtonian
from fieldsim.potentials.primitive import Primitive


class Field:
    """F(x) = sum of strength_i times the integral of h(|x - y|) dy over primitive i.

    primitives: one primitive or a sequence; kernel: its h(r); strength: a number, or one per primitive. Strengths and
    the primitives' fields may be functions of time; such a field is evaluated through `field.at(time)`.
    Fields add, scale and negate: `field + other`, `2.5 * field`, `-field`.
    """

    def __init__(self, primitives, kernel: Kernel, strength=1.0):
        primitives = skeleton(primitives)
        if not isinstance(kernel, Kernel):
            raise InputError(f"Field: kernel is {kernel!r}; give one such as Gaussian(a=2.0)")
        self.terms = tuple(
            Term(p, kernel, s) for p, s in zip(primitives, _strengths(strength, len(primitives)), strict=True)
        )

    @classmethod
    def of_terms(cls, terms) -> "Field":
        """A field of given terms."""
        field = cls.__new__(cls)
        field.terms = tuple(terms)
        return field

    @property
    def animated(self) -> bool:
        """Whether any part is a function of time."""
        return any(term.animated for term in self.terms)

    def at(self, time: float) -> "Field":
        """The field at `time`, with nothing left to animate."""
        return Field.of_terms(term.at(time) for term in self.terms) if self.animated else self

    @functools.cached_property
    def elements(self) -> cells.Elements:
        """The packed elements; raises InputError for an animated field."""
        if self.animated:
            raise InputError("this field is a function of time; evaluate field.at(time)")
        return cells.pack(
            [t.primitive for t in self.terms], [t.kernel for t in self.terms], [t.strength for t in self.terms]
        )

    def value(self, points):
        """F at `points`: (N, 3) -> (N,), (3,) -> float; a Warp array of vec3 gives a Warp array on its device."""
        return self.value_and_gradient(points)[0]

    def gradient(self, points):
        """The gradient of F: (N, 3) -> (N, 3), (3,) -> (3,)."""
        return self.value_and_gradient(points)[1]

    def value_and_gradient(self, points):
        """F and its gradient in one evaluation."""
        if isinstance(points, wp.array):
            return self._evaluate(points)
        array = np.asarray(points, dtype=float)
        single = array.shape == (3,)
        checked = validate.points("Field", "points", array[None] if single else array)
        value, gradient = self._evaluate(wp.array(checked, dtype=wp.vec3d, device="cpu"))
        value, gradient = value.numpy(), gradient.numpy()
        return (float(value[0]), gradient[0]) if single else (value, gradient)

    def _evaluate(self, points):
        if points.dtype not in (wp.vec3f, wp.vec3d):
            raise InputError(f"Field: points have dtype {points.dtype.__name__}; give a Warp array of vec3f or vec3d")
        scalar = points.dtype._wp_scalar_type_
        device = points.device
        rows = wp.array(self.elements.rows, dtype=scalar, device=device)
        kinds = wp.array(self.elements.kinds, dtype=wp.int32, device=device)
        value = wp.empty(len(points), dtype=scalar, device=device)
        gradient = wp.empty(len(points), dtype=points.dtype, device=device)
        launch.launch(
            _kernel(self.elements.kinds_used, scalar),
            len(points),
            [points, rows, kinds],
            [value, gradient],
            device=device,
        )
        return value, gradient

    def __add__(self, other):
        if not isinstance(other, Field):
            return NotImplemented
        return Field.of_terms(self.terms + other.terms)

    def __mul__(self, factor):
        if not isinstance(factor, numbers.Real):
            return NotImplemented
        return Field.of_terms(term.scaled(float(factor)) for term in self.terms)

    __rmul__ = __mul__

    def __neg__(self):
        return -1.0 * self

    def __sub__(self, other):
        return self + -other

    def __repr__(self):
        return f"<Field of {len(self.terms)} elements>"


@dataclasses.dataclass(frozen=True)
class Term:
    """One element of a field: a primitive, its kernel and its strength (a number or a function of time)."""

    primitive: Primitive
    kernel: Kernel
    strength: object = 1.0

    @property
    def animated(self) -> bool:
        """Whether the primitive or the strength is a function of time."""
        return self.primitive.animated or callable(self.strength)

    def at(self, time: float) -> "Term":
        """The concrete term at `time`."""
        return Term(self.primitive.at(time), self.kernel, _value(self.strength, time))

    def scaled(self, factor: float) -> "Term":
        """The term with its strength multiplied."""
        strength = self.strength
        scaled = (lambda time: factor * strength(time)) if callable(strength) else factor * strength
        return dataclasses.replace(self, strength=scaled)


def gravity(primitives, mass, *, G=1.0, kernel: Kernel | None = None) -> Field:
    """The field whose gradient is the acceleration towards a skeleton of the given mass.

    The mass is spread evenly over the skeleton's total measure (arc length, area; points count 1 each):
    strength = G mass / measure. The kernel is Newtonian unless told. Raises InputError for a non-finite mass.
    """
    primitives = skeleton(primitives)
    kernel = Newtonian() if kernel is None else kernel
    if callable(mass) or any(p.animated for p in primitives):

        def strength(time):
            return G * _value(mass, time) / total_measure(p.at(time) for p in primitives)

        return Field(primitives, kernel, strength)
    return Field(primitives, kernel, G * validate.number("gravity", "mass", mass) / total_measure(primitives))


def total_measure(primitives) -> float:
    """Total measure of a concrete skeleton of one dimension; raises InputError for one that mixes dimensions."""
    primitives = list(primitives)
    if len({p.dimension for p in primitives}) > 1:
        raise InputError(
            "a skeleton that mixes points, curves and surfaces has no common measure to spread mass over; "
            "add one Field or Body for each"
        )
    return float(sum(p.measure for p in primitives))


def skeleton(primitives) -> tuple[Primitive, ...]:
    """One primitive or a sequence of them, as a tuple; raises InputError for anything else."""
    result = (primitives,) if isinstance(primitives, Primitive) else tuple(primitives)
    for index, primitive in enumerate(result):
        if not isinstance(primitive, Primitive):
            raise InputError(
                f"skeleton[{index}] is {primitive!r}; give primitives such as Segment((0, 0, 0), (1, 0, 0))"
            )
    if not result:
        raise InputError("the skeleton is empty; give at least one primitive")
    return result


def _value(maybe_function, time):
    return maybe_function(time) if callable(maybe_function) else maybe_function


def _strengths(strength, count):
    if callable(strength):
        return [strength] * count
    if np.ndim(strength) == 0:
        return [validate.number("Field", "strength", strength)] * count
    if len(strength) != count:
        raise InputError(
            f"Field: {len(strength)} strengths for {count} primitives; give one number or one per primitive"
        )
    return [s if callable(s) else validate.number("Field", f"strength[{i}]", s) for i, s in enumerate(strength)]


@functools.cache
def _kernel(kinds_used, scalar):
    """The Warp kernel that evaluates fields of the given cells at points."""
    vector = wp.types.vector(3, scalar)
    total = cells.field_sum(kinds_used).warp(scalar)

    @wp.kernel(module="unique", enable_backward=False)
    def evaluate(
        start: int,
        points: wp.array(dtype=vector),
        rows: wp.array(dtype=scalar, ndim=2),
        kinds: wp.array(dtype=wp.int32),
        value: wp.array(dtype=scalar),
        gradient: wp.array(dtype=vector),
    ):
        i = start + wp.tid()
        p = points[i]
        f, gx, gy, gz = total(p[0], p[1], p[2], rows, kinds, 0, kinds.shape[0])
        value[i] = f
        gradient[i] = vector(gx, gy, gz)

    return evaluate
