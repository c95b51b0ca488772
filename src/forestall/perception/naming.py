"""Names for detections whose segmenter does not track instances.

A detection takes the name of the nearest object of its category that is close to where it was
(assignment by least total distance), or a new number. Called by the perceiver.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from forestall.perception.unproject import Cloud, Points
from forestall.types.facts import category_of
from forestall.types.observation import Detection

_NEVER = 1e6


def name_detections(
    detections: Sequence[Detection],
    clouds: Sequence[Cloud | None],
    known: Mapping[str, Points],
    reach_m: float,
) -> list[str]:
    """An instance name for every detection.

    Args:
        detections: of one frame; those with an instance keep it.
        clouds: where they are; None where depth is missing.
        known: instance → centroid (3,) of everything located so far.
        reach_m: farthest distance over which a detection is taken for a known object.
    """
    names = [d.instance or "" for d in detections]
    taken = {n for n in names if n}
    open_ones = [i for i, n in enumerate(names) if not n]
    for category in sorted({detections[i].category for i in open_ones}):
        mine = [i for i in open_ones if detections[i].category == category]
        mine.sort(key=lambda i: _order(clouds[i]))
        options = [n for n in sorted(known) if category_of(n) == category and n not in taken]
        for i, name in _assigned(mine, options, clouds, known, reach_m).items():
            names[i] = name
            taken.add(name)
        used = {n for n in (*known, *taken) if category_of(n) == category}
        number = 1
        for i in mine:
            while not names[i]:
                candidate = f"{category}-{number}"
                number += 1
                if candidate not in used:
                    names[i] = candidate
                    used.add(candidate)
    return names


def _order(cloud: Cloud | None) -> tuple[float, ...]:
    return (np.inf,) if cloud is None else tuple(float(v) for v in cloud.centroid_m)


def _assigned(
    mine: Sequence[int],
    options: Sequence[str],
    clouds: Sequence[Cloud | None],
    known: Mapping[str, Points],
    reach_m: float,
) -> dict[int, str]:
    located = [i for i in mine if clouds[i] is not None]
    if not located or not options:
        return {}
    here = np.stack([c.centroid_m for i in located if (c := clouds[i]) is not None])
    there = np.stack([known[n] for n in options])
    distance = np.linalg.norm(here[:, None, :] - there[None, :, :], axis=2)
    cost = np.where(distance <= reach_m, distance, _NEVER)
    rows, columns = linear_sum_assignment(cost)
    pairs = [(int(r), int(c)) for r, c in zip(rows, columns, strict=True)]
    return {located[r]: options[c] for r, c in pairs if cost[r, c] < _NEVER}
