"""From finished runs to a study: failing boundaries at which every chosen detector alarmed in time.

Called by the command line; calls everything of this package that makes. At most one boundary of a
run becomes an item, the first at which all alarmed. What cannot become one is counted by reason.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

import forestall
from forestall.domain.spoken import Spoken, sentence
from forestall.errors import ForestallError, InputError, UnknownNameError
from forestall.files import alone, make_folder, replace_file
from forestall.llm.explaining import TemplateWriter, Writer
from forestall.records.pictures import encode_jpeg, file_name, rgb_of
from forestall.study.assigning import Design, assign
from forestall.study.explaining import REASONING, Explainer, Remembered, memory_of
from forestall.study.model import (
    ANSWERS_NAME,
    PICTURES_NAME,
    STUDY_NAME,
    Item,
    Study,
    write_study,
)
from forestall.study.runs import Failure, Runs, Twins, runs_in
from forestall.types.episode import BoundaryRecord, EpisodeRecord
from forestall.types.observation import Rgb
from forestall.types.runtime import When
from forestall.types.verdict import Verdict

OURS = "scene-graph"
AGAINST = ("objects", "caption", "image")
"""The paper's three baselines."""

WIDTH = 800
"""Pixels that a picture of a study is wide at most."""


@dataclass(frozen=True, slots=True)
class Asked:
    """What a study is to be about.

    Args:
        ours: the detector that all others are compared with.
        against: the others.
        items: at most so many, from all tasks in turn; None for all that there are.
        threshold: of every detector, in the place of the run's own.
        memory: the demonstrations, where they are not where the record says.
        design: raters, comparisons of each, seed.
    """

    ours: str = OURS
    against: tuple[str, ...] = AGAINST
    items: int | None = 40
    threshold: float | None = None
    memory: Path | None = None
    design: Design = field(default_factory=Design)

    def __post_init__(self) -> None:
        names = (self.ours, *self.against)
        if not self.against or len(set(names)) < len(names):
            raise InputError(f"each of {', '.join(names)} once, and one to compare with at least")
        if self.items is not None and self.items < 1:
            raise InputError(f"items is {self.items}: at least 1 is needed")


@dataclass(frozen=True, slots=True)
class Candidate:
    """A boundary at which all alarmed in time."""

    failure: Failure
    boundary: BoundaryRecord
    verdicts: dict[str, Verdict]


def make_study(
    folder: Path, results: Sequence[Path], asked: Asked, writer: Writer | None = None
) -> Study:
    """Write a study into a folder.

    Args:
        folder: new or empty, or one whose study nobody has answered yet.
        results: folders of runs or experiments.
        asked: what it is to be about.
        writer: makes the explanations; templates by default.

    Raises:
        InputError: people have answered in this folder; or no boundary can be an item, with the
            reasons.
        UnknownNameError: no run has such a detector.
    """
    make_folder(folder)
    answers = folder / ANSWERS_NAME
    if answers.is_dir() and any(answers.iterdir()):
        raise InputError(f"{folder} holds answers to its study: name a new folder")
    others = [p.name for p in folder.iterdir() if not p.name.startswith(".")]
    if others and STUDY_NAME not in others and others != [PICTURES_NAME]:
        raise InputError(f"{folder} is not empty and holds no study: name a new folder")
    runs = runs_in(results)
    left_out = runs.left_out
    _check_names(runs, asked)
    found = list(_candidates(runs, asked, left_out))
    with alone(folder):
        items = _items(folder, _in_turn(found, asked.design.seed), runs.twins, asked,
                       writer or TemplateWriter(), left_out)  # fmt: skip
        if not items:
            told = "; ".join(f"{n} {why}" for why, n in left_out.most_common())
            raise InputError(f"no boundary of these runs can be asked about: {told}")
        trials = assign(items, asked.against, asked.design)
        study = Study(
            ours=asked.ours,
            against=asked.against,
            seed=asked.design.seed,
            items=tuple(items),
            raters=tuple(map(tuple, trials)),
            left_out=dict(left_out.most_common()),
            version=forestall.__version__,
        )
        write_study(folder, study)
    return study


def _check_names(runs: Runs, asked: Asked) -> None:
    """See that some run was watched by each detector."""
    watched = [b.watched for f in runs.failures for b in f.record.boundaries]
    known = {v.detector for verdicts in watched for v in verdicts} | {REASONING}
    for name in (asked.ours, *asked.against) if len(known) > 1 else ():
        if name not in known:
            raise UnknownNameError("detector of these runs", name, known)


def _candidates(runs: Runs, asked: Asked, left_out: Counter[str]) -> Iterator[Candidate]:
    names = (asked.ours, *asked.against)
    for failure in runs.failures:
        lacking: Counter[str] = Counter()
        for boundary in _looks(failure):
            verdicts = _alarms(boundary, asked.threshold)
            silent = [n for n in names if n not in verdicts]
            if not silent:
                yield Candidate(failure, boundary, {n: verdicts[n] for n in names})
                break
            lacking.update(silent)
        else:
            never = [n for n in names if lacking[n] == len(_looks(failure))]
            who = ", ".join(never) or "never all at once, though each"
            left_out[f"no alarm in time by {who}" if never else f"{who} alarmed in time"] += 1


def _looks(failure: Failure) -> list[BoundaryRecord]:
    """The last look before each subtask, where an alarm is in time."""
    last = {b.index: b for b in failure.record.boundaries if b.when is When.BEFORE and b.watched}
    return [b for index, b in sorted(last.items()) if failure.known <= index <= failure.effect]


def _alarms(boundary: BoundaryRecord, threshold: float | None) -> dict[str, Verdict]:
    """The verdicts below their thresholds, by detector; the reasoner's where it found something."""
    found = {}
    for verdict in boundary.watched:
        line = verdict.threshold if threshold is None else threshold
        if verdict.score is not None and verdict.score < line:
            found[verdict.detector] = replace(verdict, threshold=line)
    if boundary.verdict is not None and boundary.diagnosis is not None and boundary.diagnosis.found:
        found[REASONING] = boundary.verdict
    return found


def _in_turn(found: Sequence[Candidate], seed: int) -> list[Candidate]:
    """Candidates in an order drawn by the seed, tasks in turn."""
    random = np.random.default_rng(seed)
    by_task: dict[str, list[Candidate]] = {}
    for k in random.permutation(len(found)):
        candidate = found[int(k)]
        by_task.setdefault(candidate.failure.record.task.name, []).append(candidate)
    rows = [(position, task) for task, row in by_task.items() for position in range(len(row))]
    return [by_task[task][position] for position, task in sorted(rows)]


def _items(
    folder: Path,
    candidates: Sequence[Candidate],
    twins: Twins,
    asked: Asked,
    writer: Writer,
    left_out: Counter[str],
) -> list[Item]:
    items: list[Item] = []
    for candidate in candidates:
        if asked.items is not None and len(items) == asked.items:
            left_out["more than were asked for"] += 1
            continue
        item = _item(folder, f"item-{len(items) + 1:03d}", candidate, twins, asked, writer)
        if isinstance(item, str):
            left_out[item] += 1
        else:
            items.append(item)
    return items


def _item(
    folder: Path, name: str, candidate: Candidate, twins: Twins, asked: Asked, writer: Writer
) -> Item | str:
    """A candidate as an item; the reason where it cannot be one."""
    failure, boundary = candidate.failure, candidate.boundary
    record, domain = failure.record, failure.domain
    actual = _picture(boundary, failure.folder)
    if actual is None:
        return "the picture was not kept"
    memory = memory_of(record, asked.memory)
    expected = _expected(candidate, memory, twins, asked.ours)
    if expected is None:
        return "no picture of what was expected: neither in the memory nor of an undisturbed run"
    explainer = Explainer(failure, memory, writer)
    try:
        said = [explainer.explain(boundary, n, v) for n, v in candidate.verdicts.items()]
    except ForestallError as error:
        return str(error)
    return Item(
        name=name,
        task=record.task.title,
        step=sentence(Spoken(domain, boundary.scoped).step(boundary.subtask)),
        cause=failure.cause,
        expected=_kept(folder, expected[0]),
        expected_from=expected[1],
        actual=_kept(folder, actual),
        explanations=tuple(said),
        source=_source(failure, boundary, record),
    )


def _source(failure: Failure, boundary: BoundaryRecord, record: EpisodeRecord) -> dict[str, Any]:
    return {
        "run": str(failure.folder),
        "task": record.task.name,
        "scenario": record.scenario,
        "seed": record.seed,
        "boundary": boundary.index,
        "subtask": str(boundary.subtask),
        "known": failure.known,
        "effect": failure.effect,
    }


def _picture(boundary: BoundaryRecord, folder: Path) -> Rgb | None:
    """The newest picture of a boundary, which looks at what the subtask is about."""
    frames = () if boundary.observation is None else boundary.observation.frames
    return rgb_of(frames[-1], folder) if frames else None


def _expected(
    candidate: Candidate, memory: Remembered | None, twins: Twins, ours: str
) -> tuple[Rgb, str] | None:
    """What should be seen: in the demonstration nearest to ours, or in the undisturbed room."""
    failure, boundary = candidate.failure, candidate.boundary
    nearest = candidate.verdicts[ours].nearest
    if memory is not None and nearest is not None:
        rgb = memory.picture(nearest, failure.domain)
        if rgb is not None:
            return rgb, f"demonstration {nearest.demonstration}, step {nearest.index + 1}"
    record = failure.record
    twin = twins.get((record.task.name, record.seed, failure.profile))
    if twin is None:
        return None
    folder, undisturbed = twin
    same = [
        b
        for b in undisturbed.boundaries
        if b.when is When.BEFORE and _step_of(b) == _step_of(boundary)
    ]
    near = sorted(same, key=lambda b: (abs(b.index - boundary.index), -b.looks))
    rgb = _picture(near[0], folder) if near else None
    return None if rgb is None else (rgb, "the same room without the disturbance")


def _step_of(boundary: BoundaryRecord) -> str:
    return str(boundary.subtask)


def _kept(folder: Path, rgb: Rgb) -> str:
    data = encode_jpeg(rgb, width=WIDTH, quality=85)
    path = folder / PICTURES_NAME / file_name(data)
    make_folder(path.parent)
    if not path.exists():
        replace_file(path, data)
    return f"{PICTURES_NAME}/{path.name}"
