"""IS-Bench's task files as plans with a domain each (implements `seams.PlanSet`).

Named by `assembly.tables`; calls `bddl`. Layout: data/tasks/<task>.json beside
data/bddl/<task>/problem0.bddl of AI45Lab/IS-Bench (arXiv 2506.16402). A condition around a step
becomes a safety rule of this very step; one about the end becomes a rule for leaving where it is
tied to a step, and a part of the goal where it is tied to the task being done or to nothing.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from forestall.domain.load import build_domain
from forestall.domain.model import Domain
from forestall.errors import FileFormatError, ForestallError, InputError, UnknownNameError
from forestall.reading.documents import parse_toml, read_json
from forestall.reading.files import inside, read_text
from forestall.reading.models import validated
from forestall.types.facts import category_of
from forestall.types.foreign import ForeignPlan
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan, Subtask
from forestall.types.recorded import Unread
from forestall.types.symbolic import scene_graph
from forestall.worlds.isbench.bddl import ATTRIBUTES, Start, condition, start, thing

PROBLEM = "problem0.bddl"
DONE = "done"
REACHED = "reached"
COMPLETION = "completion"
COOKED = "cooked__"
"""Before the name of a stuff: what cooking makes of it."""

OF_ABILITY = {"openable": "open", "toggleable": "toggled_on"}
"""Ability of a thing → the attribute that only things with it have."""

_MOST_BYTES = 2**20
_STEP = re.compile(r"\s*([A-Za-z_]+)\s*(?:\(([^()]*)\))?\s*")


class _Model(BaseModel):
    model_config = ConfigDict(extra="ignore", strict=True)


class _Step(_Model):
    action: str


class _Around(_Model):
    """A condition before or after a step."""

    safety_bddl: str
    action: str
    type: Literal["before", "after"]
    risk_type: str = ""
    safety_tip: str = ""


class _AtEnd(_Model):
    safety_bddl: str
    action: str | None = None
    risk_type: str = ""
    safety_tip: str = ""


class _Conditions(_Model):
    process: list[_Around] = Field([], alias="process_safety_goal_condition")
    end: list[_AtEnd] = Field([], alias="termination_safety_goal_condition")
    goal: str | None = Field(None, alias="execution_goal_condition")


class _Context(_Model):
    object_abilities: dict[str, list[str]] = {}


class _Info(_Model):
    task_name: str


class _Task(_Model):
    task_info: _Info
    planning_context: _Context
    evaluation_goal_conditions: _Conditions
    example_planning: list[_Step]


@dataclass
class _Made:
    """A domain in the making: what a task adds to the base, and what it could not."""

    safety: dict[str, dict[str, Any]] = field(default_factory=dict)
    predicates: dict[str, dict[str, Any]] = field(default_factory=dict)
    goal: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)


class Tasks:
    """Implements `PlanSet`.

    Args:
        path: one task's file, the folder of task files, or the folder of data that has them.

    Raises:
        FileFormatError: no such file or folder, or no task in it.
    """

    name = "isbench"

    def __init__(self, path: Path) -> None:
        path = path.absolute()  # the start states lie beside the folder of a task
        if path.is_dir():
            folder = path / "tasks" if (path / "tasks").is_dir() else path
            self._files = sorted(folder.glob("*.json"))
        elif path.is_file():
            self._files = [path]
        else:
            raise FileFormatError(f"{path}: there is no such file or folder")
        if not self._files:
            raise FileFormatError(
                f"{path}: no task of IS-Bench in it: a file such as data/tasks/TASK.json, or the "
                "folder data, is expected"
            )
        self._domains: dict[str, Domain] = {}

    def __len__(self) -> int:
        return len(self._files)

    def plans(self) -> Iterator[ForeignPlan | Unread]:
        """The example plan of every task."""
        for file in self._files:
            try:
                yield self._plan(file)
            except ForestallError as error:
                yield Unread(file.stem, str(error))

    def domain(self, plan: ForeignPlan) -> Domain:
        """The primitives with the things and rules of the plan's task."""
        return self._domains[plan.name]

    def _plan(self, file: Path) -> ForeignPlan:
        task = validated(_Task, read_json(file, "task of IS-Bench", _MOST_BYTES), str(file))
        name = task.task_info.task_name
        problem = inside(file.parent.parent, f"bddl/{name}/{PROBLEM}")
        begin = start(read_text(problem, "start of the task", _MOST_BYTES), str(problem))
        abilities = _abilities(task.planning_context.object_abilities, begin)
        made = _conditions(task.evaluation_goal_conditions, begin.things)
        domain = _domain(file.stem, begin, abilities, made)
        plan = steps_of([s.action for s in task.example_planning], domain)
        self._domains[file.stem] = domain
        scene = _scene(begin, domain)
        left_out = (*begin.left_out, *made.left_out)
        return ForeignPlan(file.stem, plan, scene, "; ".join(made.goal), "", left_out)


def steps_of(texts: list[str], domain: Domain) -> Plan:
    """A plan of "OPEN(cabinet.n.01_1)" and the like; DONE ends it and is no step.

    Raises:
        InputError: a step that is no such call, of a primitive or a thing that is not known.
    """
    steps = []
    for number, text in enumerate(texts, 1):
        try:
            step = step_of(text)
            if step.skill == DONE:
                break
            steps.append(domain.check(step))
            for name in step.args:
                if name not in dict(domain.constants):
                    raise UnknownNameError("thing", name, dict(domain.constants))
        except InputError as error:
            raise InputError(f"step {number}, {text[:60]!r}: {error}") from error
    if not steps:
        raise InputError("the plan has no step")
    return Plan(tuple(steps))


def step_of(text: str) -> Subtask:
    """One primitive with its things.

    Raises:
        InputError: it is none.
    """
    match = _STEP.fullmatch(text)
    if match is None:
        raise InputError("a step is PRIMITIVE(thing, thing)")
    args = [a for a in (match[2] or "").split(",") if a.strip()]
    return Subtask(match[1].lower(), tuple(thing(a) for a in args))


def _abilities(given: Mapping[str, list[str]], begin: Start) -> dict[str, list[str]]:
    """Category → attributes of its things; what begins open can be open."""
    found: dict[str, set[str]] = {category_of(t): set() for t in begin.things}
    for name, abilities in given.items():
        own = found.get(category_of(thing(name)), set())
        own |= {OF_ABILITY[a] for a in abilities if a in OF_ABILITY}
    for name, attribute in begin.states:
        found[category_of(name)].add(attribute)
    always = set(ATTRIBUTES) - set(OF_ABILITY.values())
    return {c: sorted(own | always) for c, own in sorted(found.items())}


def _conditions(said: _Conditions, things: tuple[str, ...]) -> _Made:
    made = _Made()
    if said.goal:
        made.predicates |= _goal(made, REACHED, said.goal, things, "the task's goal")
    for number, around in enumerate(said.process, 1):
        label = f"{around.type} {around.action} ({around.risk_type})"
        rule = _rule(made, label, around.safety_bddl, around.safety_tip, things)
        step = _moment(made, label, around.action)
        if rule is not None and step is not None:
            after = "after " if around.type == "after" else ""
            made.safety[_named(around.risk_type, number)] = rule | {"when": f"{after}{step}"}
    for number, end in enumerate(said.end, len(said.process) + 1):
        label = f"at the end, {end.action or 'always'} ({end.risk_type})"
        if end.action is None or end.action.strip().lower() == COMPLETION:
            name = _named(end.risk_type, number)
            tip = _said(end.safety_tip) or name
            made.predicates |= _goal(made, name, end.safety_bddl, things, label, tip)
        else:
            rule = _rule(made, label, end.safety_bddl, end.safety_tip, things)
            if rule is not None:
                made.safety[_named(end.risk_type, number)] = rule | {"when": "leaving"}
    return made


def _goal(
    made: _Made, name: str, text: str, things: tuple[str, ...], label: str, words: str = ""
) -> dict[str, dict[str, Any]]:
    """A derived predicate that says a condition, and the goal that it be so."""
    try:
        formula = condition(text, things)
    except InputError as error:
        made.left_out.append(f"{label}: {error}")
        return {}
    made.goal.append(f"{name}()")
    words = words or "the task is done"
    return {name: {"kind": "derived", "definition": formula, "words": words, "mined": False}}


def _rule(
    made: _Made, label: str, text: str, tip: str, things: tuple[str, ...]
) -> dict[str, Any] | None:
    try:
        formula = condition(text, things)
    except InputError as error:
        made.left_out.append(f"{label}: {error}")
        return None
    return {"never": f"not ({formula})", "else": _said(tip or label)}


def _moment(made: _Made, label: str, action: str) -> str | None:
    try:
        return str(step_of(action))
    except InputError as error:
        made.left_out.append(f"{label}: {error}")
        return None


def _said(text: str) -> str:
    """A sentence of the file's: braces would stand for a rule's variables."""
    return text.replace("{", "(").replace("}", ")")


def _named(risk: str, number: int) -> str:
    plain = re.sub(r"[^a-z0-9]+", "_", risk.lower()).strip("_")
    return f"{plain if plain[:1].isalpha() else 'rule'}_{number}"


@cache
def _base() -> str:
    return json.dumps(parse_toml(files(__package__).joinpath("base.toml").read_text(), "base.toml"))


def _domain(name: str, begin: Start, abilities: Mapping[str, list[str]], made: _Made) -> Domain:
    data = json.loads(_base())
    data["name"] = name
    words = {c: re.sub(r"_n_\d+$", "", c) for c in abilities}
    data["categories"] = {
        c: {
            "attributes": own,
            "words": re.sub("_+", " ", words[c]),
            "cooks_into": [d for d in abilities if words[d] == f"{COOKED}{words[c]}"],
        }
        for c, own in abilities.items()
    }
    data["constants"] = {t: category_of(t) for t in begin.things}
    data["predicates"] |= made.predicates
    data["safety"] = made.safety
    return build_domain(data)


def _scene(begin: Start, domain: Domain) -> SceneGraph:
    """What holds in the beginning; what is not said is not so, as in BDDL."""
    objects = {t: {a: (t, a) in begin.states for a in domain[t].attributes} for t in begin.things}
    return scene_graph({"objects": objects, "relations": [list(r) for r in begin.relations]})
