"""What should hold before subtasks that no demonstration shows, as a language model writes it.

Called by the detector and the reasoner of mined preconditions (`seams.Expectations`); calls a
`LanguageModel`. The first time that a plan has such subtasks, which is before its first step, one
question is asked about all of them; what the scene looks like is not told, so that what is seen
does not become what is expected. Nothing is asked twice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from forestall.comparison.expectations import Expected, Key, beside, key_of
from forestall.domain.model import Domain
from forestall.llm import words
from forestall.llm.answers import Said, because, expectations, expectations_schema
from forestall.llm.asking import answered
from forestall.llm.prompts import rendered
from forestall.seams.language import LanguageModel
from forestall.supervision import deadline
from forestall.types.exchange import Exchange, Request
from forestall.types.facts import category_of
from forestall.types.plan import Subtask
from forestall.types.runtime import BoundaryContext
from forestall.types.verdict import Precondition

_MOST = 20
"""Steps that one question is about."""

_Boundary = tuple[int, int, int, int]
"""Steps tried, index in the plan, plans made, looks."""


class ModelExpectations:
    """Implements `Expectations`.

    Args:
        model: that is asked.
        domain: the facts that there are.
        weight: of an expected fact, see `comparison.expectations`.
        attempts: answers that are asked for, each with the reason why the last was not taken.
        known: what was said in earlier runs; it is not asked again.
        keep: is told what is said now.
    """

    name = "model"

    def __init__(
        self,
        model: LanguageModel,
        domain: Domain,
        weight: float,
        *,
        attempts: int = 2,
        known: Iterable[Expected] = (),
        keep: Callable[[Sequence[Expected]], None] | None = None,
    ) -> None:
        self._model, self._domain, self._weight = model, domain, weight
        self._attempts, self._keep = attempts, keep
        self._known: dict[Key, Expected] = {}
        for said in known:
            self._known.setdefault(said.key, said)
        self._done: set[Key] = set(self._known)
        self._here: _Boundary | None = None
        self._exchanges: list[Exchange] = []

    def over(
        self,
        mined: Sequence[Precondition],
        subtask: Subtask,
        context: BoundaryContext,
        shown: Callable[[Subtask], bool],
    ) -> tuple[Precondition, ...]:
        """See the Protocol; a demonstration of the subtask leaves no say to the model."""
        self._at(context)
        if shown(subtask):
            return tuple(mined)
        key = self._key(subtask, context)
        if key not in self._done:
            self._ask(subtask, context, shown)
        said = self._known.get(key)
        return tuple(mined) if said is None else beside(mined, said, self._weight)

    def asked(self, context: BoundaryContext) -> tuple[Exchange, ...]:
        """See the Protocol."""
        self._at(context)
        return tuple(self._exchanges)

    def _at(self, context: BoundaryContext) -> None:
        here = (len(context.executed), context.index, context.replans, context.looks)
        if here != self._here:
            self._here, self._exchanges = here, []

    def _ask(
        self, subtask: Subtask, context: BoundaryContext, shown: Callable[[Subtask], bool]
    ) -> None:
        """One question about every subtask of the plan that nothing is known of."""
        steps = (*context.remaining(), subtask)
        wanted: dict[Key, int] = {}
        for number, step in enumerate(steps, 1):
            key = self._key(step, context)
            if key not in self._done and not self._drives(step) and not shown(step):
                wanted.setdefault(key, number)
        wanted = dict(list(wanted.items())[:_MOST])
        self._done |= {self._key(subtask, context), *wanted}
        if not wanted:
            return
        said = self._answer(context, {n: steps[n - 1] for n in wanted.values()})
        name = self._model.name
        found = [Expected(*k, said[n][0], name, said[n][1]) for k, n in wanted.items() if n in said]
        self._known |= {e.key: e for e in found}
        if found and self._keep is not None:
            self._keep(found)

    def _answer(self, context: BoundaryContext, steps: Mapping[int, Subtask]) -> Said:
        """What the model says, {} where it gives no answer that can be read."""

        def read(answer: str) -> tuple[Said, str]:
            said, dropped = expectations(answer, steps, self._domain)
            return said, f"{len(dropped)} of its facts {because(dropped)}" if dropped else ""

        request = self.request(context, steps)
        said, asked = answered(self._model, request, read, self._attempts, deadline())
        self._exchanges += asked
        return said or {}

    def request(self, context: BoundaryContext, steps: Mapping[int, Subtask]) -> Request:
        """What is asked about some steps of the plan at hand, by their numbers."""
        domain = self._domain
        things = {domain.canonical(a) for s in steps.values() for a in s.args}
        kinds = {k for k in map(category_of, things) if domain.find(k) is not None}
        messages = rendered(
            "expecting",
            goal=context.task.goal.text,
            plan="; ".join(map(words.step, context.remaining())),
            steps=[f"{n}: {words.step(s)}" for n, s in steps.items()],
            vocabulary=words.vocabulary_of(kinds, domain),
        )
        return Request("expecting", messages, expectations_schema(steps))

    def _key(self, step: Subtask, context: BoundaryContext) -> Key:
        return key_of(step, context.task.name, self._domain)

    def _drives(self, step: Subtask) -> bool:
        skill = self._domain.skills.get(step.skill)
        return skill is None or skill.drives
