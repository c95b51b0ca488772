"""Conditions and effects of PDDL as formulas and facts.

Called by `pddl_in` and `pddl_problem`; calls `pddl_text` and `formula`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

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
)
from forestall.domain.model import SAME
from forestall.domain.pddl_text import AtLineError, Group, Node, Types, Word, ours, typed, unknown
from forestall.types.facts import Literal

_NUMERIC = ("increase", "decrease", "assign", "scale-up", "scale-down")
_COMPARED = ("<", ">", "<=", ">=")
_KEYWORDS = ("and", "or", "not", "imply", "exists", "forall", "when", "preference", "=")


@dataclass(frozen=True, slots=True)
class Value:
    """A PDDL predicate that says which value an attribute has."""

    attribute: str
    value: str
    otherwise: str | None


@dataclass(frozen=True, slots=True)
class Happens:
    """Facts that become so together."""

    variables: tuple[Parameter, ...]
    condition: Formula
    facts: tuple[Literal, ...]


@dataclass(slots=True)
class Reader:
    """Reads conditions and effects over the names of one domain.

    Args:
        types: of the domain.
        predicates: PDDL name → (our name, how many arguments).
        derived: our names of those that follow from others.
        values: our name → the value of an attribute that it stands for.
        things: our names of constants and objects.
    """

    types: Types
    predicates: Mapping[str, tuple[str, int]]
    derived: frozenset[str] = frozenset()
    values: Mapping[str, Value] = field(default_factory=dict)
    things: Mapping[str, str] = field(default_factory=dict)

    def parameters(self, node: Node | None, what: str) -> tuple[Parameter, ...]:
        """The variables of a typed list.

        Raises:
            AtLineError: no list of variables, or one stands twice.
        """
        if not isinstance(node, Group):
            raise AtLineError(
                node.line if node else 0, f"expected the variables of {what} in (...)"
            )
        found: list[Parameter] = []
        for word, types in typed(node.items, "a variable"):
            name = ours(word, "a variable such as ?x")
            if not name.startswith("?"):
                raise AtLineError(word.line, f"expected a variable such as ?x, found {word}")
            if any(p.name == name for p in found):
                raise AtLineError(word.line, f"variable {name} stands twice in {what}")
            found.append(Parameter(name, self.types.kind(types)))
        return tuple(found)

    def condition(self, node: Node, scope: frozenset[str]) -> Formula:
        """A condition over the variables of a scope.

        Raises:
            AtLineError: it is none, or has something that is not supported.
        """
        if not isinstance(node, Group):
            raise AtLineError(node.line, f"expected a condition in (...), found {node}")
        head, rest = node.head, node.items[1:]
        if not node.items:
            return TRUE
        if head in ("and", "or"):
            parts = tuple(self.condition(n, scope) for n in rest)
            if len(parts) == 1:
                return parts[0]
            return And(parts) if head == "and" else Or(parts)
        if head == "not":
            return Not(self.condition(self._only(node, 1)[0], scope))
        if head == "imply":
            left, right = self._only(node, 2)
            return Or((Not(self.condition(left, scope)), self.condition(right, scope)))
        if head in ("exists", "forall"):
            several, part = self._only(node, 2)
            own = self.parameters(several, f"({head} ...)")
            inner = self.condition(part, scope | {p.name for p in own})
            if not own:
                return inner
            return Some(own, inner) if head == "exists" else Every(own, inner)
        if head in _COMPARED or (head == "=" and any(isinstance(n, Group) for n in rest)):
            raise AtLineError(node.line, f"numeric fluents are not supported: {node}")
        if head == "preference":
            raise AtLineError(node.line, f"preferences (:preferences) are not supported: {node}")
        if head == "=":
            left, right = self._only(node, 2)
            return Literal(SAME, (self._term(left, scope), self._term(right, scope)))
        return self._value(self.atom(node, scope))

    def atom(self, node: Node, scope: frozenset[str]) -> Literal:
        """One fact as PDDL has it.

        Raises:
            AtLineError: an unknown predicate, another number of arguments, an unbound variable.
        """
        if not isinstance(node, Group) or not node.head or node.head in _KEYWORDS:
            raise AtLineError(node.line, f"expected a fact such as (on ?x ?y), found {node}")
        if node.head not in self.predicates:
            raise unknown(node, "predicate", node.head, self.predicates)
        name, arity = self.predicates[node.head]
        args = tuple(self._term(n, scope) for n in node.items[1:])
        if len(args) != arity:
            raise AtLineError(node.line, f"{node}: {node.head} takes {arity} argument(s)")
        return Literal(name, args)

    def effects(self, node: Node, scope: frozenset[str]) -> list[Happens]:
        """What an effect brings about, facts under one condition together.

        Raises:
            AtLineError: it is no effect, or has something that is not supported.
        """
        found: dict[tuple[tuple[Parameter, ...], Formula], list[tuple[Literal, int]]] = {}
        self._effect(node, scope, (), TRUE, found)
        return [
            Happens(several, condition, self._settled(facts))
            for (several, condition), facts in found.items()
        ]

    def _effect(
        self,
        node: Node,
        scope: frozenset[str],
        several: tuple[Parameter, ...],
        condition: Formula,
        found: dict[tuple[tuple[Parameter, ...], Formula], list[tuple[Literal, int]]],
    ) -> None:
        if not isinstance(node, Group):
            raise AtLineError(node.line, f"expected an effect in (...), found {node}")
        if not node.items:
            return
        head = node.head
        if head == "and":
            for part in node.items[1:]:
                self._effect(part, scope, several, condition, found)
        elif head == "forall":
            variables, part = self._only(node, 2)
            own = self.parameters(variables, "(forall ...)")
            self._effect(part, scope | {p.name for p in own}, (*several, *own), condition, found)
        elif head == "when":
            left, part = self._only(node, 2)
            own_condition = self.condition(left, scope)
            both = own_condition if condition == TRUE else And((condition, own_condition))
            self._effect(part, scope, several, both, found)
        elif head in _NUMERIC:
            raise AtLineError(node.line, f"numeric effects are not supported: {node}")
        else:
            ends = head == "not"
            literal = self.atom(self._only(node, 1)[0] if ends else node, scope)
            if literal.predicate in self.derived:
                raise AtLineError(
                    node.line,
                    f"{literal.predicate} is derived and cannot be changed: "
                    "change what it is defined by",
                )
            fact = Literal(literal.predicate, literal.args, "false" if ends else "true")
            found.setdefault((several, condition), []).append((fact, node.line))

    def _settled(self, facts: Sequence[tuple[Literal, int]]) -> tuple[Literal, ...]:
        """Facts with attributes put in: one value goes where another one comes."""
        given = {
            (self.values[f.predicate].attribute, f.args)
            for f, _ in facts
            if f.predicate in self.values and f.value == "true"
        }
        done: list[Literal] = []
        for fact, line in facts:
            known = self.values.get(fact.predicate)
            if known is None:
                done.append(fact)
            elif fact.value == "true":
                done.append(Literal(known.attribute, fact.args, known.value))
            elif (known.attribute, fact.args) not in given:
                if known.otherwise is None:
                    raise AtLineError(
                        line,
                        f"{fact}: {fact.predicate} is a value of the attribute {known.attribute}, "
                        "which is left without one: give it another value in the same effect",
                    )
                done.append(Literal(known.attribute, fact.args, known.otherwise))
        return tuple(dict.fromkeys(done))

    def _value(self, literal: Literal) -> Literal:
        known = self.values.get(literal.predicate)
        return literal if known is None else Literal(known.attribute, literal.args, known.value)

    def _term(self, node: Node, scope: frozenset[str]) -> str:
        if not isinstance(node, Word):
            raise AtLineError(node.line, f"expected a variable or a thing, found {node}")
        name = ours(node, "a variable or a thing")
        if name.startswith("?"):
            if name not in scope:
                raise unknown(node, "variable: nothing binds it:", name, scope)
        elif name not in self.things:
            raise unknown(node, "thing", name, self.things)
        return name

    @staticmethod
    def _only(node: Group, count: int) -> tuple[Node, ...]:
        if len(node.items) != count + 1:
            raise AtLineError(node.line, f"({node.head} ...) takes {count} part(s): {node}")
        return node.items[1:]


def apart(formula: Formula, taken: set[str]) -> Formula:
    """The formula with other names for bound variables that are taken."""
    if isinstance(formula, Literal | Fewer):
        return formula
    if isinstance(formula, Not):
        return Not(apart(formula.part, taken))
    if isinstance(formula, And | Or):
        return type(formula)(tuple(apart(p, taken) for p in formula.parts))
    names: dict[str, str] = {}
    for v in formula.variables:
        if v.name in taken:
            names[v.name] = f"{v.name}_in"
            while names[v.name] in taken:
                names[v.name] += "_in"
    several = tuple(Parameter(names.get(v.name, v.name), v.kind) for v in formula.variables)
    return type(formula)(several, apart(bind(formula.part, names), taken))
