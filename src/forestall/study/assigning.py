"""Who is shown what: incomplete blocks of items, every rival and side as often as every other.

Called by `making.py`; calls nothing. Items stand in a circle in an order drawn by the seed, and
each rater takes the next so many of them, so that no item is shown more than once more than
another. An item that is shown again has the next rival beside ours, and a pair that is shown again
has its sides changed. Neighbours in the circle begin with different rivals, so that a rater meets
all rivals equally often, but for one.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from forestall.errors import InputError
from forestall.study.model import Item, Side, Trial

EVERY = 10
"""Comparisons for each attention check."""

MOST_EACH = 40
"""Comparisons that one rater is asked for when nothing is said: some twenty minutes."""


@dataclass(frozen=True, slots=True)
class Design:
    """How large a study is.

    Args:
        raters: how many people can take part.
        each: comparisons for each of them; None: every item once, `MOST_EACH` at most.
        seed: of order and sides.
    """

    raters: int = 15
    each: int | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        if not 1 <= self.raters <= 999:
            raise InputError(f"raters is {self.raters}: 1 to 999 can take part")
        if self.each is not None and self.each < 1:
            raise InputError(f"each is {self.each}: at least 1 comparison is needed")

    def size(self, items: int) -> int:
        """How many comparisons each rater makes."""
        return min(items, self.each or MOST_EACH)


def assign(items: Sequence[Item], against: Sequence[str], design: Design) -> list[list[Trial]]:
    """The trials of every rater.

    Args:
        items: at least one.
        against: the rivals.
        design: how many raters, how many comparisons.
    """
    random = np.random.default_rng(design.seed)
    order = [int(k) for k in random.permutation(len(items))]
    size = design.size(len(items))
    coins = random.integers(0, 2, size=(len(items), len(against)))
    shown: Counter[int] = Counter()
    raters = []
    for rater in range(design.raters):
        trials = []
        for j in range(size):
            place = (rater * size + j) % len(items)
            item, times = order[place], shown[place]
            shown[place] += 1
            rival = (place + times) % len(against)
            flipped = (times // len(against) + int(coins[item, rival])) % 2
            side: Side = "b" if flipped else "a"
            trials.append(Trial(items[item].name, against[rival], side))
        trials = [trials[int(k)] for k in random.permutation(size)]
        raters.append(_with_checks(trials, items, random))
    return raters


def _with_checks(
    trials: list[Trial], items: Sequence[Item], random: np.random.Generator
) -> list[Trial]:
    """With attention checks between: the true cause beside that of quite another failure.

    There is none where no two items differ in task, step and cause.
    """
    pairs = [
        (a.name, b.name)
        for a in items
        for b in items
        if a.task != b.task and a.cause != b.cause and a.step != b.step
    ]
    count = max(1, round(len(trials) / EVERY))
    if not pairs:
        return trials
    result: list[Trial] = []
    spots = [round((k + 0.5) * len(trials) / count) for k in range(count)]
    chosen = random.permutation(len(pairs))
    coin = int(random.integers(0, 2))
    for position, trial in enumerate(trials):
        for k in (k for k, spot in enumerate(spots) if spot == position):
            right, wrong = pairs[int(chosen[k % len(pairs)])]
            side: Side = "a" if (k + coin) % 2 else "b"
            result.append(Trial(right, wrong, side, check=True))
        result.append(trial)
    return result
