"""Counts of the house: sizes, names, types, duplicates and imports of fieldsim's source, at any revision.

    python tools/house_counts.py                  of the files as they are
    python tools/house_counts.py --rev v0.1.0     of a revision
    python tools/house_counts.py --details 10     with the ten worst places of each figure

It imports nothing of the package. What is counted, and how:

- cyclomatic: McCabe's number, 1 + the branches of a function and of those within it, as ruff's C901 counts; and "with
  expressions", where `and`, `or`, conditional expressions and comprehensions count, and inner functions by themselves.
- literal columns: `row[14]`, `row[14:17]`, `rows[i, 14]`, also in C++ strings.
- annotated arguments: of all functions, and of the functions, classes and public methods that `fieldsim` exports.
- names defined in two or more modules: functions, classes and constants at the top of modules.
- private accesses: `x._name` in tests, where the package defines `_name`; not those on `self`.
- near-duplicates: pairs of runs of lines of one shape, see `near_duplicates`.
- arrows: from a folder to another that one of its modules imports from; a circle is a set of parts (the folders and
  modules directly in the package) or of modules that import each other, be it within a function.
"""

import argparse
import ast
import collections
import dataclasses
import io
import pathlib
import re
import subprocess
import tarfile
import tempfile

from import_graph import circles, folder_arrows, graph_of, module_of, parts_of
from near_duplicates import RUN, near_duplicates

ROOT = pathlib.Path(__file__).parents[1]
LONG_FILE, LONG_FUNCTION, COMPLEX = 400, 80, 15
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
BRANCHES = (ast.If, ast.For, ast.AsyncFor, ast.While, ast.ExceptHandler, ast.match_case)


@dataclasses.dataclass(frozen=True)
class Source:
    """A file of Python: its path below the root, its text and its syntax tree."""

    path: str
    text: str
    tree: ast.Module

    @property
    def module(self):
        """Its dotted name."""
        return module_of(self.path)

    def functions(self):
        """All functions in it, inner ones too."""
        return (node for node in ast.walk(self.tree) if isinstance(node, FUNCTIONS))


@dataclasses.dataclass(frozen=True)
class Figure:
    """A line of the table; places: what it counts, the worst first."""

    name: str
    value: str
    places: list


def sources(root, folder):
    """The sources below a folder, in order."""
    for path in sorted((root / folder).rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        yield Source(str(path.relative_to(root)), text, ast.parse(text))


# Sizes


def long_files(name, files):
    """Files of too many lines."""
    sizes = sorted(((s.text.count("\n"), s.path) for s in files), reverse=True)
    long = [f"{lines} {path}" for lines, path in sizes if lines > LONG_FILE]
    return Figure(f"files of {name}, over {LONG_FILE} lines", f"{len(sizes)}, {len(long)}", long)


def over(name, files, measure, limit):
    """Functions of which a measure is over its limit."""
    found = [(measure(node), f"{s.path}:{node.lineno} {node.name}") for s in files for node in s.functions()]
    worst = [f"{number} {where}" for number, where in sorted(found, reverse=True) if number > limit]
    return Figure(f"{name} over {limit}", f"{len(worst)} of {len(found)}", worst)


def length(function):
    """Lines of a function."""
    return function.end_lineno - function.lineno + 1


def mccabe(function):
    """McCabe's number of a function, those within it included."""
    number = 1 + sum(isinstance(node, (*BRANCHES, *FUNCTIONS)) for node in ast.walk(function) if node is not function)
    blocks = [node for node in ast.walk(function) if isinstance(node, ast.Try | ast.For | ast.While)]
    return number + sum(bool(block.orelse) for block in blocks)


def with_expressions(function):
    """Branches of a function by itself, those of expressions included."""
    number, todo = 1, list(ast.iter_child_nodes(function))
    while todo:
        node = todo.pop()
        if isinstance(node, (*FUNCTIONS, ast.Lambda)):
            continue
        number += isinstance(node, (*BRANCHES, ast.IfExp))
        number += len(node.values) - 1 if isinstance(node, ast.BoolOp) else 0
        number += 1 + len(node.ifs) if isinstance(node, ast.comprehension) else 0
        todo += ast.iter_child_nodes(node)
    return number


# Literals, silenced checks, annotations


def literal_columns(files):
    """Columns of rows by number."""
    found = []
    for source in files:
        for node in ast.walk(source.tree):
            if isinstance(node, ast.Subscript) and _is_literal_column(node):
                found.append(f"{source.path}:{node.lineno} {ast.unparse(node)}")
            elif isinstance(node, ast.Constant) and isinstance(node.value, str) and ";" in node.value:
                found += [f"{source.path}:{node.lineno} {text}" for text in re.findall(r"\brow\[\d+\]", node.value)]
    return Figure("literal row columns", str(len(found)), found)


def _is_literal_column(node):
    name = getattr(node.value, "id", getattr(node.value, "attr", ""))
    if name not in ("row", "rows"):
        return False
    column = node.slice.elts[-1] if isinstance(node.slice, ast.Tuple) else node.slice if name == "row" else None
    ends = (column.lower, column.upper) if isinstance(column, ast.Slice) else (column,)
    return any(isinstance(end, ast.Constant) and isinstance(end.value, int) for end in ends)


def silenced(files):
    """Lines on which a check is switched off."""
    found = [f"{s.path} {m[0]}" for s in files for m in re.finditer(r"# noqa\b[^\n]*", s.text)]
    undefined = [where for where in found if "F821" in where]
    return Figure("noqa, of them F821 (undefined name)", f"{len(found)}, {len(undefined)}", undefined or found)


def annotated(name, functions):
    """The share of annotated arguments."""
    total, bare = 0, []
    for where, function in functions:
        given = function.args
        every = [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]
        arguments = [a for a in every if a is not None and a.arg not in ("self", "cls")]
        total += len(arguments)
        bare += [f"{where} {function.name}({a.arg})" for a in arguments if a.annotation is None]
    share = 100 * (total - len(bare)) / max(total, 1)
    return Figure(f"annotated arguments of {name}", f"{share:.0f} % of {total}", bare)


def exported(files):
    """The functions and public methods of what the package's `__init__` imports from itself."""
    known = {source.module: source for source in files}

    def follow(module, name):
        source = None if f"{module}.{name}" in known else known.get(module)
        for node in source.tree.body if source else ():
            if isinstance(node, ast.ClassDef) and node.name == name:
                methods = (m for m in node.body if isinstance(m, FUNCTIONS))
                return [(source.path, m) for m in methods if m.name[0] != "_" or m.name in ("__init__", "__call__")]
            if isinstance(node, FUNCTIONS) and node.name == name:
                return [(source.path, node)]
            for alias in node.names if isinstance(node, ast.ImportFrom) else ():
                if (alias.asname or alias.name) == name:
                    return follow(node.module, alias.name)
        return []

    package = known["fieldsim"]
    imports = [node for node in package.tree.body if isinstance(node, ast.ImportFrom)]
    return [found for node in imports for alias in node.names for found in follow(node.module, alias.name)]


# Names


def _top_names(tree):
    for node in tree.body:
        if isinstance(node, (*FUNCTIONS, ast.ClassDef)):
            yield node.name
        elif isinstance(node, ast.Assign):
            yield from (n.id for target in node.targets for n in ast.walk(target) if isinstance(n, ast.Name))


def shared_names(files):
    """Names that several modules define."""
    where = collections.defaultdict(set)
    for source in files:
        for name in _top_names(source.tree):
            where[name].add(source.path)
    ranked = sorted(((len(paths), name) for name, paths in where.items() if len(paths) > 1), reverse=True)
    return Figure("names defined in two or more modules", str(len(ranked)), [f"{name} x{n}" for n, name in ranked])


def private_accesses(files, tests):
    """Where tests reach for what is the package's own."""
    own = {name for source in files for node in ast.walk(source.tree) for name in _private_names(node)}
    found = []
    for source in tests:
        for node in ast.walk(source.tree):
            if isinstance(node, ast.Attribute) and node.attr in own and getattr(node.value, "id", "") != "self":
                found.append(f"{source.path}:{node.lineno} {ast.unparse(node)}")
    return Figure("private accesses in tests", str(len(found)), found)


def _private_names(node):
    """The private name that a node defines, if any."""
    is_set = isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store)
    name = node.name if isinstance(node, (*FUNCTIONS, ast.ClassDef)) else ""
    name = getattr(node, "id", getattr(node, "attr", "")) if is_set else name
    return [name] if name.startswith("_") and not name.startswith("__") else []


def named_in(files, base):
    """In how many files each public class of a family is named."""
    bases = {
        node.name: {getattr(b, "id", "") for b in node.bases}
        for s in files
        for node in ast.walk(s.tree)
        if isinstance(node, ast.ClassDef)
    }
    family = {base}
    while more := {name for name, above in bases.items() if above & family} - family:
        family |= more
    counts = collections.Counter()
    for source in files:
        seen = set()
        for node in ast.walk(source.tree):
            seen |= {getattr(node, "id", None), getattr(node, "attr", None), getattr(node, "name", None)}
            seen |= {node.value} if isinstance(node, ast.Constant) and isinstance(node.value, str) else set()
        counts.update(name for name in family - {base} if name in seen)
    ranked = [f"{name} {count}" for name, count in counts.most_common() if name[0] != "_"]
    return Figure(f"files in which each {base} is named", ", ".join(ranked), [])


# Imports


def imports(trees):
    """Imports between folders, and circles of parts and of modules."""
    graph, between = graph_of(trees), folder_arrows(trees)
    found = [circles(parts_of(graph, "fieldsim")), circles(graph)]
    folders = {str(pathlib.PurePath(path).parent) for path in trees}
    value = f"{len(folders)}, {len(between)}, {len(found[0])}, {len(found[1])}"
    name = "folders, import arrows between them, circles of parts, of modules"
    return Figure(name, value, [" <-> ".join(circle) for kind in found for circle in kind])


# The table


def figures(root):
    """All figures of a tree of files."""
    files, tests = (list(sources(root, name)) for name in ("fieldsim", "tests"))
    everything = [(source.path, node) for source in files for node in source.functions()]
    yield long_files("fieldsim", files)
    yield long_files("tests", tests)
    yield over("functions, lines", files, length, LONG_FUNCTION)
    yield over("cyclomatic (McCabe)", files, mccabe, COMPLEX)
    yield over("cyclomatic with expressions", files, with_expressions, COMPLEX)
    yield literal_columns(files)
    yield silenced(files)
    yield annotated("all functions", everything)
    yield annotated("what fieldsim exports", exported(files))
    yield shared_names(files)
    yield private_accesses(files, tests)
    yield named_in(files, "Kernel")
    yield named_in(files, "Primitive")
    runs = [f"{lines} lines {where}" for lines, where in near_duplicates({s.path: s.text for s in files})]
    yield Figure(f"near-duplicates, runs of {RUN} lines and more", str(len(runs)), runs)
    yield imports({s.path: s.tree for s in files})


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--rev", help="count a git revision instead of the files as they are")
    parser.add_argument("--details", type=int, default=0, metavar="N", help="also list so many places of each figure")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        root = ROOT
        if options.rev:
            root = pathlib.Path(folder)
            packed = subprocess.run(
                ["git", "archive", options.rev, "fieldsim", "tests"], cwd=ROOT, capture_output=True, check=True
            )
            tarfile.open(fileobj=io.BytesIO(packed.stdout)).extractall(root, filter="data")
        for figure in figures(root):
            print(f"{figure.name}: {figure.value}")
            for place in figure.places[: options.details]:
                print(f"    {place}")


if __name__ == "__main__":
    main()
