"""`forestall bench robustness`: detection and false alarms against what a sensor gets wrong."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from cyclopts import App

from forestall.cli.flags import ComparingFlags, Flag, Json, Names

if TYPE_CHECKING:
    from forestall.experiments.cost import Cost


PARTS = ComparingFlags()


def register(bench: App) -> None:
    """Add the command to `forestall bench`."""
    bench.command(robustness)


def robustness(
    *,
    split: str = "development",
    limit: int | None = None,
    task: Names = None,
    disturbance: Names = None,
    profile: str = "kind",
    judge: str = "scene-graph",
    jobs: int | None = None,
    out: Path | None = None,
    engine: str = "local",
    parts: ComparingFlags = PARTS,
    as_json: Json = False,
    quiet: Flag = False,
) -> int:
    """What judges detect, and how often they cry wolf, through sensors with one error each.

    Failing cases and undisturbed runs are watched through a perfect sensor, and through one with
    noisy depth, a wrong pose, wrong outlines, masks that are missing, wrong labels, no identities,
    or small things unseen, at several strengths. See docs/sensors.md.

    Args:
        split: development (to look at and to tune on) or test (to report).
        limit: so many cases of each set, from all tasks in turn; 10 by default.
        task: only cases of these tasks.
        disturbance: only these: camera, depth, pose, outline, missed, mislabelled, identities,
            small, realistic.
        profile: of the household: kind or honest.
        judge: whose alarms are counted: scene-graph, preconditions, plan-check, objects, caption or
            image.
        jobs: how many episodes at once; one for each core by default.
        out: folder of the results; what is finished in it is not run again.
        engine: local (processes), ray, or inline (this process, one after the other).
        parts: which parts.
        as_json: print the summary as JSON instead of the table.
        quiet: no progress on standard error.
    """
    from forestall.cli.listing import print_table
    from forestall.cli.progress import bar
    from forestall.experiments.conduct import Experiment, conduct
    from forestall.experiments.robustness import (
        EXPERIMENT_KIND,
        LIMIT,
        SUMMARY,
        Robustness,
        present,
        without_sensor,
    )
    from forestall.experiments.settings import Settings

    given = parts.given()
    without_sensor(given.kinds())
    most = LIMIT if limit is None else limit
    choice = Robustness(split, most, tuple(disturbance or ()), profile, tuple(task or ()))
    workers = jobs if jobs is not None else os.cpu_count() or 1
    settings = Settings(given, pages="none")
    experiment = Experiment(choice, workers, engine, settings=settings, kind=EXPERIMENT_KIND)
    folder = out or Path("runs") / f"robustness-{split}-{profile}"
    silent = quiet or as_json

    def announce(cost: Cost) -> None:
        if not silent:
            print(cost.text, file=sys.stderr)

    with bar("running", quiet=silent) as feed:
        conduct(experiment, folder, feed, announce=announce)
    table = present(folder, judge)
    if as_json:
        print((folder / SUMMARY).read_text(encoding="utf-8"), end="")
        return 0
    print(table.title)
    print_table(table.header, list(table.rows))
    print(folder / "robustness.svg")
    return 0
