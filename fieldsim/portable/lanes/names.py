"""Names in the C++ of lanes: which are taken, by the language, by the types and by functions."""

from fieldsim.portable.lanes.mathematics import NAMES

_KEYWORDS = frozenset(
    "alignas alignof and and_eq asm auto bitand bitor bool break case catch char class compl const constexpr continue "
    "decltype default delete do double else enum explicit export extern false float for friend goto if inline int long "
    "mutable namespace new noexcept not not_eq nullptr operator or or_eq private protected public register return "
    "short signed sizeof static struct switch template this throw true try typedef typeid typename union unsigned "
    "using virtual void volatile wchar_t while xor xor_eq far near live result lanes wp".split()
)
_TYPES = frozenset({"Real", "Int", "Mask", "scalar", "Table", "Indices"})
_TAKEN = _KEYWORDS | _TYPES | NAMES


def is_taken(name: str) -> bool:
    """Whether a name means something everywhere in the C++."""
    return name in _TAKEN


def is_reserved(name: str) -> bool:
    """Whether no local name may be this one: functions, unlike words and types, can be told from local names."""
    return name in _KEYWORDS or name in _TYPES
