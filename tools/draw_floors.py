"""Draw which parts of fieldsim import which, from the imports themselves: docs/floors.png.

    python tools/draw_floors.py

Parts are the folders and modules directly below fieldsim/. Modules that every part may use are drawn as one, "base".
An arrow that follows from two others is left out. The edges are kept in the picture's metadata, where a test compares
them with the imports of today.
"""

import ast
import json
import pathlib

from import_graph import graph_of, parts_of

ROOT = pathlib.Path(__file__).parents[1]
PACKAGE = ROOT / "fieldsim"
PICTURE = ROOT / "docs" / "floors.png"
# Where parts are in the picture, from left to right; others find a place beside those of their floor.
COLUMNS = {
    "base": 0.5,
    "cli": 0.5,
    "dynamics": 0.3,
    "files": 0.8,
    "filming": 0.68,
    "launch": 0.4,
    "mujoco": 0.3,
    "native": 0.08,
    "orbits": 0.24,
    "plots": 0.9,
    "potentials": 0.5,
    "recording": 0.88,
    "render": 0.59,
    "sampling": 0.12,
    "scenario": 0.5,
    "sources": 0.3,
    "world": 0.5,
}


def imports() -> dict[str, set[str]]:
    """The parts that each part imports, imports within functions included; the package's own modules left out."""
    paths = sorted(PACKAGE.rglob("*.py"))
    trees = {path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8")) for path in paths}
    found = parts_of(graph_of(trees), "fieldsim")
    short = {part: part.removeprefix("fieldsim.") for part in found if part not in ("fieldsim", "fieldsim.__main__")}
    return {name: {short[one] for one in found[part] if one in short} for part, name in short.items()}


def edges() -> dict[str, list[str]]:
    """The parts that each part imports, sorted, with the parts that import nothing but each other as one: "base"."""
    found = imports()
    base = set(found)
    while True:
        kept = {part for part in base if found[part] <= base and (PACKAGE / f"{part}.py").exists()}
        kept |= base & {"portable", "numerics"}
        kept -= {"sampling", "plots"}
        if kept == base:
            break
        base = kept
    merged = {part: sorted((used - base) | ({"base"} if used & base else set())) for part, used in found.items()}
    return {"base": []} | {part: used for part, used in sorted(merged.items()) if part not in base}


def floors(graph) -> dict[str, int]:
    """The floor of each part: one above the highest part that it imports."""
    found = {}

    def floor(part):
        if part not in found:
            found[part] = 1 + max((floor(used) for used in graph[part]), default=-1)
        return found[part]

    for part in graph:
        floor(part)
    return found


def reduced(graph) -> dict[str, list[str]]:
    """The edges that do not follow from others."""

    def reached(part):
        return {one for used in graph[part] for one in {used, *reached(used)}}

    return {
        part: [one for one in used if not any(one in reached(other) for other in used)] for part, used in graph.items()
    }


def rooms(part: str) -> list[str]:
    """The subfolders of a part; of "base", its parts."""
    if part == "base":
        return sorted(set(imports()) - set(edges()))
    return sorted(path.parent.name for path in (PACKAGE / part).glob("*/__init__.py"))


def raised(graph, level) -> dict[str, int]:
    """Floors with each part directly below the lowest part that imports it, so that arrows are short."""
    found = dict(level)
    for part in sorted(graph, key=level.get, reverse=True):
        above = [found[other] for other, used in graph.items() if part in used]
        if above and part != "base":
            found[part] = min(above) - 1
    return found


def columns(level) -> dict[str, float]:
    """The middle of each part across the picture: as in COLUMNS, and others evenly beside each other."""
    found = {}
    for floor in set(level.values()):
        parts = sorted(part for part in level if level[part] == floor)
        found |= {part: COLUMNS.get(part, (k + 0.5) / len(parts)) for k, part in enumerate(parts)}
    return found


def draw(graph, path) -> None:
    """Draw the graph, floor by floor from below, as PNG with the edges in its metadata."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    level = raised(graph, floors(graph))
    top = max(level.values())
    column = columns(level)
    figure, axes = pyplot.subplots(figsize=(10.0, 1.05 * (top + 1)), dpi=110)
    figure.subplots_adjust(left=0.0, right=1.0, bottom=0.0, top=1.0)
    axes.set_axis_off()
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(-0.5, top + 0.5)
    box = {"boxstyle": "round,pad=0.45", "facecolor": "#f3ede2", "edgecolor": "0.3"}
    boxes = {}
    for part in graph:
        lines = [part, *wrapped(rooms(part), 80 if part == "base" else 30)]
        where = {"ha": "center", "va": "center", "fontsize": 9, "linespacing": 1.35}
        boxes[part] = axes.text(column[part], level[part], "\n".join(lines), bbox=box, zorder=2, **where)
    figure.canvas.draw()  # lays the boxes out, at whose edges arrows end
    for part, used in reduced(graph).items():
        for one in used:
            ends = {"patchA": boxes[part].get_bbox_patch(), "patchB": boxes[one].get_bbox_patch()}
            arrow = {"arrowstyle": "-|>", "color": "0.4", "lw": 1.1, "shrinkA": 0, "shrinkB": 2, **ends}
            start = column[part], level[part]
            end = min(max(column[part], 0.3), 0.7) if one == "base" else column[one], level[one]
            axes.annotate("", xy=end, xytext=start, arrowprops=arrow, zorder=3)
    figure.savefig(path, metadata={"Software": None, "Edges": json.dumps(graph)})
    pyplot.close(figure)


def wrapped(names, width) -> list[str]:
    """Names joined into lines of at most so many letters."""
    lines = []
    for name in names:
        if lines and len(lines[-1]) + len(name) + 2 <= width:
            lines[-1] += f", {name}"
        else:
            lines.append(name)
    return lines


if __name__ == "__main__":
    draw(edges(), PICTURE)
    print(PICTURE.relative_to(ROOT))
