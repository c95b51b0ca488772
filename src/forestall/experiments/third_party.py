"""`forestall bench third-party`: the judges on a household that somebody else wrote.

Called by the command line; calls the household (`seams.Foreign`), the parts of a run, and
`third_party_rows`. Every run is judged by each judge alone with demonstrations that its own program
is not among: up to a few of its task, or all that there are. Nothing stops at an alarm, so that all
judges see the same.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace

from forestall.assembly.configuration import choices
from forestall.assembly.judging import always_held
from forestall.assembly.monitor import DEFAULTS
from forestall.assembly.parts import Assembly
from forestall.assembly.weighing import plainer, weights
from forestall.comparison.preconditions import MiningConfig
from forestall.domain.model import Domain
from forestall.errors import InputError
from forestall.experiments.conduct import Progress
from forestall.experiments.third_party_rows import (
    JUDGES,
    NEEDS,
    PLAN,
    SCORE,
    Judged,
    Knowledge,
    Said,
)
from forestall.kinds import DETECTOR, RETRIEVER, VALIDATOR
from forestall.learning.learn import learn
from forestall.planning.validate import GraphValidator
from forestall.seams.others import Foreign
from forestall.strategies.judges import DetectorJudge, Judge, PlanJudge
from forestall.types.demonstration import Demonstration
from forestall.types.foreign import ForeignRun
from forestall.types.graph import SceneGraph
from forestall.types.runtime import BoundaryContext
from forestall.types.scene import SceneNeeds
from forestall.types.task import Goal, Task
from forestall.types.verdict import Decision

NO_DOMAIN = "none"
ITS_TASK, ALL_TASKS = "its task", "all tasks"


NOT_JUDGED = Said(None, False, "not judged")


def _silent(done: int, total: int, what: str) -> None:
    """Nobody is told how far it is."""


def judge(foreign: Foreign, progress: Progress = _silent) -> list[Judged]:
    """Judge every run, with each of the household's domains, and without one.

    With a domain there are the demonstrations of the run's own task; without one also those of all
    tasks, from which habits of one task can be told.

    Args:
        foreign: the household. Programs that are the only one of their task are left out.
        progress: told how far it is.

    Raises:
        InputError: the household has no good run.
    """
    made = {r.program: [r] for r in foreign.good if foreign.demonstrations(r)}
    if not made:
        raise InputError(
            f"{foreign.name} has no run that went well with another of its task to compare it "
            "with: there is nothing to judge"
        )
    for run in foreign.failing():
        if run.program in made:
            made[run.program].append(run)
    every = {d.name: d for g in foreign.good for d in (g, *foreign.demonstrations(g))}
    known: list[tuple[Knowledge, Domain | None]] = [
        (Knowledge(NO_DOMAIN, ITS_TASK), None),
        (Knowledge(NO_DOMAIN, ALL_TASKS), None),
        *((Knowledge(name, ITS_TASK), d) for name, d in foreign.domains().items()),
    ]
    total = len(known) * sum(map(len, made.values()))
    judged: list[Judged] = []
    for program, runs in made.items():
        for knowledge, domain in known:
            shown: Sequence[ForeignRun] = foreign.demonstrations(runs[0])
            if knowledge.memory == ALL_TASKS:
                shown = [d for d in every.values() if d.program != program]
            geometry = foreign.geometry if domain is None else ()
            seen = [without(r, geometry).demonstration() for r in shown]
            own = domain or learn(seen, hands=foreign.hands).domain
            panel = panel_of(seen, own, learnt=domain is None, exact=foreign.exact)
            for run in runs:
                said = said_of(without(run, geometry), panel, own.skills, domain is not None)
                judged.append(Judged(run.name, program, run.change, knowledge, said))
            progress(len(judged), total, program)
    return judged


def panel_of(
    memory: Sequence[Demonstration], domain: Domain, learnt: bool = False, *, exact: bool = False
) -> dict[str, Judge]:
    """The judges with some demonstrations and the domain that is known, or that they show.

    Without a demonstration only the plan check is left. `exact`: nobody can have seen wrong.
    """
    parts = Assembly(choices(DEFAULTS), domain, memory, {"states": {}})
    mining = MiningConfig(exception=0.0) if exact else MiningConfig()
    checked = parts.part(VALIDATOR)
    if learnt:
        checked = GraphValidator(plainer(domain, weights(domain, memory, mining)))
    if not memory:
        return {PLAN: PlanJudge(checked, PLAN)}
    retriever = parts.part(RETRIEVER)
    return {
        SCORE: DetectorJudge(parts.part(DETECTOR, "scene-graph"), retriever),
        NEEDS: DetectorJudge(always_held(parts, mining=mining), retriever),
        PLAN: PlanJudge(checked, PLAN),
    }


def without(run: ForeignRun, geometry: Sequence[str]) -> ForeignRun:
    """A run whose scenes leave out some relations."""
    if not geometry:
        return run
    scenes, scoped = (tuple(_plain(g, geometry) for g in gs) for gs in (run.scenes, run.scoped))
    final = None if run.final is None else _plain(run.final, geometry)
    return replace(run, scenes=scenes, final=final, scoped=scoped)


def _plain(graph: SceneGraph, geometry: Sequence[str]) -> SceneGraph:
    kept = tuple(r for r in graph.relations if r.predicate not in geometry)
    return replace(graph, relations=kept)


def said_of(
    run: ForeignRun,
    panel: Mapping[str, Judge],
    skills: Collection[str],
    ahead: bool,
    goal: Goal | None = None,
) -> tuple[Mapping[str, Said], ...]:
    """What each judge says before each step that the run came to.

    Args:
        run: good or failing.
        panel: the judges.
        skills: those of the judges' domain. What nobody has shown is not judged, neither as the
            next step nor as a later one.
        ahead: whether the judges see the rest of the plan, or its next step alone.
        goal: what the plan is to reach; by default it is only to run.
    """
    found = []
    for context in _boundaries(run, skills, ahead, goal or Goal(run.task)):
        said = dict.fromkeys(JUDGES, NOT_JUDGED)
        if context.subtask.skill in skills:
            verdicts = {name: judge.judge(context) for name, judge in panel.items()}
            said |= {
                name: Said(v.score, v.decision is not Decision.PROCEED, v.note)
                for name, v in verdicts.items()
            }
        found.append(said)
    return tuple(found)


def _boundaries(
    run: ForeignRun, skills: Collection[str], ahead: bool, goal: Goal
) -> Iterator[BoundaryContext]:
    steps = run.plan.subtasks
    unknown = [i for i, step in enumerate(steps) if step.skill not in skills]
    for at, scene in enumerate(run.scenes):
        first = max((i + 1 for i in unknown if i < at), default=0)
        last = min((i for i in unknown if i > at), default=len(steps)) if ahead else at + 1
        plan = replace(run.plan, subtasks=steps[first:last])
        task = Task(run.task, run.task, goal, plan, SceneNeeds())
        scoped = run.concerns(at)
        step = scoped.subtask or steps[at]
        yield BoundaryContext(
            task, plan, at - first, at, step, scene, scoped, None, looks=2, may_look=False
        )
