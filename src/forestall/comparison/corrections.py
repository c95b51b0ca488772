"""What a person says of mined preconditions: facts to leave out, facts to add.

A layer over what is mined: made by assembly from a file of its own, asked by the detector and the
reasoner wherever preconditions were mined before a subtask. Mining knows nothing of it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from forestall.domain.model import Domain
from forestall.types.facts import Literal, category_of
from forestall.types.plan import Subtask
from forestall.types.verdict import Precondition


@dataclass(frozen=True, slots=True)
class Correction:
    """One fact that is or is not needed before a skill, whatever was mined.

    Args:
        adds: whether it is needed; else it is left out.
        skill: before which.
        fact: over the skill's parameters.
        args: categories that the arguments must be of; () for any.
        task: in which; "" for any.
        note: why, for people.
        place: where it stands in its file.
    """

    adds: bool
    skill: str
    fact: Literal
    args: tuple[str, ...] = ()
    task: str = ""
    note: str = ""
    place: str = ""

    def __str__(self) -> str:
        before = str(Subtask(self.skill, self.args)) if self.args else self.skill
        return f"{before}: {self.fact}"

    def concerns(self, subtask: Subtask, task: str, domain: Domain) -> bool:
        """Whether it is about a subtask of a task."""
        if subtask.skill != self.skill or self.task not in ("", task):
            return False
        kinds = tuple(category_of(domain.canonical(a)) for a in subtask.args)
        return self.args in ((), kinds)


@dataclass(frozen=True, slots=True)
class Corrections:
    """All that one file says.

    Args:
        source: the file.
        each: in its order.
    """

    source: str
    each: tuple[Correction, ...]

    def over(
        self, mined: Sequence[Precondition], subtask: Subtask, task: str, domain: Domain
    ) -> tuple[Precondition, ...]:
        """Mined preconditions of a subtask as they stand corrected, those by hand first.

        A fact that is added takes the place of a mined one that it contradicts.
        """
        own = [c for c in self.each if c.concerns(subtask, task, domain)]
        dropped = {c.fact for c in own if not c.adds}
        kept = {p.literal: p for p in mined if p.literal not in dropped}
        added = []
        for fact in dict.fromkeys(c.fact for c in own if c.adds):
            known = kept.pop(fact, None)
            for other in [x for x in kept if _contradict(x, fact)]:
                del kept[other]
            by_hand = known or Precondition(subtask.skill, fact, 0, 0)
            added.append(replace(by_hand, weight=1.0, by_hand=True))
        return (*added, *kept.values())


def stale(
    corrections: Iterable[Correction],
    mined: Iterable[tuple[Subtask, str, Sequence[Precondition]]],
    domain: Domain,
) -> tuple[tuple[Correction, str], ...]:
    """Corrections that change nothing any more, and why.

    Args:
        corrections: of one file.
        mined: what is mined, before the corrections, for every subtask and task that were shown.
        domain: the words of both.
    """
    known, found = list(mined), []
    for c in corrections:
        about = [found for subtask, task, found in known if c.concerns(subtask, task, domain)]
        if not about:
            found.append((c, "no demonstration has such a subtask"))
        elif not c.adds and not any(p.literal == c.fact for several in about for p in several):
            found.append((c, "this is not mined any more, so there is nothing to leave out"))
    return tuple(found)


def _contradict(one: Literal, other: Literal) -> bool:
    return one != other and (one.predicate, one.args) == (other.predicate, other.args)
