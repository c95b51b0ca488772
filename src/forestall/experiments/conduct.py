"""Conducts an experiment: everything is checked, demonstrations are made, episodes run.

Calls: command line → here → engines → worker → assembly. What is in the folder is not run again.
`results` makes what people look at.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

from forestall.assembly.configuration import Given, RunConfig, digest_of, run_config
from forestall.assembly.demonstrations import memory_path, ready_made, to_record
from forestall.assembly.make import needs_memory
from forestall.domain.model import Domain
from forestall.errors import InputError, UnknownNameError
from forestall.experiments.cost import Cost, cost_of
from forestall.experiments.engines import WorkerDiedError, check_engine, computed, make_lanes
from forestall.experiments.folder import EXPERIMENT, About, ResultsFolder, episodes_in
from forestall.experiments.runs import PAPER_DETECTOR, Run, by_scene
from forestall.experiments.settings import PAGES, Settings
from forestall.experiments.worker import (
    Work,
    broken_row,
    config_of,
    prepared_run,
    run_one,
    second_of,
    varied,
)
from forestall.memory.store import open_store
from forestall.statistics.outcomes import NO_STRATEGY
from forestall.statistics.rows import EXACT, EpisodeRow
from forestall.tasks.files import load_task

Progress = Callable[[int, int, str], None]


class Wanted(Protocol):
    """Which episodes are wanted: `runs.Choice`, or `episodes.Episodes`."""

    def runs(self) -> Sequence[Run]:
        """Each once; those of one case after its watched run."""

    def about(self, domain: Domain | None = None) -> Mapping[str, Any]:
        """What all of them have in common, as JSON has it, when read in another domain."""


@dataclass(frozen=True, slots=True)
class Experiment:
    """What to do and how.

    Args:
        choice: which episodes.
        workers: how many episodes at once.
        engine: "local" or "ray".
        address: of a Ray cluster.
        settings: what is the same for every episode.
        kind: of the results; those of two kinds do not share a folder.
    """

    choice: Wanted
    workers: int = 1
    engine: str = "local"
    address: str | None = None
    settings: Settings = field(default_factory=Settings)
    kind: str = EXPERIMENT

    def about(self) -> About:
        """What all its rows have in common: settings, code, and the content of a given memory."""
        memory = memory_path(run_config("", given=self.settings.given))
        domain = self.settings.domain()
        what = {
            **self.choice.about(domain),
            "content of the domain": None if domain is None else digest_of(domain),
            "settings": self.settings.to_json(),
        }
        return About.now(self.kind, what, memory)


def conduct(
    experiment: Experiment,
    out: Path,
    progress: Progress,
    compute: Callable[[Work], dict[str, Any]] = run_one,
    demonstrate: Callable[[Sequence[Run], Experiment, Progress], None] | None = None,
    announce: Callable[[Cost], None] | None = None,
) -> list[EpisodeRow]:
    """Run what is missing; every row of the experiment in the order of its runs.

    Args:
        experiment: what to do.
        out: folder of the results.
        progress: told (done, total, what).
        compute: makes a row; called in the workers.
        demonstrate: called once before, by default to record the demonstrations that are needed.
        announce: told what it will cost, before anything is run.

    Raises:
        InputError: something that does not fit, each with what would be valid.
    """
    runs = experiment.choice.runs()
    check(experiment, runs)
    folder = episodes_in(out, experiment.kind)
    with folder.alone():
        rows = folder.open(experiment.about())
        todo = [r for r in runs if r.key not in rows]
        before = len(runs) - len(todo)
        if todo:
            if announce is not None:
                announce(_cost(todo, experiment))
            with folder.effort_of(
                experiment.choice,
                ((run.case.set, run.setup) for run in runs),
                experiment.workers,
                experiment.engine,
                before,
            ) as count:
                (demonstrate or _demonstrations)(todo, experiment, progress)
                progress(before, len(runs), "episodes")
                for done, row in enumerate(_computed(todo, rows, folder, experiment, compute), 1):
                    count(done)
                    progress(before + done, len(runs), row.scenario or row.task)
    return [rows[r.key] for r in runs]


def check(experiment: Experiment, runs: Sequence[Run]) -> None:
    """See before anything is run that all of it can be.

    Raises:
        ForestallError: it cannot; says why.
    """
    if experiment.workers < 1:
        raise InputError(f"--jobs {experiment.workers}: at least 1 is needed")
    if experiment.settings.pages not in PAGES:
        raise UnknownNameError("pages", experiment.settings.pages, PAGES)
    check_engine(experiment.engine)
    experiment.settings.parts()
    memory = memory_path(run_config("", given=experiment.settings.given))
    if memory is not None:
        with open_store(memory) as store:
            store.required()
    one_each = {r.case: r for r in runs} | {replace(r, case=runs[0].case): r for r in runs}
    for run in one_each.values():
        prepared_run(run, experiment.settings)


def _demonstrations(runs: Sequence[Run], experiment: Experiment, progress: Progress) -> None:
    for config, ways, second in _memories(runs, experiment):
        ready_made(
            config, progress=progress, workers=experiment.workers, varied=ways, second=second
        )


def _memories(
    runs: Sequence[Run], experiment: Experiment
) -> list[tuple[RunConfig, int, Given | None]]:
    """A run with each ready-made memory that runs need, how many ways it has, and where."""
    wanted: dict[tuple[str, str, int], RunConfig] = {}
    for run in runs:
        for task in run.shown_in:
            key = (run.profile, task, varied(run))
            shown = replace(run, case=replace(run.case, task=task, scenario=None))
            config = None if key in wanted else config_of(shown, experiment.settings)
            if config is not None and needs_memory(config) and memory_path(config) is None:
                wanted[key] = config
    ordered = sorted(wanted.items(), key=lambda item: item[0])
    return [(config, ways, second_of(profile)) for (profile, _, ways), config in ordered]


def _cost(todo: Sequence[Run], experiment: Experiment) -> Cost:
    domain = experiment.settings.domain()
    steps = {task: len(load_task(task, domain).task.plan) for task in {r.case.task for r in todo}}
    recorded = sum(
        to_record(config, ways, second) * steps[config.task]
        for config, ways, second in _memories(todo, experiment)
    )
    return cost_of([(r, steps[r.case.task]) for r in todo], recorded, experiment.workers)


def _computed(
    todo: Sequence[Run],
    rows: dict[str, EpisodeRow],
    folder: ResultsFolder[EpisodeRow],
    experiment: Experiment,
    compute: Callable[[Work], dict[str, Any]],
) -> Iterator[EpisodeRow]:
    """Every missing row, written and put among `rows`, as they come."""
    where = str(folder.path.resolve())
    groups = [[Work(r, experiment.settings, where) for r in group] for group in by_scene(todo)]

    def spared(work: Work) -> dict[str, Any] | None:
        row = implied(work.run, rows)
        return None if row is None else row.to_json()

    lanes = make_lanes(experiment.engine, min(experiment.workers, len(groups)), experiment.address)
    with folder.writing() as lines:
        for work, answer in computed(groups, lanes, compute, spared):
            row = (
                broken_row(work.run, str(answer), prepared_run(work.run, work.settings))
                if isinstance(answer, WorkerDiedError)
                else EpisodeRow.from_json(answer)
            )
            rows[work.run.key] = row
            folder.add(lines, row)
            yield row


RETRY = "retry-once"

_PLAIN: dict[str, Any] = {"without": None, "model": EXACT}
"""What the watched run of a case has, whatever the others differ in."""


def implied(run: Run, rows: Mapping[str, EpisodeRow]) -> EpisodeRow | None:
    """The row of a run that must be the watched one, None where it has to be run.

    Where nobody steps in, where there is nothing to repeat, and where a baseline detector stays at
    or above its threshold at every boundary of the watched run, the run is the same, step by step.
    Runs in which the robot looked twice anywhere are not spared: who watched wished for that.
    """
    alone = run.strategy in (NO_STRATEGY, RETRY)
    if not alone and (run.strategy != "proactive" or run.detector == PAPER_DETECTOR):
        return None
    watched = rows.get(replace(run, strategy="watch", **_PLAIN).key)
    if watched is None or watched.error or any(j.looks > 1 for j in watched.judged):
        return None
    if run.strategy == RETRY and watched.refused:
        return None
    scores = [None if alone else j.scores.get(run.detector) for j in watched.judged]
    if any(s is not None and s < run.threshold for s in scores):
        return None
    return replace(
        watched,
        strategy=run.strategy,
        detector=run.detector,
        threshold=run.threshold,
        model=run.model,
        judged=tuple(
            replace(j, score=s, decision="proceed", confirmed=False, cause="", scores={}, named={})
            for j, s in zip(watched.judged, scores, strict=True)
        ),
        planner_calls=0,
        compute_s={},
        reasoning_s=0.0,
        implied=True,
    )


__all__ = ["Experiment", "check", "conduct", "implied"]
