"""`forestall import`: recorded runs of others as demonstrations and labelled failures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from forestall.cli.flags import SeeingFlags

if TYPE_CHECKING:
    from forestall.assembly.recorded import Opened
    from forestall.experiments.recorded import JudgedRun
    from forestall.types.recorded import ReadReport

DEFAULTS = SeeingFlags()
Json = Annotated[bool, Parameter(name="--json", negative="")]
Quiet = Annotated[bool, Parameter(negative="")]

MOST_TOLD = 12


def import_(
    data_set: str,
    folder: Path,
    out: Path | None = None,
    /,
    *,
    layout: Path | None = None,
    steps: Path | None = None,
    dry_run: Annotated[bool, Parameter(negative="")] = False,
    parts: SeeingFlags = DEFAULTS,
    as_json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Read recorded runs of others: good ones become demonstrations, failing ones labelled scenes.

    Pickles are read as plain data, and nothing in them is run. See docs/logs.md, docs/robofail.md.

    Args:
        data_set: whose or of what kind: folder, lerobot, mcap, record, robofail.
        folder: where it is; one file for mcap.
        out: a new folder for memory.db, failing.json, failing/ and report.json.
        layout: a TOML file that says which topic or column is what (docs/logs.md).
        steps: a CSV file that says when subtasks began: time_s, subtask, outcome, episode.
        dry_run: only show what would be read; every picture is decoded, nothing is written.
        parts: what pictures are seen with; states are the data set's by default.
        as_json: print the report as JSON.
        quiet: no progress on standard error.
    """
    from forestall.assembly.recorded import FAILING, MEMORY, import_into, open_data, report_of
    from forestall.cli.listing import say
    from forestall.cli.progress import bar
    from forestall.errors import InputError

    opened = open_data(data_set, folder, parts.given(), {"layout": layout, "steps": steps})
    if dry_run:
        return _shown(opened, as_json, quiet)
    if out is None:
        raise InputError("say into which new folder, or --dry-run")
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

    if report.unread:
        say(f"{len(report.unread)} runs could not be used:")
    for unread in report.unread[:MOST_TOLD]:
        say(f"  {unread.name}: {unread.why}")
    if len(report.unread) > MOST_TOLD:
        say(f"  ... and {len(report.unread) - MOST_TOLD} more (--json tells all)")
    for name, notes in list(report.notes.items())[:MOST_TOLD]:
        say(f"  {name}, left out: {'; '.join(notes)}")
