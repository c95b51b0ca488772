"""Which facts decide whether a subtask can start, of those that nobody saw or can read.

Called by strategies, which do not let a robot start on what nobody saw; calls `truth`.
"""

from __future__ import annotations

from forestall.domain.formula import bind, literals
from forestall.domain.model import Domain
from forestall.domain.truth import formula_truth
from forestall.types.facts import Literal, Truth
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask


def asked_of(graph: SceneGraph, subtask: Subtask, domain: Domain) -> frozenset[Literal]:
    """Literals of the needs that are not seen to hold, and of what defines derived ones.

    The subtask's arguments stand in them; what a quantifier binds is still a variable ("?x").
    A need that is true on what is seen asks nothing.
    """
    names = domain.bound(subtask)
    needs = [bind(n.formula, names) for n in domain.skill(subtask.skill).needs]
    pending = [n for n in needs if formula_truth(graph, n, domain) is not Truth.TRUE]
    found: set[Literal] = set()
    while pending:
        for literal, _ in literals(pending.pop()):
            if literal in found:
                continue
            found.add(literal)
            known = domain.derived.get(literal.predicate)
            if known is not None and known.definition is not None:
                inner = {p.name: a for p, a in zip(known.parameters, literal.args, strict=True)}
                pending.append(bind(known.definition, inner))
    return frozenset(found)


def is_asked(fact: Literal, asked: frozenset[Literal]) -> bool:
    """Whether one of the literals is about these very arguments; a variable stands for any."""
    return any(
        x.predicate == fact.predicate
        and all(a.startswith("?") or a == b for a, b in zip(x.args, fact.args, strict=True))
        for x in asked
    )


def not_understood(graph: SceneGraph, subtask: Subtask, domain: Domain) -> list[str]:
    """What a graph says of a subtask's arguments in words that the domain lacks, a sentence each.

    It may matter or not: nobody can say. A domain that was learnt has no words but those of its
    demonstrations.
    """
    about = {name for a in subtask.args for name in graph.matches(a)}
    relations = [
        f"{r}: nothing is known of the relation {r.predicate}, so it may matter"
        for r in graph.relations
        if r.predicate not in domain.relations and (r.subject in about or r.object in about)
    ]
    attributes = [
        f"{n.id}: nothing is known of the attribute {attribute}, so it may matter"
        for n in graph.nodes
        for attribute, _ in (n.states if n.id in about else ())
        if attribute not in domain.attributes
    ]
    return relations + attributes
