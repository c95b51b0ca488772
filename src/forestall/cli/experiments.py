"""`forestall bench proactive | detection | ablation | all | report`: the paper's experiments."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import App, Parameter

from forestall.cli.flags import AblationFlags, ComparingFlags, Flag, Json, Names, SeeingFlags

if TYPE_CHECKING:
    from forestall.experiments.cost import Cost
    from forestall.statistics.tables import Table

MAIN_TABLES = ("sentences", "side-by-side", "strategies-side-by-side")
"""Printed; all of them are in the folder."""


@Parameter(name="*")
@dataclass(frozen=True)
class Options:
    """What every experiment can be told.

    Args:
        split: development (to look at and to tune on) or test (to report).
        seeds: how many scenes each scenario and task gets (a number, not a range).
        jobs: how many episodes at once; one for each core by default.
        limit: at most so many cases of each set, from all tasks in turn; for a first look.
        sets: only cases of these sets; `forestall cases list` names them.
        tasks: only cases of these; `forestall tasks list` names them.
        strategies: only runs of these: watch (all judges judge), none, retry-once, proactive,
            plan-check, online, online-scene, post-hoc. Without watch there are no figures of
            judges.
        profiles: of the household: honest (motions go wrong, the domain file does not know all) or
            kind. Honest by default, both for `all`.
        part: of the cases of each set in `all`, from all tasks in turn; 0.03 by default, which is
            an hour on two cores, 1 for every case, which takes many.
        quick: a tenth of it, of few tasks in few rooms, with fewer demonstrations and fewer
            strategies on each case: a first look in minutes.
        demonstrations: of each task in the honest household, each another way to do it (1 to 32);
            8 by default, 1 in a quick experiment.
        out: folder of the results; what is finished in it is not run again.
        engine: local (processes), ray, or inline (this process, one after the other).
        address: of a running Ray cluster; a local one is started by default.
        pages: which episodes get a page of their own (1.5 MB each): all, telling (the proactive
            runs of failing cases, and those with a false alarm) or none.
        as_json: print the summary as JSON instead of tables.
        quiet: no progress on standard error.
    """

    split: str = "test"
    seeds: int = 1
    jobs: int | None = None
    limit: int | None = None
    sets: Names = None
    tasks: Names = None
    strategies: Names = None
    profiles: Names = None
    part: float | None = None
    quick: Flag = False
    demonstrations: int | None = None
    out: Path | None = None
    engine: str = "local"
    address: str | None = None
    pages: str = "telling"
    as_json: Json = False
    quiet: Flag = False


DEFAULTS = Options()
PARTS = ComparingFlags()
ABLATED = AblationFlags()


def proactive(*, options: Options = DEFAULTS, parts: ComparingFlags = PARTS) -> int:
    """The paper's Table 1: success and time of none, post-hoc, online and proactive."""
    return _experiment("proactive", options, parts)


def detection(
    *, data: str | None = None, options: Options = DEFAULTS, parts: ComparingFlags = PARTS
) -> int:
    """The paper's Fig. 8a: what detectors find, how early, and how often they cry wolf.

    Args:
        data: recorded runs of others to judge, in the place of runs of our own: robofail:FOLDER
            (docs/robofail.md). Of the other options --memory, --json and --quiet are for them.
        options: of the experiment.
        parts: which parts.
    """
    if data is None:
        return _experiment("detection", options, parts)
    from forestall.cli.importing import bench_data
    from forestall.errors import InputError

    for_data = replace(DEFAULTS, as_json=options.as_json, quiet=options.quiet)
    if options != for_data:
        own = next(f.name for f in fields(Options) if _differ(options, for_data, f.name))
        raise InputError(f"--{own} says nothing of recorded runs: leave it out with --data")
    seeing = SeeingFlags(**{f.name: getattr(parts, f.name) for f in fields(SeeingFlags)})
    return bench_data(data, parts.memory, seeing, as_json=options.as_json, quiet=options.quiet)


def ablation(*, options: Options = DEFAULTS, parts: AblationFlags = ABLATED) -> int:
    """The paper's Table 2: the score without its parts, replanning without reasoning.

    With --llm also reasoning by a language model, and by one that plans, too.
    """
    return _experiment("ablation", options, parts)


def transfer(*, options: Options = DEFAULTS, parts: ComparingFlags = PARTS) -> int:
    """Judges with the demonstrations of the other nine tasks alone: none of the task at hand."""
    return _experiment("transfer", options, parts)


def everything(*, options: Options = DEFAULTS, parts: ComparingFlags = PARTS) -> int:
    """All of them, on one set of episodes."""
    return _experiment("all", options, parts)


def report(
    folder: Path,
    /,
    *,
    out: Path | None = None,
    as_json: Json = False,
) -> int:
    """Make the tables, figures and page of a folder of results again; nothing is run.

    Args:
        folder: where an experiment left its results; its episodes may be packed with xz.
        out: folder to write to; that of the results by default.
        as_json: print the summary as JSON instead of tables.
    """
    from forestall.experiments.results import present

    return _show(*present(folder, out), out or folder, as_json)


def register(bench: App) -> None:
    """Add the experiments to `forestall bench`."""
    for command in (proactive, detection, ablation, transfer, report):
        bench.command(command)
    bench.command(everything, name="all")


def _differ(one: Options, other: Options, name: str) -> bool:
    return bool(getattr(one, name) != getattr(other, name))


def _experiment(name: str, options: Options, parts: ComparingFlags) -> int:
    from forestall.cli.progress import bar
    from forestall.experiments.conduct import Experiment, conduct
    from forestall.experiments.results import present
    from forestall.experiments.runs import PART, Choice
    from forestall.experiments.settings import Settings

    settings = Settings(parts.given(), pages=options.pages)
    experiment = Experiment(
        Choice(
            name,
            options.split,
            options.seeds,
            options.limit,
            tuple(options.sets or ()),
            tuple(options.strategies or ()),
            tuple(options.profiles or ()),
            PART if options.part is None else options.part,
            options.quick,
            options.demonstrations,
            models=name == "ablation" and settings.asks,
            tasks=tuple(options.tasks or ()),
        ),
        options.jobs if options.jobs is not None else os.cpu_count() or 1,
        options.engine,
        options.address,
        settings,
    )
    out = options.out or Path("runs") / f"{name}-{options.split}"
    quiet = options.quiet or options.as_json

    def announce(cost: Cost) -> None:
        if not quiet:
            print(cost.text, file=sys.stderr)

    with bar("running", quiet=quiet) as feed:
        conduct(experiment, out, feed, announce=announce)
    return _show(*present(out), out, options.as_json)


def _show(summary: dict[str, Any], tables: Sequence[Table], folder: Path, as_json: bool) -> int:
    if as_json:
        print(json.dumps(summary, indent=2))
        return 0
    from rich.console import Console

    from forestall.cli.listing import print_table
    from forestall.reading.printing import printable

    console = Console(highlight=False)
    for table in tables:
        if table.name in MAIN_TABLES:
            console.print(f"\n[bold]{table.title}[/]")
            print_table(table.header, list(table.rows))
    for line in summary["profiles"][summary["shown"]]["orderings"]:
        console.print(printable(line["sentence"]), soft_wrap=True, markup=False)
    for name, value in summary["meta"]["effort"].items():
        console.print(printable(f"{name}: {value}"), soft_wrap=True, markup=False)
    print(folder / "index.html")
    return 0
