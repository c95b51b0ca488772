"""Which episodes the experiments consist of: splits, sets of cases, matched pairs.

Called by the experiments; reads scenario names. A case is one start of one task; its undisturbed
twin is the same task with the same seed, so that a failing run and a faultless one differ in the
fault alone. Splits differ in seeds, hence in rooms; demonstrations and pictures have ranges of
their own (`config`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from forestall.errors import InputError, UnknownNameError
from forestall.tasks.files import load_scenario, scenario_names, task_names

SPLITS = {"development": 10_000, "test": 20_000}
"""First seed of each split. Nothing is fitted, chosen or looked at on seeds of "test"."""

SCENES_PER_TASK = 10
"""Seeds of one round: the k-th scenario of a task (and of a set) has the k-th scene, in turn."""

ROUND = 100
"""Distance of the seeds of two rounds."""

UNDISTURBED = "undisturbed"

CASE_SETS = ("robofail", "irreversible", UNDISTURBED, "harmless")


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
        return self.set not in (UNDISTURBED, "harmless")

    @property
    def twin(self) -> Case:
        """The undisturbed run in the same scene."""
        return Case(UNDISTURBED, self.task, None, self.seed)


def cases(of: str, split: str, rounds: int = 1) -> tuple[Case, ...]:
    """All cases of a set in a split, in a fixed order.

    Args:
        of: one of `CASE_SETS`.
        split: "development" or "test".
        rounds: how many scenes each scenario gets.

    Raises:
        UnknownNameError: no such set or split.
        InputError: no round.
    """
    if of not in CASE_SETS:
        raise UnknownNameError("set of cases", of, CASE_SETS)
    if split not in SPLITS:
        raise UnknownNameError("split", split, SPLITS)
    if not 1 <= rounds <= SPLITS["development"] // ROUND:
        raise InputError(
            f"{rounds} seeds for each scenario: 1 to {SPLITS['development'] // ROUND} are possible"
        )
    starts = [SPLITS[split] + ROUND * r for r in range(rounds)]
    found = []
    for task in task_names():
        names: Sequence[str | None]
        if of == UNDISTURBED:
            names = [None] * SCENES_PER_TASK
        else:
            names = [n for n in scenario_names(of) if load_scenario(n).task == task]
        found += [
            Case(of, task, name, start + k % SCENES_PER_TASK)
            for start in starts
            for k, name in enumerate(names)
        ]
    return tuple(found)
