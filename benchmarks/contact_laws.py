"""What contact keeps and what is known in closed form: energy of elastic bounces, friction, rolling, grooves, rest.

- energy: balls of 0.01 to 10 features fall onto the bodies of tests/contact_scenes.py under a soft central pull, which
  holds them, and bounce without loss; the largest change of a ball's energy, relative to what it began with.
- closed forms: a slide down a plane, the angle at which it begins, the 2/7 that rolling takes, a ball between two rails
  and on three fixed balls. The pull is uniform to 1e-9.
"""

import math
import pathlib
import sys

import numpy as np

import fieldsim as fs
from benchmarks.progress import progress

sys.path.append(str(pathlib.Path(__file__).parent.parent / "tests"))

BOUNCES, QUICK_BOUNCES = 100_000, 5_000
DT = 1e-3
# Families whose bodies balls bounce on, how many balls, and how far from the surface they begin, in features.
WELLS = (
    "Gaussian points and polylines",
    "Gaussian circles and arcs",
    "Gaussian triangles",
    "Cauchy triangles and segments",
    "Metaball points and segments",
    "Quartic circles and segments",
)
BALLS, HEIGHTS = 100, (0.3, 3.0)
PULL, SOFTNESS = 1.0, 0.5
# Of a ball that buzzes in a corner only so many times its share of the bounces count; simulated time at most.
SHARES, PATIENCE = 3, 1000.0
# Simulated time between two looks at the energy.
LOOK = 0.5
# The pull of the closed forms is 1 and comes from so far away that it is uniform to 1e-9.
FAR = 1e9
GROUND, BALL = 0.25, 0.02
FRICTION = 0.5


def energy_rows(full: bool = False):
    """The drift of energy in each well, after its share of the bounces."""
    wanted = (BOUNCES if full else QUICK_BOUNCES) // len(WELLS)
    for name in WELLS:
        try:
            simulation = fs.Simulation(well(name), fs.Leapfrog(DT))
        except fs.InputError:
            yield {"name": f"energy, {name}: refused", "value": 1, "unit": "wells"}
            continue
        begin = fs.energy(simulation.snapshot()).total
        worst = np.zeros(len(begin))
        for _ in progress(_bounced(simulation, wanted), f"bounces on {name}", wanted):
            now = fs.energy(simulation.snapshot()).total
            worst = np.maximum(worst, np.abs(now / begin - 1.0))
        free = _free_drift(simulation, begin)
        label = f"energy, {name}, dt = {DT:g}"
        yield {"name": f"{label}: bounces", "value": simulation.bounces, "unit": "bounces"}
        for share, value in (("median", 0.5), ("90 %", 0.9), ("worst", 1.0)):
            found = {"value": float(np.quantile(worst, value)), "unit": "of the energy"}
            peer = {"peer": "free motion", "peer_value": float(np.quantile(free, value))}
            yield {"name": f"{label}: drift, {share}", **found, **peer}


def _free_drift(bouncing, begin):
    """The greatest drift of each ball that passes through everything, over a tenth of the time."""
    free = [
        fs.Particles(balls.positions, balls.velocities, radius=balls.radius, contact=None)
        for balls in bouncing.world.particles
    ]
    simulation = fs.Simulation(bouncing.world.replace(particles=free), fs.Leapfrog(DT))
    worst = np.zeros(len(begin))
    for time in np.arange(LOOK, 0.1 * bouncing.time + LOOK, LOOK):
        simulation.advance(time)
        worst = np.maximum(worst, np.abs(fs.energy(simulation.snapshot()).total / begin - 1.0))
    return worst


def _bounced(simulation, wanted):
    """Advance a simulation until its balls have bounced as often, and yield once for each bounce."""
    done, most = 0, SHARES * wanted // len(simulation.bounce_counts) + 1
    while done < wanted and simulation.time < PATIENCE:
        simulation.advance(simulation.time + LOOK)
        now = int(np.minimum(np.concatenate(simulation.bounce_counts), most).sum())
        yield from range(done, max(now, done + 1))
        done = now


def well(name, seed=1):
    """A world of a family's bodies about a central pull, and balls at rest over their surface."""
    from contact_scenes import LARGEST, SMALLEST, STILL, make_scene
    from contact_surface import Surface

    family = next(family for family in STILL if family.name == name)
    world, bodies = fs.World(), make_scene(family, seed).bodies
    world.add_body(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(SOFTNESS), mass=PULL))
    for body in bodies:
        world.add_body(body)
    surface, rng = Surface(bodies), np.random.default_rng(seed)
    points, _ = surface.samples(0.0)
    for point in points[rng.choice(len(points), BALLS, replace=False)]:
        feature = surface.feature
        radius = feature * SMALLEST * (LARGEST / SMALLEST) ** rng.random()
        _, normal, _ = surface.logarithm(point[None], 0.0)
        # Beyond all of the surface, not only this part of it.
        for height in radius + feature * rng.uniform(*HEIGHTS) + np.linspace(0.0, 8.0, 81):
            center = point - height * normal[0]
            clear = np.linalg.norm(points - center, axis=1).min() - radius
            if clear > HEIGHTS[0] * feature and surface.value_and_gradient(center[None], 0.0)[0] < 1.0:
                break
        world.add_particles([center], [(0, 0, 0)], radius=radius, contact=fs.Bounce(1.0))
    return world


def closed_forms():
    """Relative errors, but for angles, which are in radians."""
    yield _row("critical angle of friction on a plane", abs(_critical(_plane) - math.atan(FRICTION)), "radians")
    rail = math.atan(FRICTION / math.cos(HALF_ANGLE))
    yield _row("critical angle of friction along two rails", abs(_critical(_rails) - rail), "radians")
    yield _row("slide down a plane: speed", _slide(_plane, FRICTION), "relative error")
    yield _row("slide down two rails: speed", _slide(_rails, FRICTION / math.cos(HALF_ANGLE)), "relative error")
    law = fs.Bounce(0.0, friction=0.3, rolling=True)
    speed = np.linalg.norm(_end(_plane(0.0), (1.0, 0, 0), law, 3.0).velocities[0])
    yield _row("sliding to rolling keeps 5/7 of the speed", abs(speed * 7.0 / 5.0 - 1.0), "relative error")
    # Between rails it rolls on a circle of radius r cos.
    speed = np.linalg.norm(_end(_rails(0.0), (1.0, 0, 0), law, 4.0).velocities[0])
    kept = math.cos(HALF_ANGLE) ** 2 / (0.4 + math.cos(HALF_ANGLE) ** 2)
    yield _row("sliding to rolling between two rails", abs(speed / kept - 1.0), "relative error")
    for count, title in ((2, "two rails"), (3, "three balls")):
        height, moved, asleep = _settled(count)
        yield _row(f"a ball dropped between {title} and at rest: height", height, "ball radii")
        yield _row(f"a ball dropped between {title} and at rest: moved in 100 time units", moved, "ball radii")
        yield _row(f"a ball dropped between {title}: at rest", asleep, "balls of 1")


def _row(name, value, unit):
    return {"name": f"closed form, {name}", "value": float(value), "unit": unit}


def _tilted(angle):
    """A world with a uniform pull of 1, tilted by an angle from -z towards +x."""
    world = fs.World()
    toward = FAR * np.array([math.sin(angle), 0.0, -math.cos(angle)])
    world.add_body(fs.Body(fs.Point(toward), gravity=fs.Newtonian(), mass=FAR**2))
    return world


def _plane(angle):
    """A ball on a plane: (world, its centre)."""
    world = _tilted(angle)
    world.add_body(fs.Body(fs.Plane((0, 0, 0), (0, 0, 1)), surface=fs.Material(radius=GROUND)))
    return world, (0.0, 0.0, GROUND + BALL)


# Two rails along x, half their distance in y, the ball between them, and the angle of its contacts to the vertical.
RAIL, APART, GROOVED = 0.1, 0.3, 0.3
HALF_ANGLE = math.asin(APART / (RAIL + GROOVED))


def _rails(angle):
    """A ball in the groove between two rails: (world, its centre)."""
    world = _tilted(angle)
    rails = [fs.Segment((-40, y, 0), (40, y, 0)) for y in (-APART, APART)]
    world.add_body(fs.Body(rails, surface=fs.Material(radius=RAIL, blobbiness=-4.0)))
    return world, (0.0, 0.0, (RAIL + GROOVED) * math.cos(HALF_ANGLE))


def _end(placed, velocity, law, until, radius=None, dt=DT):
    """The simulation of one ball at that time."""
    world, center = placed
    radius = radius or (BALL if center[2] == GROUND + BALL else GROOVED)
    world.add_particles([center], [velocity], radius=radius, contact=law)
    simulation = fs.Simulation(world, fs.Leapfrog(dt), threads=1)
    simulation.advance(until)
    return simulation


def _critical(place):
    """The tilt at which a ball at rest begins to slide, by halving."""
    low, high = 0.0, 0.5 * math.pi
    for _ in range(30):
        middle = 0.5 * (low + high)
        end = _end(place(middle), (0, 0, 0), fs.Bounce(0.0, friction=FRICTION), 0.05)
        rests = np.linalg.norm(end.velocities[0]) == 0.0
        low, high = (middle, high) if rests else (low, middle)
    return low


def _slide(place, friction, angle=0.9):
    """Relative error of the speed after a slide of one time unit."""
    end = _end(place(angle), (0, 0, 0), fs.Bounce(0.0, friction=FRICTION), 1.0)
    return abs(np.linalg.norm(end.velocities[0]) / (math.sin(angle) - friction * math.cos(angle)) - 1.0)


def _settled(count, dt=DT):
    """A ball dropped between rails or balls: errors of its height, what it moved since, whether it rests."""
    radius = 0.4
    if count == 2:
        world, (_, _, height) = _rails(0.0)
        radius = GROOVED
    else:
        world = _tilted(0.0)
        corners = [(math.cos(turn), math.sin(turn), 0.0) for turn in np.arange(3) * math.tau / 3]
        world.add_body(fs.Body([fs.Point(0.6 * np.array(c)) for c in corners], surface=fs.Material(radius=GROUND)))
        height = math.sqrt((GROUND + radius) ** 2 - 0.6**2)
    end = _end((world, (0.0, 0.0, height + 0.2)), (0, 0, 0), fs.Bounce(0.3, friction=0.8), 30.0, radius, dt)
    before = end.positions[0][0].copy()
    end.advance(130.0)
    after = end.positions[0][0]
    off = abs(after[2] - height) / radius
    return off, np.abs(after - before).max() / radius, int(end.states[0][0] == fs.Status.RESTING)
