"""Portable statements in C++ over lanes: if-conversion, as in ISPC (Pharr & Mark 2012).

A condition that differs between lanes becomes a mask. A branch runs where any lane needs it, and assignments within it
blend; a loop goes on until no lane is left in it; break, continue and `return` take lanes out of the masks around
them. Conditions that all lanes share stay plain, and so do names that hold the same in all lanes.

A *level* is a mask: `live` for the function's lanes, and one for each branch or loop that only some of these take.
"""

import ast

from fieldsim.portable.lanes import scopes
from fieldsim.portable.lanes.expressions import may_fail
from fieldsim.portable.lanes.loops import Loops
from fieldsim.portable.lanes.types import INT, Type, Value

# A branch of at most so many operations runs whether a lane wants it or not: cheaper than to ask, and to jump.
CHEAP = 4


class Statements(Loops):
    """Emits the statements of one function."""

    wanted: tuple[bool, ...]
    count: int
    read: frozenset[str]
    homes: dict[int, dict[str, bool]]

    def call_for_many(self, node: ast.expr, wanted: tuple[bool, ...]) -> list[Value | None]:
        """The values of a call of a portable function that returns several; None for what is not wanted."""
        raise NotImplementedError

    def block(self, statements):
        """Emit a block; whether lanes of its level may have left it on the way."""
        for name, ahead in self.homes.get(id(statements), {}).items():
            if ahead:
                self._declare(name)
        return self._run(statements)

    def _run(self, statements):
        for place, statement in enumerate(statements):
            if not getattr(self, f"_emit_{type(statement).__name__.lower()}")(statement):
                continue
            if rest := statements[place + 1 :]:
                self._guard(rest)
            return True
        return False

    def _guard(self, rest):
        """Emit what follows a statement at which lanes may have left: for those that are left."""
        if self.levels == ["live"] and self.indent == 1:
            self.line("if (!any(live)) return result;")
            self._run(rest)
            return
        with self.braces(f"if (any({self.mask()}))"):
            self._run(rest)

    def _emit_expr(self, statement):
        return False

    def _emit_pass(self, statement):
        return False

    def _emit_assign(self, statement):
        for target in statement.targets:
            if isinstance(target, ast.Tuple):
                self._unpack(statement, target)
            else:
                self.assign(target, self.value(statement.value))
        return False

    def _unpack(self, statement, target):
        """Assign several names: all values are there before the first is assigned."""
        if isinstance(statement.value, ast.Tuple):
            values = [self.value(part) for part in statement.value.elts]
            written = scopes.names_in([target])
            values = [Value(self.hold(v), v.type) if scopes.names_in([part]) & written else v
                      for part, v in zip(statement.value.elts, values, strict=True)]  # fmt: skip
        else:
            wanted = tuple(isinstance(t, ast.Name) and t.id in self.read for t in target.elts)
            values = self.call_for_many(statement.value, wanted)
        if len(values) != len(target.elts):
            self.refuse(statement, f"assigns {len(values)} values to {len(target.elts)} names")
        for part, value in zip(target.elts, values, strict=True):
            if value is not None:
                self.assign(part, value)

    def _emit_augassign(self, statement):
        if not isinstance(statement.target, ast.Name):
            self.refuse(statement, f"assigns to {ast.unparse(statement.target)!r}: only names can be assigned")
        left = self.value(ast.Name(statement.target.id, ast.Load()))
        self.assign(statement.target, self.combined(statement, statement.op, left, self.value(statement.value)))
        return False

    def assign(self, target, value):
        """Assign a value to a name: for all lanes of its level, or blended with what the other lanes hold."""
        if not isinstance(target, ast.Name):
            self.refuse(target, f"assigns to {ast.unparse(target)!r}: only names can be assigned")
        name, present = target.id, self.levels[-1]
        blended = self.declared.get(name, present) != present
        kind = self.types.get(name)
        if kind is None or kind.kind != value.type.kind:
            if kind is not None:
                self.refuse(target, f"assigns {value.type.kind} to {name!r}, which is {kind.kind}")
            kind = value.type
        wanted = kind.joined(value.type.varying or blended)
        if self.types.get(name) != wanted:
            self.types[name] = wanted
            self.changed = True
        text = value.to(wanted.varying)
        if name not in self.declared:
            self.declared[name] = present
            self.line(f"{wanted.cpp} {self.local(name)} = {text};")
        elif blended:
            self.line(f"{self.local(name)} = {self.mask()} ? {self._side(value, True)} : {self.local(name)};")
        else:
            self.line(f"{self.local(name)} = {text};")

    def _declare(self, name):
        """Declare a name ahead of the branches or loops that assign it."""
        self.declared[name] = self.levels[-1]
        kind = self.types.get(name, INT)
        zero = {"real": "0", "int": "0", "bool": "false"}[kind.kind]
        self.line(f"{kind.cpp} {self.local(name)} = {Value(zero, Type(kind.kind)).to(kind.varying)};")

    def _emit_if(self, statement):
        test = self.truth(statement.test)
        if test.type.varying:
            return self._branches(statement, test)
        with self.braces(f"if ({test.text})"):
            left = self.block(statement.body)
        if statement.orelse:
            self.lines.pop()
            with self.braces("} else"):
                left = self.block(statement.orelse) or left
        return left

    def _branches(self, statement, test):
        """Both branches of a condition that varies, each under its mask."""
        left = False
        if statement.orelse:
            test = Value(self.hold(test), test.type)
        parts = [(statement.body, test)] + ([(statement.orelse, self._not(test))] if statement.orelse else [])
        for body, wanted in parts:
            left = self._branch(body, wanted) or left
        return left

    def _branch(self, body, wanted):
        name = self.fresh("if")
        present = self.levels[-1]
        cheap = is_cheap(body)
        alone = cheap and all(self.declared.get(n) == present for n in scopes.names_in(_targets(body)))
        self.line(f"const Mask {name} = {wanted.text};" if alone else
                  f"{'const ' * cheap}Mask {name} = {self.mask()} & {wanted.within(6)};")  # fmt: skip
        self.levels.append(name)
        if cheap:
            left = self.block(body)
        else:
            with self.braces(f"if (any({name}))"):
                left = self.block(body)
        self.levels.pop()
        return left

    def _emit_return(self, statement):
        values = self._returned(statement)
        present = self.levels[-1]
        if present != "live":
            self.returns += 1
            self.changed = self.changed or not self.returns_vary
            self.returns_vary = True
        wanted = [(place, value) for place, value in enumerate(values) if value is not None]
        kinds = [self._note_result(statement, *one) for one in wanted]
        if not self.returns_vary:
            texts = [value.to(kind.varying) for kind, (_place, value) in zip(kinds, wanted, strict=True)]
            self.line(f"return {texts[0]};" if self.count == 1 else f"return {{{', '.join(texts)}}};")
            return False
        for place, value in wanted:
            kept = "result" if self.count == 1 else f"result.r{place}"
            self.line(f"{kept} = {self.mask()} ? {self._side(value, True)} : {kept};")
        if present == "live":
            self.line("return result;")
            return False
        self._take_out(self.levels)
        return True

    def _returned(self, statement):
        """The values of a return statement; None for those that nobody wants."""
        node = statement.value
        if isinstance(node, ast.Tuple):
            return [self.value(part) if wanted else None for part, wanted in zip(node.elts, self.wanted, strict=True)]
        if self.count > 1:
            return self.call_for_many(node, self.wanted)
        if node is None:
            self.refuse(statement, "returns nothing")
        return [self.value(node)]

    def _note_result(self, statement, place, value):
        known = self.results[place] or value.type
        if known.kind != value.type.kind:
            self.refuse(statement, f"returns {value.type.kind} where it returns {known.kind} elsewhere")
        kind = known.joined(value.type.varying or self.returns_vary)
        self.changed = self.changed or self.results[place] != kind
        self.results[place] = kind
        return kind


def is_cheap(body) -> bool:
    """Whether a branch is a few assignments of plain arithmetic, that all lanes may do."""
    cost = 0
    for statement in body:
        if not isinstance(statement, ast.Assign | ast.AugAssign) or may_fail(statement.value):
            return False
        for node in ast.walk(statement):
            if isinstance(node, ast.Call) and not (isinstance(node.func, ast.Name) and node.func.id in _FREE):
                return False
            cost += isinstance(node, ast.BinOp | ast.Compare | ast.IfExp | ast.AugAssign)
            cost += CHEAP * isinstance(node, ast.Div)
        cost += isinstance(statement, ast.Assign)
    return cost <= CHEAP


_FREE = frozenset({"real", "abs", "min", "max"})


def _targets(body):
    return [part for s in body for part in (s.targets if isinstance(s, ast.Assign) else [s.target])]
