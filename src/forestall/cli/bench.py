"""`forestall bench`: measurements, as a table and as JSON."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

Json = Annotated[bool, Parameter(name="--json", negative="")]

bench = App(name="bench", help="Measure.")


@bench.command
def speed(
    *,
    repeat: int = 10,
    seed: int = 0,
    as_json: Json = False,
    quiet: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Milliseconds per picture, graph, comparison and plan; seconds per episode.

    Args:
        repeat: how often each is timed (the episode: once with each strategy).
        seed: of the scene.
        as_json: print JSON instead of the table.
        quiet: no progress on standard error.
    """
    from forestall.cli.progress import bar
    from forestall.errors import InputError
    from forestall.speed import measure

    if repeat < 1:
        raise InputError(f"--repeat {repeat}: at least 1 is needed")
    with bar("measuring", quiet=quiet or as_json) as feed:
        report = measure(repeat, seed, feed)
    if as_json:
        print(json.dumps(report, indent=2))
        return 0
    from forestall.cli.listing import print_table

    print_table(
        ("what", "median", "least", "most", "unit", "aim", "median / aim"),
        [
            (
                r["what"],
                f"{r['median']:.2f}",
                f"{r['least']:.2f}",
                f"{r['most']:.2f}",
                r["unit"],
                "" if r["aim"] is None else f"{r['aim']:g}",
                "" if r["aim"] is None else f"{r['median'] / r['aim']:.2f}",
            )
            for r in report["rows"]
        ],
    )
    machine = report["machine"]
    print(f"{machine['processor']}, {machine['cores']} cores, {machine['platform']}")
    return 0


@bench.command
def episodes(
    *,
    task: Annotated[list[str] | None, Parameter(consume_multiple=True, negative="")] = None,
    scenario: Annotated[list[str] | None, Parameter(consume_multiple=True, negative="")] = None,
    strategy: Annotated[list[str] | None, Parameter(consume_multiple=True, negative="")] = None,
    seeds: str = "100:105",
    memory: Path | None = None,
    states: str = "learned",
    feature: str = "parts",
    encoder: str = "hashed-words",
    jobs: int | None = None,
    out: Path = Path("runs/episodes.jsonl"),
    as_json: Json = False,
    quiet: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Run many episodes and count successes and alarms; every alarm without scenario is false.

    Args:
        task: tasks to run undisturbed; all by default, none when only scenarios are named.
        scenario: scenarios to run, or names of sets (see `forestall scenarios`); "all" for every
            shipped one; none by default.
        strategy: strategies; none and proactive by default.
        seeds: scenes, e.g. 100:120 for 100 to 119.
        memory: a demonstration file; the ready-made one of each task by default.
        states: where object states come from: learned, clip or oracle.
        feature: what a node's feature encodes: text, parts or image.
        encoder: of texts: hashed-words, two-tower, sentence.
        jobs: how many processes; all cores by default.
        out: results, one JSON line each; what is in it already is not run again.
        as_json: print JSON instead of the table.
        quiet: no progress on standard error.
    """
    from forestall.cli.progress import bar
    from forestall.errors import InputError
    from forestall.survey import jobs_for, parse_seeds, survey, table
    from forestall.tasks.files import SETS, scenario_names, task_names

    if jobs is not None and jobs < 1:
        raise InputError(f"--jobs {jobs}: at least 1 is needed")
    of_sets = {"all": scenario_names(), **{of: scenario_names(of) for of in SETS}}
    scenarios = [s for name in scenario or [] for s in of_sets.get(name, (name,))]
    tasks = task or ([] if scenarios else list(task_names()))
    todo = jobs_for(
        tasks,
        scenarios,
        strategy or ["none", "proactive"],
        parse_seeds(seeds),
        None if memory is None else str(memory),
        states,
        feature,
        encoder,
    )
    with bar("running", quiet=quiet or as_json) as feed:
        rows = survey(todo, jobs or os.cpu_count() or 1, out, feed)
    lines = table(rows)
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
    print(f"seeds {seeds}, states: {states}, results in {out}")
    return 0
