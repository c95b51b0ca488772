"""Writes a domain as a TOML file that loads back equal.

Called by the command line; calls `formula` and `load`. Events are written where they happen; the
order is that of the domain, so that the text never changes between runs.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields
from typing import Any

from forestall.domain.formula import TRUE, show
from forestall.domain.load import ATTRIBUTE_FIELDS, CATEGORY_FIELDS, PREDICATE_FIELDS, chosen
from forestall.domain.model import Domain
from forestall.domain.schema import (
    Category,
    Effect,
    Need,
    Predicate,
    PredicateKind,
    Process,
    Robot,
    Roles,
    SafetyRule,
    Skill,
)
from forestall.domain.schemas_in import SKILL_FIELDS

_OWN_FORM = ("parameters", "words", "family", "undoes", "done_when", "choices", "makes", "needs",
             "prefers", "effects")  # fmt: skip

Table = dict[str, Any]


def domain_toml(domain: Domain) -> str:
    """The text of a domain file.

    Args:
        domain: any domain; what its categories say of statics is written as it was given.
    """
    text = [f"name = {_value(domain.name)}"]
    if domain.tags:
        text.append(f"tags = {_value(domain.tags)}")
    text += _table("roles", _given(domain.roles, [f.name for f in fields(Roles)]))
    text += _table("robot", _given(domain.robot, [f.name for f in fields(Robot)]))
    text += _table("run", dict(domain.run))
    text += _table("constants", dict(domain.constants))
    text += _table("spelling", dict(domain.spelling))
    for p in domain.predicates.values():
        if p.kind is PredicateKind.ATTRIBUTE:
            text += _table(f"attributes.{p.name}", _attribute(p))
        else:
            text += _table(f"predicates.{p.name}", _predicate(p))
    left = _left(domain)
    for c in domain.categories.values():
        text += _table(f"categories.{_key(c.name)}", {**_category(c), **left.get(c.name, {})})
    for s in domain.skills.values():
        text += _table(f"skills.{s.name}", _skill(s))
    for process in domain.processes:
        text += _table(f"processes.{process.name}", _process(process))
    for rule in domain.safety:
        text += _table(f"safety.{rule.name}", _rule(rule))
    return "\n".join(text) + "\n"


def _given(part: object, names: Iterable[str], written: Iterable[str] = ()) -> Table:
    """Fields of a dataclass that are not at their default, but for those that are written."""
    wanted = set(names) - set(written)
    found: Table = {}
    for f in fields(part):  # type: ignore[arg-type]
        value = getattr(part, f.name)
        default = f.default_factory() if f.default_factory is not MISSING else f.default
        if f.name in wanted and value != default:
            found[f.name] = value
    return found


def _predicate(p: Predicate) -> Table:
    table: Table = {"kind": p.kind.value}
    if p.parameters:
        table["parameters"] = [str(x) for x in p.parameters]
    if p.definition is not None:
        table["definition"] = show(p.definition)
    return table | _given(p, PREDICATE_FIELDS, ("kind", "parameters", "definition"))


def _attribute(p: Predicate) -> Table:
    table: Table = {"values": p.values, "lasting": p.lasting}
    return table | _given(p, ATTRIBUTE_FIELDS, table)


def _category(c: Category) -> Table:
    table: Table = {"tags": sorted(c.tags)} if c.tags else {}
    table |= _given(c, CATEGORY_FIELDS, ("tags", "defaults"))
    if c.defaults:
        table["defaults"] = dict(c.defaults)
    table |= dict(c.numbers)
    world = {k: v for k, v in c.extra.items() if not k.startswith("#")}
    table |= {k.removeprefix("#"): v for k, v in c.extra.items() if k.startswith("#")}
    return table | ({"world": world} if world else {})


def _left(domain: Domain) -> dict[str, Table]:
    """Statics that no category's own list says, as lists of the second category."""
    found: dict[str, Table] = {}
    for predicate, pairs in sorted(domain.statics.items()):
        said = set()
        for c in domain.categories.values():
            spec = c.extra.get(f"#{predicate}", ())
            assert isinstance(spec, tuple)
            said |= {(c.name, other) for other in chosen(domain, predicate, c.name, spec)}
        for first, second in sorted(pairs - said):
            found.setdefault(second, {}).setdefault(f"{predicate}_of", []).append(first)
    return found


def _skill(s: Skill) -> Table:
    table: Table = {"parameters": [str(p) for p in s.parameters]}
    if s.words != s.name.replace("_", " "):
        table["words"] = s.words
    if s.family != s.name:
        table["family"] = s.family
    table |= _given(s, SKILL_FIELDS, _OWN_FORM)
    if s.undoes is not None:
        table["undoes"] = str(s.undoes)
    if s.done_when is not None:
        table["done_when"] = show(s.done_when)
    if s.choices:
        table["choices"] = [
            {
                "variable": str(c.variable),
                "among": [show(f) for f in c.among],
                **({} if c.such_that == TRUE else {"such_that": show(c.such_that)}),
                **({} if c.only_if == TRUE else {"only_if": show(c.only_if)}),
                **({"else": c.sentence} if c.sentence else {}),
            }
            for c in s.choices
        ]
    if s.makes:
        table["makes"] = [
            {"variable": m.variable, "source": m.source, "by": m.by, "count": m.count}
            for m in s.makes
        ]
    if s.needs:
        table["needs"] = [_need(n) for n in s.needs]
    if s.prefers:
        table["prefers"] = [show(f) for f in s.prefers]
    if s.effects:
        table["effects"] = [_effect(e) for e in s.effects]
    return table


def _need(n: Need) -> Table:
    return {
        "fact": show(n.formula),
        **({"else": n.sentence} if n.sentence else {}),
        **({"lacks": [str(x) for x in n.lacking]} if n.lacking else {}),
        **({} if n.find is None else {"find": show(n.find)}),
    }


def _effect(e: Effect) -> Table:
    then = [str(f) for f in e.facts]
    then += [f"{c.attribute}({c.target}) = {c.attribute}({c.source})" for c in e.copies]
    then += [f"gone({g})" for g in e.gone]
    return {
        **({"every": [str(v) for v in e.variables]} if e.variables else {}),
        **({} if e.condition == TRUE else {"when": show(e.condition)}),
        "then": then,
    }


def _process(p: Process) -> Table:
    return {
        "parameters": [str(x) for x in p.parameters],
        "when": show(p.condition),
        "effects": [_effect(e) for e in p.effects],
    }


def _rule(r: SafetyRule) -> Table:
    return {
        "never": show(r.never),
        **({"every": [str(v) for v in r.variables]} if r.variables else {}),
        **({"when": r.moment} if r.when else {}),
        "else": r.sentence,
    }


# --- text -----------------------------------------------------------------------------------------


def _table(name: str, table: Mapping[str, Any]) -> list[str]:
    if not table and not name.startswith("categories."):
        return []
    return ["", f"[{name}]", *(line for k, v in table.items() for line in _entry(k, v))]


def _entry(key: str, value: Any) -> list[str]:
    several = isinstance(value, list) and any(isinstance(v, dict) for v in value)
    if not several:
        return [f"{_key(key)} = {_value(value)}"]
    return [f"{_key(key)} = [", *(f"  {_value(v)}," for v in value), "]"]


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{_key(k)} = {_value(v)}' for k, v in value.items())} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return str(value)
    return json.dumps(str(value), ensure_ascii=False)


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _value(key)
