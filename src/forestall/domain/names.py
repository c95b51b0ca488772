"""Which instance a category name in a plan means, from what the robot has seen.

Used by the monitor before each subtask. It reads the fused scene graph and never a simulator. A
name that fits nothing observed stays a category name: the environment then resolves it, as a robot
would that opens a fridge to look for "the egg".
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping

from forestall.domain.formula import literals
from forestall.domain.model import Domain
from forestall.domain.schema import Skill
from forestall.domain.truth import view
from forestall.types.facts import Literal, Truth, category_of, is_instance
from forestall.types.graph import ObjectNode, SceneGraph
from forestall.types.observation import Vec3
from forestall.types.plan import Subtask


def ground_subtask(
    subtask: Subtask,
    graph: SceneGraph,
    domain: Domain,
    robot_world_m: Vec3,
    bound: Mapping[str, str],
    refused: Collection[Subtask] = (),
) -> Subtask:
    """Replace category names by instance names.

    An instance name stays. Otherwise, in this order: the held object when it is of the category
    (for a placed or poured object); the instance that the category was bound to before; the
    nearest located one that nothing shuts in or blocks, ties by name.

    Args:
        subtask: as the plan has it.
        graph: the whole fused graph.
        domain: what names and skills mean.
        robot_world_m: where the robot stands.
        bound: category → instance, from earlier subtasks of the same episode.
        refused: what the robot would refuse: another instance is meant, where there is one.
    """
    skill = domain.skill(subtask.skill)
    names = []
    for parameter, raw in zip(skill.parameters, subtask.args, strict=True):
        name = domain.canonical(raw)
        if is_instance(name) or domain.find(name) is None:
            names.append(name)
            continue
        category = domain[name].name
        nodes = graph.of_category(category)
        held = [h for h in graph.in_hands(domain.robot.hands) if _is(graph, h, category)]
        places = parameter.name == skill.hand or _may_be_in_hand(skill, domain)
        if held and (places or len(nodes) == 1):
            names.append(held[0])
        elif bound.get(category) in {n.id for n in nodes} and not domain.is_open_support(category):
            names.append(bound[category])
        else:
            names.append(_nearest(nodes, graph, domain, robot_world_m) or category)
    meant = Subtask(subtask.skill, tuple(names))
    if meant not in refused:
        return meant
    return _otherwise(subtask, meant, graph, domain, robot_world_m, refused) or meant


def as_meant(
    steps: Iterable[Subtask], meant: Mapping[str, str], graph: SceneGraph, domain: Domain
) -> tuple[Subtask, ...]:
    """Steps of a plan as they will be grounded, as far as that is known before they come up.

    Of several things of a category the one that is in the hand is meant, or that the category has
    meant before; on an open support it is the robot's controller that chooses.

    Args:
        steps: with categories or instances.
        meant: category → instance, from earlier subtasks of the same episode.
        graph: the whole fused graph.
        domain: what names mean.
    """
    held = {n.category: n.id for h in graph.in_hands(domain.robot.hands) if (n := graph.get(h))}
    known = {
        category: name
        for category, name in {**meant, **held}.items()
        if len(graph.of_category(category)) > 1
        and graph.get(name) is not None
        and not domain.is_open_support(category)
    }
    if not known:
        return tuple(steps)
    return tuple(
        Subtask(s.skill, tuple(known.get(domain.canonical(a), a) for a in s.args)) for s in steps
    )


def _otherwise(
    planned: Subtask,
    meant: Subtask,
    graph: SceneGraph,
    domain: Domain,
    robot_world_m: Vec3,
    refused: Collection[Subtask],
) -> Subtask | None:
    """The same with another instance of a category that the plan names, the last argument first."""
    for position in reversed(range(len(planned.args))):
        raw = domain.canonical(planned.args[position])
        if is_instance(raw) or raw in domain.robot.hands:
            continue
        nodes = graph.of_category(category_of(meant.args[position]))
        while nodes:
            nearest = _nearest(nodes, graph, domain, robot_world_m)
            if nearest is None:
                break
            args = (*meant.args[:position], nearest, *meant.args[position + 1 :])
            other = Subtask(meant.skill, args)
            if other not in refused and len(set(args)) == len(set(meant.args)):
                return other
            nodes = tuple(n for n in nodes if n.id != nearest)
    return None


def executable(subtask: Subtask, planned: Subtask, domain: Domain) -> Subtask:
    """The subtask to send to the robot: grounded, but open supports as the plan names them.

    "On a counter" leaves it to the robot's controller which counter has room.
    """
    return Subtask(
        subtask.skill,
        tuple(
            raw if domain.is_open_support(raw) and not is_instance(raw) else name
            for name, raw in zip(subtask.args, planned.args, strict=True)
        ),
    )


def _is(graph: SceneGraph, name: str, category: str) -> bool:
    node = graph.get(name)
    return node is not None and node.category == category


def _may_be_in_hand(skill: Skill, domain: Domain) -> bool:
    """Whether a skill can be about what is held already: it neither drives nor fills the hand."""
    roles = domain.roles
    if skill.drives or skill.hand is not None:
        return False
    wants_empty = any(
        x.predicate == roles.hand_empty or (x.predicate == roles.holding and not positive)
        for need in skill.needs
        for x, positive in literals(need.formula)
    )
    return not wants_empty


def _nearest(
    nodes: tuple[ObjectNode, ...], graph: SceneGraph, domain: Domain, robot_world_m: Vec3
) -> str | None:
    """The located one that nothing shuts in or blocks; of several the nearest, then by name."""
    seen = view(graph, domain)

    def fails(predicate: str | None, name: str) -> bool:
        return predicate is not None and seen.truth(Literal(predicate, (name,))) is not Truth.TRUE

    def key(node: ObjectNode) -> tuple[bool, bool, bool, float, str]:
        shut_in = fails(domain.roles.accessible, node.id)
        blocked = fails(domain.roles.unblocked, node.id)
        if node.centroid_m is None:
            return (True, shut_in, blocked, 0.0, node.id)
        gap = math.dist(node.centroid_m[:2], robot_world_m[:2])
        return (False, shut_in, blocked, round(gap, 3), node.id)

    best = min(nodes, key=key, default=None)
    return None if best is None else best.id
