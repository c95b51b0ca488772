"""What a language model expects before subtasks that no demonstration shows: evidence of its own.

Made by `diagnosis.expecting`, which asks the model, and by the file that keeps its answers; asked
through `seams.Expectations` by the detector and the reasoner of mined preconditions. It is never
counted as a demonstration, weighs less than the first one, and has no say where there is one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from forestall.comparison.needs import Needs, slot_of
from forestall.comparison.tally import weight
from forestall.domain.model import Domain
from forestall.types.exchange import Exchange
from forestall.types.facts import Literal, category_of
from forestall.types.plan import Subtask
from forestall.types.runtime import BoundaryContext
from forestall.types.verdict import Precondition

WEIGHT = 0.6
"""Of an expected fact: every violation of one is an alarm under the default threshold."""

LEAST_SHOWN = weight(1, 1)
"""What held in the only demonstration weighs this, 2/3."""

Key = tuple[str, tuple[str, ...], str]
"""Skill, categories of the arguments, task."""


@dataclass(frozen=True, slots=True)
class Expected:
    """What a model said of one subtask; no fact where it said that nothing must hold.

    Args:
        skill: before which.
        args: categories of its arguments.
        task: in which.
        facts: over the skill's parameters.
        model: that said so.
        why: in its words.
    """

    skill: str
    args: tuple[str, ...]
    task: str
    facts: tuple[Literal, ...]
    model: str
    why: str = ""

    @property
    def key(self) -> Key:
        """What it is about."""
        return self.skill, self.args, self.task


def key_of(subtask: Subtask, task: str, domain: Domain) -> Key:
    """What is expected for one subtask is expected for all of these."""
    kinds = tuple(category_of(domain.canonical(a)) for a in subtask.args)
    return subtask.skill, kinds, task


def shown(memory: Needs, subtask: Subtask) -> bool:
    """Whether a demonstration of any task has such a subtask: skill and kinds of its arguments."""
    about = (memory.domain.family(subtask), tuple(memory.kinds(subtask).values()))
    return any(key[:2] == about for key in memory.here)


def beside(
    mined: Sequence[Precondition], expected: Expected, weighs: float
) -> tuple[Precondition, ...]:
    """Mined preconditions with what is expected of what they say nothing about."""
    said = {slot_of(p.literal) for p in mined}
    return (
        *mined,
        *(
            Precondition(expected.skill, f, 0, 0, weighs, expected_by=expected.model)
            for f in expected.facts
            if slot_of(f) not in said
        ),
    )


class NoExpectations:
    """Nothing but demonstrations says what should hold (implements `Expectations`)."""

    name = "none"

    def over(
        self,
        mined: Sequence[Precondition],
        subtask: Subtask,
        context: BoundaryContext,
        shown: Callable[[Subtask], bool],
    ) -> tuple[Precondition, ...]:
        """As they were mined."""
        return tuple(mined)

    def asked(self, context: BoundaryContext) -> tuple[Exchange, ...]:
        """Nothing."""
        return ()
