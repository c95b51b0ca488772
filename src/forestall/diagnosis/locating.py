"""Where a run went wrong, by a language model: REFLECT's questions and answers.

Called by the strategies post-hoc and online (`seams.Locator`); calls a `LanguageModel`. After
REFLECT (Liu et al. 2023, arXiv 2306.15724, Sec. 3, and its public `main/exp.py`): each subgoal is
verified by what is seen after it, the first that fails is explained from the events until then;
where none fails, the plan is, from the last scene. Other than there, the step comes with the
explanation instead of by a question of its own, and so do facts that must change, which are read
against the domain.
"""

from __future__ import annotations

from collections.abc import Sequence

from forestall.domain.model import Domain
from forestall.llm import words
from forestall.llm.answers import (
    Explained,
    because,
    diagnosis_schema,
    located,
    verified,
    verified_schema,
)
from forestall.llm.asking import answered
from forestall.llm.prompts import rendered
from forestall.seams.language import LanguageModel
from forestall.supervision import deadline
from forestall.types.exchange import Exchange, Request
from forestall.types.runtime import BoundaryContext
from forestall.types.story import Located, Tried, Verified
from forestall.types.verdict import Diagnosis

_MOST = 40
"""Events, the newest, that are told."""


class ModelLocator:
    """Implements `Locator`.

    Args:
        model: that is asked.
        domain: the facts that there are.
        attempts: answers that are asked for, each with the reason why the last was not taken.
    """

    name = "model"

    def __init__(self, model: LanguageModel, domain: Domain, *, attempts: int = 2) -> None:
        self._model, self._domain, self._attempts = model, domain, attempts

    def verify(self, context: BoundaryContext, tried: Tried) -> Verified:
        """One question about one subtask."""

        def read(answer: str) -> tuple[tuple[bool, str], str]:
            return verified(answer), ""

        request = self.verifying(tried)
        found, asked = answered(self._model, request, read, self._attempts, deadline())
        if found is None:
            return Verified(None, _why(asked), asked)
        done, why = found
        return Verified(done, why, asked)

    def verifying(self, tried: Tried) -> Request:
        """What is asked about one subtask."""
        seen = [] if tried.seen is None else words.scene(tried.seen, self._domain)
        messages = rendered(
            "verifying", step=words.step(tried.subtask), observed=seen or ["nothing of it"]
        )
        return Request("verifying", messages, verified_schema(), max_tokens=200)

    def explain(
        self, context: BoundaryContext, story: Sequence[Tried], failed: Tried | None
    ) -> Located:
        """One question about the run until the failure, or about all of it."""
        told = [e for e in story if failed is None or e.number <= failed.number][-_MOST:]
        numbers = {e.number for e in told}

        def read(answer: str) -> tuple[tuple[int, Explained], str]:
            number, found = located(answer, numbers, context.graph, self._domain)
            return (number, found), because(found.dropped)

        request = self.explaining(context, told, failed)
        answer, asked = answered(self._model, request, read, self._attempts, deadline())
        if answer is None:
            return Located(failed, None, asked)
        number, found = answer
        at = next(e for e in told if e.number == number)
        return Located(at, self._diagnosis(at, found, asked), asked)

    def explaining(
        self, context: BoundaryContext, told: Sequence[Tried], failed: Tried | None
    ) -> Request:
        """What is asked about a run."""
        graph, domain = context.graph, self._domain
        near = {n for e in told if e.seen is not None for n in (x.id for x in e.seen.nodes)}
        messages = rendered(
            "locating",
            goal=context.task.goal.text,
            story=words.told_steps(told, domain),
            failed=None if failed is None else failed.number,
            observed=words.scene(graph, domain, near or None),
            vocabulary=words.vocabulary(graph, domain),
        )
        things = {n.id for n in graph.nodes if n.id not in domain.robot.hands}
        return Request("locating", messages, diagnosis_schema(things, {e.number for e in told}))

    def _diagnosis(self, at: Tried, found: Explained, exchanges: Sequence[Exchange]) -> Diagnosis:
        cause = found.cause or found.advice
        return Diagnosis(
            cause=f"located at step {at.number}, {at.subtask}: {cause}",
            must_change=found.must_change,
            must_stay=found.must_stay,
            culprits=found.because_of,
            producer=self.name,
            why=found.why,
            advice=found.advice,
            exchanges=tuple(exchanges),
        )


def _why(asked: Sequence[Exchange]) -> str:
    return asked[-1].problem if asked else "it was not asked"
