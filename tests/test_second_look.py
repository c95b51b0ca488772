"""A robot that can goes where it sees more before it looks again, and back before it acts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest

from forestall.assembly.configuration import run_config
from forestall.assembly.make import prepare
from forestall.assembly.parts import Assembly
from forestall.kinds import PERCEIVER
from forestall.runtime import Runtime
from forestall.seams.around import Around
from forestall.tasks.faults import apply_scene_faults
from forestall.testing.symbolic_world import SymbolicWorld
from forestall.types.episode import EpisodeEnd, EpisodeRecord, SkillOutcome
from forestall.types.observation import Observation, Vec3
from forestall.types.plan import Subtask
from forestall.types.runtime import BoundaryContext, LooksAfter, StrategyAnswer
from forestall.types.verdict import Calibration, Decision, Verdict
from robot.bench import SYMBOLIC, TASK

PLACES: tuple[Vec3, ...] = ((0.0, 0.0, 1.5), (1.0, 0.0, 1.5))


class Roving(Around):
    """A world in which the camera can be moved; it keeps what it is told."""

    def __init__(self, inner: SymbolicWorld) -> None:
        super().__init__(inner)
        self.told: list[str] = []

    def vantages(self, point: Vec3) -> Sequence[Vec3]:
        return PLACES

    def look_from(self, place: Vec3, point: Vec3) -> float:
        self.told.append(f"look from {place[0]:g}")
        return 1.0

    def scan(self, thorough: bool = False) -> Observation:
        self.told.append("scan")
        return super().scan(thorough)

    def approach(self, name: str) -> float:
        self.told.append("approach")
        return super().approach(name)

    def execute(self, subtask: Subtask) -> SkillOutcome:
        self.told.append("execute")
        return super().execute(subtask)


class Doubting:
    """Wants another look before each subtask."""

    name = "doubting"
    looks_after = LooksAfter.NOTHING

    def before_subtask(self, context: BoundaryContext) -> StrategyAnswer:
        sure = Verdict(Decision.PROCEED, "doubting", 1.0, 0.9, Calibration.FIXED)
        if not context.may_look:
            return StrategyAnswer(Decision.PROCEED, sure)
        return StrategyAnswer(Decision.LOOK_AGAIN, replace(sure, decision=Decision.LOOK_AGAIN))

    def after_subtask(self, context: BoundaryContext, outcome: SkillOutcome) -> StrategyAnswer:
        return StrategyAnswer(Decision.PROCEED)

    def after_episode(self, context: BoundaryContext) -> StrategyAnswer:
        return StrategyAnswer(Decision.PROCEED)


class Failing(Doubting):
    """Breaks on what it sees then, once so many steps are done."""

    def __init__(self, done: int) -> None:
        self._done = done

    def before_subtask(self, context: BoundaryContext) -> StrategyAnswer:
        if not context.may_look and context.done == self._done:
            raise ZeroDivisionError
        return super().before_subtask(context)


def run(best: int | None, strategy: Doubting | None = None) -> tuple[EpisodeRecord, list[str]]:
    prepared = prepare(run_config(TASK, seed=3, given=SYMBOLIC))
    loaded, domain = prepared.loaded, prepared.loaded.domain
    inner = SymbolicWorld(domain, apply_scene_faults(loaded.task.scene, (), domain))
    perceiver = Assembly(prepared.config.choices, domain, ()).part(PERCEIVER)
    perceiver.best_vantage = lambda eyes, points: best  # type: ignore[attr-defined]
    world = Roving(inner)
    record = Runtime(world, perceiver, strategy or Doubting(), domain).run(
        loaded.task, prepared.plan, 3
    )
    return record, world.told


def test_the_robot_goes_to_look_again_and_back_before_it_acts() -> None:
    record, told = run(1)
    assert record.end is EpisodeEnd.PLAN_FINISHED, record.trouble
    went = [k for k, what in enumerate(told) if what == "look from 1"]
    assert went and "look from 0" not in told
    for k in went:
        assert told[k + 1] == "scan", "it looks from there"
        back = told[k + 2 : told.index("execute", k)]
        assert back in (["approach"], []), "and what is done at a place is done from before it"
    assert any(told[k + 2] == "approach" for k in went)


def test_a_robot_that_is_held_stays_where_it_looked_from() -> None:
    _, whole = run(1)
    looked = [k for k, what in enumerate(whole) if what == "look from 1"]
    back = next(k for k in looked if whole[k + 2] == "approach")
    record, told = run(1, Failing(whole[:back].count("execute")))
    assert record.end is EpisodeEnd.HELD
    assert told == whole[: back + 2], "nothing moves it any more"


def test_where_no_place_is_better_it_stays() -> None:
    record, told = run(None)
    assert record.end is EpisodeEnd.PLAN_FINISHED
    assert "scan" in told and not any(what.startswith("look") for what in told)


@pytest.mark.parametrize("named", [7, -1, "left"])
def test_a_place_that_nobody_offered_holds_the_robot(named: object) -> None:
    record, told = run(named)  # type: ignore[arg-type]
    assert record.end is EpisodeEnd.HELD and "execute" not in told
    assert record.trouble is not None and "place" in record.trouble.text
