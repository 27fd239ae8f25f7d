"""The registry: what it holds, in which order, and in which files."""

import pathlib
import re

import pytest

from fieldsim.potentials import kernels
from fieldsim.potentials.formulas import registered
from fieldsim.potentials.formulas.arc.frame import ARC
from fieldsim.potentials.primitives.arc import Arc
from fieldsim.potentials.registry import FORMULAS

ORDER = [(kernel.__name__, primitive.__name__) for kernel, primitive in FORMULAS]


def test_the_order_is_that_of_the_list():
    """It numbers the formulas in compiled code; an import elsewhere that registered some earlier would change it."""
    text = pathlib.Path(registered.__file__).read_text(encoding="utf-8")
    calls = re.findall(r"^register(_points)?\((\w+)(?:, (\w+))?", text, re.MULTILINE)
    listed = [(kernel, "Point" if points else primitive) for points, kernel, primitive in calls]
    assert [key for key in ORDER if not key[1].startswith("Profiled")] == listed
    first = ORDER.index(("SoftObject", "Plane")) + 1
    assert ORDER[first][1] == "ProfiledSegment"


def test_numbers_follow_the_order():
    assert [formula.kind for formula in FORMULAS.values()] == list(range(len(FORMULAS)))


@pytest.mark.parametrize("kernel", [key[0] for key in FORMULAS if key[1] is Arc], ids=lambda kernel: kernel.__name__)
def test_arcs_ask_every_kernel_in_one_order(kernel):
    """All arguments but the kernel's width bear the same names in the same places."""
    names = ARC.split(", ")
    local = FORMULAS[kernel, Arc].jet.bindings["kernel"]
    asked = [local, *(local.bindings[name] for name in ("arc",) if name in local.bindings)]
    assert issubclass(kernel, kernels.Kernel)
    for function in asked:
        code = function.function.__code__
        given = list(code.co_varnames[: code.co_argcount])
        width = names.index("width")
        assert given[:width] == names[:width]
        assert given[width + 1 :] == names[width + 1 :]
