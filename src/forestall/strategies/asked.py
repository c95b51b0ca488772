"""What strategies ask, each saying that it is at work: an error or a limit then names the part.

Built by the strategies around what they are given; each class is the Protocol that it wraps. What
an answer is made of is looked at here, so that nonsense is an error of the part that gave it.
"""

from __future__ import annotations

from collections.abc import Sequence
from inspect import signature
from typing import Any

from forestall.domain.model import Domain
from forestall.seams.judging import Detector, Locator, PlanValidator, Reasoner, Replanner, Retriever
from forestall.supervision import ask, checked_answer, deadline
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext
from forestall.types.story import Located, Tried, Verified
from forestall.types.task import Goal
from forestall.types.verdict import Diagnosis, PlanCheck, Reference, Replan, Verdict


class AskedRetriever:
    """Finds references within its time."""

    def __init__(self, retriever: Retriever) -> None:
        self._retriever = retriever

    def retrieve(self, subtask: Subtask, task: str, done: int) -> tuple[Reference, ...]:
        """As the retriever."""

        def found() -> tuple[Reference, ...]:
            references = tuple(self._retriever.retrieve(subtask, task, done))
            for reference in references:
                checked_answer("retriever", reference, Reference)
            return references

        return ask("retriever", "retrieve", tuple, found)


class AskedDetector:
    """Judges within its time; one that takes a `context` is told the plan, too."""

    def __init__(self, detector: Detector) -> None:
        self._detector, self.name = detector, detector.name
        self._plans = "context" in signature(detector.judge).parameters

    def judge(
        self,
        observed: SceneGraph,
        observation: Observation | None,
        references: Sequence[Reference],
        context: BoundaryContext | None = None,
    ) -> Verdict:
        """As the detector."""

        def judged() -> Verdict:
            plan: dict[str, Any] = {"context": context} if self._plans else {}
            return self._detector.judge(observed, observation, references, **plan)

        return ask(f"detector {self.name}", "detect", Verdict, judged)


class AskedReasoner:
    """Explains within its time."""

    def __init__(self, reasoner: Reasoner) -> None:
        self._reasoner, self.name = reasoner, reasoner.name

    def diagnose(self, context: BoundaryContext, verdict: Verdict) -> Diagnosis:
        """As the reasoner."""
        part = f"reasoner {self.name}"
        return ask(part, "diagnose", Diagnosis, self._reasoner.diagnose, context, verdict)


class AskedLocator:
    """Verifies and explains, each question within its time."""

    def __init__(self, locator: Locator) -> None:
        self._locator, self.name = locator, locator.name

    def verify(self, context: BoundaryContext, tried: Tried) -> Verified:
        """As the locator."""
        part = f"locator {self.name}"
        return ask(part, "diagnose", Verified, self._locator.verify, context, tried)

    def explain(
        self, context: BoundaryContext, story: Sequence[Tried], failed: Tried | None
    ) -> Located:
        """As the locator."""
        part = f"locator {self.name}"
        return ask(part, "diagnose", Located, self._locator.explain, context, story, failed)


class AskedReplanner:
    """Makes a plan within its time; one that takes a `deadline` is told when that is over."""

    def __init__(self, replanner: Replanner) -> None:
        self._replanner, self.name = replanner, replanner.name
        self._stops = "deadline" in signature(replanner.replan).parameters

    def replan(self, context: BoundaryContext, diagnosis: Diagnosis) -> Replan:
        """As the replanner."""

        def made() -> Replan:
            until: dict[str, Any] = {"deadline": deadline()} if self._stops else {}
            return self._replanner.replan(context, diagnosis, **until)

        return ask(f"replanner {self.name}", "replan", Replan, made)


class AskedValidator:
    """Checks a plan within its time."""

    def __init__(self, validator: PlanValidator) -> None:
        self._validator = validator

    @property
    def domain(self) -> Domain:
        """As the validator."""
        return self._validator.domain

    def check(self, plan: Plan, graph: SceneGraph, goal: Goal) -> PlanCheck:
        """As the validator."""
        return ask("validator", "validate", PlanCheck, self._validator.check, plan, graph, goal)
