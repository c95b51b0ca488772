"""Scene graphs that somebody else made: handed on, remembered over time, cut to the subtask.

Implements `Perceiver` for observations that carry a graph (symbolic worlds, other people's
perception). Called by the loop; calls `scope`. There is nothing to estimate: what is in
the graph is believed, and what it says is hidden stays what it was when it was last seen. A state
that it leaves open is presumed to be what the robot's skills should have made of it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from forestall.domain.model import LOCATED, Domain
from forestall.errors import PerceptionError
from forestall.perception.config import ScopeConfig
from forestall.perception.scope import scope
from forestall.seams.perceiving import Alters
from forestall.types.graph import ObjectNode, SceneGraph, Seen
from forestall.types.observation import Observation
from forestall.types.plan import Subtask


class GraphPassthrough:
    """Believes the graph of every observation.

    Args:
        domain: says which relations tell where a thing is and what concerns a subtask.
        config: what a subtask's graph keeps.
        alters: what a skill may have changed; without it nothing is presumed.
    """

    def __init__(
        self, domain: Domain, config: ScopeConfig | None = None, *, alters: Alters | None = None
    ) -> None:
        self._domain = domain
        self._config = config or ScopeConfig()
        self._alters = alters
        self._graph = SceneGraph(())
        self._presumed: dict[str, dict[str, str]] = {}

    def reset(self) -> None:
        """Forget everything."""
        self._graph = SceneGraph(())
        self._presumed = {}

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
        hidden_now = [replace(n, seen=Seen.UNOBSERVED) for n in self._graph.nodes if n.id in kept]
        nodes = [self._with_presumed(n) for n in (*seen.nodes, *hidden_now)]
        relations = [
            r
            for r in self._graph.relations
            if r.subject in kept and (r.object in kept or r.object in known)
        ]
        hidden = {*seen.hidden, *(h for h in self._graph.hidden if h in kept)}
        self._graph = SceneGraph(tuple(nodes), (*seen.relations, *relations), None, tuple(hidden))
        return self._graph

    def acted(self, subtask: Subtask, succeeded: bool) -> None:
        """A skill was carried out: states that it may have changed are presumed until told.

        Where things are is not: the next graph says so.

        Args:
            subtask: in the names of the graph.
            succeeded: whether the robot believes that it has done it.
        """
        if self._alters is None:
            return
        doubted: set[tuple[str, str]] = set()
        for name, attribute, before, after in self._alters(self._graph, subtask):
            if attribute not in (LOCATED, *self._domain.containing):
                self._presumed.setdefault(name, {})[attribute] = after if succeeded else before
                doubted.add((name, attribute))
        untold = [
            replace(n, states=tuple(s for s in n.states if (n.id, s[0]) not in doubted))
            for n in self._graph.nodes
        ]
        self._graph = replace(self._graph, nodes=tuple(untold))

    def _with_presumed(self, node: ObjectNode) -> ObjectNode:
        """What a graph tells of a thing ends what was presumed of it."""
        presumed = self._presumed.get(node.id)
        if not presumed:
            return node
        told = {a for a, value in node.states if value is not None} | dict(node.presumed).keys()
        open_still = {a: value for a, value in presumed.items() if a not in told}
        self._presumed[node.id] = open_still
        return replace(node, presumed=(*node.presumed, *open_still.items()))

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
