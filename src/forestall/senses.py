"""Senses that are dead, told without pictures: a clock that runs back, a scene that never changes.

Owned by the monitor and asked of every observation before it is believed; what pictures show is the
perceiver's own affair, which raises the same error. Calls nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from forestall.errors import ObservationError
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation

_WITHOUT_EFFECT = 2
"""So many skills in a row that should have had an effect and show none are not to be believed."""


@dataclass(slots=True)
class Senses:
    """What was seen last, and what the robot says it has done since something changed.

    Args:
        max_unchanged: subtasks that may be reported as done while a given scene graph stays the
            same; 0: any number. One of them that should have had an effect is what skills do
            unseen; two are not believed.
    """

    max_unchanged: int
    _time_s: float | None = None
    _graph: SceneGraph | None = None
    _done: int = 0
    _effects: int = 0
    _last: Observation | None = None
    _since: int = 0

    def done(self, has_effect: bool) -> None:
        """The robot reports a subtask as done; by the rules it changes something or not."""
        self._done += 1
        self._since += has_effect
        self._effects += has_effect

    def check(self, observation: Observation | SceneGraph) -> None:
        """See whether this can be what the robot sees now.

        Raises:
            ObservationError: it cannot; says why.
        """
        graph: SceneGraph | None
        if isinstance(observation, SceneGraph):
            graph = observation
        else:
            self._check_clock(observation.time_s)
            if not observation.frames and (
                observation.graph is None or not observation.graph.nodes
            ):
                raise ObservationError("nothing at all is seen: neither a picture nor a thing")
            if self._since and self._last is not None and _the_same(self._last, observation):
                raise ObservationError(
                    "this is the very observation from before a subtask that is reported as done: "
                    "look anew after each"
                )
            self._last, self._since = observation, 0
            graph = observation.graph
        if graph is None:
            return
        seen = _timeless(graph)
        if seen != self._graph:
            self._graph, self._done, self._effects = seen, 0, 0
        elif 0 < self.max_unchanged <= self._done and self._effects >= min(
            _WITHOUT_EFFECT, self.max_unchanged
        ):
            raise ObservationError(
                f"nothing that is seen has changed over {self._done} subtasks reported as "
                "done: the senses, or the reports, are not to be trusted"
            )

    def _check_clock(self, time_s: float) -> None:
        if self._time_s is not None and not time_s >= self._time_s:
            raise ObservationError(f"time runs back: {time_s:g} s after {self._time_s:g} s")
        self._time_s = time_s


def _the_same(one: Observation, other: Observation) -> bool:
    """Whether both are one look: of one time, with the same pictures to the last bit."""
    if one.time_s != other.time_s or not 0 < len(one.frames) == len(other.frames):
        return False
    pairs = list(zip(one.frames, other.frames, strict=True))
    return all(
        a is b or (np.array_equal(a.rgb, b.rgb) and np.array_equal(a.depth_m, b.depth_m))
        for a, b in pairs
    )


def _timeless(graph: SceneGraph) -> SceneGraph:
    nodes = tuple(replace(n, last_seen_s=0.0) for n in graph.nodes)
    return SceneGraph(nodes, graph.relations, None, graph.hidden)
