"""Where a function's local names are declared: in the smallest block in which all of their life passes.

A name that lives within a branch or within one turn of a loop needs no blending with what other lanes hold.
"""

import ast
import dataclasses
import functools


def blocks_of(statement) -> list[list[ast.stmt]]:
    """The blocks of statements within a compound statement."""
    if isinstance(statement, ast.If):
        return [statement.body, statement.orelse] if statement.orelse else [statement.body]
    return [statement.body] if isinstance(statement, ast.For | ast.While) else []


def head_of(statement) -> list[ast.AST]:
    """What a statement evaluates or assigns itself, outside of its blocks."""
    if isinstance(statement, ast.If | ast.While):
        return [statement.test]
    return [statement.iter, statement.target] if isinstance(statement, ast.For) else [statement]


@functools.cache
def _names(tree):
    """The names that stand in a tree, with how often each is read."""
    names = [node for node in ast.walk(tree) if isinstance(node, ast.Name)]
    reads = dict.fromkeys((node.id for node in names), 0)
    for node in names:
        reads[node.id] += isinstance(node.ctx, ast.Load)
    return reads


def names_in(nodes) -> set[str]:
    """All names that stand in some trees."""
    return set().union(*(_names(tree) for tree in nodes))


def _home_of(name: str, body: list[ast.stmt]) -> list[ast.stmt]:
    """The smallest block in which a local name is always assigned before it is read; else the whole body."""
    block = body
    while True:
        users = [s for s in block if name in _names(s)]
        if len(users) != 1 or name in names_in(head_of(users[0])):
            return block
        inner = [part for part in blocks_of(users[0]) if name in names_in(part)]
        if len(inner) != 1 or not _is_assigned_first(name, inner[0], False)[0]:
            return block
        block = inner[0]


def _begins_with_assignment(name, block):
    """Whether a statement of a block declares a name by assigning it, before a branch or a loop has it."""
    first = next(statement for statement in block if name in _names(statement))
    return isinstance(first, ast.Assign) and name not in _names(first.value)


@dataclasses.dataclass(frozen=True)
class Scopes:
    """What a function's tree says of its names and loops.

    read: the names that are read; counters: those that are only counters of loops, assigned nowhere else and read only
    within them; homes: by the identity of a block, the names that are declared in it, and whether ahead of
    all else; loop_of: the loop that a break or
    a continue belongs to.
    """

    read: frozenset[str]
    counters: frozenset[str]
    homes: dict[int, dict[str, bool]]
    loop_of: dict[ast.stmt, ast.stmt]


@functools.cache
def scopes_of(tree: ast.FunctionDef) -> Scopes:
    """The scopes of a function."""
    walked = [node for statement in tree.body for node in ast.walk(statement)]
    augmented = {n.target.id for n in walked if isinstance(n, ast.AugAssign) and isinstance(n.target, ast.Name)}
    names = [node for node in walked if isinstance(node, ast.Name)]
    assigned = {n.id for n in names if isinstance(n.ctx, ast.Store)} - {a.arg for a in tree.args.args}
    loops = [node for node in walked if isinstance(node, ast.For | ast.While)]
    counters = {name for name in assigned if _is_counter(name, names, loops)}
    homes: dict[int, dict[str, bool]] = {}
    for name in sorted(assigned - counters):
        home = _home_of(name, tree.body)
        homes.setdefault(id(home), {})[name] = not _begins_with_assignment(name, home)
    # Loops within loops come later, and have the last word.
    loop_of: dict[ast.stmt, ast.stmt] = {
        n: loop for loop in loops for n in ast.walk(loop) if isinstance(n, ast.Break | ast.Continue)
    }
    read = frozenset(n.id for n in names if isinstance(n.ctx, ast.Load))
    return Scopes(read | augmented, frozenset(counters), homes, loop_of)


def _is_counter(name, names, loops):
    within = 0
    for loop in loops:
        if isinstance(loop, ast.For) and isinstance(loop.target, ast.Name) and loop.target.id == name:
            within += 1 + sum(_reads(name, s) for s in loop.body)
    return within == sum(node.id == name for node in names)


def _reads(name, tree):
    return _names(tree).get(name, 0)


def _is_assigned_first(name, block, assigned):
    """(whether no read comes before an assignment, whether the name is assigned at the end of the block)."""
    for statement in block:
        if not assigned and any(_reads(name, part) for part in _evaluated(statement, name)):
            return False, False
        if isinstance(statement, ast.Return | ast.Break | ast.Continue):
            return True, True
        if isinstance(statement, ast.If):
            first, after = _is_assigned_first(name, statement.body, assigned)
            second, other = _is_assigned_first(name, statement.orelse, assigned)
            if not (first and second):
                return False, False
            assigned = after and other
        elif isinstance(statement, ast.For | ast.While):
            within = assigned or (isinstance(statement, ast.For) and name in names_in([statement.target]))
            if not _is_assigned_first(name, statement.body, within)[0]:
                return False, False
        elif isinstance(statement, ast.Assign):
            assigned = assigned or name in names_in(statement.targets)
    return True, assigned


def _evaluated(statement, name):
    """The parts of a statement that are evaluated before it assigns."""
    if isinstance(statement, ast.AugAssign):
        target = (
            ast.Name(statement.target.id, ast.Load()) if isinstance(statement.target, ast.Name) else statement.target
        )
        return [statement.value, target]
    return head_of(statement)
