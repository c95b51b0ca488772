"""Derived facts about one thing that say what is not there: nothing related, nothing shut.

Called by `vocabulary`, which finds them; calls nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

from forestall.domain.formula import And, Not, Parameter, Some
from forestall.domain.schema import Predicate, PredicateKind
from forestall.domain.spoken import by_name
from forestall.types.facts import Literal
from forestall.types.graph import ObjectNode, SceneGraph


@dataclass(frozen=True, slots=True)
class Lack:
    """A derived fact about one thing: nothing is related to it, in some relations.

    Args:
        name: of the derived predicate.
        relations: that nothing may have to it.
        position: of the thing in them, 0 or 1.
        of: categories that it is said of; None: all.
    """

    name: str
    relations: tuple[str, ...]
    position: int
    of: frozenset[str] | None = None

    def holds(self, graph: SceneGraph, node: ObjectNode) -> bool:
        """Whether it is true of a node."""
        if self.of is not None and node.category not in self.of:
            return False
        return not any(
            node.id == (r.subject, r.object)[self.position]
            for r in graph.relations
            if r.predicate in self.relations
        )


@dataclass(frozen=True, slots=True)
class Inside:
    """A derived fact about one thing: it is in or on nothing that is in some state.

    Args:
        name: of the derived predicate.
        relation: of a thing to where it is.
        attribute: of that place.
        value: that the place may not have.
    """

    name: str
    relation: str
    attribute: str
    value: str

    def holds(self, graph: SceneGraph, node: ObjectNode) -> bool:
        """Whether it is true of a node."""
        return not any(
            r.subject == node.id
            and r.predicate == self.relation
            and (place := graph.get(r.object)) is not None
            and place.state(self.attribute) == self.value
            for r in graph.relations
        )


def lacking(lack: Lack, vacant: bool) -> Predicate:
    """The predicate of a lack; `vacant`: the one that says that a thing is empty."""
    own, other = Parameter("?thing"), Parameter("?other")
    ends = (own.name, other.name) if lack.position == 0 else (other.name, own.name)
    related = tuple(Not(Some((other,), Literal(r, ends))) for r in lack.relations)
    related_as = by_name(lack.relations[0], 2)
    thing, others = ("{0}", "{}") if lack.position == 0 else ("{}", "{0}")
    told = related_as.format(thing, others)
    return Predicate(
        lack.name,
        PredicateKind.DERIVED,
        (own,),
        definition=related[0] if len(related) == 1 else And(related),
        words="{0} is empty" if vacant else told.replace("{}", "nothing"),
        opposite="{0} is not empty" if vacant else told.replace("{}", "something"),
    )


def placed(inside: Inside) -> Predicate:
    """The predicate of where a thing is not."""
    own, other = Parameter("?thing"), Parameter("?other")
    there = Literal(inside.relation, (own.name, other.name))
    so = Literal(inside.attribute, (other.name,), inside.value)
    such = f"whose {inside.attribute} is {inside.value}"
    told = by_name(inside.relation, 2)
    return Predicate(
        inside.name,
        PredicateKind.DERIVED,
        (own,),
        definition=Not(Some((other,), And((there, so)))),
        words=told.format("{0}", f"nothing {such}"),
        opposite=told.format("{0}", f"something {such}"),
    )
