"""Judging scenes of the user's own: nothing is simulated, and nothing is executed.

Calls: command line → here → stored, parts, monitor. A monitor is asked before the subtasks of the
plan one after the other, or before the same one each time; a corrected plan is proposed and never
followed. Composition like `make`, for `forestall check`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from forestall.assembly.configuration import Given, RunConfig, digest_of, run_config
from forestall.assembly.corrections import described, remembering
from forestall.assembly.make import STORED_STATES, provenance
from forestall.assembly.monitor import DEFAULTS
from forestall.assembly.other_eyes import other_eyes
from forestall.assembly.own_domain import domain_of_demonstrations
from forestall.assembly.parts import Assembly
from forestall.assembly.plans import fitting, read_plan
from forestall.assembly.registry import known
from forestall.assembly.sources import scoped
from forestall.assembly.stored import Stored, is_graph, read_scene, scenes_in
from forestall.conclusion import MonitorConfig, unlocated
from forestall.domain.model import Domain
from forestall.domain.words import Names
from forestall.errors import InputError, UnknownNameError
from forestall.kinds import PERCEIVER, STATES, STRATEGY
from forestall.monitor import Monitor
from forestall.seams.judging import Strategy
from forestall.types.decision import Hold, MonitorDecision, Outcome
from forestall.types.demonstration import Demonstration
from forestall.types.episode import (
    STORED,
    BoundaryRecord,
    EpisodeEnd,
    EpisodeRecord,
    ExecutedRecord,
    SkillOutcome,
    SkillStatus,
)
from forestall.types.facts import category_of, is_instance
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation
from forestall.types.plan import Plan, Subtask, same_step
from forestall.types.runtime import BoundaryContext
from forestall.types.scene import SceneNeeds
from forestall.types.task import Goal, Task

TRUTH_STATES = "oracle"
"""The simulator's own, which no stored observation has."""

ATTEMPTS = "max_attempts"
"""Option of a strategy that gives up after so many repairs of one cause; here none is tried."""


@dataclass(frozen=True, slots=True)
class Question:
    """Before what the scenes are judged.

    Args:
        subtask: in text form: the same one for every scene. None: the plan's, one after the other.
        plan: "step; step", or a file (`assembly.plans`); the task's by default.
        task: name or file; its own demonstrations are preferred, and its goal is kept.
    """

    subtask: str | None = None
    plan: str | None = None
    task: str | None = None


@dataclass(frozen=True, slots=True)
class Judgement:
    """One scene and what the monitor says; "replan" where a corrected plan is proposed."""

    path: Path
    decision: MonitorDecision
    record: BoundaryRecord

    @property
    def judged(self) -> bool:
        """Whether something was judged: to the good, or to an alarm."""
        held = self.decision.hold in (Hold.SENSES, Hold.INTERNAL)
        return not held and self.decision.outcome not in (Outcome.LOOK, Outcome.NOT_JUDGED)

    @property
    def alarm(self) -> bool:
        """Whether the subtask should not start."""
        return self.judged and self.decision.outcome is not Outcome.PROCEED


@dataclass(frozen=True, slots=True)
class Judgements:
    """Every scene's, and the record from which the page is drawn.

    `limits` say what cannot be judged because the domain was learnt from the demonstrations, `eyes`
    that these were seen with other parts than the scenes; "" where they were not.
    """

    each: tuple[Judgement, ...]
    record: EpisodeRecord
    limits: tuple[str, ...] = ()
    eyes: str = ""

    @property
    def outcome(self) -> Outcome:
        """Of all: the first alarm, else the first that was not judged, else "proceed"."""
        alarms = [j for j in self.each if j.alarm]
        unclear = [j for j in self.each if not j.judged]
        return (*alarms, *unclear, *self.each)[0].decision.outcome


def judge_stored(
    paths: Sequence[Path],
    question: Question,
    demonstrations: Sequence[Demonstration] | None = None,
    given: Given | None = None,
    memory: str | None = None,
    pictures: bool = False,
) -> Judgements:
    """Judge scenes in their order.

    Where neither a domain nor a task was named, the domain is that of the demonstrations: one that
    comes with the project and has their skills, else one that is learnt from them.

    Args:
        paths: observation folders (docs/observation-format.md), graph files, or folders that hold
            numbered ones.
        question: before what.
        demonstrations: the memory; None only for a strategy that uses none.
        given: what was said about parts: the detector's threshold, what reads states off pictures.
        memory: where the demonstrations come from, for the record.
        pictures: whether they stay in the record.

    Raises:
        InputError: a name, a scene, the subtask or the plan is not valid.
    """
    scenes = scenes_in(paths, of_plan=question.subtask is None)
    if not scenes:
        raise InputError("nothing to judge: give an observation folder or a graph file")
    config = _config(question, given or Given(), all(map(is_graph, scenes)))
    task, domain, limits = _task(question, config, demonstrations, memory)
    wanted = None
    if question.subtask is not None:
        wanted = fitting(Subtask.parse(question.subtask), domain)
    if wanted is None and len(scenes) > len(task.plan):
        raise InputError(
            f"{len(scenes)} scenes for the {len(task.plan)} subtasks of the plan: give one for "
            "each at most, or --subtask to judge all before the same one"
        )
    stated: dict[str, Mapping[str, str]] = {}
    choices = remembering(config.choices, memory)
    if demonstrations is not None:
        seeing = Assembly(choices, domain, None, {"states": stated}).part(PERCEIVER)
        demonstrations = scoped(demonstrations, seeing.scope)
    lent = {"states": stated, "task": task.name}
    parts = Assembly(choices, domain, demonstrations, lent)
    bounds = MonitorConfig(max_subtasks=len(scenes), max_replans=0)
    strategy, perceiver = strategy_of(parts, len(scenes)), parts.part(PERCEIVER)
    monitor = Monitor(strategy, domain, perceiver, bounds)
    monitor.start(task)
    found: list[Judgement] = []
    passed: list[ExecutedRecord] = []
    for stored in _read(scenes, domain, stated, learnt=bool(limits)):
        if found and wanted is None:
            passed.append(_passed(monitor, found[-1].record, stored))
        found.append(
            judgement_of(stored.path, asked(monitor, stored.scene, wanted), pictures, domain)
        )
    eyes = other_eyes(demonstrations or (), perceiver.describe(), scenes)
    record = EpisodeRecord(
        task=task,
        scenario=STORED,
        strategy=strategy.name,
        seed=config.seed,
        initial_plan=_from(task.plan, wanted),
        boundaries=tuple(j.record for j in found),
        executed=tuple(passed),
        end=EpisodeEnd.UNFINISHED,
        simulated_s=sum(e.outcome.duration_s for e in passed),
        compute_s=monitor.seconds,
        provenance=(
            *((name, value) for name, value in provenance(config) if name != "loop"),
            ("perception", dict(perceiver.describe())),
            ("memory", memory),
            ("corrections", described(config.choices, memory)),
            ("observations", [str(path) for path in scenes]),
            ("other eyes", eyes or None),
            ("inputs", {"task": repr(task), "domain": digest_of(domain)}),
        ),
    )
    return Judgements(tuple(found), record, limits, eyes)


def _read(
    scenes: Sequence[Path], domain: Domain, stated: dict[str, Mapping[str, str]], *, learnt: bool
) -> Iterator[Stored]:
    """Scene by scene, so that few pictures are held at once; `stated` is what the last one says."""
    names = Names(domain)
    for path in scenes:
        stored = read_scene(path, domain, names, learnt)
        stated.clear()
        stated.update(stored.states)
        yield stored


def _config(question: Question, given: Given, graphs: bool) -> RunConfig:
    """What was said, over what a stored scene brings with it, over what any `Monitor` has."""
    own = {
        "segmenter": "given-masks",
        "states": STORED_STATES,
        "perceiver": "given-graph" if graphs else "graph",
    }
    own_over_usual = given.over(Given.named(own)).over(DEFAULTS)
    config = run_config(question.task or "", given=own_over_usual)
    if config.choice(STATES).name == TRUTH_STATES:
        readable = [n for n in known(STATES.name) if n != TRUTH_STATES]
        raise UnknownNameError("states of a stored observation", TRUTH_STATES, readable)
    return config


def _task(
    question: Question,
    config: RunConfig,
    demonstrations: Sequence[Demonstration] | None,
    memory: str | None,
) -> tuple[Task, Domain, tuple[str, ...]]:
    """The task with the plan at hand, its domain, and what a learnt one cannot know.

    A plan or a subtask of no task is of the one that all demonstrations are of, if there is one. A
    subtask that the task's own plan does not have is judged alone, without the task's goal.
    """
    limits: tuple[str, ...] = ()
    if question.task is None:
        domain = config.load_domain()
        if config.domain is None and demonstrations:
            own = domain_of_demonstrations(demonstrations, memory)
            domain, limits = own.domain, own.limits
        title = f"before {question.subtask}" if question.subtask else "a plan"
        shown = {d.task for d in demonstrations or ()}
        name = shown.pop() if len(shown) == 1 else ""
        task = Task(name, title, Goal(""), Plan(()), SceneNeeds(), domain.name)
    else:
        loaded = config.load()
        task, domain = loaded.task, loaded.domain
    if question.plan is not None:
        task = replace(task, plan=replace(read_plan(question.plan, domain), goal=task.goal.text))
    if question.subtask is None:
        if not len(task.plan):
            raise InputError("say before what: --subtask STEP, --plan 'STEP; STEP' or --task NAME")
        return task, domain, limits
    wanted = fitting(Subtask.parse(question.subtask), domain)
    if not any(same_step(step, wanted) for step in task.plan):
        if question.plan is not None:
            raise UnknownNameError("step of the plan", str(wanted), task.plan.texts())
        task = replace(task, goal=Goal(""), plan=Plan((wanted,)))
    return task, domain, limits


def strategy_of(parts: Assembly, scenes: int) -> Strategy:
    """The strategy that was chosen; as no repair is tried, it gives none up."""
    name = parts.name(STRATEGY)
    options: dict[str, Any] = {}
    if ATTEMPTS in parts.declared(STRATEGY, name):
        options = {**parts.given(STRATEGY), ATTEMPTS: scenes}
    return parts.part(STRATEGY, name, **options) if options else parts.part(STRATEGY)


def _passed(monitor: Monitor, last: BoundaryRecord, following: Stored) -> ExecutedRecord:
    """The subtask before which was judged last lies between two scenes: it is over."""
    lasted = max(0.0, following.time_s - last.time_s)
    done = SkillOutcome(SkillStatus.SUCCEEDED, lasted)
    monitor.after(done)
    return ExecutedRecord(last.subtask, done, last.index)


def asked(
    monitor: Monitor, scene: Observation | SceneGraph, wanted: Subtask | None
) -> MonitorDecision:
    """What the monitor says of a scene.

    Nobody looks here. Where an argument was not seen, "look" is the answer; a monitor that only
    wants to be sure is asked again with the same scene.
    """
    decision = monitor.before(scene, wanted)
    if decision.outcome is not Outcome.LOOK or decision.context is None:
        return decision
    return decision if unlocated(decision.context) else monitor.before(scene, wanted)


def _meant(context: BoundaryContext, domain: Domain) -> str:
    """Things of the scene that may be meant by arguments that are in no view."""
    ids, text = [n.id for n in context.graph.nodes], ""
    for name in unlocated(context):
        if domain.find(name) is None:
            names = {*ids, *(n.category for n in context.graph.nodes)}
            near = get_close_matches(name, sorted(names - {name}), 3)
        elif is_instance(name):
            near = [n for n in ids if n != name and category_of(n) == category_of(name)]
        else:
            continue
        text += f"; did you mean {' or '.join(near)} by {name}?" if near else ""
    return text


def judgement_of(
    path: Path, decision: MonitorDecision, pictures: bool, domain: Domain
) -> Judgement:
    """What is kept of a decision; a plan that may not be adopted is one that is proposed."""
    record, replan, verdict = decision.record, decision.replan, decision.verdict
    assert record is not None, "what was looked at is recorded"
    if decision.hold is Hold.REPLAN_LIMIT and replan is not None:
        why = "" if decision.diagnosis is None else decision.diagnosis.cause
        decision = replace(decision, outcome=Outcome.REPLAN, hold=None, plan=replan.plan, why=why)
    if not decision.why and verdict is not None:
        decision = replace(decision, why=verdict.note)
    if decision.outcome is Outcome.LOOK and decision.context is not None:
        decision = replace(decision, why=decision.why + _meant(decision.context, domain))
    record = replace(record, outcome=decision.outcome)
    if not pictures:
        record = replace(record, observation=None)
    return Judgement(path, replace(decision, context=None, record=None), record)


def _from(plan: Plan, wanted: Subtask | None) -> Plan:
    """What is left of a plan from a step on."""
    if wanted is None:
        return plan
    first = next(i for i, step in enumerate(plan) if same_step(step, wanted))
    return replace(plan, subtasks=plan.subtasks[first:])
