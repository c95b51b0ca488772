"""Reads a PDDL domain file, with its annotation file where there is one, into a `Domain`.

Called by `load.load_domain`; calls `pddl_text`, `pddl_formula`, `pddl_notes`, and hands the same
tables to `load.build_domain` that a TOML file has, so that every check is made once. Types become
categories and the types above them tags; predicates become relations, derived ones derived,
actions skills. What is not supported is refused by name and line, and nothing is half loaded.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from forestall.domain.formula import TRUE, And, Formula, Or, Parameter, bind, show
from forestall.domain.load import build_domain
from forestall.domain.located import located
from forestall.domain.model import Domain
from forestall.domain.pddl_declared import Declared, differing, plain, value_key
from forestall.domain.pddl_formula import Reader, Value, apart
from forestall.domain.pddl_notes import Notes
from forestall.domain.pddl_text import (
    ROOT,
    AtLineError,
    Group,
    Node,
    Word,
    definition,
    unknown,
    words,
)
from forestall.errors import DomainError, InputError
from forestall.reading.documents import MOST_TOML_BYTES
from forestall.reading.files import read_text
from forestall.types.facts import Literal

SUPPORTED = (
    ":adl", ":conditional-effects", ":constants", ":derived-predicates",
    ":disjunctive-preconditions", ":equality", ":existential-preconditions",
    ":negative-preconditions", ":quantified-preconditions", ":strips", ":typing",
    ":universal-preconditions",
)  # fmt: skip

_REFUSED = {
    ":durative-action": "durative actions are not supported",
    ":functions": "numeric fluents are not supported",
    ":constraints": "constraints on trajectories are not supported",
    ":process": "processes of PDDL+ are not supported",
    ":event": "events of PDDL+ are not supported",
    ":method": "hierarchical methods are not supported",
    ":task": "hierarchical tasks are not supported",
}
_SECTIONS = (
    ":requirements", ":types", ":constants", ":predicates", ":derived", ":action",
)  # fmt: skip


def load_pddl(path: str) -> Domain:
    """A domain from a PDDL file and, beside it, NAME.annotations.toml.

    Raises:
        FileFormatError: a file cannot be read.
        DomainError: something in it is wrong or not supported; with file and line.
    """
    notes = Path(path).with_suffix(".annotations.toml")
    return read_pddl(_text(Path(path)), path, _text(notes) if notes.is_file() else None, str(notes))


def _text(path: Path) -> str:
    return read_text(path, "domain file", MOST_TOML_BYTES)


def read_pddl(
    text: str, source: str, annotations: str | None = None, annotated: str = "annotations"
) -> Domain:
    """A domain from the text of a PDDL file and of its annotations.

    Args:
        text: of the PDDL file.
        source: its name in errors.
        annotations: text of the annotation file.
        annotated: its name in errors.

    Raises:
        FileFormatError: the annotations are no TOML.
        DomainError: something is wrong or not supported.
    """
    notes = Notes.parse(annotations or "", annotated)
    found = _Found(notes.values)
    try:
        data = found.read(text)
        domain = build_domain(data)
    except AtLineError as error:
        raise DomainError(f"{source}, line {error.line}: {error}") from error
    except InputError as error:
        raise _placed(error, found, source, annotations, annotated) from error
    if annotations is None:
        return domain
    try:
        return build_domain(notes.put_into(data))
    except InputError as error:
        raise located(annotated, annotations, error) from error


def _placed(
    error: InputError, found: _Found, source: str, annotations: str | None, annotated: str
) -> InputError:
    for key in getattr(error, "keys", ()):
        if key in found.lines:
            return DomainError(f"{source}, line {found.lines[key]}: {error}")
    if annotations is not None and any(k in annotations for k in getattr(error, "keys", ())):
        return located(annotated, annotations, error)
    return DomainError(f"{source}: {error}")


class _Found(Declared):
    """What a PDDL domain says, on its way to the tables of a domain file."""

    def read(self, text: str) -> dict[str, Any]:
        """The tables of a domain file.

        Raises:
            AtLineError: something is wrong or not supported.
        """
        name, sections = definition(text, "domain")
        several: dict[str, list[Group]] = {s: [] for s in _SECTIONS}
        for section in sections:
            if section.head in _REFUSED:
                raise AtLineError(section.line, f"{_REFUSED[section.head]}: ({section.head} ...)")
            if section.head not in several:
                raise unknown(section, "section", section.head, _SECTIONS)
            several[section.head].append(section)
        for section in several[":requirements"]:
            for word in words(section.items[1:], "a requirement such as :typing"):
                if word.text not in SUPPORTED:
                    raise unknown(word, "or unsupported requirement", word.text, SUPPORTED)
        self.read_types(several[":types"])
        self.read_constants(several[":constants"])
        self.read_predicates(several[":predicates"])
        derived = self._derived(several[":derived"])
        values = self.values(frozenset(derived))
        reader = Reader(
            self.types,
            {pddl: (n, len(p)) for pddl, (n, p) in self.predicates.items()},
            frozenset(derived),
            values,
            self.constants,
        )
        definitions = {n: self._defined(n, rules, reader) for n, rules in derived.items()}
        skills = dict(self._skills(several[":action"], reader))
        return self._tables(name, values, definitions, skills)

    # --- derived predicates and actions ----------------------------------------------------------

    def _derived(self, sections: list[Group]) -> dict[str, list[Group]]:
        found: dict[str, list[Group]] = {}
        for section in sections:
            head = section.items[1] if len(section.items) == 3 else None
            if not isinstance(head, Group):
                raise AtLineError(section.line, "write (:derived (name ?x) condition)")
            if head.head not in self.predicates:
                raise unknown(head, "predicate", head.head, self.predicates)
            found.setdefault(self.predicates[head.head][0], []).append(section)
        return found

    def _defined(self, name: str, rules: list[Group], reader: Reader) -> Formula:
        parameters = next(p for n, p in self.predicates.values() if n == name)
        parts: list[Formula] = []
        for rule in rules:
            head, body = rule.items[1], rule.items[2]
            assert isinstance(head, Group)
            own = self.parameters(Group(head.items[1:], head.line), f"{name}(...)")
            if len(own) != len(parameters):
                raise AtLineError(head.line, f"{head}: {name} takes {len(parameters)} argument(s)")
            self.eithers(body)
            part = reader.condition(body, frozenset(p.name for p in own))
            narrower = [
                Literal(p.kind, (p.name,))
                for p, q in zip(own, parameters, strict=True)
                if p.kind is not None and p.kind != q.kind
            ]
            part = And((*narrower, part)) if narrower else part
            parts.append(_renamed(part, own, parameters))
        return parts[0] if len(parts) == 1 else Or(tuple(parts))

    def _skills(
        self, sections: list[Group], reader: Reader
    ) -> Iterator[tuple[str, dict[str, Any]]]:
        for section in sections:
            word = section.items[1] if len(section.items) > 1 else section
            if not isinstance(word, Word):
                raise AtLineError(section.line, "expected (:action NAME ...)")
            name = self.named(word, "an action")
            key = f"[skills.{name}]"
            if key in self.lines:
                raise AtLineError(
                    word.line, f"action {word} stands twice: first in line {self.lines[key]}"
                )
            self.lines[key] = word.line
            yield name, self._skill(section, reader)

    def _skill(self, section: Group, reader: Reader) -> dict[str, Any]:
        known = (":parameters", ":precondition", ":effect")
        parts: dict[str, Node] = {}
        rest = list(section.items[2:])
        while rest:
            key = rest.pop(0)
            if str(key) not in known:
                raise unknown(key, f"part of action {section.items[1]}", str(key), known)
            if not rest:
                raise AtLineError(key.line, f"{key} of action {section.items[1]} is missing")
            if str(key) in parts:
                raise AtLineError(key.line, f"{key} of action {section.items[1]} stands twice")
            parts[str(key)] = rest.pop(0)
            self.eithers(parts[str(key)])
        empty = Group((), section.line)
        own = self.parameters(parts.get(":parameters", empty), str(section.items[1]))
        scope = frozenset(p.name for p in own)
        needs = reader.condition(parts.get(":precondition", empty), scope)
        return {
            "parameters": [str(p) for p in own],
            "needs": [{"fact": show(f)} for f in conjuncts(needs)],
            "effects": [
                {
                    **({"every": [str(p) for p in e.variables]} if e.variables else {}),
                    **({} if e.condition == TRUE else {"when": show(e.condition)}),
                    "then": [str(f) for f in e.facts],
                }
                for e in reader.effects(parts.get(":effect", empty), scope)
                if e.facts
            ],
        }

    # --- the tables ------------------------------------------------------------------------------

    def _tables(
        self,
        name: str,
        values: dict[str, Value],
        definitions: dict[str, Formula],
        skills: dict[str, dict[str, Any]],
    ) -> dict[str, Any]:
        parents = self.types.parents
        above = {t: self.types.above(t) for t in (ROOT, *parents)}
        tags = dict.fromkeys(a for several in above.values() for a in several)
        predicates: dict[str, Any] = {}
        attributes: dict[str, list[str]] = {t: [] for t in above}
        for n, own in self.predicates.values():
            if n in values:
                for t, several in above.items():
                    fits = own[0].kind is None or own[0].kind in (t, *several, *self.unions(t))
                    if fits and values[n].attribute not in attributes[t]:
                        attributes[t].append(values[n].attribute)
                continue
            predicates[n] = {"kind": "relation", "parameters": [str(p) for p in own]}
            if n in definitions:
                predicates[n] |= {"kind": "derived", "definition": show(definitions[n])}
        return {
            "name": name,
            "tags": sorted({*tags, *self.tags}),
            "robot": {"hands": []},
            "predicates": predicates,
            "attributes": {a: {"values": list(t)} for a, t in self.grouped.items()},
            "categories": {
                t: {
                    "tags": [*several, *self.unions(t)],
                    "attributes": [a for a in self.grouped if a in attributes[t]],
                }
                for t, several in above.items()
            },
            "skills": skills,
            "constants": dict(sorted(self.constants.items())),
            "spelling": {**differing(self.spelling), **self._value_names()},
        }

    def _value_names(self) -> dict[str, str]:
        """How the file says that an attribute has a value: "light=on" → "lit"."""
        spelt = {n: pddl for pddl, (n, _) in self.predicates.items()}
        return {
            value_key(a, v): spelt.get(plain(p), "")
            for a, table in self.grouped.items()
            for v, p in table.items()
        }


def conjuncts(formula: Formula) -> tuple[Formula, ...]:
    """The parts of a conjunction, those of parts that are conjunctions too."""
    if isinstance(formula, And):
        return tuple(c for p in formula.parts for c in conjuncts(p))
    return (formula,)


def _renamed(
    formula: Formula, own: tuple[Parameter, ...], wanted: tuple[Parameter, ...]
) -> Formula:
    """The formula over the names of the declaration; bound variables get out of their way."""
    formula = apart(formula, {p.name for p in wanted})
    return bind(formula, {o.name: w.name for o, w in zip(own, wanted, strict=True)})
