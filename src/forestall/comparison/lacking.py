"""What the plan at hand lacks: needs of the next step, and of later ones that no step puts right.

Called by the detector and the reasoner of mined preconditions; calls preconditions and relevance,
and asks whoever executes plans (`Foresee`) what becomes of the scene by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from forestall.comparison.lifting import Kind, evaluate, kind_of
from forestall.comparison.needs import Needs
from forestall.comparison.parts import spoken_of
from forestall.comparison.preconditions import violations
from forestall.comparison.relevance import counts
from forestall.comparison.tally import VARIED
from forestall.domain.model import Domain
from forestall.types.facts import Literal, Truth
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext, When
from forestall.types.verdict import Precondition, Reference, Violation


class Foreseen(Protocol):
    """A plan executed in the mind, as far as it runs."""

    @property
    def steps(self) -> Sequence[Subtask]:
        """What is left of it, every argument an instance; the last one may not run."""

    def holds(self, step: int, literal: Literal) -> bool:
        """Whether a ground fact holds before a step."""

    def mends(self, step: int, literal: Literal) -> bool:
        """Whether it makes no difference in the end that a state does not hold before a step."""

    def undoable(self, step: int, literal: Literal) -> bool:
        """Whether nothing happens because of it that cannot be undone."""


Foresee = Callable[[SceneGraph, Plan, int, Domain], Foreseen]
"""What is seen, the plan, the step that comes next, the domain → what becomes of it."""


@dataclass(frozen=True)
class Knowledge:
    """What a detector or a reasoner knows beside the references of a boundary.

    Args:
        counts: of the whole memory, worked out when they are first asked for.
        foresee: executes plans; None: needs of later steps are not looked at.
        early_weight: least weight of a later step's need that no schema speaks of.
    """

    counts: Callable[[], Needs]
    foresee: Foresee | None = None
    early_weight: float = VARIED


def step_of(references: Sequence[Reference], task: str, done: int) -> int:
    """Index of the demonstrated step that this boundary is like."""
    return next((r.index for r in references if r.task == task), done)


def lacking(
    context: BoundaryContext,
    mined: Callable[[Subtask, int | None], Sequence[Precondition]],
    knowledge: Knowledge,
    domain: Domain,
) -> list[Violation]:
    """Violated needs at a boundary, those of the next step first.

    Of the next step also what was not observed. A state that the plan itself puts right, so that
    nothing of it is left in the end, is no violation. Of a later step what is false now, is false
    still when the step begins, and is brought about by no step before it, as far as the domain and
    the demonstrations know; only of facts that a skill's schema speaks of or that weigh enough.

    Args:
        context: the boundary.
        mined: preconditions of a subtask; None as the step's index leaves out what is about no
            argument.
        knowledge: counts, and who executes plans.
        domain: skills.
    """
    subtask = context.subtask
    step = step_of(context.references, context.task.name, context.done)
    own = [
        v
        for v in violations(mined(subtask, step), context.scoped, subtask, domain)
        if counts(v, subtask, context.scoped, When.BEFORE, domain)
    ]
    if knowledge.foresee is None:
        return own
    ahead = knowledge.foresee(context.graph, context.plan, context.index, domain)
    found = [
        replace(v, undoable=ahead.undoable(0, v.literal))
        for v in own
        if v.truth is not Truth.FALSE or not _mended(ahead, 0, v, subtask, domain)
    ]
    known = {v.literal for v in own}
    for v in _later(context, mined, knowledge, domain, ahead):
        if v.literal not in known:
            known.add(v.literal)
            found.append(v)
    return found


def _later(
    context: BoundaryContext,
    mined: Callable[[Subtask, int | None], Sequence[Precondition]],
    knowledge: Knowledge,
    domain: Domain,
    ahead: Foreseen,
) -> Iterator[Violation]:
    done: set[Literal] = set()
    for step, subtask in enumerate(ahead.steps):
        if step:
            skill = domain.skills[subtask.skill]
            names = domain.bound(subtask)
            for p in mined(subtask, None):
                literal = p.literal.bind(names)
                if literal in done or ahead.holds(step, literal):
                    continue
                if p.weight < knowledge.early_weight and not spoken_of(p.literal, skill):
                    continue
                if evaluate(p.literal, context.graph, subtask, domain) is not Truth.FALSE:
                    continue
                v = Violation(p, literal, Truth.FALSE, step, ahead.undoable(step, literal))
                matters = counts(v, subtask, context.graph, When.BEFORE, domain)
                if matters and not _mended(ahead, step, v, subtask, domain):
                    yield v
        done |= knowledge.counts().brings_about(subtask)


def _mended(
    ahead: Foreseen, step: int, violation: Violation, subtask: Subtask, domain: Domain
) -> bool:
    """Whether the plan puts right what does not decide over whether the skill can run."""
    skill = domain.skills[subtask.skill]
    material = kind_of(violation.precondition.literal, domain, skill) is Kind.MATERIAL
    return material and ahead.mends(step, violation.literal)
