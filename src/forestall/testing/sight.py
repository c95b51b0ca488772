"""Whether perception sees what a robot has done: each skill's effects, looked for afterwards.

Called by `conformance`; calls a perceiver, and the domain's own execution of the skill on the scene
as perceived before it. What no camera can show is not asked for.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from forestall.domain.model import Domain
from forestall.domain.truth import truth
from forestall.planning.execute import Refusal, apply, resolve
from forestall.planning.observed import state_of
from forestall.planning.state import State
from forestall.seams.acting import Environment
from forestall.seams.perceiving import Perceiver
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.facts import Literal, Truth
from forestall.types.graph import SceneGraph
from forestall.types.observation import Vec3
from forestall.types.plan import Subtask


def unseen(
    environment: Environment,
    seed: int,
    subtasks: Sequence[Subtask],
    domain: Domain,
    perceiver: Perceiver,
) -> Iterator[str]:
    """Complaints: what was done and perception says otherwise, or nothing, of.

    A relation that has come about must be seen; a state must not be seen otherwise.
    """
    environment.reset(seed)
    perceiver.reset()
    graph = perceiver.perceive(environment.scan())
    for subtask in subtasks:
        for name in subtask.args:
            environment.approach(name)
        graph = perceiver.perceive(environment.observe(_points(graph, subtask)))
        before = state_of(graph, domain)
        outcome = environment.execute(subtask)
        done = outcome.status is SkillStatus.SUCCEEDED
        acted = getattr(perceiver, "acted", None)
        if acted is not None:
            acted(subtask, done)
        if not done:
            continue
        expected = _expected(before, subtask)
        if isinstance(expected, str):
            yield f"{subtask} was done; on the scene as perceived before it cannot be: {expected}"
        graph = perceiver.perceive(environment.observe(_where(outcome, graph, subtask)))
        if not isinstance(expected, str):
            yield from _not_seen(subtask, expected, graph, domain)


def _expected(before: State, subtask: Subtask) -> list[Literal] | str:
    """What the domain says that the skill brings about, or why it says that it cannot be done."""
    domain = before.domain
    args = resolve(before, subtask)
    if isinstance(args, Refusal):
        return args.reason
    after = apply(before, Subtask(subtask.skill, args))
    if isinstance(after, Refusal):
        return after.reason
    new = [f for f in after.facts - before.facts if f[0] in domain.relations]
    found = [Literal(f[0], f[1:]) for f in sorted(new) if domain.predicates[f[0]].camera]
    for (name, attribute), value in sorted(after.values.items()):
        changed = before.values.get((name, attribute)) != value and name in before.kinds
        if changed and domain.attributes[attribute].camera:
            found.append(Literal(attribute, (name,), value))
    return found


def _not_seen(
    subtask: Subtask, expected: Sequence[Literal], graph: SceneGraph, domain: Domain
) -> Iterator[str]:
    ids = {n.id for n in graph.nodes}
    for fact in expected:
        seen = truth(graph, fact, domain) if ids >= set(fact.args) else Truth.UNOBSERVED
        if seen is Truth.FALSE or (seen is Truth.UNOBSERVED and not fact.is_state):
            how = "sees otherwise" if seen is Truth.FALSE else "does not see"
            yield f"after {subtask} perception {how}: {fact}"


def _points(graph: SceneGraph, subtask: Subtask) -> list[Vec3]:
    """Where perception believes the things to be that a subtask names."""
    found = []
    for name in subtask.args:
        nodes = [n for n in graph.nodes if name in (n.id, n.category)]
        found += [n.centroid_m for n in nodes[:1] if n.centroid_m is not None]
    return found


def _where(outcome: SkillOutcome, graph: SceneGraph, subtask: Subtask) -> list[Vec3]:
    hand = [] if outcome.hand_world_m is None else [outcome.hand_world_m]
    return [*_points(graph, subtask), *hand]
