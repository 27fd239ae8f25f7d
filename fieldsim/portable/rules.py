"""What a portable function may contain: the part of Python that Warp and numba compile to the same numbers.

A compiler's own complaint comes late, names generated code, or does not come at all where the targets silently differ
(`real(1.0 / 3.0)` loses half its digits in Warp alone). These rules are read off the source before a compiler sees it.
"""

import ast
import builtins
import functools
import inspect
import math
import textwrap

from fieldsim.errors import PortableError

# Builtins that mean the same to Python, Warp and numba. (float is single precision in Warp; round differs at halves.)
BUILTINS = frozenset({"abs", "bool", "int", "max", "min", "range"})

# Functions of math that both compilers know. (cbrt and exp2 are unknown to numba; log1p, expm1, hypot, ... to Warp.)
MATH = frozenset(
    "acos asin atan atan2 ceil copysign cos cosh degrees erf erfc exp floor isfinite isinf isnan log log10 log2 pow "
    "radians sin sinh sqrt tan tanh trunc".split()
)

_SYNTAX = (
    *(ast.Module, ast.FunctionDef, ast.arguments, ast.arg, ast.Return, ast.Assign, ast.AugAssign, ast.Expr, ast.Pass),
    *(ast.If, ast.For, ast.While, ast.Break, ast.Continue, ast.IfExp, ast.BoolOp, ast.BinOp, ast.UnaryOp, ast.Compare),
    *(ast.Call, ast.Name, ast.Attribute, ast.Subscript, ast.Tuple, ast.Constant, ast.expr_context, ast.boolop),
    *(ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow, ast.USub, ast.UAdd, ast.Not),
    *(ast.Eq, ast.NotEq, ast.Lt, ast.LtE, ast.Gt, ast.GtE),
)
_REMEDIES = {
    ast.ListComp: "write a loop",
    ast.GeneratorExp: "write a loop",
    ast.Mod: "the targets disagree about negative numbers; write x - y * math.floor(x / y)",
    ast.FloorDiv: "the targets disagree about negative numbers; write math.floor(x / y)",
    ast.keyword: "pass arguments by position",
    ast.Import: "import at the module's top",
    ast.ImportFrom: "import at the module's top",
    ast.Raise: "return NaN or inf, and check inputs where they enter",
}


def check(function, names, is_portable, annotations) -> None:
    """Raise PortableError, naming function, line and remedy, if `function` breaks a rule.

    names: its global names as bound; is_portable(value): whether it is a portable function;
    annotations: the marks it may carry.
    """
    definition = definition_of(function)
    if function.__code__.co_freevars:
        raise PortableError(
            f"{_where(function)} captures {sorted(function.__code__.co_freevars)} of the function around it; "
            "make them global names and give them with bind"
        )
    _check_arguments(function, definition.args, annotations)
    visitor = _Rules(function, names, is_portable)
    for statement in definition.body:
        visitor.visit(statement)


@functools.cache
def definition_of(function) -> ast.FunctionDef:
    """The tree of a function; raises PortableError where there is no source, or another one than a definition."""
    try:
        definition = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    except (OSError, SyntaxError):
        raise PortableError(f"{_where(function)} has no source to read; define it with def in a file") from None
    if not isinstance(definition, ast.FunctionDef):
        raise PortableError(f"{_where(function)} is not written with def; portable functions are")
    return definition


def _where(function, line=None):
    place = "" if line is None else f", line {function.__code__.co_firstlineno + line - 1},"
    return f"portable function {function.__module__}.{function.__qualname__}{place}"


def refuse(function, node, what):
    """Raise PortableError: what `function` does at a node of its tree, and the remedy."""
    raise PortableError(f"{_where(function, getattr(node, 'lineno', None))} {what}")


def _check_arguments(function, arguments, annotations):
    if arguments.defaults or arguments.kwonlyargs or arguments.vararg or arguments.kwarg or arguments.posonlyargs:
        raise PortableError(f"{_where(function)} has defaults, * or **; give it plain positional arguments")
    for argument in arguments.args:
        mark = function.__annotations__.get(argument.arg)
        if mark not in annotations:
            marks = ", ".join(a.__name__ if a is not float else "real" for a in annotations)
            raise PortableError(
                f"{_where(function)}: argument {argument.arg!r} has no usable type; give one of: {marks}"
            )


class _Rules(ast.NodeVisitor):
    """Visits a function's tree and refuses the first thing that is not portable."""

    def __init__(self, function, names, is_portable):
        self.function = function
        self.names = names
        self.is_portable = is_portable
        self.locals = frozenset(function.__code__.co_varnames)

    def refuse(self, node, what):
        refuse(self.function, node, what)

    def visit(self, node):
        if isinstance(node, _SYNTAX):
            return super().visit(node)
        thing = type(node).__name__
        text = ast.unparse(node) if isinstance(node, ast.expr | ast.stmt | ast.keyword) else ""
        remedy = _REMEDIES.get(type(node), "Warp and numba have no common meaning for it; see fieldsim.portable")
        return self.refuse(node, f"uses {thing} {text.strip()!r}: {remedy}" if text else f"uses {thing}: {remedy}")

    def visit_BinOp(self, node):
        if not isinstance(node.op, _SYNTAX):
            self.refuse(node, f"uses {ast.unparse(node)!r}: {_REMEDIES.get(type(node.op), 'no target needs it')}")
        self.generic_visit(node)

    def visit_Expr(self, node):
        text = isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        if not text:
            self.generic_visit(node)

    def visit_Constant(self, node):
        if type(node.value) not in (bool, int):
            text = ast.unparse(node)
            remedy = f"write real({text})" if type(node.value) is float else "only numbers are portable"
            self.refuse(node, f"uses the bare literal {text}: {remedy}")

    def visit_Call(self, node):
        """A call; real(...) is where literals and constants become reals."""
        if not (isinstance(node.func, ast.Name) and node.func.id == "real"):
            return self.generic_visit(node)
        if len(node.args) != 1 or node.keywords:
            self.refuse(node, f"uses {ast.unparse(node)!r}: real takes one argument")
        inner = node.args[0]
        if isinstance(inner, ast.UnaryOp):
            inner = inner.operand
        if isinstance(inner, ast.Constant) and type(inner.value) in (int, float):
            return None
        if self._is_number(inner):
            return None
        if isinstance(inner, ast.BinOp) and all(isinstance(n, ast.Constant) for n in (inner.left, inner.right)):
            self.refuse(
                node,
                f"uses {ast.unparse(node)!r}, which Warp rounds to single precision: write real(a) / real(b) or a "
                "module constant",
            )
        return self.visit(inner)

    def visit_Attribute(self, node):
        if not (isinstance(node.value, ast.Name) and self.names.get(node.value.id) is math):
            self.refuse(node, f"uses {ast.unparse(node)!r}: of all modules only math is portable")
        if isinstance(getattr(math, node.attr, None), float):
            self.refuse(node, f"uses the bare constant math.{node.attr}: write real(math.{node.attr})")
        if node.attr not in MATH:
            self.refuse(
                node,
                f"uses math.{node.attr}, which not every target has: write it as a portable function "
                "(see fieldsim.numerics)",
            )

    def visit_Name(self, node):
        name = node.id
        if name in self.locals or name == "real":
            return
        if name not in self.names:
            if name not in BUILTINS:
                kind = "a builtin that the targets lack" if hasattr(builtins, name) else "not defined"
                self.refuse(node, f"uses {name!r}, which is {kind}; builtins that compile: {sorted(BUILTINS)}")
            return
        value = self.names[name]
        if isinstance(value, float):
            self.refuse(node, f"uses the constant {name} bare: write real({name})")
        if not (self.is_portable(value) or isinstance(value, int)):
            self.refuse(
                node,
                f"uses {name!r} ({type(value).__name__}): only numbers, math, real and portable functions compile for "
                "every target; mark it @portable or pass it as an argument",
            )

    def _is_number(self, node):
        """Whether `node` names a numeric constant: THIRD, math.pi."""
        if isinstance(node, ast.Name):
            return node.id not in self.locals and isinstance(self.names.get(node.id), int | float)
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            return self.names.get(node.value.id) is math and isinstance(getattr(math, node.attr, None), float)
        return False
