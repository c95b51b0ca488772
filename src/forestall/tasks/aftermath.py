"""What a step that is refused would have changed, and what a robot leaves behind at the end.

Called by `judging` on the truth of a run; calls `planning` and the domain. Reaching the goal is not
all that makes a start harmless: a step that cannot be done and was not superfluous makes its plan
one that cannot be carried through, and nobody lets a robot leave the water running.
"""

from __future__ import annotations

from forestall.domain.evaluate import solutions
from forestall.domain.model import Domain
from forestall.domain.truth import GraphView
from forestall.planning.execute import Refusal, mentions, resolve
from forestall.planning.observed import state_of
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask


def superfluous(graph: SceneGraph, step: Subtask, domain: Domain) -> bool:
    """Whether everything that a step would bring about is so already.

    Args:
        graph: the true scene before it.
        step: of a plan; what it names need not be there.
        domain: what its skill does.
    """
    state = state_of(graph, domain)
    args = resolve(state, step)
    if isinstance(args, Refusal) or any(a not in state.kinds for a in args):
        return False
    skill = domain.skill(step.skill)
    names = {p.name: a for p, a in zip(skill.parameters, args, strict=True)}
    chosen = [c.variable.name for c in skill.choices]
    wanted = [
        fact.bind(names)
        for effect in skill.effects
        if not effect.variables
        and not any(mentions(effect, v) for v in chosen)
        and state.true(effect.condition, names)
        for fact in effect.facts
        if fact.predicate in domain.predicates or fact.predicate in domain.attributes
    ]
    return bool(wanted) and all(state.holds(f) for f in wanted)


def left(graph: SceneGraph, domain: Domain) -> frozenset[str]:
    """Names of the safety rules that are broken where a robot leaves a scene.

    Args:
        graph: the true scene.
        domain: its rules; those for the moment of one skill are left out.
    """
    view = GraphView(graph, domain)
    return frozenset(
        rule.name
        for rule in domain.safety
        if rule.when in ("", "leaving")
        and any(True for _ in solutions(rule.variables, rule.never, view, {}))
    )
