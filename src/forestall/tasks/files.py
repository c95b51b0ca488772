"""Task and scenario files: one documented TOML format, validated, with a JSON schema.

Calls: command line and build → here → types. A task file holds the goal, the nominal plan, what
the scene needs, and, when it speaks of things that the project does not know, their categories. A
scenario file names a task and adds faults; a file of a set holds several scenarios of one task. All
are checked against the domain when loaded.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, TypeAdapter

from forestall.config import DEFAULT_DOMAIN
from forestall.domain.checks import check_literal
from forestall.domain.load import extend, load_domain, shipped_names
from forestall.domain.model import Domain
from forestall.errors import InputError, UnknownNameError
from forestall.reading.documents import MOST_TOML_BYTES, parse_toml
from forestall.reading.files import read_text
from forestall.reading.models import validated
from forestall.tasks.faults import Fault
from forestall.tasks.schemas import (
    GoalFile,
    ScenarioFields,
    ScenarioFile,
    ScenarioSetFile,
    SceneFile,
    TaskFile,
)
from forestall.types.facts import Literal as Fact
from forestall.types.facts import category_of, is_instance
from forestall.types.plan import Plan, Subtask
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.types.task import Goal, Task

SETS = (
    *("examples", "robofail", "irreversible", "harmless"),
    *("everyday", "composed", "midrun", "double", "planner", "planner-harmless", "eyes", "hidden"),
    "long",
)
"""Sets of shipped scenarios; each but the first is a folder of its own (docs/experiments.md)."""

HARMLESS_SETS = ("harmless", "everyday", "planner-harmless")
"""Sets of starts in which nothing fails because of what is different."""

LONG = "long"
"""The folder of tasks of more than 25 steps, and the set of their scenarios."""

END = "end"
"""The moment after the last step of a plan."""

M = TypeVar("M", bound=BaseModel)


@dataclass(frozen=True, slots=True)
class LoadedTask:
    """A task with the domain that it is written in, what the file adds included."""

    task: Task
    domain: Domain


@dataclass(frozen=True, slots=True)
class Scenario:
    """A task with faults.

    Args:
        name: unique among all sets.
        task: name of its task.
        title: in a few words.
        kind: what sort of failure it is, in RoboFail's terms where it has one.
        cause: what is wrong, in a sentence; for a harmless one, what is different.
        faults: what is changed.
        set: one of `SETS`; "own" for a user's file.
        source: which published episode it rebuilds, empty for one of our own.
        known: the first step of its plan before which one who looks well and knows the task can
            know that the run will fail, "end" for after the last one; None for a harmless one.
        effect: the first step from then on that is refused or does harm because of it (a thing
            that breaks by falling: the step on which it falls), "end" where none is and the run
            merely ends without its goal; None likewise.
        domain: whose it is, where it comes with the project.
        compared: whether what is compared before some step differs because of it.

    Both are a step in text form; " #2" behind it means its second occurrence.
    """

    name: str
    task: str
    title: str
    kind: str
    cause: str
    faults: tuple[Fault, ...]
    set: str = "own"
    source: str = ""
    known: str | None = None
    effect: str | None = None
    domain: str = ""
    compared: bool | None = None

    @property
    def harmless(self) -> bool:
        """Whether nothing fails because of it."""
        return self.set in HARMLESS_SETS

    def moments(self, plan: Plan) -> tuple[int | None, int | None]:
        """Where `known` and `effect` are in the plan that the run starts with, from 0.

        Raises:
            InputError: the plan has no such step.
        """
        return moment(self.known, plan), moment(self.effect, plan)


def schemas() -> dict[str, Any]:
    """JSON schemas of both file formats."""
    return {
        "task": TypeAdapter(TaskFile).json_schema(),
        "scenario": TypeAdapter(ScenarioFile).json_schema(),
    }


def task_names(domain: str | None = DEFAULT_DOMAIN) -> tuple[str, ...]:
    """Names of the shipped tasks of a domain; None: of all. The long ones are not among them."""
    return tuple(sorted(n for n, _, d in _shipped("tasks") if domain in (None, d)))


def long_task_names(domain: str | None = DEFAULT_DOMAIN) -> tuple[str, ...]:
    """Names of the shipped tasks of more than 25 steps."""
    return tuple(sorted(n for n, _, d in _shipped("tasks", LONG) if domain in (None, d)))


def scenario_names(of: str | None = None, domain: str | None = DEFAULT_DOMAIN) -> tuple[str, ...]:
    """Names of the shipped scenarios of a domain (None: of all), of one set or of all.

    Raises:
        UnknownNameError: no such set.
    """
    if of is not None and of not in SETS:
        raise UnknownNameError("set of scenarios", of, SETS)
    return tuple(
        n for n, s in _scenarios().items() if of in (None, s.set) and domain in (None, s.domain)
    )


def load_task(name_or_file: str, domain: Domain | None = None) -> LoadedTask:
    """A shipped task by name, or any task file by path.

    Args:
        name_or_file: of the task.
        domain: what to read it in, in the place of the domain that it names.

    Raises:
        UnknownNameError: neither a shipped task nor a file.
        FileFormatError: the file is not TOML or has a wrong field.
        InputError: it speaks of a skill, category, attribute or value that is not known.
    """
    source, text, own = _read("tasks", "task", name_or_file)
    data = _validated(TaskFile, source, text)
    if domain is None:
        return _task(source, data, lambda: load_domain(beside(source, data.domain or own)))
    other = f"{source} does not fit the domain {domain.name!r}"
    return _task(other, data, lambda: domain)


def load_scenario(name_or_file: str) -> Scenario:
    """A shipped scenario by name, or any scenario file by path.

    Raises:
        UnknownNameError: neither a shipped scenario nor a file.
        FileFormatError: the file is not TOML or has a wrong field.
    """
    if _is_file(name_or_file):
        source, text, _ = _read("scenarios", "scenario", name_or_file)
        data = _validated(ScenarioFile, source, text)
        return _scenario(data, data.task, "own")
    shipped = _scenarios()
    if name_or_file not in shipped:
        raise UnknownNameError("scenario", name_or_file, shipped)
    return shipped[name_or_file]


@cache
def _scenarios() -> Mapping[str, Scenario]:
    """Every shipped scenario by name, in the order of sets, tasks and files."""
    found: dict[str, Scenario] = {}
    for name, text, domain in sorted(_shipped("scenarios")):
        data = _validated(ScenarioFile, name, text)
        found[data.name] = _scenario(data, data.task, SETS[0], domain)
    for set_name in SETS[1:]:
        for name, text, domain in sorted(_shipped("scenarios", set_name)):
            several = _validated(ScenarioSetFile, f"{set_name}/{name}", text)
            for one in several.scenarios:
                if one.name in found:
                    raise InputError(f"{set_name}/{name}: there are two scenarios {one.name}")
                found[one.name] = _scenario(one, several.task, set_name, domain)
    return found


def _scenario(data: ScenarioFields, task: str, set_name: str, domain: str = "") -> Scenario:
    return Scenario(
        data.name,
        task,
        data.title,
        data.kind,
        data.cause,
        tuple(data.faults),
        set_name,
        data.source,
        data.known,
        data.effect,
        domain,
        data.compared,
    )


def moment(text: str | None, plan: Plan) -> int | None:
    """Where a moment as scenario files write it is in a plan, from 0; None for none.

    Raises:
        InputError: the plan has no such step.
    """
    if text is None:
        return None
    if text == END:
        return len(plan)
    step, _, number = text.partition("#")
    wanted = str(Subtask.parse(step))
    places = [i for i, t in enumerate(plan.texts()) if t == wanted]
    occurrence = int(number) if number.strip().isdigit() else 0 if number else 1
    if not 1 <= occurrence <= len(places):
        raise InputError(f"{text!r}: the plan has {wanted} {len(places)} time(s)")
    return places[occurrence - 1]


def _is_file(name_or_file: str) -> bool:
    return name_or_file.endswith(".toml") or "/" in name_or_file


def _shipped(*folders: str) -> Iterator[tuple[str, str, str]]:
    """Name, text and domain of the files in a folder of every shipped domain."""
    for domain in shipped_names():
        place = files("forestall").joinpath("domains", domain, *folders)
        for entry in place.iterdir() if place.is_dir() else ():
            if entry.name.endswith(".toml"):
                yield entry.name.removesuffix(".toml"), entry.read_text(encoding="utf-8"), domain


def _read(folder: str, kind: str, name_or_file: str) -> tuple[str, str, str]:
    """Source, text and domain of a file; one of the user's own says its domain itself."""
    if _is_file(name_or_file):
        path = Path(name_or_file)
        return str(path), read_text(path, f"{kind} file", MOST_TOML_BYTES), DEFAULT_DOMAIN
    found = (*_shipped(folder), *_shipped(folder, LONG))
    shipped = {name: (text, domain) for name, text, domain in found}
    if name_or_file not in shipped:
        raise UnknownNameError(kind, name_or_file, shipped)
    return name_or_file, *shipped[name_or_file]


def _validated(model: type[M], source: str, text: str) -> M:
    return validated(model, parse_toml(text, source), source)


def _task(source: str, data: TaskFile, read_in: Callable[[], Domain]) -> LoadedTask:
    try:
        domain = _extended(read_in(), data)
        goal = goal_from(data.goal, domain)
        plan = domain.check_plan(Plan.parse(data.plan, data.goal.text))
        for subtask in plan:
            for name in subtask.args:
                domain[name]
        scene = _scene(data.scene, domain)
        task = Task(data.name, data.title, goal, plan, scene, domain.name)
    except InputError as error:
        raise InputError(f"{source}: {error}") from error
    return LoadedTask(task, domain)


def beside(source: str, name: str) -> str:
    """A domain file is found from the task file that names it, wherever one works."""
    return str(Path(source).parent / name) if name.endswith((".toml", ".pddl")) else name


def _extended(domain: Domain, data: TaskFile) -> Domain:
    """The task's domain with what the file adds to it."""
    attributes = {n: t.model_dump(exclude_none=True) for n, t in data.attributes.items()}
    return extend(domain, data.categories, attributes)


def goal_from(data: GoalFile, domain: Domain) -> Goal:
    """A goal as a task file has it, every name checked.

    Raises:
        InputError: a name that means nothing, or a fact that nothing can meet.
    """
    for variable, category in data.variables.items():
        if not variable.startswith("?"):
            raise InputError(f"goal variable {variable!r} must start with '?'")
        domain[category]

    def facts(texts: list[str]) -> tuple[Fact, ...]:
        return tuple(goal_fact(t, data.variables, domain) for t in texts)

    return Goal(
        text=data.text,
        variables=tuple(sorted(data.variables.items())),
        literals=facts(data.all),
        never=facts(data.never),
        weak=facts(data.weak),
    )


def goal_fact(text: str, variables: Mapping[str, str], domain: Domain) -> Fact:
    """A fact of a goal, every name checked.

    Raises:
        InputError: a name that means nothing, or a fact that nothing can meet.
    """
    fact = Fact.parse(text)
    check_literal(domain, "goal", fact)
    for name in fact.args:
        if name.startswith("?"):
            if name not in variables:
                raise UnknownNameError("goal variable", name, variables)
        elif name not in domain.robot.hands:
            domain[name]
    if fact.is_state:
        _can_have(domain, fact, variables.get(fact.args[0], fact.args[0]))
    return fact


def _can_have(domain: Domain, fact: Fact, name: str) -> None:
    """See that a thing has the attribute that a goal is about: else nothing can meet it."""
    own = domain[name]
    if fact.predicate in own.attributes:
        return
    having = [c.name for c in domain.categories.values() if fact.predicate in c.attributes]
    near = [c for c in having if own.name in domain.paired(c) or c in domain.paired(own.name)]
    raise InputError(
        f"goal '{fact}': nothing can meet it, for {own.name} has no {fact.predicate}"
        + (f"; {' and '.join(near)} that belongs to it has" if near else "")
    )


def _scene(data: SceneFile, domain: Domain) -> SceneNeeds:
    if not 0 <= data.clutter[0] <= data.clutter[1]:
        raise InputError(f"scene.clutter {list(data.clutter)}: write [least, most]")
    numbers: dict[str, int] = {}
    objects = []
    for need in data.objects:
        category = domain[need.category].name
        for place in need.places:
            domain[place]
        check_states(category, need.states, domain)
        numbers[category] = numbers.get(category, 0) + 1
        objects.append(
            ObjectNeed(
                id=need.id or f"{category}-{numbers[category]}",
                category=category,
                places=tuple(domain.canonical(p) for p in need.places),
                states=tuple(sorted(need.states.items())),
                in_front_of=need.in_front_of,
            )
        )
    overrides = []
    for name, states in data.fixtures.items():
        check_states(name, states, domain)
        instance = name if is_instance(name) else f"{domain[name].name}-1"
        overrides += [(instance, a, v) for a, v in sorted(states.items())]
    return SceneNeeds(data.room, tuple(objects), tuple(overrides), data.clutter)


def check_states(name: str, states: Mapping[str, str], domain: Domain) -> None:
    """See that a thing can have these states.

    Raises:
        InputError: no such thing, attribute or value.
    """
    category = domain[category_of(name)]
    for attribute, value in states.items():
        if attribute not in category.attributes:
            raise UnknownNameError(f"attribute of {category.name}", attribute, category.attributes)
        if value not in domain.values(attribute):
            raise UnknownNameError(f"{attribute} of {name}", value, domain.values(attribute))
