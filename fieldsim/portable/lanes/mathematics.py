"""Elementary functions of lanes in C++: which there are, and the source of those that are used.

`common.h` serves both precisions, the files of `double/` and `single.h` one each. Their paragraphs are functions; a
source has the paragraphs that it needs, in their order. In single precision `double/` serves too: its types are called
Wide.
"""

import functools
import pathlib
import re

from fieldsim.portable.rules import MATH

_FOLDER = pathlib.Path(__file__).parent
# Each may use what stands in those before it.
DOUBLE = "double/exponentials.h", "double/angles.h", "double/error_function.h"
SINGLE = ("single.h",)
_NAME = re.compile(r"\b[a-z_][a-z_0-9]*\b")
_DEFINED = re.compile(r"^(?:__attribute__\(\(noinline\)\) )?static \w+ (\w+)\(", re.MULTILINE)
_WIDE = {"Real": "Wide", "Int": "WideInt", "Mask": "WideMask"}
# Of one number each; pow and atan2 are of two.
_PAIRS = frozenset({"atan2", "pow", "copysign"})
_TYPES = """typedef {scalar} scalar;
constexpr static int width() {{ return {width}; }}
typedef scalar Real __attribute__((ext_vector_type({width})));
typedef decltype(Real() < Real()) Int;
typedef Int Mask;
typedef int Int32 __attribute__((ext_vector_type({width})));
"""
_WIDE_TYPES = """typedef double Wide __attribute__((ext_vector_type({width})));
typedef decltype(Wide() < Wide()) WideInt;
typedef WideInt WideMask;
static WideInt to_int(Wide x) {{ return __builtin_convertvector(__builtin_convertvector(x, Int32), WideInt); }}
static Wide to_real(WideInt k) {{ return __builtin_convertvector(__builtin_convertvector(k, Int32), Wide); }}
static bool any(WideMask m) {{ return __builtin_reduce_or(m) != 0; }}
static Wide abs(Wide x) {{ return __builtin_elementwise_abs(x); }}
static Wide sqrt(Wide x) {{ return __builtin_elementwise_sqrt(x); }}
static Wide floor(Wide x) {{ return __builtin_elementwise_floor(x); }}
static Wide copysign(Wide x, Wide y) {{ return __builtin_elementwise_copysign(x, y); }}
"""


@functools.cache
def _paragraphs(files):
    """(names that it defines, text) of each paragraph with functions."""
    parts = [part for file in files for part in (_FOLDER / file).read_text().split("\n\n")]
    return [(frozenset(_DEFINED.findall(part)), part.strip()) for part in parts if _DEFINED.search(part)]


def _defined(files):
    return frozenset().union(*(names for names, _ in _paragraphs(files)))


COMMON = frozenset(_DEFINED.findall((_FOLDER / "common.h").read_text()))
# All names that translated functions must not take.
NAMES = COMMON | _defined(DOUBLE) | _defined(SINGLE) | {"width", "widen", "narrow", "gather"} | MATH


def preamble(used: set[str], single: bool, width: int) -> str:
    """The types, and the functions of math in `used` with what they need."""
    scalar = "float" if single else "double"
    text = _TYPES.format(scalar=scalar, width=width) + (_FOLDER / "common.h").read_text()
    wanted = set(used) - COMMON
    own = _defined(SINGLE) if single else _defined(DOUBLE)
    through = sorted(wanted - own)
    if single and wanted:
        wanted |= {"widen", "narrow"} if through else set()
        wide = _chosen(DOUBLE, set(through)) if through else ""
        for name, other in _WIDE.items():
            wide = re.sub(rf"\b{name}\b", other, wide)
        text += _WIDE_TYPES.format(width=width) + wide + _chosen(SINGLE, wanted & own | {"widen", "narrow"})
        text += "".join(_through_double(name) for name in through)
    else:
        text += _chosen(DOUBLE, wanted)
    return text.replace("WIDTH", str(width)) + "".join(_for_one(name) for name in sorted(wanted & MATH))


def _chosen(files, wanted):
    """The paragraphs that define what is wanted, and what these need."""
    parts, wanted, chosen = _paragraphs(files), set(wanted), set()
    known = _defined(files)
    # What a paragraph needs stands above it.
    for names, part in reversed(parts):
        if names & wanted:
            chosen.add(part)
            wanted |= set(_NAME.findall(part)) & known
    return "".join(part + "\n" for _, part in parts if part in chosen)


def _through_double(name):
    if name in _PAIRS:
        return f"static Real {name}(Real x, Real y) {{ return narrow({name}(widen(x), widen(y))); }}\n"
    return f"static Real {name}(Real x) {{ return narrow({name}(widen(x))); }}\n"


def _for_one(name):
    """The function of numbers that are the same in all lanes."""
    if name in _PAIRS:
        return f"static scalar {name}(scalar x, scalar y) {{ return {name}(Real(x), Real(y))[0]; }}\n"
    return f"static scalar {name}(scalar x) {{ return {name}(Real(x))[0]; }}\n"
