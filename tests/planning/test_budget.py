"""One budget for everything that planning does, and who may stop it."""

from __future__ import annotations

import threading
import time
from dataclasses import replace

import pytest

from forestall.deadline import Deadline, TimeUp
from forestall.experiments.yard import drawn
from forestall.planning.goals import alternatives, different
from forestall.planning.ground import ground
from forestall.planning.planner import Planned, plan_goal, pose
from forestall.planning.relevance import everything, narrowed
from forestall.planning.search import SearchConfig, SearchOutcome, _shortened, solve
from forestall.planning.state import State
from forestall.planning.validate import GraphValidator, observed
from forestall.replanning.anew import GoalReplanner
from forestall.replanning.symbolic import PlannerReplanner
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan
from forestall.types.task import Goal
from forestall.types.verdict import Diagnosis, ReplanOutcome
from planning.corpus import DOMAIN, GOALS, KITCHEN, PLANS, goal, home_of, scene
from planning.episodes import context

SLACK_S = 1.0
"""How late an answer may be on a machine on which much else runs."""


def mugs(count: int) -> SceneGraph:
    """A kitchen with many dirty mugs."""
    return scene(
        KITCHEN, *[f"Mug-{i} on CounterTop-{i % 2 + 1}, Mug-{i} is dirty" for i in range(1, count)]
    )


def each(count: int, *texts: str) -> Goal:
    """A goal that asks the same of so many different mugs."""
    whole = goal(*(t.replace("?", f"?m{i}") for i in range(count) for t in texts))
    return replace(whole, variables=tuple((f"?m{i}", "Mug") for i in range(count)))


def test_nine_variables_over_sixty_things_are_planned_for_and_checked() -> None:
    graph, wanted = mugs(61), each(9, "dirty(?)=clean", "on_top_of(?, DiningTable)")
    planned = plan_goal(observed(graph, DOMAIN), wanted, SearchConfig(60.0))
    assert planned.outcome is ReplanOutcome.SOLVED, planned.note
    assert GraphValidator(DOMAIN).check(Plan(planned.subtasks), graph, wanted).ok
    without = GraphValidator(DOMAIN).check(Plan(()), graph, wanted)
    assert not without.ok and without.unmet


def test_a_goal_for_more_things_than_there_are_is_not_met_by_anything() -> None:
    graph = scene(KITCHEN, *(f"Mug-{i} on CounterTop-1" for i in range(2, 9)))
    wanted = each(9, "dirty(?)=clean")
    assert not GraphValidator(DOMAIN).check(Plan(()), graph, wanted).ok
    planned = plan_goal(observed(graph, DOMAIN), wanted)
    assert planned.outcome is ReplanOutcome.UNSOLVABLE
    assert "there are not 9 different things of Mug" in planned.note
    clean = each(8, "dirty(?)=clean")
    assert GraphValidator(DOMAIN).check(Plan(()), graph, clean).ok


def test_different_things_are_bound_in_order_and_dead_ends_are_not_gone_through() -> None:
    several = [list("abc"), list("ab"), list("ab")]
    assert list(different(several, [True] * 3)) == [("c", "a", "b"), ("c", "b", "a")]
    assert list(different([["a"], ["a", "b"]], [True, False])) == [("a", "a"), ("a", "b")]
    assert list(different([], [])) == [()]
    assert list(different([["a", "b"]] * 40 + [[]], [False] * 41)) == []
    many = [[f"x{i}" for i in range(60)]] * 60 + [["x0"]]
    assert list(different(many, [True] * 61)) == []
    assert next(different(many[1:], [True] * 60))[-1] == "x0"


def busy(state: State, wanted: Goal, deadline: Deadline) -> Planned:
    return plan_goal(state, wanted, SearchConfig(3600.0, 10**9, 3600.0), deadline)


HARD = each(14, "filled(?)=coffee", "on_top_of(?, DiningTable)")


def test_the_deadline_is_kept_over_all_parts_and_told_apart() -> None:
    state = observed(mugs(61), DOMAIN)
    start_s = time.monotonic()
    planned = busy(state, HARD, Deadline(0.3))
    assert time.monotonic() - start_s < 0.3 + SLACK_S
    assert planned.outcome is ReplanOutcome.TIMEOUT
    assert planned.note and not planned.subtasks


def test_another_thread_cancels_and_what_was_half_done_is_not_remembered() -> None:
    state = observed(mugs(61), DOMAIN)
    deadline = Deadline()
    found: list[Planned] = []
    worker = threading.Thread(target=lambda: found.append(busy(state, HARD, deadline)))
    worker.start()
    time.sleep(0.1)
    deadline.cancel()
    worker.join(SLACK_S + 1.0)
    assert found and found[0].outcome is ReplanOutcome.TIMEOUT
    planned = plan_goal(state, GOALS["make-coffee"], SearchConfig(60.0))
    assert planned.outcome is ReplanOutcome.SOLVED


@pytest.mark.parametrize("after", [0.0, 0.003, 0.01, 0.03, 0.1])
def test_wherever_it_is_stopped_the_next_plan_is_the_same(after: float) -> None:
    fresh, _ = drawn(60, 3)
    state, wanted = drawn(60, 3)
    whole = plan_goal(fresh, wanted, SearchConfig(60.0))
    state.domain.__dict__.pop("_possible", None)
    state.domain.__dict__.pop("_groundings", None)
    first = plan_goal(state, wanted, SearchConfig(60.0), Deadline(after))
    assert first.outcome in (ReplanOutcome.TIMEOUT, ReplanOutcome.SOLVED, ReplanOutcome.NOT_FOUND)
    assert plan_goal(state, wanted, SearchConfig(60.0)).subtasks == whole.subtasks


def test_every_part_asks_the_deadline() -> None:
    state = observed(mugs(61), DOMAIN)
    over = Deadline(0.0)
    with pytest.raises(TimeUp):
        alternatives(state, HARD, deadline=over)
    goals = alternatives(state, HARD)
    with pytest.raises(TimeUp):
        narrowed(state, goals.conjunctions, deadline=over)
    with pytest.raises(TimeUp):
        ground(state, everything(state), deadline=over)
    problem = pose(observed(scene(KITCHEN), DOMAIN), alternatives(state, GOALS["make-salad"]))
    assert solve(problem, SearchConfig(60.0), over).outcome is SearchOutcome.TIMEOUT


@pytest.mark.parametrize("kind", [PlannerReplanner, GoalReplanner])
def test_a_replanner_stops_when_it_is_told_to(
    kind: type[PlannerReplanner] | type[GoalReplanner],
) -> None:
    graph = scene(home_of("make-coffee"), "Mug-1 held, Cup-1 in CoffeeMachine-1")
    where = context("make-coffee", PLANS["make-coffee"], 3, graph)
    wanted = alternatives(observed(graph, DOMAIN), GOALS["make-coffee"])
    assert wanted.conjunctions
    cause = Diagnosis("a cup is in the way", GOALS["make-coffee"].literals[:1])
    cancelled = Deadline()
    cancelled.cancel()
    answer = kind(GraphValidator(DOMAIN), DOMAIN).replan(where, cause, cancelled)
    assert (answer.outcome, answer.plan) == (ReplanOutcome.TIMEOUT, None)


def test_a_plan_found_too_late_to_be_shortened_is_given_all_the_same() -> None:
    state = observed(scene(KITCHEN), DOMAIN)
    problem = pose(state, alternatives(state, GOALS["make-salad"]))

    steps = list(solve(problem).steps)
    there_and_back = next(
        [i, j]
        for i, one in enumerate(problem.operators)
        for j, other in enumerate(problem.operators)
        if problem.works([one, other, *(problem.operators[k] for k in steps)])
    )
    longer = there_and_back + steps
    assert _shortened(problem, longer, Deadline(0.0)) == longer
    assert len(_shortened(problem, longer, Deadline())) == len(steps)
