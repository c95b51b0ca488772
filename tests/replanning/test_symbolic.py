from __future__ import annotations

from dataclasses import dataclass, replace

import pytest

from forestall.planning.needless import needless_pairs
from forestall.planning.search import SearchConfig
from forestall.planning.validate import GraphValidator, observed, run
from forestall.replanning.symbolic import PlannerReplanner
from forestall.types.facts import Literal, category_of
from forestall.types.plan import Plan, Subtask
from forestall.types.verdict import Diagnosis, Replan, ReplanOutcome
from planning.corpus import DOMAIN, GOALS, PLANS, home_of, plan, scene
from planning.episodes import context

VALIDATOR = GraphValidator(DOMAIN)


@dataclass(frozen=True)
class Repair:
    """A scene before a subtask, what must change, and what the repair must look like."""

    task: str
    before: str
    scene: str
    must_change: tuple[str, ...]
    starts: str
    must_stay: tuple[str, ...] = ()
    keeps_rest: bool = True
    plan: Plan | None = None


CLOSED_PLAN = Plan(
    tuple(s for s in PLANS["heat-potato"].subtasks if str(s) != "open_obj(Microwave)")
)

REPAIRS: dict[str, Repair] = {
    "bowl in the microwave, plate in hand": Repair(
        "heat-potato",
        "put_in(Plate, Microwave)",
        "Potato-1 on Plate-1, Plate-1 held, Bowl-1 in Microwave-1, Microwave-1 is open",
        ("vacant(Microwave-1)",),
        """
        navigate_to_obj(CounterTop)
        put_on(Plate-1, CounterTop)
        navigate_to_obj(Microwave-1)
        pick_up(Bowl-1)
        navigate_to_obj(CounterTop)
        put_on(Bowl-1, CounterTop)
        pick_up(Plate-1)
        """,
        ("open(Microwave-1)=open", "held_by(Plate-1, gripper)", "dirty(Plate-1)=clean"),
    ),
    "dirty plate, potato in hand": Repair(
        "heat-potato",
        "put_on(Potato, Plate)",
        "Potato-1 held, Plate-1 is dirty",
        ("dirty(Plate-1)=clean",),
        "",
        ("held_by(Potato-1, gripper)", "vacant(Plate-1)"),
        keeps_rest=False,
    ),
    "dirty plate, hand empty": Repair(
        "heat-potato",
        "navigate_to_obj(Potato)",
        "Plate-1 is dirty",
        ("dirty(Plate-1)=clean",),
        """
        navigate_to_obj(Plate-1)
        pick_up(Plate-1)
        navigate_to_obj(Sink-1)
        put_in(Plate-1, Sink-1)
        toggle_on(Faucet-1)
        """,
        keeps_rest=False,
    ),
    "dirty plate in hand with the potato on it": Repair(
        "heat-potato",
        "put_in(Plate, Microwave)",
        "Potato-1 on Plate-1, Plate-1 held, Plate-1 is dirty, Microwave-1 is open",
        ("dirty(Plate-1)=clean",),
        """
        navigate_to_obj(Sink-1)
        put_in(Plate-1, Sink-1)
        toggle_on(Faucet-1)
        toggle_off(Faucet-1)
        pick_up(Plate-1)
        """,
        ("held_by(Plate-1, gripper)", "on_top_of(Potato-1, Plate-1)"),
    ),
    "microwave closed, plate in hand": Repair(
        "heat-potato",
        "put_in(Plate, Microwave)",
        "Potato-1 on Plate-1, Plate-1 held",
        ("open(Microwave-1)=open",),
        """
        navigate_to_obj(Microwave-1)
        open_obj(Microwave-1)
        """,
        ("held_by(Plate-1, gripper)",),
        plan=CLOSED_PLAN,
    ),
    "cup in the coffee machine, mug in hand": Repair(
        "make-coffee",
        "put_in(Mug, CoffeeMachine)",
        "Mug-1 held, Cup-1 in CoffeeMachine-1",
        ("vacant(CoffeeMachine-1)",),
        """
        navigate_to_obj(CounterTop)
        put_on(Mug-1, CounterTop)
        navigate_to_obj(CoffeeMachine-1)
        pick_up(Cup-1)
        navigate_to_obj(CounterTop)
        put_on(Cup-1, CounterTop)
        pick_up(Mug-1)
        """,
        ("held_by(Mug-1, gripper)", "filled(Mug-1)=empty"),
    ),
    "mug on the floor": Repair(
        "make-coffee",
        "put_in(Mug, CoffeeMachine)",
        "Mug-1 on Floor-1",
        ("held_by(Mug-1, gripper)",),
        """
        navigate_to_obj(Mug-1)
        pick_up(Mug-1)
        """,
        ("vacant(CoffeeMachine-1)",),
    ),
    "dirty pan": Repair(
        "cook-egg",
        "pick_up(Pan)",
        "Pan-1 is dirty, StoveBurner-1 is on, Egg-1 on CounterTop-1",
        ("dirty(Pan-1)=clean",),
        """
        navigate_to_obj(StoveBurner-1)
        toggle_off(StoveBurner-1)
        navigate_to_obj(Pan-1)
        pick_up(Pan-1)
        navigate_to_obj(Sink-1)
        put_in(Pan-1, Sink-1)
        toggle_on(Faucet-1)
        """,
        ("hand_empty()",),
        keeps_rest=False,
    ),
    "potato in the pan": Repair(
        "cook-egg",
        "pick_up(Pan)",
        "Potato-1 in Pan-1, StoveBurner-1 is on, Egg-1 on CounterTop-1",
        ("vacant(Pan-1)",),
        """
        navigate_to_obj(Potato-1)
        pick_up(Potato-1)
        navigate_to_obj(CounterTop)
        put_on(Potato-1, CounterTop)
        """,
        ("hand_empty()",),
        keeps_rest=False,
    ),
    "pan on the burner, pot in hand": Repair(
        "boil-water",
        "put_on(Pot, StoveBurner-4)",
        "Pan-1 on StoveBurner-4, Pot-1 held, Pot-1 is water",
        ("vacant(StoveBurner-4)",),
        """
        navigate_to_obj(CounterTop)
        put_on(Pot-1, CounterTop)
        navigate_to_obj(Pan-1)
        pick_up(Pan-1)
        navigate_to_obj(CounterTop)
        put_on(Pan-1, CounterTop)
        pick_up(Pot-1)
        """,
        ("held_by(Pot-1, gripper)", "filled(Pot-1)=water"),
    ),
    "wine in the bowl, lettuce in hand": Repair(
        "make-salad",
        "navigate_to_obj(Bowl)",
        "Bowl-1 is wine, Lettuce-1 held",
        ("filled(Bowl-1)=empty",),
        "",
        ("held_by(Lettuce-1, gripper)",),
        keeps_rest=False,  # without putting down again what the repair would only pick up for that
    ),
    "wine in the bowl, slice in hand": Repair(
        "make-salad",
        "put_in(LettuceSliced, Bowl)",
        """Bowl-1 is wine, LettuceSliced-1 held, LettuceSliced-2 on CounterTop-1,
        PotatoSliced-1 on CounterTop-1, TomatoSliced-1 on CounterTop-1""",
        ("filled(Bowl-1)=empty",),
        "",
        ("held_by(LettuceSliced-1, gripper)",),
    ),
    "pot in front of the knife": Repair(
        "toast-bread",
        "pick_up(Knife)",
        "Pot-1 on CounterTop-1, Pot-1 blocks Knife-1",
        ("unblocked(Knife-1)",),
        """
        navigate_to_obj(Pot-1)
        pick_up(Pot-1)
        navigate_to_obj(CounterTop-2)
        put_on(Pot-1, CounterTop-2)
        """,
        ("hand_empty()",),
    ),
    "potato on the dirty plate, hand empty": Repair(
        "heat-potato",
        "pick_up(Plate)",
        "Potato-1 on Plate-1, Plate-1 is dirty",
        ("dirty(Plate-1)=clean",),
        "",
        ("on_top_of(Potato-1, Plate-1)", "hand_empty()"),
        keeps_rest=False,
    ),
    "wrong thing in hand": Repair(
        "make-coffee",
        "put_in(Mug, CoffeeMachine)",
        "Cup-1 held",
        ("held_by(Mug-1, gripper)",),
        """
        navigate_to_obj(CounterTop)
        put_on(Cup-1, CounterTop)
        navigate_to_obj(Mug-1)
        pick_up(Mug-1)
        """,
    ),
}


def without_numbers(steps: Plan) -> list[tuple[str, ...]]:
    return [(s.skill, *(category_of(DOMAIN.canonical(a)) for a in s.args)) for s in steps]


def attempt(case: Repair, config: SearchConfig | None = None) -> tuple[Replan, Plan]:
    current = case.plan or PLANS[case.task]
    texts = current.texts()
    index = len(texts) - 1 - texts[::-1].index(case.before)
    if case.task == "heat-potato" and case.before == "pick_up(Plate)":
        index = texts.index(case.before)
    if case.task == "make-salad" and case.before == "navigate_to_obj(Bowl)":
        index = texts.index(case.before)
    graph = scene(home_of(case.task), case.scene)
    if "LettuceSliced-1" in case.scene:
        gone = {"Lettuce-1", "Tomato-1", "Potato-1"}
        graph = replace(
            graph,
            nodes=tuple(n for n in graph.nodes if n.id not in gone),
            relations=tuple(r for r in graph.relations if r.subject not in gone),
        )
    diagnosis = Diagnosis(
        "a cause",
        tuple(map(Literal.parse, case.must_change)),
        tuple(map(Literal.parse, case.must_stay)),
    )
    replanner = PlannerReplanner(VALIDATOR, DOMAIN, config or SearchConfig(time_limit_s=60.0))
    answer = replanner.replan(context(case.task, current, index, graph), diagnosis)
    if answer.outcome is ReplanOutcome.SOLVED:
        assert answer.plan is not None
        check = VALIDATOR.check(answer.plan, graph, GOALS[case.task])
        assert check.ok, check.reason
        trace = run(observed(graph, DOMAIN), answer.plan.subtasks)
        for fact in diagnosis.must_change:
            assert any(s.holds(fact) for s in trace.states), fact
        assert not any("Floor" in s.args[1:] for s in answer.plan)
    return answer, Plan(current.subtasks[index:])


def test_what_the_old_plan_puts_down_again_is_not_picked_up_in_between() -> None:
    case = REPAIRS["wine in the bowl, lettuce in hand"]
    answer, _ = attempt(case)
    assert answer.plan is not None
    put_down = [s for s in answer.plan if s.skill == "put_on"]
    assert [category_of(s.args[0]) for s in put_down].count("Lettuce") == 1
    state = observed(scene(home_of(case.task), case.scene), DOMAIN)
    assert needless_pairs(state, answer.plan.subtasks) == ()


@pytest.mark.parametrize("name", sorted(REPAIRS))
def test_repairs(name: str) -> None:
    case = REPAIRS[name]
    answer, rest = attempt(case)
    assert answer.outcome is ReplanOutcome.SOLVED, answer.note
    assert answer.plan is not None and answer.check is not None
    assert answer.check.ok
    wanted = plan(case.starts).texts()
    assert answer.plan.texts()[: len(wanted)] == wanted
    if case.keeps_rest:
        kept = Plan(answer.plan.subtasks[-len(rest) :])
        assert without_numbers(kept) == without_numbers(rest)


def test_dirty_plate_is_washed_and_the_potato_picked_up_again() -> None:
    answer, _ = attempt(REPAIRS["dirty plate, potato in hand"])
    assert answer.plan is not None
    texts = answer.plan.texts()
    for step in ("put_in(Plate-1, Sink-1)", "toggle_on(Faucet-1)", "toggle_off(Faucet-1)"):
        assert step in texts
    assert texts.index("pick_up(Potato-1)") < texts.index("put_on(Potato-1, Plate-1)")


def test_wine_is_poured_away_and_not_into_food() -> None:
    answer, _ = attempt(REPAIRS["wine in the bowl, slice in hand"])
    assert answer.plan is not None
    assert "pour(Bowl-1, Sink-1)" in answer.plan.texts()


def test_a_lost_mug_is_unsolvable_and_named() -> None:
    case = replace(REPAIRS["mug on the floor"], scene="Mug-1 lost")
    answer, _ = attempt(case)
    assert answer.outcome is ReplanOutcome.UNSOLVABLE
    assert answer.plan is None
    assert "Mug-1: its place is not known" in answer.note


def test_nothing_to_change() -> None:
    graph = scene(home_of("make-coffee"))
    replanner = PlannerReplanner(VALIDATOR, DOMAIN)
    answer = replanner.replan(
        context("make-coffee", PLANS["make-coffee"], 0, graph), Diagnosis("all is well", ())
    )
    assert answer.outcome is ReplanOutcome.NOTHING_TO_CHANGE
    assert answer.plan is None


def test_what_no_skill_is_about_is_unsupported() -> None:
    case = replace(REPAIRS["mug on the floor"], must_change=("near(Mug-1, Cup-1)",))
    answer, _ = attempt(case)
    assert answer.outcome is ReplanOutcome.UNSUPPORTED


def test_a_search_that_is_cut_short_is_told() -> None:
    answer, _ = attempt(
        REPAIRS["bowl in the microwave, plate in hand"], SearchConfig(max_expansions=1)
    )
    assert answer.outcome is ReplanOutcome.NOT_FOUND


def test_what_should_stay_gives_way_when_it_makes_the_repair_impossible() -> None:
    case = replace(
        REPAIRS["bowl in the microwave, plate in hand"],
        must_stay=("inside(Bowl-1, Microwave-1)", "held_by(Plate-1, gripper)"),
    )
    answer, _ = attempt(case)
    assert answer.outcome is ReplanOutcome.SOLVED


def test_an_impossible_demand_does_not_hide_a_possible_one() -> None:
    case = replace(
        REPAIRS["bowl in the microwave, plate in hand"],
        must_change=("cooked(Potato-1)=raw", "vacant(Microwave-1)"),
        scene=REPAIRS["bowl in the microwave, plate in hand"].scene + ", Potato-1 is cooked",
    )
    graph = scene(home_of(case.task), case.scene)
    index = PLANS["heat-potato"].texts().index(case.before)
    answer = PlannerReplanner(VALIDATOR, DOMAIN).replan(
        context("heat-potato", PLANS["heat-potato"], index, graph),
        Diagnosis("a cause", tuple(map(Literal.parse, case.must_change))),
    )
    assert answer.outcome is ReplanOutcome.SOLVED
    assert answer.plan is not None
    assert "pick_up(Bowl-1)" in answer.plan.texts()


def test_where_the_rest_does_not_reach_the_goal_a_new_plan_does() -> None:
    short = Plan(PLANS["make-coffee"].subtasks[:-3])
    graph = scene(home_of("make-coffee"), "Mug-1 held, Cup-1 in CoffeeMachine-1")
    index = short.texts().index("put_in(Mug, CoffeeMachine)")
    answer = PlannerReplanner(VALIDATOR, DOMAIN).replan(
        context("make-coffee", short, index, graph),
        Diagnosis("a cup is in the way", (Literal.parse("vacant(CoffeeMachine-1)"),)),
    )
    assert answer.outcome is ReplanOutcome.SOLVED
    assert answer.plan is not None
    assert VALIDATOR.check(answer.plan, graph, GOALS["make-coffee"]).ok


def test_the_thing_at_hand_is_named_where_there_are_several() -> None:
    graph = scene(
        home_of("make-coffee"), "Mug-2 held, Mug-1 on CounterTop-1, Cup-1 in CoffeeMachine-1"
    )
    index = PLANS["make-coffee"].texts().index("put_in(Mug, CoffeeMachine)")
    answer = PlannerReplanner(VALIDATOR, DOMAIN).replan(
        context("make-coffee", PLANS["make-coffee"], index, graph),
        Diagnosis("a cup is in the way", (Literal.parse("vacant(CoffeeMachine-1)"),)),
    )
    assert answer.plan is not None
    assert "put_in(Mug-2, CoffeeMachine-1)" in answer.plan.texts()
    assert not any("Mug-1" in t for t in answer.plan.texts())


def test_two_mugs_the_near_one_blocked_and_the_plan_names_the_one_it_was_checked_with() -> None:
    graph = scene(
        home_of("make-coffee"),
        "Mug-2 on CounterTop-2, Mug-1 on CounterTop-1, Pot-1 blocks Mug-1",
        "Cup-1 in CoffeeMachine-1",
    )
    current = PLANS["make-coffee"]
    answer = PlannerReplanner(VALIDATOR, DOMAIN).replan(
        context("make-coffee", current, current.texts().index("pick_up(Mug)"), graph),
        Diagnosis("a cup is in the way", (Literal.parse("vacant(CoffeeMachine-1)"),)),
    )
    assert answer.plan is not None and answer.check is not None and answer.check.plan is not None
    sent = [s for s in answer.plan if s.skill == "pick_up" and "Mug" in s.args[0]]
    assert sent and all(s.args == ("Mug-2",) for s in sent)
    assert [
        s.args[0] for s in answer.check.plan if s.skill == "pick_up" and "Mug" in s.args[0]
    ] == [s.args[0] for s in sent]


def test_a_burner_is_off_during_a_long_detour_and_on_again_for_the_rest() -> None:
    answer, _ = attempt(REPAIRS["dirty pan"])
    assert answer.plan is not None
    texts = answer.plan.texts()
    assert texts.index("toggle_off(StoveBurner-1)") < texts.index("pick_up(Pan-1)")
    assert texts.index("toggle_on(StoveBurner-1)") > texts.index("put_in(Pan-1, Sink-1)")
    assert texts.index("toggle_on(StoveBurner-1)") < texts.index("crack_obj(Egg-1)")


def test_a_burner_that_nothing_needs_stays_off_after_the_detour() -> None:
    """Somebody has left it on; what was turned off for safety is on again only where that helps."""
    case = Repair(
        "make-coffee",
        "put_in(Mug, CoffeeMachine)",
        "Mug-1 is dirty, Mug-1 held, StoveBurner-2 is on",
        ("dirty(Mug-1)=clean",),
        "",
    )
    answer, _ = attempt(case)
    assert answer.plan is not None
    texts = answer.plan.texts()
    assert texts.index("toggle_off(StoveBurner-2)") < texts.index("toggle_on(Faucet-1)")
    assert "toggle_on(StoveBurner-2)" not in texts


def mended(
    step: str | None, refused: tuple[Subtask, ...] = (), besides: str | None = None
) -> list[str]:
    """What is done, knife in hand, about a bowl before the slices, which a step minds."""
    current = PLANS["make-salad"]
    index = current.texts().index("slice_obj(Potato)")
    graph = scene(
        home_of("make-salad"),
        "Knife-1 held, LettuceSliced-1 on CounterTop-1, Bowl-1 on CounterTop-1",
        "Potato-1 on CounterTop-1, Tomato-1 on CounterTop-1, Bowl-1 blocks LettuceSliced-1",
        "Bowl-1 is dirty" if besides else "",
    )
    graph = replace(
        graph,
        nodes=tuple(n for n in graph.nodes if n.id != "Lettuce-1"),
        relations=tuple(r for r in graph.relations if r.subject != "Lettuce-1"),
    )
    diagnosis = Diagnosis(
        "the bowl stands in front of the lettuce",
        tuple(map(Literal.parse, filter(None, ("unblocked(LettuceSliced-1)", besides)))),
        step=None if step is None else Subtask.parse(step),
        refusal="" if step is None else "Bowl-1 stands in front of LettuceSliced-1",
    )
    at = replace(context("make-salad", current, index, graph), refused=refused)
    answer = PlannerReplanner(VALIDATOR, DOMAIN, SearchConfig(time_limit_s=60.0)).replan(
        at, diagnosis
    )
    assert answer.plan is not None, answer.note
    check = VALIDATOR.check(answer.plan, graph, GOALS["make-salad"])
    assert check.ok, check.reason
    return [s.skill if s.args[0] != "Knife-1" else f"{s.skill} knife" for s in answer.plan]


def test_what_a_later_step_minds_is_mended_when_the_hands_are_empty() -> None:
    done = mended("pick_up(LettuceSliced)")
    assert done[:2] == ["slice_obj", "slice_obj"], "the knife is in the hand for both"
    assert done.count("put_on knife") == 1
    assert "pick_up knife" not in done


def test_what_the_step_at_hand_minds_is_mended_at_once() -> None:
    for done in (mended(None), mended("slice_obj(Potato)")):
        assert "put_on knife" in done[: done.index("slice_obj")]
        assert "pick_up knife" in done


def test_nothing_waits_once_the_robot_has_refused_something() -> None:
    done = mended("pick_up(LettuceSliced)", (Subtask("put_on", ("Bowl-1", "StoveBurner-1")),))
    assert "put_on knife" in done[: done.index("slice_obj")]


def test_nothing_waits_that_another_step_may_be_in_need_of() -> None:
    done = mended("pick_up(LettuceSliced)", besides="dirty(Bowl-1)=clean")
    assert "put_on knife" in done[: done.index("slice_obj")]
