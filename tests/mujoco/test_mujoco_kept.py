"""The callback on disk: what it is made of is known, so that no other code is taken for it."""

import ast
import importlib
import pathlib

import pytest

import fieldsim
from fieldsim.mujoco.callback import field_callbacks, layout, memory
from fieldsim.native import fingerprint, functions
from fieldsim.portable import Portable
from fieldsim.potentials.registry import element_field

PACKAGE = pathlib.Path(fieldsim.__file__).parent
MODULES = [path for folder in ("callback", "contact") for path in sorted((PACKAGE / "mujoco" / folder).glob("*.py"))]
# Of their modules those that are Python's alone, and sums of fields, whose portable functions are told of one by one.
OUTSIDE = {f"{name}.py" for name in "feet field_callbacks geoms pulls impact ownership shapes starts tables".split()}


@pytest.mark.parametrize("path", [path for path in MODULES if path.name not in OUTSIDE], ids=lambda path: path.name)
def test_all_that_compiled_code_reads_is_in_its_fingerprint(path):
    """Constants come from modules whose text counts, and portable functions are told of."""
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith("fieldsim."):
            continue
        place = node.module.removeprefix("fieldsim.").replace(".", "/")
        counts = any(place == one.removesuffix(".py") or place.startswith(one) for one in layout.FOLDERS)
        for alias in node.names:
            value = getattr(importlib.import_module(node.module), alias.name)
            if isinstance(value, Portable):
                assert value in memory.PORTABLES, alias.name
            elif isinstance(value, int | float | tuple | slice):
                assert counts, alias.name


def test_a_change_anywhere_in_the_modules_is_another_fingerprint(tmp_path):
    """Each folder and file that is named is there, and counts."""
    for one in layout.FOLDERS:
        for path in [PACKAGE / one] if one.endswith(".py") else (PACKAGE / one).rglob("*.py"):
            copy = tmp_path / path.relative_to(PACKAGE)
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(path.read_bytes())
    digest = fingerprint.sources.__wrapped__
    found = {digest(layout.FOLDERS, tmp_path)}
    assert found == {digest(layout.FOLDERS, PACKAGE)}
    for one in layout.FOLDERS:
        path = tmp_path / one if one.endswith(".py") else sorted((tmp_path / one).rglob("*.py"))[-1]
        path.write_text(path.read_text() + "# changed\n")
        found.add(digest(layout.FOLDERS, tmp_path))
    assert len(found) == 1 + len(layout.FOLDERS)


def test_a_kernel_of_a_user_is_compiled_for_itself(monkeypatch):
    """Sums of the same formulas, of which one calls another function than before, are not taken for each other."""
    here, there = (
        fieldsim.Field(fieldsim.Point((0, 0, 0)), kernel, 1.0).elements.kinds_used
        for kernel in (fieldsim.Newtonian(), fieldsim.Cauchy(1.0))
    )
    total = field_callbacks._PORTABLE["weight"](here)
    made = []

    def native_function(name, make, signature, *, folders, portables):
        made.append((name, fingerprint.portables(portables)))
        return functions.NativeFunction(name, 0)

    monkeypatch.setattr(field_callbacks, "native_function", native_function)
    for _ in range(2):
        field_callbacks._compiled.__wrapped__("weight", here)
    monkeypatch.setitem(field_callbacks._PORTABLE, "weight", lambda kinds: total.bind(field=element_field(there)))
    field_callbacks._compiled.__wrapped__("weight", here)
    assert made[0] == made[1]
    assert made[0][0] == made[2][0]
    assert made[0][1] != made[2][1]
