"""Formulas and effects as PDDL text.

Called by `pddl_out`; calls `formula` and `model`. What the two languages say differently is
decided here: an attribute is one predicate for each value; relations of one group delete each
other; `fewer than` speaks of so many different things; a definition that goes through "every" to
itself is written as its opposite, which only needs "some".
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from forestall.domain.formula import (
    TRUE,
    And,
    Every,
    Fewer,
    Formula,
    Not,
    Or,
    Parameter,
    Some,
    bind,
    free,
    literals,
    normal,
)
from forestall.domain.model import SAME, Domain
from forestall.domain.pddl_declared import value_key
from forestall.domain.pddl_text import ROOT
from forestall.domain.schema import Effect, PredicateKind
from forestall.errors import DomainError
from forestall.types.facts import Literal

THING = "thing"
"""The type of all that is no hand, where hands are no things of the domain."""

Kinds = Mapping[str, str | None]
"""Variable → kind."""


@dataclass(frozen=True, slots=True)
class _Happens:
    """One fact of an effect, with the variables and the condition that it brings along as text."""

    fact: str
    variables: str = ""
    condition: str = ""


class Writer:
    """Writes formulas and effects over the names of one domain."""

    def __init__(self, domain: Domain) -> None:
        self.domain = domain
        self._spelt = dict(domain.spelling)
        constants = {name for name, _ in domain.constants}
        self.hands = tuple(h for h in domain.robot.hands if h not in constants)
        self.top = THING if self.hands else ROOT

    # --- names -----------------------------------------------------------------------------------

    def name(self, ours: str) -> str:
        """How PDDL calls a category, predicate, skill or thing."""
        return self._spelt.get(ours, ours).lower()

    def value_name(self, attribute: str, value: str) -> str:
        """The predicate of a value; "" for the one that holds where the other does not."""
        return self._spelt.get(value_key(attribute, value), f"{attribute}_{value}")

    def is_type(self, kind: str) -> bool:
        """Whether a kind is a category, and so a type."""
        return kind in self.domain.categories

    def parameters(self, several: Iterable[Parameter], top: str | None = None) -> str:
        """A typed list without its parentheses."""
        top = self.top if top is None else top
        found = []
        for p in several:
            typed = p.kind is not None and self.is_type(p.kind)
            found.append((p.name, self.name(p.kind or "") if typed else top))
        if all(kind == ROOT for _, kind in found):
            return " ".join(name for name, _ in found)
        return " ".join(f"{name} - {kind}" for name, kind in found)

    def tags_of(self, several: Iterable[Parameter]) -> tuple[Literal, ...]:
        """Conditions that stand for kinds which are no types."""
        kinds = [(p.kind, p.name) for p in several if p.kind is not None]
        return tuple(Literal(k, (n,)) for k, n in kinds if not self.is_type(k))

    # --- formulas --------------------------------------------------------------------------------

    def formula(self, formula: Formula) -> str:
        """A condition.

        Raises:
            DomainError: it cannot be said in PDDL.
        """
        if isinstance(formula, Literal):
            return self._literal(formula)
        if isinstance(formula, Not):
            return f"(not {self.formula(formula.part)})"
        if isinstance(formula, And | Or):
            word = "and" if isinstance(formula, And) else "or"
            return f"({' '.join((word, *map(self.formula, formula.parts)))})"
        if isinstance(formula, Fewer):
            return self.formula(self._fewer(formula))
        tags = self.tags_of(formula.variables)
        part = formula.part
        if isinstance(formula, Some):
            part = And((*tags, part)) if tags else part
            return f"(exists ({self.parameters(formula.variables)}) {self.formula(part)})"
        part = Or((*(Not(t) for t in tags), part)) if tags else part
        return f"(forall ({self.parameters(formula.variables)}) {self.formula(part)})"

    def _literal(self, literal: Literal) -> str:
        args = tuple(self.name(a) if not a.startswith("?") else a for a in literal.args)
        known = self.domain.predicates.get(literal.predicate)
        if known is not None and known.kind is PredicateKind.ATTRIBUTE:
            name = self.value_name(known.name, literal.value)
            if name:
                return f"({name} {args[0]})"
            others = [self.value_name(known.name, v) for v in known.values]
            other = next(o for o in others if o)
            return f"(and (has_{known.name} {args[0]}) (not ({other} {args[0]})))"
        negative = literal.value == "false"
        if literal.predicate == SAME:
            text = f"(= {' '.join(args)})"
        elif known is None and self.is_type(literal.predicate):
            text = f"(exists (?own - {self.name(literal.predicate)}) (= ?own {args[0]}))"
        elif literal.predicate in self.inverted:
            text, negative = (
                f"({' '.join((self.opposite(literal.predicate), *args))})",
                not negative,
            )
        else:
            text = f"({' '.join((self.name(literal.predicate), *args))})"
        return f"(not {text})" if negative else text

    def _fewer(self, formula: Fewer) -> Formula:
        if isinstance(formula.bound, str):
            parts: list[Formula] = []
            for number in self.numbers(formula.bound):
                of = Literal(f"{formula.bound}_{number}", (formula.of,))
                parts.append(Or((Not(of), Fewer(number, "", formula.variable, formula.part))))
            return And(tuple(parts))
        name, kind = formula.variable.name, formula.variable.kind
        several = tuple(Parameter(f"{name}_{i + 1}", kind) for i in range(formula.bound))
        if not several:
            return Or(())
        apart = [
            Not(Literal(SAME, (a.name, b.name)))
            for i, a in enumerate(several)
            for b in several[i + 1 :]
        ]
        parts = [bind(formula.part, {name: v.name}) for v in several]
        both = (*apart, *parts)
        return Not(Some(several, both[0] if len(both) == 1 else And(both)))

    def numbers(self, name: str) -> tuple[int, ...]:
        """Every value of a number that categories have."""
        found = {dict(c.numbers).get(name) for c in self.domain.categories.values()}
        return tuple(sorted(n for n in found if n is not None))

    @cached_property
    def inverted(self) -> frozenset[str]:
        """Derived predicates that are written as their opposite."""
        found: set[str] = set()
        for name, members in self.domain.recursive.items():
            definition = self.domain.predicates[name].definition
            assert definition is not None
            if any(_through(normal(definition), Every, m) for m in members):
                found |= members
        for name in sorted(found):
            definition = self.domain.predicates[name].definition
            assert definition is not None
            members = self.domain.recursive[name]
            if any(_through(normal(definition), Some, m) for m in members):
                raise DomainError(
                    f"{name} is defined by itself through both 'some' and 'every', which no "
                    "planner reads: leave one of the two to another predicate"
                )
        return frozenset(found)

    def opposite(self, name: str) -> str:
        """The name of the opposite of a derived predicate."""
        return f"not_{self.name(name)}"

    def derived(self, name: str) -> str:
        """One derived predicate with its definition."""
        predicate = self.domain.predicates[name]
        assert predicate.definition is not None
        definition = predicate.definition
        if name in self.inverted:
            definition, name = normal(definition, False), self.opposite(name)
        else:
            name = self.name(name)
        head = " ".join((name, self.parameters(predicate.parameters, ROOT))).strip()
        tags = self.tags_of(predicate.parameters)
        body = And((*tags, definition)) if tags else definition
        return f"(:derived ({head}) {self.formula(body)})"

    # --- effects ---------------------------------------------------------------------------------

    def effects(self, effects: Iterable[Effect], kinds: Kinds) -> list[str]:
        """What effects bring about; a quantifier stands outside of every condition."""
        found = []
        for effect in effects:
            inner = {**kinds, **{v.name: v.kind for v in effect.variables}}
            several: dict[tuple[str, str], list[str]] = {}
            for happens in self._happens(effect, inner):
                several.setdefault((happens.variables, happens.condition), []).append(happens.fact)
            tags = self.tags_of(effect.variables)
            condition = And((*tags, effect.condition)) if tags else effect.condition
            for (variables, own), facts in several.items():
                text = facts[0] if len(facts) == 1 else f"(and {' '.join(facts)})"
                parts = [] if condition == TRUE else [self.formula(condition)]
                parts += [own] if own else []
                if parts:
                    both = parts[0] if len(parts) == 1 else f"(and {' '.join(parts)})"
                    text = f"(when {both} {text})"
                bound = f"{self.parameters(effect.variables)} {variables}".strip()
                found.append(f"(forall ({bound}) {text})" if bound else text)
        return found

    def _happens(self, effect: Effect, kinds: Kinds) -> Iterator[_Happens]:
        for fact in effect.facts:
            known = self.domain.predicates[fact.predicate]
            if known.kind is PredicateKind.ATTRIBUTE:
                sure = self._surely_has(known.name, fact.args[0], kinds)
                has = "" if sure else f"(has_{known.name} {self._arg(fact.args[0])})"
                yield from self._set(known.name, fact.args[0], fact.value, has)
                continue
            yield _Happens(self._literal(fact))
            if fact.value != "false" and known.group is not None:
                for other in self.domain.relations.values():
                    if other.group == known.group and (other is not known or len(fact.args) > 1):
                        yield self._ended(other.name, fact)
        for copy in effect.copies:
            has = f"(has_{copy.attribute} {self._arg(copy.target)})"
            for value in self.domain.values(copy.attribute):
                holds = self._literal(Literal(copy.attribute, (copy.source,), value))
                yield from self._set(copy.attribute, copy.target, value, f"(and {has} {holds})")
            none = f"(and {has} (not (has_{copy.attribute} {self._arg(copy.source)})))"
            default = self.domain.values(copy.attribute)[0]
            yield from self._set(copy.attribute, copy.target, default, none)

    def _ended(self, other: str, fact: Literal) -> _Happens:
        """Relations of a group end for the first argument, but for what comes to hold."""
        parameters = self.domain.predicates[other].parameters[1:]
        names = [f"?other{i or ''}" for i in range(len(parameters))]
        ends = self._literal(Literal(other, (fact.args[0], *names), "false"))
        several = " ".join(f"{n} - {ROOT}" for n in names)
        if other != fact.predicate:
            return _Happens(ends, several)
        same = [f"(= {n} {self._arg(a)})" for n, a in zip(names, fact.args[1:], strict=True)]
        kept = same[0] if len(same) == 1 else f"(and {' '.join(same)})"
        return _Happens(ends, several, f"(not {kept})")

    def _set(self, attribute: str, thing: str, value: str, condition: str) -> Iterator[_Happens]:
        for other in self.domain.values(attribute):
            name = self.value_name(attribute, other)
            if name:
                text = f"({name} {self._arg(thing)})"
                yield _Happens(text if other == value else f"(not {text})", "", condition)

    def _surely_has(self, attribute: str, thing: str, kinds: Kinds) -> bool:
        constants = dict(self.domain.constants)
        kind = kinds.get(thing) if thing.startswith("?") else constants.get(thing)
        fitting = [c for c in self.domain.categories if kind is None or self.domain.is_a(c, kind)]
        return all(attribute in self.domain.categories[c].attributes for c in fitting)

    def _arg(self, name: str) -> str:
        return name if name.startswith("?") else self.name(name)

    # --- what is used ----------------------------------------------------------------------------

    def used(self, formulas: Iterable[Formula]) -> tuple[frozenset[str], frozenset[str]]:
        """Predicates and numbers that formulas speak of."""
        formulas = tuple(formulas)
        predicates = {x.predicate for f in formulas for x, _ in literals(f)}
        numbers = {n for f in formulas for n in _numbers(f)}
        return frozenset(predicates), frozenset(numbers)


def without(formula: Formula, variable: str) -> Formula:
    """The formula where nothing stands for a variable: what is said of it is false."""
    if isinstance(formula, Literal):
        if variable not in formula.args:
            return formula
        return And(()) if formula.value == "false" else Or(())
    if isinstance(formula, Not):
        return Not(without(formula.part, variable))
    if isinstance(formula, And | Or):
        return type(formula)(tuple(without(p, variable) for p in formula.parts))
    if variable not in free(formula):
        return formula
    if isinstance(formula, Fewer):
        part = without(formula.part, variable)
        if formula.of == variable:
            return TRUE
        return Fewer(formula.bound, formula.of, formula.variable, part)
    return type(formula)(formula.variables, without(formula.part, variable))


def _through(formula: Formula, kind: type[Some] | type[Every], predicate: str) -> bool:
    """Whether a formula speaks of a predicate under a quantifier of a kind."""
    if isinstance(formula, Literal):
        return False
    if isinstance(formula, And | Or):
        return any(_through(p, kind, predicate) for p in formula.parts)
    inside = isinstance(formula, kind) and any(
        x.predicate == predicate for x, _ in literals(formula.part)
    )
    return inside or _through(formula.part, kind, predicate)


def _numbers(formula: Formula) -> Iterator[str]:
    if isinstance(formula, Literal):
        return
    if isinstance(formula, And | Or):
        for part in formula.parts:
            yield from _numbers(part)
        return
    if isinstance(formula, Fewer) and isinstance(formula.bound, str):
        yield formula.bound
    yield from _numbers(formula.part)
