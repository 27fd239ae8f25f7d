"""Steps of particles that pull each other: all take one step together, as in IAS15.

A step is a sequence of parts, each for one particle or for the step as a whole, with the sums over particles in
between: open, foresee each, then sweeps of (place each, pull each, weigh up), judge each, close, finish each. A few
particles are taken through many steps by one thread; of many each part is a launch.
"""

import functools

import warp as wp

from fieldsim.dynamics.radau.kernels import LOST, ROUNDING, SHORTEST, Flights, Leg, first_step, fitted
from fieldsim.dynamics.radau.nodes import PLACES, Pulling, Series, mixed_of, path_of, place_of, pulls_of
from fieldsim.dynamics.radau.step import (
    AHEAD,
    ENDS,
    EXTRAPOLATION,
    IN_POWERS,
    PULL,
    SWEEPS,
    UNSETTLED,
    WAYS,
    WAYS_OF_POWERS,
    arrived,
    differences,
    expected_of,
    is_last,
    lengthening,
    moved,
    replanned,
    scaled,
)
from fieldsim.dynamics.splitting.groups import column
from fieldsim.dynamics.splitting.mutual_gravity import pull_of_sources
from fieldsim.numerics.running_sums import exactly_added
from fieldsim.portable.lanes.functions import TABLES, group_function
from fieldsim.sources.windows import Window, part_from


@wp.struct
class Course:
    """The step that all are taking: when it begins, t, with its rest, and its length h; a length of 0 only looks.

    end: of the sources' interpolants; no step passes it.

    last: length of the last step; plan: of the next one. known: whether the last step foretells it. sweep: the present
    one; settled: whether it was the last; good: whether they converged; counts: whether the step does. steps,
    evaluations: how many so far.
    """

    t: wp.float64
    t_rest: wp.float64
    end: wp.float64
    h: wp.float64
    last: wp.float64
    plan: wp.float64
    known: bool
    sweep: int
    settled: int
    good: int
    counts: bool
    ended: int
    steps: wp.int64
    evaluations: wp.int64


@wp.struct
class Task:
    """What a particle does in the step: its start; its path and acceleration at the nodes; how it converges.

    expected: powers of the acceleration; ways, p: see `settled_of`; points: positions at the nodes. error: of the last
    sweep; settled, good: as in `Course`. longer: how much longer a step might be, in the time of this one.
    """

    x: wp.vec3d
    x_rest: wp.vec3d
    v: wp.vec3d
    v_rest: wp.vec3d
    expected: Series
    ways: Series
    points: Series
    p: Series
    error: wp.float64
    settled: int
    good: int
    longer: wp.float64


@wp.struct
class Crowd:
    """N particles that pull each other. course (1,); tasks (N,).

    rows (PLACES, M, columns of SOURCE): the particles that pull, at the nodes; index (N,): which row is each one's, -1
    of those that do not pull.
    """

    course: wp.array(dtype=Course)
    tasks: wp.array(dtype=Task)
    rows: wp.array3d(dtype=wp.float64)
    index: wp.array(dtype=wp.int32)


@functools.cache
def sweep_of(kinds_used, kernel, lanes: int):
    """Warp functions of the parts of a sweep: place (i, crowd), pull (i, pulling, crowd), weigh (crowd)."""
    mixed, path, pulls = mixed_of(lanes), path_of(lanes), pulls_of(kinds_used, lanes)
    inputs = ("rows 3", TABLES, "int")
    pulled = group_function(pull_of_sources.bind(law=kernel.law), wp.float64, inputs, (0, 1, 2), PLACES, lanes)

    @wp.func
    def place(i: int, crowd: Crowd):
        task = crowd.tasks[i]
        points = path(task.ways, task.x, task.x_rest, task.v, crowd.course[0].h)
        crowd.tasks[i].points = points
        row = crowd.index[i]
        if row >= 0:
            for c in range(3):
                for n in range(PLACES):
                    crowd.rows[n, row, c] = points[c, n]

    @wp.func
    def pull(i: int, pulling: Pulling, crowd: Crowd):
        points = crowd.tasks[i].points
        ways = crowd.tasks[i].ways
        p = differences(pulls(points, pulling, 0) + pulled(points, crowd.rows, crowd.rows.shape[1]))
        new = mixed(WAYS, p)
        size, error = moved(p, ways, new)
        crowd.tasks[i].p = p
        crowd.tasks[i].ways = new
        crowd.tasks[i].good = wp.where(error <= UNSETTLED * size, 1, 0)
        if is_last(crowd.course[0].sweep, size, error, crowd.tasks[i].error):
            crowd.tasks[i].settled = 1
        crowd.tasks[i].error = error

    @wp.func
    def weigh(crowd: Crowd):
        course = crowd.course[0]
        course.settled = 1
        course.good = 1
        for i in range(crowd.tasks.shape[0]):
            course.settled = wp.min(course.settled, crowd.tasks[i].settled)
            course.good = wp.min(course.good, crowd.tasks[i].good)
        course.sweep += 1
        if course.settled == 0 and course.sweep == SWEEPS:
            course.settled = 1
            course.good = 0
        if course.h == wp.float64(0.0):
            course.settled = 1
        crowd.course[0] = course

    return place, pull, weigh


@wp.func
def begin(h: wp.float64, crowd: Crowd):
    """Begin the sweeps of a step of length h."""
    course = crowd.course[0]
    course.h = h
    course.sweep = 0
    course.settled = 0
    course.known = course.last > wp.float64(0.0) and h < EXTRAPOLATION * course.last
    crowd.course[0] = course
    for i in range(crowd.tasks.shape[0]):
        crowd.tasks[i].settled = 0
        crowd.tasks[i].error = wp.float64(wp.inf)


@functools.cache
def start_of(kinds_used, lanes: int):
    """Warp functions of what comes before sweeps: open and foresee.

    open (leg, pulling, window, flights, crowd); foresee (i, flights, crowd).
    """
    mixed, place = mixed_of(lanes), place_of(kinds_used, lanes)

    @wp.func
    def open(leg: Leg, pulling: Pulling, window: Window, flights: Flights, crowd: Crowd):
        course = crowd.course[0]
        h = course.plan
        for i in range(crowd.tasks.shape[0]):
            if h * wp.length(flights.v[i]) > leg.stride:
                h = leg.stride / wp.length(flights.v[i])
        crowd.course[0].plan = h
        course.end = window.bounds[part_from(window, course.t) + 1]
        crowd.course[0].end = course.end
        h = fitted(h, (course.end - course.t) - course.t_rest)
        place(pulling, 0, window, course.t, course.t_rest, h)
        begin(h, crowd)

    @wp.func
    def foresee(i: int, flights: Flights, crowd: Crowd):
        course = crowd.course[0]
        last = flights.last[i]
        shifted = mixed(AHEAD, last.b)
        expected = expected_of(shifted, flights.miss[i], flights.a[i], course.known, course.h / course.last)
        crowd.tasks[i].x = flights.x[i]
        crowd.tasks[i].x_rest = flights.x_rest[i]
        crowd.tasks[i].v = flights.v[i]
        crowd.tasks[i].v_rest = flights.v_rest[i]
        crowd.tasks[i].expected = expected
        crowd.tasks[i].ways = mixed(WAYS_OF_POWERS, expected)

    return open, foresee


@wp.func
def close(leg: Leg, crowd: Crowd):
    """Decide on the step, and on the next."""
    course = crowd.course[0]
    least = crowd.tasks[0].longer
    for i in range(crowd.tasks.shape[0]):
        if not (crowd.tasks[i].longer >= least):  # a NaN, too
            least = crowd.tasks[i].longer
    course.evaluations += wp.int64(PLACES * course.sweep * crowd.tasks.shape[0])
    if course.h == wp.float64(0.0):
        course.counts = False
        course.plan = least
    else:
        counts, plan = replanned(course.plan, course.h, leg.eta * least, course.good)
        course.counts = counts
        course.plan = plan
    if course.counts:
        left = (course.end - course.t) - course.t_rest
        t, t_rest = exactly_added(course.t, course.t_rest, course.h)
        if course.h == left:
            t = course.end
            t_rest = wp.float64(0.0)
        course.t = t
        course.t_rest = t_rest
        course.last = course.h
        course.steps += wp.int64(crowd.tasks.shape[0])
    if not (course.plan > SHORTEST * wp.abs(course.t - leg.begin)):
        course.ended = LOST
    crowd.course[0] = course


@functools.cache
def end_of(lanes: int):
    """Warp functions of what comes after sweeps: judge (i, leg, flights, crowd), finish (i, flights, crowd)."""
    mixed = mixed_of(lanes)

    @wp.func
    def judge(i: int, leg: Leg, flights: Flights, crowd: Crowd):
        h = crowd.course[0].h
        x = flights.x[i]
        a = column(crowd.tasks[i].p, 0, 0)
        longer = first_step(x, flights.v[i], a, leg.extent)
        if h > wp.float64(0.0):
            p = crowd.tasks[i].p
            noise = ROUNDING * (leg.extent + wp.length(x)) / (h * h)
            longer = lengthening(a, mixed(ENDS, p), column(mixed(IN_POWERS, p), 0, PLACES - 1), noise)
        crowd.tasks[i].longer = longer

    @wp.func
    def finish(i: int, flights: Flights, crowd: Crowd):
        course = crowd.course[0]
        task = crowd.tasks[i]
        a = column(task.p, 0, 0)
        if course.counts:
            ends = mixed(ENDS, task.p)
            last = flights.last[i]
            last.x = task.x
            last.x_rest = task.x_rest
            last.v = task.v
            last.v_rest = task.v_rest
            last.t = flights.t[i]
            last.t_rest = flights.t_rest[i]
            last.h = course.h
            last.b = mixed(IN_POWERS, task.p)
            flights.last[i] = last
            miss = Series()
            if course.known:
                miss = last.b - task.expected
            flights.miss[i] = miss
            x, x_rest, v, v_rest = arrived(task.x, task.x_rest, task.v, task.v_rest, a, ends, course.h)
            flights.x[i] = x
            flights.x_rest[i] = x_rest
            flights.v[i] = v
            flights.v_rest[i] = v_rest
            flights.t[i] = course.t
            flights.t_rest[i] = course.t_rest
            a = column(ends, 0, PULL)
            if course.h * task.longer < flights.tau[i]:
                flights.tau[i] = course.h * task.longer
                flights.tau_at[i] = course.t
        flights.a[i] = a
        flights.ended[i] = course.ended

    return judge, finish


@functools.cache
def look_of(kinds_used, lanes: int):
    """Warp functions: dense output.

    look (time, pulling, window, flights, crowd): begin a step from the last one's start to a time; remember (i,
    flights, crowd): what is known of it; show (i, crowd; positions, velocities): where it leads.
    """
    mixed, place = mixed_of(lanes), place_of(kinds_used, lanes)

    @wp.func
    def look(time: wp.float64, pulling: Pulling, window: Window, flights: Flights, crowd: Crowd):
        last = flights.last[0]
        h = (time - last.t) - last.t_rest
        place(pulling, 0, window, last.t, last.t_rest, h)
        begin(h, crowd)

    @wp.func
    def remember(i: int, flights: Flights, crowd: Crowd):
        last = flights.last[i]
        crowd.tasks[i].x = last.x
        crowd.tasks[i].x_rest = last.x_rest
        crowd.tasks[i].v = last.v
        crowd.tasks[i].v_rest = last.v_rest
        crowd.tasks[i].ways = mixed(WAYS_OF_POWERS, scaled(last.b, crowd.course[0].h / last.h))

    @wp.func
    def show(i: int, crowd: Crowd, positions: wp.array(dtype=wp.vec3d), velocities: wp.array(dtype=wp.vec3d)):
        task = crowd.tasks[i]
        a = column(task.p, 0, 0)
        ends = mixed(ENDS, task.p)
        x, _x, v, _v = arrived(task.x, task.x_rest, task.v, task.v_rest, a, ends, crowd.course[0].h)
        positions[i] = x
        velocities[i] = v

    return look, remember, show
