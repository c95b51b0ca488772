"""A recorded run, judged step by step as it was recorded: what a monitor would have said, and when.

Called by `forestall replay`; calls a data set (through `recorded`), `worlds.replay` and a monitor.
Nothing stops at an alarm: what was carried out is what goes on. Composition like `checking`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from forestall.assembly.checking import (
    Judgement,
    Judgements,
    asked,
    judgement_of,
    strategy_of,
)
from forestall.assembly.configuration import Given, RunConfig, digest_of, run_config
from forestall.assembly.corrections import described, remembering
from forestall.assembly.make import provenance
from forestall.assembly.parts import Assembly
from forestall.assembly.plans import fitting
from forestall.assembly.recorded import Opened
from forestall.assembly.sources import scoped
from forestall.conclusion import MonitorConfig
from forestall.domain.model import Domain
from forestall.errors import FileFormatError, UnknownNameError
from forestall.kinds import PERCEIVER
from forestall.monitor import Monitor
from forestall.types.decision import Hold, MonitorDecision, Outcome
from forestall.types.demonstration import Demonstration
from forestall.types.episode import EpisodeEnd, EpisodeRecord, SkillOutcome, SkillStatus
from forestall.types.observation import Observation
from forestall.types.plan import Plan
from forestall.types.recorded import Look, ReadReport, RecordedRun, Unread
from forestall.types.scene import SceneNeeds
from forestall.types.task import Goal, Task
from forestall.worlds.replay.world import ReplayWorld

RECORDED = "a recorded run"
"""What stands in the record in the place of a scenario."""


@dataclass(frozen=True, slots=True)
class Said:
    """What a monitor would have said at one moment of a recorded run.

    Args:
        step: of the run, from 0.
        time_s: on the clock of the log.
        judgement: of the monitor.
        ended: how the step ended, as the log says.
    """

    step: int
    time_s: float
    judgement: Judgement
    ended: str


@dataclass(frozen=True, slots=True)
class Replayed:
    """A run as it was judged.

    Args:
        run: the run.
        timeline: every moment in its order.
        judgements: the same as `forestall check` has them, with the record for a page.
    """

    run: RecordedRun
    timeline: tuple[Said, ...]
    judgements: Judgements


@dataclass(slots=True)
class _Replay:
    """One run under way."""

    run: RecordedRun
    domain: Domain
    world: ReplayWorld
    monitor: Monitor
    pictures: bool
    looks: int = 0
    found: list[Said] = field(default_factory=list)
    waiting: tuple[int, SkillOutcome] | None = None

    def go(self) -> None:
        """From the first look to the last."""
        self.world.reset(0)
        more = True
        while more:
            self.looks += 1
            self._look(self.world.observe(), self.world.next)
            more = self.world.follow()

    def _look(self, seen: Observation, following: Look | None) -> None:
        """One look: what came of the last step, then whatever begins on it."""
        if self.waiting is not None:
            number, outcome = self.waiting
            self.waiting = None
            decision = self.monitor.after(outcome, seen)
            if decision is not None:
                self._note(number, seen.time_s, decision, _ended(outcome))
        begins = () if following is None else following.before
        if not begins:
            if not self.monitor.finished:
                self.monitor.observe(seen)
            return
        assert following is not None, "something begins before it"
        for number in begins:
            self._before(number, seen, following)

    def _before(self, number: int, seen: Observation, following: Look) -> None:
        outcome = _outcome(number, following, seen.time_s)
        wanted = self.run.plan.subtasks[number]
        decision = asked(self.monitor, seen, wanted)
        if (why := dict(following.unshown).get(number)) is not None:
            decision = _unjudged(decision, why)
        self._note(number, seen.time_s, decision, _ended(outcome))
        if decision.hold in (Hold.SENSES, Hold.INTERNAL):
            return
        answer = self.monitor.after(outcome)
        if answer is not None and answer.outcome is Outcome.LOOK:
            self.waiting = (number, outcome)
        elif answer is not None and answer.record is not None:
            self._note(number, seen.time_s, answer, _ended(outcome))

    def _note(self, step: int, time_s: float, decision: MonitorDecision, ended: str) -> None:
        place = Path(self.run.name) / f"{self.looks:04d}"
        judged = judgement_of(place, decision, self.pictures, self.domain)
        self.found.append(Said(step, time_s, judged, ended))


def replay(
    opened: Opened,
    run: RecordedRun,
    demonstrations: Sequence[Demonstration] | None,
    memory: str | None = None,
    given: Given | None = None,
    pictures: bool = False,
) -> Replayed:
    """Judge a recorded run.

    Args:
        opened: the data set that it is of.
        run: one of its runs.
        demonstrations: the memory; None only for a strategy that uses none.
        memory: where they come from, for the record.
        given: what was said about parts, over what the data set needs.
        pictures: whether they stay in the record.

    Raises:
        InputError: a part or a step that is not valid, or a log that cannot be read.
    """
    config, domain = replay_config(opened, given or Given()), opened.domain
    plan = Plan(tuple(fitting(step, domain) for step in run.plan), run.plan.goal)
    run = replace(run, plan=plan)
    task = Task(
        run.task, run.plan.goal or run.task, Goal(plan.goal), plan, SceneNeeds(), domain.name
    )
    stated: dict[str, dict[str, str]] = {}
    choices = remembering(config.choices, memory)
    if demonstrations is not None:
        seeing = Assembly(choices, domain, None, {"states": stated}).part(PERCEIVER)
        demonstrations = scoped(demonstrations, seeing.scope)
    parts = Assembly(choices, domain, demonstrations, {"states": stated, "task": task.name})
    strategy, perceiver = strategy_of(parts, len(plan)), parts.part(PERCEIVER)
    bounds = MonitorConfig(max_subtasks=len(plan) + 1, max_replans=0)
    monitor = Monitor(strategy, domain, perceiver, bounds)
    monitor.start(task)
    under_way = _Replay(run, domain, ReplayWorld(run.name, run.looks), monitor, pictures)
    under_way.go()
    found = tuple(under_way.found)
    record = EpisodeRecord(
        task=task,
        scenario=RECORDED,
        strategy=strategy.name,
        seed=config.seed,
        initial_plan=plan,
        boundaries=tuple(said.judgement.record for said in found),
        executed=monitor.executed,
        end=EpisodeEnd.UNFINISHED,
        simulated_s=found[-1].time_s if found else 0.0,
        compute_s=monitor.seconds,
        provenance=(
            *((name, value) for name, value in provenance(config) if name != "loop"),
            ("perception", dict(perceiver.describe())),
            ("memory", memory),
            ("corrections", described(config.choices, memory)),
            ("log", [opened.data.name, run.name]),
            ("inputs", {"task": repr(task), "domain": digest_of(domain)}),
        ),
    )
    return Replayed(run, found, Judgements(tuple(said.judgement for said in found), record))


def replay_config(opened: Opened, given: Given) -> RunConfig:
    """The parts that a data set is judged with: what was said, over what its pictures need."""
    return run_config("", given=given.over(opened.given))


def runs_of(
    opened: Opened, name: str | None, report: ReadReport | None = None
) -> Iterator[RecordedRun]:
    """Every run that can be used, or the one of a name.

    Args:
        opened: the data set that they are of.
        name: of one run.
        report: is told which runs cannot be used.

    Raises:
        InputError: the run of that name, or the only one, cannot be used.
    """
    names = []
    for run in opened.data.runs(opened.domain):
        names.append(run.name)
        if name is not None and run.name != name:
            continue
        if isinstance(run, RecordedRun):
            yield run
        elif name is not None or len(opened.data) == 1:
            raise FileFormatError(f"{run.name}: {run.why}")
        elif report is not None:
            report.unread.append(run)
    if name is not None and name not in names:
        raise UnknownNameError("run", name, names)


def judged_of(
    opened: Opened,
    name: str | None,
    report: ReadReport,
    judge: Callable[[RecordedRun], Replayed],
) -> Iterator[Replayed]:
    """Like `runs_of`, each run judged; one of several whose looks cannot be read is unread."""
    for run in runs_of(opened, name, report):
        try:
            found = judge(run)
        except FileFormatError as error:
            if name is not None or len(opened.data) == 1:
                raise
            report.unread.append(Unread(run.name, str(error)))
        else:
            yield found


def _outcome(number: int, following: Look, now_s: float) -> SkillOutcome:
    """How a step ended, by the look after it: what is not done was refused."""
    then = following.observation
    lasted_s = 0.0 if then is None else max(0.0, then.time_s - now_s)
    status = SkillStatus.REFUSED
    if following.done is not None and number <= following.done:
        good = following.succeeded or number < following.done
        status = SkillStatus.SUCCEEDED if good else SkillStatus.FAILED
    return SkillOutcome(status, lasted_s)


def _unjudged(decision: MonitorDecision, why: str) -> MonitorDecision:
    """What is said of a step that nothing shows as it begins; senses that fail are told as ever."""
    if decision.hold in (Hold.SENSES, Hold.INTERNAL):
        return decision
    nothing: dict[str, Any] = {"verdict": None, "diagnosis": None, "replan": None, "sentence": ""}
    record = decision.record
    if record is not None:
        record = replace(record, outcome=Outcome.NOT_JUDGED, watched=(), why=why, **nothing)
    return replace(
        decision,
        outcome=Outcome.NOT_JUDGED,
        may_start=False,
        plan=None,
        look_at=(),
        hold=None,
        why=why,
        record=record,
        **nothing,
    )


def _ended(outcome: SkillOutcome) -> str:
    return outcome.status.value
