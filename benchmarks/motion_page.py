"""Write docs/motion.md and its pictures from the figures of `python -m benchmarks precision`."""

import inspect
import itertools
import pathlib

import numpy as np

from fieldsim.dynamics.contact.sliding import SLOW
from fieldsim.dynamics.diagnostics.energy_log import LOST
from fieldsim.dynamics.integrators.splittings import Splitting
from fieldsim.dynamics.trials import AHEAD, SAMPLE

DOCS = pathlib.Path(__file__).parents[1] / "docs"
COLORS = (
    *("black", "grey", "gold", "tab:orange", "tab:red", "crimson", "tab:pink", "tab:purple", "navy", "tab:blue"),
    *("tab:cyan", "teal", "tab:green", "tab:olive", "tab:brown", "orchid"),
)
# Errors to be reached in the table of costs.
TARGETS = (1e-4, 1e-8, 1e-12)

PAGE = """# Motion

Which integrator when, what each costs, and how contact, rest, friction and work are defined. Written by
`python -m benchmarks precision`, from the classes and from what it measured. How a particle passes through the code:
[architecture.md](architecture.md#the-road-of-a-particle).

## Which integrator when

| you want | give |
|---|---|
| a film, pebbles that bounce and rest | `fs.Leapfrog(dt)`: next to a surface every method is one |
| an energy tolerance and no thought | `"auto"`, `fs.Auto(tolerance)` |
| orbits to rounding, close passages, bare wires | `fs.Radau()` |
| smooth orbits for very long times | `fs.BlanesMoan6(dt)`, `fs.Omelyan6(dt)`: nothing drifts but rounding |
| a few particles that pull each other, to rounding | `fs.Radau()` |
| free bodies | a splitting without force gradients: `fs.Leapfrog`, `fs.BlanesMoan6` |
| free bodies with friction, or a restitution below 1 | `fs.Leapfrog(dt)`: what is lost cannot be taken back |

`fieldsim run SCENARIO --integrator NAME[:dt]` tries another (`auto:1e-6`, `radau`, `kahanli8:0.05`), and
`--energy-plot FILE` draws how well energy was kept.

`Auto` tries methods on {sample} of the particles, on all that pull each other and on the free bodies, and takes the
cheapest method and step that keep the tolerance. First a flight ahead for {ahead} trials' time looks for close
passages, and trials begin shortly before them: with Radau, where it knows all that is there (the escape radius
aside) and no particles pull each other; else with the method chosen first, and where that loses the tolerance
another trial begins. Where the flight has to end early, or nothing keeps the tolerance on it, a warning and
`simulation.choice` say until when the choice is good. A passage closer still, or of a particle not in the sample, is
not foreseen. `EnergyLog` tells of it, and warns where more than {lost:g} of a particle's energy is lost.

`Radau` does not know contacts and free bodies, and refuses them; as do methods with force gradients free bodies.
Each particle has its own steps, but those that pull each other, and what they pull, share one, as in IAS15. Where a
particle crosses the escape radius Radau finds the crossing itself; the others see it at the end of their step.
Particles that pull each other neither touch nor escape. Sections and exponents follow particles past all bodies,
free ones too, but know no contact, escape and pull of particles on each other. All this is refused when a tool is
called, by name; `world.replace(...)` gives a copy without what is in the way.

## Methods

- *evaluations* of the pull in a step, and how many of them with the Hessian.
- *donut*: median relative energy error after {turns:.0f} orbits of 2 to 3.5 radii about a bare ring in steps of 0.05
  (an orbit takes about 25), the power of time with which it grows, microseconds an orbit.
- *needle*: microseconds for an orbit to T = 50 about a softened needle with an rms energy error of {targets}.

{methods}

{sources}

![Work and precision](precision.png)

![Energy error against time](energy.png)

All times are of one core, in float64, for particles that one thread moves together.

## What is kept

Splittings are symplectic and symmetric: where sources stand still energy swings with dt^order and does not drift, until
rounding, which compensated summation lets grow as a random walk, is all that is left. Radau's error is rounding from
the start. In a world that turns with one `Spin` the Jacobi integral takes energy's place.

**Work.** Where sources move otherwise, a particle's energy E = v^2/2 - F changes by the work of whoever moves them:
dE/dt = -dF/dt at its place. `EnergyLog` sums it with the splitting's own kicks (time is one more coordinate, and that
rate is the kick of its momentum) and follows E less work, which is kept as energy is where sources are still.

**Together.** Free bodies keep their energy in sum, contacts and what these took included, where prescribed bodies stand
still, and momentum and angular momentum where there are none; so do particles that pull each other. The report of a
film names all drifts.

**Manoeuvres.** `Simulation.set_particles` and `set_body` give particles and free bodies other places and motions
between two calls of `advance`; they go on as from a start there, and an `EnergyLog` tells what was given apart from
drifts. Arrays that a simulation hands out are copies, which refuse to be written.

**Many particles that pull each other.** Exact sums take the square of their number. Under splittings without force
gradients, on the CPU, more than 20,000 are summed by fast multipoles: no acceleration is wrong by more than 1e-6 of the
root mean square of all, as estimated with room at 64 particles. `fs.Simulation(world, method, pull_tolerance=1e-4)` is
less exact and faster, and 0 is exact. Momentum is then kept to the tolerance, not to rounding. The first evaluation of
a softened kernel prepares its tables, which may take a minute at 1e-6; later steps have them.

**Two masses.** Gravity pulls on the mass that resists, so that all fall alike. Free bodies that pull each other do so
with opposite forces, or are refused: they have one kernel, and one ratio of G times the mass that pulls to the mass
that resists. Particles of several G feel each other's own, and keep sums weighted by G times mass.

## Contact

How particles touch surfaces, bounce, rub and rest: [contact.md](contact.md). A touching particle whose normal speed is
below {slow:g} g dt, g the pull along the normal, has landed.

**Free bodies** touch by an energy of overlap: each point spread over a surface that lies within another one, at the
depth d (its distance to the nearest point of that surface), has the energy stiffness d^3 / 3 times its area, and is
pushed out along the normal there. Of two free bodies each presses with its own `Rigid(stiffness=...)`. A prescribed
body thinner than a free one's points are apart has points as well, unless it deforms. By default nothing is lost, and
momentum is kept.

`Rigid(restitution=e)`: the force of a patch of neighbouring points is multiplied by 1 + c v / v0, v its speed of
approach, v0 that of its first meeting, and c such that what comes at v0 leaves at e v0, whatever the force (Hunt and
Crossley); it never pulls. As long as they press in by no more than a fifth of their radius, two balls that hit
centrally leave within 1 % of it. `Rigid(friction=mu)`: after each kick, at each point, the impulse that ends the slip
against the material as it moves, at most mu times the normal impulse of that kick, solved for all points together:
what sticks does not creep. Of two free bodies the lesser restitution counts, and the geometric mean of the frictions;
against prescribed bodies the free one's own. Momentum and angular momentum are kept to rounding, and
`simulation.bodies.lost` is the energy that was taken. About axes without a moment of inertia (a point's, a straight
line's own) friction turns nothing: give `inertia="solid"` to what is to roll. Of prescribed bodies that grow or bend
only the pose's motion rubs and damps. Methods with steps backwards refuse such bodies: use `fs.Leapfrog`.
"""


def write(curves, runs, long):
    """Write the page and draw its pictures; without matplotlib the pictures stay as they are.

    curves: {name: [(microseconds an orbit, error), ...]}; runs, long: {name: benchmarks.precision.Run}, the latter of
    many more orbits, or nothing.
    """
    turns = next(iter(runs.values())).turns[-1]
    text = PAGE.format(
        sample=SAMPLE,
        ahead=AHEAD,
        lost=LOST,
        turns=turns,
        targets=", ".join(f"{target:g}" for target in TARGETS),
        methods="\n".join(_table(curves, runs)),
        sources="\n".join(f"- `{m.__name__}`: {_words(m)}" for m in Splitting.__subclasses__()),
        slow=float(SLOW),
    )
    (DOCS / "motion.md").write_text(text, encoding="utf-8")
    try:
        import matplotlib as _  # noqa: F401
    except ImportError:
        return
    _draw_curves(curves, DOCS / "precision.png")
    _draw_runs(runs | long, DOCS / "energy.png")


def _words(method):
    return " ".join(inspect.getdoc(method).split())


def _table(curves, runs):
    """Lines of the table of methods, then Radau and the peer."""
    yield (
        "| method | order | evaluations | with Hessian | donut error | growth | us | "
        + " | ".join(f"needle {target:g}" for target in TARGETS)
        + " |"
    )
    yield "|---|---:|---:|---:|---:|---:|---:|" + "---:|" * len(TARGETS)
    facts = {m.__name__: (m.order, m.evaluations, sum(map(bool, m.gradients))) for m in Splitting.__subclasses__()}
    for name, run in runs.items():
        error, power, cost = run.summary
        title = name.partition("(")[0]
        order, evaluations, bends = facts.get(title, (15, "", ""))
        needle = [_cost_of(curves.get(title, ()), target) for target in TARGETS]
        cells = (name, order, evaluations, bends, f"{error:.1e}", f"{power:.2f}", f"{cost:.0f}", *needle)
        yield "| " + " | ".join(map(str, cells)) + " |"


def _cost_of(points, target):
    """Microseconds at which a curve reaches an error, or "" where it does not."""
    points = sorted(points)
    for (cost, error), (more, better) in itertools.pairwise(points):
        if better <= target < error:
            share = np.log(error / target) / np.log(error / better)
            return f"{np.exp((1 - share) * np.log(cost) + share * np.log(more)):.0f}"
    return f"{points[0][0]:.0f}" if points and points[0][1] <= target else ""


def _style(name):
    return {"ls": "--" if "REBOUND" in name else "-", "marker": "s" if "REBOUND" in name else "o", "ms": 3, "lw": 1.1}


def _axes(title, x, y):
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 6), dpi=110, layout="constrained")
    axes = figure.add_subplot()
    axes.set_prop_cycle(color=COLORS)
    axes.set(xlabel=x, ylabel=y, xscale="log", yscale="log", title=title)
    axes.grid(alpha=0.3)
    return figure, axes


def _draw_curves(curves, path):
    figure, axes = _axes(
        "Orbits about a softened needle: work and precision",
        "CPU time of an orbit to T = 50 [us], one core",
        "relative energy error, rms over the orbits",
    )
    for name, points in curves.items():
        axes.plot(*zip(*points, strict=True), label=name, **_style(name))
    axes.set_ylim(1e-17, 1.0)
    axes.legend(fontsize=7, ncols=2)
    figure.savefig(path)


def _draw_runs(runs, path):
    figure, axes = _axes(
        "Orbits of the donut: energy error against time, and the power of time with which it grows",
        "orbits",
        "relative energy error, median over the orbits",
    )
    for name, run in runs.items():
        axes.plot(run.turns, run.sizes, label=f"{name}: {run.summary[1]:+.2f}", **_style(name))
    axes.set_ylim(1e-17, 1.0)  # room for the legend
    axes.legend(fontsize=7, ncols=2)
    figure.savefig(path)
