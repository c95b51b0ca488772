"""Replanning when the whole task has been executed (REFLECT, paper, Sec. 4 and Table 1).

Called by the runtime at each boundary, after each subtask and at the end of the plan. Retriever,
detector, reasoner, replanner and validator come through the constructor, the same as the proactive
strategy has; what follows an alarm is in `intervention.py`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from forestall.seams.judging import Detector, Locator, PlanValidator, Reasoner, Replanner, Retriever
from forestall.strategies.asked import AskedDetector, AskedLocator, AskedReasoner, AskedRetriever
from forestall.strategies.intervention import Clock, Intervention, look_again
from forestall.strategies.story import Scope, Story
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.exchange import Exchange
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.types.runtime import BoundaryContext, LooksAfter, StrategyAnswer
from forestall.types.verdict import Decision, Diagnosis, Verdict, scenes

_GO_ON = StrategyAnswer(Decision.PROCEED)


@dataclass(slots=True)
class _Summary:
    """What is kept of a run to locate its failure: scenes that did not fit, subtasks that failed.

    REFLECT keeps every scene in words (`story.py`, for a locator); only those that can be the
    failure are kept here.
    """

    unlike: list[tuple[BoundaryContext, Verdict]] = field(default_factory=list)
    failed: list[tuple[BoundaryContext, SkillStatus]] = field(default_factory=list)


class PostHoc:
    """Lets the plan run, then checks the goal, locates the failure and corrects it.

    The scenes are judged as they pass, and nothing follows from it: the verdicts are recorded as
    going on, their scores with them. When the plan is finished and its goal is not reached on what
    is seen, the failure is the first scene that did not fit and of which the reasoner names what
    was wrong, else the first subtask that the robot could not do, else the missed goal itself. The
    correction starts from the state that the plan left; what has been spoiled stays so.

    With a locator it is the step that this one names, from the story of the whole run, as REFLECT
    has it; where it cannot say, all is as without it.

    Args:
        retriever: finds the references.
        detector: judges the scenes.
        reasoner: explains.
        replanner: makes the correction.
        validator: says whether the goal is reached on what is seen.
        max_attempts: corrections of one run (REFLECT makes one).
        locator: names the step that went wrong, and why.
        scope: the part of a graph that concerns a subtask; a locator needs it.
    """

    name = "post-hoc"
    looks_after = LooksAfter.EPISODE

    def __init__(
        self,
        retriever: Retriever,
        detector: Detector,
        reasoner: Reasoner,
        replanner: Replanner,
        validator: PlanValidator,
        max_attempts: int = 1,
        *,
        locator: Locator | None = None,
        scope: Scope | None = None,
    ) -> None:
        self._retriever = AskedRetriever(retriever)
        self._detector = AskedDetector(detector)
        self._reasoner = AskedReasoner(reasoner)
        self._intervention = Intervention(replanner, validator, max_attempts)
        self._max_attempts = max_attempts
        self._summary = _Summary()
        self._locator = None if locator is None else AskedLocator(locator)
        self._story = Story(scope or _whole, validator.domain)
        self._replans = 0

    def before_subtask(self, context: BoundaryContext) -> StrategyAnswer:
        """Judge what is seen, keep it, go on."""
        self._intervention.begin(context)
        if self._locator is not None:
            if context.replans != self._replans or (context.index == 0 and not context.replans):
                self._story.begin()
            self._replans = context.replans
            self._story.saw(context.graph)
        if context.replans > 0:
            return _GO_ON
        if context.index == 0:
            self._summary = _Summary()
        clock = Clock()
        references = scenes(
            self._retriever.retrieve(context.subtask, context.task.name, context.done)
        )
        clock.lap("retrieve")
        verdict = self._detector.judge(context.scoped, context.observation, references)
        clock.lap("compare")
        if verdict.decision is not Decision.PROCEED:
            self._summary.unlike.append((replace(context, references=references), verdict))
        kept = replace(verdict, decision=Decision.PROCEED)
        return StrategyAnswer(
            Decision.PROCEED, kept, seconds=clock.items(), watched=(verdict,), only_watched=True
        )

    def after_subtask(self, context: BoundaryContext, outcome: SkillOutcome) -> StrategyAnswer:
        """Keep whether the robot could do it, go on."""
        if self._locator is not None:
            self._story.tried(context, outcome.status)
        if outcome.status is not SkillStatus.SUCCEEDED:
            self._summary.failed.append((context, outcome.status))
        return _GO_ON

    def after_episode(self, context: BoundaryContext) -> StrategyAnswer:
        """Check the goal; where it is missed, locate the failure and correct it."""
        clock = Clock()
        verdict, missed = self._intervention.check_goal(context, clock)
        if verdict.decision is Decision.PROCEED:
            return StrategyAnswer(Decision.PROCEED, verdict, seconds=clock.items())
        if context.may_look:
            return look_again(verdict, clock, missed.cause)
        diagnosis = self._located(context, missed)
        clock.lap("diagnose")
        if context.replans >= self._max_attempts:
            made = f"{context.replans} correction{'s' if context.replans != 1 else ''}"
            why = f"the goal is still not reached; {made} made, no more are"
            return StrategyAnswer(Decision.PROCEED, verdict, diagnosis, None, why, clock.items())
        return self._intervention.alarm(context, verdict, diagnosis, clock)

    def _located(self, at_end: BoundaryContext, missed: Diagnosis) -> Diagnosis:
        """Where the run went wrong; what must change is what is still missing of the goal.

        What was needed at the located step is not needed at the end: the goal is. After the last
        correction nobody is asked, since nothing would follow from it.
        """
        asked: tuple[Exchange, ...] = ()
        if self._locator is not None and at_end.replans < self._max_attempts:
            self._story.saw(at_end.graph)
            told = self._story.located(self._locator, at_end)
            if told.diagnosis is not None:
                return replace(
                    told.diagnosis,
                    must_change=missed.must_change,
                    must_stay=missed.must_stay,
                    exchanges=told.exchanges,
                )
            asked = told.exchanges
        for context, verdict in self._summary.unlike:
            found = self._reasoner.diagnose(context, verdict)
            asked = (*asked, *found.exchanges)
            if found.found:
                where = f"located at step {context.index + 1}, {context.subtask}: {found.cause}"
                return replace(
                    missed,
                    cause=where,
                    culprits=found.culprits,
                    producer=self._reasoner.name,
                    why=found.why,
                    advice=found.advice,
                    exchanges=asked,
                )
        missed = replace(missed, exchanges=asked)
        if self._summary.failed:
            context, status = self._summary.failed[0]
            where = f"located at step {context.index + 1}, {context.subtask}: it was {status.value}"
            return replace(missed, cause=f"{where}; {missed.cause}")
        return missed


def _whole(graph: SceneGraph, subtask: Subtask) -> SceneGraph:
    return graph
