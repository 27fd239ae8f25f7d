"""Translations of moments to local expansions: what a cell's moments make of the field in a cell that lies apart.

With cells of half width 1 and a kernel k, the field at x in a cell at the offset t (in widths) of moments M is

    F(x) = sum over a, b of T~_a(x) C_t[a, b] M_b,    C_t the coefficients of k(|x + 2 t - y|) in x and y

(Fong & Darve 2009). Offsets that differ by signs and order have the same C but for signs and order: 16 matrices serve
316 offsets (Messner et al. 2012). Each is found by adaptive cross approximation at the nodes (Bebendorf 2000) and cut
by its singular values; all together have few rows and columns that count, on which they are projected. What is lost by
all of this is measured: the error of the kernel itself, at points of the cells' faces, edges, corners and inside.
"""

import dataclasses
import functools
import itertools
import math

import numpy as np

from fieldsim.potentials.fast_summation import chebyshev
from fieldsim.potentials.fast_summation.crosses import crosses
from fieldsim.potentials.fast_summation.laws import law_and_slopes, law_values
from fieldsim.potentials.kernels import PowerLaw

# Degrees are tried up to this one.
MOST_ORDER = 24
# What is measured at points of the cells may be larger between them.
SAFETY = 3.0
# Singular values are cut at this share of the allowed error, times the number of nodes.
CUT = 0.3
# The order is such that the error at the worst places is so many times the allowed one: hardly anything lies there.
SLACK = 20.0
# What float32 keeps of a number.
SINGLE = 2.0**-23
PLACES = 96


@dataclasses.dataclass(frozen=True)
class Scaled:
    """A kernel in half widths of cells, in units of its value between the nearest: k(r) = h(size r) / h(2 size)."""

    kernel: PowerLaw
    size: float

    @functools.cached_property
    def unit(self) -> float:
        """h(2 size)."""
        return float(law_values(self.kernel, np.array([4.0 * self.size**2]))[0])

    def values(self, squares: np.ndarray) -> np.ndarray:
        """K at squared distances."""
        return law_values(self.kernel, self.size**2 * squares) / self.unit

    def jets(self, away: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Values k (N,), its gradient (N, 3) and Hessian (N, 3, 3) at offsets (N, 3)."""
        h, slope, bend = law_and_slopes(self.kernel, self.size**2 * (away * away).sum(axis=-1))
        unit, size = self.unit, self.size
        outer = 4.0 * (bend * size**4)[:, None, None] * away[:, :, None] * away[:, None, :]
        hessian = outer + 2.0 * (slope * size**2)[:, None, None] * np.eye(3)
        return h / unit, 2.0 * (slope * size**2)[:, None] * away / unit, hessian / unit

    @property
    def softening(self) -> float:
        """The softening, in half widths."""
        return float(type(self.kernel).softening_of(self.kernel.width)) / self.size


# Offsets of positive, falling components, by the largest: those of the nearer cells need more than the others.
RINGS = {ring: [(ring, j, k) for j in range(ring + 1) for k in range(j + 1)] for ring in (2, 3)}


def order_needed(scaled: Scaled, canonical, error: float) -> int:
    """About how many nodes along an edge give k between cells at an offset to `error`."""
    t = 2.0 * np.array(canonical, dtype=float)
    gap = np.maximum(t - 2.0, 0.0)
    across = np.sqrt((gap**2).sum() - gap**2 + scaled.softening**2)
    singular = np.maximum(t - 1.0, 0.0) + 1j * across
    # The half axes' sum of the ellipse through the singularity next to -1..1 (Trefethen 2008).
    rho = np.abs(singular + np.sqrt(singular - 1.0) * np.sqrt(singular + 1.0)).min()
    greatest = scaled.values(np.array([(gap**2).sum()]))[0]
    power = type(scaled.kernel).power
    lead = 1.2 * 12.0 ** (0.5 * (power - 1)) * greatest / error
    return max(3, math.ceil(math.log(max(lead, 1.0)) / math.log(rho)))


@dataclasses.dataclass(frozen=True)
class Translations:
    """The translations between cells of one size whose offsets' largest component is `ring`, in half widths.

    They give the field in units of h(2 size). bases: of each of the eight parities, (products, R_parity). before and
    after: offset -> two factors (R, rank), the larger part in float64, and what is so small that float32 holds it well
    enough; C_t is the sum of U after[t] before[t]^T U^T over both. errors: offset, its sizes in falling order -> how
    far the field of an amount 1 at any place may be wrong: its value, gradient and Hessian.
    """

    ring: int
    order: int
    bases: tuple[np.ndarray, ...]
    before: dict
    after: dict
    errors: dict

    @property
    def rank(self) -> int:
        """R, the length of projected moments."""
        return sum(basis.shape[1] for basis in self.bases)

    def projected(self, tensors: np.ndarray) -> np.ndarray:
        """Moments (C, order^3) on the basis, (C, R)."""
        order, ends = _by_parity(self.order)
        parts = np.split(np.take(tensors, order, axis=1), ends, axis=1)
        return np.concatenate([part @ basis for part, basis in zip(parts, self.bases, strict=True)], axis=1)

    def projected_factor(self, factor: np.ndarray, moved: np.ndarray | None = None) -> np.ndarray:
        """Coefficients (order^3, K) on the basis, (R, K); moved: where each product stands in them."""
        parts = zip(chebyshev.parities(self.order), self.bases, strict=True)
        places = np.arange(self.order**3) if moved is None else moved
        return np.concatenate([basis.T @ factor[places[which]] for which, basis in parts])

    def expanded(self, local: np.ndarray) -> np.ndarray:
        """Local expansions (C, order^3) of those on the basis, (C, R)."""
        parts = np.split(local, np.cumsum([basis.shape[1] for basis in self.bases])[:-1], axis=1)
        parts = [part @ basis.T for part, basis in zip(parts, self.bases, strict=True)]
        order, _ends = _by_parity(self.order)
        place = np.full(self.order**3, len(order))
        place[order] = np.arange(len(order))
        return np.take(np.concatenate([*parts, np.zeros((len(local), 1))], axis=1), place, axis=1)


@functools.cache
def _by_parity(order):
    """The kept products, those of one parity together, and where parities end."""
    parities = chebyshev.parities(order)
    return np.concatenate(parities), np.cumsum([len(which) for which in parities])[:-1]


def translations(scaled: Scaled, ring: int, error: float) -> Translations:
    """The translations of a ring, each wrong by about `error` where that is worst for most distributions of amounts."""
    orders = {t: min(order_needed(scaled, t, SLACK * error), MOST_ORDER) for t in RINGS[ring]}
    order = max(orders.values())
    cut = CUT * error * math.sqrt(order**3)
    factors = [_cut(*_factors(scaled, t, orders[t], order, CUT * error), cut) for t in RINGS[ring]]
    bases = _bases(np.concatenate([part for pair in factors for part in pair[:2]], axis=1), order, cut)
    made = _projected(Translations(ring, order, bases, {}, {}, {}), factors)
    return dataclasses.replace(made, errors=_measured(made, scaled))


def _factors(scaled, t, lower, order, error):
    """Both factors (order^3, rank) of C_t, in coefficients, from crosses at lower^3 nodes."""

    def coefficients(factor):
        cubes = chebyshev.applied(factor.T.reshape(-1, lower, lower, lower), [chebyshev.from_values(lower)] * 3)
        whole = np.zeros((order, order, order, len(cubes)))
        whole[:lower, :lower, :lower] = cubes.transpose(1, 2, 3, 0) * (order / lower) ** 1.5
        return whole.reshape(-1, len(cubes))

    left, right = crosses(scaled.values, 2.0 * np.array(t), lower, error)
    return coefficients(left), coefficients(right)


ORDERS = list(itertools.permutations(range(3)))


@functools.cache
def _permuted(order: int, axes: tuple[int, int, int]) -> np.ndarray:
    """Indices (order^3,): which product of canonical axes stands where, for an offset with offset[i] = t[axes[i]]."""
    return np.arange(order**3).reshape((order,) * 3).transpose(*axes).ravel()


def _bases(factors, order, cut):
    """Per parity, the directions (products, R) in which some translation is larger than `cut`."""
    parities = chebyshev.parities(order)
    grams = [factors[which] @ factors[which].T for which in parities]
    found = []
    for which in parities:
        total = np.zeros((len(which), len(which)))
        for axes in ORDERS:
            moved = _permuted(order, axes)[which]
            parity = next(k for k, other in enumerate(parities) if len(other) and moved[0] in other)
            where = np.searchsorted(parities[parity], moved)
            total += grams[parity][np.ix_(where, where)]
        sizes, vectors = np.linalg.eigh(total)
        found.append(np.ascontiguousarray(vectors[:, sizes > cut]))
    return tuple(found)


def _cut(left, right, cut):
    """Factors (order^3, rank) of left right^T without what is smaller than `cut`; how many columns need float64."""
    lower, other = (_triangle(factor.T @ factor) for factor in (left, right))
    u, sizes, v = np.linalg.svd(lower.T @ other)
    rank = max(1, int((sizes > cut).sum()))
    root = np.sqrt(sizes[:rank])
    exact = int((sizes > cut / SINGLE).sum())
    return (
        left @ np.linalg.solve(lower.T, u[:, :rank] * root),
        right @ np.linalg.solve(other.T, v[:rank].T * root),
        exact,
    )


def _triangle(gram):
    """Cholesky's factor of a Gram matrix, of which rounding may have made the least directions negative."""
    return np.linalg.cholesky(gram + 1e-15 * np.diag(gram).sum() * np.eye(len(gram)))


def _projected(made, factors):
    """The translations of all offsets on the bases."""
    parity_signs = np.array([[(-1.0) ** (parity >> bit & 1) for bit in (2, 1, 0)] for parity in range(8)])
    signs = np.repeat(parity_signs, [basis.shape[1] for basis in made.bases], axis=0)
    before, after, done, classes = {}, {}, set(), RINGS[made.ring]
    for axes in ORDERS:
        fresh = [k for k, t in enumerate(classes) if tuple(t[i] for i in axes) not in done]
        if not fresh:
            continue
        ends = np.cumsum([factors[k][0].shape[1] for k in fresh])
        moved = _permuted(made.order, axes)
        sides = [np.concatenate([factors[k][side] for k in fresh], axis=1) for side in (0, 1)]
        left, right = (np.split(made.projected_factor(side, moved), ends[:-1], axis=1) for side in sides)
        for number, k in enumerate(fresh):
            offset = tuple(classes[k][i] for i in axes)
            done.add(offset)
            for flips in itertools.product(*((1, -1) if one else (1,) for one in offset)):
                sign = np.prod(np.where(np.array(flips) < 0, signs, 1.0), axis=1)[:, None]
                whole = tuple(one * flip for one, flip in zip(offset, flips, strict=True))
                exact = factors[k][2]
                after[whole], before[whole] = _in_two(sign * left[number], exact), _in_two(sign * right[number], exact)
    return dataclasses.replace(made, before=before, after=after)


def _in_two(factor, exact):
    """The first columns of a factor in float64, and the others in float32."""
    return np.ascontiguousarray(factor[:, :exact]), factor[:, exact:].astype(np.float32)


def _places():
    """Points (PLACES, 3) of the cube -1..1 where errors are looked at: corners, edges, faces and inside."""
    rng = np.random.default_rng(1)
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    middles = np.array([p for p in itertools.product((-1.0, 0.0, 1.0), repeat=3) if 0 in p])
    inside = rng.uniform(-1.0, 1.0, (PLACES - len(corners) - len(middles), 3))
    outward = rng.random(inside.shape) < 0.6
    return np.concatenate([corners, middles, np.where(outward, np.sign(inside), inside)])


def _measured(made, scaled):
    """The largest errors of value, gradient and Hessian of each class."""
    places = _places()
    own = made.projected(_products(places, made.order, (0, 0, 0)))
    derivatives = [
        made.projected(_products(places, made.order, tuple(which)))
        for which in [*np.eye(3, dtype=int), *(np.eye(3, dtype=int)[i] + np.eye(3, dtype=int)[j] for i, j in _PAIRS)]
    ]
    found = {}
    for t in RINGS[made.ring]:
        away = (places[:, None] + 2.0 * np.array(t) - places[None]).reshape(-1, 3)
        value, gradient, hessian = scaled.jets(away)
        # As it is summed: the smaller part in float32.
        right = [before.T @ own.T.astype(before.dtype) for before in made.before[t]]
        parts = [after @ one for after, one in zip(made.after[t], right, strict=True)]
        both = parts[0] + parts[1]
        missed = [(part @ both).ravel() for part in (own, *derivatives)]
        slopes = np.stack(missed[1:4], axis=1) - gradient
        bends = np.stack(missed[4:], axis=1) - np.stack([hessian[:, i, j] for i, j in _PAIRS], axis=1)
        weights = np.array([1.0 if i == j else 2.0 for i, j in _PAIRS])
        sizes = np.abs(missed[0] - value), np.linalg.norm(slopes, axis=1), np.sqrt((bends**2) @ weights)
        found[t] = tuple(SAFETY * float(size.max()) for size in sizes)
    return found


_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def _products(places, order, derivatives):
    """The products of the basis (N, order^3) at places (N, 3), differentiated so often along x, y and z."""
    x, y, z = (chebyshev.basis_and_derivatives(places[:, axis], order)[derivatives[axis]] for axis in range(3))
    return np.einsum("na,nb,nc->nabc", x, y, z).reshape(len(places), -1)
