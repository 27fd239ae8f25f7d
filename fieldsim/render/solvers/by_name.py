"""Solvers by name, `Renderer(solver=...)`: how primary rays find the surface F = 1.

| name | method | surfaces |
|---|---|---|
| hermite | bounded steps on the true field, cubic Hermite pieces for the root: the default | all that are rendered |
| lagrange | one quartic an element through five samples, as published in 1998; its error shows | all; 1/r only alone |
| laguerre | exact polynomials along the ray, roots by Laguerre's method | Points of polynomial kernels |
| numeric | samples of the true field, regula falsi where the sign changes | as hermite |
| referee | safe steps on the true field in float64: slow, misses nothing | all that safe steps know |

With "hermite", scenes of Gaussian points, segments and circles of positive strength are traced by
`packet.packet_tracer`, whose steps are not certified. Solvers differ in primary rays; shadows, reflection and
refraction are the default's.
"""

import difflib

import numpy as np
import warp as wp

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.potentials import registry
from fieldsim.potentials.bounds import safe_step
from fieldsim.potentials.elements import Elements
from fieldsim.render.scene.candidates import TILE, Candidates
from fieldsim.render.solvers import hermite, lagrange, laguerre, numeric
from fieldsim.render.solvers.referee import Referee


class Solver:
    """A solver of primary rays: a sweep through sorted intervals. known(): (kernel, primitive) pairs; None: all.

    counts: whether it counts the evaluations of each ray, which layers show; pieces: whether it cuts intervals into
    pieces as long as a kernel is wide, which are too many where a field goes on for ever, as 1/r does, beside others.
    """

    def __init__(self, name, first_hit, *, known=None, polish=0.01, counts=False, pieces=False):
        self.name, self.counts, self.pieces = name, counts, pieces
        self.options = {"first_hit": first_hit, "polish": polish}
        self._known = known

    def check(self, elements: Elements) -> None:
        """Raise InputError for elements that the solver cannot do."""
        known = None if self._known is None else self._known()
        formulas = list(_formulas(elements))
        endless = [formula for formula in formulas if formula.kernel.unit]
        if self.pieces and 0 < len(endless) < len(formulas):
            raise InputError(
                f"the solver {self.name!r} cannot do {endless[0].kernel.__name__}, whose field never ends, beside "
                "kernels that end: too many pieces; give solver='hermite'"
            )
        for formula in formulas:
            if known is not None and (formula.kernel, formula.primitive) not in known:
                raise InputError(
                    f"the solver {self.name!r} cannot do {formula.kernel.__name__} on {formula.primitive.__name__}, "
                    "only " + ", ".join(f"{k.__name__} on {p.__name__}" for k, p in known) + "; give solver='hermite'"
                )

    def check_layers(self) -> None:
        """Raise InputError where the solver gives no layers."""
        if not self.counts:
            raise InputError(
                f"Renderer.layers: the solver {self.name!r} does not count its evaluations, which are a layer; give "
                "solver='hermite'"
            )

    def lists(self, stage) -> Candidates:
        """The candidates of the tracing kernel."""
        return stage.elements.lists

    def finish(self, stage, samples, hits) -> None:
        """Post-processing after the tracing kernel; none by default."""


class SafeSteps(Solver):
    """The referee: the tracing kernel finds everything but the surfaces, and the referee overwrites what they hide."""

    def __init__(self, name):
        super().__init__(name, hermite.first_hit)

    def check(self, elements):
        """Raise InputError for elements for which no safe step is known."""
        for formula in _formulas(elements):
            safe_step.check(formula)

    def lists(self, stage):
        """Empty lists: the tracing kernel finds no surface."""
        tiles = stage.perspective.view.tiles * -(-stage.perspective.view.height // TILE)
        device = stage.elements.lists.ids.device
        nothing = Candidates()
        nothing.first = wp.zeros(tiles + 1, dtype=int, device=device)
        nothing.ids, nothing.near = stage.elements.lists.ids, stage.elements.lists.near
        return nothing

    def finish(self, stage, samples, hits):
        """Write surface hits over what lies behind them."""
        count, view = samples.shape[0], stage.perspective.view
        x, y = samples.numpy().astype(float).T
        corner, across, down = (np.array(v, dtype=float) for v in (view.corner, view.across, view.down))
        directions = corner + x[:, None] * across + y[:, None] * down
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        referee = Referee(stage.elements.surface.elements, stage.elements.lists.ids.device)
        depths, normals = referee.first_hits(stage.perspective.eye, directions)
        behind = hits.thing.numpy()[:count] != -1
        far = np.where(behind, hits.depth.numpy()[:count].astype(float) * stage.perspective.unit, np.inf)
        which = np.flatnonzero(depths < far)
        points = stage.perspective.eye + depths[which, None] * directions[which]
        referee.describe(hits, which, depths[which] / stage.perspective.unit, normals[which], points, stage)


def _formulas(elements):
    return registry.formulas_of(elements.kinds_used).values()


SOLVERS = {
    "hermite": Solver("hermite", hermite.first_hit, counts=True),
    # polish=0: no Newton step on the true field afterwards.
    "lagrange": Solver("lagrange", lagrange.first_hit, polish=0.0, pieces=True),
    "laguerre": Solver("laguerre", laguerre.first_hit, known=laguerre.known),
    "numeric": Solver("numeric", numeric.first_hit),
    "referee": SafeSteps("referee"),
}


def solver_named(name: str) -> Solver:
    """The solver of that name; raises InputError for an unknown one."""
    if isinstance(name, str) and name in SOLVERS:
        return SOLVERS[name]
    near = difflib.get_close_matches(name, SOLVERS, n=1) if isinstance(name, str) else ()
    hint = f"did you mean {near[0]!r}?" if near else "give one of " + ", ".join(SOLVERS)
    raise InputError(f"Renderer: solver is {validate.shown(name)}; {hint}")
