"""Needless pairs of steps: found by what a plan does, and kept where something asks for them."""

from forestall.planning.needless import needless_pairs, pruned, without
from forestall.planning.state import State
from forestall.planning.validate import observed, run
from forestall.types.plan import Plan, Subtask
from planning.corpus import DOMAIN, scene

KITCHEN = """
Egg-1 held, Pan-1 on CounterTop-1, Pan-1 is dirty, Sink-1, Faucet-1, CounterTop-1,
StoveBurner-1, StoveKnob-1, Fridge-1, Mug-1 on CounterTop-1
"""
PUT_AND_TAKEN = (
    "navigate_to_obj(CounterTop-1)",
    "put_on(Egg-1, CounterTop-1)",
    "pick_up(Pan-1)",
    "put_in(Pan-1, Sink-1)",
    "navigate_to_obj(Egg-1)",
    "pick_up(Egg-1)",
    "navigate_to_obj(Faucet-1)",
    "toggle_on(Faucet-1)",
    "toggle_off(Faucet-1)",
    "navigate_to_obj(CounterTop-1)",
    "put_on(Egg-1, CounterTop-1)",
    "pick_up(Pan-1)",
)


def start(*more: str) -> State:
    return observed(scene(KITCHEN, *more), DOMAIN)


def steps(*texts: str) -> tuple[Subtask, ...]:
    return Plan.parse(texts).subtasks


def test_what_is_taken_up_only_to_be_put_down_again_is_needless() -> None:
    plan = steps(*PUT_AND_TAKEN)
    assert needless_pairs(start(), plan) == ((5, 10),)
    kept = without(start(), plan, (5, 10))
    assert [str(plan[k]) for k in kept] == [
        t for k, t in enumerate(PUT_AND_TAKEN) if k not in (4, 5, 10)
    ]
    assert run(start(), [plan[k] for k in kept]).refusal is None


def test_water_that_washes_is_not_needless() -> None:
    washing = steps(*PUT_AND_TAKEN)
    assert (7, 8) not in needless_pairs(start(), washing)
    clean = start("Pan-1 is clean")
    assert (7, 8) in needless_pairs(clean, washing)


def test_what_something_between_needs_is_not_needless() -> None:
    plan = steps(
        "put_on(Egg-1, CounterTop-1)", "open_obj(Fridge-1)", "pick_up(Mug-1)",
        "put_in(Mug-1, Fridge-1)", "close_obj(Fridge-1)", "pick_up(Egg-1)",
    )  # fmt: skip
    assert needless_pairs(start(), plan) == ()


def test_a_burner_that_is_off_during_a_detour_stays_off() -> None:
    detour = steps(
        "put_on(Egg-1, CounterTop-1)", "toggle_off(StoveKnob-1)", "pick_up(Mug-1)",
        "put_in(Mug-1, Sink-1)", "toggle_on(StoveKnob-1)",
    )  # fmt: skip
    assert needless_pairs(start("StoveBurner-1 is on"), detour) == ()
    plan = steps("toggle_on(StoveKnob-1)", "toggle_off(StoveKnob-1)")
    assert needless_pairs(start(), plan) == ((0, 1),)


def test_a_step_that_changes_nothing_is_needless_by_itself() -> None:
    plan = steps("close_obj(Fridge-1)", "open_obj(Fridge-1)")
    assert needless_pairs(start(), plan) == ((0, 0),)


def test_what_is_turned_on_by_one_name_and_off_by_another_is_one_pair() -> None:
    plan = steps("toggle_on(StoveKnob-1)", "toggle_off(StoveBurner-1)")
    assert needless_pairs(start(), plan) == ((0, 1),)


def test_a_plan_that_does_not_run_has_none() -> None:
    plan = steps("open_obj(Fridge-1)", "close_obj(Fridge-1)", "pick_up(Mug-1)")
    assert needless_pairs(start(), plan) == ()


def test_pairs_go_where_that_is_accepted_from_repair_and_old_plan() -> None:
    plan = steps(*PUT_AND_TAKEN)
    asked: list[tuple[int, int]] = []

    def accepts(shorter: tuple[Subtask, ...], own: int) -> bool:
        asked.append((len(shorter), own))
        return True

    left = pruned(start(), plan, 9, accepts)
    assert len(left) == 9 and asked == [(9, 7)]
    assert needless_pairs(start(), left) == ()
    assert pruned(start(), plan, 5, accepts) == left and asked[-1] == (9, 4)
    assert pruned(start(), plan, 9, lambda shorter, own: False) == plan
