"""Write docs/fields.md and docs/fields.png: `python -m benchmarks.chart`.

The chart of cells with its formulas' places, the accuracy reached on the reference values and the cost, all taken from
the registry and measured here.
"""

import json
import pathlib

import numpy as np
import warp as wp
from PIL import Image, ImageDraw

import fieldsim as fs
from benchmarks.fields import KERNELS, PRIMITIVES, nanoseconds
from fieldsim.potentials import cells

ROOT = pathlib.Path(__file__).parent.parent
REFERENCE = ROOT / "tests" / "reference" / "fields.json"
OF_NAME = {
    "cauchy": fs.Cauchy,
    "gaussian": fs.Gaussian,
    "inverse": fs.Newtonian,
    "inverse_squared": fs.InverseSquare,
    "metaballs": fs.Metaball,
    "soft_objects": fs.SoftObject,
    "quartic": fs.Quartic,
    "point": lambda p: fs.Point(p["p"]),
    "segment": lambda p: fs.Segment(p["a"], p["b"]),
    "arc": lambda p: fs.Arc(p["center"], p["normal"], p["start"], p["radius"], p["angle"]),
    "triangle": lambda p: fs.Triangle(p["a"], p["b"], p["c"]),
    "plane": lambda p: fs.Plane(p["point"], p["normal"]),
}
METHODS = {
    fs.Point: dict.fromkeys(OF_NAME, "the kernel"),
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


def accuracy():
    """{(kernel, primitive): (value, gradient) errors, largest over the reference, relative to what the field is}."""
    result = {}
    for cell in json.loads(REFERENCE.read_text())["cells"]:
        worst = np.zeros(2)
        for case in cell["cases"]:
            kernel = OF_NAME[cell["kernel"]](*case["kernel"].values())
            field = fs.Field(OF_NAME[cell["primitive"]](case["primitive"]), kernel)
            if abs(case["value"]) < 1e-12:
                continue
            value, gradient = field.value_and_gradient(case["point"])
            size = np.linalg.norm(case["gradient"])
            off = np.linalg.norm(gradient - case["gradient"]) / size if size > 1e-12 else 0.0
            worst = np.maximum(worst, (abs(value / case["value"] - 1.0), off))
        result[type(kernel), type(field.terms[0].primitive)] = worst
    return result


def table():
    """The lines of the chart, one per cell."""
    errors = accuracy()
    lines = [
        "| kernel | primitive | method | formula in | value | gradient | ns | points |",
        "|---|---|---|---|---:|---:|---:|---:|",
    ]
    for kernel in KERNELS:
        base = None
        for primitive in PRIMITIVES:
            cost = nanoseconds(kernel, primitive, wp.float64, 5)
            base = base or cost
            key = type(kernel), type(primitive)
            jet = cells.CELLS[key].jet
            local = jet.bindings.get("kernel", jet)
            value, gradient = (f"{e:.0e}" for e in errors[key]) if key in errors else ("as Arc", "as Arc")
            method = METHODS[type(primitive)].get(type(kernel).__name__, "the kernel")
            where = f"`{local.__module__.rsplit('.', 1)[-1]}.py`"
            names = f"| {type(kernel).__name__} | {type(primitive).__name__} | {method} | {where} "
            lines.append(f"{names}| {value} | {gradient} | {cost:.0f} | {cost / base:.1f} |")
    return lines


def contours(kernel, primitive):
    """Filled contours of a cell's field in a plane through the primitive, (SIZE, SIZE, 3) uint8."""
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
    """The contour pictures of all cells, kernels down and primitives across."""
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

![Contours of every cell](fields.png)

Every kernel on every primitive has its value, gradient and Hessian in one evaluation: in closed form, or with a special
function at fixed cost. Written by `python -m benchmarks.chart`, from the registry and from what it measured.

- *method*: what the formula is made of; *formula in*: the module of `fieldsim/potentials` where it stands, with source.
- *value*, *gradient*: the largest relative error in float64 over the cell's 40 reference cases (50-digit quadrature)
  where they exceed 1e-12. Kernels whose tails vanish lose relative digits in the tail, never absolute ones.
- *ns*: nanoseconds per value and gradient in float64 on one core, and the same in *points* of that kernel.

"""


def main():
    """Write both files."""
    (ROOT / "docs" / "fields.md").write_text(TEXT + "\n".join(table()) + "\n")
    sheet().quantize(128).save(ROOT / "docs" / "fields.png", optimize=True)


if __name__ == "__main__":
    main()
