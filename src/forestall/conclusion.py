"""What a strategy's answer comes to: the outcome that the monitor tells its caller.

Called by the monitor, calls nothing. A strategy says what it would do; here it is told apart
whether going on was judged, was not judged, or would be in spite of an alarm.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

from forestall.errors import InputError
from forestall.supervision import Limits
from forestall.types.decision import Hold, MonitorDecision, Outcome
from forestall.types.graph import SceneGraph, Seen
from forestall.types.runtime import BoundaryContext, StrategyAnswer, When
from forestall.types.verdict import Decision

Policy = Literal["proceed", "hold"]


@dataclass(frozen=True, slots=True)
class MonitorConfig:
    """Bounds of one run, and what to do where there is no clear answer.

    Args:
        max_subtasks: how many subtasks may be executed.
        max_replans: how many corrected plans may be adopted; asking for more is a "hold". Plans
            that look for something do not count: there are only so many places.
        max_looks: how many observations one boundary may take.
        on_not_judged: whether a subtask may start of which nothing was judged: there is no
            reference, an argument is not located, or the strategy does not judge here.
        on_alarm: whether a subtask may start in spite of an alarm that the strategy lets pass: it
            was not explained, no plan was found, it was repaired too often, or is only watched.
        limits: how long perception and strategy may take, and how often in a row something may go
            wrong.

    Raises:
        InputError: a policy that is neither "proceed" nor "hold", or a bound out of range.
    """

    max_subtasks: int = 150
    max_replans: int = 8
    max_looks: int = 2
    on_not_judged: Policy = "hold"
    on_alarm: Policy = "hold"
    limits: Limits = field(default_factory=Limits)

    def __post_init__(self) -> None:
        for name in ("on_not_judged", "on_alarm"):
            if getattr(self, name) not in ("proceed", "hold"):
                raise InputError(f"{name} is {getattr(self, name)!r}: write 'proceed' or 'hold'")
        for name, least in (("max_subtasks", 0), ("max_replans", 0), ("max_looks", 1)):
            if getattr(self, name) < least:
                raise InputError(f"{name} is {getattr(self, name)}: at least {least} is needed")


def conclude(
    context: BoundaryContext, answer: StrategyAnswer, config: MonitorConfig, strategy: str
) -> MonitorDecision:
    """The outcome of one moment; `plan` is set where a new one is to be followed.

    Args:
        context: what was known.
        answer: what the strategy said.
        config: bounds and policies.
        strategy: its name, for the reason.
    """
    decision = MonitorDecision(
        Outcome.PROCEED,
        True,
        context.subtask,
        verdict=answer.verdict,
        diagnosis=answer.diagnosis,
        replan=answer.replan,
        why=answer.why,
        seconds=answer.seconds,
    )
    if answer.decision is Decision.STOP:
        return _held(decision, Hold.STOPPED, answer.why)
    plan = None if answer.replan is None else answer.replan.plan
    if answer.decision is Decision.REPLAN and plan is not None:
        repairs = context.replans - context.searches
        if repairs >= config.max_replans:
            why = f"{repairs} corrected plans were adopted, and no more may be: {answer.why}"
            return _held(decision, Hold.REPLAN_LIMIT, why)
        return replace(decision, outcome=Outcome.REPLAN, may_start=False, plan=plan)
    if answer.decision is Decision.LOOK_AGAIN and context.may_look:
        return replace(decision, outcome=Outcome.LOOK, may_start=False)
    why = _not_judged(context, answer, strategy)
    if why:
        may = config.on_not_judged == "proceed"
        if context.may_look and not may and unlocated(context):
            return replace(decision, outcome=Outcome.LOOK, may_start=False, why=why)
        return replace(decision, outcome=Outcome.NOT_JUDGED, may_start=may, why=why)
    verdict = answer.verdict
    if verdict is not None and verdict.decision is Decision.STOP:
        return _held(decision, Hold.STOPPED, answer.why or verdict.note)
    if _alarmed(answer) and config.on_alarm == "hold":
        return _held(decision, Hold.ALARM, answer.why or "nothing came of an alarm")
    return decision


def _alarmed(answer: StrategyAnswer) -> bool:
    """Whether somebody speaks against going on: the strategy, or a judge that it only watches."""
    verdict = answer.verdict
    if answer.decision is Decision.REPLAN:  # and it has no plan
        return True
    if verdict is not None and verdict.decision is Decision.REPLAN:
        return True
    return answer.only_watched and any(
        v.judged and v.decision is not Decision.PROCEED for v in answer.watched
    )


def _held(decision: MonitorDecision, hold: Hold, why: str) -> MonitorDecision:
    return replace(decision, outcome=Outcome.HOLD, may_start=False, hold=hold, why=why)


def _not_judged(context: BoundaryContext, answer: StrategyAnswer, strategy: str) -> str:
    """Why nothing was judged, empty where something was.

    One rule stands above what a detector says: nothing is said to fit whose arguments were not
    located. An alarm was judged, whatever else was not seen.
    """
    verdict, again = answer.verdict, answer.decision is Decision.LOOK_AGAIN
    again |= verdict is not None and verdict.decision is Decision.LOOK_AGAIN
    if verdict is not None and verdict.decision is Decision.REPLAN and not again:
        return ""
    unseen = unlocated(context)
    if unseen and verdict is not None:
        return f"not located: {', '.join(unseen)}"
    if verdict is None:
        return answer.why or f"the strategy {strategy} does not judge here"
    if not verdict.judged:
        return verdict.note or "there was nothing to compare with"
    if again:
        return f"another look is asked for and none is left: {answer.why or verdict.note}"
    return ""


def unlocated(context: BoundaryContext) -> tuple[str, ...]:
    """Arguments of the subtask that comes next which are in no view: it cannot be said to fit."""
    if context.when is not When.BEFORE:
        return ()
    return tuple(n for n in context.subtask.args if not _located(context.graph, n))


def _located(graph: SceneGraph, name: str) -> bool:
    return any(
        node.seen is not Seen.UNOBSERVED for node in graph.nodes if name in (node.id, node.category)
    )
