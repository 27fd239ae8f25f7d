"""Portable loops in C++ over lanes: a loop goes on until no lane is left in it.

`break` and `continue` of all lanes stay what they are; those of some lanes take these out of the masks of the loop, or
of its present turn.
"""

import ast

from fieldsim.portable.lanes.emitter import Loop
from fieldsim.portable.lanes.expressions import Expressions
from fieldsim.portable.lanes.types import INT, Type, Value


class Loops(Expressions):
    """Emits the loops of one function."""

    counters: frozenset[str]
    loop_of: dict[ast.stmt, ast.stmt]

    def block(self, statements: list[ast.stmt]) -> bool:
        """Emit a block; whether lanes of its level may have left it on the way."""
        raise NotImplementedError

    def assign(self, target: ast.expr, value: Value) -> None:
        """Assign a value to a name."""
        raise NotImplementedError

    def _emit_while(self, statement):
        self._refuse_else(statement)
        before, test = self._test_of(statement, None)
        own = self.fresh("loop") if test.type.varying or statement in self.breaking else None
        if own:
            # Lanes that have left are asked no more: what they hold may be no place in a table.
            before, test = self._test_of(statement, own)
        head = "while (true)" if before or test.type.varying else f"while ({test.text}"
        return self._loop(statement, head, before, test, [], own)

    def _test_of(self, statement, level):
        """(lines that its test needs, the test) of a while loop, evaluated for the lanes of a level."""
        outer, self.lines = self.lines, []
        self.indent += 1
        self.levels += [level] if level else []
        test = self.truth(statement.test)
        self.levels = self.levels[:-1] if level else self.levels
        self.indent -= 1
        before, self.lines = self.lines, outer
        return before, test

    def _emit_for(self, statement):
        self._refuse_else(statement)
        low, high, step = self._bounds(statement)
        if not high.text.lstrip("-").isdigit():
            high = Value(self.hold(high), high.type)
        name = statement.target.id
        known = name in self.counters
        counter = self.local(name) if known else self.fresh(name)
        if known:
            # Of this loop alone: others declare the name anew.
            self.types[name] = INT.joined(low.type.varying)
        start = f"{INT.joined(low.type.varying).cpp} {counter} = {low.text}"
        varying = low.type.varying or high.type.varying
        sides = [Value(counter, low.type).to(varying), high.to(varying)]
        test = Value(f"{sides[0]} {'<' if step > 0 else '>'} {sides[1]}", Type("bool", varying), 5)
        further = {1: f"++{counter}", -1: f"--{counter}"}.get(step, f"{counter} += {step}")
        if low.type.varying:
            further = f"{counter} += {step}"
        first = [] if known else [(statement.target, Value(counter, low.type))]
        head = f"for ({start}; {'' if varying else test.text}"
        own = self.fresh("loop") if varying or statement in self.breaking else None
        return self._loop(statement, head, [], test, first, own, f"; {further}")

    def _bounds(self, statement):
        """(first, end, step) of a range, the step a number."""
        call = statement.iter
        if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range"):
            self.refuse(statement, f"loops over {ast.unparse(call)!r}: loop over range(...)")
        if not isinstance(statement.target, ast.Name):
            self.refuse(statement, "unpacks a loop's counter: give it one name")
        values = [self.value(argument) for argument in call.args]
        for argument, value in zip(call.args, values, strict=True):
            self.expect(argument, value, ("int",))
        step = values[2].text if len(values) == 3 else "1"
        if not step.lstrip("-").isdigit() or int(step) == 0:
            self.refuse(statement, f"steps by {step!r}: give a whole number, not 0")
        low, high = (Value("0", INT), values[0]) if len(values) == 1 else values[:2]
        return low, high, int(step)

    def _loop(self, statement, head, before, test, first, own, further=""):
        """Emit a loop. head: `for (...; test` or `while (test`; before: lines of the test; first: assignments.

        own: the level of the lanes still in it, None where they all stay or leave together.
        """
        around = self.levels[-1]
        turn = self.fresh("turn") if statement in self.continuing else None
        if own:
            self.line(f"Mask {own} = {self.mask()};")
            self.levels.append(own)
        returns = self.returns
        outer, self.lines = self.lines, []
        self.indent += 1
        self.lines += before
        if test.type.varying:
            self.line(f"{own} &= {test.text};")
            self.line(f"if (!any({own})) break;")
        elif before:
            self.line(f"if (!({test.text})) break;")
        if turn:
            self.line(f"Mask {turn} = {self.levels[-1]};")
            self.levels.append(turn)
        self.loops.append(Loop(own, turn, self.levels[-1]))
        for target, value in first:
            self.assign(target, value)
        self.block(statement.body)
        self.loops.pop()
        self.indent -= 1
        body, self.lines = self.lines, outer
        returned = self.returns > returns
        while self.levels[-1] != around:
            self.levels.pop()
        asked = own or (around if returned else None)
        if asked and not test.type.varying:
            self.masked = True
            if before:
                body.insert(0, "    " * (self.indent + 1) + f"if (!any({asked})) break;")
            else:
                head += f" && any({asked})"
        self.line(f"{head}{further}{'' if head.endswith('while (true)') else ')'} {{")
        self.lines += body
        self.line("}")
        return returned

    def _refuse_else(self, statement):
        if statement.orelse:
            self.refuse(statement, "has a loop with else: set a name in the loop, and ask it after")

    def _emit_break(self, statement):
        loop, present = self.loops[-1], self.levels[-1]
        if present == loop.body and not loop.turn:
            self.line("break;")
            return False
        return self._leave(loop.own, self.breaking, statement)

    def _emit_continue(self, statement):
        loop = self.loops[-1]
        if self.levels[-1] == loop.body:
            self.line("continue;")
            return False
        return self._leave(loop.turn, self.continuing, statement)

    def _leave(self, level, noted, statement):
        """Take the present lanes out of the levels from `level` on; one that is missing is made in the next pass."""
        if level is None:
            noted.add(self.loop_of[statement])
            self.changed = True
            return True
        self._take_out(self.levels[self.levels.index(level) :])
        return True

    def _take_out(self, levels):
        present = self.mask()
        for level in levels[:-1]:
            self.line(f"{level} &= ~{present};")
