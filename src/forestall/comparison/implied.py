"""Facts that only say again what another one says.

Called by preconditions. Where a thing needs to be next to the robot, "something is next to it" is
no need of its own: it cannot fail while the other holds, and is one more habit to a reader.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from forestall.comparison.lifting import evaluate
from forestall.comparison.needs import Needs
from forestall.types.facts import Literal, Truth
from forestall.types.graph import ObjectNode, Relation, SceneGraph
from forestall.types.plan import Subtask
from forestall.types.verdict import Precondition


def said_once(found: Sequence[Precondition], counts: Needs, subtask: Subtask) -> list[Precondition]:
    """Preconditions without the derived facts that a relation which weighs as much implies."""
    domain = counts.domain
    relations = [
        p for p in found if p.literal.predicate in domain.relations and p.literal.value == "true"
    ]

    def again(p: Precondition) -> bool:
        return p.literal.predicate in domain.derived and any(
            q.weight >= p.weight and _implies(q.literal, p.literal, counts, subtask)
            for q in relations
        )

    return [p for p in found if not again(p)]


def _implies(one: Literal, other: Literal, counts: Needs, subtask: Subtask) -> bool:
    """Whether a relation alone makes a derived fact what it is, which it would not be without."""
    kinds = counts.kinds(subtask)
    key = (one, other, subtask.skill, *kinds.values())
    if key not in counts.implied:
        domain = counts.domain
        things = [ObjectNode(f"{kind}-{i}", kind) for i, kind in enumerate(kinds.values(), 1)]
        alike = Subtask(subtask.skill, tuple(t.id for t in things))
        there = one.bind(domain.bound(alike))
        graph = SceneGraph((*things, *(ObjectNode(h, h) for h in domain.robot.hands)))
        if all(graph.get(a) for a in there.args):
            related = Relation(there.args[0], there.predicate, there.args[1])
            holds = replace(graph, relations=(related,))
            said = [evaluate(other, g, alike, domain) is Truth.TRUE for g in (graph, holds)]
            counts.implied[key] = said == [False, True]
        else:  # it speaks of a kind of thing, and not of an argument
            counts.implied[key] = False
    return counts.implied[key]
