"""Which violated facts matter to a subtask, and which are a habit of the demonstrations.

Called by the reasoner and by the detector that judges by preconditions; calls nothing.
"""

from __future__ import annotations

from forestall.domain.model import Domain
from forestall.types.facts import Literal, category_of
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.types.runtime import When
from forestall.types.verdict import Violation


def counts(
    violation: Violation, subtask: Subtask, graph: SceneGraph, when: When, domain: Domain
) -> bool:
    """Whether a violated fact matters before a subtask, or after it."""
    lifted = violation.precondition.literal
    if when is When.BEFORE:
        return concerns(violation, domain) and not _is_the_effect(lifted, subtask, domain)
    if _is_put(lifted, subtask, domain):
        return not _on_another(violation.literal, graph, domain)
    return concerns(violation, domain)


def _is_put(lifted: Literal, subtask: Subtask, domain: Domain) -> bool:
    """Whether a fact says what putting something somewhere brings about."""
    variables = tuple(domain.bound(subtask))
    return lifted.predicate in domain.containing and lifted.args == variables


def _on_another(literal: Literal, graph: SceneGraph, domain: Domain) -> bool:
    """Whether a thing stands on another instance of a support of which any will do."""
    thing, target = literal.args
    return domain.is_open_support(target) and any(
        category_of(parent) == category_of(target)
        for parent in graph.parents(thing, domain.containing)
    )


def _is_the_effect(literal: Literal, subtask: Subtask, domain: Domain) -> bool:
    """Whether a fact is violated only because what the subtask is to bring about holds already.

    That a door was closed before it was opened is no need of opening it.
    """
    return literal == domain.skill(subtask.skill).undoes


def concerns(violation: Violation, domain: Domain) -> bool:
    """Whether a violated fact speaks of an argument, and not merely of where it happens to stand.

    Which counter a thing stood on is a habit of the demonstrations and not a need.
    """
    lifted = violation.precondition.literal
    if lifted.predicate in domain.containing and lifted.value == "true":
        if not lifted.args[0].startswith("?"):
            return lifted.args[1].startswith("?")
        return not domain.is_a(violation.literal.args[1], domain.roles.fixture)
    if lifted.predicate in (domain.roles.hand_empty, domain.roles.holding):
        return True
    return any(a.startswith("?") for a in lifted.args)
