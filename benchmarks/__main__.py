"""Print figures: `python -m benchmarks [PART ...] [--json] [--full]`.

The parts are accuracy, fields, solids, many, motion, precision, contact, mujoco, render, referee, film and gpu; default
all. Each is a module with a function `rows()` that yields dicts: name, value, unit, and where a peer is installed peer
(its name), peer_value and ratio (value / peer_value). A part or a peer that is not there is passed over with a word.
"""

import importlib
import importlib.util
import inspect
import json
import sys

import click

PARTS = (
    "accuracy",
    "fields",
    "solids",
    "many",
    "motion",
    "precision",
    "contact",
    "mujoco",
    "render",
    "referee",
    "film",
    "gpu",
)
KEYS = ("name", "value", "unit", "peer", "peer_value", "ratio")


def measured(part, full):
    """The rows of one part, with all the keys; full: the long runs too, where a part has some."""
    if importlib.util.find_spec(f"benchmarks.{part}") is None:
        click.echo(f"benchmarks: there is no part {part} yet, passed over", err=True)
        return
    rows = importlib.import_module(f"benchmarks.{part}").rows
    options = {"full": full} if "full" in inspect.signature(rows).parameters else {}
    for row in rows(**options):
        peer_value = row.get("peer_value")
        ratio = row["value"] / peer_value if peer_value else None
        yield {key: row.get(key) for key in KEYS} | {"ratio": row.get("ratio", ratio)}


@click.command()
@click.argument("parts", nargs=-1, type=click.Choice(PARTS))
@click.option("as_json", "--json", is_flag=True, help="One JSON object per line.")
@click.option("--full", is_flag=True, help="The long runs too: minutes.")
def main(parts, as_json, full):
    """Measure PARTS and print the figures; default all parts."""
    rows = (row for part in parts or PARTS for row in measured(part, full))
    if as_json:
        for row in rows:
            click.echo(json.dumps(row))
    else:
        _print_table(rows)


def _print_table(rows):
    from rich import box, console, table

    shown = table.Table(*KEYS, box=box.SIMPLE)
    for key in ("value", "peer_value", "ratio"):
        shown.columns[KEYS.index(key)].justify = "right"
    out = console.Console(width=None if sys.stdout.isatty() else 120)
    with out.status("measuring"):
        for row in rows:
            shown.add_row(*(_text(row[key]) for key in KEYS))
    out.print(shown)


def _text(value):
    if value is None:
        return ""
    return f"{value:.3g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    main(prog_name="python -m benchmarks")
