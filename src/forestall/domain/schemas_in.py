"""Skills, processes and safety rules from their tables: text becomes formulas, events are put in.

Called by `load`; calls `formula` and `model`. Whether the names in them exist is seen by `checks`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

from forestall.domain.formula import (
    TRUE,
    And,
    Formula,
    Parameter,
    Some,
    bind,
    free,
    parse_formula,
)
from forestall.domain.model import Domain
from forestall.domain.phrases import table as as_table
from forestall.domain.schema import Choice, Copy, Effect, Make, Need, Process, SafetyRule, Skill
from forestall.errors import InputError, UnknownNameError
from forestall.types.facts import Literal

SKILL_FIELDS = tuple(f.name for f in fields(Skill) if f.name != "name")
"""Fields of the table of a skill."""

_COPY = re.compile(r"^\s*(\w+)\s*\(\s*(\?\w+)\s*\)\s*=\s*\1\s*\(\s*(\?\w+)\s*\)\s*$")
_MOMENT = re.compile(r"(?P<after>after\s+)?(?P<skill>\w*)\s*(?:\((?P<args>[^()]*)\))?\s*")
_PARAMETER = re.compile(r"^\s*(\??)([A-Za-z_]\w*)(?:\s*-\s*([A-Za-z_]\w*))?\s*$")


def parameter(label: str, text: Any) -> Parameter:
    """Read "?x", "object" or "object - pickupable".

    Raises:
        InputError: it is something else.
    """
    match = _PARAMETER.match(text) if isinstance(text, str) else None
    if match is None:
        raise InputError(f'{label}: cannot read {text!r} as a variable: write "?x" or "?x - kind"')
    return Parameter(f"?{match[2]}", match[3])


def read_skill(name: str, table: Mapping[str, Any], events: Mapping[str, Any], d: Domain) -> Skill:
    """One skill.

    Raises:
        InputError: something in it cannot be read.
    """
    label = f"skill {name}"
    _fields(label, table, SKILL_FIELDS)
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise InputError(f"{label}: the name must be lower-case letters, digits and '_'")
    reader = _Effects(label, events, d)
    done = table.get("done_when")
    skill = Skill(
        name,
        tuple(parameter(label, p) for p in _list(label, "parameters", table)),
        choices=tuple(_choice(label, c) for c in _list(label, "choices", table)),
        needs=tuple(_need(label, n) for n in _list(label, "needs", table)),
        prefers=tuple(parse_formula(p) for p in _list(label, "prefers", table)),
        effects=tuple(e for x in _list(label, "effects", table) for e in reader.read(x)),
        makes=tuple(_make(label, m) for m in _list(label, "makes", table)),
        at=_variable(label, table.get("at")),
        drives=_flag(label, "drives", table),
        hand=_variable(label, table.get("hand")),
        words=table.get("words", name.replace("_", " ")),
        says=_says(label, table),
        family=table.get("family", name),
        undoes=None if "undoes" not in table else Literal.parse(table["undoes"]),
        done_when=None if done is None else parse_formula(done),
        duration_s=float(table.get("duration_s", 0.0)),
    )
    return replace(skill, choices=_weighed(skill))


def _says(label: str, table: Mapping[str, Any]) -> str:
    """How a step is said, with its parameters in braces."""
    said = str(table.get("says", ""))
    names = [parameter(label, p).name[1:] for p in _list(label, "parameters", table)]
    for name in re.findall(r"\{(.*?)\}", said):
        if name not in names:
            raise UnknownNameError(f"parameter in says of {label}", name, names)
    return said


def _weighed(skill: Skill) -> tuple[Choice, ...]:
    """The choices, each with whether anything but the robot's own place depends on it."""
    formulas: list[Formula] = [n.formula for n in skill.needs]
    formulas += [n.find for n in skill.needs if n.find is not None]
    formulas += [*skill.prefers, *([skill.done_when] if skill.done_when is not None else [])]
    formulas += [f for e in skill.effects for f in (e.condition, *e.facts)]
    used = {name for f in formulas for name in free(f)}
    used |= {x for e in skill.effects for c in e.copies for x in (c.target, c.source)}
    used |= {x for e in skill.effects for x in e.gone}
    weighed: list[Choice] = []
    for choice in reversed(skill.choices):
        decides = choice.variable.name in used
        weighed.append(replace(choice, decides=decides))
        if decides:
            parts = (*choice.among, choice.such_that, choice.only_if)
            used |= {name for f in parts for name in free(f)}
    return tuple(reversed(weighed))


def read_process(name: str, table: Any, events: Mapping[str, Any], d: Domain) -> Process:
    """One process.

    Raises:
        InputError: something in it cannot be read.
    """
    label = f"process {name}"
    table = as_table(label, table)
    _fields(label, table, ("parameters", "when", "effects"))
    reader = _Effects(label, events, d)
    return Process(
        name,
        tuple(parameter(label, p) for p in _list(label, "parameters", table)),
        parse_formula(table.get("when", "true")),
        tuple(e for x in _list(label, "effects", table) for e in reader.read(x)),
    )


def read_safety(name: str, table: Any) -> SafetyRule:
    """One safety rule.

    Raises:
        InputError: something in it cannot be read.
    """
    label = f"safety rule {name}"
    table = as_table(label, table)
    _fields(label, table, ("never", "every", "when", "else"))
    if "never" not in table:
        raise InputError(f"{label}: never is missing: the formula that must not become true")
    when = _MOMENT.fullmatch(table.get("when", ""))
    if when is None:
        raise InputError(
            f"{label}: when = {table['when']!r}: write 'leaving', a skill, or 'skill(?thing)', "
            "each skill with 'after' before it where it is judged after it"
        )
    return SafetyRule(
        name,
        parse_formula(table["never"]),
        tuple(parameter(label, p) for p in _list(label, "every", table)),
        when["skill"],
        table.get("else", name.replace("_", " ")),
        None if when["args"] is None else tuple(re.findall(r"[^\s,]+", when["args"])),
        when["after"] is not None,
    )


def _need(label: str, entry: Any) -> Need:
    if isinstance(entry, str):
        entry = {"fact": entry}
    _fields(f"{label}: need", entry, ("fact", "else", "lacks", "find"))
    if "fact" not in entry:
        raise InputError(f"{label}: a need says its fact: {{ fact = ..., else = ... }}")
    find = parse_formula(entry["find"]) if "find" in entry else None
    if find is not None and not isinstance(find, Some):
        raise InputError(f"{label}: find = {entry['find']!r}: write some ?x: ...")
    return Need(
        parse_formula(entry["fact"]),
        entry.get("else", ""),
        tuple(Literal.parse(x) for x in entry.get("lacks", ())),
        find,
    )


def _choice(label: str, entry: Any) -> Choice:
    entry = as_table(f"{label}: choice", entry)
    _fields(f"{label}: choice", entry, ("variable", "among", "such_that", "only_if", "else"))
    return Choice(
        parameter(label, entry.get("variable")),
        tuple(parse_formula(f) for f in entry.get("among", ("true",))),
        parse_formula(entry.get("such_that", "true")),
        parse_formula(entry.get("only_if", "true")),
        entry.get("else", ""),
    )


def _make(label: str, entry: Any) -> Make:
    entry = as_table(f"{label}: makes", entry)
    _fields(f"{label}: makes", entry, ("variable", "source", "by", "count"))
    return Make(
        parameter(label, entry.get("variable")).name,
        parameter(label, entry.get("source")).name,
        str(entry.get("by", "")),
        entry.get("count", 1),
    )


class _Effects:
    """Effects of one schema, events replaced by what they stand for."""

    def __init__(self, label: str, events: Mapping[str, Any], domain: Domain) -> None:
        self._label, self._events, self._domain = label, events, domain

    def read(self, entry: Any, depth: int = 0) -> list[Effect]:
        if isinstance(entry, str):
            entry = {"then": [entry]}
        _fields(f"{self._label}: effect", entry, ("every", "when", "then"))
        several = tuple(parameter(self._label, p) for p in entry.get("every", ()))
        when = parse_formula(entry.get("when", "true"))
        facts: list[Literal] = []
        copies: list[Copy] = []
        gone: list[str] = []
        found: list[Effect] = []
        for text in entry.get("then", ()):
            copy = _COPY.match(text)
            if copy is not None:
                copies.append(Copy(copy[1], copy[2], copy[3]))
                continue
            fact = Literal.parse(text)
            if fact.predicate == "gone":
                gone.append(fact.args[0])
            elif fact.predicate in self._events:
                found += self._event(fact, several, when, depth)
            else:
                facts.append(fact)
        own = Effect(several, when, tuple(facts), tuple(copies), tuple(gone))
        return [own, *found] if facts or copies or gone else found

    def _event(
        self, fact: Literal, several: tuple[Parameter, ...], when: Formula, depth: int
    ) -> list[Effect]:
        event = as_table(f"event {fact.predicate}", self._events[fact.predicate])
        _fields(f"event {fact.predicate}", event, ("parameters", "effects"))
        names = [parameter(self._label, p).name for p in event.get("parameters", ())]
        if len(names) != len(fact.args):
            raise InputError(
                f"{self._label}: event {fact.predicate} takes {len(names)} argument(s)"
            )
        if depth > 3:
            raise InputError(f"{self._label}: event {fact.predicate} calls itself")
        binding = dict(zip(names, fact.args, strict=True))
        found = []
        for entry in event.get("effects", ()):
            for e in self.read(entry, depth + 1):
                condition = bind(e.condition, binding)
                found.append(
                    Effect(
                        (*several, *e.variables),
                        condition if when == TRUE else And((when, condition)),
                        tuple(f.bind(binding) for f in e.facts),
                        tuple(
                            Copy(c.attribute, binding.get(c.target, c.target),
                                 binding.get(c.source, c.source))
                            for c in e.copies
                        ),
                        tuple(binding.get(g, g) for g in e.gone),
                    )
                )  # fmt: skip
        return found


def _variable(label: str, text: Any) -> str | None:
    return None if text is None else parameter(label, text).name


def _flag(label: str, key: str, table: Mapping[str, Any]) -> bool:
    value = table.get(key, False)
    if not isinstance(value, bool):
        raise InputError(f"{label}: {key} must be true or false")
    return value


def _list(label: str, key: str, table: Mapping[str, Any]) -> Sequence[Any]:
    value = table.get(key, ())
    if not isinstance(value, list | tuple):
        raise InputError(f"{label}: {key} must be a list")
    return value


def _fields(label: str, table: Any, known: Sequence[str]) -> None:
    for key in as_table(label, table):
        if key not in known:
            raise UnknownNameError(f"field of {label}", key, known)
