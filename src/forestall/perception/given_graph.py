"""Scene graphs that somebody else made: handed on, remembered over time, cut to the subtask.

Implements `Perceiver` for observations that carry a graph (symbolic worlds, other people's
perception). Called by the loop; calls the domain only. There is nothing to estimate: what is in
the graph is believed, and what it says is hidden stays what it was when it was last seen.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from forestall.domain.evaluate import static_holds
from forestall.domain.model import Domain
from forestall.domain.truth import GraphView
from forestall.errors import PerceptionError
from forestall.types.graph import SceneGraph, Seen
from forestall.types.observation import Observation
from forestall.types.plan import Subtask


class GraphPassthrough:
    """Believes the graph of every observation.

    Args:
        domain: says which relations tell where a thing is and what concerns a subtask.
    """

    def __init__(self, domain: Domain) -> None:
        self._domain = domain
        self._graph = SceneGraph(())

    def reset(self) -> None:
        """Forget everything."""
        self._graph = SceneGraph(())

    def perceive(self, observation: Observation) -> SceneGraph:
        """What is seen now, and what was seen earlier in a container that is shut now.

        Raises:
            PerceptionError: the observation has no graph.
        """
        seen = observation.graph
        if seen is None:
            raise PerceptionError("the observation has pictures and no scene graph to hand on")
        known = {n.id for n in seen.nodes}
        kept = _within(self._graph, set(seen.hidden), self._domain.containing) - known
        nodes = [replace(n, seen=Seen.UNOBSERVED) for n in self._graph.nodes if n.id in kept]
        relations = [
            r
            for r in self._graph.relations
            if r.subject in kept and (r.object in kept or r.object in known)
        ]
        hidden = {*seen.hidden, *(h for h in self._graph.hidden if h in kept)}
        self._graph = SceneGraph(
            (*seen.nodes, *nodes), (*seen.relations, *relations), None, tuple(hidden)
        )
        return self._graph

    def scope(self, graph: SceneGraph, subtask: Subtask) -> SceneGraph:
        """Arguments, where they are, what is in, on or before them, the hands, paired devices."""
        domain = self._domain
        hands = set(domain.robot.hands)
        names = {i for a in subtask.args for i in graph.matches(domain.canonical(a))}
        names |= {r.subject for r in graph.relations if r.predicate == domain.roles.holding}
        kept = names | _holders(graph, names, domain.containing)
        kept |= _within(graph, {n for n in names if not self._crowded(n)}, domain.containing)
        blocking = domain.roles.blocking
        kept |= {r.subject for r in graph.relations if r.predicate == blocking and r.object in kept}
        kept |= self._partners(graph, names)
        nodes = tuple(n for n in graph.nodes if n.id in kept | hands)
        ids = {n.id for n in nodes}
        counted = [r for r in graph.relations if domain.predicates[r.predicate].scored]
        relations = tuple(r for r in counted if r.subject in ids and r.object in ids)
        return SceneGraph(nodes, relations, subtask, tuple(h for h in graph.hidden if h in ids))

    def describe(self) -> Mapping[str, str]:
        """Neither pictures nor estimates: a graph was given."""
        return {"segmenter": "given graph", "state_estimator": "given graph"}

    def _crowded(self, name: str) -> bool:
        return self._domain.is_a(name, self._domain.roles.support)

    def _partners(self, graph: SceneGraph, names: Iterable[str]) -> set[str]:
        """What works on a thing: the tap of a basin, the person of a tray."""
        domain, view = self._domain, GraphView(graph, self._domain)
        paired = [p for p in domain.predicates.values() if p.paired]
        return {
            n.id
            for p in paired
            for n in graph.nodes
            for name in names
            if static_holds(view, p.name, (n.id, name)) or static_holds(view, p.name, (name, n.id))
        }


def _within(graph: SceneGraph, names: set[str], containing: Iterable[str]) -> set[str]:
    """Everything in, on or at some things, at any depth."""
    found: set[str] = set()
    pending, relations = set(names), set(containing)
    while pending:
        pending = {
            r.subject for r in graph.relations if r.predicate in relations and r.object in pending
        } - found
        found |= pending
    return found


def _holders(graph: SceneGraph, names: set[str], containing: Iterable[str]) -> set[str]:
    """Everything that contains or supports some things, up to the last."""
    found: set[str] = set()
    pending, relations = set(names), set(containing)
    while pending:
        pending = {
            r.object for r in graph.relations if r.predicate in relations and r.subject in pending
        } - found
        found |= pending
    return found
