"""`forestall run`: the main job."""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from forestall.cli.beside import (
    ALL,
    FIRST,
    OTHERS,
    beside_json,
    named,
    recorded,
    run_beside,
    told,
)
from forestall.cli.demos import memory_of
from forestall.cli.flags import Flag, Json, Names, RunFlags

if TYPE_CHECKING:
    from forestall.types.episode import EpisodeRecord


DEFAULTS = RunFlags()


def run(
    task: str,
    /,
    *,
    scenario: str | None = None,
    seed: int | None = None,
    without: str | None = None,
    out: Path | None = None,
    log: str | None = None,
    beside: Names = None,
    parts: RunFlags = DEFAULTS,
    as_json: Json = False,
    quiet: Flag = False,
    live: Flag = False,
) -> int:
    """Run one task from pixels to a plan that works, and write a page about it.

    Args:
        task: a task's name (see `forestall tasks`) or a task file.
        scenario: what goes wrong (see `forestall scenarios`), or a scenario file.
        seed: of the scene.
        without: a part to leave out: subtask-node, structure, nodes, edges, reasoning, validation.
        out: folder for the record, its pictures and the page; a new one under runs/ by default.
        log: keep all that is seen and done, too: mcap:FILE, lerobot:FOLDER or folder:FOLDER, for
            `forestall import` and `forestall replay`; rerun:FILE for a viewer (docs/logs.md).
        beside: strategies that the same start is run under as well; none: what it would have cost
            to have no monitor.
        parts: which parts; the strategy `all` is proactive beside none, post-hoc and online.
        as_json: print one record as JSON and nothing else on standard output.
        quiet: no progress on standard error.
        live: show the run in a browser while it happens, and its page until Ctrl-C.
    """
    from forestall.assembly.again import under
    from forestall.assembly.configuration import run_config
    from forestall.assembly.logs import logging_to
    from forestall.assembly.make import needs_memory, prepare
    from forestall.assembly.other_eyes import other_eyes
    from forestall.files import alone, make_folder
    from forestall.kinds import STRATEGY
    from forestall.records.codec import record_to_json
    from forestall.records.derived import provenance_of
    from forestall.records.record import read_record
    from forestall.report.page import write_page

    also = list(beside or ())
    if parts.strategy == ALL:
        parts, also = replace(parts, strategy=FIRST), [*OTHERS, *also]
    given, of_run = parts.read()
    flags = {"scenario": scenario, "seed": seed, "without": without}
    of_run |= {name: value for name, value in flags.items() if value is not None}
    config = run_config(task, given=given, final_look=log is not None, **of_run)
    strategy = config.choice(STRATEGY).name
    others = named(also, strategy)
    for name in others:
        prepare(under(config, name))
    prepared = prepare(config)
    called = None if prepared.scenario is None else prepared.scenario.name
    folder = out or _new_folder(prepared.loaded.task.name, called, strategy, config.seed)
    make_folder(folder)
    page = folder / "index.html"
    with _shown(folder, live) as stay:
        with alone(folder):
            lent = memory_of(config, quiet) if needs_memory(config) else (None, None)
            with logging_to(log) as logs:
                record = recorded(prepared, folder, lent, quiet, also=logs)
            found = run_beside(config, folder, record, others, lent, quiet=quiet) if others else ()
            if found:
                write_page(record, page, folder)
            if eyes := other_eyes(lent[0] or (), provenance_of(record, "perception")):
                print(f"forestall: {eyes}", file=sys.stderr)
            data = record_to_json(read_record(folder), page=str(page))
        if as_json:
            more = {"beside": beside_json(found, folder)} if others else {}
            print(json.dumps({**data, **more}, indent=2), flush=True)
        else:
            _summary(data)
            if found:
                told(record, found)
            print(page)
        stay()
    return _code(record)


@contextmanager
def _shown(folder: Path, live: bool) -> Iterator[Callable[[], None]]:
    """Show a run in a browser while it happens; yields what waits until it was seen enough."""
    if not live:
        yield lambda: None
        return
    from forestall.cli.view import serving_run

    with serving_run(folder) as address:
        print(f"live: {address}", file=sys.stderr, flush=True)

        def stay() -> None:
            print(f"the page stays at {address} until Ctrl-C", file=sys.stderr, flush=True)
            _until_stopped()

        yield stay


def _until_stopped() -> None:
    """Wait for Ctrl-C."""
    with suppress(KeyboardInterrupt):
        threading.Event().wait()


def _code(record: EpisodeRecord) -> int:
    """The exit code of a run; what held or broke it is said on standard error."""
    from forestall.cli.main import OF_ITS_OWN
    from forestall.reading.printing import shown
    from forestall.types.episode import TroubleKind

    trouble = record.trouble
    if trouble is None:
        return 0 if record.success else 1
    print(f"forestall: held: {shown(trouble.text)}", file=sys.stderr)
    codes = {
        TroubleKind.INTERNAL: OF_ITS_OWN,
        TroubleKind.SENSES: 4,
        TroubleKind.TOO_MANY: 1,
    }
    return codes.get(trouble.kind, 3)


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _new_folder(task: str, scenario: str | None, strategy: str, seed: int) -> Path:
    from forestall.files import make_folder

    stamp = time.strftime("%Y%m%d-%H%M%S")
    folder = Path("runs") / "-".join((task, scenario or "undisturbed", strategy, str(seed), stamp))
    make_folder(folder.parent)
    number = 2
    while True:
        try:
            folder.mkdir()
        except FileExistsError:  # of another run that began in this second
            folder = folder.with_name(f"{folder.name.partition('+')[0]}+{number}")
            number += 1
        else:
            return folder


def _summary(data: dict[str, Any]) -> None:
    from rich.console import Console

    from forestall.reading.printing import shown

    console = Console(highlight=False)
    good = bool(data["success"])
    console.print(
        f"[bold {'green' if good else 'red'}]{'success' if good else 'failed'}[/] "
        f"{shown(str(data['task']))} · {shown(str(data['scenario'] or 'undisturbed'))} · "
        f"{data['strategy']} · seed {data['seed']}"
    )
    for failure in data["failures"]:
        console.print(f"  not reached: {shown(failure)}")
    for alarm in data["alarms"]:
        score = "plan check"
        if alarm["score"] is not None:
            score = f"score {alarm['score']:.2f} < {alarm['threshold']:.2f}"
        console.print(
            f"  alarm before {shown(alarm['subtask'])}: {score}: {shown(alarm['cause'] or '')}",
            soft_wrap=True,
        )
        if alarm["sentence"]:
            console.print(f"    {shown(alarm['sentence'])}", soft_wrap=True)
    console.print(
        f"  {len(data['executed'])} subtasks, {_count(data['replans'], 'new plan')}, "
        f"{data['simulated_s']:.0f} s of robot time, {data['reasoning_s']:.1f} s of reasoning; "
        f"states: {shown(str(data['perception']['state_estimator']))}",
        soft_wrap=True,
    )
