"""Reads a PDDL problem over a domain: its things, what holds at first, and the goal.

Called by `planning`; calls `pddl_text` and `pddl_formula`. A PDDL problem is complete: what it does
not say is false.
"""

from __future__ import annotations

from dataclasses import dataclass

from forestall.domain.formula import Formula, variables
from forestall.domain.model import Domain
from forestall.domain.pddl_declared import differing, plain, things_of, value_key
from forestall.domain.pddl_formula import Reader, Value
from forestall.domain.pddl_text import (
    ROOT,
    AtLineError,
    Group,
    Types,
    Word,
    definition,
    unknown,
)
from forestall.domain.schema import PredicateKind
from forestall.errors import DomainError
from forestall.types.facts import Literal

_SECTIONS = (":domain", ":goal", ":init", ":objects", ":requirements")
_REFUSED = {
    ":metric": "metrics are not supported",
    ":constraints": "constraints on trajectories are not supported",
    ":htn": "hierarchical task networks are not supported",
}


@dataclass(frozen=True, slots=True)
class PddlProblem:
    """One problem.

    Args:
        name: of the problem.
        things: thing → category, the domain's constants first.
        values: (thing, attribute) → value.
        facts: relations and histories that hold at first, (predicate, *arguments).
        goal: what must hold in the end.
        spelling: (name, how the file spells it), where they differ.
    """

    name: str
    things: dict[str, str]
    values: dict[tuple[str, str], str]
    facts: tuple[tuple[str, ...], ...]
    goal: Formula
    spelling: tuple[tuple[str, str], ...]


def parse_problem(text: str, domain: Domain, source: str = "problem") -> PddlProblem:
    """Read the text of a problem file.

    Raises:
        DomainError: something in it is wrong, not supported, or not of this domain; with its line.
    """
    try:
        return _read(text, domain)
    except AtLineError as error:
        raise DomainError(f"{source}, line {error.line}: {error}") from error


def _read(text: str, domain: Domain) -> PddlProblem:
    name, found = _parts(text, domain)
    types = types_of(domain)
    spelling: dict[str, str] = {}
    things = dict(domain.constants)
    if ":objects" in found:
        things |= things_of(found[":objects"], types, things, spelling)
    for thing, category in things.items():
        if category not in domain.categories:
            raise unknown(found[":objects"], f"type of {thing}", category, domain.categories)
    reader = _reader(domain, types, things)
    facts, values = _init(found[":init"], reader, domain, things)
    goal = found[":goal"]
    if len(goal.items) != 2:
        raise AtLineError(goal.line, "write (:goal condition)")
    wanted = reader.condition(goal.items[1], frozenset())
    for variable in variables(wanted):
        if variable.kind is not None and not domain.known_kind(variable.kind):
            raise AtLineError(
                goal.line, f"no action of {domain.name} is about the types of {variable} together"
            )
    return PddlProblem(name, things, values, facts, wanted, tuple(differing(spelling).items()))


def _parts(text: str, domain: Domain) -> tuple[str, dict[str, Group]]:
    """The name of the problem and its sections."""
    name, sections = definition(text, "problem")
    found: dict[str, Group] = {}
    for section in sections:
        if section.head in _REFUSED:
            raise AtLineError(section.line, f"{_REFUSED[section.head]}: ({section.head} ...)")
        if section.head not in _SECTIONS:
            raise unknown(section, "section", section.head, _SECTIONS)
        if section.head in found:
            raise AtLineError(section.line, f"section {section.head} stands twice")
        found[section.head] = section
    for needed in (":domain", ":init", ":goal"):
        if needed not in found:
            raise AtLineError(1, f"problem {name} has no section ({needed} ...)")
    stated = found[":domain"]
    if [plain(str(x)) for x in stated.items[1:]] != [plain(domain.name)]:
        other = " ".join(map(str, stated.items[1:]))
        raise AtLineError(
            stated.line, f"the problem is one of domain {other}, and not of {domain.name}"
        )
    return name, found


def types_of(domain: Domain) -> Types:
    """The types that the categories of a domain are, by those of their tags that are categories."""
    above = {
        name: [t for t in c.tags if t in domain.categories and t != ROOT]
        for name, c in domain.categories.items()
    }
    return Types(
        {
            name: max(tags, key=lambda t: (len(above[t]), t), default=ROOT)
            for name, tags in above.items()
            if name != ROOT
        }
    )


def _reader(domain: Domain, types: Types, things: dict[str, str]) -> Reader:
    spelt = dict(domain.spelling)
    predicates: dict[str, tuple[str, int]] = {}
    values: dict[str, Value] = {}
    for p in domain.predicates.values():
        if p.kind is PredicateKind.ATTRIBUTE:
            names = {v: spelt.get(value_key(p.name, v), f"{p.name}_{v}") for v in p.values}
            otherwise = next((v for v, n in names.items() if not n), None)
            for value, given in names.items():
                if given:
                    predicates[given] = plain(given), 1
                    values[plain(given)] = Value(p.name, value, otherwise)
        else:
            predicates[spelt.get(p.name, p.name)] = p.name, len(p.parameters)
    return Reader(types, predicates, frozenset(domain.derived), values, things)


def _init(
    section: Group, reader: Reader, domain: Domain, things: dict[str, str]
) -> tuple[tuple[tuple[str, ...], ...], dict[tuple[str, str], str]]:
    facts: dict[tuple[str, ...], None] = {}
    values: dict[tuple[str, str], str] = {}
    for node in section.items[1:]:
        if isinstance(node, Group) and len(node.items) == 3 and node.head == "at":
            time = node.items[1]
            if isinstance(time, Word) and time.text.replace(".", "", 1).isdigit():
                raise AtLineError(
                    node.line,
                    f"timed initial literals (:timed-initial-literals) are not supported: {node}",
                )
        if isinstance(node, Group) and node.head == "=":
            raise AtLineError(node.line, f"numeric fluents are not supported: {node}")
        if isinstance(node, Group) and node.head == "not" and len(node.items) == 2:
            reader.atom(node.items[1], frozenset())  # what is not said is false anyway
            continue
        fact = reader.atom(node, frozenset())
        known = reader.values.get(fact.predicate)
        if known is not None:
            _give(node.line, values, fact, known, things, domain)
        elif fact.predicate in reader.derived:
            raise AtLineError(node.line, f"{node}: {fact.predicate} is derived: it is not given")
        else:
            facts[fact.predicate, *fact.args] = None
    otherwise = {v.attribute: v.otherwise for v in reader.values.values()}
    grouped = {key.partition("=")[0] for key, _ in domain.spelling if "=" in key}
    for thing, category in things.items():
        for attribute, default in domain.default_states(category).items():
            if (thing, attribute) in values:
                continue
            value = otherwise[attribute] if attribute in grouped else default
            if value is None:
                raise AtLineError(section.line, f"{thing} has no value of {attribute} in (:init)")
            values[thing, attribute] = value
    return tuple(facts), values


def _give(
    line: int,
    values: dict[tuple[str, str], str],
    fact: Literal,
    known: Value,
    things: dict[str, str],
    domain: Domain,
) -> None:
    thing = fact.args[0]
    if known.attribute not in domain.categories[things[thing]].attributes:
        raise AtLineError(line, f"{thing} is a {things[thing]}, which has no {known.attribute}")
    before = values.setdefault((thing, known.attribute), known.value)
    if before != known.value:
        raise AtLineError(line, f"{thing} has two values of {known.attribute}: {before} and "
                          f"{known.value}")  # fmt: skip
