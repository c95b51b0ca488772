"""The runs that judges watched and nobody interrupted, as columns: what was judged, what was true.

Called by everything that counts alarms; calls `intervals`. A row of strategy "watch" gives a
run; its moments before a subtask (and after, where somebody judged there) are its boundaries.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Protocol

import numpy as np

from forestall.errors import InputError
from forestall.statistics.cases import Case
from forestall.statistics.intervals import Bools, Clusters, Floats, Ints, Unit
from forestall.statistics.rows import HONEST, EpisodeRow, Judged

WATCH = "watch"
HARMLESS = "harmless"
PAPER_SET = "robofail"
ALL = "all"
"""In place of a set: every run of the profile that fails, or does not."""


def order(row: EpisodeRow) -> tuple[str | int | float, ...]:
    """Where a row stands among others, whatever order they were written in."""
    return (
        row.profile,
        row.set,
        row.task,
        row.scenario or "",
        row.seed,
        row.strategy,
        row.detector,
        row.threshold,
        row.without or "",
        row.model,
        row.demonstrations,
        row.reasoning,
        row.sensor,
    )


def canonical(rows: Iterable[EpisodeRow]) -> tuple[EpisodeRow, ...]:
    """Rows in a fixed order.

    Raises:
        InputError: one episode is there twice; it would count twice.
    """
    found = sorted(rows, key=order)
    for one, other in pairwise(found):
        if order(one) == order(other):
            raise InputError(f"two rows of the same episode: {order(one)}")
    return tuple(found)


def case_of(row: EpisodeRow) -> Case:
    """The case that a row is an episode of."""
    return Case(row.set, row.task, row.scenario, row.seed)


def unit_of(row: EpisodeRow) -> Unit:
    """What episodes share that are not independent of each other."""
    return Unit((row.task, row.seed), row.scenario)


def fails(row: EpisodeRow) -> bool:
    """Whether a run fails when nobody steps in: by its set, or in the honest household as it did.

    Raises:
        InputError: a failing one does not say when it can be known.
    """
    failing = row.failing if row.profile == HONEST else case_of(row).failing
    if failing and (row.known is None or row.effect is None):
        raise InputError(
            f"{case_of(row)} does not say when its failure can be known and takes effect"
        )
    return failing


@dataclass(frozen=True, eq=False)
class Watches:
    """Watched runs of one profile, and their boundaries one after the other.

    Args:
        rows: (runs,) of them.
        judged: (boundaries,) what was judged there.
        run: (boundaries,) which run each is of.
        index: (boundaries,) position in the plan. `time_s`: (boundaries,) simulated.
        known: (runs,) when the failure can be known, NaN if it does not fail; `effect`: when harm
            is done.
        faultless: (boundaries,) whether the truth has nothing against going on. Where nobody asked
            the truth, a run that does not fail is faultless.
        scores: judge → (boundaries,), NaN where it judged nothing.
        seen_by: judge → (runs,) whether it watched this one; one without boundaries (it broke off)
            was watched by all, and nothing was seen.
        clusters: of the runs.
    """

    rows: tuple[EpisodeRow, ...]
    judged: tuple[Judged, ...]
    run: Ints
    index: Floats
    time_s: Floats
    known: Floats
    effect: Floats
    faultless: Bools
    scores: dict[str, Floats]
    seen_by: dict[str, Bools]
    clusters: Clusters

    @classmethod
    def of(cls, rows: Iterable[EpisodeRow]) -> Watches:
        """The watched runs among rows, one of each case, in a fixed order.

        Raises:
            InputError: two of one case, or a failing one that does not say when it can be known.
        """
        found = canonical(r for r in rows if r.strategy == WATCH)
        for one, other in pairwise(found):
            if case_of(one) == case_of(other) and one.profile == other.profile:
                raise InputError(f"two watched runs of one case: {case_of(one)}")
        failing = [fails(r) for r in found]
        places = [(k, j) for k, r in enumerate(found) for j in r.judged if _boundary(j)]
        run = np.array([k for k, _ in places], np.int64)
        judged = tuple(j for _, j in places)
        names = sorted({name for j in judged for name in j.scores})
        scores, seen_by = _scores(judged, run, len(found), names)
        return cls(
            found,
            judged,
            run,
            np.array([j.index for j in judged], float),
            np.array([j.time_s for j in judged], float),
            _moment([r.known if bad else None for r, bad in zip(found, failing, strict=True)]),
            _moment([r.effect if bad else None for r, bad in zip(found, failing, strict=True)]),
            np.array([_faultless(j, failing[k]) for k, j in places], bool),
            scores,
            seen_by,
            Clusters.of([unit_of(r) for r in found]),
        )

    def __len__(self) -> int:
        return len(self.rows)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Every judge that gave a score, sorted."""
        return tuple(self.scores)

    @cached_property
    def failing(self) -> Bools:
        """Runs that fail."""
        return ~np.isnan(self.known)

    @cached_property
    def foreseeable(self) -> Bools:
        """Runs whose failure can be known before the harm is done."""
        return self.known <= self.effect

    @cached_property
    def undisturbed(self) -> Bools:
        """Runs that do not fail and in which nothing was arranged."""
        return ~self.failing & self.where(lambda r: r.scenario is None)

    @cached_property
    def harmless(self) -> Bools:
        """Runs that do not fail although something was arranged."""
        return ~self.failing & self.where(lambda r: r.scenario is not None)

    @cached_property
    def timely(self) -> Bools:
        """Boundaries from when a foreseeable failure can be known up to the harm."""
        index, known, effect = self.index, self.known[self.run], self.effect[self.run]
        return (known <= index) & (index <= effect)

    @cached_property
    def hours(self) -> Floats:
        """Robot time of each run."""
        return np.array([r.simulated_s / 3600 for r in self.rows], float)

    @cached_property
    def harm_s(self) -> Floats:
        """When the harm is done in each run, or its end: simulated seconds."""
        found = np.array([r.simulated_s for r in self.rows], float)
        at = np.flatnonzero(self.index == self.effect[self.run])[::-1]
        found[self.run[at]] = self.time_s[at]
        return found

    @cached_property
    def twins(self) -> Ints:
        """Which undisturbed run in the same room belongs to each failing one, -1 for none."""
        calm = {case_of(self.rows[k]): k for k in np.flatnonzero(self.undisturbed)}
        return np.array(
            [
                calm.get(case_of(r).twin, -1) if bad else -1
                for r, bad in zip(self.rows, self.failing, strict=True)
            ],
            np.int64,
        )

    def where(self, rule: _Rule) -> Bools:
        """Runs that a rule takes."""
        return np.array([rule(r) for r in self.rows], bool)

    def of_set(self, name: str) -> Bools:
        """Failing runs of a set, or of `ALL`."""
        return self.failing & self.where(lambda r: name in (ALL, r.set))

    def per_run(self, boundaries: Bools | Floats) -> Floats:
        """Sum over the boundaries of each run, (runs,)."""
        return np.bincount(self.run, boundaries.astype(float), len(self)).astype(float)


class _Rule(Protocol):
    """Row → whether it is taken."""

    def __call__(self, row: EpisodeRow, /) -> bool: ...


def _boundary(judged: Judged) -> bool:
    """Whether an alarm could have been raised there."""
    return judged.when == "before" or bool(judged.scores)


def _faultless(judged: Judged, failing: bool) -> bool:
    if judged.possible is None and judged.reachable is None:
        return not failing
    return judged.possible is not False and judged.reachable is not False


def _moment(values: Sequence[int | None]) -> Floats:
    return np.array([np.nan if v is None else v for v in values], float)


def _scores(
    judged: Sequence[Judged], run: Ints, runs: int, names: Sequence[str]
) -> tuple[dict[str, Floats], dict[str, Bools]]:
    scores = {name: np.full(len(judged), np.nan) for name in names}
    there = {name: np.zeros(len(judged), bool) for name in names}
    for place, one in enumerate(judged):
        for name, score in one.scores.items():
            there[name][place] = True
            if score is not None:
                scores[name][place] = score
    blank = np.bincount(run, minlength=runs) == 0
    seen_by = {n: blank | (np.bincount(run, at, runs) > 0) for n, at in there.items()}
    return scores, seen_by
