"""Poincare sections: where orbits pierce a plane."""

import dataclasses
import functools
from typing import TYPE_CHECKING

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.dynamics.integrators.splittings import Leapfrog, Splitting
from fieldsim.dynamics.radau.radau import Radau
from fieldsim.dynamics.radau.section import radau_crossings
from fieldsim.dynamics.refusals import refuse
from fieldsim.dynamics.simulation import Simulation
from fieldsim.dynamics.splitting.groups import V, X, column, lanes_of, launch_groups, load_of, store_of
from fieldsim.dynamics.splitting.method import Method, method_of
from fieldsim.dynamics.splitting.step import advance_of
from fieldsim.dynamics.state import State
from fieldsim.errors import InputError
from fieldsim.launch import checked_threads
from fieldsim.sources.field import field_at
from fieldsim.sources.poses import spin_poses
from fieldsim.sources.stages import Stages
from fieldsim.types import ArrayLike, RealLike, VectorLike, WholeLike
from fieldsim.world.motion import Spin
from fieldsim.world.world import World, given_world

# Halvings and Newton steps towards a crossing at most.
REFINEMENTS = wp.constant(60)


@dataclasses.dataclass(frozen=True)
class Section:
    """The plane through `point` across `normal` that orbits are to pierce.

    direction: 1 counts crossings along `normal`, -1 those against it, 0 both. spin: a Spin with which the plane turns,
    as bodies do; crossings are then given in the turning frame.
    """

    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)
    direction: int = 1
    spin: Spin | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            point: VectorLike = ...,
            normal: VectorLike = ...,
            direction: WholeLike = ...,
            spin: Spin | None = ...,
        ) -> None: ...

    def __post_init__(self):
        validate.fields(self, validate.vector, "point")
        validate.fields(self, validate.direction, "normal")
        validate.fields(self, validate.whole, "direction", at_least=-1, at_most=1)
        remedy = "give the fs.Spin with which the plane turns, or None"
        validate.instance("Section", "spin", self.spin, Spin | None, remedy)

    def seen(self, times: ArrayLike, x: ArrayLike, v: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Positions and velocities (M, 3) of the world's frame at `times` (M,), as seen from the section's frame."""
        x, v = validate.points("Section.seen", "x", x), validate.points("Section.seen", "v", v)
        times = validate.numbers("Section.seen", "times", times, shape=(len(x),))
        if len(v) != len(x):
            raise InputError(f"Section.seen: x has shape {x.shape} but v {v.shape}; give one velocity per position")
        if self.spin is None:
            return x, v
        center, omega = np.array(self.spin.center), self.spin.rate * np.array(self.spin.axis)
        turns, _places = spin_poses(self.spin, times)
        relative = v - np.cross(omega, x - center)
        return np.einsum("nji,nj->ni", turns, x - center) + center, np.einsum("nji,nj->ni", turns, relative)


@dataclasses.dataclass(frozen=True)
class Crossings:
    """M crossings of a section in order of time: times (M,), particles (M,), positions and velocities (M, 3).

    particles: index in all sets together. Velocities are those seen from the section's frame.
    """

    times: np.ndarray
    particles: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray

    def __len__(self) -> int:
        return len(self.times)


def poincare(
    world: World,
    section: Section,
    duration: RealLike,
    integrator: Splitting | Radau | None = None,
    *,
    device: str | None = None,
    threads: WholeLike | None = None,
) -> Crossings:
    """Follow the particles of `world` for `duration` and collect where they pierce `section`.

    integrator: default `Leapfrog()`. Under a splitting a crossing is found on the quintic through position,
    velocity and acceleration at both ends of a step (error dt^6), under `Radau` to rounding. An orbit that pierces
    the plane twice within one step only touches it, and is not seen to. Bodies move as they do in a simulation, free
    ones too. Raises InputError where particles have a contact law, may escape or pull each other.
    """
    world = given_world("poincare", world)
    validate.instance("poincare", "section", section, Section, "give a fs.Section")
    threads = checked_threads("poincare", threads)
    refuse("poincare", "poincare", world)
    duration = validate.number("poincare", "duration", duration, above=0.0)
    options = {"device": device, "threads": threads}
    if isinstance(integrator, Radau):
        simulation = Simulation(world, integrator, **options)
        return _in_order(*radau_crossings(simulation.radau, section, 0.0, duration))
    simulation = _Sectioned(world, splitting_for("poincare", integrator), **options)
    simulation.section = section
    simulation.advance(duration)
    return simulation.crossings()


def splitting_for(who, integrator) -> Splitting:
    """`integrator` as the splitting that a study of free motion takes: `Leapfrog()` for None; InputError for others."""
    integrator = Leapfrog() if integrator is None else integrator
    remedy = "give a splitting such as fs.BlanesMoan6(dt)"
    return validate.instance(who, "integrator", integrator, Splitting, remedy)


class _Sectioned(Simulation):
    """A simulation of free motion that records crossings of its `section`."""

    section: Section

    def __init__(self, *args, **options):
        super().__init__(*args, **options)
        self._found = []

    def _fly(self, steps, start, dt, gravity):
        tables = method_of(self._splitting, dt, self.device)
        plane = self._plane(start + dt * np.append(steps, steps[-1] + 1), dt)
        shape = (self._count, len(steps))
        times = wp.full(shape, np.nan, dtype=wp.float64, device=self.device)
        x, v = (wp.empty(shape, dtype=wp.vec3d, device=self.device) for _ in range(2))
        gradients = any(self._splitting.gradients)
        kernel = section_kernel(self._gravity.kinds_used, gradients, lanes_of(self.device))
        inputs = [wp.float64(dt), tables, gravity, plane, self.section.direction]
        outputs = [self._state, times, x, v]
        launch_groups(kernel, self._count, inputs, outputs, device=self.device, threads=self.threads)
        self._keep(times.numpy(), x.numpy(), v.numpy(), start + dt * steps)

    def _plane(self, times, dt):
        """The plane at the steps' ends `times`, dt apart."""
        section, spin = self.section, self.section.spin or Spin(rate=0.0)
        turns, _places = spin_poses(spin, times)
        plane = SectionPlane()
        plane.normals = wp.array(turns @ section.normal, dtype=wp.vec3d, device=self.device)
        plane.axis, plane.center = wp.vec3d(*spin.axis), wp.vec3d(*spin.center)
        plane.angle = spin.rate * dt
        plane.height = float(np.dot(section.normal, np.subtract(section.point, spin.center)))
        return plane

    def _keep(self, fractions, x, v, starts):
        particle, step = np.nonzero(~np.isnan(fractions))
        times = starts[step] + fractions[particle, step]
        self._found.append((times, particle, x[particle, step], v[particle, step]))

    def crossings(self) -> Crossings:
        """What was found so far."""
        parts = self._found or [(np.zeros(0), np.zeros(0, dtype=int), np.zeros((0, 3)), np.zeros((0, 3)))]
        times, particles, x, v = (np.concatenate(part) for part in zip(*parts, strict=True))
        return _in_order(times, particles, *self.section.seen(times, x, v))


def _in_order(times, particles, x, v):
    """Crossings in order of time."""
    order = np.lexsort((particles, times))
    return Crossings(times[order], particles[order], x[order], v[order])


@wp.struct
class Quintic:
    """A path over one step of length dt: positions, velocities and accelerations at its ends."""

    x0: wp.vec3d
    v0: wp.vec3d
    a0: wp.vec3d
    x1: wp.vec3d
    v1: wp.vec3d
    a1: wp.vec3d
    dt: wp.float64


@wp.func
def quintic_at(q: Quintic, u: wp.float64):
    """Position and velocity at the fraction u of the step, by quintic Hermite interpolation."""
    h = q.dt
    # In powers of u: the Taylor polynomial of the start, and what the end asks for beyond it.
    x = q.x1 - (q.x0 + h * q.v0 + wp.float64(0.5) * h * h * q.a0)
    v = h * (q.v1 - q.v0 - h * q.a0)
    a = h * h * (q.a1 - q.a0)
    c3 = wp.float64(10.0) * x - wp.float64(4.0) * v + wp.float64(0.5) * a
    c4 = wp.float64(-15.0) * x + wp.float64(7.0) * v - a
    c5 = wp.float64(6.0) * x - wp.float64(3.0) * v + wp.float64(0.5) * a
    t = u * h
    u2 = u * u
    position = q.x0 + t * (q.v0 + wp.float64(0.5) * t * q.a0) + (u2 * u) * (c3 + u * (c4 + u * c5))
    bend = u2 * (wp.float64(3.0) * c3 + u * (wp.float64(4.0) * c4 + u * (wp.float64(5.0) * c5)))
    return position, q.v0 + t * q.a0 + bend / h


@wp.struct
class SectionPlane:
    """A section's plane during a launch: its normals at the steps' ends (steps + 1).

    It turns about `axis` through `center`, by `angle` in a step, and stands at `height` along its normal from there.
    """

    normals: wp.array(dtype=wp.vec3d)
    axis: wp.vec3d
    center: wp.vec3d
    angle: wp.float64
    height: wp.float64


@wp.func
def height(x: wp.vec3d, plane: SectionPlane, step: int, u: wp.float64):
    """Signed distance of x from the plane at the fraction u of a step."""
    normal = plane.normals[step]
    across = wp.cross(plane.axis, normal)
    turn = u * plane.angle
    half = wp.sin(wp.float64(0.5) * turn)
    normal = normal + wp.sin(turn) * across + wp.float64(2.0) * half * half * wp.cross(plane.axis, across)
    return wp.dot(x - plane.center, normal) - plane.height


@wp.func
def section_crossing(q: Quintic, plane: SectionPlane, step: int):
    """The fraction of the step at which the path pierces the plane: a bracket, halved until rounding stops it."""
    low = wp.float64(0.0)
    high = wp.float64(1.0)
    below = height(q.x0, plane, step, low) < wp.float64(0.0)
    for _ in range(REFINEMENTS):
        middle = wp.float64(0.5) * (low + high)
        if middle <= low or middle >= high:
            break
        x, _v = quintic_at(q, middle)
        if (height(x, plane, step, middle) < wp.float64(0.0)) == below:
            low = middle
        else:
            high = middle
    return high


@functools.cache
def section_kernel(kinds_used, gradients: bool, lanes: int):
    """Kernel over groups: a launch's steps, and where they pierced the plane: times since a step's start, x and v.

    times, positions, velocities: (N, steps); the time stays NaN where a step did not pierce it.
    """
    advance, load, store = advance_of(kinds_used, gradients, lanes), load_of(lanes), store_of(lanes)
    field = field_at(kinds_used)

    @wp.kernel(module="unique", enable_backward=False)
    def follow(
        start: int,
        dt: wp.float64,
        method: Method,
        gravity: Stages,
        plane: SectionPlane,
        direction: int,
        state: State,
        times: wp.array2d(dtype=wp.float64),
        positions: wp.array2d(dtype=wp.vec3d),
        velocities: wp.array2d(dtype=wp.vec3d),
    ):
        first = (start + wp.tid()) * lanes
        count = wp.min(lanes, state.x.shape[0] - first)
        p = load(state, first, count)
        for step in range(times.shape[1]):
            before = p
            p = advance(p, method, 0, method.stages, 1, step * method.stages, gravity)
            for k in range(count):
                x0 = column(before, X, k)
                x1 = column(p, X, k)
                above = height(x1, plane, step + 1, wp.float64(0.0)) >= wp.float64(0.0)
                if above != (height(x0, plane, step, wp.float64(0.0)) >= wp.float64(0.0)) and (
                    direction == 0 or (direction > 0) == above
                ):
                    _f, a0 = field(x0, gravity, step * method.stages)
                    _f1, a1 = field(x1, gravity, (step + 1) * method.stages)
                    q = Quintic(x0, column(before, V, k), a0, x1, column(p, V, k), a1, dt)  # pyrefly: ignore[bad-argument-count]
                    u = section_crossing(q, plane, step)
                    x, v = quintic_at(q, u)
                    times[first + k, step] = u * dt
                    positions[first + k, step] = x
                    velocities[first + k, step] = v
        store(p, state, first, count)

    return follow
