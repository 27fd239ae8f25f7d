"""Portable functions in C++ over lanes: each function once for each way in which its arguments vary.

`Translator.version` translates a function and all that it calls. Which names vary is found by translating again until
nothing changes: all names begin as the same in all lanes, and each pass finds those that are not.
"""

import ast
import dataclasses
import functools

from fieldsim.errors import PortableError
from fieldsim.portable import rules
from fieldsim.portable.lanes import scopes
from fieldsim.portable.lanes.names import is_taken
from fieldsim.portable.lanes.statements import Statements
from fieldsim.portable.lanes.types import KINDS, Type, Value


@dataclasses.dataclass
class Version:
    """A function for certain types of arguments. results: the types; None for what is not wanted."""

    name: str
    results: list[Type | None]
    masked: bool
    text: str
    where: str
    callees: list["Version"]
    mathematics: set[str]


class Translator:
    """Translates portable functions for one precision. single: float32 instead of float64."""

    def __init__(self, single: bool):
        self.single = single
        self._versions: dict[tuple, Version | None] = {}
        self._names: set[str] = set()
        # Of values within functions, which hide no function's.
        self.values: set[str] = set()

    def version(self, portable, arguments: tuple[Type, ...], wanted: tuple[bool, ...]) -> Version:
        """The function for the given types of arguments, returning what is wanted."""
        key = portable.key, arguments, wanted
        if key not in self._versions:
            self._versions[key] = None
            self._versions[key] = Function(self, portable, arguments, wanted).translated()
        made = self._versions[key]
        if made is None:
            raise _calls_itself(portable)
        return made

    def name_for(self, stem: str) -> str:
        """A name for a version that no other has."""
        stem = stem.strip("_") or "function"
        name, count = stem, 1
        while self.is_known(name) or name in self.values:
            count += 1
            name = f"{stem}_{count}"
        self._names.add(name)
        return name

    def is_known(self, name: str) -> bool:
        """Whether a function has this name."""
        return is_taken(name) or name in self._names


def needed(entry: Version) -> list[Version]:
    """A version and all that it calls, each after those that it calls itself."""
    found: dict[int, Version] = {}

    def visit(version):
        if id(version) not in found:
            for callee in version.callees:
                visit(callee)
            found[id(version)] = version

    visit(entry)
    return list(found.values())


def _calls_itself(portable):
    return PortableError(f"portable function {portable.__module__}.{portable.__qualname__} calls itself; write a loop")


def result_count(portable) -> int:
    """How many values a portable function returns."""
    try:
        return _result_count(portable.key, portable)
    except RecursionError:
        raise _calls_itself(portable) from None


@functools.lru_cache(4096)
def _result_count(_key, portable):
    names = portable._globals()
    for node in ast.walk(rules.definition_of(portable.function)):
        if isinstance(node, ast.Return):
            if isinstance(node.value, ast.Tuple):
                return len(node.value.elts)
            call = node.value
            if isinstance(call, ast.Call) and isinstance(call.func, ast.Name):
                callee = names.get(call.func.id)
                if hasattr(callee, "bindings"):
                    return result_count(callee)
            return 1
    raise PortableError(f"portable function {portable.__module__}.{portable.__qualname__} returns nothing")


class Function(Statements):
    """One function being translated for certain types of arguments."""

    def __init__(self, translator: Translator, portable, arguments: tuple[Type, ...], wanted: tuple[bool, ...]):
        self.translator, self.portable, self.wanted = translator, portable, wanted
        self.single = translator.single
        self.globals = portable.checked()._globals()
        self.tree = rules.definition_of(portable.function)
        self.parameters = dict(zip((a.arg for a in self.tree.args.args), arguments, strict=True))
        self._check_arguments()
        self.locals = frozenset(portable.function.__code__.co_varnames)
        known = scopes.scopes_of(self.tree)
        self.read, self.counters, self.homes, self.loop_of = known.read, known.counters, known.homes, known.loop_of
        self.count = len(wanted)
        self.types = dict(self.parameters)
        self.results = [None] * self.count
        self.breaking, self.continuing = set(), set()
        self.returns_vary = False

    def _check_arguments(self):
        marks = self.portable.function.__annotations__
        for name, kind in self.parameters.items():
            if KINDS[marks[name]] != kind.kind:
                self.refuse(self.tree, f"is given {kind.kind} for its argument {name!r}, which is {KINDS[marks[name]]}")

    def translated(self) -> Version:
        """The version; raises PortableError for what lanes lack."""
        self.changed = True
        while self.changed:
            self.begin()
            self.callees: list[Version] = []
            for name, kind in self.parameters.items():
                if self.types[name] != kind:
                    self.line(f"{self.types[name].cpp} {self.local(name)} = {Value(f'{name}_given', kind).to(True)};")
            self.block(self.tree.body)
        name = self.translator.name_for(self.portable.function.__name__)
        place = (
            f"{self.portable.__module__.replace('.', '/')}.py, line {self.portable.function.__code__.co_firstlineno}"
        )
        return Version(name, self.results, self.masked, self._text(name), place, self.callees, self.used)

    def _text(self, name):
        """The function's definition, preceded by the struct of its results where there are several."""
        arguments = [
            f"{kind.cpp} {self.local(given) if self.types[given] == kind else f'{given}_given'}"
            for given, kind in self.parameters.items()
        ]
        if self.masked:
            arguments.append("Mask live")
        wanted = [(place, kind) for place, kind in enumerate(self.results) if kind is not None]
        struct, returned = "", wanted[0][1].cpp
        if self.count > 1:
            members = " ".join(f"{kind.cpp} r{place};" for place, kind in wanted)
            struct, returned = f"struct {name}_results {{ {members} }};\n", f"{name}_results"
        lines = list(self.lines)
        if self.returns_vary:
            lines.insert(0, f"    {returned} result = {{}};")
        if not isinstance(self.tree.body[-1], ast.Return):
            lines.append("    return result;" if self.returns_vary else "    __builtin_unreachable();")
        return f"{struct}static {returned} {name}({', '.join(arguments)})\n{{\n" + "\n".join(lines) + "\n}\n"

    def is_known(self, name: str) -> bool:
        """Whether a function has this name."""
        return self.translator.is_known(name)

    def fresh(self, stem: str) -> str:
        """A name that nothing else has, in the function or outside of it."""
        name = super().fresh(stem)
        self.translator.values.add(name)
        return name

    def call_for_one(self, node):
        """The value of a call of a portable function that returns one."""
        (value,) = self._call(node, (True,))
        assert value is not None
        return value

    def call_for_many(self, node, wanted):
        """The values of a call of a portable function that returns several; None for what is not wanted."""
        is_call = isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in self.globals
        if not is_call:
            self.refuse(node, f"unpacks {ast.unparse(node)!r}: give a tuple or a call of a portable function")
        return self._call(node, wanted)

    def _call(self, node, wanted) -> list[Value | None]:
        callee = self.globals[node.func.id]
        count = result_count(callee)
        if count != len(wanted):
            self.refuse(node, f"takes {len(wanted)} of the {count} results of {node.func.id}")
        values = [self.value(argument) for argument in node.args]
        version = self.translator.version(callee, tuple(value.type for value in values), wanted)
        self.callees.append(version)
        arguments = [value.text for value in values]
        if version.masked:
            arguments.append(self.mask())
        text = f"{self.called(version.name)}({', '.join(arguments)})"
        if count == 1:
            return [None if kind is None else Value(text, kind) for kind in version.results]
        name = self.fresh(version.name)
        self.line(f"const auto {name} = {text};")
        return [None if kind is None else Value(f"{name}.r{place}", kind) for place, kind in enumerate(version.results)]
