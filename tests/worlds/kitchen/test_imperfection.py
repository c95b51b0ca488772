"""Each way in which a motion goes wrong does what it says, and leaves the household consistent."""

from dataclasses import replace

import pytest
from small_kitchen import CONTAINING, SmallKitchen

from forestall.domain.load import shipped
from forestall.errors import InputError
from forestall.testing.conformance import check_environment
from forestall.types.episode import SkillStatus
from forestall.types.facts import GRIPPER
from forestall.types.plan import Subtask
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.worlds.kitchen.flat_world import flat_environment
from forestall.worlds.kitchen.imperfection import DRAW_EVENT, PERFECT, WAYS, Rates
from forestall.worlds.kitchen.law import LAW_EVENT
from forestall.worlds.kitchen.law import WAYS as WAYS_OF_LAW
from forestall.worlds.kitchen.motions import Motions
from forestall.worlds.kitchen.streams import Streams

HOUSEHOLD = shipped("household")
MUG = "Mug-1@CounterTop-1"
FULL = "Mug-1@CounterTop-1 filled=coffee"


def always(way: str, *things: str, hard: float = 0.0) -> SmallKitchen:
    """A kitchen in which motions always go wrong in one way, where it is possible."""
    return SmallKitchen(*things, rates=replace(PERFECT, hard=hard, **{way: 1.0}))


def check_consistent(kitchen: SmallKitchen) -> None:
    """Truth and geometry agree, and everything is at one place."""
    graph = kitchen.env.oracle.truth()
    names = {n.id for n in graph.nodes}
    placed: dict[str, str] = {}
    for relation in graph.relations:
        assert {relation.subject, relation.object} <= names
        if relation.predicate in (*CONTAINING, "held_by"):
            assert relation.subject not in placed
            placed[relation.subject] = relation.object
    for name in names - {GRIPPER}:
        if not kitchen.env._acting.household.category(name).fixture:
            assert name in placed
    held = graph.in_hands(("gripper",))
    assert held == tuple(filter(None, [kitchen.world._held]))
    for name, parent in kitchen.world._parents.items():
        assert placed.get(name) == (GRIPPER if name in held else parent)


def believed(kitchen: SmallKitchen) -> str | None:
    return kitchen.env.observe().gripper.holding


def ends(kitchen: SmallKitchen, step: str, status: SkillStatus) -> str:
    outcome = kitchen.tried(step)
    check_consistent(kitchen)
    assert outcome.status is status, outcome.reason
    return outcome.reason


DONE, FAILED, REFUSED = SkillStatus.SUCCEEDED, SkillStatus.FAILED, SkillStatus.REFUSED


def test_a_grasp_that_misses_is_seen_and_takes_its_time() -> None:
    kitchen = always("miss", MUG)
    kitchen.do("navigate_to_obj(Mug)")
    before_s = kitchen.env.time_s
    assert "closed on nothing" in ends(kitchen, "pick_up(Mug)", FAILED)
    assert kitchen.env.time_s == before_s + 4.0
    assert (kitchen.held, believed(kitchen), kitchen.parent("Mug-1")) == (
        None,
        None,
        "CounterTop-1",
    )


def test_a_grasp_of_the_neighbour_is_taken_for_the_thing_itself() -> None:
    kitchen = always("neighbour", MUG, "Cup-1@CounterTop-1")
    ends(kitchen, "pick_up(Mug)", DONE)
    assert (kitchen.held, believed(kitchen)) == ("Cup-1", "Mug-1")
    assert "holds Mug-1" in ends(kitchen, "pick_up(Cup)", REFUSED)
    ends(kitchen, "put_on(Mug, CounterTop-2)", DONE)
    assert (kitchen.parent("Cup-1"), kitchen.parent("Mug-1")) == ("CounterTop-2", "CounterTop-1")
    assert (kitchen.held, believed(kitchen)) == (None, None)


def test_what_a_refusal_says_of_the_wrong_thing_is_what_the_robot_believes() -> None:
    kitchen = always("neighbour", MUG, "Knife-1@CounterTop-1")
    ends(kitchen, "pick_up(Mug)", DONE)
    reason = ends(kitchen, "put_in(Mug, CoffeeMachine)", REFUSED)
    assert "Knife" not in reason
    assert "Mug-1" in reason


def test_without_a_neighbour_the_thing_itself_is_taken() -> None:
    kitchen = always("neighbour", MUG)
    ends(kitchen, "pick_up(Mug)", DONE)
    assert kitchen.held == believed(kitchen) == "Mug-1"
    assert kitchen.told(DRAW_EVENT)[0].endswith("neighbour is not possible, as meant")


def test_a_loose_grasp_slips_on_the_next_drive_and_nobody_reports_it() -> None:
    kitchen = always("slip", FULL)
    ends(kitchen, "pick_up(Mug)", DONE)
    assert kitchen.held == "Mug-1"
    ends(kitchen, "navigate_to_obj(DiningTable)", DONE)
    assert kitchen.held is None
    assert kitchen.parent("Mug-1") == "Floor-1"
    assert kitchen.state("Mug-1", "filled") == "empty"
    gripper = kitchen.env.observe().gripper
    assert (gripper.holding, gripper.released, gripper.released_world_m) == (None, None, None)


def test_what_slips_on_the_way_of_a_put_ends_the_put() -> None:
    kitchen = always("slip", MUG)
    ends(kitchen, "pick_up(Mug)", DONE)
    assert "closed on nothing" in ends(kitchen, "put_on(Mug, DiningTable)", FAILED)
    assert kitchen.parent("Mug-1") == "Floor-1"


def test_what_slips_while_the_robot_comes_near_is_on_the_floor_before_the_step() -> None:
    kitchen = always("slip", MUG)
    kitchen.do("pick_up(Mug)")
    kitchen.env.approach("DiningTable-1")
    assert believed(kitchen) is None
    assert "not in the gripper" in ends(kitchen, "put_on(Mug, DiningTable)", REFUSED)


def test_a_hard_fall_breaks_what_is_fragile() -> None:
    for hard, broken in ((0.0, "intact"), (1.0, "broken")):
        kitchen = always("slip", MUG, hard=hard)
        kitchen.do("pick_up(Mug)", "navigate_to_obj(DiningTable)")
        assert kitchen.state("Mug-1", "broken") == broken


def test_what_lies_on_a_plate_that_falls_does_not_stay_on_it() -> None:
    kitchen = always("slip", "Plate-1@CounterTop-1", "Potato-1@Plate-1")
    ends(kitchen, "pick_up(Plate)", DONE)
    ends(kitchen, "navigate_to_obj(Microwave)", DONE)
    assert kitchen.parent("Plate-1") == kitchen.parent("Potato-1") == "Floor-1"


def test_an_egg_breaks_in_the_bowl_that_falls_and_stays_in_it() -> None:
    kitchen = always("slip", "Bowl-1@CounterTop-1", "Egg-1@Bowl-1")
    ends(kitchen, "pick_up(Bowl)", DONE)
    ends(kitchen, "navigate_to_obj(DiningTable)", DONE)
    assert kitchen.parent("Bowl-1") == "Floor-1"
    assert kitchen.parent("EggCracked-1") == "Bowl-1"


def test_an_arm_that_balks_keeps_what_it_holds() -> None:
    kitchen = always("balk", MUG)
    kitchen.do("pick_up(Mug)")
    ends(kitchen, "put_in(Mug, Sink)", FAILED)
    assert kitchen.held == believed(kitchen) == "Mug-1"


def test_a_put_beside_a_vessel_lands_on_what_that_stands_on() -> None:
    kitchen = always("beside", "Potato-1@CounterTop-1", "Plate-1@CounterTop-2")
    kitchen.do("pick_up(Potato)")
    ends(kitchen, "put_on(Potato, Plate)", DONE)
    assert kitchen.parent("Potato-1") == "CounterTop-2"


def test_a_put_beside_where_nothing_is_near_falls_to_the_floor() -> None:
    kitchen = always("beside", FULL)
    kitchen.do("pick_up(Mug)")
    ends(kitchen, "put_in(Mug, CoffeeMachine)", DONE)
    assert kitchen.parent("Mug-1") == "Floor-1"
    assert kitchen.state("Mug-1", "filled") == "empty"
    gripper = kitchen.env.observe().gripper
    assert gripper.released == "Mug-1"
    assert gripper.released_world_m == gripper.position_world_m


def test_nothing_lands_beside_a_support_where_any_place_will_do() -> None:
    kitchen = always("beside", MUG)
    kitchen.do("pick_up(Mug)")
    ends(kitchen, "put_on(Mug, DiningTable)", DONE)
    assert kitchen.parent("Mug-1") == "DiningTable-1"


def test_a_mug_on_its_side_loses_what_was_in_it_and_takes_nothing_until_it_is_picked_up() -> None:
    kitchen = always("tip", FULL, "Pot-1@CounterTop-1 filled=water")
    kitchen.do("pick_up(Mug)")
    ends(kitchen, "put_in(Mug, Sink)", DONE)
    assert (kitchen.parent("Mug-1"), kitchen.state("Mug-1", "filled")) == ("Sink-1", "empty")
    kitchen.do("toggle_on(Faucet)", "toggle_off(Faucet)")
    assert kitchen.state("Mug-1", "filled") == "empty"
    kitchen.do("pick_up(Pot)")
    ends(kitchen, "pour(Pot, Mug)", DONE)
    assert kitchen.state("Mug-1", "filled") == kitchen.state("Pot-1", "filled") == "empty"
    home = kitchen.env._acting.household
    kitchen.env._acting.motions = Motions()
    kitchen.do("put_on(Pot, CounterTop)", "pick_up(Mug)", "put_in(Mug, Sink)", "toggle_on(Faucet)")
    assert not home.is_lying("Mug-1")
    assert kitchen.state("Mug-1", "filled") == "water"


def test_what_is_put_into_a_vessel_on_its_side_lands_beside_it() -> None:
    kitchen = always("tip", "Bowl-1@CounterTop-1", "Potato-1@CounterTop-1")
    kitchen.do("pick_up(Bowl)", "put_on(Bowl, CounterTop-2)", "pick_up(Potato)")
    ends(kitchen, "put_in(Potato, Bowl)", DONE)
    assert kitchen.parent("Potato-1") == "CounterTop-2"


def test_a_vessel_with_something_in_it_and_a_plate_do_not_tip() -> None:
    kitchen = always("tip", "Bowl-1@CounterTop-1", "Egg-1@Bowl-1", "Plate-1@CounterTop-2")
    kitchen.do("pick_up(Bowl)", "put_on(Bowl, DiningTable)", "pick_up(Plate)")
    kitchen.do("put_on(Plate, DiningTable)")
    assert not any(kitchen.env._acting.household.is_lying(n) for n in ("Bowl-1", "Plate-1"))


@pytest.mark.parametrize("step", ["open_obj(Fridge)", "close_obj(Microwave)"])
def test_a_handle_that_slips_leaves_the_door_as_it_was(step: str) -> None:
    kitchen = always("handle", "Microwave-1 open=open")
    ends(kitchen, step, FAILED)
    assert kitchen.state("Fridge-1", "open") == "closed"
    assert kitchen.state("Microwave-1", "open") == "open"


def test_a_door_left_ajar_counts_as_it_was_and_can_be_tried_again() -> None:
    kitchen = always("ajar", "Microwave-1 open=open", "Egg-1@Fridge-1")
    ends(kitchen, "open_obj(Fridge)", DONE)
    ends(kitchen, "close_obj(Microwave)", DONE)
    assert kitchen.state("Fridge-1", "open") == "closed"
    assert kitchen.state("Microwave-1", "open") == "open"
    assert "Fridge-1 is closed" in ends(kitchen, "pick_up(Egg)", REFUSED)
    assert "while it is open" in ends(kitchen, "toggle_on(Microwave)", REFUSED)
    kitchen.env._acting.motions = Motions()
    kitchen.do("open_obj(Fridge)", "close_obj(Microwave)")
    assert kitchen.state("Fridge-1", "open") == "open"
    assert kitchen.state("Microwave-1", "open") == "closed"


def test_a_door_left_ajar_can_be_pushed_back() -> None:
    kitchen = always("ajar")
    kitchen.do("open_obj(Fridge)")
    home = kitchen.env._acting.household
    assert home.is_ajar("Fridge-1")
    kitchen.env._acting.motions = Motions()
    before_s = kitchen.env.time_s
    kitchen.do("close_obj(Fridge)")
    assert not home.is_ajar("Fridge-1")
    assert kitchen.env.time_s == before_s + 3.0
    assert kitchen.world.shown[-1] == ("Fridge-1", "open", "closed")


@pytest.mark.parametrize(("way", "status"), [("press", DONE), ("press_seen", FAILED)])
def test_a_press_that_does_not_take(way: str, status: SkillStatus) -> None:
    kitchen = always(way, "Faucet-1 toggled=on")
    ends(kitchen, "toggle_off(Faucet)", status)
    ends(kitchen, "toggle_on(StoveBurner-1)", status)
    assert kitchen.state("Faucet-1", "toggled") == "on"
    assert kitchen.state("StoveBurner-1", "toggled") == "off"


def test_pouring_that_goes_wrong() -> None:
    things = ("Mug-1@CounterTop-1 filled=water", "Pot-1@CounterTop-1")
    kitchen = always("shy", *things)
    kitchen.do("pick_up(Mug)")
    ends(kitchen, "pour(Mug, Pot)", FAILED)
    assert kitchen.state("Mug-1", "filled") == "water"
    kitchen = always("spill", *things)
    kitchen.do("pick_up(Mug)")
    ends(kitchen, "pour(Mug, Pot)", DONE)
    assert kitchen.state("Mug-1", "filled") == kitchen.state("Pot-1", "filled") == "empty"
    assert "spill" in kitchen.kinds()
    kitchen = always("spill", *things)
    kitchen.do("pick_up(Mug)")
    ends(kitchen, "pour(Mug, Sink)", DONE)
    assert kitchen.state("Mug-1", "filled") == "water"


def test_a_knife_that_glances_off() -> None:
    kitchen = always("glance", "Knife-1@CounterTop-1", "Potato-1@CounterTop-1")
    kitchen.do("pick_up(Knife)")
    ends(kitchen, "slice_obj(Potato)", FAILED)
    assert kitchen.parent("Potato-1") == "CounterTop-1"


def test_a_shell_that_does_not_break_and_one_that_breaks_beside() -> None:
    things = ("Egg-1@CounterTop-1", "Pan-1@CounterTop-1")
    kitchen = always("shell", *things)
    kitchen.do("pick_up(Egg)", "navigate_to_obj(Pan)")
    ends(kitchen, "crack_obj(Egg)", FAILED)
    assert kitchen.held == "Egg-1"
    kitchen = always("shell_beside", *things)
    kitchen.do("pick_up(Egg)", "navigate_to_obj(Pan)")
    ends(kitchen, "crack_obj(Egg)", DONE)
    assert kitchen.parent("EggCracked-1") == "CounterTop-1"


def test_a_base_that_stalls_does_not_come_there() -> None:
    kitchen = always("stall", MUG)
    at = kitchen.env.observe().robot_position_world_m
    ends(kitchen, "navigate_to_obj(Mug)", FAILED)
    assert kitchen.env.observe().robot_position_world_m == at


def test_every_way_is_a_rate_and_every_rate_is_documented() -> None:
    ways = [w for several in WAYS.values() for w in several]
    assert len(ways) == len(set(ways))
    assert set(ways) | {"hard", "place_sd_m", "turn_sd_deg", "roam"} == set(
        Rates.__dataclass_fields__
    )
    assert Rates.__doc__ is not None
    assert all(f"        {name}: " in Rates.__doc__ for name in Rates.__dataclass_fields__)


def test_a_rate_that_is_none_is_refused() -> None:
    with pytest.raises(InputError, match=r"miss = 1.5 is no rate"):
        Rates(miss=1.5)
    with pytest.raises(InputError, match="slip, of take, is more than 1"):
        Rates(miss=0.6, slip=0.6)


STEPS = (
    "pick_up(Mug)",
    "put_in(Mug, Sink)",
    "toggle_on(Faucet)",
    "toggle_off(Faucet)",
    "pick_up(Mug)",
    "put_on(Mug, CounterTop)",
    "open_obj(Fridge)",
    "close_obj(Fridge)",
)


def _draws(seed: int, *steps: str) -> dict[str, str]:
    """Attempt → what was drawn for it."""
    kitchen = SmallKitchen(MUG, "Potato-1@CounterTop-2", rates=Rates(), seed=seed)
    for step in steps:
        kitchen.tried(step)
    return dict(t.split(": ") for t in kitchen.told(DRAW_EVENT))


def test_a_seed_draws_the_same_each_time_and_another_seed_something_else() -> None:
    assert _draws(3, *STEPS) == _draws(3, *STEPS) != _draws(4, *STEPS)


def test_what_is_done_in_between_changes_no_draw() -> None:
    plain = _draws(5, *STEPS)
    assert len(plain) == len(STEPS)
    more = _draws(5, "open_obj(Microwave)", "navigate_to_obj(Potato)", *STEPS, "pick_up(Potato)")
    assert plain.items() <= more.items()


def test_an_attempt_that_is_refused_draws_nothing() -> None:
    kitchen = SmallKitchen(MUG, rates=Rates())
    kitchen.tried("put_on(Mug, CounterTop)")
    kitchen.tried("close_obj(Fridge)")
    assert kitchen.told(DRAW_EVENT) == []


def test_each_attempt_of_the_same_draws_anew() -> None:
    steps = ("toggle_on(Faucet)", "toggle_off(Faucet)") * 6
    numbers = [v for k, v in _draws(5, *steps).items() if "on #" in k]
    assert len(set(numbers)) == len(numbers) > 3


def test_ways_come_about_as_often_as_their_rates_say() -> None:
    rates, streams = Rates(), Streams(7)
    numbers = [float(streams("skill", "take", "Mug", n).random()) for n in range(2000)]
    share = sum(n < rates.miss for n in numbers) / len(numbers)
    assert abs(share - rates.miss) < 4 * (rates.miss / len(numbers)) ** 0.5


def test_what_was_drawn_stays_with_the_truth() -> None:
    kitchen = always("neighbour", MUG, "Cup-1@CounterTop-1")
    kitchen.do("pick_up(Mug)")
    assert kitchen.told(DRAW_EVENT)
    assert "Cup" not in repr(kitchen.env.observe().gripper)


def test_the_honest_kitchen_is_an_environment_like_any_other() -> None:
    needs = SceneNeeds(objects=(ObjectNeed("Mug-1", "Mug"), ObjectNeed("Cup-1", "Cup")))
    steps = [Subtask.parse(s) for s in STEPS]
    rates = replace(Rates(), neighbour=0.2, slip=0.2, tip=0.3, ajar=0.3)
    for seed in range(6):
        assert not check_environment(
            lambda: flat_environment(needs, HOUSEHOLD, rates, WAYS_OF_LAW), seed, steps, HOUSEHOLD
        )


def test_a_scenario_changes_no_draw_and_another_task_does() -> None:
    mug, cup = ObjectNeed("Mug-1", "Mug"), ObjectNeed("Cup-1", "Cup")
    plain = SceneNeeds(objects=(mug,))
    disturbed = SceneNeeds(objects=(mug, cup), undisturbed=plain)

    def first(needs: SceneNeeds) -> str:
        kitchen = flat_environment(needs, HOUSEHOLD, Rates(), WAYS_OF_LAW)
        kitchen.reset(7)
        kitchen.execute(Subtask.parse("pick_up(Mug)"))
        events = kitchen.oracle.events()
        return repr([e.text for e in events if e.kind in (DRAW_EVENT, LAW_EVENT)])

    assert first(plain) == first(disturbed) != first(SceneNeeds(objects=(mug, cup)))
