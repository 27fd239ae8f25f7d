"""Names in backquotes, in the package's docstrings and comments, are names of something that is there."""

import ast
import builtins
import functools
import io
import pathlib
import re
import tokenize

import pytest

import fieldsim as fs

HOME = pathlib.Path(fs.__file__).parent
FILES = sorted(HOME.rglob("*.py"))
# What is no name of fieldsim's: commands, functions of other libraries, and beginnings and ends of names.
OTHERS = {"nohup", "gym", "build", "isfinite", "mj_rne", "store", "Like", "row_", "_1", "_3", "f"}
# Objects that stand for one of their kind, and modules of others.
HEADS = {"f", "fs", "math", "mujoco", "name", "run", "about"}


@functools.cache
def tree_of(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def own_names(path):
    """All that a file names, and short strings in it."""
    found = set()
    for node in ast.walk(tree_of(path)):
        for key in ("name", "id", "attr", "arg"):
            found.add(getattr(node, key, None))
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and len(node.value) < 60:
            found.update(re.findall(r"\w+", node.value))
    return found


@functools.cache
def defined():
    """What is defined in the package: functions, classes, their attributes, and names of modules."""
    found = set(dir(builtins))
    for path in FILES:
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.ClassDef | ast.FunctionDef):
                found.add(node.name)
            if isinstance(node, ast.ClassDef | ast.Module):
                for line in node.body:
                    targets = [line.target] if isinstance(line, ast.AnnAssign) else getattr(line, "targets", ())
                    found.update(one.id for t in targets for one in ast.walk(t) if isinstance(one, ast.Name))
            if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
                found.add(node.attr)
    return found


@functools.cache
def modules():
    """Folders and modules by name."""
    found = {}
    for path in [HOME, *HOME.rglob("*")]:
        if (path.is_dir() and path.name != "__pycache__") or path.suffix == ".py":
            found.setdefault(path.stem, []).append(path)
    return found


def within(path, names):
    """Whether a folder or module has what the dotted names say."""
    if not names:
        return True
    if path.is_dir():
        below = [path / names[0], path / f"{names[0]}.py"]
        inside = next((one for one in below if one.exists()), None)
        return within(inside, names[1:]) if inside else named_in(path / "__init__.py", names[0])
    return named_in(path, names[0])


def named_in(path, name):
    return path.exists() and re.search(rf"\b{name}\b", path.read_text(encoding="utf-8")) is not None


def prose(path):
    """(line, text) of a file's docstrings and comments."""
    source = path.read_text(encoding="utf-8")
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node):
            yield node.body[0].lineno, ast.get_docstring(node, clean=False)
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


def is_there(path, quoted):
    first, *rest = quoted.split(".")
    if rest:
        homes = modules().get(first, [])
        return first in HEADS or any(within(home, rest) for home in homes) or {first, *rest} <= known(path)
    # A module of another folder is named with its folder.
    return first in OTHERS | known(path) or any(home.parent == path.parent for home in modules().get(first, ()))


def known(path):
    return defined() | own_names(path)


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(HOME)))
def test_names_in_backquotes_are_there(path):
    missing = []
    for line, text in prose(path):
        for quoted in re.findall(r"(?<!`)`([A-Za-z_][\w.]*)(?:\([^`\n]*\))?`(?!`)", text):
            if not is_there(path, quoted.rstrip(".")):
                missing.append(f"{line}: {quoted}")
    assert not missing
