"""Facts about a subtask's arguments as literals over the skill's parameters.

Called by preconditions and needs; calls nothing. A literal is true, false, or unobserved in a
graph; `lift` collects the true ones, the negative ones included.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from enum import Enum
from itertools import permutations

from forestall.domain.formula import literals
from forestall.domain.model import Domain
from forestall.domain.schema import Skill
from forestall.domain.truth import truth
from forestall.types.facts import Literal, Truth, category_of
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask


class Kind(Enum):
    """What a literal follows from, and so how far it carries over."""

    SKILL = "skill"  # whether the skill can run: holds in any task
    MATERIAL = "material"  # what the task makes of an argument
    CONTEXT = "context"  # things that are no argument of the subtask


def lift(graph: SceneGraph, subtask: Subtask, domain: Domain) -> frozenset[Literal]:
    """Every literal of this version that is true of a subtask's arguments in a graph.

    - states of the arguments: dirty(?object)=clean, open(?target)=open, ... (before driving
      somewhere not whether that is open or on: it makes no difference to driving);
    - vacant(?x) for receptacles with a capacity and for vessels;
    - accessible(?x) for what can be picked up; unblocked(?x) for what the skill needs clear;
    - held_by(?x, gripper) for each hand, or that any hand has it, where the domain has a word for
      that; hand_empty(), and held_by(Lettuce, gripper) for what is no argument;
    - the relations between two arguments that skills are about: inside(?object, ?target) or not;
    - every other derived fact about one argument, or about none, that the domain wants mined;
    - contents by category, but not of supports, on which many things merely stand.

    An argument that is a category name and no node of the graph has no true literal.
    """
    found = candidates(graph, subtask, domain)
    return frozenset(c for c in found if evaluate(c, graph, subtask, domain) is Truth.TRUE)


def candidates(graph: SceneGraph, subtask: Subtask, domain: Domain) -> frozenset[Literal]:
    """What `lift` would find true or not; of what is open-ended only what is there."""
    roles, known = domain.bound(subtask), domain.roles
    skill = domain.skill(subtask.skill)
    found = {Literal(known.hand_empty, ())} if known.hand_empty else set()
    for variable, name in roles.items():
        node = graph.get(name)
        category = domain.find(name if node is None else node.category)
        if node is None or category is None:
            continue
        found |= {
            Literal(attribute, (variable,), value)
            for attribute, value in node.states
            if value is not None
            and _is_observable(attribute, domain)
            and not (skill.drives and domain.attributes[attribute].mechanical)
        }
        if known.vacant and known.vacatable in category.tags:
            found.add(Literal(known.vacant, (variable,)))
        if known.movable in category.tags:
            found |= _about_movable(variable, domain)
        if known.unblocked and _asks_for_way(variable, skill, domain):
            found.add(Literal(known.unblocked, (variable,)))
        if not domain.is_open_support(category.name) and domain.offers(category.name):
            found |= _contents(graph, node.id, variable, roles, domain)
    found |= _between(roles, graph, domain) | _derived(tuple(roles), domain)
    for hand in domain.robot.hands if known.holding else ():
        for held in graph.in_hands((hand,)):
            if held not in roles.values():
                found.add(Literal(str(known.holding), (_category(held, graph), hand)))
    return frozenset(found)


def _category(name: str, graph: SceneGraph) -> str:
    node = graph.get(name)
    return category_of(name) if node is None else node.category


def _between(roles: Mapping[str, str], graph: SceneGraph, domain: Domain) -> set[Literal]:
    """Relations that skills are about, between arguments.

    Denied only in the order of the parameters, and where the second can have such a thing at all.
    """
    apart = (domain.roles.holding, domain.roles.blocking)
    predicates = {*domain.containing, *(p for p in domain.relations if p in domain.moved)}
    order, found = tuple(roles), set[Literal]()
    for predicate in predicates.difference(apart):
        offered = domain.predicates[predicate].offered_by or None
        for pair in permutations(order, 2):
            found.add(Literal(predicate, pair))
            node = graph.get(roles[pair[1]])
            place = roles[pair[1]] if node is None else node.category
            if order.index(pair[0]) < order.index(pair[1]) and domain.is_a(place, offered):
                found.add(Literal(predicate, pair, "false"))
    return found


def _derived(variables: tuple[str, ...], domain: Domain) -> set[Literal]:
    """Derived facts beyond those that the engine knows by their part."""
    roles = domain.roles
    apart = (
        roles.vacant,
        roles.accessible,
        roles.unblocked,
        roles.hand_empty,
        roles.shut,
        domain.in_any_hand,
    )
    found = set()
    for predicate in domain.derived.values():
        if predicate.mined and predicate.name not in apart:
            for args in permutations(variables, len(predicate.parameters)):
                found |= {Literal(predicate.name, args, v) for v in ("true", "false")}
    return found


def _about_movable(variable: str, domain: Domain) -> set[Literal]:
    """What can matter about a thing that a hand can take."""
    roles, found = domain.roles, set()
    if roles.accessible:
        found.add(Literal(roles.accessible, (variable,)))
    if roles.holding:
        one = [Literal(roles.holding, (variable, hand)) for hand in domain.robot.hands]
        if domain.in_any_hand:
            one = [Literal(domain.in_any_hand, (variable,))]
        found |= {replace(x, value=v) for x in one for v in ("true", "false")}
    return found


def _asks_for_way(variable: str, skill: Skill, domain: Domain) -> bool:
    """Whether a skill needs nothing to stand before a thing."""
    way = (domain.roles.unblocked, domain.roles.blocking)
    return any(
        x.predicate in way and variable in x.args
        for need in skill.needs
        for x, _ in literals(need.formula)
    )


def kind_of(literal: Literal, domain: Domain, skill: Skill | None = None) -> Kind:
    """How far a lifted literal carries over.

    What is about no argument follows from a skill only where its needs speak of it: that the hand
    is empty is needed to grasp, and a habit of whoever drives somewhere.
    """
    attribute = domain.attributes.get(literal.predicate)
    if literal.is_state and (attribute is None or attribute.material):
        return Kind.MATERIAL
    names = [a for a in literal.args if a not in domain.robot.hands]
    if not names and skill is not None and literal.args == ():
        said = {x.predicate for n in skill.needs for x, _ in literals(n.formula)}
        return Kind.SKILL if literal.predicate in said else Kind.CONTEXT
    if not names or any(not a.startswith("?") for a in names):
        return Kind.CONTEXT
    return Kind.SKILL


def evaluate(literal: Literal, graph: SceneGraph, subtask: Subtask, domain: Domain) -> Truth:
    """The truth of a lifted literal in a graph, its variables bound to the subtask's arguments.

    A literal about an argument that is no node of the graph is unobserved. What a hand holds is
    always known, and so is that it stands nowhere else.
    """
    ground = literal.bind(domain.bound(subtask))
    for raw, name in zip(literal.args, ground.args, strict=True):
        if raw.startswith("?") and graph.get(name) is None:
            return Truth.UNOBSERVED
    if ground.predicate == domain.roles.holding:
        return _held(ground, graph)
    first = literal.args[0] if literal.args else ""
    if ground.predicate in domain.containing and not first.startswith("?"):
        return _contains(ground, graph)
    held = graph.in_hands(domain.robot.hands)
    if ground.predicate in domain.containing and ground.args[0] in held:
        return Truth.TRUE if ground.value == "false" else Truth.FALSE
    return truth(graph, ground, domain)


def _held(ground: Literal, graph: SceneGraph) -> Truth:
    held = graph.in_hands(ground.args[1:])
    names = {n for h in held for n in (h, _category(h, graph))}
    return Truth.TRUE if (ground.args[0] in names) == (ground.value == "true") else Truth.FALSE


def _contains(ground: Literal, graph: SceneGraph) -> Truth:
    category, container = ground.args
    for r in graph.relations:
        if r.object == container and r.predicate == ground.predicate:
            node = graph.get(r.subject)
            if node is not None and node.category == category:
                return Truth.TRUE
    return Truth.UNOBSERVED if container in graph.hidden else Truth.FALSE


def _contents(
    graph: SceneGraph, node_id: str, variable: str, roles: dict[str, str], domain: Domain
) -> set[Literal]:
    return {
        Literal(r.predicate, (category_of(r.subject), variable))
        for r in graph.relations
        if r.object == node_id
        and r.predicate in domain.containing
        and r.subject not in roles.values()
    }


def _is_observable(attribute: str, domain: Domain) -> bool:
    """Whether a camera can tell; demonstrations may know attributes that this domain lacks."""
    known = domain.attributes.get(attribute)
    return known is not None and known.camera
