"""The one builder of a boundary's record; called by the monitor, calls nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from forestall.types.decision import Outcome
from forestall.types.episode import BoundaryRecord
from forestall.types.runtime import BoundaryContext, StrategyAnswer
from forestall.types.verdict import Verdict


def boundary_record(
    index: int,
    context: BoundaryContext,
    answer: StrategyAnswer,
    outcome: Outcome,
    before: Mapping[str, float],
    until: Mapping[str, float],
    time_s: float,
    sentence: str = "",
) -> BoundaryRecord:
    """The record of one look at one moment.

    Args:
        index: of the boundary; its looks share it, and so does what is judged after its subtask.
        context: what was known.
        answer: what the strategy said.
        outcome: what the monitor made of it.
        before: compute seconds by phase when the boundary began.
        until: the same now.
        time_s: of the robot's clock.
        sentence: what the owner is told.
    """
    spent = {name: seconds - before.get(name, 0.0) for name, seconds in until.items()}
    return BoundaryRecord(
        index=index,
        subtask=context.subtask,
        graph=context.graph,
        scoped=context.scoped,
        observation=context.observation,
        looks=context.looks,
        verdict=None if answer.verdict is None else _kept(answer.verdict),
        diagnosis=answer.diagnosis,
        replan=answer.replan,
        why=answer.why,
        seconds=tuple(sorted((k, v) for k, v in spent.items() if v > 0)),
        time_s=time_s,
        when=context.when,
        watched=tuple(_kept(v) for v in answer.watched),
        outcome=outcome,
        compute_s=tuple(sorted(until.items())),
        sentence=sentence,
    )


def _kept(verdict: Verdict) -> Verdict:
    """Of the nearest reference the memory keeps picture and aftermath; a record names it."""
    if verdict.nearest is None:
        return verdict
    return replace(verdict, nearest=replace(verdict.nearest, view=None, after=None))
