"""Each way in which a household differs from its domain file, and how it is drawn."""

from dataclasses import replace

import pytest
from small_kitchen import SmallKitchen

from forestall.types.episode import SkillStatus
from forestall.worlds.kitchen.environment import KitchenEnvironment
from forestall.worlds.kitchen.imperfection import PERFECT, Rates
from forestall.worlds.kitchen.law import LAW_EVENT, WAYS, Law, Way, draw_law
from forestall.worlds.kitchen.part import Kitchens, LawOption, Profile
from forestall.worlds.kitchen.streams import Streams

BY_NAME = {w.name: w for w in WAYS}
BURNERS = tuple(f"StoveBurner-{k}" for k in (1, 2, 3, 4))
DEVICES = ("Fridge-1", "Microwave-1", "CoffeeMachine-1", "Faucet-1", "Cabinet-1", "Toaster-1")
NAMES = ("Mug-1", "Pot-1", *DEVICES, *BURNERS)


def differing(way: str, *things: str, of: str = "", number: float | None = None) -> SmallKitchen:
    """A kitchen that differs in one way, in a thing of one category where several can."""
    chosen = replace(BY_NAME[way], probability=1.0)
    if of:
        chosen = replace(chosen, of=(of,))
    if number is not None:
        chosen = replace(chosen, number=number)
    kitchen = SmallKitchen(*things, ways=(chosen,))
    assert len(kitchen.told(LAW_EVENT)) == 1
    return kitchen


def test_a_slow_device_heats_after_a_while() -> None:
    things = ("Potato-1@Microwave-1", "Mug-1@CounterTop-1")
    kitchen = differing("slow", *things, of="Microwave", number=8.0)
    kitchen.do("toggle_on(Microwave)")
    assert kitchen.state("Potato-1", "temperature") == "room"
    assert kitchen.state("Potato-1", "cooked") == "raw"
    kitchen.do("pick_up(Mug)", "put_on(Mug, DiningTable)")
    assert kitchen.state("Potato-1", "temperature") == "hot"
    assert kitchen.state("Potato-1", "cooked") == "cooked"


def test_a_slow_device_that_is_turned_off_begins_again() -> None:
    kitchen = differing("slow", "Potato-1@Microwave-1", of="Microwave", number=20.0)
    kitchen.do("toggle_on(Microwave)", "navigate_to_obj(Fridge)")
    kitchen.do("toggle_off(Microwave)", "navigate_to_obj(Television)", "toggle_on(Microwave)")
    assert kitchen.env.time_s > 40.0
    assert kitchen.state("Potato-1", "temperature") == "room"


def test_a_stubborn_switch_takes_the_second_press_each_time() -> None:
    kitchen = differing("stubborn", of="CoffeeMachine")
    states = []
    for step in ("toggle_on(CoffeeMachine)",) * 2 + ("toggle_off(CoffeeMachine)",):
        kitchen.do(step)
        states.append(kitchen.state("CoffeeMachine-1", "toggled"))
    kitchen.do("toggle_on(CoffeeMachine)")
    states.append(kitchen.state("CoffeeMachine-1", "toggled"))
    assert states == ["off", "on", "off", "off"]


def test_crossed_knobs_turn_each_other_s_burner() -> None:
    kitchen = differing("crossed", "Pot-1@StoveBurner-2")
    kitchen.do("toggle_on(StoveBurner-1)")
    assert kitchen.state("StoveBurner-1", "toggled") == "off"
    assert kitchen.state("StoveBurner-2", "toggled") == "on"
    assert kitchen.state("Pot-1", "temperature") == "hot"
    kitchen.do("toggle_on(StoveKnob-2)")
    assert kitchen.state("StoveBurner-1", "toggled") == "on"
    kitchen.do("toggle_off(StoveBurner-1)")
    assert kitchen.state("StoveBurner-2", "toggled") == "off"


def test_a_door_falls_shut_some_skills_after_it_was_opened() -> None:
    kitchen = differing("falls shut", "Mug-1@CounterTop-1", of="Fridge", number=2.0)
    kitchen.do("open_obj(Fridge)", "pick_up(Mug)")
    assert kitchen.state("Fridge-1", "open") == "open"
    kitchen.do("navigate_to_obj(Fridge)")
    assert kitchen.state("Fridge-1", "open") == "closed"
    assert "closed" in kitchen.tried("put_in(Mug, Fridge)").reason
    kitchen.do("open_obj(Fridge)", "put_in(Mug, Fridge)")


def test_a_mug_that_is_too_tall_stays_in_the_hand() -> None:
    kitchen = differing("misfit", "Mug-1@CounterTop-1")
    kitchen.do("pick_up(Mug)")
    outcome = kitchen.tried("put_in(Mug, CoffeeMachine)")
    assert outcome.status is SkillStatus.FAILED
    assert kitchen.held == "Mug-1"
    kitchen.do("put_in(Mug, Sink)")


def test_a_pot_with_a_lid_is_full_after_the_second_run_of_water() -> None:
    kitchen = differing("lid", "Pot-1@Sink-1", "Mug-1@CounterTop-1")
    kitchen.do("toggle_on(Faucet)", "pick_up(Mug)", "toggle_off(Faucet)")
    assert kitchen.state("Pot-1", "filled") == "empty"
    kitchen.do("toggle_on(Faucet)")
    assert kitchen.state("Pot-1", "filled") == "water"


def test_what_was_under_water_slips_more_often() -> None:
    way = replace(BY_NAME["slippery when wet"], probability=1.0, number=6.0)
    slipped = {}
    for wet in (False, True):
        slipped[wet] = 0
        for seed in range(60):
            rates = replace(PERFECT, slip=0.1)
            kitchen = SmallKitchen("Mug-1@Sink-1", rates=rates, ways=(way,), seed=seed)
            washing = ("toggle_on(Faucet)", "toggle_off(Faucet)") if wet else ()
            kitchen.do(*washing, "pick_up(Mug)", "navigate_to_obj(Television)")
            slipped[wet] += kitchen.held is None
    assert slipped[False] < 15
    assert slipped[True] > 25


def test_a_fridge_that_must_be_pulled_twice_says_so_once() -> None:
    kitchen = differing("pull twice")
    assert kitchen.tried("open_obj(Fridge)").status is SkillStatus.FAILED
    assert kitchen.state("Fridge-1", "open") == "closed"
    kitchen.do("open_obj(Fridge)")
    assert kitchen.state("Fridge-1", "open") == "open"


def test_the_law_is_the_seed_s_and_the_same_each_time() -> None:
    drawn = [str(draw_law(Streams(s), NAMES).deviations) for s in range(40)]
    assert drawn == [str(draw_law(Streams(s), NAMES).deviations) for s in range(40)]
    assert len(set(drawn)) > 20


@pytest.mark.parametrize("way", WAYS, ids=lambda w: w.name)
def test_a_way_is_drawn_as_often_as_it_says(way: Way) -> None:
    runs = 600
    laws = [draw_law(Streams(s), NAMES) for s in range(runs)]
    share = sum(any(d.way == way for d in law.deviations) for law in laws) / runs
    assert abs(share - way.probability) < 4 * (way.probability / runs) ** 0.5


@pytest.mark.parametrize("way", WAYS, ids=lambda w: w.name)
def test_what_is_drawn_is_there_and_said(way: Way) -> None:
    law = draw_law(Streams(1), NAMES, (replace(way, probability=1.0),))
    (drawn,) = law.deviations
    assert {drawn.thing, drawn.other or "Mug-1"} <= set(NAMES)
    assert drawn.thing != drawn.other
    assert drawn.thing in str(drawn)
    assert "{" not in str(drawn)
    assert draw_law(Streams(1), ("Floor-1",), (replace(way, probability=1.0),)).deviations == ()


def test_the_things_are_not_always_the_same() -> None:
    way = replace(BY_NAME["crossed"], probability=1.0)
    pairs = {draw_law(Streams(s), NAMES, (way,)).deviations[0].thing for s in range(30)}
    assert len(pairs) == 4


def test_a_scene_that_lacks_a_thing_changes_no_other_draw() -> None:
    for seed in range(20):
        most = {d.way.name for d in draw_law(Streams(seed), NAMES).deviations}
        few = {d.way.name for d in draw_law(Streams(seed), NAMES[1:]).deviations}
        assert most - few <= {"misfit"}
        assert few <= most


def test_without_deviations_the_law_is_the_catalogue_s() -> None:
    law = Law()
    assert law.wired("StoveBurner-1") == "StoveBurner-1"
    assert law.turns("Microwave-1", "on")
    assert law.opens("Fridge-1")
    assert law.fits("Mug-1", "CoffeeMachine-1")
    assert law.fills("Pot-1", "Faucet-1")
    assert law.heats("Pot-1", "StoveBurner-1", 0.0)
    assert law.slips("Mug-1") == 1.0
    assert law.falling_shut(lambda *_: "open") == []


def test_each_run_of_a_scene_begins_with_the_same_law() -> None:
    kitchen = differing("stubborn", of="CoffeeMachine")
    kitchen.do("toggle_on(CoffeeMachine)")
    kitchen.env.reset(0)
    kitchen.do("toggle_on(CoffeeMachine)")
    assert kitchen.state("CoffeeMachine-1", "toggled") == "off"


@pytest.mark.parametrize(
    ("profile", "law", "drawn"),
    [
        (Profile.KIND, LawOption.PROFILE, False),
        (Profile.KIND, LawOption.DRAWN, True),
        (Profile.HONEST, LawOption.PROFILE, True),
        (Profile.HONEST, LawOption.KNOWN, False),
    ],
)
def test_profile_and_law_are_options_of_the_world(
    profile: Profile, law: LawOption, drawn: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: dict[str, object] = {}

    def environment(*args: object, **options: object) -> KitchenEnvironment:
        made.update(options)
        return KitchenEnvironment(*args)  # type: ignore[arg-type]

    monkeypatch.setattr("forestall.worlds.kitchen.environment.KitchenEnvironment", environment)
    from forestall.domain.load import shipped
    from forestall.types.scene import SceneNeeds

    with Kitchens(profile=profile, law=law).open(SceneNeeds(), shipped("household")):
        pass
    assert made["ways"] == (WAYS if drawn else ())
    assert made["rates"] == (Rates() if profile is Profile.HONEST else None)
