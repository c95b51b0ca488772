"""What happened in a run, step by step, and what questions about it come to (REFLECT).

Kept by a strategy, told to a `seams.Locator`. REFLECT (Liu et al. 2023, arXiv 2306.15724) sums a
run up in words on two levels: events, and of these the ones that end a subgoal.
"""

from __future__ import annotations

from dataclasses import dataclass

from forestall.types.episode import SkillStatus
from forestall.types.exchange import Exchange
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.types.verdict import Diagnosis


@dataclass(frozen=True, slots=True)
class Tried:
    """One subtask that was tried.

    Args:
        number: among those of the run, from 1.
        subtask: as it was commanded.
        status: how it ended, as the robot knows it.
        seen: what concerns it of what was seen next; None while nobody has looked.
    """

    number: int
    subtask: Subtask
    status: SkillStatus
    seen: SceneGraph | None = None


@dataclass(frozen=True, slots=True)
class Verified:
    """Whether a subtask did what it is for.

    Args:
        satisfied: None where nobody could say.
        why: in words.
        exchanges: with a language model.
    """

    satisfied: bool | None
    why: str = ""
    exchanges: tuple[Exchange, ...] = ()


@dataclass(frozen=True, slots=True)
class Located:
    """Where a run went wrong, and why.

    Args:
        step: the one that it is about; None where none is named.
        diagnosis: None where nobody could say.
        exchanges: with a language model.
    """

    step: Tried | None
    diagnosis: Diagnosis | None
    exchanges: tuple[Exchange, ...] = ()
