"""Strategies in development kitchens in which everything that is not shut in is seen as it is.

    python tests/all_seen.py irreversible robofail

What is lost here is lost by judging and planning, and not by perception: the truth is handed on as
the scene graph of every look, without what is shut in and without what no camera sees. A set takes
a minute or two.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any
from unittest.mock import patch

from forestall.assembly.configuration import Given, run_config
from forestall.assembly.make import prepare, run_episode
from forestall.domain.load import shipped
from forestall.domain.truth import is_shut
from forestall.statistics.cases import SPLITS, Case, cases, room
from forestall.tasks.files import load_scenario
from forestall.types.episode import EpisodeRecord
from forestall.types.facts import Truth
from forestall.types.graph import SceneGraph, Seen
from forestall.types.observation import Observation
from forestall.worlds.kitchen.environment import KitchenEnvironment

DOMAIN = shipped("household")
GIVEN = {"strategy": "plan-check", "perceiver": "given-graph", "world.profile": "kind"}


def open_to_view(graph: SceneGraph) -> SceneGraph:
    """What a camera that misses nothing would tell."""
    shut = {
        n.id
        for n in graph.nodes
        if DOMAIN.encloses(n.category) and is_shut(DOMAIN, n.category, dict(n.states)) is Truth.TRUE
    }
    inside, pending = set[str](), shut
    while pending:
        within = {r.subject for r in graph.relations if r.object in pending}
        pending = {n for n in within if graph.parents(n, DOMAIN.containing)} - inside
        inside |= pending
    nodes = [
        replace(
            n,
            states=tuple((a, v if DOMAIN.attributes[a].camera else None) for a, v in n.states),
            seen=Seen.VISIBLE,
        )
        for n in graph.nodes
        if n.id not in inside
    ]
    relations = [r for r in graph.relations if not {r.subject, r.object} & inside]
    return SceneGraph(tuple(nodes), tuple(relations), None, tuple(shut))


@contextmanager
def everything_seen() -> Iterator[None]:
    """Every look of the kitchen is the truth, as far as it is open to view."""

    def look(self: Any, *_: Any, **__: Any) -> Observation:
        household = self._acting.household
        return Observation(
            (),
            self._gripper(),
            household.time_s,
            robot_position_world_m=self._stage.robot_position_world_m,
            graph=open_to_view(household.truth()),
        )

    with patch.multiple(KitchenEnvironment, scan=look, observe=look):
        yield


def run(scenario: str, place: int) -> EpisodeRecord:
    """A run with the plan check in one of the development rooms."""
    task, seed = load_scenario(scenario).task, room(SPLITS["development"], place)
    return _run(Case("", task, scenario, seed))


def _run(case: Case) -> EpisodeRecord:
    config = run_config(case.task, case.scenario, seed=case.seed, given=Given.named(GIVEN))
    with everything_seen():
        return run_episode(prepare(config), ())


def main(sets: list[str]) -> None:
    """Run sets of the development split; names what does not succeed."""
    for name in sets:
        records = [(case, _run(case)) for case in cases(name, "development")]
        for case, record in records:
            if not record.success:
                sys.stdout.write(f"{case.task} {case.scenario} {case.seed}: {record.end.value}\n")
        saved = sum(bool(r.success) for _, r in records)
        sys.stdout.write(f"{name}: {saved} of {len(records)}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
