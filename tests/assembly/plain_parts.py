"""Parts of somebody else: a world without geometry, and perception that is always right."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

from forestall.domain.model import Domain
from forestall.perception.config import ScopeConfig
from forestall.perception.scope import scope
from forestall.seams import OracleView, Parts
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation
from forestall.types.plan import Subtask
from forestall.types.scene import SceneNeeds
from forestall.types.world import Working
from forestall.worlds.kitchen.flat_world import flat_environment
from forestall.worlds.kitchen.part import OpenKitchen


class FlatWorlds:
    """A world part; counts the worlds that it opened."""

    name = "flat"

    def __init__(self, gravity: float = 9.81) -> None:
        self.gravity = gravity
        self.opened: list[bool] = []

    @contextmanager
    def open(
        self, needs: SceneNeeds, domain: Domain, remember: bool = False
    ) -> Iterator[OpenKitchen]:
        self.opened.append(remember)
        yield OpenKitchen(flat_environment(needs, domain))

    def check(self) -> Sequence[Working]:
        return ()


class TruthPerceiver:
    """A perceiver that borrows the truth."""

    def __init__(self, parts: Parts) -> None:
        self._oracle: OracleView = parts.lent("truth")
        self._domain = parts.domain

    def reset(self) -> None:
        pass

    def perceive(self, observation: Observation) -> SceneGraph:
        return self._oracle.truth()

    def scope(self, graph: SceneGraph, subtask: Subtask) -> SceneGraph:
        return scope(graph, subtask, self._domain, ScopeConfig())

    def describe(self) -> Mapping[str, str]:
        return {"segmenter": "truth", "state_estimator": "truth"}
