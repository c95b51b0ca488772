"""On what that nobody saw it hangs whether the next subtask can start. Called by strategies."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from forestall.domain.asked import asked_of, is_asked
from forestall.domain.model import Domain
from forestall.types.facts import Literal
from forestall.types.graph import ObjectNode, SceneGraph, Seen
from forestall.types.runtime import BoundaryContext
from forestall.types.verdict import PlanCheck


def relied_on_now(
    check: PlanCheck, context: BoundaryContext, domain: Domain
) -> tuple[Literal, ...]:
    """Unobserved facts about the next subtask's arguments, and hands, that its needs ask about.

    What is assumed of things that nobody has seen is not among them: those are looked for.
    """
    known = {n.id for n in context.graph.nodes}
    seen = context.observation
    untold = set() if seen is None else {h.name for h in (seen.gripper, *seen.others) if not h.told}
    untold &= set(domain.robot.hands) - known
    asked = asked_of(_with_hands(context.graph, untold), context.subtask, domain)
    found = [x for x in asked if untold & set(x.args)]
    found += [
        x
        for x in check.assumed
        if set(x.args) & set(context.subtask.args)
        and known.issuperset(x.args)
        and (is_asked(x, asked) or _emptiness_asked(x, asked, domain))
    ]
    return tuple(sorted(found))


def _with_hands(graph: SceneGraph, untold: Collection[str]) -> SceneGraph:
    """With hands of which the robot does not say what they hold: they may hold anything."""
    hands = (ObjectNode(h, h, seen=Seen.UNOBSERVED) for h in untold)
    return replace(graph, nodes=(*graph.nodes, *hands)) if untold else graph


def _emptiness_asked(fact: Literal, asked: Collection[Literal], domain: Domain) -> bool:
    """Whether a place is assumed to be empty, and it is asked what is in it."""
    return fact.predicate == domain.roles.vacant and any(
        x.predicate in domain.containing and x.args[-1] == fact.args[0] for x in asked
    )
