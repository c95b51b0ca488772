"""`forestall bench`: measurements, as a table and as JSON."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path

from cyclopts import App

from forestall.cli.flags import ComparingFlags, Flag, Json, Names

DEFAULTS = ComparingFlags()

bench = App(name="bench", help="Measure.")


@bench.command
def speed(
    *,
    repeat: int | None = None,
    seed: int = 0,
    out: Path | None = None,
    as_json: Json = False,
    quiet: Flag = False,
) -> int:
    """Milliseconds per picture, graph, comparison and plan; seconds per episode.

    Args:
        repeat: how often each is timed (the episode: once with each strategy).
        seed: of the scene.
        out: folder of the results; what is finished in it is not timed again. A new one under
            runs/ by default.
        as_json: print JSON instead of the table.
        quiet: no progress on standard error.
    """
    from forestall.cli.progress import bar
    from forestall.errors import InputError
    from forestall.experiments.speed import REPEAT, measure, table

    repeat = REPEAT if repeat is None else repeat
    if repeat < 1:
        raise InputError(f"--repeat {repeat}: at least 1 is needed")
    folder = out or Path("runs") / f"speed-{time.strftime('%Y%m%d-%H%M%S')}"
    with bar("measuring", quiet=quiet or as_json) as feed:
        report = measure(repeat, seed, folder, feed)
    if as_json:
        print(json.dumps(report, indent=2))
        return 0
    from forestall.cli.listing import print_table

    made = table(report)
    print_table(made.header, list(made.rows))
    print(made.note)
    return 0


@bench.command
def episodes(
    *,
    task: Names = None,
    scenario: Names = None,
    strategy: Names = None,
    seeds: str | None = None,
    jobs: int | None = None,
    out: Path | None = None,
    parts: ComparingFlags = DEFAULTS,
    as_json: Json = False,
    quiet: Flag = False,
) -> int:
    """Run many episodes and count successes and alarms; every alarm without scenario is false.

    Args:
        task: tasks to run undisturbed; all by default, none when only scenarios are named.
        scenario: scenarios to run, or names of sets (see `forestall scenarios`); "all" for every
            shipped one; none by default.
        strategy: none, retry-once, plan-check, proactive, online, online-scene, post-hoc, watch;
            none and proactive by default.
        seeds: scenes, e.g. 100:120 for 100 to 119.
        jobs: how many processes; all cores by default.
        out: folder of the results; what is finished in it is not run again. By default one under
            runs/ that only the same settings, code and memory share.
        parts: which parts.
        as_json: print JSON instead of the table.
        quiet: no progress on standard error.
    """
    from forestall.cli.progress import bar
    from forestall.errors import InputError
    from forestall.experiments.conduct import Experiment
    from forestall.experiments.episodes import (
        KIND,
        SEEDS,
        STRATEGIES,
        Episodes,
        count,
        folder_for,
        parse_seeds,
    )
    from forestall.experiments.settings import Settings
    from forestall.tasks.files import SETS, scenario_names, task_names

    of_sets = {"all": scenario_names(), **{of: scenario_names(of) for of in SETS}}
    scenarios = [s for name in scenario or [] for s in of_sets.get(name, (name,))]
    tasks = task or ([] if scenarios else list(task_names()))
    seeds = seeds or SEEDS
    chosen = Episodes(
        tuple(tasks), tuple(scenarios), tuple(strategy or STRATEGIES), tuple(parse_seeds(seeds))
    )
    workers = jobs if jobs is not None else os.cpu_count() or 1
    if workers < 1:
        raise InputError(f"--jobs {workers}: at least 1 is needed")
    settings = Settings(parts.given(), pages="none")
    experiment = Experiment(chosen, workers, settings=settings, kind=KIND)
    folder = folder_for(experiment, out)
    with bar("running", quiet=quiet or as_json) as feed:
        lines = count(experiment, folder, feed)
    states = next(p.name for p in settings.parts() if p.kind == "states")
    if as_json:
        print(json.dumps({"seeds": seeds, "states": states, "rows": lines}, indent=2))
        return 0
    from forestall.cli.listing import print_table

    print_table(
        ("task", "scenario", "strategy", "succeeded", "95 %", "alarms / boundaries", "new plans"),
        [
            (
                r["task"],
                r["scenario"] or "",
                r["strategy"],
                f"{r['succeeded']}/{r['n']}",
                f"{r['low']:.2f}-{r['high']:.2f}",
                f"{r['alarms']} / {r['boundaries']}",
                str(r["replans"]),
            )
            for r in lines
        ],
    )
    print(f"seeds {seeds}, states: {states}, results in {folder}")
    return 0
