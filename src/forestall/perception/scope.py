"""The part of a scene graph that concerns a subtask (paper, Sec. 3: "task-informed"). Pure."""

from __future__ import annotations

from collections.abc import Iterable, Set
from functools import lru_cache

from forestall.domain.counted import counted
from forestall.domain.formula import literals
from forestall.domain.model import Domain
from forestall.perception.config import ScopeConfig
from forestall.perception.relations import DIRECTIONS
from forestall.types.facts import category_of
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask


def scope(graph: SceneGraph, subtask: Subtask, domain: Domain, config: ScopeConfig) -> SceneGraph:
    """Arguments, what holds them, what is in, on or before them, the hand, devices at work.

    A category name as argument stands for every node of that category. What holds many things by
    nature loses its contents, unless the skill itself asks for them. What is said of an argument in
    a relation that the domain does not know is kept: it may matter. So is what is said in one by
    which something derived is defined.
    """
    if config.whole:
        return SceneGraph(graph.nodes, graph.relations, subtask, graph.hidden)
    arguments = {i for a in subtask.args for i in graph.matches(domain.canonical(a))}
    kept = set(arguments)
    kept |= {h for h in domain.robot.hands if graph.get(h) is not None}
    held = graph.in_hands(domain.robot.hands)
    kept |= set(held)
    for name in sorted(kept):
        kept |= _holders(graph, name, domain)
    asked: set[str] = set()
    if any(is_crowded(a, domain) for a in subtask.args):
        asked = {i for a in counted(subtask, domain) for i in graph.matches(domain.canonical(a))}
    for name in sorted(kept):
        argument = name in arguments or name in held
        if argument or (config.fellows and name in _direct(graph, arguments, domain)):
            kept |= _contents(graph, name, domain, asked)
    kept |= {
        r.subject
        for r in graph.relations
        if r.predicate == domain.roles.blocking and r.object in arguments
    }
    kept |= _devices(graph, arguments | _direct(graph, arguments, domain), domain)
    known = {*domain.relations, *DIRECTIONS}
    strange = {r.predicate for r in graph.relations} - known
    with_both_ends = strange | _defining(domain)
    pairs = [{r.subject, r.object} for r in graph.relations if r.predicate in with_both_ends]
    kept |= {name for pair in pairs if pair & arguments for name in pair}
    nodes = tuple(n for n in graph.nodes if n.id in kept)
    ids = {n.id for n in nodes}
    telling = {*domain.scored, *strange}
    relations = tuple(
        r
        for r in graph.relations
        if r.predicate in telling and r.subject in ids and r.object in ids
    )
    return SceneGraph(nodes, relations, subtask, tuple(h for h in graph.hidden if h in ids))


@lru_cache(maxsize=32)
def _defining(domain: Domain) -> frozenset[str]:
    """Relations by which something derived is defined, but those that say where a thing is.

    That nothing has such a relation to a thing cannot be read where what has it is left out.
    """
    formulas = (p.definition for p in domain.derived.values() if p.definition is not None)
    used = {literal.predicate for f in formulas for literal, _ in literals(f)}
    return frozenset(used.intersection(domain.relations).difference(domain.containing))


def _direct(graph: SceneGraph, names: Iterable[str], domain: Domain) -> set[str]:
    return {p for n in names for p in graph.parents(n, domain.containing)}


def _holders(graph: SceneGraph, name: str, domain: Domain) -> set[str]:
    """Everything that contains or supports a node, up to the last."""
    found: set[str] = set()
    pending = [name]
    while pending:
        for parent in graph.parents(pending.pop(), domain.containing):
            if parent not in found:
                found.add(parent)
                pending.append(parent)
    return found


def _contents(graph: SceneGraph, name: str, domain: Domain, asked: Set[str]) -> set[str]:
    """What is in or on a node, at any depth, but not of what holds many things by nature.

    Args:
        graph: the whole scene.
        name: of the node.
        domain: that says what holds many things.
        asked: nodes whose contents are wanted all the same.
    """
    found: set[str] = set()
    pending = [name]
    while pending:
        current = pending.pop()
        if is_crowded(current, domain) and current not in asked:
            continue
        for child in graph.contents(current, domain.containing):
            if child not in found:
                found.add(child)
                pending.append(child)
    return found


def is_crowded(name: str, domain: Domain) -> bool:
    """Whether a receptacle holds many things by nature."""
    return domain.is_a(name, domain.roles.crowded) or domain.is_open_support(name)


def _devices(graph: SceneGraph, names: Iterable[str], domain: Domain) -> set[str]:
    """What works on a node from elsewhere: the tap of a basin, the knob of a burner."""
    found = set()
    for name in names:
        partners = domain.paired(name)
        number = name[len(category_of(name)) :]
        found |= {
            n.id
            for n in graph.nodes
            if domain.canonical(n.category) in partners and n.id[len(category_of(n.id)) :] == number
        }
    return found
