"""Does a plan by anybody run on a scene and reach its goal? Composition for `forestall plan check`.

Calls: command line → here → plans, stored, records, planning. No demonstration is asked, nothing is
executed.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from forestall.assembly.configuration import Given, run_config
from forestall.assembly.eyes import eyes_for
from forestall.assembly.plans import STANDARD_INPUT, check_arguments, read_plan
from forestall.assembly.sources import RECORD_FILES
from forestall.assembly.stored import read_scene
from forestall.domain.load import load_domain
from forestall.domain.model import Domain
from forestall.errors import FileFormatError, InputError
from forestall.perception.folder import OBSERVATION_FILE
from forestall.planning.rehearse import Rehearsal, left_broken, rehearse
from forestall.records.record import read_record
from forestall.tasks.files import LoadedTask, goal_from
from forestall.tasks.schemas import GoalFile
from forestall.testing.symbolic_scene import start_scene
from forestall.types.graph import SceneGraph
from forestall.types.task import Goal

_NEVER = re.compile(r"never\s+")
_NO_GOAL = "no goal says that the plan is over here"
_USUAL = "the task's own plan does so, too"


@dataclass(frozen=True, slots=True)
class PlanQuestion:
    """What is asked of a plan.

    Args:
        plan: a file, "-", or the steps themselves.
        scene: a scene graph, the folder of an observation, a run's folder or record.
        task: name or file, whose goal it is to reach.
        goal: "fact; fact; never fact" instead.
    """

    plan: str
    scene: Path
    task: str | None = None
    goal: str | None = None


@dataclass(frozen=True, slots=True)
class CheckedPlan:
    """The answer, and what it was given in.

    Args:
        rehearsal: step by step.
        goal: that was asked for.
        graph: the scene as it was understood.
        domain: that it was read in.
    """

    rehearsal: Rehearsal
    goal: Goal
    graph: SceneGraph
    domain: Domain


@dataclass(frozen=True, slots=True)
class _Start:
    """A scene, and what comes with it."""

    graph: SceneGraph
    goal: Goal = field(default_factory=lambda: Goal(""))
    excused: Mapping[str, str] = field(default_factory=lambda: {})


def check_plan(question: PlanQuestion, given: Given | None = None) -> CheckedPlan:
    """Execute a plan in the mind.

    Args:
        question: which plan, where, to what end.
        given: what was said about parts: the domain, what pictures are seen with.

    Raises:
        InputError: a file, a name, a step or a fact that is not valid; says what would be.
    """
    given = given or Given()
    if question.task is not None and question.goal is not None:
        raise InputError("give --task or --goal: the goal of a task is its own")
    said = "domain" in given.kinds()
    config = run_config(question.task or "", given=given)
    if question.task is not None:
        loaded = config.load()
        start = _with_task(_start(question.scene, loaded.domain, given, seeing=True)[0], loaded)
        domain = loaded.domain
    else:
        own = config.load_domain() if said or not _is_record(question.scene) else None
        start, domain = _start(question.scene, own, given, seeing=said)
    if question.goal is not None:
        start = _Start(start.graph, read_goal(question.goal, domain, start.graph))
    elif not start.goal.literals:
        rules = (r.name for r in domain.safety)
        start = _Start(start.graph, start.goal, dict.fromkeys(rules, _NO_GOAL))
    plan = read_plan(question.plan, domain, "PLAN")
    source = "standard input" if question.plan == STANDARD_INPUT else question.plan
    things = {name for n in start.graph.nodes for name in (n.id, n.category)}
    check_arguments(plan, things, domain, "PLAN" if "(" in source else source)
    rehearsal = rehearse(plan, start.graph, start.goal, domain, start.excused)
    return CheckedPlan(rehearsal, start.goal, start.graph, domain)


def read_goal(text: str, domain: Domain, graph: SceneGraph) -> Goal:
    """A goal of "fact; fact; never fact".

    Args:
        text: facts over things or categories; "never" before what must not come about.
        domain: whose facts they are.
        graph: whose things they may name.

    Raises:
        InputError: no fact that is to hold, or one that means nothing.
    """
    facts = [fact.strip() for fact in text.split(";") if fact.strip()]
    never = [_NEVER.sub("", fact, count=1) for fact in facts if _NEVER.match(fact)]
    held = [fact for fact in facts if not _NEVER.match(fact)]
    if not held:
        raise InputError(
            f"--goal {text!r}: a fact is needed that is to hold in the end: "
            "'attribute(Thing)=value; relation(Thing, Place); never attribute(Thing)=value'"
        )
    own = domain.knowing(n.category for n in graph.nodes if n.id not in domain.robot.hands)
    try:
        return goal_from(GoalFile(text=text, all=held, never=never), own)
    except InputError as error:
        raise InputError(f"--goal: {error}") from error


def _with_task(start: _Start, loaded: LoadedTask) -> _Start:
    """The task's goal; what its own plan leaves behind is no fault of another one."""
    task, domain = loaded.task, loaded.domain
    usual = left_broken(task.plan, start_scene(domain, task.scene, 0), domain)
    return _Start(start.graph, task.goal, dict.fromkeys(usual, _USUAL))


def _start(
    path: Path, domain: Domain | None, given: Given, *, seeing: bool
) -> tuple[_Start, Domain]:
    """The scene; that of a run is the one before its last boundary, with the goal of the run."""
    if not path.exists():
        raise FileFormatError(f"{path}: there is no such file or folder")
    if _is_record(path):
        return _of_run(path, domain)
    assert domain is not None, "only a run brings its own"
    if path.is_dir() or path.name == OBSERVATION_FILE:
        folder = path if path.is_dir() else path.parent
        if not (folder / OBSERVATION_FILE).is_file():
            raise FileFormatError(
                f"{folder} holds neither {OBSERVATION_FILE} nor {' nor '.join(RECORD_FILES)}"
            )
        if not seeing:
            raise InputError(f"{folder}: pictures are seen in a domain: give --domain or --task")
        eyes = eyes_for(given, domain)
        eyes.begin()
        return _Start(eyes.see(folder)), domain
    scene = read_scene(path, domain).scene
    assert isinstance(scene, SceneGraph), "it is a file"
    return _Start(scene), domain


def _of_run(path: Path, domain: Domain | None) -> tuple[_Start, Domain]:
    record = read_record(path)
    if not record.boundaries:
        raise InputError(f"{path}: the run ended before its first boundary, so it has no scene")
    if domain is None:
        try:
            domain = load_domain(record.task.domain)
        except InputError as error:
            raise InputError(f"{path}: its domain is not known: {error}; give --domain") from error
    return _Start(record.boundaries[-1].graph, record.task.goal), domain


def _is_record(path: Path) -> bool:
    return path.name in RECORD_FILES or any((path / name).is_file() for name in RECORD_FILES)
