"""Portable expressions in C++ over lanes: each becomes a text with its type.

What Python evaluates only where it is wanted (the sides of a conditional expression, the right of `and` and `or`) is
evaluated under a mask if it may read a table or call a function, and everywhere if it is plain arithmetic.
"""

import ast
import contextlib
import itertools
import math

from fieldsim.portable.lanes.emitter import Emitter
from fieldsim.portable.lanes.literals import literal
from fieldsim.portable.lanes.types import BOOL, INT, REAL, Type, Value

_ARITHMETIC = {ast.Add: ("+", 7), ast.Sub: ("-", 7), ast.Mult: ("*", 8), ast.Div: ("/", 8)}
_COMPARISONS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
_TESTS = frozenset({"isfinite", "isinf", "isnan"})


class Expressions(Emitter):
    """Emits the expressions of one function."""

    def call_for_one(self, node: ast.Call) -> Value:
        """The value of a call of a portable function that returns one."""
        raise NotImplementedError

    def value(self, node: ast.expr) -> Value:
        """The value of an expression; statements that it needs first are emitted."""
        return getattr(self, f"_value_of_{type(node).__name__.lower()}")(node)

    def truth(self, node: ast.expr) -> Value:
        """The value of a condition."""
        value = self.value(node)
        if value.type.kind == "bool":
            return value
        self.expect(node, value, ("int", "real"))
        zero = self.wide("0", value.type)
        return Value(f"{value.within(6)} != {zero}", BOOL.joined(value.type.varying), 5)

    def expect(self, node, value, kinds):
        """Refuse a value whose kind is none of `kinds`."""
        if value.type.kind not in kinds:
            self.refuse(node, f"uses {ast.unparse(node)!r}, which is {value.type.kind}, as {' or '.join(kinds)}")

    def wide(self, text, kind):
        """A constant in a type."""
        return f"{kind.cpp}({text})" if kind.varying else text

    @contextlib.contextmanager
    def where(self, wanted: Value):
        """Collect what is emitted as it runs where `wanted` holds; `under` then emits it."""
        outer, self.lines = self.lines, []
        self.indent += 1
        if wanted.type.varying:
            self.levels.append(f"({self.mask()} & {wanted.within(9)})")
        collected: list[str] = []
        yield collected
        if wanted.type.varying:
            self.levels.pop()
        self.indent -= 1
        collected += self.lines
        self.lines = outer

    @contextlib.contextmanager
    def under(self, wanted: Value, lines):
        """Emit collected lines, and those of the block, to run where `wanted` holds."""
        test = f"any({self.mask()} & {wanted.within(9)})" if wanted.type.varying else wanted.text
        with self.braces(f"if ({test})"):
            self.lines += lines
            yield

    def _value_of_constant(self, node):
        if isinstance(node.value, bool):
            return Value(str(node.value).lower(), BOOL)
        return Value(str(node.value), INT, 100 if node.value >= 0 else 9)

    def _value_of_name(self, node):
        known = self.type_of(node.id)
        if known is not None:
            return Value(self.local(node.id), known)
        number = self.globals.get(node.id)
        if node.id in self.locals or not isinstance(number, int):
            self.refuse(node, f"reads {node.id!r} before it is assigned a number")
        return self._value_of_constant(ast.Constant(number))

    def _value_of_unaryop(self, node):
        if isinstance(node.op, ast.Not):
            value = self.truth(node.operand)
            return Value(f"{'~' if value.type.varying else '!'}{value.within(9)}", value.type, 9)
        value = self.value(node.operand)
        self.expect(node.operand, value, ("int", "real"))
        if isinstance(node.op, ast.UAdd):
            return value
        inner = value.within(10)
        return Value(f"-{inner}", value.type, 9)

    def _value_of_binop(self, node):
        return self.combined(node, node.op, self.value(node.left), self.value(node.right))

    def combined(self, node, op, left, right):
        """The value of left op right."""
        self.expect(node, left, ("int", "real"))
        self.same_kind(node, (left, right))
        varying = left.type.varying or right.type.varying
        kind = Type(left.type.kind, varying)
        if isinstance(op, ast.Pow):
            self.expect(node, left, ("real",))
            return self.mathematics("pow", (left, right))
        if isinstance(op, ast.Div) and kind.kind == "int":
            self.refuse(node, f"divides integers in {ast.unparse(node)!r}: write real(a) / real(b)")
        sign, binds = _ARITHMETIC[type(op)]
        sides = [left.within(binds), right.within(binds + 1)]
        if kind.kind == "int" and varying:
            sides = [
                text if side.type.varying else side.to(True) for text, side in zip(sides, (left, right), strict=True)
            ]
        return Value(f"{sides[0]} {sign} {sides[1]}", kind, binds)

    def same_kind(self, node, values):
        """Refuse numbers of different kinds together."""
        kinds = {value.type.kind for value in values}
        if len(kinds) > 1:
            self.refuse(node, f"mixes {' and '.join(sorted(kinds))} in {ast.unparse(node)!r}: convert with real or int")

    def _value_of_compare(self, node):
        sides = [self.value(side) for side in (node.left, *node.comparators)]
        self.same_kind(node, sides)
        links = [
            self._link(_COMPARISONS[type(op)], *pair)
            for op, pair in zip(node.ops, itertools.pairwise(sides), strict=True)
        ]
        return self._joined("and", links)

    def _link(self, sign, left, right):
        varying = left.type.varying or right.type.varying
        if left.type.kind == "bool" and varying and sign in ("==", "!="):
            text = f"{left.to(True)} ^ {right.to(True)}"
            return Value(text, BOOL.joined(True), 3) if sign == "!=" else Value(f"~({text})", BOOL.joined(True), 9)
        texts = [side.within(7) if side.type.varying == varying else side.to(varying) for side in (left, right)]
        return Value(f"{texts[0]} {sign} {texts[1]}", BOOL.joined(varying), 5)

    def _joined(self, word, values):
        """Conditions joined by `and` or `or`, all of them evaluated where one varies."""
        if len(values) == 1:
            return values[0]
        if any(value.type.varying for value in values):
            sign, binds = ("&", 4) if word == "and" else ("|", 2)
            texts = [v.within(6) if v.type.varying else v.to(True) for v in values]
            return Value(f" {sign} ".join(texts), BOOL.joined(True), binds)
        sign, binds = ("&&", 1) if word == "and" else ("||", 0)
        return Value(f" {sign} ".join(v.within(binds + 1) for v in values), BOOL, binds)

    def _value_of_boolop(self, node):
        word = "and" if isinstance(node.op, ast.And) else "or"
        whole = self._condition(node.values[0])
        for other in node.values[1:]:
            if not may_fail(other):
                whole = self._joined(word, [whole, self._condition(other)])
                continue
            name = self.fresh(word)
            text = self.hold(whole)
            wanted = Value(text, whole.type) if word == "and" else self._not(Value(text, whole.type))
            with self.where(wanted) as lines:
                value = self._condition(other)
            kind = whole.type.joined(value.type.varying)
            self.line(f"{kind.cpp} {name} = {Value(text, whole.type).to(kind.varying)};")
            sign = "&" if word == "and" else "|"
            with self.under(wanted, lines):
                self.line(f"{name} = {Value(text, whole.type).to(kind.varying)} {sign} {value.to(kind.varying)};")
            whole = Value(name, kind)
        return whole

    def _not(self, value):
        return Value(f"{'~' if value.type.varying else '!'}{value.within(9)}", value.type, 9)

    def _condition(self, node):
        value = self.value(node)
        self.expect(node, value, ("bool",))
        return value

    def _value_of_ifexp(self, node):
        test = self.truth(node.test)
        if not (may_fail(node.body) or may_fail(node.orelse)):
            sides = self.value(node.body), self.value(node.orelse)
            self.same_kind(node, sides)
            varying = any(v.type.varying for v in (test, *sides))
            text = f"{test.within(1)} ? {self._side(sides[0], varying)} : {self._side(sides[1], varying)}"
            return Value(text, Type(sides[0].type.kind, varying), -1)
        return self._chosen(node, test)

    def _side(self, value, varying):
        return value.within(0) if value.type.varying == varying else value.to(varying)

    def _chosen(self, node, test):
        """A conditional expression, its sides evaluated only where wanted."""
        held = Value(self.hold(test), test.type)
        parts = []
        for side, wanted in ((node.body, held), (node.orelse, self._not(held))):
            with self.where(wanted) as lines:
                parts.append((wanted, self.value(side), lines))
        self.same_kind(node, [value for _, value, _ in parts])
        varying = test.type.varying or any(value.type.varying for _, value, _ in parts)
        kind, name = Type(parts[0][1].type.kind, varying), self.fresh("chosen")
        self.line(f"{kind.cpp} {name} = {self.wide('0', kind)};")
        for wanted, value, lines in parts:
            with self.under(wanted, lines):
                text = value.to(varying)
                self.line(f"{name} = {wanted.text} ? {text} : {name};" if test.type.varying else f"{name} = {text};")
        return Value(name, kind)

    def _value_of_subscript(self, node):
        array = node.value.id if isinstance(node.value, ast.Name) else ""
        kind = self.type_of(array)
        if kind is None or kind.kind not in ("table", "indices"):
            self.refuse(node, f"uses {ast.unparse(node)!r}: only a Table or Indices argument has elements")
        places = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        if len(places) != (2 if kind.kind == "table" else 1):
            self.refuse(node, f"uses {ast.unparse(node)!r}: give a Table two indices, and Indices one")
        values = [self.value(place) for place in places]
        for place, value in zip(places, values, strict=True):
            self.expect(place, value, ("int",))
        varying = any(value.type.varying for value in values)
        at = ", ".join(value.to(varying) for value in values)
        text = f"gather({self.local(array)}, {at}, {self.mask()})" if varying else f"{self.local(array)}({at})"
        return Value(text, (REAL if kind.kind == "table" else INT).joined(varying or kind.varying))

    def _value_of_call(self, node):
        if isinstance(node.func, ast.Attribute):
            return self._mathematics_of(node)
        name = node.func.id
        if name == "real":
            return self._real(node.args[0])
        if name in self.globals:
            return self.call_for_one(node)
        return getattr(self, f"_builtin_{name}", self._no_builtin)(node)

    def _no_builtin(self, node):
        self.refuse(node, f"uses {ast.unparse(node)!r} as a value")

    def _mathematics_of(self, node):
        values = [self.value(argument) for argument in node.args]
        for argument, value in zip(node.args, values, strict=True):
            self.expect(argument, value, ("real",))
        return self.mathematics(node.func.attr, values)

    def mathematics(self, name, values):
        """A function of math of some reals."""
        self.used.add(name)
        varying = any(value.type.varying for value in values)
        text = f"{self.called(name)}({', '.join(value.to(varying) for value in values)})"
        return Value(text, (BOOL if name in _TESTS else REAL).joined(varying))

    def _real(self, node):
        """real(...): a literal or constant becomes a number of the scalar's precision, an integer is converted."""
        sign, inner = "", node
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            sign, inner = "-", node.operand
        number = self._number(inner)
        if number is not None:
            text = sign + literal(number, self.single)
            return Value(text, REAL, 9 if text.startswith("-") else 100)
        value = self.value(node)
        if value.type.kind == "real":
            return value
        if value.type.varying:
            self.expect(node, value, ("int",))
            return Value(f"{self.called('to_real')}({value.text})", REAL.joined(True))
        return Value(f"scalar({value.text})", REAL)

    def _number(self, node):
        if isinstance(node, ast.Constant):
            return node.value
        if isinstance(node, ast.Attribute):
            return getattr(math, node.attr)
        if isinstance(node, ast.Name) and node.id not in self.locals:
            return self.globals[node.id]
        return None

    def _one_argument(self, node):
        if len(node.args) != 1:
            self.refuse(node, f"uses {ast.unparse(node)!r}: it takes one argument")
        return self.value(node.args[0])

    def _builtin_int(self, node):
        value = self._one_argument(node)
        if value.type.kind == "int":
            return value
        if not value.type.varying:
            return Value(f"(int)({value.text})", INT, 9)
        name = "to_int" if value.type.kind == "real" else "as_int"
        return Value(f"{self.called(name)}({value.text})", INT.joined(True))

    def _builtin_bool(self, node):
        if len(node.args) != 1:
            self.refuse(node, f"uses {ast.unparse(node)!r}: it takes one argument")
        return self.truth(node.args[0])

    def _builtin_abs(self, node):
        value = self._one_argument(node)
        self.expect(node, value, ("int", "real"))
        return Value(f"{self.called('abs')}({value.text})", value.type)

    def _builtin_min(self, node):
        return self._least("min", node)

    def _builtin_max(self, node):
        return self._least("max", node)

    def _least(self, name, node):
        values = [self.value(argument) for argument in node.args]
        if len(values) < 2:
            self.refuse(node, f"uses {ast.unparse(node)!r}: give two numbers or more")
        self.same_kind(node, values)
        self.expect(node, values[0], ("int", "real"))
        varying = any(value.type.varying for value in values)
        text = values[0].to(varying)
        for value in values[1:]:
            text = f"{self.called(name)}({text}, {value.to(varying)})"
        return Value(text, Type(values[0].type.kind, varying))

    def _value_of_tuple(self, node):
        self.refuse(node, f"uses {ast.unparse(node)!r} as a number")


def may_fail(node: ast.expr) -> bool:
    """Whether an expression may not be evaluated where Python would not: it reads a table or calls a function."""
    return any(
        isinstance(n, ast.Subscript)
        or (isinstance(n, ast.Call) and isinstance(n.func, ast.Name) and n.func.id not in _SAFE)
        for n in ast.walk(node)
    )


_SAFE = frozenset({"real", "int", "bool", "abs", "min", "max"})
