"""Diagnosis by a language model (paper, "reasoning module").

Called by the strategies; calls a `LanguageModel`, and another reasoner where that gives no answer
that can be read. The model is told what is seen, what a demonstration shows, how they differ, the
goal, the step, what was done and what the judges say; its facts are read against the domain.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import replace

from PIL import Image

from forestall.domain.model import Domain
from forestall.llm import words
from forestall.llm.answers import Explained, because, diagnosis_schema, explanation
from forestall.llm.asking import answered
from forestall.llm.prompts import rendered
from forestall.seams.judging import Reasoner
from forestall.seams.language import LanguageModel
from forestall.supervision import deadline
from forestall.types.exchange import Exchange, Request
from forestall.types.observation import Rgb
from forestall.types.runtime import BoundaryContext, When
from forestall.types.verdict import Decision, Diagnosis, Reference, Verdict

_WHEN = {When.BEFORE: "Next step", When.AFTER: "Step just done", When.END: "Last step of the plan"}
_TOLD = 8
"""How many differences are told."""
_PICTURE_WIDTH = 640


class ModelReasoner:
    """Implements `Reasoner`.

    Args:
        model: that is asked.
        domain: the facts that there are.
        otherwise: explains where the model gives no answer that can be taken; None: nothing is
            found then.
        attempts: answers that are asked for, each with the reason why the last was not taken.
        pictures: whether the robot's picture goes with the question.
        shown: the picture of a demonstration, which then goes with it, too; None where there is
            none.
    """

    name = "model"

    def __init__(
        self,
        model: LanguageModel,
        domain: Domain,
        otherwise: Reasoner | None = None,
        *,
        attempts: int = 2,
        pictures: bool = False,
        shown: Callable[[Reference], Rgb | None] | None = None,
    ) -> None:
        self._shown = shown
        self._model, self._domain, self._otherwise = model, domain, otherwise
        self._attempts, self._pictures = attempts, pictures

    def diagnose(self, context: BoundaryContext, verdict: Verdict) -> Diagnosis:
        """Ask; what the model names of facts must mean something here, its advice need not."""

        def read(answer: str) -> tuple[Explained, str]:
            found = explanation(answer, context.graph, self._domain)
            return found, because(found.dropped)

        request = self.request(context, verdict)
        found, exchanges = answered(self._model, request, read, self._attempts, deadline())
        if found is None:
            return self._without(context, verdict, exchanges)
        return self._diagnosis(found, exchanges)

    def request(self, context: BoundaryContext, verdict: Verdict) -> Request:
        """What is asked at a boundary."""
        nearest = verdict.nearest
        domain = self._domain
        images = self._images(context, nearest) if self._pictures else ()
        judges = [v for v in context.said if v.decision is not Decision.PROCEED and v.note]
        messages = rendered(
            "reasoning",
            goal=context.task.goal.text,
            when=_WHEN[context.when],
            step=words.step(context.subtask),
            executed=words.executed(context.executed),
            observed=words.scene(context.scoped, domain),
            expected=[] if nearest is None else words.scene(nearest.graph, domain),
            differences=[words.quoted(d.text) for d in verdict.discrepancies[:_TOLD]],
            judges=[f"Judge {words.name(v.detector)}: {words.quoted(v.note)}" for v in judges],
            vocabulary=words.vocabulary(context.scoped, domain),
            pictures=" ".join(f"Picture {n}: {of}." for n, (of, _) in enumerate(images, 1)),
        )
        things = {n.id for n in context.graph.nodes if n.id not in domain.robot.hands}
        return Request("reasoning", messages, diagnosis_schema(things), tuple(i for _, i in images))

    def _images(
        self, context: BoundaryContext, nearest: Reference | None
    ) -> tuple[tuple[str, bytes], ...]:
        """What is seen, and what was seen in a run that went well: what of, and a JPEG file."""
        seen = context.observation
        pairs = [("what is seen", seen.frames[-1].rgb if seen and seen.frames else None)]
        if nearest is not None and self._shown is not None:
            pairs.append(("a run that went well", self._shown(nearest)))
        return tuple((of, jpeg(rgb)) for of, rgb in pairs if rgb is not None)

    def _diagnosis(self, found: Explained, exchanges: Sequence[Exchange]) -> Diagnosis:
        named = [a for x in found.must_change for a in x.args if a not in self._domain.robot.hands]
        return Diagnosis(
            cause=found.cause or found.advice,
            must_change=found.must_change,
            must_stay=found.must_stay,
            culprits=tuple(dict.fromkeys((*found.because_of, *named))),
            producer=self.name,
            why=found.why,
            advice=found.advice,
            exchanges=tuple(exchanges),
        )

    def _without(
        self, context: BoundaryContext, verdict: Verdict, exchanges: Sequence[Exchange]
    ) -> Diagnosis:
        """What is said where the model gave no answer that could be taken."""
        why = exchanges[-1].problem if exchanges else "it was not asked"
        if self._otherwise is None:
            cause = f"nothing was found: the language model gave no explanation ({why})"
            return Diagnosis(cause, (), producer=self.name, exchanges=tuple(exchanges))
        found = self._otherwise.diagnose(context, verdict)
        producer = f"{found.producer}, since the language model gave no explanation"
        return replace(found, producer=producer, exchanges=(*exchanges, *found.exchanges))


def jpeg(rgb: Rgb) -> bytes:
    """A picture as a JPEG file, at most 640 pixels wide."""
    picture = Image.fromarray(rgb)
    if picture.width > _PICTURE_WIDTH:
        height = round(picture.height * _PICTURE_WIDTH / picture.width)
        picture = picture.resize((_PICTURE_WIDTH, height))
    made = io.BytesIO()
    picture.save(made, "JPEG", quality=80)
    return made.getvalue()
