"""Scene graphs that somebody else made: handed on, remembered over time, cut to the subtask.

Implements `Perceiver` for observations that carry a graph (symbolic worlds, other people's
perception). Called by the loop; calls `scope`. There is nothing to estimate: what is in
the graph is believed, and what it says is hidden stays what it was when it was last seen.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from forestall.domain.model import Domain
from forestall.errors import PerceptionError
from forestall.perception.config import ScopeConfig
from forestall.perception.scope import scope
from forestall.types.graph import SceneGraph, Seen
from forestall.types.observation import Observation
from forestall.types.plan import Subtask


class GraphPassthrough:
    """Believes the graph of every observation.

    Args:
        domain: says which relations tell where a thing is and what concerns a subtask.
        config: what a subtask's graph keeps.
    """

    def __init__(self, domain: Domain, config: ScopeConfig | None = None) -> None:
        self._domain = domain
        self._config = config or ScopeConfig()
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
        """The part that concerns a subtask, as from pictures; see `scope`."""
        return scope(graph, subtask, self._domain, self._config)

    def describe(self) -> Mapping[str, str]:
        """Neither pictures nor estimates: a graph was given."""
        return {"segmenter": "given graph", "state_estimator": "given graph"}


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
