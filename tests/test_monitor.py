"""A monitor driven by hand, on scene graphs alone: no environment, no perceiver."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from forestall.assembly.configuration import run_config
from forestall.assembly.make import make_strategy
from forestall.conclusion import MonitorConfig
from forestall.domain.load import shipped
from forestall.errors import InputError, PerceptionError, UnknownNameError
from forestall.monitor import Monitor
from forestall.perception.config import ScopeConfig
from forestall.perception.scope import scope
from forestall.strategies.none import NoReplanning
from forestall.tasks.faults import apply_scene_faults
from forestall.tasks.files import load_scenario, load_task
from forestall.tasks.goals import TruthGoalChecker
from forestall.types.decision import Hold, Outcome
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.facts import GRIPPER, Literal
from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph, Seen
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext, LooksAfter, StrategyAnswer, When
from forestall.types.verdict import (
    Calibration,
    Decision,
    Diagnosis,
    Replan,
    ReplanOutcome,
    Verdict,
)
from forestall.worlds.kitchen.flat_world import flat_environment
from test_runtime import memory

PLAN = Plan.parse(["pick_up(Mug)", "put_in(Mug, Sink)"], "a mug in the sink")
DONE = SkillOutcome(SkillStatus.SUCCEEDED, 1.0)
REFUSED = SkillOutcome(SkillStatus.REFUSED, 1.0, "the mug is behind a pot")
FITS = Verdict(Decision.PROCEED, "scripted", 0.95, 0.9, Calibration.FIXED)
ALARM = Verdict(Decision.REPLAN, "scripted", 0.5, 0.9, Calibration.FIXED)
NO_REFERENCE = Verdict(
    Decision.PROCEED, "scripted", None, 0.9, Calibration.UNCALIBRATED, note="no reference"
)
WHY = Diagnosis("the sink is full", (Literal.parse("vacant(Sink-1)"),))
REPAIR = Plan.parse(["pick_up(Bowl-1)", "put_on(Bowl-1, CounterTop)", *PLAN.texts()])
GO = StrategyAnswer(Decision.PROCEED, FITS)
REPLAN = StrategyAnswer(
    Decision.REPLAN, ALARM, WHY, Replan(ReplanOutcome.SOLVED, REPAIR), "the sink is full"
)
LOOK = StrategyAnswer(Decision.LOOK_AGAIN, replace(ALARM, decision=Decision.LOOK_AGAIN))


def node(name: str, x: float = 0.0) -> ObjectNode:
    box = Box((x - 0.1, -0.1, 0.8), (x + 0.1, 0.1, 1.0))
    return ObjectNode(name, name.split("-", maxsplit=1)[0], centroid_m=box.centre, box_m=box)


def scene(held: str | None = None) -> SceneGraph:
    """Two mugs, the second one nearer to the hand, and a sink."""
    hand = ObjectNode(GRIPPER, GRIPPER, centroid_m=(3.0, 0.0, 1.0))
    relations = () if held is None else (Relation(held, "held_by", GRIPPER),)
    return SceneGraph((node("Mug-1"), node("Mug-2", 2.0), node("Sink-1", 1.0), hand), relations)


class Scripted:
    """Gives the answers it was told to give, then goes on; remembers what it was asked."""

    name = "scripted"

    def __init__(
        self, *answers: StrategyAnswer, looks_after: LooksAfter = LooksAfter.NOTHING
    ) -> None:
        self.looks_after = looks_after
        self.answers = list(answers)
        self.asked: list[BoundaryContext] = []
        self.told: list[SkillOutcome] = []

    def _next(self, context: BoundaryContext) -> StrategyAnswer:
        self.asked.append(context)
        return self.answers.pop(0) if self.answers else GO

    def before_subtask(self, context: BoundaryContext) -> StrategyAnswer:
        return self._next(context)

    def after_subtask(self, context: BoundaryContext, outcome: SkillOutcome) -> StrategyAnswer:
        self.told.append(outcome)
        if self.looks_after is LooksAfter.SUBTASK:
            return self._next(context)
        return StrategyAnswer(Decision.PROCEED)

    def after_episode(self, context: BoundaryContext) -> StrategyAnswer:
        return self._next(context)


def started(*answers: StrategyAnswer, **config: object) -> tuple[Monitor, Scripted]:
    strategy = Scripted(*answers)
    monitor = Monitor(strategy, shipped("household"), config=MonitorConfig(**config))  # type: ignore[arg-type]
    monitor.start(PLAN)
    return monitor, strategy


def test_what_was_to_be_cut_is_looked_at_before_anything_is_believed_of_it() -> None:
    """Whether a skill has made other things of one shows where it was, and nowhere else."""
    monitor, _ = started()
    plan = Plan.parse(["slice_obj(Bread)", "put_on(Knife, CounterTop)"], "bread to be toasted")
    more = (node("Knife-1", 3.0), node("Bread-1", 5.0), node("CounterTop-1"))
    held = (Relation("Knife-1", "held_by", GRIPPER),)
    there = replace(scene(), nodes=(*scene().nodes, *more), relations=held)
    monitor.start(plan)
    monitor.before(there)
    bread, counter = there.get("Bread-1"), there.get("CounterTop-1")
    assert bread is not None and counter is not None
    monitor.after(replace(DONE, hand_world_m=None))
    assert monitor.wanted_views() == (bread.centroid_m, counter.centroid_m)
    monitor.before(there)
    monitor.after(replace(DONE, hand_world_m=(0.0, 0.0, 1.0)))
    assert monitor.wanted_views() == ((0.0, 0.0, 1.0), counter.centroid_m), "and once only"


def test_a_run_by_hand_from_graphs_alone() -> None:
    monitor, strategy = started()
    monitor.observe(scene())
    assert monitor.command == Subtask.parse("pick_up(Mug-2)")
    assert monitor.approach() == "Mug-2"
    assert monitor.wanted_views() == (scene().get("Mug-2").centroid_m,)  # type: ignore[union-attr]
    decision = monitor.before(scene())
    assert (decision.outcome, decision.may_start) == (Outcome.PROCEED, True)
    assert decision.command == Subtask.parse("pick_up(Mug-2)")
    assert monitor.after(DONE) is None
    assert monitor.bound == {"Mug": "Mug-2"}
    decision = monitor.before(scene("Mug-2"), "put_in(Mug, Sink)")
    assert decision.command == Subtask.parse("put_in(Mug-2, Sink-1)")
    assert monitor.after(DONE) is None
    assert monitor.finished and monitor.command is None and monitor.approach() is None
    assert monitor.finish(scene()).outcome is Outcome.PROCEED
    assert monitor.final == scene()
    assert [c.when for c in strategy.asked] == [When.BEFORE, When.BEFORE, When.END]
    assert [c.done for c in strategy.asked] == [0, 1, 2]
    assert all(c.observation is None for c in strategy.asked)
    assert strategy.asked[0].scoped.subtask == Subtask.parse("pick_up(Mug-2)")


def test_every_moment_has_its_record() -> None:
    monitor, _ = started(LOOK, GO)
    monitor.observe(scene())
    first, second = monitor.before(scene()).record, monitor.before(scene()).record
    assert first is not None and second is not None
    assert (first.index, first.looks, first.outcome) == (0, 1, Outcome.LOOK)
    assert (second.index, second.looks, second.outcome) == (0, 2, Outcome.PROCEED)
    assert dict(first.seconds).keys() == {"perceive", "strategy"}
    total = dict(second.compute_s)
    assert total == dict(monitor.seconds)
    assert sum(total.values()) > sum(s for r in (first, second) for _, s in r.seconds)
    monitor.after(DONE)
    with monitor.phase("observe"):
        pass
    third = monitor.before(scene("Mug-2")).record
    assert third is not None and third.index == 1 and "observe" in dict(third.seconds)
    assert monitor.executed[0].index == 0


@pytest.mark.parametrize(("policy", "may"), [("hold", False), ("proceed", True)])
@pytest.mark.parametrize(
    "answer", [StrategyAnswer(Decision.PROCEED), StrategyAnswer(Decision.PROCEED, NO_REFERENCE)]
)
def test_what_was_not_judged_is_not_said_to_proceed(
    answer: StrategyAnswer, policy: str, may: bool
) -> None:
    monitor, _ = started(answer, on_not_judged=policy)
    decision = monitor.before(scene())
    assert (decision.outcome, decision.may_start) == (Outcome.NOT_JUDGED, may)
    assert decision.why
    assert decision.record is not None and decision.record.outcome is Outcome.NOT_JUDGED


def test_holding_is_the_default_and_the_caller_may_overrule_it() -> None:
    monitor = Monitor(NoReplanning(), shipped("household"))
    monitor.start(PLAN)
    decision = monitor.before(scene())
    assert (decision.outcome, decision.may_start) == (Outcome.NOT_JUDGED, False)
    assert monitor.after(DONE) is None
    assert [str(e.subtask) for e in monitor.executed] == ["pick_up(Mug-2)"]


def without(name: str) -> SceneGraph:
    return SceneGraph(tuple(n for n in scene().nodes if n.category != name))


def lost(name: str) -> SceneGraph:
    return SceneGraph(
        tuple(
            replace(n, seen=Seen.UNOBSERVED, centroid_m=None, box_m=None)
            if n.category == name
            else n
            for n in scene().nodes
        )
    )


@pytest.mark.parametrize("graph", [without("Mug"), lost("Mug")])
def test_an_argument_that_is_not_located_is_not_judged(graph: SceneGraph) -> None:
    monitor, _ = started()
    assert monitor.before(graph).outcome is Outcome.LOOK
    decision = monitor.before(graph)
    assert decision.outcome is Outcome.NOT_JUDGED
    assert "Mug" in decision.why
    assert monitor.approach() is None


def test_a_graph_without_geometry_is_enough() -> None:
    plain = SceneGraph(tuple(ObjectNode(f"{c}-1", c) for c in ("Mug", "Sink")))
    monitor, _ = started()
    decision = monitor.before(plain)
    assert decision.outcome is Outcome.PROCEED
    assert decision.command == Subtask.parse("pick_up(Mug-1)")
    assert monitor.wanted_views() == ()


def test_another_look_and_no_more() -> None:
    monitor, strategy = started(LOOK, LOOK)
    decision = monitor.before(scene())
    assert (decision.outcome, decision.may_start) == (Outcome.LOOK, False)
    assert decision.look_at == (scene().get("Mug-2").centroid_m,)  # type: ignore[union-attr]
    decision = monitor.before(scene())
    assert [c.may_look for c in strategy.asked] == [True, False]
    assert decision.outcome is Outcome.NOT_JUDGED
    assert "none is left" in decision.why


def test_a_new_plan_is_followed_from_its_start() -> None:
    monitor, strategy = started(GO, REPLAN)
    monitor.before(scene())
    monitor.after(DONE)
    decision = monitor.before(scene("Mug-2"))
    assert (decision.outcome, decision.may_start) == (Outcome.REPLAN, False)
    assert decision.plan == monitor.plan == REPAIR
    assert decision.diagnosis == WHY
    with pytest.raises(InputError, match="judged before"):
        monitor.after(DONE)
    monitor.before(scene())
    assert (strategy.asked[-1].index, strategy.asked[-1].replans) == (0, 1)


def test_one_plan_too_many_is_a_hold() -> None:
    monitor, _ = started(REPLAN, max_replans=0)
    decision = monitor.before(scene())
    assert (decision.outcome, decision.hold) == (Outcome.HOLD, Hold.REPLAN_LIMIT)
    assert "the sink is full" in decision.why
    assert monitor.plan == PLAN


def test_looking_for_something_uses_up_no_repair() -> None:
    """There are only so many places to look into, and each is looked into once."""
    assert REPLAN.replan is not None
    search = replace(REPLAN, replan=replace(REPLAN.replan, looking_for=("Bowl",)))
    monitor, _ = started(search, search, search, REPLAN, search, max_replans=1)
    outcomes = [monitor.before(scene()).outcome for _ in range(5)]
    assert outcomes == [Outcome.REPLAN] * 4 + [Outcome.HOLD]


def test_a_strategy_that_stops_holds_the_robot() -> None:
    monitor, _ = started(StrategyAnswer(Decision.STOP, ALARM, WHY, why="no repair found"))
    decision = monitor.before(scene())
    assert (decision.outcome, decision.hold) == (Outcome.HOLD, Hold.STOPPED)
    assert (decision.may_start, decision.why) == (False, "no repair found")


@pytest.mark.parametrize(
    ("policy", "outcome"), [("hold", Outcome.HOLD), ("proceed", Outcome.PROCEED)]
)
def test_an_alarm_that_nothing_comes_of_is_for_the_caller_to_pass(
    policy: str, outcome: Outcome
) -> None:
    dismissed = StrategyAnswer(Decision.PROCEED, ALARM, why="nothing must change")
    monitor, _ = started(dismissed, on_alarm=policy)
    decision = monitor.before(scene())
    assert decision.outcome is outcome
    assert decision.hold is (Hold.ALARM if policy == "hold" else None)
    assert decision.why == "nothing must change"


@pytest.mark.parametrize(
    "answer",
    [
        StrategyAnswer(Decision.REPLAN, FITS),
        StrategyAnswer(Decision.REPLAN, FITS, None, Replan(ReplanOutcome.TIMEOUT)),
        StrategyAnswer(Decision.PROCEED, replace(FITS, decision=Decision.LOOK_AGAIN)),
        StrategyAnswer(Decision.PROCEED, replace(FITS, decision=Decision.STOP)),
        StrategyAnswer(Decision.PROCEED, FITS, watched=(FITS, ALARM), only_watched=True),
    ],
)
def test_an_answer_that_contradicts_itself_lets_nothing_start(answer: StrategyAnswer) -> None:
    monitor, _ = started(answer)
    decision = monitor.before(scene())
    assert decision.outcome is not Outcome.PROCEED
    assert not decision.may_start


def test_as_many_subtasks_as_may_be() -> None:
    monitor, strategy = started(max_subtasks=1)
    monitor.before(scene())
    monitor.after(DONE)
    decision = monitor.before(scene("Mug-2"))
    assert (decision.outcome, decision.hold) == (Outcome.HOLD, Hold.SUBTASK_LIMIT)
    assert len(strategy.asked) == 1


def test_a_refusal_unbinds_and_its_reason_is_not_told() -> None:
    monitor, strategy = started()
    monitor.before(scene())
    assert monitor.after(REFUSED) is None
    assert monitor.bound == {}
    assert strategy.told == [replace(REFUSED, reason="")]
    assert monitor.executed[0].outcome == REFUSED
    assert monitor.command == Subtask.parse("put_in(Mug-2, Sink-1)")


def test_what_a_subtask_has_led_to_is_looked_at_where_the_strategy_wants_it() -> None:
    strategy = Scripted(GO, LOOK, GO, looks_after=LooksAfter.SUBTASK)
    monitor = Monitor(strategy, shipped("household"))
    monitor.start(PLAN)
    monitor.before(scene())
    let_go = replace(DONE, hand_world_m=(5.0, 5.0, 1.0))
    asked = monitor.after(let_go)
    assert asked is not None and asked.outcome is Outcome.LOOK
    assert asked.look_at == monitor.wanted_views()
    assert asked.look_at[0] == (5.0, 5.0, 1.0)
    again = monitor.after(let_go, scene())
    assert again is not None and again.outcome is Outcome.LOOK
    fine = monitor.after(let_go, scene())
    assert fine is not None and fine.outcome is Outcome.PROCEED
    assert fine.record is not None
    assert (fine.record.index, fine.record.when, fine.record.looks) == (0, When.AFTER, 2)
    assert len(monitor.executed) == 1
    assert monitor.before(scene("Mug-2")).record.index == 1  # type: ignore[union-attr]


def test_the_end_is_looked_at_where_the_strategy_wants_it() -> None:
    strategy = Scripted(GO, GO, REPLAN, looks_after=LooksAfter.EPISODE)
    monitor = Monitor(strategy, shipped("household"))
    monitor.start(PLAN)
    for held in (None, "Mug-2"):
        monitor.before(scene(held))
        monitor.after(DONE)
    assert monitor.finish().outcome is Outcome.LOOK
    decision = monitor.finish(scene())
    assert (decision.outcome, decision.plan) == (Outcome.REPLAN, REPAIR)
    assert not monitor.finished


def nothing_started(monitor: Monitor) -> object:
    return Monitor(Scripted(), shipped("household")).before(scene())


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (nothing_started, "start"),
        (lambda m: m.after(DONE), "judged before"),
        (lambda m: m.finish(), "not finished"),
        (lambda m: m.before(scene(), "open_obj(Fridge)"), "next is pick_up"),
        (lambda m: m.before(scene(), "fly(Mug)"), "fly"),
    ],
)
def test_calls_out_of_order_are_told(call: Callable[[Monitor], object], says: str) -> None:
    monitor, _ = started()
    with pytest.raises(InputError, match=says):
        call(monitor)


def test_a_subtask_further_on_skips_what_lies_between() -> None:
    monitor, strategy = started()
    decision = monitor.before(scene("Mug-2"), "put_in(Mug-2, Sink-1)")
    assert decision.command == Subtask.parse("put_in(Mug-2, Sink-1)")
    assert strategy.asked[0].done == 1
    monitor.after(DONE)
    assert monitor.finished
    with pytest.raises(InputError, match="finish"):
        monitor.before(scene())


def test_an_error_in_a_part_holds_and_is_named() -> None:
    class Broken(Scripted):
        def before_subtask(self, context: BoundaryContext) -> StrategyAnswer:
            raise PerceptionError("the camera is gone")

    monitor = Monitor(Broken(), shipped("household"), config=MonitorConfig(on_not_judged="proceed"))
    monitor.start(PLAN)
    decision = monitor.before(scene())
    assert (decision.outcome, decision.hold) == (Outcome.HOLD, Hold.INTERNAL)
    assert not decision.may_start
    assert decision.why == "strategy scripted: the camera is gone"
    with pytest.raises(InputError, match="judged before"):
        monitor.after(DONE)


def test_starting_again_forgets() -> None:
    monitor, _ = started(REPLAN)
    monitor.before(scene())
    monitor.start(PLAN)
    assert (monitor.plan, monitor.executed, monitor.bound) == (PLAN, (), {})
    assert monitor.seconds == ()


@pytest.mark.parametrize(
    "config", [{"on_not_judged": "maybe"}, {"on_alarm": ""}, {"max_looks": 0}, {"max_replans": -1}]
)
def test_a_policy_or_a_bound_that_cannot_be(config: dict[str, object]) -> None:
    with pytest.raises(InputError, match=next(iter(config))):
        MonitorConfig(**config)  # type: ignore[arg-type]


def test_the_real_strategy_on_graphs_of_the_callers_own() -> None:
    """An executive that owns the robot: the microwave is occupied, and is emptied first."""
    loaded = load_task("heat-potato")
    faults = load_scenario("microwave-occupied").faults
    needs = apply_scene_faults(loaded.task.scene, faults, loaded.domain)
    kitchen = flat_environment(needs, loaded.domain)
    kitchen.reset(3)
    monitor = Monitor(
        make_strategy(run_config("heat-potato", seed=3), loaded.domain, memory()),
        loaded.domain,
        config=MonitorConfig(on_alarm="proceed"),
        scope=lambda graph, subtask: scope(graph, subtask, loaded.domain, ScopeConfig()),
    )
    monitor.start(loaded.task)
    outcomes = []
    while not monitor.finished:
        place = monitor.approach()
        if place is not None:
            kitchen.approach(place)
        decision = monitor.before(kitchen.oracle.truth())
        outcomes.append(decision.outcome)
        if decision.may_start:
            assert decision.command is not None
            monitor.after(kitchen.execute(decision.command))
        else:
            assert decision.outcome is Outcome.REPLAN, decision.why
            assert decision.diagnosis is not None and "Bowl-1" in decision.diagnosis.cause
    assert outcomes.count(Outcome.REPLAN) == 1
    assert all(e.outcome.status is SkillStatus.SUCCEEDED for e in monitor.executed)
    strict, _, why = TruthGoalChecker(loaded.domain).check(loaded.task.goal, kitchen.oracle)
    assert strict, why


def test_an_unlocated_argument_is_not_looked_for_where_a_caller_goes_on_anyway() -> None:
    monitor, _ = started(on_not_judged="proceed")
    decision = monitor.before(without("Mug"))
    assert (decision.outcome, decision.may_start) == (Outcome.NOT_JUDGED, True)


def test_a_single_question() -> None:
    monitor, strategy = started()
    decision = monitor.check(scene(), "pick_up(Mug-1)")
    assert (decision.outcome, decision.may_start) == (Outcome.PROCEED, True)
    assert strategy.asked[-1].may_look is False
    assert monitor.check(without("Mug"), "pick_up(Mug)").outcome is Outcome.NOT_JUDGED
    with pytest.raises(InputError, match="pick_up takes 1"):
        monitor.check(scene(), "pick_up(Mug, Sink)")


def test_a_scene_may_be_written_by_hand() -> None:
    monitor, _ = started()
    written = {"objects": ["Mug-1", "Sink-1"], "relations": ["Mug-1 held_by gripper"]}
    decision = monitor.check(written, "put_in(Mug, Sink)")
    assert decision.command == Subtask.parse("put_in(Mug-1, Sink-1)")


def test_what_was_refused_is_not_tried_again_the_same_way() -> None:
    monitor, strategy = started()
    assert monitor.before(scene()).command == Subtask.parse("pick_up(Mug-2)")
    monitor.after("refused", reason="the mug is behind a pot")
    monitor.before(scene())
    assert strategy.asked[-1].refused == (Subtask.parse("pick_up(Mug-2)"),)
    monitor.start(Plan.parse(["pick_up(Mug)", "pick_up(Mug)", "pick_up(Mug-2)"]))
    monitor.before(scene())
    monitor.after("refused")
    assert monitor.before(scene()).command == Subtask.parse("pick_up(Mug-1)")
    monitor.after("refused")
    asked = monitor.before(scene())
    assert asked.subtask in strategy.asked[-1].refused
    changed = monitor.before(scene("Mug-2"))
    assert changed.subtask not in strategy.asked[-1].refused


def test_an_outcome_is_one_of_three_words() -> None:
    monitor, _ = started()
    monitor.before(scene())
    with pytest.raises(UnknownNameError, match="refused"):
        monitor.after("refuse")
