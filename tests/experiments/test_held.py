"""Episodes that are held or broken are rows like others, and are counted."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from forestall.assembly.configuration import Given
from forestall.domain.model import Domain
from forestall.experiments.runs import Run
from forestall.experiments.settings import Settings
from forestall.experiments.worker import Work, config_of, run_one
from forestall.kinds import LIMIT
from forestall.statistics.cases import Case
from forestall.statistics.outcomes import outcome_metrics
from forestall.statistics.rows import EpisodeRow
from forestall.testing.misbehaving import Fault, Instead, gives, raises
from forestall.testing.part import OpenSymbolicWorld, SymbolicWorlds
from forestall.testing.symbolic_world import SymbolicWorld
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.observation import Observation
from forestall.types.scene import SceneNeeds

RUN = Run(Case("undisturbed", "glue-peg", None, 3), "none")


class Faulty(SymbolicWorlds):
    """A symbolic world in which something is wrong."""

    call = "observe"
    instead: Instead = staticmethod(raises(RuntimeError("no picture")))

    @contextmanager
    def open(
        self, needs: SceneNeeds, domain: Domain, remember: bool = False
    ) -> Iterator[OpenSymbolicWorld]:
        world = SymbolicWorld(domain, needs)
        yield OpenSymbolicWorld(Fault(self.call, self.instead, 2).around(world))


def _sleeps(call: object, *args: object, **named: object) -> Observation:
    import time

    time.sleep(2.0)
    raise AssertionError("nobody waits for this")


class Sleeping(Faulty):
    """Its camera sleeps."""

    instead = staticmethod(_sleeps)


class Unopened(Faulty):
    """There is no scene to begin with."""

    @contextmanager
    def open(
        self, needs: SceneNeeds, domain: Domain, remember: bool = False
    ) -> Iterator[OpenSymbolicWorld]:
        raise ZeroDivisionError("no scene")
        yield


class Refusing(Faulty):
    """It refuses everything."""

    call = "execute"
    instead = staticmethod(gives(SkillOutcome(SkillStatus.REFUSED, 0.0, "no")))


def row_of(world: str, *options: str) -> EpisodeRow:
    said = Given.said([f"world.name=experiments.test_held:{world}", *options])
    settings = Settings(given=said.over(Given.named({"perceiver": "given-graph"})))
    return EpisodeRow.from_json(run_one(Work(RUN, settings)))


def test_a_world_that_breaks_is_a_broken_episode() -> None:
    row = row_of("Faulty")
    assert (row.end, row.error, row.success) == (
        "error",
        "observe: RuntimeError: no picture",
        False,
    )
    metrics = outcome_metrics([row])
    assert metrics["errors"].count == 1 and metrics["held"].count == 0


def test_what_breaks_before_a_run_is_a_row_that_says_where() -> None:
    row = row_of("Unopened")
    assert row.end == "error"
    assert re.fullmatch(r"ZeroDivisionError: no scene \(test_held\.py, line \d+\)", row.error), (
        row.error
    )


def test_a_world_that_sleeps_is_a_held_episode() -> None:
    row = row_of("Sleeping", "limit.observe_s=0.1")
    assert (row.end, row.error) == ("held", "observe did not answer within 0.1 s")
    assert (row.executed, len(row.judged)) == (2, 2)
    metrics = outcome_metrics([row])
    assert metrics["held"].count == 1 and metrics["errors"].count == 0


def test_an_experiment_goes_on_and_counts_what_was_refused_and_not_judged() -> None:
    row = row_of("Refusing")
    assert (row.end, row.refused, row.not_judged) == ("plan finished", 4, 6)
    assert outcome_metrics([row])["not_judged"].value == pytest.approx(6.0)


def test_limits_that_somebody_gives_hold_in_experiments_too() -> None:
    limits = config_of(RUN, Settings()).choice(LIMIT).options
    assert limits["max_alarms_in_a_row"] == limits["max_unchanged"] == 0
    row = row_of("Refusing", "limit.max_failures_in_a_row=2")
    assert (row.end, row.error) == (
        "held",
        "3 subtasks refused or failed in a row, and 2 are the most",
    )
