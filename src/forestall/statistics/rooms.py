"""How much rooms matter: the same scenario in several rooms.

Called by `profile`; calls nothing. Every scenario that was run in two rooms or more counts once.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from forestall.statistics.metrics import Alarms
from forestall.statistics.outcomes import Runs, succeeded
from forestall.statistics.rows import EpisodeRow


def over_rooms(setups: Mapping[str, Runs], alarms: Mapping[str, Alarms]) -> dict[str, Any]:
    """Success of each strategy, and alarms in time of each judge, by how they vary over rooms.

    Returns:
        "strategies" and "judges" → name → `scenarios` with several rooms, `runs` in them, `mean`,
        `between` (standard deviation of the scenarios' means), `within` (of the rooms of a
        scenario, on average) and `differing` (share of the scenarios that come out otherwise in
        another room).
    """
    strategies = {
        name: [(r, float(succeeded(r))) for r in runs.values()] for name, runs in setups.items()
    }
    judges = {}
    for name, one in alarms.items():
        seen = one.of.foreseeable & one.seen_by
        share = one.share(one.of.timely)
        judges[name] = [(one.of.rows[k], float(share[k])) for k in np.flatnonzero(seen)]
    return {
        "strategies": _varied(strategies),
        "judges": _varied(judges),
    }


def _varied(values: Mapping[str, Sequence[tuple[EpisodeRow, float]]]) -> dict[str, Any]:
    found = {}
    for name, several in values.items():
        groups: dict[str, dict[int, float]] = {}
        for row, value in several:
            if row.scenario is not None:
                groups.setdefault(row.scenario, {})[row.seed] = value
        rooms = [list(g.values()) for g in groups.values() if len(g) > 1]
        if rooms:
            means = [float(np.mean(g)) for g in rooms]
            found[name] = {
                "scenarios": len(rooms),
                "runs": sum(map(len, rooms)),
                "mean": float(np.mean(means)),
                "between": float(np.std(means, ddof=1)) if len(means) > 1 else None,
                "within": float(np.sqrt(np.mean([np.var(g, ddof=1) for g in rooms]))),
                "differing": float(np.mean([len(set(g)) > 1 for g in rooms])),
            }
    return found
