"""Facts about a subtask's arguments as literals over ?object and ?target.

Called by preconditions; calls nothing. A literal is true, false, or unobserved in a graph; `lift`
collects the true ones, the negative ones included.
"""

from __future__ import annotations

from enum import Enum

from forestall.types.facts import GRIPPER, Literal, Truth, category_of
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.vocabulary import Category, Vocabulary

_NEEDED = ("broken", "open", "toggled")
"""Attributes that decide whether a skill can run; the others only matter to a task's outcome."""

_MECHANICAL = ("open", "toggled")
_VESSELS = ("dish", "vessel")


class Kind(Enum):
    """What a literal follows from, and so how far it carries over."""

    SKILL = "skill"  # whether the skill can run: holds in any task
    MATERIAL = "material"  # what the task makes of an argument
    CONTEXT = "context"  # things that are no argument of the subtask


def lift(graph: SceneGraph, subtask: Subtask, vocabulary: Vocabulary) -> frozenset[Literal]:
    """Every literal of this version that is true of a subtask's arguments in a graph.

    - states of the arguments: dirty(?object)=clean, open(?target)=open, ... (before driving
      somewhere not whether that is open or on: it makes no difference to driving);
    - vacant(?x) for receptacles with a capacity and for vessels;
    - unblocked(?object); accessible(?x) for what can be picked up;
    - held_by(?x, gripper), hand_empty(), and held_by(Lettuce, gripper) for what is no argument;
    - inside(?object, ?target) and on_top_of(?object, ?target), or their negations;
    - contents by category, inside(Potato, ?target), but not of tables, counters and shelves.

    An argument that is a category name and no node of the graph has no true literal.
    """
    roles = subtask.roles()
    moving = subtask.skill == "navigate_to_obj"
    candidates = {Literal("hand_empty", ())}
    for variable, name in roles.items():
        node = graph.get(name)
        category = vocabulary.find(name if node is None else node.category)
        if node is None or category is None:
            continue
        candidates |= {
            Literal(attribute, (variable,), value)
            for attribute, value in node.states
            if value is not None
            and _is_observable(attribute, vocabulary)
            and not (moving and attribute in _MECHANICAL)
        }
        if _is_vacatable(category):
            candidates.add(Literal("vacant", (variable,)))
        if category.pickupable:
            candidates.add(Literal("accessible", (variable,)))
            for value in ("true", "false"):
                candidates.add(Literal("held_by", (variable, GRIPPER), value))
            if variable == "?object":
                candidates.add(Literal("unblocked", (variable,)))
        candidates |= _contents(graph, node.id, variable, roles, category)
    if len(roles) == 2:
        for predicate in ("inside", "on_top_of"):
            for value in ("true", "false"):
                candidates.add(Literal(predicate, ("?object", "?target"), value))
    held = graph.holding
    if held is not None and held not in roles.values():
        node = graph.get(held)
        category_name = category_of(held) if node is None else node.category
        candidates.add(Literal("held_by", (category_name, GRIPPER)))
    return frozenset(c for c in candidates if evaluate(c, graph, subtask) is Truth.TRUE)


def kind_of(literal: Literal) -> Kind:
    """How far a lifted literal carries over."""
    if literal.is_state and literal.predicate not in _NEEDED:
        return Kind.MATERIAL
    names = [a for a in literal.args if a != GRIPPER]
    if literal.predicate == "hand_empty" or any(not a.startswith("?") for a in names):
        return Kind.CONTEXT
    return Kind.SKILL


def evaluate(literal: Literal, graph: SceneGraph, subtask: Subtask) -> Truth:
    """The truth of a lifted literal in a graph, its variables bound to the subtask's arguments.

    A literal about an argument that is no node of the graph is unobserved. What the gripper holds
    is always known, and so is that it stands nowhere else.
    """
    ground = literal.bind(subtask.roles())
    for raw, name in zip(literal.args, ground.args, strict=True):
        if raw.startswith("?") and graph.get(name) is None:
            return Truth.UNOBSERVED
    if ground.predicate == "held_by":
        return _held(ground, graph)
    first = literal.args[0] if literal.args else ""
    if ground.predicate in ("inside", "on_top_of") and not first.startswith("?"):
        return _contains(ground, graph)
    if ground.predicate in ("inside", "on_top_of") and graph.holding == ground.args[0]:
        return Truth.TRUE if ground.value == "false" else Truth.FALSE
    return graph.truth(ground)


def _held(ground: Literal, graph: SceneGraph) -> Truth:
    held = graph.holding
    node = None if held is None else graph.get(held)
    names = () if held is None else (held, category_of(held) if node is None else node.category)
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
    graph: SceneGraph, node_id: str, variable: str, roles: dict[str, str], category: Category
) -> set[Literal]:
    if category.receptacle is None or _is_surface(category):
        return set()
    return {
        Literal(r.predicate, (category_of(r.subject), variable))
        for r in graph.relations
        if r.object == node_id
        and r.predicate in ("inside", "on_top_of")
        and r.subject not in roles.values()
    }


def _is_observable(attribute: str, vocabulary: Vocabulary) -> bool:
    """Whether a camera can tell; demonstrations may know attributes that this vocabulary lacks."""
    known = vocabulary.attributes.get(attribute)
    return known is not None and known.camera


def _is_vacatable(category: Category) -> bool:
    """Whether it can matter that nothing is in or on it: not for counters, fridges and sinks."""
    receptacle = category.receptacle
    if receptacle is None:
        return False
    return receptacle.capacity is not None or category.shape.get("kind") in _VESSELS


def _is_surface(category: Category) -> bool:
    receptacle = category.receptacle
    return (
        category.fixture
        and receptacle is not None
        and receptacle.relation == "on_top_of"
        and receptacle.capacity is None
    )
