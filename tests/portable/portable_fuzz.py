"""Random portable functions: every construct, nested in each other, of numbers on which all arithmetic is exact.

Reals are small multiples of powers of two and are only added, subtracted and multiplied by powers of two, so that every
target must give the same numbers, bit for bit, and the same branches. Loops end after a few turns.
"""

import random

HEADER = """
import math

from fieldsim.portable import Indices, Table, portable, real


@portable
def stairs(x: real, n: int):
    total = real(0.0)
    for k in range(n):
        if x < real(k):
            return total
        total += real(0.5)
        if k == 3:
            break
    return total - x


@portable
def shifted(x: real, y: real, far: bool):
    if far and x > y:
        return x - y, y, True
    z = y if x < y else -x
    return z, x, x == y


"""
REALS, WHOLES, FLAGS = ("x", "y", "u", "v"), ("n", "m", "k"), ("p", "q")


class Writer:
    """Writes one function. seed: of its choices."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        self.lines, self.fuel, self.counters = [], 0, []
        self.loops = 0

    def pick(self, *choices):
        return self.random.choice(choices)

    def real(self, depth=2):
        if depth == 0 or self.random.random() < 0.2:
            return self.pick(*REALS, *REALS, f"real({self.pick(0.5, 1.0, -2.0, 3.0, 0.0)})", "rows[n, 1]")
        a, b = self.real(depth - 1), self.real(depth - 1)
        return self.pick(
            f"({a} + {b})",
            f"({a} - {b})",
            f"{self.pick('real(0.5)', 'real(2.0)', '-real(1.0)')} * {a}",
            f"-{a}",
            f"abs({a})",
            f"min({a}, {b})",
            f"max({a}, {b}, {self.real(0)})",
            f"({a} if {self.flag(depth - 1)} else {b})",
            f"real({self.pick('n', 'm + 1', '-n', *self.counters)})",
            f"stairs({a}, {self.whole(0)})",
            f"math.floor({a})",
            f"rows[{self.place()}, {self.place()}]",
        )

    def place(self):
        """An index of the table, in 0..3."""
        return self.pick("0", "1", "2", "3", "n", "m", "kinds[n]", "kinds[m]", "min(n, kinds[2])")

    def whole(self, depth=2):
        if depth == 0 or self.random.random() < 0.25:
            return self.pick("n", "m", *self.counters, str(self.random.randrange(4)))
        a, b = self.whole(depth - 1), self.whole(depth - 1)
        return self.pick(
            f"({a} + {b})",
            f"({a} - {b})",
            f"abs({a})",
            f"min({a}, {b})",
            f"max({a}, {b})",
            f"-{a}",
            f"int({self.pick(*REALS)})",
            f"kinds[{self.place()}]",
            f"({a} if {self.flag(depth - 1)} else {b})",
        )

    def flag(self, depth=2):
        if depth == 0 or self.random.random() < 0.2:
            return self.pick("p", "q", f"{self.pick(*REALS)} < {self.pick(*REALS)}")
        sign = self.pick("<", "<=", ">", ">=", "==", "!=")
        return self.pick(
            f"({self.real(depth - 1)} {sign} {self.real(depth - 1)})",
            f"({self.whole(depth - 1)} {sign} {self.whole(depth - 1)})",
            f"({self.real(0)} <= {self.real(0)} < {self.real(0)})",
            f"({self.flag(depth - 1)} and {self.flag(depth - 1)})",
            f"({self.flag(depth - 1)} or {self.flag(depth - 1)})",
            f"(not {self.flag(depth - 1)})",
        )

    def line(self, indent, text):
        self.lines.append("    " * indent + text)

    def statement(self, indent, depth):
        kind = self.random.random()
        if kind < 0.3:
            name = self.pick(*REALS)
            self.line(indent, f"{name} {self.pick('=', '=', '+=', '-=')} {self.real()}")
            # Small again, so that all stays exact.
            self.line(indent, f"{name} = min(max({name}, -real(64.0)), real(64.0))")
        elif kind < 0.4:
            name = self.pick("n", "m")
            self.line(indent, f"{name} = min(max({self.whole()}, 0), 3)")
        elif kind < 0.5:
            self.line(indent, f"{self.pick(*FLAGS)} = {self.flag()}")
        elif kind < 0.56:
            self.line(
                indent, self.pick("x, u = u, x", "n, m = m, n", "u, v = v + real(0.5), u", "y, x, p = shifted(x, v, q)")
            )
        elif kind < 0.62 and self.loops:
            self.line(indent, f"if {self.flag()}:")
            self.line(indent + 1, self.pick("break", "continue"))
        elif kind < 0.67:
            self.line(indent, f"if {self.flag()}:")
            self.line(indent + 1, f"return {self.real()}, {self.whole(1)}, {self.pick(*FLAGS)}")
        elif depth == 0:
            self.line(indent, f"v = {self.real()}")
            self.line(indent, "v = min(max(v, -real(64.0)), real(64.0))")
        elif kind < 0.8:
            self.line(indent, f"if {self.flag()}:")
            self.block(indent + 1, depth - 1)
            if self.random.random() < 0.4:
                self.line(indent, f"elif {self.flag()}:")
                self.block(indent + 1, depth - 1)
            if self.random.random() < 0.5:
                self.line(indent, "else:")
                self.block(indent + 1, depth - 1)
        elif kind < 0.9:
            self.loop_for(indent, depth)
        else:
            self.loop_while(indent, depth)

    def loop_for(self, indent, depth):
        counter = f"k{len(self.counters)}"
        ends = self.pick("n", "3", "1, m", "m, 4", "3, -1, -1", "n, 5, 2", "kinds[n]")
        self.line(indent, f"for {counter} in range({ends}):")
        self.counters.append(counter)
        self.loops += 1
        self.block(indent + 1, depth - 1)
        self.loops -= 1
        self.counters.pop()

    def loop_while(self, indent, depth):
        self.fuel += 1
        left = f"fuel{self.fuel}"
        self.line(indent, f"{left} = 0")
        self.line(indent, f"while {self.flag()} and {left} < {self.pick('3', '4', 'n + 1')}:")
        self.line(indent + 1, f"{left} += 1")
        self.loops += 1
        self.block(indent + 1, depth - 1)
        self.loops -= 1

    def block(self, indent, depth):
        for _ in range(self.random.randint(1, 3)):
            self.statement(indent, depth)

    def function(self, name):
        """The text of a function of (x, y, n, m, rows, kinds) that returns a real, a whole number and a flag."""
        self.line(0, "@portable")
        self.line(0, f"def {name}(x: real, y: real, n: int, m: int, rows: Table, kinds: Indices):")
        for text in ("u = x", "v = real(1.0)", "p = x < y", "q = n == m"):
            self.line(1, text)
        for _ in range(self.random.randint(4, 7)):
            self.statement(1, 3)
        self.line(1, f"return {self.real()}, {self.whole(1)}, {self.flag(1)}")
        return "\n".join(self.lines) + "\n\n\n"


def module(seeds) -> str:
    """The text of a module with a function for each seed, and `all_of` that adds up what each returns."""
    text = HEADER + "".join(Writer(seed).function(f"f{seed}") for seed in seeds)
    for seed in seeds:
        text += f"""
@portable
def g{seed}(x: real, y: real, n: int, m: int, rows: Table, kinds: Indices):
    a, b, c = f{seed}(x, y, n, m, rows, kinds)
    return a + real(256.0) * real(b) + (real(4096.0) if c else real(0.0))


"""
    calls = ", ".join(f"g{seed}(x, y, n, m, rows, kinds)" for seed in seeds)
    return text + (
        f"@portable\ndef all_of(x: real, y: real, n: int, m: int, rows: Table, kinds: Indices):\n    return ({calls})\n"
    )
