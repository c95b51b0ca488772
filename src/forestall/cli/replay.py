"""`forestall replay`: what a monitor would have said of a recorded run, and when."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from forestall.cli.flags import Json, RunFlags

if TYPE_CHECKING:
    from forestall.assembly.replaying import Replayed, Said
    from forestall.types.recorded import ReadReport, RecordedRun, Unread


DEFAULTS = RunFlags()
_LONGEST = 90


def replay(
    log: str,
    /,
    *,
    run: str | None = None,
    layout: Path | None = None,
    steps: Path | None = None,
    page: Path | None = None,
    show: Annotated[str | None, Parameter(name="--log")] = None,
    parts: RunFlags = DEFAULTS,
    as_json: Json = False,
) -> int:
    """Judge a recorded run step by step; nothing stops at an alarm.

    Exit code 0: nothing would have been said; 1: an alarm; 2: the input is not valid; 4: something
    could not be judged: a step, or one of several runs that cannot be read. See docs/logs.md.

    Args:
        log: the kind of log and where it is: folder:FOLDER, lerobot:FOLDER, mcap:FILE,
            record:FOLDER, robofail:FOLDER.
        run: the name of one of its runs; all of them by default.
        layout: a TOML file that says which topic or column is what.
        steps: a CSV file that says when subtasks began.
        page: an HTML file to write about it, of one run.
        show: a log to write of it, of one run: rerun:FILE for the Rerun viewer.
        parts: who judges; --memory FILE unless the strategy needs none.
        as_json: print JSON.
    """
    from forestall.assembly.demonstrations import memory_path
    from forestall.assembly.logs import export, showing
    from forestall.assembly.make import needs_memory
    from forestall.assembly.recorded import named_data, open_data
    from forestall.assembly.replaying import judged_of, replay_config
    from forestall.assembly.replaying import replay as replayed
    from forestall.cli.demos import memory_of
    from forestall.cli.listing import warn
    from forestall.errors import InputError
    from forestall.report.page import write_page
    from forestall.types.recorded import ReadReport

    given, writer = parts.given(), None if show is None else showing(show)
    shown = page is not None or writer is not None
    opened = open_data(*named_data(log), given, {"layout": layout, "steps": steps})
    config = replay_config(opened, given)
    demonstrations, memory = None, None
    if needs_memory(config):
        if memory_path(config) is None:
            raise InputError("give --memory FILE, or --strategy plan-check, which needs none")
        demonstrations, memory = memory_of(config, as_json)
    found: list[Replayed] = []
    report = ReadReport()

    def judge(one: RecordedRun) -> Replayed:
        if shown and found:
            raise InputError("--page and --log are of one run: name it with --run")
        return replayed(opened, one, demonstrations, memory, given, pictures=shown)

    for one in judged_of(opened, run, report, judge):
        found.append(one)
        if not as_json:
            _tell(one)
    if not found:
        raise InputError(_none_of(log, report))
    if page is not None:
        write_page(found[0].judgements.record, page)
    if writer is not None:
        export(found[0].judgements.record, None, writer)
    if as_json:
        print(json.dumps([*map(_json, found), *map(_unread_json, report.unread)], indent=2))
    elif page is not None:
        print(page)
    for unread in report.unread:
        warn(f"{unread.name}: not judged: {unread.why}")
    said = [j for one in found for j in one.judgements.each]
    if any(j.alarm for j in said):
        return 1
    return 0 if not report.unread and all(j.judged for j in said) else 4


def _tell(found: Replayed) -> None:
    """One line for each moment."""
    from forestall.cli.listing import print_table, say

    run = found.run
    label = "went well" if run.fails is None else f"failed at step {run.fails + 1}: {run.why}"
    say(f"{run.name}: {label}")
    print_table(
        ("step", "time", "subtask", "in the log", "monitor", "score", "why"),
        [
            (
                str(s.step + 1),
                f"{s.time_s:.1f} s",
                str(s.judgement.record.subtask),
                s.ended,
                s.judgement.decision.outcome.value,
                _score(s),
                _why(s)[:_LONGEST],
            )
            for s in found.timeline
        ],
    )


def _score(said: Said) -> str:
    verdict = said.judgement.decision.verdict
    return "-" if verdict is None or verdict.score is None else f"{verdict.score:.2f}"


def _why(said: Said) -> str:
    decision = said.judgement.decision
    cause = "" if decision.diagnosis is None else decision.diagnosis.cause
    return cause if said.judgement.alarm and cause else decision.why


def _none_of(log: str, report: ReadReport) -> str:
    """Why nothing was judged: of the first run, for example."""
    text = f"{log}: no run of it can be used; 'forestall import --dry-run' says why"
    return f"{text}: {one.name}: {one.why}" if (one := next(iter(report.unread), None)) else text


def _unread_json(unread: Unread) -> dict[str, Any]:
    """A run that cannot be used, with the same entries as one that can."""
    return {
        "run": unread.name,
        "task": None,
        "fails_at_step": None,
        "kind": "",
        "why": "",
        "left_out": [],
        "why_not": unread.why,
        "timeline": [],
    }


def _json(found: Replayed) -> dict[str, Any]:
    run = found.run
    return {
        "run": run.name,
        "task": run.task or None,
        "fails_at_step": None if run.fails is None else run.fails + 1,
        "kind": run.kind,
        "why": run.why,
        "left_out": list(run.left_out),
        "why_not": "",
        "timeline": [
            {
                "step": s.step + 1,
                "time_s": s.time_s,
                "moment": s.judgement.record.when.value,
                "subtask": str(s.judgement.record.subtask),
                "in_the_log": s.ended,
                "outcome": s.judgement.decision.outcome.value,
                "alarm": s.judgement.alarm,
                "judged": s.judgement.judged,
                "score": None
                if s.judgement.decision.verdict is None
                else s.judgement.decision.verdict.score,
                "why": _why(s),
                "graph": s.judgement.record.scoped.to_json(),
            }
            for s in found.timeline
        ],
    }
