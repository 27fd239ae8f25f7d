"""A portable function as C++ over lanes: its source, to be read and to be compiled."""

import dataclasses
import functools

from fieldsim.errors import PortableError
from fieldsim.portable.lanes.mathematics import preamble
from fieldsim.portable.lanes.translator import Translator, Version, needed, result_count
from fieldsim.portable.lanes.types import KINDS, Type


@dataclasses.dataclass(frozen=True)
class Lanes:
    """A portable function in C++ for `width` numbers at a time.

    entry: the name of the function itself, a member of `struct lanes`, which `source` defines with all that it calls;
    arguments and results: their types, None for a result that is not wanted; masked: whether its last argument is the
    mask of the lanes that count.
    """

    entry: str
    width: int
    arguments: tuple[Type, ...]
    results: tuple[Type | None, ...]
    masked: bool
    source: str = dataclasses.field(repr=False)

    @property
    def code(self) -> str:
        """The source without comments: what a compiler needs, and a cache should depend on."""
        return "\n".join(line for line in self.source.splitlines() if not line.lstrip().startswith("//"))


def width_of(single: bool) -> int:
    """How many numbers a vector holds."""
    return 16 if single else 8


def lanes_of(
    portable,
    single: bool,
    uniform: tuple[str, ...] | None = None,
    width: int | None = None,
    wanted: frozenset[int] | None = None,
) -> Lanes:
    """A portable function in C++.

    uniform: the arguments that are the same in all lanes; default all but reals. A table that is none of them is one
    for each lane. wanted: the places of the results that it returns; default all.
    """
    marks = portable.function.__annotations__
    code = portable.function.__code__
    names = code.co_varnames[: code.co_argcount]
    if uniform is None:
        uniform = tuple(name for name in names if KINDS.get(marks.get(name)) != "real")
    if unknown := sorted(set(uniform) - set(names)):
        raise PortableError(f"{portable.__qualname__} has no argument {unknown[0]!r}; its arguments are {list(names)}")
    count = result_count(portable.checked())
    return _made(
        portable,
        single,
        frozenset(uniform),
        width or width_of(single),
        tuple(wanted is None or place in wanted for place in range(count)),
    )


@functools.lru_cache(1024)
def _made(portable, single, uniform, width, wanted):
    marks = portable.function.__annotations__
    code = portable.function.__code__
    arguments = tuple(
        Type(KINDS[marks[name]], name not in uniform and KINDS[marks[name]] != "indices")
        for name in code.co_varnames[: code.co_argcount]
    )
    entry = Translator(single).version(portable, arguments, wanted)
    return Lanes(
        entry.name,
        width,
        arguments,
        tuple(entry.results),
        entry.masked,
        _source(entry, single, width),
    )


def _source(entry: Version, single, width):
    versions = needed(entry)
    used = set().union(*(version.mathematics for version in versions))
    parts = [preamble(used, single, width)]
    parts += [f"// {version.where}\n{version.text}" for version in versions]
    body = "\n".join(parts)
    return "struct lanes {\n" + "".join(f"{line}\n" for line in body.splitlines()) + "};\n"
