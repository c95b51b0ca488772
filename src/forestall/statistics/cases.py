"""Which episodes the experiments consist of: splits, sets of cases, matched pairs.

Called by the experiments; reads scenario names. A case is one start of one task; its undisturbed
twin is the same task with the same seed, so that a failing run and a faultless one differ in the
fault alone. Splits differ in seeds, hence in rooms; demonstrations and pictures have ranges of
their own (`config`), and so have the rooms in which further starts were chosen (`tasks.drawing`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from forestall.errors import InputError, UnknownNameError
from forestall.tasks.files import (
    HARMLESS_SETS,
    LONG,
    load_scenario,
    long_task_names,
    scenario_names,
    task_names,
)

SPLITS = {"development": 10_000, "test": 20_000}
"""First seed of each split. Nothing is fitted, chosen or looked at on seeds of "test"."""

FURTHER_SPLITS = {"development": 10_000, "test": 40_000}
"""The same for the further sets, and for all sets in the honest household."""

SCENES_PER_TASK = 10
"""Seeds of one round: the k-th scenario of a task (and of a set) has the k-th scene, in turn."""

ROUND = 100
"""Distance of the seeds of two rounds."""

ROUNDS = 3
"""In how many rooms each further scenario was judged, and is meant to be run."""

UNDISTURBED = "undisturbed"
LONG_UNDISTURBED = "long-undisturbed"

CASE_SETS = ("robofail", "irreversible", UNDISTURBED, "harmless")

FURTHER_SETS = (
    *("everyday", "composed", "midrun", "double", "planner", "planner-harmless", "eyes"),
    *(LONG, LONG_UNDISTURBED, "hidden"),
)


@dataclass(frozen=True, slots=True, order=True)
class Case:
    """One start: a task in a scene, with what goes wrong in it."""

    set: str
    task: str
    scenario: str | None
    seed: int

    @property
    def failing(self) -> bool:
        """Whether the run fails when nobody steps in."""
        return self.scenario is not None and self.set not in HARMLESS_SETS

    @property
    def twin(self) -> Case:
        """The undisturbed run in the same scene."""
        plain = LONG_UNDISTURBED if self.set in (LONG, LONG_UNDISTURBED) else UNDISTURBED
        return Case(plain, self.task, None, self.seed)


def cases(of: str, split: str, rounds: int = 1, further: bool = False) -> tuple[Case, ...]:
    """All cases of a set in a split, in a fixed order.

    Args:
        of: one of `CASE_SETS` or `FURTHER_SETS`.
        split: "development" or "test".
        rounds: how many scenes each scenario gets.
        further: whether the set has the rooms of the further sets, as those always have: what all
            sets are run in is then the same rooms, and every case has its undisturbed twin.

    Raises:
        UnknownNameError: no such set or split.
        InputError: no round.
    """
    if of not in (*CASE_SETS, *FURTHER_SETS):
        raise UnknownNameError("set of cases", of, (*CASE_SETS, *FURTHER_SETS))
    if split not in SPLITS:
        raise UnknownNameError("split", split, SPLITS)
    first = (FURTHER_SPLITS if further or of in FURTHER_SETS else SPLITS)[split]
    if not 1 <= rounds <= SPLITS["development"] // ROUND:
        raise InputError(
            f"{rounds} seeds for each scenario: 1 to {SPLITS['development'] // ROUND} are possible"
        )
    found = []
    for task in long_task_names() if of in (LONG, LONG_UNDISTURBED) else task_names():
        names: Sequence[str | None]
        if of in (UNDISTURBED, LONG_UNDISTURBED):
            names = [None] * SCENES_PER_TASK
        else:
            names = [n for n in scenario_names(of) if load_scenario(n).task == task]
        found += [
            Case(of, task, name, seed)
            for number in range(rounds)
            for k, name in enumerate(names)
            for seed in (room(first, k, number),)
        ]
    return tuple(found)


def room(first: int, place: int, number: int = 0) -> int:
    """The seed of the room that a place (from 0) of a set has in a round.

    Args:
        first: first seed of the split.
        place: among the scenarios of the set that are of one task.
        number: of the round, from 0.
    """
    return first + ROUND * number + place % SCENES_PER_TASK
