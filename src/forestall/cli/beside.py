"""`forestall beside` and `run --beside`: the same start under other strategies, beside a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from forestall.cli.flags import Flag, Names

if TYPE_CHECKING:
    from forestall.assembly.configuration import RunConfig
    from forestall.assembly.make import Prepared
    from forestall.seams.running import Listener
    from forestall.types.demonstration import Demonstration
    from forestall.types.episode import EpisodeRecord

    Lent = tuple[Sequence[Demonstration] | None, str | None]
    """Demonstrations, and where they are from."""

ALL = "all"
"""Said in the place of a strategy: the paper's four, on one timeline."""

FIRST, OTHERS = "proactive", ("none", "post-hoc", "online")
"""The paper's four; the others lie beside the first."""


def beside(
    run: Path,
    /,
    *,
    strategy: Names = None,
    quiet: Flag = False,
) -> int:
    """Run what a run began with once more, under another strategy, and draw its page again.

    Without a strategy: what it would have cost to have no monitor.

    Args:
        run: the folder of a run (see docs/record-format.md).
        strategy: one or several of none (the default), retry-once, proactive, plan-check, online,
            online-scene, post-hoc and watch; all is the paper's four.
        quiet: no progress on standard error.
    """
    from forestall.assembly.again import config_of
    from forestall.files import alone
    from forestall.records.record import read_record

    with alone(run):
        record = read_record(run)
        config = config_of(record)
        wanted = named(strategy or ["none"], record.strategy)
        others = run_beside(config, run, record, wanted, quiet=quiet)
        page = _drawn(record, run)
    told(record, others)
    print(page)
    return 0


def named(strategies: Sequence[str], own: str) -> tuple[str, ...]:
    """The strategies that are meant, `all` written out, each once and without the run's own."""
    every = [n for s in strategies for n in ((FIRST, *OTHERS) if s == ALL else (s,))]
    if ALL in strategies:
        every = [n for n in every if n != own]
    return tuple(dict.fromkeys(every))


def run_beside(
    config: RunConfig,
    folder: Path,
    record: EpisodeRecord,
    strategies: Sequence[str],
    lent: Lent = (None, None),
    *,
    quiet: bool = False,
) -> tuple[EpisodeRecord, ...]:
    """Run the same start under other strategies, each into a folder of its own.

    Args:
        config: of the run.
        folder: of the run, which this process holds.
        record: of the run.
        strategies: names of others than its own.
        lent: its demonstrations and where they are from, where there are any.
        quiet: no progress on standard error.

    Returns:
        All finished runs beside the run, earlier ones among them.

    Raises:
        InputError: a strategy is not valid, or what files say is no longer what it was.
    """
    from forestall.assembly.again import under
    from forestall.assembly.make import needs_memory, prepare
    from forestall.cli.demos import memory_of
    from forestall.files import replace_file
    from forestall.records.beside import BESIDE_NAME, TIMELINE_NAME
    from forestall.records.beside import beside as beside_of
    from forestall.report.beside_view import beside_view

    for prepared in [prepare(under(config, name)) for name in strategies]:
        used: Lent = (None, None)
        if needs_memory(prepared.config):
            used = lent = memory_of(prepared.config, quiet) if lent[0] is None else lent
        _run_one(prepared, folder, record, used, quiet)
    found = beside_of(folder, record)
    view = beside_view(record, found)
    if view is not None:
        replace_file(folder / BESIDE_NAME / TIMELINE_NAME, view.drawing)
    return found


def recorded(
    prepared: Prepared,
    folder: Path,
    lent: Lent,
    quiet: bool,
    beside: Mapping[str, Any] | None = None,
    also: Sequence[Listener] = (),
) -> EpisodeRecord:
    """Run one episode; its record and its page are in the folder.

    Args:
        prepared: the run.
        folder: nobody else writes to it.
        lent: demonstrations and where they are from; None, None for a strategy that uses none.
        quiet: no progress on standard error.
        beside: which run this is beside.
        also: who else listens.
    """
    from forestall.assembly.make import run_episode
    from forestall.records.listeners import ProgressLine
    from forestall.records.record import RECORD_NAME, RunRecorder, write_record
    from forestall.report.page import write_page

    page = folder / "index.html"
    recorder = RunRecorder(folder, page=str(page))
    with ProgressLine(quiet=quiet) as line:
        listeners: list[Listener] = [recorder, line, *also]
        record = run_episode(prepared, lent[0], listeners, lent[1], beside=beside)
    if not (folder / RECORD_NAME).exists():  # the recorder may fail and the run go on
        write_record(folder, record, page=str(page))
    write_page(record, page, folder)
    return record


def _run_one(
    prepared: Prepared, folder: Path, record: EpisodeRecord, lent: Lent, quiet: bool
) -> None:
    from forestall.errors import InputError
    from forestall.kinds import STRATEGY
    from forestall.records.beside import beside_what, folder_beside, same_start

    place = folder_beside(folder, prepared.config.choice(STRATEGY).name)
    other = recorded(prepared, place, lent, quiet, beside_what(record))
    if not same_start(record, other):
        raise InputError(
            f"{folder} began otherwise: its task, scenario or domain has changed since, and "
            f"{place} is no run beside it"
        )


def told(record: EpisodeRecord, others: Sequence[EpisodeRecord]) -> None:
    """Print a table of the runs."""
    from rich.console import Console
    from rich.table import Table

    from forestall.reading.printing import shown
    from forestall.report.beside_view import COLUMNS, LONG, beside_rows

    console = Console(highlight=False)
    table = Table(box=None, padding=(0, 2, 0, 0))
    columns = COLUMNS[: -len(LONG)]
    for name, right in columns:
        table.add_column(name, justify="right" if right else "left", no_wrap=True)
    rows = beside_rows(record, others)
    for row in rows:
        table.add_row(*(shown(cell) for cell in row.cells[: len(columns)]))
    console.print(table)
    for row in rows:
        if row.cells[-1]:
            console.print(f"  {shown(f'{row.cells[0]}: {row.cells[-1]}')}", soft_wrap=True)


def beside_json(others: Sequence[EpisodeRecord], folder: Path) -> list[dict[str, Any]]:
    """What `--json` says of the runs beside a run."""
    from forestall.records.beside import folder_beside
    from forestall.records.derived import replans

    return [
        {
            "strategy": other.strategy,
            "success": other.success,
            "end": other.end.value,
            "failures": list(other.failures),
            "harmed": [list(harm) for harm in other.harmed],
            "replans": replans(other),
            "simulated_s": other.simulated_s,
            "folder": str(folder_beside(folder, other.strategy)),
        }
        for other in others
    ]


def _drawn(record: EpisodeRecord, folder: Path) -> Path:
    from forestall.report.page import write_page

    return write_page(record, folder / "index.html", folder)
