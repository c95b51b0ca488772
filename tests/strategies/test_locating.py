"""REFLECT's way through a run: subgoals verified in turn, the first that fails explained."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from scripted import BEFORE, HOT, OPEN, PLAN, REPAIRED, Parts, boundary

from forestall.strategies.online import VERIFIED, Online
from forestall.strategies.post_hoc import PostHoc
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.exchange import Exchange
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.types.runtime import BoundaryContext, StrategyAnswer, When
from forestall.types.story import Located, Tried, Verified
from forestall.types.verdict import Decision, Diagnosis

DONE = SkillOutcome(SkillStatus.SUCCEEDED, 1.0)
REFUSED = SkillOutcome(SkillStatus.REFUSED, 1.0)
DRIVE = Subtask.parse("navigate_to_obj(Microwave)")
END = boundary(When.END, index=len(PLAN), looks=2, may_look=False)


def asked(purpose: str) -> tuple[Exchange, ...]:
    return (Exchange(purpose, "m", "k", (), "{}"),)


class Told:
    """A locator that says which subtasks did what they are for."""

    name = "told"

    def __init__(self, *failed: str, knows: bool = True, says: Diagnosis | None = None) -> None:
        self.failed, self.knows, self.says = failed, knows, says
        self.verified: list[str] = []
        self.explained: list[tuple[tuple[str, ...], Tried | None]] = []
        self.seen: list[SceneGraph | None] = []

    def verify(self, context: BoundaryContext, tried: Tried) -> Verified:
        self.verified.append(tried.subtask.skill)
        self.seen.append(tried.seen)
        found = tried.subtask.skill not in self.failed if self.knows else None
        return Verified(found, "it is not there", asked("verifying"))

    def explain(
        self, context: BoundaryContext, story: Sequence[Tried], failed: Tried | None
    ) -> Located:
        self.explained.append((tuple(t.subtask.skill for t in story), failed))
        return Located(failed, self.says, asked("locating"))


SAYS = Diagnosis("located: it was shut", (OPEN,), producer="told", advice="open it")


def scope(graph: SceneGraph, subtask: Subtask) -> SceneGraph:
    return replace(graph, subtask=subtask)


def after_all(parts: Parts, locator: Told) -> PostHoc:
    """The whole plan was run, driving in it."""
    strategy = PostHoc(parts, parts, parts, parts, parts, locator=locator, scope=scope)
    for index, step in enumerate((PLAN.subtasks[0], DRIVE, *PLAN.subtasks[1:])):
        at = boundary(index=index, subtask=step)
        strategy.before_subtask(at)
        strategy.after_subtask(at, DONE)
    return strategy


def test_post_hoc_explains_the_first_subgoal_that_was_not_reached() -> None:
    locator = Told("put_in", "close_obj", says=SAYS)
    strategy = after_all(Parts(Decision.REPLAN, (OPEN,), rest_runs=False), locator)
    answer = strategy.after_episode(END)
    assert locator.verified == ["pick_up", "put_in"], "driving is no subgoal, later ones wait"
    ((story, failed),) = locator.explained
    assert story == ("pick_up", "navigate_to_obj", "put_in", "close_obj")
    assert failed is not None and failed.number == 3
    assert all(s is not None and s.subtask is not None for s in locator.seen)
    found = answer.diagnosis
    assert found is not None and found.cause == SAYS.cause and found.advice == "open it"
    assert found.must_change == (HOT,), "at the end the goal is missing, and nothing else"
    assert [e.purpose for e in found.exchanges] == ["verifying", "verifying", "locating"]
    assert answer.decision is Decision.REPLAN


def test_where_every_subgoal_was_reached_the_plan_is_asked_about() -> None:
    locator = Told(says=SAYS)
    after_all(Parts(Decision.PROCEED, rest_runs=False), locator).after_episode(END)
    assert locator.verified == ["pick_up", "put_in", "close_obj"]
    assert locator.explained[0][1] is None


def test_post_hoc_falls_back_to_the_scenes_where_nobody_can_say() -> None:
    for locator in (Told(knows=False), Told("put_in")):
        strategy = after_all(Parts(Decision.REPLAN, (OPEN,), rest_runs=False), locator)
        found = strategy.after_episode(END).diagnosis
        assert found is not None and found.producer == "scripted"
        assert found.cause.startswith("located at step") and found.exchanges
    assert locator.verified == ["pick_up", "put_in"]


def test_post_hoc_asks_about_a_goal_that_is_missed_and_once() -> None:
    locator = Told(says=SAYS)
    after_all(Parts(Decision.PROCEED), locator).after_episode(END)
    assert not locator.verified
    strategy = after_all(Parts(Decision.PROCEED, rest_runs=False), locator)
    strategy.after_episode(END)
    asked_before = len(locator.verified)
    strategy.before_subtask(boundary(plan=REPAIRED, index=0, replans=1))
    strategy.after_episode(replace(END, plan=REPAIRED, replans=1))
    assert len(locator.verified) == asked_before


def during(
    parts: Parts, locator: Told, outcome: SkillOutcome = DONE, subtask: Subtask = PLAN.subtasks[1]
) -> tuple[StrategyAnswer, Parts]:
    strategy = Online(parts, parts, parts, parts, parts, scope, locator=locator)
    strategy.before_subtask(boundary(subtask=subtask))
    at = boundary(When.AFTER, may_look=False, subtask=subtask, graph=BEFORE)
    return strategy.after_subtask(at, outcome), parts


def test_online_goes_on_where_the_subtask_did_what_it_is_for() -> None:
    parts, locator = Parts(Decision.REPLAN, (OPEN,)), Told()
    answer, _ = during(parts, locator)
    assert answer.decision is Decision.PROCEED and not parts.judged
    verdict = answer.verdict
    assert verdict is not None
    assert (verdict.detector, verdict.decision) == (VERIFIED, Decision.PROCEED)
    assert [e.purpose for e in verdict.exchanges] == ["verifying"]


def test_online_explains_what_did_not_and_goes_on_behind_it() -> None:
    parts, locator = Parts(Decision.PROCEED), Told("put_in", says=SAYS)
    answer, _ = during(parts, locator)
    assert answer.decision is Decision.REPLAN
    assert answer.diagnosis == SAYS and not parts.asked
    assert parts.replanned_at == 2
    ((_, failed),) = locator.explained
    assert failed is not None and failed.status is SkillStatus.SUCCEEDED


def test_online_words_alone_get_their_facts_from_the_check_of_the_plan() -> None:
    says = replace(SAYS, must_change=())
    parts = Parts(Decision.PROCEED, rest_runs=False)
    answer, _ = during(parts, Told("put_in", says=says))
    found = answer.diagnosis
    assert found is not None and found.advice == "open it" and found.must_change == (HOT,)


def test_online_explains_what_the_robot_refused_from_the_story() -> None:
    parts, locator = Parts(Decision.PROCEED), Told(says=SAYS)
    answer, _ = during(parts, locator, REFUSED)
    assert not locator.verified and len(locator.explained) == 1
    assert answer.diagnosis == SAYS and not parts.asked


def test_online_compares_where_nobody_can_say_and_after_driving() -> None:
    parts, locator = Parts(Decision.PROCEED), Told(knows=False)
    answer, _ = during(parts, locator)
    assert parts.judged and answer.verdict is not None
    assert answer.verdict.detector == "scripted"
    assert [e.purpose for e in answer.verdict.exchanges] == ["verifying"]
    parts, locator = Parts(Decision.PROCEED), Told("navigate_to_obj")
    during(parts, locator, subtask=DRIVE)
    assert parts.judged and not locator.verified
