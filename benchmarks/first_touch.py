"""First touches of balls in random scenes, held against the surface itself (tests/contact_oracle.py).

    python -m benchmarks.first_touch --scenes 100 --first 0 --family "Gaussian triangles"

names every scene in which a touch is missed, false, or wrong by more than TOLERANCE of the ball's radius.
"""

import pathlib
import sys

import click
import numpy as np

import fieldsim as fs
from benchmarks.progress import progress
from fieldsim import launch

sys.path.append(str(pathlib.Path(__file__).parent.parent / "tests"))

SCENES, QUICK_SCENES = 1000, 60
# Of so many scenes one has bodies that move: it takes ten times as long.
ONE_MOVES = 10
TOLERANCE = 1e-6


def rows(full: bool = False):
    """Counts and errors of all scenes, of those whose bodies stay and of those where some move."""
    verdicts, refused = {False: [], True: []}, 0
    for family, seed in progress(chosen(SCENES if full else QUICK_SCENES), "scenes judged"):
        verdict = judged(family, seed)
        if verdict is None:
            refused += 1
        else:
            verdicts[family.moving].append(verdict)
    yield {"name": "first touch: scenes that a simulation refuses", "value": refused, "unit": "scenes"}
    for moving, some in verdicts.items():
        yield from figures(some, f"first touch, {len(some)} scenes, {'moving' if moving else 'still'} bodies")


def chosen(count, first=0, only=None):
    """(family, number) of `count` scenes: families in turn, every tenth scene of one that moves."""
    from contact_scenes import MOVING, STILL

    still = [family for family in STILL if only in (None, family.full_name)]
    moving = [family for family in MOVING if only in (None, family.full_name)]
    result = []
    for k in range(first, first + count):
        turn, place = divmod(k, ONE_MOVES)
        some = moving if (place == 0 and moving) or not still else still
        number = turn if some is moving and still else (k - turn - 1 if moving else k)
        result.append((some[number % len(some)], number // len(some)))
    return result


def judged(family, seed):
    """The verdict on one scene, on one core; None where a simulation refuses its surfaces."""
    from contact_verdicts import judge_family

    threads, launch.THREADS = launch.THREADS, 1
    try:
        return judge_family(family, seed)
    except fs.InputError:
        return None
    finally:
        launch.THREADS = threads


def figures(verdicts, name):
    """Rows of what verdicts say together."""

    def count(what):
        return int(sum(np.sum(getattr(verdict, what)) for verdict in verdicts))

    yield {"name": f"{name}: balls thrown", "value": sum(len(v.judged) for v in verdicts), "unit": "balls"}
    for what in ("judged", "touching", "missed", "false", "overruled"):
        yield {"name": f"{name}: {what}", "value": count(what), "unit": "balls"}
    for what in ("time", "place"):
        errors = np.concatenate([getattr(verdict, f"{what}_errors") for verdict in verdicts])
        errors = errors[np.isfinite(errors)]
        for share, value in (("median", 0.5), ("99 %", 0.99), ("worst", 1.0)):
            found = float(np.quantile(errors, value)) if len(errors) else None
            yield {"name": f"{name}: error of {what}, {share}", "value": found, "unit": "ball radii"}


@click.command()
@click.option("--scenes", default=QUICK_SCENES)
@click.option("--first", default=0)
@click.option("--family", default=None, help="Only those of the family of this name.")
@click.option("--tolerance", default=TOLERANCE)
def main(scenes, first, family, tolerance):
    """Judge scenes, and name those that fail."""
    verdicts = {False: [], True: []}
    for one, seed in progress(chosen(scenes, first, family), "scenes judged"):
        verdict = judged(one, seed)
        if verdict is None:
            click.echo(f"REFUSED: {one.full_name!r}, number {seed}")
            continue
        verdicts[one.moving].append(verdict)
        if not verdict.worst <= tolerance:
            click.echo(failure(one, seed, verdict, tolerance))
    for moving, some in verdicts.items():
        for row in figures(some, "moving" if moving else "still") if some else ():
            click.echo(f"{row['name']}: {row['value'] if row['value'] is None else format(row['value'], '.3g')}")


def failure(family, seed, verdict, tolerance):
    """What is wrong in a scene, ball by ball."""
    lines = [f"FAILS: {family.full_name!r}, number {seed}"]
    for ball in range(len(verdict.judged)):
        what = [name for name in ("missed", "false", "overruled") if getattr(verdict, name)[ball]]
        errors = verdict.time_errors[ball], verdict.place_errors[ball]
        if what or max(errors) > tolerance:
            size = verdict.scene.radii[ball] / verdict.scene.features[ball]
            lines.append(
                f"  ball {ball} of {size:.3g} features: {', '.join(what) or 'late or elsewhere'}; "
                f"errors in radii: time {errors[0]:.2g}, place {errors[1]:.2g}"
            )
    return "\n".join(lines)


if __name__ == "__main__":
    main()
