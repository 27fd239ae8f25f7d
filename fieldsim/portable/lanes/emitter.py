"""What is being emitted of one function: its lines, the names in them, and the masks of its lanes."""

import ast
import contextlib
import dataclasses
from typing import Any, NoReturn

from fieldsim.portable import rules
from fieldsim.portable.lanes.names import is_reserved
from fieldsim.portable.lanes.types import Type, Value


@dataclasses.dataclass(frozen=True)
class Loop:
    """A loop around the statement at work, by its levels.

    own: the lanes that are still in the loop, turn: those still in this turn of it, both None where no lane leaves by
    itself; body: the level of its block.
    """

    own: str | None
    turn: str | None
    body: str


class Emitter:
    """The state of one function being translated; subclasses emit expressions, loops and statements.

    A *level* is a mask: `live` for the function's lanes, and one for each branch or loop that only some of these take.
    """

    portable: Any
    tree: ast.FunctionDef
    single: bool
    globals: dict[str, Any]
    locals: frozenset[str]
    parameters: dict[str, Type]
    # What passes find out: the types of names and results, loops that lanes leave or cut short one by one, and whether
    # lanes return one by one.
    types: dict[str, Type]
    results: list[Type | None]
    breaking: set[ast.stmt]
    continuing: set[ast.stmt]
    returns_vary: bool

    def begin(self) -> None:
        """Begin a pass."""
        self.changed = self.masked = False
        self.lines: list[str] = []
        self.indent = 1
        self.levels = ["live"]
        self.loops: list[Loop] = []
        self.returns = 0
        self.numbers: dict[str, int] = {}
        self.declared = dict.fromkeys(self.parameters, "live")
        self.used: set[str] = set()

    def line(self, text: str) -> None:
        """Emit a line."""
        self.lines.append("    " * self.indent + text)

    @contextlib.contextmanager
    def braces(self, head: str, tail: str = ""):
        """A block in braces after `head`."""
        self.line(f"{head} {{".lstrip())
        self.indent += 1
        yield
        self.indent -= 1
        self.line("}" + tail)

    def mask(self) -> str:
        """The mask of the present level."""
        self.masked = True
        return self.levels[-1]

    def hold(self, value: Value) -> str:
        """A value by a name, so that it is evaluated once."""
        if value.text.isidentifier() and value.text.rstrip("_") not in self.locals:
            return value.text
        name = self.fresh("test")
        self.line(f"const {value.type.cpp} {name} = {value.text};")
        return name

    def refuse(self, node: ast.AST, what: str) -> NoReturn:
        """Raise PortableError at a node."""
        rules.refuse(self.portable.function, node, what)

    def type_of(self, name: str) -> Type | None:
        """The type of an argument or local name; None where it is none, or unknown yet."""
        return self.types.get(name)

    def local(self, name: str) -> str:
        """A local name in C++."""
        return f"{name}_" if is_reserved(name) else name

    def is_known(self, name: str) -> bool:
        """Whether a function has this name."""
        raise NotImplementedError

    def fresh(self, stem: str) -> str:
        """A name that nothing else in the function has."""
        while True:
            self.numbers[stem] = self.numbers.get(stem, 0) + 1
            name = f"{stem}_{self.numbers[stem]}"
            if name not in self.locals and not self.is_known(name):
                return name

    def called(self, name: str) -> str:
        """The C++ name of a function, told from a local name that hides it."""
        return f"lanes::{name}" if name in self.locals else name
