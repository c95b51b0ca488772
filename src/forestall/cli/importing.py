"""`forestall import`: recorded runs of others as demonstrations and failures, and their plans."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from forestall.cli.flags import Flag, Json, SeeingFlags

if TYPE_CHECKING:
    from forestall.assembly.recorded import Opened
    from forestall.experiments.recorded import JudgedRun
    from forestall.seams.others import PlanSet
    from forestall.types.recorded import ReadReport, Unread

DEFAULTS = SeeingFlags()

MOST_TOLD = 12


def import_(
    data_set: str,
    folder: Path,
    out: Path | None = None,
    /,
    *,
    layout: Path | None = None,
    steps: Path | None = None,
    dry_run: Flag = False,
    parts: SeeingFlags = DEFAULTS,
    as_json: Json = False,
    quiet: Flag = False,
) -> int:
    """Read recorded runs of others, or plans of others.

    Of runs good ones become demonstrations, failing ones labelled scenes; pickles are read as plain
    data, and nothing in them is run (docs/logs.md, docs/robofail.md). Plans go through the plan
    check, and conditions around their steps become safety rules of a domain
    (docs/plans-of-others.md).

    Args:
        data_set: whose runs or logs: folder, lerobot, mcap, record, robofail; whose plans: isbench,
            safeagentbench.
        folder: where it is: a folder; of mcap and of plans also one file.
        out: a new folder: for memory.db, failing.json, failing/ and report.json of runs, for
            plans/, domains/ and report.json of plans.
        layout: of a log: a TOML file that says which topic or column is what (docs/logs.md).
        steps: of a log: a CSV file: time_s, subtask and, if wanted, outcome and episode.
        dry_run: of runs: show what would be read; all is decoded, nothing is written.
        parts: what pictures are seen with; states are the data set's by default.
        as_json: print the report as JSON.
        quiet: no progress on standard error.
    """
    from forestall.assembly.recorded import FAILING, MEMORY, import_into, open_data, report_of
    from forestall.assembly.registry import imported_sets, plan_set
    from forestall.cli.listing import say
    from forestall.cli.progress import bar
    from forestall.errors import InputError, UnknownNameError

    plans = plan_set(data_set)
    if plans is None and data_set not in imported_sets():
        raise UnknownNameError("data set", data_set, imported_sets())
    how = {"layout": layout, "steps": steps}
    if plans is not None:
        if dry_run or layout is not None or steps is not None:
            raise InputError(f"{data_set} has plans: --dry-run, --layout and --steps are of runs")
        return _plans(plans(folder), _new(out), parts, as_json=as_json, quiet=quiet)
    opened = open_data(data_set, folder, parts.given(), how)
    if dry_run:
        return _shown(opened, as_json, quiet)
    out = _new(out)
    with bar("reading", quiet=quiet or as_json) as feed:
        report = import_into(opened, out, feed)
    if as_json:
        print(json.dumps(report_of(report), indent=2))
        return 0
    say(f"{len(report.good)} good runs in {out / MEMORY}")
    say(f"{len(report.failing)} failing runs in {out / FAILING}")
    _tell(report)
    return 0


def _shown(opened: Opened, as_json: bool, quiet: bool) -> int:
    """What would be read of each run."""
    from dataclasses import asdict

    from forestall.assembly.recorded import outlines
    from forestall.cli.listing import print_table, say
    from forestall.cli.progress import bar

    with bar("reading", quiet=quiet or as_json) as feed:
        found = list(outlines(opened, feed))
    if as_json:
        print(json.dumps([asdict(outline) for outline in found], indent=2))
        return 0
    for one in found:
        if one.why_not:
            say(f"{one.name}: cannot be used: {one.why_not}")
            continue
        what = one.fails or "a good run, a demonstration"
        say(f"{one.name}: {what}; task {one.task or 'not told'}; {one.looks} looks: {one.pictures}")
        print_table(
            ("step", "begins", "subtask", "ended"),
            [(str(n), f"{s.time_s:.1f} s", s.subtask, s.ended) for n, s in enumerate(one.steps, 1)],
        )
        for note in one.left_out:
            say(f"  left out: {note}")
    return 0


def _new(out: Path | None) -> Path:
    """The folder that is written to."""
    from forestall.errors import InputError

    if out is None:
        raise InputError("say into which new folder, or --dry-run")
    return out


def _plans(plans: PlanSet, out: Path, parts: SeeingFlags, *, as_json: bool, quiet: bool) -> int:
    """Plans of others: what their check comes to, by the authors' label."""
    from forestall.assembly.foreign_plans import REPORT, import_plans
    from forestall.cli.listing import print_table, say
    from forestall.cli.progress import bar
    from forestall.errors import InputError

    if parts.given().kinds():
        raise InputError(f"{plans.name} has plans and no pictures: no part can be chosen for it")
    with bar("checking", quiet=quiet or as_json) as feed:
        report = import_plans(plans, out, feed)
    if as_json:
        print(json.dumps(report.to_json(), indent=2))
        return 0
    counts = report.counts()
    results = sorted({r for _, by in counts for r in by})
    print_table(
        ("plans", *results),
        [(label or "all", *(str(by.get(r, 0)) for r in results)) for label, by in counts],
    )
    lacking = [c.plan for c in report.checked if c.plan.left_out]
    say(f"{len(report.checked)} plans converted, {len(lacking)} of them in part")
    for plan in lacking[:MOST_TOLD]:
        say(f"  {plan.name}, left out: {'; '.join(plan.left_out)}")
    _unread(report.unread, "plans could not be converted")
    say(f"all of it: {out / REPORT}")
    return 0


def bench_data(
    data: str, memory: Path | None, parts: SeeingFlags, *, as_json: bool, quiet: bool
) -> int:
    """`forestall bench detection --data NAME:FOLDER`: the judges on recorded runs of others."""
    from forestall.assembly.recorded import named_data, open_data, report_of
    from forestall.cli.listing import print_table, say
    from forestall.cli.progress import bar
    from forestall.cli.third_party import share
    from forestall.experiments.recorded import judge_recorded, lines_of
    from forestall.experiments.third_party_rows import JUDGES, changes
    from forestall.memory.store import open_store
    from forestall.types.recorded import ReadReport

    opened, report = open_data(*named_data(data), parts.given()), ReadReport()
    shown = []
    if memory is not None:
        with open_store(memory) as store:
            shown = list(store.required())
    silent = quiet or as_json
    with bar("reading", quiet=silent) as reading, bar("judging", quiet=silent) as judging:
        judged = judge_recorded(opened, shown, report, reading, judging)
    lines = lines_of(judged)
    if as_json:
        told = {
            **report_of(report),
            "rows": [line.to_json() for line in lines],
            "runs": [_run(j) for j in judged],
        }
        print(json.dumps(told, indent=2))
        return 0
    say(f"{opened.data.name}: {len(report.good)} good runs, {len(report.failing)} failing ones")
    print_table(
        ("judge", "good runs alarmed", "by the failing step", "by the step after", "in the run"),
        [(r.judge, *map(share, (r.false_alarms, r.at_step, r.by_next, r.ever))) for r in lines],
    )
    if report.failing:
        say("detected by the step after the failing one, by kind of failure")
        until = [j.until(1) for j in judged]
        print_table(
            ("kind", "runs", *JUDGES),
            [(c, str(n), *map(str, by)) for c, n, by in changes(until, until[0].knowledge)],
        )
    _tell(report)
    return 0


def _run(judged: JudgedRun) -> dict[str, object]:
    """Everything that was said of a run."""
    from forestall.cli.third_party import told

    fails = None if judged.fails is None else judged.fails + 1
    return {**told(judged.judged), "fails_at_step": fails}


def _tell(report: ReadReport) -> None:
    """What was not read, and why."""
    from forestall.cli.listing import say

    _unread(report.unread, "runs could not be used")
    for name, notes in list(report.notes.items())[:MOST_TOLD]:
        say(f"  {name}, left out: {'; '.join(notes)}")


def _unread(unread: Sequence[Unread], what: str) -> None:
    from forestall.cli.listing import say

    if unread:
        say(f"{len(unread)} {what}:")
    for one in unread[:MOST_TOLD]:
        say(f"  {one.name}: {one.why}")
    if len(unread) > MOST_TOLD:
        say(f"  ... and {len(unread) - MOST_TOLD} more (--json tells all)")
