"""Calibrates judges on the demonstrations of a memory, each judged against the others.

Called by the command line and by Python; calls the detectors and the retriever of the registry, as
a run does, and calibration. Graphs in a memory were perceived when it was recorded, so that what is
judged here came through the same eyes as what is judged in use. No world is opened.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from forestall.assembly.calibrated import SET_BY_SCORE, digest_of_memory, options_of
from forestall.assembly.configuration import Given, choices, domain_of, said_domain
from forestall.assembly.options import checked
from forestall.assembly.parts import Assembly
from forestall.assembly.registry import find
from forestall.assembly.sources import LABEL, scoped
from forestall.calibration.conformal import extreme
from forestall.calibration.fitted import LEVEL, CalibrationTable
from forestall.calibration.martingale import ExchangeabilityTest
from forestall.calibration.scores import JudgedBoundary, JudgedRun, Parts, scores_of
from forestall.comparison.options import ScoreConfig
from forestall.detection.preconditions import PreconditionDetector
from forestall.detection.scene_graph import SceneGraphDetector
from forestall.domain.model import Domain
from forestall.domain.undo import irreversible_skills
from forestall.errors import InputError, UnknownNameError
from forestall.kinds import DETECTOR, DOMAIN, PERCEIVER, RETRIEVER
from forestall.learning.learn import learn
from forestall.perception.config import ScopeConfig
from forestall.perception.scope import scope
from forestall.planning.validate import GraphValidator
from forestall.seams.judging import Retriever
from forestall.strategies.plan_check import PlanChecking
from forestall.tasks.files import load_task
from forestall.types.demonstration import Demonstration
from forestall.types.episode import EpisodeRecord
from forestall.types.plan import Plan
from forestall.types.runtime import When
from forestall.types.task import Goal
from forestall.types.verdict import Decision, Reference, Verdict

SCORED, COUNTED, PLAN_CHECK = (
    SceneGraphDetector.name,
    PreconditionDetector.name,
    PlanChecking.name,
)
JUDGES = (SCORED, COUNTED, PLAN_CHECK)
"""The first has a score, of the other two alarms are counted."""

Progress = Callable[[int, int, str], None]


def calibrate(
    demonstrations: Sequence[Demonstration],
    given: Given | None = None,
    *,
    judges: Sequence[str] = (),
    references: Sequence[Demonstration] | None = None,
    level: float = LEVEL,
    parts: Parts = Parts.UNDO,
    by_task: bool = True,
    share: float = 2 / 3,
    progress: Progress | None = None,
) -> CalibrationTable:
    """Judge good runs as a run would be, and keep the smallest score of each.

    Args:
        demonstrations: good runs; labels by a person are none.
        given: what was said about detector, retriever, encoder and domain.
        judges: names from `JUDGES`, under one bound together; the run's detector by default.
        references: what they are compared with; by default each with all of them but itself.
        level: the bound on false alarms per run.
        parts: which boundaries of a run have lines of their own.
        by_task: whether tasks have, where their runs suffice.
        share: see `scores_of`.
        progress: told (done, total, what).

    Raises:
        InputError: no good run, a judge that cannot be calibrated, or an option that is not valid.
    """
    said = given or Given()
    runs = [d for d in demonstrations if dict(d.perception).get("source") != LABEL and d.steps]
    if not runs:
        raise InputError("there is no good run to calibrate with: the memory has only labels")
    domain = domain_for(runs, said)
    said = said.over(Given.named(dict(domain.run)))
    named = tuple(dict.fromkeys(judges or (said.chosen(DETECTOR.name).name,)))
    for name in named:
        if name not in JUDGES:
            raise UnknownNameError("judge that can be calibrated", name, JUDGES)
    cut = partial(_cut, domain)
    bench = _Bench(said, domain, cut(runs if references is None else references), named)
    judged, total, tell = [], len(runs), progress or (lambda done, total, what: None)
    for done, run in enumerate(cut(runs)):
        tell(done, total, run.id)
        judged.append(bench.judged(run))
    tell(total, total, "")
    final = irreversible_skills(domain)
    used = {s.subtask.skill for d in runs for s in d.steps}
    return CalibrationTable(
        scores_of(judged, parts, final, share),
        level,
        parts,
        tuple(s for s in final if s in used),
        by_task,
        {name: bench.options(name) for name in named},
        digest_of_memory(bench.demonstrations),
        len(bench.demonstrations),
        references is not None,
        {name: _asked(judged, name) for name in named},
    )


def judged_in(record: EpisodeRecord, judges: Sequence[str]) -> JudgedRun:
    """What judges said in a run that is over: of an accepted run as good as a demonstration."""
    found = [
        _boundary(verdict.detector, boundary.subtask.skill, verdict)
        for boundary in record.boundaries
        if boundary.when is When.BEFORE
        for verdict in boundary.watched or (boundary.verdict,)
        if verdict is not None and verdict.detector in judges
    ]
    return JudgedRun(f"{record.task.name} {record.seed}", record.task.name, tuple(found))


def still_fits(
    table: CalibrationTable, later: Iterable[JudgedRun], seed: int = 0
) -> dict[str, ExchangeabilityTest]:
    """For each judge the bet that later good runs are no longer like those of the calibration.

    Each may be believed at the level that is split between them: `broken(level / len(found))`.

    Args:
        table: the calibration.
        later: good runs, in the order in which they were.
        seed: of the breaking of ties.
    """
    whole = table.scores.undivided()
    tests = {}
    for place, judge in enumerate(whole.judges):
        known = {task: whole.matrix(task)[:, place].tolist() for task in dict.fromkeys(whole.tasks)}
        tests[judge] = ExchangeabilityTest(known, np.random.default_rng((seed, place)))
    for run in later:
        for judge, test in tests.items():
            own = [b.score for b in run.boundaries if b.judge == judge]
            if own:
                test.add(extreme(own), run.task)
    return tests


def domain_for(demonstrations: Iterable[Demonstration], given: Given) -> Domain:
    """The domain that was said, else that of the shipped tasks, else one that is learnt.

    Raises:
        InputError: the demonstrations are of tasks of several domains.
    """
    found = list(demonstrations)
    said = said_domain(given)
    if said is not None:
        return domain_of(said)
    names = set()
    for task in {d.task for d in found}:
        try:
            names.add(load_task(task).domain.name)
        except UnknownNameError:
            continue
    if len(names) > 1:
        raise InputError(
            f"the demonstrations are of the domains {' and '.join(sorted(names))}: calibrate them "
            "apart, or say one with --domain"
        )
    if not names:
        return learn(found).domain
    return domain_of(Given.named({DOMAIN.name: names.pop()}).chosen(DOMAIN.name))


def _cut(domain: Domain, demonstrations: Iterable[Demonstration]) -> list[Demonstration]:
    return scoped(demonstrations, partial(scope, domain=domain, config=ScopeConfig()))


def _asked(judged: Iterable[JudgedRun], judge: str) -> int:
    return sum(any(b.asked for b in run.boundaries if b.judge == judge) for run in judged)


class _Bench:
    """Judges, and what they compare with."""

    def __init__(
        self,
        given: Given,
        domain: Domain,
        demonstrations: Sequence[Demonstration],
        judges: Sequence[str],
    ) -> None:
        self.demonstrations = demonstrations
        self._domain, self._judges = domain, tuple(judges)
        self._choices = choices(Given(tuple(p for p in given.parts if p[0] != DOMAIN.name)))
        self._parts = Assembly(self._choices, domain, demonstrations)
        self._detectors = {
            name: self._parts.part(DETECTOR, name, **self._given(name))
            for name in judges
            if name != PLAN_CHECK
        }

    def options(self, judge: str) -> dict[str, object]:
        """What the scores of a judge depend on; see `calibrated.check_same`."""
        if judge == PLAN_CHECK:
            return {"domain": self._domain.name}
        given, defaulted = checked(find(DETECTOR.name, judge), self._given(judge))
        own = {**dict(defaulted), **dict(given)}
        if judge == SCORED:
            del own[SET_BY_SCORE]
            seen = self._parts.options(PERCEIVER).get("feature")
            own["feature"] = ScoreConfig().feature if seen is None else seen
        return options_of(self._parts, own)

    def judged(self, run: Demonstration) -> JudgedRun:
        """What every judge says of every boundary of a run, which is no reference of its own."""
        retriever = self._retriever(run.id) if self._detectors else None
        found = []
        for position, step in enumerate(run.steps):
            references: Sequence[Reference] = ()
            if retriever is not None:
                references = retriever.retrieve(step.subtask, run.task, step.index)
            for judge in self._judges:
                if judge == PLAN_CHECK:
                    found.append(self._checked(run, position))
                    continue
                seen = step.graph
                if seen.subtask != step.subtask:
                    seen = replace(seen, subtask=step.subtask)
                verdict = self._detectors[judge].judge(seen, None, references)
                found.append(_boundary(judge, step.subtask.skill, verdict))
        return JudgedRun(run.id, run.task, tuple(found))

    def _given(self, judge: str) -> dict[str, object]:
        """What was said of the run's detector, where it is this judge."""
        if self._parts.name(DETECTOR) != judge:
            return {}
        return {k: v for k, v in self._parts.given(DETECTOR).items() if k != "calibration"}

    def _retriever(self, without: str) -> Retriever | None:
        others = [d for d in self.demonstrations if d.id != without]
        return Assembly(self._choices, self._domain, others).part(RETRIEVER) if others else None

    def _checked(self, run: Demonstration, position: int) -> JudgedBoundary:
        """The plan check: what is left of the run's own plan, with the drive before it."""
        subtasks = tuple(s.subtask for s in run.steps)
        skill = subtasks[position].skill
        start = position
        if start > 0 and self._domain.drives(subtasks[start - 1]):
            start -= 1
        goal = self._goal(run.task)
        check = GraphValidator(self._domain).check(
            Plan(subtasks[start:], goal.text), run.steps[position].whole, goal
        )
        return JudgedBoundary(PLAN_CHECK, skill, float(check.ok))

    def _goal(self, task: str) -> Goal:
        try:
            return load_task(task, self._domain).task.goal
        except InputError:  # a task of somebody's own: its plan has to run, whatever it is for
            return Goal("")


def _boundary(judge: str, skill: str, verdict: Verdict) -> JudgedBoundary:
    score = verdict.score
    if score is not None and judge == COUNTED:
        score = 0.0 if verdict.decision is Decision.REPLAN else 1.0
    return JudgedBoundary(judge, skill, score, verdict.decision is Decision.LOOK_AGAIN)
