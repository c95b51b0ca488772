"""Judges that only watch: what each would say of a boundary, whatever it compares with.

Built by the composition root for `watch`. One judge is a detector with references of its own, one
compares whole scenes, one executes what is left of the plan in its own model of the domain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Protocol

from forestall.domain.model import LOCATED
from forestall.seams.judging import Detector, PlanValidator, Retriever
from forestall.strategies.asked import AskedDetector, AskedRetriever, AskedValidator
from forestall.strategies.intervention import rest_of
from forestall.types.graph import SceneGraph
from forestall.types.runtime import BoundaryContext
from forestall.types.verdict import Calibration, Decision, PlanCheck, Reference, Verdict

NOT_SEEN = 0.25
"""Score of a plan that lacks nothing but the places of things."""

Wholes = Mapping[tuple[str, int], SceneGraph]
"""(demonstration, index of the step) → everything that was known before the step."""


class Judge(Protocol):
    """Says of a boundary whether the robot should go on."""

    @property
    def name(self) -> str:
        """Told apart from the others that watch."""

    def judge(self, context: BoundaryContext) -> Verdict:
        """Judge what is seen; `context.references` are those of the run's own retriever."""


class DetectorJudge:
    """A detector.

    Args:
        detector: judges.
        retriever: finds references of its own; the run's are taken by default.
        name: the detector's by default.
    """

    def __init__(
        self, detector: Detector, retriever: Retriever | None = None, name: str | None = None
    ) -> None:
        self.name = name or detector.name
        self._detector = AskedDetector(detector)
        self._retriever = None if retriever is None else AskedRetriever(retriever)

    def judge(self, context: BoundaryContext) -> Verdict:
        """Judge the scene that is scoped to the subtask."""
        references = tuple(self._references(context))
        context = replace(context, references=references)
        verdict = self._detector.judge(context.scoped, context.observation, references, context)
        return replace(verdict, detector=self.name)

    def _references(self, context: BoundaryContext) -> Sequence[Reference]:
        if self._retriever is None:
            return context.references
        return self._retriever.retrieve(context.subtask, context.task.name, context.done)


class WholeSceneJudge:
    """A detector of which neither side is scoped to the subtask.

    Args:
        detector: judges.
        wholes: the whole scenes behind the references.
        name: the detector's by default.
    """

    def __init__(self, detector: Detector, wholes: Wholes, name: str | None = None) -> None:
        self.name = name or detector.name
        self._detector = AskedDetector(detector)
        self._wholes = wholes

    def judge(self, context: BoundaryContext) -> Verdict:
        """Judge everything that is known."""
        references = [
            replace(r, graph=_whole(self._wholes[r.demonstration, r.index], r.graph))
            for r in context.references
        ]
        observed = _whole(context.graph, context.scoped)
        verdict = self._detector.judge(observed, context.observation, references)
        return replace(verdict, detector=self.name)


class PlanJudge:
    """The plan check: score 1 where what is left of the plan reaches the goal, 0 where it does not.

    Where it runs only because something is assumed that was not seen, it runs. Where it does not
    run only because things were not seen, which may yet turn up, the score is `NOT_SEEN`.

    Args:
        validator: executes the plan on what is seen, in its model of the domain.
        name: told apart from those with another model.
    """

    def __init__(self, validator: PlanValidator, name: str) -> None:
        self.name = name
        self._validator = AskedValidator(validator)

    def judge(self, context: BoundaryContext) -> Verdict:
        """Execute what is left of the plan in the mind."""
        rest = rest_of(context, self._validator.domain)
        check = self._validator.check(rest, context.graph, context.task.goal)
        decision = Decision.PROCEED if check.ok else Decision.REPLAN
        if not check.ok and context.may_look:
            decision = Decision.LOOK_AGAIN
        return Verdict(
            decision,
            self.name,
            score=_score(check),
            threshold=0.5,
            calibration=Calibration.FIXED,
            note=check.reason,
            lacking=() if check.ok else check.lacking or check.unmet,
        )


def _score(check: PlanCheck) -> float:
    if check.ok:
        return 1.0
    lacking = check.lacking or check.unmet
    return NOT_SEEN if lacking and all(x.predicate == LOCATED for x in lacking) else 0.0


def _whole(whole: SceneGraph, scoped: SceneGraph) -> SceneGraph:
    """All of a scene, about the subtask that it is looked at for."""
    return SceneGraph(whole.nodes, whole.relations, scoped.subtask, whole.hidden)
