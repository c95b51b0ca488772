"""The part of a scene graph that concerns a subtask (paper, Sec. 3: "task-informed"). Pure."""

from __future__ import annotations

from collections.abc import Iterable

from forestall.perception.config import ScopeConfig
from forestall.types.facts import GRIPPER, category_of
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.vocabulary import Vocabulary


def scope(
    graph: SceneGraph, subtask: Subtask, vocabulary: Vocabulary, config: ScopeConfig
) -> SceneGraph:
    """Arguments, what holds them, what is in, on or before them, the hand, devices at work.

    A category name as argument stands for every node of that category.
    """
    if config.whole:
        return SceneGraph(graph.nodes, graph.relations, subtask, graph.hidden)
    arguments = {i for a in subtask.args for i in graph.matches(vocabulary.canonical(a))}
    kept = set(arguments)
    if graph.get(GRIPPER) is not None:
        kept.add(GRIPPER)
    held = graph.holding
    if held is not None:
        kept.add(held)
    for name in sorted(kept):
        kept |= _holders(graph, name)
    for name in sorted(kept):
        argument = name in arguments or name == held
        if argument or (config.fellows and name in _direct(graph, arguments)):
            kept |= _contents(graph, name, vocabulary, config)
    kept |= {
        r.subject for r in graph.relations if r.predicate == "blocking" and r.object in arguments
    }
    kept |= _devices(graph, arguments | _direct(graph, arguments), vocabulary)
    nodes = tuple(n for n in graph.nodes if n.id in kept)
    ids = {n.id for n in nodes}
    relations = tuple(
        r
        for r in graph.relations
        if r.predicate in config.predicates and r.subject in ids and r.object in ids
    )
    return SceneGraph(nodes, relations, subtask, tuple(h for h in graph.hidden if h in ids))


def _direct(graph: SceneGraph, names: Iterable[str]) -> set[str]:
    return {p for n in names for p in graph.parents(n)}


def _holders(graph: SceneGraph, name: str) -> set[str]:
    """Everything that contains or supports a node, up to the last."""
    found: set[str] = set()
    pending = [name]
    while pending:
        for parent in graph.parents(pending.pop()):
            if parent not in found:
                found.add(parent)
                pending.append(parent)
    return found


def _contents(
    graph: SceneGraph, name: str, vocabulary: Vocabulary, config: ScopeConfig
) -> set[str]:
    """What is in or on a node, at any depth, unless it holds many things by nature."""
    found: set[str] = set()
    pending = [name]
    while pending:
        current = pending.pop()
        if is_crowded(current, vocabulary, config):
            continue
        for child in graph.contents(current):
            if child not in found:
                found.add(child)
                pending.append(child)
    return found


def is_crowded(name: str, vocabulary: Vocabulary, config: ScopeConfig) -> bool:
    """Whether a receptacle holds many things by nature (counters, fridges, sinks)."""
    category = vocabulary.find(name)
    if category is None or category.receptacle is None:
        return False
    if category.name in config.crowded:
        return True
    large = category.fixture and category.receptacle.relation == "on_top_of"
    return large and category.receptacle.capacity is None


def _devices(graph: SceneGraph, names: Iterable[str], vocabulary: Vocabulary) -> set[str]:
    """Devices and knobs that work on a node: the faucet of a sink, the knob of a burner."""
    found = set()
    for name in names:
        category = vocabulary.find(name)
        if category is None:
            continue
        number = name[len(category_of(name)) :]
        for node in graph.nodes:
            other = vocabulary.find(node.category)
            if other is None or node.id[len(category_of(node.id)) :] != number:
                continue
            acts_on = None if other.device is None else other.device.acts_on
            if category.name in {acts_on, other.controls} - {None}:
                found.add(node.id)
    return found
