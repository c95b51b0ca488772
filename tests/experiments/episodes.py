"""Episodes that cost nothing: what a worker answers when nothing is simulated."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Any

from forestall.experiments.worker import Work, broken_row, prepared_run
from forestall.statistics.rows import EpisodeRow, Judged

DEADLY = "boil-water"
"""The task whose episodes end their worker."""


def computed_row(work: Work) -> dict[str, Any]:
    """A row with scores, drawn from the run's key."""
    run = work.run
    empty = broken_row(run, "", prepared_run(run, work.settings))
    good = run.strategy == "proactive" or not run.case.failing
    low = 0.8 if run.case.failing else 0.95
    judged = tuple(
        Judged(
            index=k,
            when="before",
            subtask="pick_up(Mug)",
            time_s=5.0 * k,
            score=score,
            decision="replan" if score < run.threshold else "proceed",
            confirmed=score < run.threshold,
            scores={"scene-graph": score, "image": 0.86 + 0.01 * k}
            if run.strategy == "watch"
            else {},
            possible=True,
            reachable=not run.case.failing,
        )
        for k, score in enumerate((1.0, low, 1.0))
    )
    row: EpisodeRow = replace(
        empty,
        success=good,
        weak_success=good,
        failures=() if good else ("not reached",),
        end="plan finished",
        error="",
        executed=3,
        judged=judged,
        simulated_s=15.0,
        compute_s={"perceive": 0.1},
        reasoning_s=0.1,
    )
    return row.to_json()


def deadly_row(work: Work) -> dict[str, Any]:
    """As `computed_row`, but for one task."""
    if work.run.case.task == DEADLY:
        os._exit(1)
    return computed_row(work)
