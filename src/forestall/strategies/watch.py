"""The plan as given, judged by several detectors at once and never interrupted.

Called by the runtime at each boundary; retriever, detectors and reasoner come through the
constructor. One such run gives every detector the same observations, so that they can be compared
boundary by boundary.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from forestall.errors import InputError
from forestall.seams import Detector, Reasoner, Retriever
from forestall.strategies.asked import AskedDetector, AskedReasoner, AskedRetriever
from forestall.strategies.intervention import Clock
from forestall.types.episode import SkillOutcome
from forestall.types.runtime import BoundaryContext, LooksAfter, StrategyAnswer
from forestall.types.verdict import Decision

_GO_ON = StrategyAnswer(Decision.PROCEED)


class Watch:
    """Judges each subtask before it starts, and lets it start.

    The first detector is the primary one: it alone may ask for another look, so that what is seen
    until its first alarm is what a proactive run with it would see. Its alarm is diagnosed, and
    stays in the record as an alarm that nothing came of.

    Args:
        retriever: finds the references, the same for all.
        detectors: the primary one first; their names tell them apart.
        reasoner: explains the primary one's alarms.

    Raises:
        InputError: no detector, or two of the same name.
    """

    name = "watch"
    looks_after = LooksAfter.NOTHING

    def __init__(
        self, retriever: Retriever, detectors: Sequence[Detector], reasoner: Reasoner
    ) -> None:
        if not detectors:
            raise InputError("there is nothing to watch with: give at least one detector")
        twice = sorted(n for n, count in Counter(d.name for d in detectors).items() if count > 1)
        if twice:
            raise InputError(f"several detectors are called {', '.join(twice)}")
        self._retriever = AskedRetriever(retriever)
        self._primary, *self._others = (AskedDetector(d) for d in detectors)
        self._reasoner = AskedReasoner(reasoner)

    def before_subtask(self, context: BoundaryContext) -> StrategyAnswer:
        """Let every detector judge; on an alarm of the primary one, diagnose; go on."""
        clock = Clock()
        references = tuple(
            self._retriever.retrieve(context.subtask, context.task.name, context.done)
        )
        clock.lap("retrieve")
        context = replace(context, references=references)
        verdict = self._primary.judge(context.scoped, context.observation, references)
        clock.lap("compare")
        if verdict.decision is Decision.LOOK_AGAIN:
            if context.may_look:
                return StrategyAnswer(Decision.LOOK_AGAIN, verdict, seconds=clock.items())
            verdict = replace(verdict, decision=Decision.REPLAN)
        diagnosis = None
        if verdict.decision is Decision.REPLAN:
            diagnosis = self._reasoner.diagnose(context, verdict)
            clock.lap("diagnose")
        watched = [verdict]
        for detector in self._others:
            watched.append(detector.judge(context.scoped, context.observation, references))
            clock.lap("watch")
        return StrategyAnswer(
            Decision.PROCEED, verdict, diagnosis, seconds=clock.items(), watched=tuple(watched)
        )

    def after_subtask(self, context: BoundaryContext, outcome: SkillOutcome) -> StrategyAnswer:
        """Go on."""
        return _GO_ON

    def after_episode(self, context: BoundaryContext) -> StrategyAnswer:
        """Go on."""
        return _GO_ON
