"""SafeAgentBench's tasks as plans, and hazardous final states as safety rules (a `seams.PlanSet`).

Named by `assembly.tables`; calls `actions`. Layout: the JSON lines of dataset/ of
shengyin1224/SafeAgentBench (arXiv 2412.13178): `step`, `final_state`, `scene_name`, and
`risk_category` of hazardous tasks. The rooms are AI2-THOR's and not in the set: a plan is
checked in a scene with what it names, in the state that it supposes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from importlib.resources import files
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from forestall.domain.load import build_domain
from forestall.domain.model import Domain
from forestall.errors import FileFormatError, ForestallError, InputError, UnknownNameError
from forestall.reading.documents import parse_json, parse_toml
from forestall.reading.files import read_text
from forestall.reading.models import validated
from forestall.types.foreign import ForeignPlan
from forestall.types.graph import SceneGraph
from forestall.types.recorded import Unread
from forestall.types.symbolic import scene_graph
from forestall.worlds.ai2thor.safeagentbench.actions import category, steps_of

SAFE, UNSAFE = "safe", "unsafe"
STATES = {
    "isOpen": ("open", "open", "closed"),
    "isToggled": ("toggled", "on", "off"),
    "isBroken": ("broken", "broken", "intact"),
    "isDirty": ("dirty", "dirty", "clean"),
    "isCooked": ("cooked", "cooked", "raw"),
    "isSliced": ("sliced", "sliced", "whole"),
}
"""Key of a final state → attribute, value where it is true, and where it is false."""

HELD, FILLED, WITHIN, CONTENT = (
    "isPickedUp", "isFilledWithLiquid", "parentReceptacles", "receptacleObjectIds"
)  # fmt: skip
TYPE = "objectType"

_MOST_BYTES = 16 * 2**20


class _Row(BaseModel):
    model_config = ConfigDict(extra="ignore", strict=True)

    step: list[str] | None = None
    final_state: list[dict[str, Any]] | None = None
    risk_category: str | None = None
    scene_name: str = ""


class SafeAgentBench:
    """Implements `PlanSet`.

    Args:
        path: a file of tasks (.jsonl), or a folder of such files.

    Raises:
        FileFormatError: no such file or folder, or no line in it.
    """

    name = "safeagentbench"

    def __init__(self, path: Path) -> None:
        if not path.exists():
            raise FileFormatError(f"{path}: there is no such file or folder")
        named = sorted(path.glob("*.jsonl")) if path.is_dir() else [path]
        self._lines = [
            (f"{file.stem}-{number}", f"{file}, line {number}", text)
            for file in named
            for number, text in enumerate(_lines(file), 1)
            if text.strip()
        ]
        if not self._lines:
            raise FileFormatError(f"{path}: no task in it: a file of JSON lines is expected")

    def __len__(self) -> int:
        return len(self._lines)

    def plans(self) -> Iterator[ForeignPlan | Unread]:
        """Every task with steps, in the order of the files."""
        for name, source, text in self._lines:
            try:
                yield self._plan(name, _row(text, source))
            except ForestallError as error:
                yield Unread(name, str(error))

    def domain(self, plan: ForeignPlan) -> Domain:
        """One for all: AI2-THOR's with the set's actions, and a rule for each hazardous end."""
        return self._domain

    @cached_property
    def _base(self) -> Mapping[str, Any]:
        own = files("forestall.domains").joinpath("ai2thor", "domain.toml").read_text("utf-8")
        data = parse_toml(own, "domain.toml")
        text = files(__package__).joinpath("actions.toml").read_text("utf-8")
        added = parse_toml(text, "actions.toml")
        merged = {key: {**data[key], **added[key]} for key in added}
        return {**data, "name": self.name, **merged}

    @cached_property
    def _plain(self) -> Domain:
        return build_domain(self._base)

    @cached_property
    def _domain(self) -> Domain:
        rules: dict[str, dict[str, Any]] = {}
        for _, source, text in self._lines:
            try:
                row = _row(text, source)
                if row.risk_category and row.final_state:
                    rule = rule_of(row.final_state, row.risk_category, self._plain)
                    rules.setdefault(rule["never"], rule)
            except ForestallError:
                continue  # its own plan tells why
        named = {f"{_slug(r['else'])}_{n}": r for n, r in enumerate(rules.values(), 1)}
        return build_domain({**self._base, "safety": {**self._base["safety"], **named}})

    def _plan(self, name: str, row: _Row) -> ForeignPlan:
        if not row.step:
            raise InputError("it has no steps: only a sentence says what is to be done")
        plan, began = steps_of(row.step, self._plain)
        named = {a for step in plan for a in step.args}
        label = UNSAFE if row.risk_category else SAFE
        facts: list[str] = []
        left_out: list[str] = []
        if row.final_state is not None and label == SAFE:
            facts, left_out = facts_of(row.final_state, self._plain)
        elif row.final_state:
            try:
                rule_of(row.final_state, row.risk_category or "", self._plain)
            except InputError as error:
                left_out = [f"no rule of its final state: {error}"]
        scene = _scene(named, began, self._plain)
        return ForeignPlan(name, plan, scene, "; ".join(facts), label, tuple(left_out))


def facts_of(final: Sequence[Mapping[str, Any]], domain: Domain) -> tuple[list[str], list[str]]:
    """A final state as facts over categories, and what of it is none.

    Raises:
        InputError: an entry without the type of its object.
    """
    facts: list[str] = []
    left_out: list[str] = []
    for entry in final:
        if not isinstance(entry.get(TYPE), str):
            raise InputError(f"final_state: an entry has no {TYPE}")
        for key, value in entry.items():
            if key == TYPE or value is None:
                continue
            try:
                facts += _facts(category(entry[TYPE], domain), key, value, domain)
            except InputError as error:
                left_out.append(f"final state {entry[TYPE]}.{key}: {error}")
    return list(dict.fromkeys(facts)), left_out


def rule_of(final: Sequence[Mapping[str, Any]], risk: str, domain: Domain) -> dict[str, Any]:
    """The rule that a robot never leaves a scene in a final state.

    Raises:
        InputError: a part of the state cannot be said; a rule without it would say too much.
    """
    facts, left_out = facts_of(final, domain)
    if left_out or not facts:
        raise InputError("; ".join(left_out) or "it says nothing")
    variables: dict[str, str] = {}

    def variable(match: re.Match[str]) -> str:
        if match[0] not in domain.categories:
            return match[0]
        return variables.setdefault(match[0], f"?x{len(variables) + 1}")

    formula = " and ".join(re.sub(r"\b[A-Z]\w*", variable, fact) for fact in facts)
    return {
        "never": formula,
        "every": [f"{v} - {c}" for c, v in variables.items()],
        "when": "leaving",
        "else": risk.strip().replace("{", "(").replace("}", ")"),
    }


def _facts(thing: str, key: str, value: Any, domain: Domain) -> list[str]:
    if key in STATES and isinstance(value, bool):
        attribute, true, false = STATES[key]
        slices = sorted(domain.becomes(thing) - {thing}) if key == "isSliced" else ()
        of = next(iter(slices), thing)
        _has(of, attribute, domain)
        return [f"{attribute}({of})={true if value else false}"]
    if key == FILLED and isinstance(value, bool):
        _has(thing, "filled", domain)
        return [f"full({thing})" if value else f"filled({thing})=empty"]
    if key == HELD and isinstance(value, bool):
        return [f"{'' if value else 'not '}held_by({thing}, gripper)"]
    if key in (WITHIN, CONTENT):
        several = [value] if isinstance(value, str) else value
        if not isinstance(several, list):
            raise InputError(f"a list of object types is expected, not {value!r}")
        others = [category(str(other), domain) for other in several]
        pairs = [(thing, o) if key == WITHIN else (o, thing) for o in others]
        return [f"{_relation(b, domain)}({a}, {b})" for a, b in pairs]
    raise UnknownNameError("entry of a final state", key, (*STATES, HELD, FILLED, WITHIN, CONTENT))


def _has(thing: str, attribute: str, domain: Domain) -> None:
    if attribute not in domain[thing].attributes:
        raise InputError(f"{thing} has no {attribute}")


def _relation(place: str, domain: Domain) -> str:
    return "inside" if domain.is_a(place, "takes_inside") else "on_top_of"


def _scene(named: set[str], began: Mapping[tuple[str, str], str], domain: Domain) -> SceneGraph:
    """One of each fixture and one of each thing that is named, as a plan supposes them."""
    fixtures = [c for c in domain.categories if domain.is_a(c, domain.roles.fixture)]
    movable = [c for c in sorted(named) if c not in fixtures and not _made(c, named, domain)]
    objects = {f"{c}-1": {"category": c, **domain.default_states(c)} for c in (*fixtures, *movable)}
    for (thing, attribute), value in began.items():
        controlled = [c for c in fixtures if domain.static("controls", thing, c)]
        for c in (thing, *controlled):
            if attribute in domain[c].attributes and f"{c}-1" in objects:
                objects[f"{c}-1"][attribute] = value
    relations = [[f"{c}-1", "on_top_of", f"{_place(c, fixtures, domain)}-1"] for c in movable]
    return scene_graph({"objects": {**objects, "gripper": {}}, "relations": relations})


def _made(thing: str, named: set[str], domain: Domain) -> bool:
    """Whether a thing only comes about: the slices of something that is named, too."""
    return any(thing in domain.becomes(n) for n in named if n != thing)


def _place(thing: str, fixtures: Sequence[str], domain: Domain) -> str:
    open_ones = [c for c in fixtures if domain.is_a(c, "takes_on_top") and not domain.encloses(c)]
    taking = [c for c in open_ones if domain.accepts(c, thing) and not domain.is_a(c, "limited")]
    return taking[0] if taking else "Floor"


def _row(text: str, source: str) -> _Row:
    try:
        data = parse_json(text)
    except FileFormatError as error:
        raise FileFormatError(f"{source}: {error}") from error
    return validated(_Row, data, source)


def _lines(file: Path) -> list[str]:
    return read_text(file, "tasks of SafeAgentBench", _MOST_BYTES).splitlines()


def _slug(text: str) -> str:
    plain = re.sub(r"[^a-z0-9]+", "_", text.lower()).strip("_")
    return plain if plain[:1].isalpha() else f"hazard_{plain}".rstrip("_")
