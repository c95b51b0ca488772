"""A calibration to try things on: two judges, two tasks, a skill that cannot be undone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from forestall.calibration.fitted import CalibrationTable
from forestall.calibration.scores import JudgedBoundary, JudgedRun, Parts, scores_of

TURN, BREAK = "turn", "break"


def run(name: str, task: str, score: float, alarm: bool = False) -> JudgedRun:
    """Before a reversible skill it fits as well as `score`, before the other a little better."""
    return JudgedRun(
        name,
        task,
        (
            JudgedBoundary("likeness", TURN, score),
            JudgedBoundary("likeness", TURN, None),
            JudgedBoundary("likeness", BREAK, min(1.0, score + 0.05)),
            JudgedBoundary("facts", TURN, 1.0, asked=alarm),
            JudgedBoundary("facts", BREAK, 0.0 if alarm else 1.0),
        ),
    )


def runs(many: int = 99, few: int = 5, alarms: int = 0, seed: int = 0) -> list[JudgedRun]:
    """Good runs of a task with many of them and of one with few, which fit less well."""
    rng = np.random.default_rng(seed)
    return [
        *(
            run(f"many-{i}", "many", round(0.8 + 0.2 * rng.random(), 6), i < alarms)
            for i in range(many)
        ),
        *(run(f"few-{i}", "few", round(0.7 + 0.1 * rng.random(), 6)) for i in range(few)),
    ]


def table(judged: list[JudgedRun] | None = None, **changed: Any) -> CalibrationTable:
    """Over one judge or both, not divided unless that is said."""
    parts = changed.pop("parts", Parts.NONE)
    judges = changed.pop("judges", ("likeness",))
    share = changed.pop("share", 2 / 3)
    kept = [
        replace(r, boundaries=tuple(b for b in r.boundaries if b.judge in judges))
        for r in (runs() if judged is None else judged)
    ]
    scores = scores_of(kept, parts, (BREAK,), share)
    return CalibrationTable(scores, parts=parts, irreversible=(BREAK,), **changed)
