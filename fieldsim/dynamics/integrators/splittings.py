"""Integrators: how a simulation steps. Each is a frozen value with its order, its cost and its source.

A *splitting* alternates drifts, x += dt drifts[j] v, with kicks, v += dt (kicks[j] g + gradients[j] dt^2 H g), where
g = grad F is the acceleration and H the Hessian of F: H g = grad |g|^2 / 2 is the force gradient. All tables are
palindromes, so that the methods are reversible, and all flows are canonical, so that they are symplectic. Order and
coefficients were checked, and published 15-digit ones completed, by solving the order conditions in the Lie algebra of
drift A and kick B modulo [B, [B, [B, A]]] = 0, which holds because the kinetic energy is quadratic.
"""

import dataclasses
import itertools
import math
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from fieldsim import validate
from fieldsim.errors import InputError
from fieldsim.types import RealLike


class Integrator:
    """What moves a simulation's particles: one of the splittings, `Leapfrog` the simplest."""


@dataclasses.dataclass(frozen=True)
class Splitting(Integrator):
    """A symplectic method of fixed steps; a subclass gives its `order` and its tables, else it is refused.

    dt: the longest step; a simulation shortens it so that whole steps land on the times it is asked for.
    kicks and gradients (s + 1), drifts (s): one step is kick 0, drift 0, kick 1, ..., drift s - 1, kick s. Where the
    outer kicks are not 0, the last evaluation serves the next step too; the outer gradients are 0.
    nodes (s + 1): the stages' times within a step, in units of dt. evaluations: of the acceleration, a step.
    """

    dt: float = 1e-3

    if TYPE_CHECKING:

        def __init__(self, dt: RealLike = ...) -> None: ...

    order: ClassVar[int]
    kicks: ClassVar[tuple[float, ...]]
    drifts: ClassVar[tuple[float, ...]]
    gradients: ClassVar[tuple[float, ...]]
    nodes: ClassVar[tuple[float, ...]]
    evaluations: ClassVar[int]

    def __init_subclass__(cls):
        _check(cls)
        stages = len(cls.drifts)
        if not len(cls.kicks) == len(cls.gradients) == stages + 1:
            raise InputError(f"{cls.__name__}: {stages} drifts want {stages + 1} kicks and gradients")
        if cls.gradients[0] or cls.gradients[-1] or bool(cls.kicks[0]) != bool(cls.kicks[-1]):
            raise InputError(f"{cls.__name__}: the outer gradients must be 0, the outer kicks both 0 or both not")
        stages_used = [bool(kick or gradient) for kick, gradient in zip(cls.kicks, cls.gradients, strict=True)]
        if not all(stages_used[1:-1]):
            raise InputError(f"{cls.__name__}: an inner kick and its gradient are both 0; join the drifts beside them")
        cls.nodes = (*(math.fsum(cls.drifts[:j]) for j in range(stages)), 1.0)
        cls.evaluations = sum(stages_used[1:])

    def __post_init__(self):
        validate.fields(self, validate.number, "dt", above=0.0)

    def steps(self, duration: float) -> tuple[int, float]:
        """Number and length of the equal steps, at most `dt` long, that fill `duration`.

        Raises InputError where a step would be too short to change the time.
        """
        duration = validate.number(f"{type(self).__name__}.steps", "duration", duration, at_least=0.0)
        # A quotient that differs from a whole number by rounding counts as that number.
        count = duration / self.dt * (1.0 - 1e-12)
        if count > 2**53:
            name = type(self).__name__
            raise InputError(f"{name}: dt is {self.dt:g}, too short for a duration of {duration:g}; give a longer dt")
        count = math.ceil(count)
        return count, duration / count if count else 0.0


def _check(cls):
    """Raise InputError for a subclass of Splitting without an order or a table, or with tables of no step."""
    for name in ("order", "kicks", "drifts", "gradients"):
        if not hasattr(cls, name):
            raise InputError(
                f"{cls.__name__}: the splitting has no {name!r}; give order (a whole number), kicks and gradients "
                "(s + 1 numbers each) and drifts (s numbers)"
            )
    validate.whole(cls.__name__, "order", cls.order, at_least=1)
    for name in ("kicks", "drifts", "gradients"):
        table = validate.numbers(cls.__name__, name, getattr(cls, name), shape=(None,))
        if name != "gradients" and abs(math.fsum(table) - 1.0) > 1e-12:
            raise InputError(
                f"{cls.__name__}: the sum of {name} is {math.fsum(table):.15g}; give shares of a step, of sum 1"
            )
        if not np.allclose(table, table[::-1], rtol=0.0, atol=1e-12):
            raise InputError(f"{cls.__name__}: {name} is no palindrome; give a table that reads the same backwards")


def moments(steps, nodes):
    """Stage times of consecutive steps, in units of dt; the shared end point of two steps is listed once."""
    inner = steps[:, None] + np.asarray(nodes)[:-1]
    return np.append(inner.ravel(), steps[-1] + 1.0)


def _mirrored(*half, middle=True):
    """The palindrome that begins with `half`; its last number stands once if it is the middle one."""
    return (*half, *half[::-1][middle:])


def _composed(*half):
    """Kicks, drifts and gradients of leapfrog steps with the palindromic weights that begin with `half`."""
    weights = _mirrored(*half)
    joints = (0.5 * (one + other) for one, other in itertools.pairwise(weights))
    kicks = (0.5 * weights[0], *joints, 0.5 * weights[-1])
    return kicks, weights, (0.0,) * len(kicks)


class Leapfrog(Splitting):
    """Velocity Verlet, kick-drift-kick: order 2, one evaluation a step.

    Verlet 1967; Hairer, Lubich & Wanner 2003.
    """

    order = 2
    kicks, drifts, gradients = _composed(1.0)


class Suzuki4(Splitting):
    """Five leapfrogs: order 4, five evaluations a step. Robust, not fast. Suzuki 1990."""

    order = 4
    kicks, drifts, gradients = _composed(*2 * (1 / (4 - 4 ** (1 / 3)),), 1 - 4 / (4 - 4 ** (1 / 3)))


class BlanesMoan4(Splitting):
    """Runge-Kutta-Nystrom, order 4, six evaluations a step: SRKN6b of Blanes & Moan 2002."""

    order = 4
    kicks = _mirrored(0.08298440641740497637, 0.39630980149836803858, -0.03905630492234842745, 0.11952419401315082487)
    drifts = _mirrored(0.24529895718427111659, 0.60487266571107991560, -0.35017162289535103223, middle=False)
    gradients = (0.0,) * 7


class BlanesMoan6(Splitting):
    """Runge-Kutta-Nystrom, order 6, fourteen evaluations a step: SRKN14a of Blanes & Moan 2002."""

    order = 6
    kicks = _mirrored(
        0.0,
        0.09171915262446660550,
        0.18398317000500974992,
        -0.05653436583288475944,
        0.00491468877470894866,
        0.14376112716837105580,
        0.32856769374679417148,
        -0.19641146648646577192,
        middle=False,
    )
    drifts = _mirrored(
        0.03785931984061578677,
        0.10263563310243526121,
        -0.02586788826656283024,
        0.31424140307147133556,
        -0.13014445951742059997,
        0.10641770036954733671,
        -0.00879424312850728326,
        0.20730506905684198641,
    )
    gradients = (0.0,) * 16


class BlanesMoan6B(Splitting):
    """Runge-Kutta-Nystrom, order 6, eleven evaluations a step: SRKN11b of Blanes & Moan 2002."""

    order = 6
    kicks = _mirrored(
        0.04146499851826283665,
        0.19812867191806651000,
        -0.04000619210415272389,
        0.07525398430158031411,
        -0.01151138742068775672,
        0.23666992478693081989,
        middle=False,
    )
    drifts = _mirrored(
        0.12322977594627113581,
        0.29055379779955825995,
        -0.12704921262541697456,
        -0.24633176106207541289,
        0.35720887279592784775,
        0.20477705429147028794,
    )
    gradients = (0.0,) * 12


class KahanLi6(Splitting):
    """Nine leapfrogs: order 6, nine evaluations a step. Kahan & Li 1997."""

    order = 6
    kicks, drifts, gradients = _composed(
        0.39216144400731413927925056,
        0.33259913678935943859974864,
        -0.70624617255763935980996482,
        0.08221359629355080023149045,
        0.79854399093482996339895035,
    )


class KahanLi8(Splitting):
    """Seventeen leapfrogs: order 8, seventeen evaluations a step. Kahan & Li 1997."""

    order = 8
    kicks, drifts, gradients = _composed(
        0.13020248308889008087881763,
        0.56116298177510838456196441,
        -0.38947496264484728640807860,
        0.15884190655515560089621075,
        -0.39590389413323757733623154,
        0.18453964097831570709183254,
        0.25837438768632204729397911,
        0.29501172360931029887096624,
        -0.60550853383003451169892108,
    )


class SofroniouSpaletta10(Splitting):
    """Thirty-five leapfrogs: order 10, thirty-five evaluations a step. Sofroniou & Spaletta 2005."""

    order = 10
    kicks, drifts, gradients = _composed(
        0.07879572252168641926390768,
        0.31309610341510852776481247,
        0.02791838323507806610952027,
        -0.22959284159390709415121340,
        0.13096206107716486317465686,
        -0.26973340565451071434460973,
        0.07497334315589143566613711,
        0.11199342399981020488957508,
        0.36613344954622675119314812,
        -0.39910563013603589787862981,
        0.10308739852747107731580277,
        0.41143087395589023782070412,
        -0.00486636058313526176219566,
        -0.39203335370863990644808194,
        0.05194250296244964703718290,
        0.05066509075992449633587434,
        0.04967437063972987905456880,
        0.04931773575959453791768001,
    )


class Chin4(Splitting):
    """Force gradient, order 4, all steps forward, three evaluations a step, one with the Hessian: 4C of Chin 1997."""

    order = 4
    kicks = (0.0, 3 / 8, 1 / 4, 3 / 8, 0.0)
    drifts = (1 / 6, 1 / 3, 1 / 3, 1 / 6)
    gradients = (0.0, 0.0, 1 / 96, 0.0, 0.0)


class Omelyan4(Splitting):
    """Force gradient, order 4, all steps forward, five evaluations a step, two with the Hessian.

    Omelyan, Mryglod & Folk 2003, eqs. 72 and 78.
    """

    order = 4
    kicks = _mirrored(0.0, 0.15181796402764660635, 0.21583694767876190939, 0.26469017658718296856)
    drifts = _mirrored(0.06419108866816235767, 0.19198079404557411477, 0.24382811728626352756, middle=False)
    gradients = _mirrored(0.0, 0.0, 0.00192578104240497438, 0.0)


class Omelyan6(Splitting):
    """Force gradient, order 6, five evaluations a step, all with the Hessian.

    Omelyan, Mryglod & Folk 2003, eqs. 72 and 73.
    """

    order = 6
    kicks = _mirrored(0.0, 0.26938165176778535207, 0.07611936345860830175, 0.30899796954721269244)
    drifts = _mirrored(0.10980593015771474046, 0.48280999402510121741, -0.09261592418281595786, middle=False)
    gradients = _mirrored(0.0, 0.00202249869806602346, -0.00360675625875210958, 0.02167300215323971526)


class Omelyan8(Splitting):
    """Force gradient, order 8, eleven evaluations a step, all with the Hessian.

    Omelyan, Mryglod & Folk 2002, eq. 53.
    """

    order = 8
    kicks = _mirrored(
        0.0,
        0.0048249309817414952912695842664785,
        0.17492394861090375603419001374207,
        0.29304366370957066164364546204288,
        0.047448940168459770284238136482511,
        -0.0015299863411743974499219652320477,
        -0.037422994259002571606842462603791,
    )
    drifts = _mirrored(
        0.41009674738801111928784693005080,
        -0.34123345756052780489101697378499,
        0.25644714021068150492361761631743,
        0.27765273975812438394100476242641,
        -0.56926266869753773902939657321159,
        0.46629949890124853576794423820194,
        middle=False,
    )
    gradients = _mirrored(
        0.0,
        2 * 1.4743936907797528364717244760736e-4,
        2 * 2.3288450531932545357194967600155e-4,
        2 * 6.1648659635535962497705619884752e-3,
        2 * -1.2307516860831240716732016960034e-2,
        2 * -7.3296648559126385387017161643798e-5,
        2 * 1.5295860994523744731993293847001e-2,
    )
