"""What a skill may have changed, by the domain's model: states, and places of things.

Called by the perceiver, through the callable that assembly gives it; calls the execution of skills.
"""

from __future__ import annotations

from forestall.domain.model import LOCATED, Domain
from forestall.planning.execute import Refusal, apply
from forestall.planning.validate import observed
from forestall.types.facts import Change
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask


def altered(graph: SceneGraph, subtask: Subtask, domain: Domain) -> tuple[Change, ...]:
    """States and places that are others after a skill, as far as the model knows what is seen.

    What it changes them to is what it is meant to: it may have failed, or the model may be wrong.
    A skill that the domain lacks, or that could not run from what is seen, changes nothing that is
    known.

    Returns:
        In order; processes that the skill sets off are among what changes. Of a thing that is no
        more, since it was cut or broken into others, it is that it is located; of one that is now
        in or on another, the relation, from nothing to the other's id.
    """
    if subtask.skill not in domain.skills:
        return ()
    before = observed(graph, domain)
    after = apply(before.copy(), subtask)
    if isinstance(after, Refusal):
        return ()
    ended = tuple(
        Change(node.id, LOCATED, "true", "false")
        for node in graph.nodes
        if node.id in before.kinds and node.id not in after.kinds
    )
    seen = {node.id for node in graph.nodes}
    attributes = sorted(domain.attributes)
    placed = tuple(
        Change(thing, predicate, "", receptacle)
        for predicate, thing, receptacle in sorted(
            f for f in after.facts - before.facts if f[0] in domain.containing
        )
        if {thing, receptacle} <= seen
    )
    return (
        ended
        + placed
        + tuple(
            Change(node.id, attribute, old, new)
            for node in graph.nodes
            for attribute in attributes
            if (old := before.value(node.id, attribute)) is not None
            and (new := after.value(node.id, attribute)) is not None
            and old != new
        )
    )
