"""Rows of episodes as tests write them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from forestall.statistics.rows import EpisodeRow, Judged

PLAIN = EpisodeRow(
    set="robofail",
    task="make-coffee",
    scenario="mug-dropped",
    kind="drop",
    knowable="scene",
    seed=20_000,
    strategy="watch",
    detector="scene-graph",
    threshold=0.9,
    without=None,
    known=1,
    effect=2,
    success=False,
    weak_success=None,
    failures=(),
    harmed=(),
    harmed_s=None,
    end="plan finished",
    error="",
    steps=4,
    executed=4,
    refused=0,
    judged=(),
    replans=0,
    planner_calls=0,
    model_calls=0,
    simulated_s=100.0,
    compute_s={},
)


def failing(k: int, strategy: str = "watch", of: str = "robofail", **changes: Any) -> EpisodeRow:
    """The k-th failing run, in the k-th scene."""
    row = replace(PLAIN, set=of, scenario=f"{of}-{k}", seed=20_000 + k, strategy=strategy)
    return replace(row, **changes)


def good(k: int, strategy: str = "watch", of: str = "undisturbed", **changes: Any) -> EpisodeRow:
    """The k-th run without a failure, in the k-th scene."""
    row = replace(
        PLAIN,
        set=of,
        scenario=None if of == "undisturbed" else f"{of}-{k}",
        kind=None,
        knowable=None,
        seed=20_000 + k,
        strategy=strategy,
        known=None,
        effect=None,
        success=True,
    )
    return replace(row, **changes)


def judged(
    scores: Mapping[str, Sequence[float | None]], seconds: float = 10.0, **changes: Any
) -> tuple[Judged, ...]:
    """Boundaries, `seconds` apart, with the scores of each detector."""
    length = len(next(iter(scores.values())))
    return tuple(
        Judged(
            index=i,
            when="before",
            subtask=f"step_{i}",
            time_s=i * seconds,
            score=next(iter(scores.values()))[i],
            decision="proceed",
            scores={name: values[i] for name, values in scores.items()},
            **changes,
        )
        for i in range(length)
    )


def seen(*scores: float | None, name: str = "scene-graph") -> tuple[Judged, ...]:
    """Boundaries with the scores of one detector."""
    return judged({name: scores})
