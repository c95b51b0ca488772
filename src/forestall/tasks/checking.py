"""Everything that is wrong with a task or scenario file, at once; `files` stops at the first.

Called by the command line; calls `files`, `faults` and the domain's own checks, one item of the
file after the other, so that a wrong name hides none of the others.
"""

from __future__ import annotations

import typing
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from forestall.config import DEFAULT_DOMAIN
from forestall.domain.formula import Parameter
from forestall.domain.load import extend, load_domain
from forestall.domain.model import Domain
from forestall.errors import FileFormatError, InputError, UnknownNameError
from forestall.reading.documents import MOST_TOML_BYTES, parse_toml
from forestall.reading.files import read_text
from forestall.reading.models import found
from forestall.tasks.faults import apply_plan_faults, apply_scene_faults, check_steps, parse_fault
from forestall.tasks.files import (
    LoadedTask,
    beside,
    check_states,
    goal_fact,
    load_scenario,
    load_task,
    moment,
)
from forestall.tasks.scene_faults import FaultTable
from forestall.tasks.schemas import ScenarioFile, ScenarioSetFile, TaskFile
from forestall.types.plan import Plan, Subtask

_SHOWN = 8
"""How many categories that would do are named."""


@dataclass(slots=True)
class CheckedFile:
    """What was found.

    Args:
        kind: "task", "scenario" or "set of scenarios".
        faults: one sentence each, with its place in the file; none: the file does.
    """

    kind: str
    faults: list[str] = field(default_factory=list)

    @contextmanager
    def at(self, place: str) -> Iterator[None]:
        """What goes wrong within the block stands among the faults, and nothing is raised."""
        try:
            yield
        except InputError as error:
            self.faults.append(f"{place}: {error}")


def check_file(path: Path, task: str | None = None, domain: Domain | None = None) -> CheckedFile:
    """Look at a whole file.

    Args:
        path: a task file, a scenario file, or one with several scenarios.
        task: of a scenario, a name or a file; the one that the file names by default.
        domain: what a task is read in; the one that the file names by default.

    Raises:
        FileFormatError: the file cannot be read at all.
    """
    text = read_text(path, "task or scenario file", MOST_TOML_BYTES)
    try:
        data = parse_toml(text, str(path))
    except FileFormatError as error:
        return CheckedFile("file", [str(error).removeprefix(f"{path}: ")])
    if "scenarios" in data:
        checked = CheckedFile("set of scenarios")
        _shape(checked, ScenarioSetFile, data)
        _scenarios(checked, data, task)
    elif "faults" in data:
        checked = CheckedFile("scenario")
        _shape(checked, ScenarioFile, data)
        _scenarios(checked, {**data, "scenarios": [data]}, task, "")
    else:
        checked = CheckedFile("task")
        _shape(checked, TaskFile, data)
        _task(checked, data, path, domain)
    if not checked.faults and checked.kind == "task":
        with checked.at("the whole"):
            load_task(str(path), domain)
    if not checked.faults and checked.kind == "scenario":
        with checked.at("the whole"):
            load_scenario(str(path))
    return checked


def _shape(checked: CheckedFile, model: type[BaseModel], data: Mapping[str, Any]) -> None:
    """Fields that are missing, not known, or of another type."""
    try:
        model.model_validate(data)
    except ValidationError as error:
        for fault in error.errors(include_url=False):
            place = _place(fault["loc"])
            if fault["type"] == "extra_forbidden":
                known = _known_fields(model, fault["loc"][:-1])
                name = str(fault["loc"][-1])
                checked.faults.append(f"{place}: {UnknownNameError('field', name, known)}")
            else:
                value = "" if fault["type"] == "missing" else found(fault["input"])
                checked.faults.append(f"{place}: {fault['msg']}{value}")


def _place(loc: Iterable[str | int]) -> str:
    """A place in the file as one writes it: goal.all[1]."""
    text = ""
    for part in loc:
        text += f"[{part + 1}]" if isinstance(part, int) else f".{part}" if text else part
    return text or "the file"


def _known_fields(model: Any, loc: Iterable[str | int]) -> list[str]:
    """The fields of the table at a place; of a fault, those of its kind."""
    kinds = {c.model_fields["kind"].default: c for c in _leaves(FaultTable)}
    for part in loc:
        fields = getattr(model, "model_fields", {})
        if part in fields:
            model = fields[part].annotation
        elif part in kinds:
            model = kinds[part]
        else:
            model = next((a for a in typing.get_args(model) if a is not str), model)
    while not hasattr(model, "model_fields") and typing.get_args(model):
        model = typing.get_args(model)[-1]
    return list(getattr(model, "model_fields", ()))


def _leaves(of: type[FaultTable]) -> Iterator[type[FaultTable]]:
    if "kind" in of.model_fields:
        yield of
    for below in of.__subclasses__():
        yield from _leaves(below)


def _task(checked: CheckedFile, data: Mapping[str, Any], path: Path, domain: Domain | None) -> None:
    """Names that mean nothing in the domain of a task."""
    if domain is None:
        named = data.get("domain")
        name = named if isinstance(named, str) else DEFAULT_DOMAIN
        try:
            domain = load_domain(beside(str(path), name))
        except InputError as error:
            checked.faults.append(f"domain: {error}")
            return
    domain = _extended(checked, data, domain)
    _steps(checked, "plan", _texts(data.get("plan")), domain)
    _goal(checked, _table(data.get("goal")), domain)
    _scene(checked, _table(data.get("scene")), domain)


def _extended(checked: CheckedFile, data: Mapping[str, Any], domain: Domain) -> Domain:
    """The domain with every table of the file that does; each of the others is a fault."""
    tables = {k: _table(data.get(k)) for k in ("attributes", "categories")}
    try:
        return extend(domain, tables["categories"], tables["attributes"])
    except InputError as error:
        whole, before = str(error), len(checked.faults)
    for kind, each in tables.items():
        for name, table in each.items():
            one = {kind: {name: table}}
            with checked.at(f"{kind}.{name}"):
                domain = extend(domain, one.get("categories", {}), one.get("attributes", {}))
    if len(checked.faults) == before:  # each does alone, and together they do not
        checked.faults.append(whole)
    return domain


def _steps(checked: CheckedFile, place: str, texts: Mapping[int, str], domain: Domain) -> None:
    for number, text in texts.items():
        with checked.at(f"{place}[{number}]"):
            step = Subtask.parse(text)
            for name in step.args:
                with checked.at(f"{place}[{number}]"):
                    domain[name]
            domain.check(step)
            for name, parameter in zip(step.args, domain.skill(step.skill).parameters, strict=True):
                with checked.at(f"{place}[{number}]"):
                    _fits(step, name, parameter, domain)


def _fits(step: Subtask, name: str, parameter: Parameter, domain: Domain) -> None:
    """See that an argument is of the kind that the skill takes there."""
    kind = parameter.kind
    if kind is None or domain.find(name) is None or domain.is_a(name, kind):
        return
    fitting = sorted(c for c in domain.categories if domain.is_a(c, kind))
    shown = (
        fitting if len(fitting) <= _SHOWN else [*fitting[:_SHOWN], f"... ({len(fitting)} in all)"]
    )
    role, those = parameter.name.removeprefix("?"), ", ".join(shown) or "nothing"
    raise InputError(f"{step}: {name} is no {kind}: {role} of {step.skill} can be {those}")


def _goal(checked: CheckedFile, goal: Mapping[str, Any], domain: Domain) -> None:
    variables: dict[str, str] = {}
    for name, category in _table(goal.get("variables")).items():
        with checked.at(f"goal.variables.{name}"):
            if not name.startswith("?"):
                raise InputError(f"goal variable {name!r} must start with '?'")
            variables[name] = str(category)
            domain[str(category)]
    for kind in ("all", "never", "weak"):
        for number, text in _texts(goal.get(kind)).items():
            with checked.at(f"goal.{kind}[{number}]"):
                goal_fact(text, variables, domain)


def _scene(checked: CheckedFile, scene: Mapping[str, Any], domain: Domain) -> None:
    objects = scene.get("objects")
    for number, need in enumerate(objects if isinstance(objects, list) else [], 1):
        place, table = f"scene.objects[{number}]", _table(need)
        if not isinstance(table.get("category"), str):
            continue
        with checked.at(f"{place}.category"):
            domain[table["category"]]
            _states(checked, f"{place}.states", table["category"], table.get("states"), domain)
        for at, name in _texts(table.get("places")).items():
            with checked.at(f"{place}.places[{at}]"):
                domain[name]
    for name, states in _table(scene.get("fixtures")).items():
        with checked.at(f"scene.fixtures.{name}"):
            domain[name]
            _states(checked, f"scene.fixtures.{name}", name, states, domain)


def _states(checked: CheckedFile, place: str, name: str, states: Any, domain: Domain) -> None:
    for attribute, value in _table(states).items():
        with checked.at(f"{place}.{attribute}"):
            check_states(name, {attribute: str(value)}, domain)


def _scenarios(
    checked: CheckedFile, data: Mapping[str, Any], task: str | None, prefix: str = "scenarios"
) -> None:
    """Faults that cannot be in their task, and moments that its plan does not have."""
    try:
        loaded = load_task(task or str(data.get("task", "")))
    except InputError as error:
        how = "" if task else " (of a task of your own give the file: --task FILE)"
        checked.faults.append(f"task: {error}{how}")
        return
    given = data.get("task")
    if task is not None and given != loaded.task.name:
        checked.faults.append(f"task: {given!r} is not {loaded.task.name!r}, the task of {task}")
    each = data["scenarios"]
    for number, table in enumerate(each if isinstance(each, list) else [], 1):
        _scenario(checked, _table(table), loaded, f"{prefix}[{number}]." if prefix else "")


def _scenario(
    checked: CheckedFile, table: Mapping[str, Any], loaded: LoadedTask, prefix: str
) -> None:
    plan, scene, domain = loaded.task.plan, loaded.task.scene, loaded.domain
    faults = table.get("faults")
    for number, told in enumerate(faults if isinstance(faults, list) else [], 1):
        try:
            fault = parse_fault(_table(told))
        except InputError:
            continue  # its shape is told already
        with checked.at(f"{prefix}faults[{number}]"):
            scene = apply_scene_faults(scene, [fault], domain)
            changed = apply_plan_faults(plan, [fault], domain)
            check_steps(changed, [fault], domain)
            plan = changed
    for name in ("known", "effect"):
        with checked.at(f"{prefix}{name}"):
            _moment(table.get(name), plan)


def _moment(text: object, plan: Plan) -> None:
    if isinstance(text, str):
        moment(text, plan)


def _table(value: object) -> Mapping[str, Any]:
    """A table of the file; what is none was told with the shape of the file."""
    return value if isinstance(value, dict) else {}


def _texts(value: object) -> Mapping[int, str]:
    """The texts of a list, by their numbers from 1."""
    each = value if isinstance(value, list) else []
    return {n: text for n, text in enumerate(each, 1) if isinstance(text, str)}
