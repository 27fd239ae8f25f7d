"""Feet of a point on elements: where searches for the nearest points of their surface begin (see `Primitive.feet`)."""

from fieldsim.portable import Indices, Portable, Table, hole, portable, real
from fieldsim.potentials import registry

# The most feet that a primitive has.
MOST = 3
first = hole("x, y, z, rows, kinds, i")
second = hole("x, y, z, rows, kinds, i")
third = hole("x, y, z, rows, kinds, i")


@portable
def _foot(x: real, y: real, z: real, rows: Table, kinds: Indices, i: int, which: int):
    if which == 1:
        return second(x, y, z, rows, kinds, i)
    if which == 2:
        return third(x, y, z, rows, kinds, i)
    return first(x, y, z, rows, kinds, i)


def _feet(kinds):
    """The feet of the primitive of each kind; without kinds those of some, since a function needs one to compile."""
    primitives = {formula.kind: formula.primitive for formula in registry.FORMULAS.values()}
    return {kind: primitives[kind].feet for kind in kinds or (min(primitives),)}


def most_feet(kinds: tuple[int, ...]) -> int:
    """How many feet the primitives of the given kinds have at most."""
    return max(map(len, _feet(kinds).values()))


def foot_of(kinds: tuple[int, ...]) -> Portable:
    """Portable (x, y, z, rows, kinds, i, which) -> that one of the feet of element i, (x, y, z).

    Of an element that has fewer, its last.
    """
    feet = _feet(kinds)
    chosen = [registry.by_kind({kind: own[min(k, len(own) - 1)] for kind, own in feet.items()}) for k in range(MOST)]
    return _foot.bind(first=chosen[0], second=chosen[1], third=chosen[2])
