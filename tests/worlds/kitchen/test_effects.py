"""What happens by itself, and what cannot be undone."""

import pytest
from small_kitchen import SmallKitchen

from forestall.errors import SceneError

# what devices do


@pytest.mark.parametrize("vessel", ["Mug-1", "Cup-1", "Bowl-1", "Pot-1", "Kettle-1"])
def test_a_running_faucet_fills_what_is_empty_in_its_sink(vessel: str) -> None:
    kitchen = SmallKitchen(f"{vessel}@Sink-1 temperature=hot", "Faucet-1 toggled=on")
    assert kitchen.state(vessel, "filled") == "water"
    assert kitchen.state(vessel, "temperature") == "room"


def test_a_running_faucet_leaves_what_is_filled_and_what_stands_elsewhere() -> None:
    kitchen = SmallKitchen("Mug-1@Sink-1 filled=wine", "Mug-2@CounterTop-1")
    kitchen.do("toggle_on(Faucet)")
    assert kitchen.state("Mug-1", "filled") == "wine"
    assert kitchen.state("Mug-2", "filled") == "empty"


@pytest.mark.parametrize("thing", ["Mug-1", "Cup-1", "Bowl-1", "Plate-1", "Pan-1", "Pot-1"])
def test_a_running_faucet_cleans_what_is_dirty(thing: str) -> None:
    kitchen = SmallKitchen(f"{thing}@Sink-1 dirty=dirty")
    assert kitchen.state(thing, "dirty") == "dirty"
    kitchen.do("toggle_on(Faucet)")
    assert kitchen.state(thing, "dirty") == "clean"
    assert not kitchen.spoiled


def test_what_is_put_under_a_running_faucet_is_filled() -> None:
    kitchen = SmallKitchen("Mug-1@CounterTop-1", "Faucet-1 toggled=on")
    kitchen.do("pick_up(Mug)", "put_in(Mug, Sink)")
    assert kitchen.state("Mug-1", "filled") == "water"


def test_a_coffee_machine_fills_an_empty_clean_mug_with_hot_coffee() -> None:
    kitchen = SmallKitchen("Mug-1@CoffeeMachine-1")
    assert kitchen.state("Mug-1", "filled") == "empty"
    kitchen.do("toggle_on(CoffeeMachine)")
    assert kitchen.state("Mug-1", "filled") == "coffee"
    assert kitchen.state("Mug-1", "temperature") == "hot"
    assert not kitchen.spoiled


def test_a_burner_heats_what_stands_on_it_and_cooks_what_is_in_that() -> None:
    kitchen = SmallKitchen("Pan-1@StoveBurner-1", "Potato-1@Pan-1", "Tomato-1@CounterTop-1")
    kitchen.do("toggle_on(StoveKnob-1)")
    assert kitchen.state("Pan-1", "temperature") == "hot"
    assert kitchen.state("Potato-1", "cooked") == "cooked"
    assert kitchen.state("Potato-1", "temperature") == "hot"
    assert kitchen.state("Tomato-1", "temperature") == "room"
    assert not kitchen.spoiled


def test_a_burner_works_on_what_comes_later() -> None:
    kitchen = SmallKitchen("Pan-1@StoveBurner-1", "Egg-1@CounterTop-1")
    kitchen.do("toggle_on(StoveBurner-1)", "pick_up(Egg)", "navigate_to_obj(Pan)", "crack_obj(Egg)")
    assert kitchen.state("EggCracked-1", "cooked") == "cooked"


def test_a_microwave_heats_and_cooks_what_is_in_it_at_any_depth() -> None:
    kitchen = SmallKitchen("Plate-1@Microwave-1", "Potato-1@Plate-1")
    kitchen.do("toggle_on(Microwave)")
    assert kitchen.state("Plate-1", "temperature") == "hot"
    assert kitchen.state("Potato-1", "cooked") == "cooked"


def test_a_microwave_warms_bread_and_does_not_toast_it() -> None:
    kitchen = SmallKitchen("Plate-1@Microwave-1", "BreadSliced-1@Plate-1")
    kitchen.do("toggle_on(Microwave)")
    assert kitchen.state("BreadSliced-1", "temperature") == "hot"
    assert kitchen.state("BreadSliced-1", "cooked") == "raw"


def test_a_toaster_toasts_a_slice() -> None:
    kitchen = SmallKitchen("BreadSliced-1@Toaster-1")
    kitchen.do("toggle_on(Toaster)")
    assert kitchen.state("BreadSliced-1", "cooked") == "cooked"


def test_a_fridge_cools_while_it_is_closed() -> None:
    kitchen = SmallKitchen("Bowl-1@Fridge-1", "Egg-1@Bowl-1", "Fridge-1 open=open")
    assert kitchen.state("Egg-1", "temperature") == "room"
    kitchen.do("close_obj(Fridge)")
    assert kitchen.state("Bowl-1", "temperature") == "cold"
    assert kitchen.state("Egg-1", "temperature") == "cold"


def test_hot_things_cool_after_their_time_off_heat_and_not_before() -> None:
    kitchen = SmallKitchen("Mug-1@Microwave-1 filled=water", cool_down_s=20.0)
    kitchen.do("toggle_on(Microwave)")
    for _ in range(3):
        kitchen.env.scan()
    kitchen.do("navigate_to_obj(Microwave)")
    for _ in range(3):
        kitchen.env.scan()  # the microwave is on all the while
    kitchen.do("toggle_off(Microwave)")
    left_s = kitchen.env.time_s
    kitchen.do("open_obj(Microwave)", "pick_up(Mug)")
    assert kitchen.state("Mug-1", "temperature") == "hot"
    while kitchen.env.time_s - left_s < 25.0:
        kitchen.env.scan()
    kitchen.do("navigate_to_obj(Microwave)")
    assert kitchen.state("Mug-1", "temperature") == "room"


def test_effects_reach_a_fixpoint_at_once() -> None:
    kitchen = SmallKitchen("Mug-1@CoffeeMachine-1", "CoffeeMachine-1 toggled=on")
    events = len(kitchen.env.oracle.events())
    kitchen.do("navigate_to_obj(CoffeeMachine)")
    assert len(kitchen.env.oracle.events()) == events


# what cannot be undone


def test_an_egg_fried_in_a_dirty_pan_is_spoiled_though_the_pan_is_washed_later() -> None:
    kitchen = SmallKitchen("Pan-1@StoveBurner-1 dirty=dirty", "Egg-1@Pan-1")
    kitchen.do("crack_obj(Egg)")
    assert kitchen.spoiled == set()
    kitchen.do("toggle_on(StoveBurner-1)")
    assert kitchen.spoiled == {"EggCracked-1"}
    kitchen.do("pick_up(Pan)", "put_in(Pan, Sink)", "toggle_on(Faucet)")
    assert kitchen.state("Pan-1", "dirty") == "clean"
    assert kitchen.spoiled == {"EggCracked-1"}


def test_a_dirty_dish_counts_at_any_depth() -> None:
    kitchen = SmallKitchen("Plate-1@Microwave-1 dirty=dirty", "Potato-1@Plate-1")
    kitchen.do("toggle_on(Microwave)")
    assert kitchen.spoiled == {"Potato-1"}


def test_foods_of_two_kinds_cooked_in_one_pan_spoil_each_other() -> None:
    kitchen = SmallKitchen("Pan-1@StoveBurner-1", "Potato-1@Pan-1", "Egg-1@Pan-1")
    kitchen.do("crack_obj(Egg)", "toggle_on(StoveBurner-1)")
    assert kitchen.spoiled == {"EggCracked-1", "Potato-1"}


def test_food_that_was_cooked_before_counts_as_company() -> None:
    kitchen = SmallKitchen(
        "Pan-1@StoveBurner-1", "Potato-1@Pan-1", "Egg-1@CounterTop-1", "StoveBurner-1 toggled=on"
    )
    assert kitchen.spoiled == set()
    kitchen.do("pick_up(Egg)", "navigate_to_obj(Pan)", "crack_obj(Egg)")
    assert kitchen.spoiled == {"EggCracked-1", "Potato-1"}


def test_slices_of_one_kind_may_be_cooked_together() -> None:
    kitchen = SmallKitchen("Pan-1@StoveBurner-1", "PotatoSliced-1@Pan-1", "PotatoSliced-2@Pan-1")
    kitchen.do("toggle_on(StoveBurner-1)")
    assert kitchen.state("PotatoSliced-2", "cooked") == "cooked"
    assert kitchen.spoiled == set()


def test_food_put_into_wine_is_spoiled_with_its_bowl() -> None:
    kitchen = SmallKitchen("Bowl-1@CounterTop-1 filled=wine", "LettuceSliced-1@CounterTop-1")
    kitchen.do("pick_up(LettuceSliced)", "put_in(LettuceSliced, Bowl)")
    assert kitchen.spoiled == {"Bowl-1", "LettuceSliced-1"}


def test_food_put_into_water_is_spoiled_without_its_bowl() -> None:
    kitchen = SmallKitchen("Bowl-1@CounterTop-1 filled=water", "LettuceSliced-1@CounterTop-1")
    kitchen.do("pick_up(LettuceSliced)", "put_in(LettuceSliced, Bowl)")
    assert kitchen.spoiled == {"LettuceSliced-1"}


@pytest.mark.parametrize(
    "ready", ["TomatoSliced-1@CounterTop-1", "Potato-1@CounterTop-1 cooked=cooked"]
)
@pytest.mark.parametrize("dish", ["Bowl", "Plate"])
def test_food_that_is_ready_to_eat_is_spoiled_by_a_dirty_dish(ready: str, dish: str) -> None:
    kitchen = SmallKitchen(f"{dish}-1@CounterTop-1 dirty=dirty", ready)
    food = ready.partition("@")[0]
    kitchen.do(f"pick_up({food})", f"put_in({food}, {dish})")
    assert kitchen.spoiled == {food}


def test_raw_whole_food_is_not_spoiled_by_a_dirty_dish_until_it_is_cooked() -> None:
    kitchen = SmallKitchen("Plate-1@CounterTop-1 dirty=dirty", "Potato-1@CounterTop-1")
    kitchen.do("pick_up(Potato)", "put_on(Potato, Plate)")
    assert kitchen.spoiled == set()


def test_food_sliced_on_a_dirty_plate_is_spoiled() -> None:
    kitchen = SmallKitchen(
        "Plate-1@CounterTop-1 dirty=dirty", "Potato-1@Plate-1", "Knife-1@CounterTop-1"
    )
    kitchen.do("pick_up(Knife)", "slice_obj(Potato)")
    assert kitchen.spoiled == {"PotatoSliced-1", "PotatoSliced-2", "PotatoSliced-3"}


def test_slices_of_spoiled_food_are_spoiled() -> None:
    kitchen = SmallKitchen(
        "Plate-1@Microwave-1 dirty=dirty", "Potato-1@Plate-1", "Knife-1@CounterTop-1"
    )
    kitchen.do("toggle_on(Microwave)", "toggle_off(Microwave)", "open_obj(Microwave)",
               "pick_up(Knife)", "slice_obj(Potato)")  # fmt: skip
    assert {"Potato-1", "PotatoSliced-1"} <= kitchen.spoiled


@pytest.mark.parametrize(
    "mug", ["Mug-1@CoffeeMachine-1 dirty=dirty", "Mug-1@CoffeeMachine-1 filled=water"]
)
def test_coffee_brewed_into_a_dirty_mug_or_into_water_is_spoiled(mug: str) -> None:
    kitchen = SmallKitchen(mug)
    assert kitchen.spoiled == set()
    kitchen.do("toggle_on(CoffeeMachine)")
    assert kitchen.spoiled == {"Mug-1"}
    assert "spoiled" in kitchen.kinds()


def test_coffee_into_water_leaves_water_and_into_a_dirty_mug_leaves_coffee() -> None:
    water = SmallKitchen("Mug-1@CoffeeMachine-1 filled=water")
    water.do("toggle_on(CoffeeMachine)")
    assert water.state("Mug-1", "filled") == "water"
    dirty = SmallKitchen("Mug-1@CoffeeMachine-1 dirty=dirty")
    dirty.do("toggle_on(CoffeeMachine)")
    assert dirty.state("Mug-1", "filled") == "coffee"


def test_coffee_brewed_over_an_egg_spoils_both() -> None:
    kitchen = SmallKitchen("Mug-1@CoffeeMachine-1", "Egg-1@Mug-1")
    kitchen.do("toggle_on(CoffeeMachine)")
    assert kitchen.spoiled == {"Egg-1", "Mug-1"}


@pytest.mark.parametrize("full", ["", " filled=wine"])
def test_liquid_poured_over_food_spoils_it(full: str) -> None:
    kitchen = SmallKitchen(
        "Mug-1@CounterTop-1 filled=water", f"Bowl-1@CounterTop-1{full}", "Apple-1@Bowl-1"
    )
    kitchen.do("pick_up(Mug)", "pour(Mug, Bowl)")
    assert kitchen.spoiled == {"Apple-1"}


def test_water_that_runs_over_food_in_a_pot_spoils_it() -> None:
    kitchen = SmallKitchen("Pot-1@Sink-1", "Apple-1@Pot-1")
    kitchen.do("toggle_on(Faucet)")
    assert kitchen.spoiled == {"Apple-1"}
    assert kitchen.state("Pot-1", "filled") == "water"


@pytest.mark.parametrize(("food", "ruined"), [("Bread-1", True), ("Tomato-1", False)])
def test_running_water_spoils_whole_food_that_soaks(food: str, ruined: bool) -> None:
    kitchen = SmallKitchen(f"{food}@Sink-1")
    kitchen.do("toggle_on(Faucet)")
    assert kitchen.spoiled == ({food} if ruined else set())


@pytest.mark.parametrize("temperature", ["hot", "room"])
def test_a_plant_is_as_hot_as_the_water_that_it_gets(temperature: str) -> None:
    kitchen = SmallKitchen(
        f"Pot-1@CounterTop-1 filled=water temperature={temperature}", "HousePlant-1@CounterTop-1"
    )
    kitchen.do("pick_up(Pot)", "pour(Pot, HousePlant)")
    assert kitchen.state("HousePlant-1", "temperature") == temperature


def test_things_that_are_no_food_are_not_spoiled_by_dirt_or_liquid() -> None:
    kitchen = SmallKitchen("Knife-1@CounterTop-1", "Sink-1")
    kitchen.do("pick_up(Knife)", "put_in(Knife, Sink)", "toggle_on(Faucet)")
    assert kitchen.spoiled == set()


# falling


@pytest.mark.parametrize("thing", ["Mug-1", "Cup-1", "Plate-1", "Bowl-1"])
def test_a_dropped_vessel_stays_intact_on_the_floor_and_can_be_picked_up(thing: str) -> None:
    kitchen = SmallKitchen(f"{thing}@CounterTop-1")
    kitchen.do(f"pick_up({thing})")
    assert kitchen.env.drop_held() == thing
    assert kitchen.held is None
    assert kitchen.parent(thing) == "Floor-1"
    assert kitchen.state(thing, "broken") == "intact"
    kitchen.do(f"pick_up({thing})")
    assert kitchen.held == thing
    assert kitchen.spoiled == set()


@pytest.mark.parametrize("thing", ["Mug-1", "Cup-1", "Plate-1", "Bowl-1"])
def test_a_hard_fall_breaks_what_is_fragile(thing: str) -> None:
    kitchen = SmallKitchen(f"{thing}@CounterTop-1")
    kitchen.do(f"pick_up({thing})")
    kitchen.env.drop_held(hard=True)
    assert kitchen.state(thing, "broken") == "broken"
    assert kitchen.spoiled == {thing}


def test_a_hard_fall_does_not_break_what_is_not_fragile() -> None:
    kitchen = SmallKitchen("Pot-1@CounterTop-1")
    kitchen.do("pick_up(Pot)")
    kitchen.env.drop_held(hard=True)
    assert kitchen.spoiled == set()


def test_a_dropped_egg_is_a_cracked_egg_on_the_floor_for_good() -> None:
    kitchen = SmallKitchen("Egg-1@CounterTop-1")
    kitchen.do("pick_up(Egg)")
    assert kitchen.env.drop_held() == "Egg-1"
    assert kitchen.env.oracle.truth().get("Egg-1") is None
    assert kitchen.parent("EggCracked-1") == "Floor-1"
    assert kitchen.spoiled == {"Egg-1", "EggCracked-1"}
    assert "broken(Egg-1)=broken" in [e.text for e in kitchen.env.oracle.events()]


def test_a_dropped_vessel_spills_its_liquid_and_keeps_its_contents() -> None:
    kitchen = SmallKitchen("Pot-1@CounterTop-1 filled=water", "Apple-1@Pot-1")
    kitchen.do("pick_up(Pot)")
    kitchen.env.drop_held()
    assert kitchen.state("Pot-1", "filled") == "empty"
    assert kitchen.parent("Apple-1") == "Pot-1"
    assert "spill" in kitchen.kinds()


def test_an_empty_hand_drops_nothing() -> None:
    assert SmallKitchen().env.drop_held() is None


def test_nothing_falls_where_there_is_no_free_floor(monkeypatch: pytest.MonkeyPatch) -> None:
    kitchen = SmallKitchen("Mug-1@CounterTop-1")
    kitchen.do("pick_up(Mug)")

    def crowded(thing: str) -> None:
        raise SceneError("no free floor")

    monkeypatch.setattr(kitchen.world, "drop", crowded)
    assert kitchen.env.drop_held() is None
    assert kitchen.held == "Mug-1"
