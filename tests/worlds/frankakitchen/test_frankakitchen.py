"""FrankaKitchen as a world: what its skills move, the conformance suite, from alarm to success.

On a stand-in with the real joints and places, and on the real assets where they are installed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from standin import write

from forestall.assembly.configuration import run_config
from forestall.assembly.make import prepare, run_episode
from forestall.domain.load import shipped
from forestall.errors import InputError, SceneError
from forestall.testing.conformance import check_environment
from forestall.testing.levels import Level
from forestall.types.episode import SkillStatus
from forestall.types.plan import Plan, Subtask
from forestall.types.scene import SceneNeeds
from forestall.worlds.frankakitchen.assets import model_file
from forestall.worlds.frankakitchen.fixtures import FIXTURES, SKILLS
from forestall.worlds.frankakitchen.part import FrankaKitchens
from forestall.worlds.frankakitchen.world import FrankaKitchen

HERE = Path(__file__).parent
DOMAIN = shipped("frankakitchen")
SHORT = Plan.parse(["swing_open(Microwave)", "turn_on(BurnerKnob-2)", "turn_off(BurnerKnob-2)"])


@pytest.fixture(scope="module", params=["stand-in", "real"])
def assets(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> str:
    if request.param == "stand-in":
        return str(write(tmp_path_factory.mktemp("assets")))
    try:
        return str(model_file().parent.parent)
    except InputError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def kitchen(assets: str) -> FrankaKitchen:
    return FrankaKitchen(model_file(assets), SceneNeeds())


def test_every_skill_moves_its_fixture_and_nothing_else(kitchen: FrankaKitchen) -> None:
    kitchen.reset(0)
    for fixture in FIXTURES:
        category = fixture.name.split("-")[0]
        for skill in (s for s, (_, _, kinds) in SKILLS.items() if category in kinds):
            before = {f.name: dict(kitchen.states(f.name)) for f in FIXTURES}
            outcome = kitchen.execute(Subtask(skill, (fixture.name,)))
            assert outcome.status is SkillStatus.SUCCEEDED, (skill, fixture.name, outcome.reason)
            assert outcome.duration_s > 2
            attribute, value, _ = SKILLS[skill]
            before[fixture.name][attribute] = value
            assert {f.name: dict(kitchen.states(f.name)) for f in FIXTURES} == before


def test_it_conforms_within_a_tolerance(assets: str) -> None:
    file = model_file(assets)
    complaints = check_environment(
        lambda: FrankaKitchen(file, SceneNeeds()), 3, SHORT.subtasks, DOMAIN, Level.TOLERANCE
    )
    assert complaints == []


@pytest.mark.parametrize(
    ("step", "why"),
    [
        ("swing_shut(Microwave-1)", "Microwave-1 is closed already"),
        ("slide_open(Microwave-1)", "nothing that slide_open moves"),
        ("turn_on(BurnerKnob-9)", "BurnerKnob-9 is nothing that turn_on moves"),
        ("pick_up(Kettle-1)", "there is no skill pick_up(Kettle-1) here"),
    ],
)
def test_a_refusal_says_why_and_moves_nothing(kitchen: FrankaKitchen, step: str, why: str) -> None:
    kitchen.reset(0)
    outcome = kitchen.execute(Subtask.parse(step))
    assert outcome.status is SkillStatus.REFUSED and why in outcome.reason
    assert kitchen.time_s == 0.0 and kitchen.events() == ()


def test_a_door_that_jams_is_a_failure_and_no_success(tmp_path: Path) -> None:
    kitchen = FrankaKitchen(model_file(str(write(tmp_path, stuck=True))), SceneNeeds())
    outcome = kitchen.execute(Subtask.parse("swing_open(Microwave)"))
    assert outcome.status is SkillStatus.FAILED
    assert "Microwave-1 did not come to open: its joint stands at" in outcome.reason


def test_somebody_else_may_move_things(kitchen: FrankaKitchen) -> None:
    kitchen.reset(0)
    assert kitchen.alter("SlideCabinet", "open", "open")
    assert not kitchen.alter("SlideCabinet", "open", "open")
    assert not kitchen.alter("Kettle", "open", "open")
    assert kitchen.states("SlideCabinet-1") == {"open": "open"}
    assert kitchen.drop_held() is None and not kitchen.rearrange("Kettle", "Microwave")


@pytest.mark.parametrize("needs", [
    SceneNeeds(fixtures=(("Fridge", "open", "open"),)),
    SceneNeeds(fixtures=(("Microwave", "open", "ajar"),)),
])  # fmt: skip
def test_what_is_not_there_cannot_be_needed(assets: str, needs: SceneNeeds) -> None:
    with pytest.raises(SceneError, match=r"Fridge|open=ajar"):
        FrankaKitchen(model_file(assets), needs)


def test_assets_that_are_not_there_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no kitchen_assets/kitchen_env_model\.xml in it"):
        model_file(str(tmp_path))
    (found,) = FrankaKitchens(str(tmp_path)).check()
    assert not found.works and "pip install --no-deps" in found.hint


def run(assets: str, scenario: str | None, strategy: str) -> Any:
    prepared = prepare(
        run_config(
            str(HERE / "light-and-cabinet.toml"),
            None if scenario is None else str(HERE / scenario),
            world={"name": "frankakitchen", "assets": assets},
            strategy=strategy,
        )
    )
    return run_episode(prepared, None)


def test_from_alarm_to_success(assets: str) -> None:
    record = run(assets, "microwave-left-open.toml", "plan-check")
    assert record.success, record.failures
    alarmed = [b.index for b in record.boundaries if b.replan is not None]
    assert alarmed and alarmed[0] <= 1, "before anything was done"
    done = [str(e.subtask) for e in record.executed]
    assert "swing_shut(Microwave-1)" in done
    assert all(e.outcome.status is SkillStatus.SUCCEEDED for e in record.executed)
    assert run(assets, "microwave-left-open.toml", "none").success is False


def test_an_undisturbed_run_raises_no_alarm(assets: str) -> None:
    record = run(assets, None, "plan-check")
    assert record.success and all(b.replan is None for b in record.boundaries)
