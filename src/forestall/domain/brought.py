"""What a subtask brings about whatever else is so, and whether that is to be seen.

Called by the run's state and by strategies; calls `evaluate` and `truth`.
"""

from __future__ import annotations

from forestall.domain.evaluate import evaluate, solutions
from forestall.domain.formula import TRUE as ALWAYS
from forestall.domain.model import Domain
from forestall.domain.schema import Choice
from forestall.domain.truth import GraphView, truth, view
from forestall.domain.view import TRUE
from forestall.types.facts import Literal, Truth, by_number
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask


def brings_about(graph: SceneGraph, subtask: Subtask, domain: Domain) -> tuple[Literal, ...]:
    """The facts of its effects that have no condition and range over nothing.

    Those are left out that are about a thing which the subtask does not name and the graph does not
    tell.
    """
    skill, names = domain.skill(subtask.skill), domain.bound(subtask)
    seen = view(graph, domain)
    for choice in skill.deciding:
        found = _chosen(choice, seen, names)
        if found is not None:
            names[choice.variable.name] = found
    facts = (
        fact.bind(names)
        for effect in skill.effects
        if not effect.variables and effect.condition == ALWAYS
        for fact in effect.facts
    )
    return tuple(f for f in facts if not any(a.startswith("?") for a in f.args))


def _chosen(choice: Choice, seen: GraphView, names: dict[str, str]) -> str | None:
    """The thing that a skill deals with and does not name, as far as is seen for certain."""
    variable = choice.variable
    for formula in choice.among:
        found = [
            bound[variable.name]
            for bound, how in solutions((variable,), formula, seen, names)
            if how == TRUE and evaluate(choice.such_that, seen, bound) == TRUE
        ]
        if found:
            return min(found, key=by_number)
    return None


def came_about(graph: SceneGraph, subtask: Subtask, domain: Domain) -> Truth:
    """True if all of that is seen, false if something of it is seen not to be so."""
    found = [truth(graph, fact, domain) for fact in brings_about(graph, subtask, domain)]
    if Truth.FALSE in found:
        return Truth.FALSE
    return Truth.TRUE if found and set(found) == {Truth.TRUE} else Truth.UNOBSERVED
