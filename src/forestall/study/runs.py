"""Finished runs among results: which of them failed while all detectors watched, and when to alarm.

Called by `making.py`; calls records, experiments, tasks. A run may lie in a folder of its own
(`forestall run --strategy watch`), several in one folder, or in that of an experiment
(`--pages all`), whose rows then say from when on its failure could be known.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from forestall.domain.load import load_domain
from forestall.domain.model import Domain
from forestall.domain.spoken import Spoken, listed, sentence
from forestall.errors import InputError
from forestall.experiments.folder import ABOUT, episodes_in
from forestall.experiments.worker import PAGES
from forestall.records.record import LINES_NAME, RECORD_NAME, read_record
from forestall.statistics.rows import KIND, EpisodeRow
from forestall.statistics.watches import WATCH
from forestall.tasks.files import Scenario, load_scenario, load_task
from forestall.types.episode import EpisodeRecord
from forestall.types.facts import Literal

_MOST_DEEP = 3


@dataclass(frozen=True, slots=True)
class Failure:
    """A run that failed while everybody watched and nobody stepped in.

    Args:
        folder: of its record.
        record: of it.
        domain: that it was read in.
        cause: the true one, in words.
        known: index of the first boundary at which an alarm is no guess.
        effect: index of the last at which it is in time.
        profile: of the household, where an experiment ran it.
    """

    folder: Path
    record: EpisodeRecord
    domain: Domain
    cause: str
    known: int
    effect: int
    profile: str = KIND


Twins = dict[tuple[str, int, str], tuple[Path, EpisodeRecord]]
"""(task, seed, profile) → the successful run in which nothing was disturbed."""


@dataclass(frozen=True, slots=True)
class Runs:
    """What results hold for a study.

    Args:
        failures: in order.
        twins: their undisturbed twins.
        left_out: reason → how many runs.
    """

    failures: tuple[Failure, ...]
    twins: Twins
    left_out: Counter[str]


def runs_in(results: Sequence[Path]) -> Runs:
    """Every run in some folders.

    Args:
        results: folders of runs or experiments, or of several of them.

    Raises:
        InputError: one is no folder, or none holds a run.
        FileFormatError: a record or a row is damaged.
    """
    found: list[Failure] = []
    twins: Twins = {}
    left_out: Counter[str] = Counter()
    count = 0
    for result in results:
        if not result.is_dir():
            raise InputError(f"--from {result}: name a folder of runs or of an experiment")
        for folder, row in _folders(result, _MOST_DEEP):
            count += 1
            record = read_record(folder)
            profile = KIND if row is None else row.profile
            if record.scenario is None and record.success:
                twins.setdefault((record.task.name, record.seed, profile), (folder, record))
                continue
            failure = _failure(folder, record, row)
            if isinstance(failure, str):
                left_out[failure] += 1
            else:
                found.append(failure)
    if not count:
        raise InputError(
            f"no run lies in {', '.join(map(str, results))}: record some with forestall run "
            "--strategy watch, or run an experiment with --strategies watch --pages all"
        )
    return Runs(tuple(found), twins, left_out)


def _folders(place: Path, deep: int) -> Iterator[tuple[Path, EpisodeRow | None]]:
    """The folders of runs, with the row that an experiment kept."""
    if (place / RECORD_NAME).is_file() or (place / LINES_NAME).is_file():
        yield place, None
    elif (place / ABOUT).is_file():
        for key, row in episodes_in(place).rows().items():
            folder = place / PAGES / key
            if row.strategy == WATCH and (folder / RECORD_NAME).is_file():
                yield folder, row
    elif deep:
        for inner in sorted(p for p in place.iterdir() if p.is_dir() and not p.is_symlink()):
            yield from _folders(inner, deep - 1)


def _failure(folder: Path, record: EpisodeRecord, row: EpisodeRow | None) -> Failure | str:
    """A run as a failure; the reason where it is none that can be asked about."""
    if record.strategy != WATCH:
        return f"not watched by all detectors (strategy {record.strategy})"
    if record.success is None:
        return "not finished"
    if record.success:
        return "did not fail"
    domain = _domain(record)
    if row is not None:
        known, effect = row.known, row.effect
        if row.scenario is not None and row.slips:
            return "failed for more than one reason"
        facts: tuple[str, ...] = row.causes
    elif record.scenario is None:
        return "failed without a scenario, and no experiment says why"
    else:
        known, effect = _scenario(record).moments(record.initial_plan)
        facts = ()
    if known is None or effect is None or effect < known:
        return "the failure could not be known before it came"
    cause = _cause(record, domain, facts)
    if not cause:
        return "nobody says why it failed"
    profile = KIND if row is None else row.profile
    return Failure(folder, record, domain, cause, known, effect, profile)


def _cause(record: EpisodeRecord, domain: Domain, facts: Sequence[str]) -> str:
    """The scenario's own words; of a run without one the facts that it was lost by."""
    if record.scenario is not None:
        return sentence(_scenario(record).cause)
    spoken = Spoken(domain, record.boundaries[-1].graph) if record.boundaries else None
    if spoken is None:
        return ""
    return sentence(listed([spoken.fact(Literal.parse(f)) for f in facts]))


def _scenario(record: EpisodeRecord) -> Scenario:
    """By the name or file that the run was told, which the record has besides the name."""
    return load_scenario(str(_said(record, "scenario") or record.scenario))


def _domain(record: EpisodeRecord) -> Domain:
    """That of the run: its task's, what the task's file adds included."""
    try:
        return load_task(str(_said(record, "task") or record.task.name)).domain
    except InputError:
        return load_domain(record.task.domain)


def _said(record: EpisodeRecord, key: str) -> object:
    config = dict(record.provenance).get("config")
    return config.get(key) if isinstance(config, dict) else None
