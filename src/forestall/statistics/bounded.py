"""Judges under one bound on false alarms, drawn from good runs of other rooms.

Called by `profile`; calls the calibration and metrics. Each threshold is the largest at which at
most a share `LEVEL` of new good runs raises an unfounded alarm, whatever the distribution of
scores (`calibration.conformal`, `calibration.joint`). Unfounded is an alarm where the truth has
nothing against going on: a run that goes well although a step of it is refused would else make a
false alarm of the truth itself. The runs that it is drawn from are the undisturbed
ones of a split of their own; nothing of the runs that are counted is looked at.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from forestall.calibration.conformal import NOT_JUDGED, extreme, smallest_level
from forestall.calibration.joint import thresholds
from forestall.errors import InputError
from forestall.statistics.intervals import Floats
from forestall.statistics.judges import MINED, MODELS, PRIMARY, plan_check
from forestall.statistics.metrics import Alarms, point_metrics
from forestall.statistics.rows import EpisodeRow
from forestall.statistics.watches import ALL, Watches

LEVEL = 0.05
"""Share of good runs in which an unfounded alarm may be raised."""


@dataclass(frozen=True, slots=True)
class Bounded:
    """Judges that are asked together under one bound.

    Args:
        name: as tables have it.
        columns: each the judges that must agree on an alarm; any column raises one.
    """

    name: str
    columns: tuple[tuple[str, ...], ...]

    @property
    def judges(self) -> tuple[str, ...]:
        """All of them, each once."""
        return tuple(dict.fromkeys(j for column in self.columns for j in column))


def groups(known: Iterable[str]) -> Iterator[Bounded]:
    """Every judge alone, and those that learn with each plan check: any of them, or all."""
    names = set(known)
    yield from (Bounded(name, ((name,),)) for name in sorted(names))
    for model in MODELS:
        check = plan_check(model)
        found = [
            *(Bounded(f"{judge} or {check}", ((judge,), (check,))) for judge in (PRIMARY, MINED)),
            *(Bounded(f"{judge} and {check}", ((judge, check),)) for judge in (PRIMARY, MINED)),
            Bounded(f"{PRIMARY} or {MINED} or {check}", ((PRIMARY,), (MINED,), (check,))),
        ]
        yield from (group for group in found if names.issuperset(group.judges))


def bounded(
    rows: Sequence[EpisodeRow], calibration: Sequence[EpisodeRow], level: float = LEVEL
) -> dict[str, Any]:
    """What each group of judges is worth at the bound.

    Args:
        rows: of one profile, to be counted.
        calibration: of the same profile and other rooms.
        level: the bound on unfounded alarms per run.

    Returns:
        `runs` that it was calibrated by, `level`, `smallest_level` that so many can show, and
        `judges`: name → metrics as of `point_metrics`, with the `thresholds` of its columns, None
        for a column that may never alarm.

    Raises:
        InputError: rooms of both are the same ones.
    """
    counted, good = Watches.of(rows), Watches.of(calibration)
    both = _rooms(rows) & _rooms(calibration)
    if both:
        raise InputError(f"calibrated in a room that is counted: {min(both)}")
    runs = np.flatnonzero(good.undisturbed)
    found = {}
    for group in groups(set(counted.names) & set(good.names)):
        counts = np.isin(good.run, runs) & good.faultless
        own = [line[counts] for line in _lines(good, group)]
        of_run = good.run[counts]
        extremes = np.array([[_extreme(line[of_run == r]) for line in own] for r in runs])
        drawn: Sequence[float | None] = [None] * len(group.columns)
        if len(runs):
            drawn = thresholds(extremes, [1.0] * len(group.columns), level)
        found[group.name] = {
            **point_metrics(_alarms(counted, group, drawn), ALL),
            "thresholds": list(drawn),
        }
    return {
        "runs": len(runs),
        "level": level,
        "smallest_level": smallest_level(len(runs)),
        "judges": found,
    }


def _rooms(rows: Iterable[EpisodeRow]) -> set[tuple[str, int]]:
    return {(r.task, r.seed) for r in rows}


def _lines(of: Watches, group: Bounded) -> list[Floats]:
    """The scores of each column; who must agree counts by the one that minds least."""
    scores: Mapping[str, Floats] = of.scores
    return [
        np.max([np.nan_to_num(scores[j], nan=NOT_JUDGED) for j in column], axis=0)
        for column in group.columns
    ]


def _extreme(line: Floats) -> float:
    return extreme(line.tolist())


def _alarms(of: Watches, group: Bounded, drawn: Sequence[float | None]) -> Alarms:
    raised = np.zeros(len(of.judged), bool)
    for line, threshold in zip(_lines(of, group), drawn, strict=True):
        if threshold is not None:
            raised |= line < threshold
    seen = np.all([of.seen_by[j] for j in group.judges], axis=0)
    return Alarms(of, raised[None, :], seen, group.judges)
