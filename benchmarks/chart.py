"""Write docs/fields.md and docs/fields.png: `python -m benchmarks.chart`.

The registered formulas with their files and cost, the accuracy reached on the reference values and at random
points, and contours, all taken from the registry and measured here. `python -m benchmarks.chart --files` measures
nothing and only brings the names of files up to date.
"""

import collections
import functools
import pathlib
import re
import sys

import numpy as np
import warp as wp
from PIL import Image, ImageDraw

import fieldsim as fs
from benchmarks import accuracy
from benchmarks.fields import KERNELS, PRIMITIVES, nanoseconds
from fieldsim.portable import Portable
from fieldsim.potentials import registry

ROOT = pathlib.Path(__file__).parent.parent
METHODS = {
    fs.Segment: {"Cauchy": "atan", "Gaussian": "erf, erfcx", "Newtonian": "log1p", "InverseSquare": "atan",
                 "Metaball": "clipped, log", "SoftObject": "clipped, Gauss nodes (exact)", "Quartic": "as SoftObject"},
    fs.Circle: {"Cauchy": "algebraic", "Gaussian": "I0, I1", "Newtonian": "complete elliptic", "InverseSquare": "atan",
                "Metaball": "clipped, elliptic", "SoftObject": "clipped, sines", "Quartic": "clipped, sines"},
    fs.Arc: {"Cauchy": "atan", "Gaussian": "I0, I1, Gauss-Legendre", "Newtonian": "Carlson R_F, R_D",
             "InverseSquare": "atan", "Metaball": "clipped, elliptic", "SoftObject": "clipped, sines",
             "Quartic": "clipped, sines"},
    fs.Triangle: {"Cauchy": "atan", "Gaussian": "Owen's T", "Newtonian": "log, atan", "InverseSquare": "Clausen",
                  "Metaball": "clipped, log, atan", "SoftObject": "disc-clipped polynomial",
                  "Quartic": "disc-clipped polynomial"},
    fs.Plane: {"Cauchy": "rational", "Gaussian": "exp", "Newtonian": "algebraic, F(0) = 0", "InverseSquare": "log",
               "Metaball": "polynomial", "SoftObject": "polynomial", "Quartic": "polynomial"},
}  # fmt: skip
SIZE = 150  # pixels of a picture in the contour sheet


def methods():
    """The lines of the table, one per formula: method, place and cost."""
    lines = ["| kernel | primitive | method | formula in | ns | points |", "|---|---|---|---|---:|---:|"]
    for kernel in KERNELS:
        base = None
        for primitive in PRIMITIVES:
            cost = nanoseconds(kernel, primitive, wp.float64, 5)
            base = base or cost
            file = file_of(type(kernel), type(primitive))
            method = METHODS.get(type(primitive), {}).get(type(kernel).__name__, "the kernel")
            lines.append(f"| {_names(kernel, primitive)} | {method} | `{file}` | {cost:.0f} | {cost / base:.1f} |")
    return lines


def functions_of(function: Portable) -> set[tuple[str, str]]:
    """(module, name) of a portable function and of all that it calls."""
    found, waiting = set(), [function]
    while waiting:
        one = waiting.pop()
        found.add((one.__module__, one.__name__))
        names = [one.bindings.get(name, one.function.__globals__.get(name)) for name in one.function.__code__.co_names]
        waiting += [name for name in names if isinstance(name, Portable)]
    return found


@functools.cache
def _functions():
    return {key: functions_of(formula.jet) for key, formula in registry.FORMULAS.items()}


def file_of(kernel: type, primitive: type) -> str:
    """The file of a formula, relative to fieldsim/potentials: that of the functions which the fewest others use.

    The kernel's law, which all its formulas use, does not count.
    """
    users = collections.Counter(one for functions in _functions().values() for one in functions)
    law = _functions()[kernel, fs.Point] if primitive is not fs.Point else set()
    own = {one for one in _functions()[kernel, primitive] - law if one[0].startswith("fieldsim.potentials.formulas.")}
    fewest = min(users[one] for one in own)
    modules = collections.Counter(sorted(one[0] for one in own if users[one] == fewest))
    module = modules.most_common(1)[0][0]
    return module.removeprefix("fieldsim.potentials.").replace(".", "/") + ".py"


def update_files():
    """Write today's files into the table of docs/fields.md, and leave all else as it is."""
    page = ROOT / "docs" / "fields.md"

    def renewed(row):
        kernel, primitive = (getattr(fs, name) for name in row.group("kernel", "primitive"))
        return f"{row['begin']}`{file_of(kernel, primitive)}`"

    text = page.read_text(encoding="utf-8")
    pattern = r"^(?P<begin>\| (?P<kernel>\w+) \| (?P<primitive>\w+) \| [^|]+ \| )`[^`]+`"
    page.write_text(re.sub(pattern, renewed, text, flags=re.MULTILINE), encoding="utf-8")


def errors():
    """The lines of the accuracy table, one per formula."""
    lines = [
        "| kernel | primitive | reference | random points | median | float32, reference | float32, random points |",
        "|---|---|---|---|---|---|---|",
    ]
    for kernel in KERNELS:
        for primitive in PRIMITIVES:
            report = accuracy.measure(kernel, primitive)
            double, single = accuracy.over_reference(type(kernel), type(primitive))
            columns = double, report.largest, report.median, single, report.single.max(axis=0)
            lines.append(f"| {_names(kernel, primitive)} | " + " | ".join(map(_powers, columns)) + " |")
    return lines


def _names(kernel, primitive):
    return f"{type(kernel).__name__} | {type(primitive).__name__}"


def _powers(values):
    """Few characters for errors; what is below 1e-17 is as good as 0."""
    return ", ".join("0" if v < 1e-17 else f"{v:.0e}".replace("e-0", "e-") for v in values)


def contours(kernel, primitive):
    """Filled contours of a formula's field in a plane through the primitive, (SIZE, SIZE, 3) uint8."""
    line = np.linspace(-1.25, 1.25, SIZE)
    x, y = np.meshgrid(line, -line)
    # A plane that the primitive does not fill: tilted a little, or across it.
    across = isinstance(primitive, fs.Plane)
    points = np.stack([x, 0.013 + 0 * y, y] if across else [x, y, 0.17 + 0 * y], axis=-1).reshape(-1, 3)
    f = fs.Field(primitive, kernel).value(points)
    low, high = np.percentile(f, [2, 98])
    level = np.clip((f - low) / max(high - low, 1e-30), 0, 1).reshape(SIZE, SIZE)
    bands = np.floor(level * 12)
    shade = (bands / 12)[..., None]
    picture = (1 - shade) * (20, 26, 52) + shade * (255, 214, 140)
    edge = (np.diff(bands, axis=0, prepend=bands[:1]) != 0) | (np.diff(bands, axis=1, prepend=bands[:, :1]) != 0)
    picture[edge] *= 0.55
    return picture.astype(np.uint8)


def sheet():
    """The contour pictures of all formulas, kernels down and primitives across."""
    left, top = 95, 22
    image = Image.new("RGB", (left + SIZE * len(PRIMITIVES), top + SIZE * len(KERNELS)), "white")
    draw = ImageDraw.Draw(image)
    for row, kernel in enumerate(KERNELS):
        draw.text((6, top + SIZE * row + SIZE // 2), type(kernel).__name__, fill="black")
        for column, primitive in enumerate(PRIMITIVES):
            corner = left + SIZE * column, top + SIZE * row
            image.paste(Image.fromarray(contours(kernel, primitive)).crop((0, 0, SIZE - 4, SIZE - 4)), corner)
            if row == 0:
                draw.text((corner[0] + 50, 5), type(primitive).__name__, fill="black")
    return image


TEXT = """# The fields

![Contours of every formula](fields.png)

Every kernel on every primitive has its value, gradient and Hessian in one evaluation: in closed form, or with a special
function at fixed cost. Written by `python -m benchmarks.chart`, from the registry and from what it measured. How a
formula is found and compiled: [architecture.md](architecture.md#the-road-of-a-row).

## Methods and cost

- *method*: what the formula is made of; *formula in*: its file in `fieldsim/potentials`, with the source.
- *ns*: nanoseconds per value and gradient in float64 on one core, and the same in *points* of that kernel.

"""
MANY = """
## Many elements at many points

`field.value(points)` and its like sum every element at every point, exactly. `field.fast()` answers the same questions
by a fast multipole method: cells of an octree that lie apart act on each other through Chebyshev expansions of the
kernel (Fong & Darve 2009), and only what lies near is summed element by element, by the same formulas. Its time grows
with the number of elements plus that of points.

```python
import numpy as np

import fieldsim as fs

rng = np.random.default_rng(1)
starts = rng.random((300, 3))
threads = [fs.Segment(start, start + 0.1) for start in starts]
field = fs.Field(threads, fs.Newtonian(), strength=0.01)
fast = field.fast(tolerance=1e-6)
points = rng.random((200, 3))
value, gradient = fast.value_and_gradient(points)
assert abs(value - field.value(points)).max() <= 1e-6 * value.max()
```

- *tolerance*: the largest error of the value, over the largest value that the field has at the points of the call
  when strengths are taken without signs. Gradients err by about 100 times that over the width of the smallest cells,
  Hessians by some 1e4 times that over its square; near the elements, where derivatives are largest, cells are small.
- *how it is kept*: the sum is compared with the exact one at 64 of the points, and done again, finer, unless 3 times
  the largest error seen there and 12 times the root of their mean square are within the tolerance; where no try is,
  all is summed exactly.
  `fast(proved=True)` keeps bounds below the tolerance that hold for any elements and points: the errors of the kernel
  itself between cells, which are measured at 96 by 96 points and taken 3 times, times what lies in the cells.
  `fast.error_bounds(points)` gives them in any case; errors are a hundredth of them or so.
- *when*: sums that exact evaluation takes about as long for are exact, to the bit: up to 2e8 pairs of an element and a
  point under bare 1/r and 1/r^2, 2e9 under other powers (Cauchy, softened), for which translations have to be prepared
  in every size of cell, and 1e7 under kernels that end or are Gaussian, for which only what is within reach is summed,
  without an error. Below 2000 elements of one kernel and width, all is exact.
- *what*: points, segments, tapered segments, arcs and circles. Planes, triangles, faces of solids and profiled
  primitives are summed exactly; `fast.summed_exactly` counts them, and a warning says when they are most.
- *single points* of elements that stand still, as in a callback: `local_field(elements, low, high, tolerance)` in
  `fieldsim/potentials/fast_summation/local_field.py` prepares tables for a box, from which a portable function reads
  value and gradient in a sixth of the time of 1000 segments.
- *cost*: `python -m benchmarks many --full` gives this machine's seconds. Value and gradient of 1e5 segments at 1e5
  points, to 1e-9, one core of a busy machine: under 1/r 11 s at first and 8 in later calls, beside 145 s of the exact
  sum in lanes (and 700 without lanes); under Cauchy(20) 39 s at first, most of it for translations, and 12 later,
  beside 107 s (700).
"""

ACCURACY = """
## Accuracy

The largest relative errors of value, gradient and Hessian, in this order (`python -m benchmarks accuracy` gives more):

- *reference*: the formula's 40 reference cases (50-digit quadrature), value and gradient.
- *random points*: 10,000 points at distances 1e-9 to 1e6, some on hard places (beyond an end, on an axis, in
  the plane, at a corner, at a support's edge), half of them about primitives in general position with kernels of other
  widths. Identities and the other compiler judge all of them; quadrature in 34 to 50 digits judges 40 at random
  (*median*) and the 10 that the former find worst.
- *float32*: single against double precision at the same numbers, in units of the field's scale; all points.

Errors are those of the evaluation: the truth is taken at the exact binary values of the input, and of errors beyond the
goals (1e-12; float32 5e-6), as next to a support's edge or where pulls cancel, what two units in the last place of the
coordinates do to the truth is not counted (`python -m benchmarks accuracy` gives them whole as *raw*). Kernels
whose tails vanish lose relative digits in the tail, never absolute ones: their errors are relative to the field plus
0.002 of its scale. The scale is the kernel's height times the measure within its reach (`tests/reference_cases.py`).

"""


def main():
    """Write both files."""
    page = TEXT + "\n".join(methods()) + "\n" + MANY + ACCURACY + "\n".join(errors()) + "\n"
    (ROOT / "docs" / "fields.md").write_text(page)
    sheet().quantize(128).save(ROOT / "docs" / "fields.png", optimize=True)


if __name__ == "__main__":
    update_files() if "--files" in sys.argv else main()
