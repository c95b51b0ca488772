"""Which instance a category name means."""

from small_kitchen import SmallKitchen


def test_pick_up_prefers_what_can_be_reached_over_what_is_closed_in() -> None:
    kitchen = SmallKitchen("Egg-1@Fridge-1", "Egg-2@DiningTable-1")
    kitchen.do("pick_up(Egg)")
    assert kitchen.held == "Egg-2"


def test_pick_up_prefers_what_is_not_blocked() -> None:
    kitchen = SmallKitchen(
        "Mug-1@CounterTop-1", "Mug-2@DiningTable-1", "Pot-1@CounterTop-1",
        blocked={"Mug-1": "Pot-1"},
    )  # fmt: skip
    kitchen.do("pick_up(Mug)")
    assert kitchen.held == "Mug-2"


def test_pick_up_prefers_what_is_in_reach_then_the_lowest_number() -> None:
    things = ("Mug-1@CounterTop-1", "Mug-2@DiningTable-1", "Mug-10@DiningTable-1")
    kitchen = SmallKitchen(*things)
    kitchen.do("navigate_to_obj(DiningTable)", "pick_up(Mug)")
    assert kitchen.held == "Mug-2"
    kitchen = SmallKitchen(*things)
    kitchen.do("pick_up(Mug)")
    assert kitchen.held == "Mug-1"


def test_what_is_put_or_poured_means_the_held_thing() -> None:
    kitchen = SmallKitchen("Mug-1@CounterTop-1", "Mug-2@DiningTable-1 filled=water")
    kitchen.do("pick_up(Mug-2)", "pour(Mug, Sink)", "put_on(Mug, CounterTop-2)")
    assert kitchen.parent("Mug-2") == "CounterTop-2"


def test_a_poured_vessel_can_go_into_another_one_of_its_kind() -> None:
    kitchen = SmallKitchen("Mug-1@CounterTop-1 filled=water", "Mug-2@CounterTop-1")
    kitchen.do("pick_up(Mug-1)", "pour(Mug, Mug)")
    assert kitchen.state("Mug-2", "filled") == "water"


def test_a_receptacle_means_the_one_in_reach_with_room() -> None:
    kitchen = SmallKitchen("Mug-1@DiningTable-1")
    kitchen.do("pick_up(Mug)", "navigate_to_obj(CounterTop-2)", "put_on(Mug, CounterTop)")
    assert kitchen.parent("Mug-1") == "CounterTop-2"


def test_a_receptacle_without_room_is_passed_over() -> None:
    kitchen = SmallKitchen("Mug-1@DiningTable-1", spots={"CounterTop-1": 0})
    kitchen.do("pick_up(Mug)", "navigate_to_obj(CounterTop-1)", "put_on(Mug, CounterTop)")
    assert kitchen.parent("Mug-1") == "CounterTop-2"


def test_an_occupied_burner_is_passed_over() -> None:
    kitchen = SmallKitchen("Pot-1@CounterTop-1", "Pan-1@StoveBurner-1")
    kitchen.do("pick_up(Pot)", "put_on(Pot, StoveBurner)")
    assert kitchen.parent("Pot-1") == "StoveBurner-2"


def test_aliases_are_known_with_and_without_number() -> None:
    kitchen = SmallKitchen("Mug-1@CounterTop-1")
    kitchen.do("navigate_to_obj(SinkBasin-1)", "pick_up(Mug)", "put_in(Mug, SinkBasin)")
    assert kitchen.parent("Mug-1") == "Sink-1"


def test_a_crowded_counter_in_reach_is_passed_over_for_a_clear_one() -> None:
    kitchen = SmallKitchen("Mug-1@DiningTable-1", crowded=("CounterTop-1",))
    kitchen.do("pick_up(Mug)", "navigate_to_obj(CounterTop-1)", "put_on(Mug, CounterTop)")
    assert kitchen.parent("Mug-1") == "CounterTop-2"
    kitchen.do("pick_up(Mug)", "put_on(Mug, CounterTop-1)")
    assert kitchen.parent("Mug-1") == "CounterTop-1"
