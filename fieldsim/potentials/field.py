"""Fields: skeletons convolved with kernels, evaluated on the host or on a device."""

import dataclasses
import functools
import numbers
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, overload

import numpy as np
import warp as wp

from fieldsim import launch, validate
from fieldsim.errors import InputError, OperandError
from fieldsim.potentials import registry
from fieldsim.potentials.elements import BARE, Elements, concatenate, pack
from fieldsim.potentials.field_kernels import in_lanes, kernel_and_items, results_of
from fieldsim.potentials.host_points import FARTHEST, host_points
from fieldsim.potentials.kernels import Kernel
from fieldsim.potentials.meshes.mesh import TriangleMesh
from fieldsim.potentials.one_point import OnePoint, are_finite, place_of
from fieldsim.potentials.primitives.base import Primitive
from fieldsim.potentials.row import KERNEL_WIDTH, STRENGTH
from fieldsim.types import ArrayLike, RealLike, T, Timed, Vector, WholeLike

if TYPE_CHECKING:
    from fieldsim.potentials.fast_summation.fast_field import FastField

# So many infinite values are looked at.
TELLING = 32
# Items of a launch, of 64 points or 128, that are worth a thread.
GRAIN = 4


class Field:
    """F(x) = sum of strength_i times the integral of h(|x - y|) dy over primitive i.

    primitives: one primitive or a sequence; kernel: its h(r); strength: a number, or one per primitive. Strengths and
    the primitives' fields may be functions of time; such a field is evaluated through `field.at(time)`.
    Fields add, scale and negate: `field + other`, `2.5 * field`, `-field`, `sum(fields)`, also surface fields of
    bodies. They never change once made.

    Points are given as a NumPy array (or nested sequence) of shape (N, 3) or (3,), answered in float64, or as a Warp
    array of vec3f or vec3d, answered by Warp arrays on its device in its precision. Raises InputError for misshapen
    points and, on the host, for coordinates that are not finite or beyond 1e100, and where a result would be nan.
    """

    # Elements that were packed elsewhere, summed with the terms: surfaces of bodies, what is placed in the world.
    packed: tuple[Elements, ...] = ()

    # NumPy scalars leave `scalar * field` to the field.
    __array_ufunc__ = None

    def __init__(
        self,
        primitives: Primitive | Iterable[Primitive],
        kernel: Kernel,
        strength: Timed[RealLike] | Sequence[Timed[RealLike]] | np.ndarray = 1.0,
    ):
        primitives = skeleton("Field", primitives)
        validate.instance("Field", "kernel", kernel, Kernel, "give one such as fs.Gaussian(a=2.0)")
        self.terms = tuple(
            Term(p, kernel, s) for p, s in zip(primitives, _strengths(strength, len(primitives)), strict=True)
        )

    @classmethod
    def of_terms(cls, terms: Iterable["Term"], packed: Iterable[Elements] = ()) -> "Field":
        """A field of given terms and packed elements."""
        field = cls.__new__(cls)
        field.terms = validate.instances("Field.of_terms", "terms", terms, Term, "give those of other fields")
        remedy = "give those of other fields"
        field.packed = validate.instances("Field.of_terms", "packed", packed, Elements, remedy)
        return field

    @classmethod
    def of_elements(cls, elements: Elements) -> "Field":
        """A field of packed elements."""
        validate.instance("Field.of_elements", "elements", elements, Elements, "give field.elements of another")
        return cls.of_terms((), (elements,))

    @property
    def animated(self) -> bool:
        """Whether any part is a function of time."""
        return any(term.animated for term in self.terms)

    def at(self, time: RealLike) -> "Field":
        """The field at `time`, with nothing left to animate; itself where nothing is."""
        time = validate.number("Field", "time", time)
        if not self.animated:
            return self
        terms = []
        for index, term in enumerate(self.terms):
            try:
                terms.append(term.at(time))
            except InputError as reason:
                raise InputError(f"Field: term {index} at time {time:g}: {reason}") from None
        return Field.of_terms(terms, self.packed)

    @functools.cached_property
    def elements(self) -> Elements:
        """The packed elements, grouped by formula; raises InputError for an animated field."""
        if self.animated:
            raise InputError("this field is a function of time; evaluate field.at(time)")
        own = pack([t.primitive for t in self.terms], [t.kernel for t in self.terms], [t.strength for t in self.terms])
        return concatenate([own, *self.packed]).grouped()[0] if self.packed else own

    # A single point gives a float; whether an array is one, types do not tell.
    @overload
    def value(self, points: wp.array) -> wp.array: ...
    @overload
    def value(self, points: Vector) -> float: ...
    @overload
    def value(self, points: ArrayLike) -> Any: ...
    def value(self, points: ArrayLike | wp.array) -> Any:
        """F at `points`: (N, 3) -> (N,); (3,) -> float. Cheaper than with the gradient."""
        return self._evaluate(points, 0)[0]

    @overload
    def gradient(self, points: wp.array) -> wp.array: ...
    @overload
    def gradient(self, points: ArrayLike) -> np.ndarray: ...
    def gradient(self, points: ArrayLike | wp.array) -> np.ndarray | wp.array:
        """The gradient of F: (N, 3) -> (N, 3); (3,) -> (3,)."""
        return self._evaluate(points, 1)[1]

    @overload
    def hessian(self, points: wp.array) -> wp.array: ...
    @overload
    def hessian(self, points: ArrayLike) -> np.ndarray: ...
    def hessian(self, points: ArrayLike | wp.array) -> np.ndarray | wp.array:
        """The matrix of second derivatives of F: (N, 3) -> (N, 3, 3), symmetric; (3,) -> (3, 3)."""
        return self._evaluate(points, 2)[2]

    @overload
    def value_and_gradient(self, points: wp.array) -> tuple[wp.array, wp.array]: ...
    @overload
    def value_and_gradient(self, points: Vector) -> tuple[float, np.ndarray]: ...
    @overload
    def value_and_gradient(self, points: ArrayLike) -> tuple[Any, np.ndarray]: ...
    def value_and_gradient(self, points: ArrayLike | wp.array) -> tuple[Any, Any]:
        """F and its gradient in one evaluation."""
        return self._evaluate(points, 1)

    def fast(
        self, tolerance: RealLike = 1e-9, *, proved: bool = False, threads: WholeLike | None = None
    ) -> "FastField":
        """The field as one that is faster for many elements at many points, and not exact; see docs/fields.md.

        tolerance: the largest error of the value over the largest value that the field, with strengths without signs,
        has at the points of a call; from 1e-12 to 1e-2. It is estimated, with room, from errors at 64 of the points;
        proved: let the tolerance be that of bounds that hold for any elements and points, which takes
        longer. threads: default all cores. Where exact sums take no longer they are taken. Raises InputError for an
        animated field, and as the field does.
        """
        from fieldsim.potentials.fast_summation.fast_field import FastField

        if self.animated:
            raise InputError("this field is a function of time; give field.at(time).fast()")
        return FastField(self, tolerance, proved=proved, threads=threads)

    def mesh(
        self, level: RealLike, *, resolution: WholeLike | None = None, tolerance: RealLike | None = None
    ) -> TriangleMesh:
        """The surface F = level as a closed `TriangleMesh`, its vertices on the true surface.

        resolution: grid cells along its longest side, default 64; or tolerance: greatest distance of the mesh from
        the surface. For fields of positive strengths. Raises InputError where there is no closed surface.
        """
        from fieldsim.potentials.meshes.isosurface import level_mesh

        if self.animated:
            raise InputError("this field is a function of time; mesh field.at(time)")
        return level_mesh(self, level, resolution=resolution, tolerance=tolerance)

    def _evaluate(self, points, order):
        """Value and derivatives up to `order`, as a tuple, where and as `points` are."""
        if isinstance(points, wp.array):
            return self._evaluate_on_device(points, order)
        place = place_of(points, FARTHEST)
        if place is not None:
            results = self._one_point(order)(place)
            if are_finite(results):
                return (float(results[0][0]), *(r[0] for r in results[1:]))
            return self._answer(results, np.array([place]), True)
        array, single = host_points(points)
        return self._answer(self._sums_on_host(array, order), array, single)

    def _sums_on_host(self, points, order):
        """Value and derivatives up to `order` at checked points (N, 3), whatever they are."""
        results = self._evaluate_on_device(wp.array(points, dtype=wp.vec3d, device="cpu", copy=False), order)
        return [result.numpy() for result in results]

    def _answer(self, results, array, single):
        """Results at points (N, 3) as a user gets them; raises InputError for what is no number."""
        for name, result in zip(("value", "gradient", "Hessian"), results, strict=False):
            if not np.isfinite(result).all():
                self._refuse_nonsense(name, array, result)
        return (float(results[0][0]), *(r[0] for r in results[1:])) if single else tuple(results)

    def _refuse_nonsense(self, name, points, result):
        """Raise InputError for what is no number, unless it is the infinite value on bare sources of one sign."""
        found = result.reshape(len(points), -1)
        bad = np.flatnonzero((np.isnan(found) if name == "value" else ~np.isfinite(found)).any(axis=1))
        if not bad.size:
            # A few tell: of many sources and points all would take long.
            infinite = np.flatnonzero(np.isinf(found[:, 0]))[:TELLING]
            bad = [index for index in infinite if not self._on_bare_source(points[index])]
        for index in bad[:1]:
            raise InputError(
                f"Field: its {name} at {tuple(points[index].tolist())} is {np.ravel(result[index]).tolist()}: it "
                "overflows there, or infinite parts of both signs meet; soften the kernel, move the point, or use "
                "another unit"
            )

    def _on_bare_source(self, point):
        """Whether an element that is infinite on itself passes through a point, to rounding."""
        rows = self.elements.rows
        near = 1e-9 * max(np.abs(point).max(), 1e-300)
        for formula, which in registry.parts_of(self.elements.kinds):
            bare = np.arange(len(rows))[which]
            for i in bare[rows[bare, KERNEL_WIDTH] < BARE]:
                distance = formula.primitive.distance
                if distance is not None and distance(*point.tolist(), rows, i) <= near:
                    return True
        return False

    def _evaluate_on_device(self, points, order):
        if points.dtype not in (wp.vec3f, wp.vec3d) or points.ndim != 1:
            raise InputError(
                f"Field: points are a Warp array of {points.dtype.__name__} with shape {points.shape}; "
                "give one of vec3f or vec3d with shape (N,)"
            )
        scalar, device = points.dtype._wp_scalar_type_, points.device
        results = tuple(results_of(order, len(points), scalar, device))
        kernel, items = kernel_and_items(order, self.elements.kinds_used, scalar, len(points), device)
        given = points, *self._tables(scalar, device), 0, len(self.elements)
        launch.launch(kernel, items, given, results, device=device, grain=GRAIN)
        return results

    def _one_point(self, order):
        """What evaluates value and derivatives at a single point."""
        key = order, "one point"
        if key not in self._uploaded:
            tables = *self._tables(wp.float64, wp.get_device("cpu")), 0, len(self.elements)
            kernel = in_lanes(order, self.elements.kinds_used, wp.float64)
            self._uploaded[key] = OnePoint(kernel, tables, order)
        return self._uploaded[key]

    def _tables(self, scalar, device):
        """Rows and kinds on a device, uploaded once."""
        key = scalar, device.alias
        if key not in self._uploaded:
            rows = wp.array(self.elements.rows, dtype=scalar, device=device)
            self._uploaded[key] = rows, wp.array(self.elements.kinds, dtype=wp.int32, device=device)
        return self._uploaded[key]

    @functools.cached_property
    def _uploaded(self):
        return {}

    def __add__(self, other: "Field") -> "Field":
        other = _operand("the other summand", other, Field, "another fs.Field")
        return Field.of_terms(self.terms + other.terms, self.packed + other.packed)

    def __radd__(self, other: "int | Field") -> "Field":
        # sum() starts at 0.
        zero = isinstance(other, int) and other == 0
        return self if zero else self + _operand("the other summand", other, Field, "another fs.Field")

    def __mul__(self, factor: RealLike) -> "Field":
        _operand("factor", factor, numbers.Real, "a number")
        factor = validate.number("Field", "factor", factor)
        with np.errstate(over="ignore"):
            scaled = Field.of_terms(
                (term.scaled(factor) for term in self.terms), (e.scaled(factor) for e in self.packed)
            )
        strengths = [term.strength for term in scaled.terms if not callable(term.strength)]
        strengths += [strength for e in scaled.packed for strength in e.rows[:, STRENGTH].tolist()]
        if not np.isfinite(strengths).all():
            raise InputError(f"Field: factor is {factor:g}, by which a strength overflows; give a smaller one")
        return scaled

    __rmul__ = __mul__

    def __neg__(self) -> "Field":
        return -1.0 * self

    def __sub__(self, other: "Field") -> "Field":
        return self + -_operand("the other", other, Field, "another fs.Field")

    def __rsub__(self, other: "int | Field") -> "Field":
        return -self + _operand("the other summand", other, Field, "another fs.Field")

    def __repr__(self):
        return f"<Field of {len(self.terms) + sum(map(len, self.packed))} elements>"

    def __getstate__(self):
        # What was uploaded and packed is made again; a Warp array can be neither pickled nor copied.
        return {"terms": self.terms, "packed": self.packed}


def _operand(name, operand: object, kind: type[T], wanted) -> T:
    """`operand`, of that kind."""
    if not isinstance(operand, kind):
        raise OperandError(f"Field: {name} is {validate.shown(operand)}; give {wanted}")
    return operand


@dataclasses.dataclass(frozen=True)
class Term:
    """One element of a field: a primitive, its kernel and its strength (a number or a function of time)."""

    primitive: Primitive
    kernel: Kernel
    strength: Timed[float] = 1.0

    @property
    def animated(self) -> bool:
        """Whether the primitive or the strength is a function of time."""
        return self.primitive.animated or callable(self.strength)

    def at(self, time: float) -> "Term":
        """The concrete term at `time`."""
        return Term(self.primitive.at(time), self.kernel, self.strength_at(time))

    def strength_at(self, time: float) -> float:
        """The strength at `time`."""
        return number_at("Field", "strength", self.strength, time)

    def scaled(self, factor: float) -> "Term":
        """The term with its strength multiplied."""
        if callable(self.strength):
            return dataclasses.replace(self, strength=functools.partial(_multiplied, factor, self.strength))
        return dataclasses.replace(self, strength=factor * self.strength)


def _multiplied(factor, strength, time):
    """A strength that is a function of time, multiplied."""
    return factor * number_at("Field", "strength", strength, time)


def skeleton(owner: str, primitives: Primitive | Iterable[Primitive]) -> tuple[Primitive, ...]:
    """One primitive or a sequence of them, as a tuple; raises InputError for anything else."""
    if isinstance(primitives, Primitive):
        return (primitives,)
    if isinstance(primitives, TriangleMesh):
        remedy = "give mesh.triangles(), its hollow shell, or fs.solid_faces(mesh), what it encloses"
        raise InputError(f"{owner}: the skeleton is {primitives!r}; {remedy}")
    remedy = "give primitives such as fs.Segment((0, 0, 0), (1, 0, 0))"
    result = validate.instances(owner, "skeleton", primitives, Primitive, remedy)
    if not result:
        raise InputError(f"{owner}: the skeleton is empty; give at least one primitive")
    return result


def number_at(owner, name, value, time):
    """A number, or what a function of time gives for one."""
    return validate.at_time(owner, lambda **given: validate.number(owner, name, given[name]), {name: value}, time)


def _strengths(strength, count):
    """One checked strength (a number, or a function of time) per primitive."""
    if callable(strength):
        return [strength] * count
    if not isinstance(strength, list | tuple) and not (isinstance(strength, np.ndarray) and strength.ndim):
        return [validate.number("Field", "strength", strength)] * count
    if len(strength) != count:
        raise InputError(
            f"Field: {len(strength)} strengths for {count} primitives; give one number or one per primitive"
        )
    return [s if callable(s) else validate.number("Field", f"strength[{i}]", s) for i, s in enumerate(strength)]
