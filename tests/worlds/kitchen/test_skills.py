import pytest
from small_kitchen import SmallKitchen

from forestall.domain.load import shipped
from forestall.errors import SceneError
from forestall.types.episode import SkillStatus
from forestall.types.plan import Subtask
from forestall.worlds.kitchen.actor import SkillTimes
from forestall.worlds.kitchen.skills import SKILL_TABLE


def test_every_verb_has_a_skill() -> None:
    assert set(SKILL_TABLE) == set(shipped("household").skills)


REFUSALS = [
    # pick_up
    (["Mug-1@CounterTop-1", "Cup-1@CounterTop-1"], ["pick_up(Cup)"], "pick_up(Mug)",
     "the gripper is not empty: it holds Cup-1"),
    ([], [], "pick_up(Fridge)", "Fridge-1 cannot be picked up"),
    (["EggCracked-1@Pan-1", "Pan-1@CounterTop-1"], [], "pick_up(EggCracked)",
     "EggCracked-1 cannot be picked up"),
    (["Egg-1@Fridge-1"], [], "pick_up(Egg)", "Egg-1 cannot be reached: Fridge-1 is closed"),
    (["Egg-1@Bowl-1", "Bowl-1@Fridge-1"], [], "pick_up(Egg)",
     "Egg-1 cannot be reached: Fridge-1 is closed"),
    # put
    (["Mug-1@CounterTop-1"], [], "put_on(Mug, DiningTable)", "Mug-1 is not in the gripper"),
    (["Pan-1@CounterTop-1", "Microwave-1 open=open"], ["pick_up(Pan)"], "put_in(Pan, Microwave)",
     "Microwave-1 does not take Pan-1"),
    (["Plate-1@CounterTop-1"], ["pick_up(Plate)"], "put_in(Plate, Microwave)",
     "Microwave-1 is closed"),
    (["Plate-1@CounterTop-1", "Bowl-1@Microwave-1", "Microwave-1 open=open"], ["pick_up(Plate)"],
     "put_in(Plate, Microwave)", "Microwave-1 is full: Bowl-1 is in the way"),
    (["Mug-1@CounterTop-1", "Cup-1@CoffeeMachine-1"], ["pick_up(Mug)"],
     "put_in(Mug, CoffeeMachine)", "CoffeeMachine-1 is full: Cup-1 is in the way"),
    (["BreadSliced-1@CounterTop-1", "BreadSliced-2@Toaster-1"], ["pick_up(BreadSliced-1)"],
     "put_in(BreadSliced-1, Toaster)", "Toaster-1 is full: BreadSliced-2 is in the way"),
    (["Pot-1@CounterTop-1", "Pan-1@StoveBurner-1"], ["pick_up(Pot)"],
     "put_on(Pot, StoveBurner-1)", "StoveBurner-1 is full: Pan-1 is in the way"),
    (["Potato-1@CounterTop-1", "Tomato-1@Plate-1", "Plate-1@CounterTop-1"], ["pick_up(Potato)"],
     "put_on(Potato, Plate)", "Plate-1 is full: Tomato-1 is in the way"),
    (["Mug-1@CounterTop-1"], ["pick_up(Mug)"], "put_in(Mug, Faucet)",
     "nothing can be put on or into Faucet-1"),
    (["Mug-1@CounterTop-1"], ["pick_up(Mug)"], "put_in(Mug, Mug)", "Mug-1 cannot go into itself"),
    (["Potato-1@CounterTop-1", "Bowl-1@Fridge-1"], ["pick_up(Potato)"], "put_in(Potato, Bowl)",
     "Bowl-1 cannot be reached: Fridge-1 is closed"),
    # open and close
    ([], [], "open_obj(Toaster)", "Toaster-1 cannot be opened"),
    ([], [], "close_obj(Toaster)", "Toaster-1 cannot be closed"),
    ([], ["toggle_on(Microwave)"], "open_obj(Microwave)",
     "Microwave-1 does not open while it is on"),
    (["Book-1@Cabinet-1"], [], "open_obj(Book)", "Book-1 cannot be reached: Cabinet-1 is closed"),
    # toggle
    ([], [], "toggle_on(Fridge)", "Fridge-1 cannot be turned on"),
    ([], [], "toggle_off(Fridge)", "Fridge-1 cannot be turned off"),
    (["Microwave-1 open=open"], [], "toggle_on(Microwave)",
     "Microwave-1 cannot be turned on while it is open"),
    (["RemoteControl-1@TVStand-1"], [], "toggle_on(Television)",
     "Television-1 is turned on with the remote control, which is not in the gripper"),
    (["CellPhone-1@Cabinet-1"], [], "toggle_on(CellPhone)",
     "CellPhone-1 cannot be reached: Cabinet-1 is closed"),
    # slice
    (["Bread-1@CounterTop-1"], [], "slice_obj(Bread)",
     "Bread-1 cannot be sliced without a knife: the gripper is empty"),
    (["Bread-1@CounterTop-1", "Cup-1@CounterTop-1"], ["pick_up(Cup)"], "slice_obj(Bread)",
     "Bread-1 cannot be sliced without a knife: the gripper holds Cup-1"),
    (["Mug-1@CounterTop-1", "Knife-1@CounterTop-1"], ["pick_up(Knife)"], "slice_obj(Mug)",
     "Mug-1 cannot be sliced"),
    (["Apple-1@Fridge-1", "Knife-1@CounterTop-1"], ["pick_up(Knife)"], "slice_obj(Apple)",
     "Apple-1 cannot be reached: Fridge-1 is closed"),
    # crack
    (["Potato-1@CounterTop-1"], [], "crack_obj(Potato)", "Potato-1 cannot be cracked"),
    (["Egg-1@Fridge-1"], [], "crack_obj(Egg)", "Egg-1 cannot be reached: Fridge-1 is closed"),
    # pour
    (["Mug-1@CounterTop-1 filled=water"], [], "pour(Mug, Sink)", "Mug-1 is not in the gripper"),
    (["Mug-1@CounterTop-1"], ["pick_up(Mug)"], "pour(Mug, Sink)", "Mug-1 is empty"),
    (["Plate-1@CounterTop-1"], ["pick_up(Plate)"], "pour(Plate, Sink)",
     "Plate-1 holds no liquid that could be poured"),
    (["Mug-1@CounterTop-1 filled=water", "Plate-1@CounterTop-1"], ["pick_up(Mug)"],
     "pour(Mug, Plate)", "nothing can be poured into Plate-1"),
    (["Mug-1@CounterTop-1 filled=water"], ["pick_up(Mug)"], "pour(Mug, Mug)",
     "Mug-1 cannot go into itself"),
    (["Mug-1@CounterTop-1 filled=water", "Bowl-1@Fridge-1"], ["pick_up(Mug)"], "pour(Mug, Bowl)",
     "Bowl-1 cannot be reached: Fridge-1 is closed"),
    # names
    (["Mug-1@CounterTop-1"], [], "pick_up(Mog)", "nothing here is called 'Mog'; did you mean Mug?"),
    (["Mug-1@CounterTop-1"], [], "pick_up(Mug-7)", "there is no Mug-7 here; there is Mug-1"),
    ([], [], "navigate_to_obj(Kettle)", "there is no kettle here"),
    (["Bread-1@CounterTop-1", "Knife-1@CounterTop-1"], ["pick_up(Knife)", "slice_obj(Bread)"],
     "slice_obj(Bread-1)", "Bread-1 is no longer there: it was sliced"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("things", "first", "step", "reason"), REFUSALS, ids=[f"{r[2]}: {r[3]}" for r in REFUSALS]
)
def test_a_skill_refuses_with_the_unmet_need_and_changes_nothing(
    things: list[str], first: list[str], step: str, reason: str
) -> None:
    kitchen = SmallKitchen(*things)
    if first:
        kitchen.do(*first)
    assert kitchen.refused(step) == reason


def test_a_blocked_thing_is_not_picked_up_until_its_blocker_is_gone() -> None:
    kitchen = SmallKitchen(
        "Knife-1@CounterTop-1", "Pot-1@CounterTop-1", blocked={"Knife-1": "Pot-1"}
    )
    assert kitchen.refused("pick_up(Knife)") == (
        "Knife-1 cannot be grasped: Pot-1 stands in front of it"
    )
    kitchen.do("pick_up(Pot)", "put_on(Pot, DiningTable)", "pick_up(Knife)")
    assert kitchen.held == "Knife-1"


def test_a_support_without_a_free_spot_refuses() -> None:
    kitchen = SmallKitchen("Mug-1@CounterTop-1", spots={"DiningTable-1": 0})
    kitchen.do("pick_up(Mug)")
    assert kitchen.refused("put_on(Mug, DiningTable)") == (
        "there is no room for Mug-1 on DiningTable-1"
    )


def test_a_refusal_costs_no_more_than_the_drive() -> None:
    kitchen = SmallKitchen("Pot-1@DiningTable-1", "Knife-1@DiningTable-1",
                           blocked={"Knife-1": "Pot-1"})  # fmt: skip
    driven = kitchen.env.execute(Subtask.parse("navigate_to_obj(DiningTable)")).duration_s
    assert driven > 0
    again = kitchen.env.execute(Subtask.parse("pick_up(Knife)"))
    assert again.status is SkillStatus.REFUSED
    assert again.duration_s == 0


def test_out_of_reach_means_driving_first() -> None:
    kitchen = SmallKitchen("Mug-1@DiningTable-1")
    far = kitchen.do("pick_up(Mug)").duration_s
    near = kitchen.do("put_on(Mug, DiningTable)").duration_s
    assert near == SkillTimes().put_s
    assert far > SkillTimes().pick_s


def test_what_is_in_a_thing_comes_with_it() -> None:
    kitchen = SmallKitchen("Potato-1@Plate-1", "Plate-1@CounterTop-1")
    kitchen.do("pick_up(Plate)", "put_on(Plate, DiningTable)")
    assert kitchen.parent("Plate-1") == "DiningTable-1"
    assert kitchen.parent("Potato-1") == "Plate-1"


def test_put_in_and_put_on_are_one_skill_with_the_relation_of_the_receptacle() -> None:
    kitchen = SmallKitchen("Mug-1@CounterTop-1", "Sink-1")
    kitchen.do("pick_up(Mug)", "put_on(Mug, SinkBasin)")
    relations = {str(r) for r in kitchen.env.oracle.truth().relations}
    assert "Mug-1 inside Sink-1" in relations
    kitchen.do("pick_up(Mug)", "put_in(Mug, CounterTop-2)")
    relations = {str(r) for r in kitchen.env.oracle.truth().relations}
    assert "Mug-1 on top of CounterTop-2" in relations


@pytest.mark.parametrize(
    ("step", "reason"),
    [
        ("open_obj(Fridge)", "Fridge-1 is already open"),
        ("close_obj(Cabinet)", "Cabinet-1 is already closed"),
        ("toggle_on(FloorLamp)", "FloorLamp-1 is already on"),
        ("toggle_off(Toaster)", "Toaster-1 is already off"),
    ],
)
def test_what_is_already_so_succeeds_and_says_so(step: str, reason: str) -> None:
    kitchen = SmallKitchen("Fridge-1 open=open", "FloorLamp-1 toggled=on")
    assert kitchen.do(step).reason == reason


def test_doors_and_switches_change_and_are_shown() -> None:
    kitchen = SmallKitchen()
    kitchen.do("open_obj(Microwave)", "close_obj(Microwave)", "toggle_on(Microwave)")
    assert kitchen.state("Microwave-1", "toggled") == "on"
    assert kitchen.world.shown[-3:] == [
        ("Microwave-1", "open", "open"),
        ("Microwave-1", "open", "closed"),
        ("Microwave-1", "toggled", "on"),
    ]


def test_the_television_is_turned_on_with_the_remote_control_in_hand_and_off_without() -> None:
    kitchen = SmallKitchen("RemoteControl-1@TVStand-1")
    kitchen.do("pick_up(RemoteControl)", "toggle_on(Television)", "put_on(RemoteControl, TVStand)")
    assert kitchen.state("Television-1", "toggled") == "on"
    kitchen.do("toggle_off(Television)")
    assert kitchen.state("Television-1", "toggled") == "off"


def test_a_knob_turns_its_burner() -> None:
    kitchen = SmallKitchen()
    kitchen.do("toggle_on(StoveKnob-2)")
    assert kitchen.state("StoveBurner-2", "toggled") == "on"
    assert kitchen.state("StoveBurner-1", "toggled") == "off"
    assert kitchen.do("toggle_on(StoveBurner-2)").reason == "StoveBurner-2 is already on"


def test_slicing_makes_slices_at_the_place_and_the_whole_vanishes() -> None:
    kitchen = SmallKitchen("Potato-1@CounterTop-2 cooked=cooked", "Knife-1@CounterTop-1")
    kitchen.do("pick_up(Knife)", "slice_obj(Potato)")
    assert kitchen.env.oracle.truth().get("Potato-1") is None
    assert kitchen.env.oracle.states("Potato-1") == {}
    for name in ("PotatoSliced-1", "PotatoSliced-2", "PotatoSliced-3"):
        assert kitchen.parent(name) == "CounterTop-2"
        assert kitchen.state(name, "cooked") == "cooked"
        assert kitchen.state(name, "sliced") == "sliced"


def test_an_egg_held_over_a_pan_lands_in_it() -> None:
    kitchen = SmallKitchen("Egg-1@CounterTop-1", "Pan-1@StoveBurner-1")
    kitchen.do("pick_up(Egg)", "navigate_to_obj(Pan)", "crack_obj(Egg)")
    assert kitchen.parent("EggCracked-1") == "Pan-1"
    assert kitchen.held is None
    assert kitchen.do("put_in(EggCracked, Pan)").reason == "EggCracked-1 is already there"


def test_an_egg_held_over_a_burner_lands_in_the_pan_on_it() -> None:
    kitchen = SmallKitchen("Egg-1@CounterTop-1", "Pan-1@StoveBurner-1")
    kitchen.do("pick_up(Egg)", "navigate_to_obj(StoveBurner-1)", "crack_obj(Egg)")
    assert kitchen.parent("EggCracked-1") == "Pan-1"


def test_an_egg_held_over_a_counter_lands_on_it_and_not_on_a_plate_there() -> None:
    kitchen = SmallKitchen("Egg-1@DiningTable-1", "Plate-1@CounterTop-1")
    kitchen.do("pick_up(Egg)", "navigate_to_obj(CounterTop-1)", "crack_obj(Egg)")
    assert kitchen.parent("EggCracked-1") == "CounterTop-1"


def test_an_egg_held_before_something_that_takes_none_lands_on_the_floor() -> None:
    kitchen = SmallKitchen("Egg-1@DiningTable-1")
    kitchen.do("pick_up(Egg)", "navigate_to_obj(Microwave)", "crack_obj(Egg)")
    assert kitchen.parent("EggCracked-1") == "Floor-1"


def test_an_egg_held_over_a_vessel_without_room_lands_below_it() -> None:
    kitchen = SmallKitchen("Egg-1@DiningTable-1", "Pan-1@CounterTop-1", spots={"Pan-1": 0})
    kitchen.do("pick_up(Egg)", "navigate_to_obj(Pan)", "crack_obj(Egg)")
    assert kitchen.parent("EggCracked-1") == "CounterTop-1"


def test_an_egg_that_finds_no_room_at_all_is_not_cracked() -> None:
    kitchen = SmallKitchen("Egg-1@DiningTable-1", spots={"Floor-1": 0})
    kitchen.do("pick_up(Egg)", "navigate_to_obj(Microwave)")
    assert kitchen.refused("crack_obj(Egg)") == "there is no room for what is in Egg-1"


def test_what_the_geometry_cannot_do_is_refused_and_changes_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    kitchen = SmallKitchen("Mug-1@CounterTop-1")
    kitchen.do("pick_up(Mug)")

    def jammed(thing: str, receptacle: str) -> None:
        raise SceneError(f"{receptacle} has no room for {thing}")

    monkeypatch.setattr(kitchen.world, "place", jammed)
    assert kitchen.refused("put_on(Mug, CounterTop-1)") == "CounterTop-1 has no room for Mug-1"
    assert kitchen.held == "Mug-1"


def test_an_egg_that_is_not_held_cracks_where_it_lies() -> None:
    kitchen = SmallKitchen("Egg-1@Bowl-1", "Bowl-1@CounterTop-1")
    kitchen.do("crack_obj(Egg)")
    assert kitchen.parent("EggCracked-1") == "Bowl-1"
    assert kitchen.env.oracle.truth().get("Egg-1") is None


def test_putting_an_egg_that_was_cracked_elsewhere_is_refused() -> None:
    kitchen = SmallKitchen("Egg-1@Bowl-1", "Bowl-1@CounterTop-1", "Pan-1@StoveBurner-1")
    kitchen.do("crack_obj(Egg)")
    assert kitchen.refused("put_in(EggCracked, Pan)") == "EggCracked-1 is not in the gripper"


def test_pouring_fills_what_is_empty_with_the_liquid_and_its_temperature() -> None:
    kitchen = SmallKitchen(
        "Mug-1@CounterTop-1 filled=coffee temperature=hot", "Bowl-1@CounterTop-1"
    )
    kitchen.do("pick_up(Mug)", "pour(Mug, Bowl)")
    assert kitchen.state("Mug-1", "filled") == "empty"
    assert kitchen.state("Bowl-1", "filled") == "coffee"
    assert kitchen.state("Bowl-1", "temperature") == "hot"


def test_pouring_into_a_sink_drains() -> None:
    kitchen = SmallKitchen("Bowl-1@CounterTop-1 filled=wine")
    kitchen.do("pick_up(Bowl)", "pour(Bowl, SinkBasin)")
    assert kitchen.state("Bowl-1", "filled") == "empty"
    assert "spill" not in kitchen.kinds()


def test_pouring_into_what_is_full_spills() -> None:
    kitchen = SmallKitchen("Mug-1@CounterTop-1 filled=water", "Cup-1@CounterTop-1 filled=wine")
    kitchen.do("pick_up(Mug)", "pour(Mug, Cup)")
    assert kitchen.state("Mug-1", "filled") == "empty"
    assert kitchen.state("Cup-1", "filled") == "wine"
    assert "spill" in kitchen.kinds()


def test_navigating_to_the_held_thing_is_no_drive() -> None:
    kitchen = SmallKitchen("Mug-1@CounterTop-1")
    kitchen.do("pick_up(Mug)")
    assert kitchen.do("navigate_to_obj(Mug)").duration_s == 0
