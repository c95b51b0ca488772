"""Replanning after a subtask has failed (REFLECT-online, paper, Sec. 4 and Table 1).

Called by the runtime before and after each subtask. Retriever, detector,
reasoner, replanner and validator come through the constructor, the same as the proactive strategy
has; what follows an alarm is in `intervention.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from forestall.seams.judging import Detector, Locator, PlanValidator, Reasoner, Replanner, Retriever
from forestall.strategies.asked import AskedDetector, AskedLocator, AskedReasoner, AskedRetriever
from forestall.strategies.intervention import SKILL_STATUS, Clock, Intervention, checked, look_again
from forestall.strategies.story import Story
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.exchange import Exchange
from forestall.types.facts import Literal
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.types.runtime import BoundaryContext, LooksAfter, StrategyAnswer, When
from forestall.types.story import Located, Verified
from forestall.types.verdict import Decision, Diagnosis, Reference, Verdict, scenes

_GO_ON = StrategyAnswer(Decision.PROCEED)

VERIFIED = "subgoal check"
"""Name of the verdict that a locator gives."""


class Online:
    """Judges the outcome of each subtask when it is over.

    - The robot's own controller says that the skill did not succeed: what the subtask needs and
      does not hold is named from the scenes before it in the demonstrations, and the rest of the
      plan, this subtask included, is replanned. Why the controller gave up is not asked.
    - It went through, and the scene after it does not fit the scenes after it in the
      demonstrations: what held there and does not here must change, and the plan goes on behind it.

    What was wrong before the subtask already is not its outcome: whether a subtask has succeeded is
    another question than whether the next one will. It becomes its outcome when the subtask puts
    something into or onto the thing that is wrong, as slices into a bowl of wine (paper, Sec. 4).
    Steps of a repair have no demonstration; what is left of the plan is checked after them.

    With a locator, as REFLECT-online has it, nothing is compared: each subtask but driving, those
    of a repair too, is verified by what is seen after it, and one that did not do what it is for is
    explained from the story of the run so far. Where the locator cannot say, all is as without it.

    Args:
        retriever: finds the references.
        detector: judges the scene after a subtask.
        reasoner: explains.
        replanner: makes the corrected plan.
        validator: says whether what is left of a plan runs on what is seen.
        scope: the part of a graph that concerns a subtask, as the perceiver cuts it.
        max_attempts: repairs of one cause.
        inherited: whether every deviation counts that was there before the subtask.
        locator: says whether a subtask did what it is for, and why it did not.
    """

    name = "online"
    looks_after = LooksAfter.SUBTASK

    def __init__(
        self,
        retriever: Retriever,
        detector: Detector,
        reasoner: Reasoner,
        replanner: Replanner,
        validator: PlanValidator,
        scope: Callable[[SceneGraph, Subtask], SceneGraph],
        max_attempts: int = 2,
        *,
        inherited: bool = False,
        locator: Locator | None = None,
    ) -> None:
        self._retriever = AskedRetriever(retriever)
        self._detector = AskedDetector(detector)
        self._reasoner = AskedReasoner(reasoner)
        self._intervention = Intervention(replanner, validator, max_attempts)
        self._scope = scope
        self._inherited = inherited
        self._before: BoundaryContext | None = None
        self._locator = None if locator is None else AskedLocator(locator)
        self._story = Story(scope, validator.domain)

    def before_subtask(self, context: BoundaryContext) -> StrategyAnswer:
        """Go on; what is seen now is kept for when the subtask is over."""
        self._intervention.begin(context)
        if context.index == 0 and context.replans == 0:
            self._story.begin()
        self._before = context
        return _GO_ON

    def after_subtask(self, context: BoundaryContext, outcome: SkillOutcome) -> StrategyAnswer:
        """Did the subtask succeed? On a failure diagnose and replan."""
        clock = Clock()
        if self._locator is not None:
            self._story.tried(context, outcome.status)
            self._story.saw(context.graph)
        if outcome.status is not SkillStatus.SUCCEEDED:
            return self._failed(context, outcome.status, clock)
        onward = replace(context, index=context.index + 1)
        asked: tuple[Exchange, ...] = ()
        if self._locator is not None and self._story.is_subgoal(self._story.told[-1]):
            found = self._locator.verify(context, self._story.told[-1])
            clock.lap("compare")
            if found.satisfied is not None:
                return self._by_locator(self._locator, found, onward, clock)
            asked = found.exchanges
        return _with(self._compared(context, onward, clock), asked)

    def _by_locator(
        self, locator: AskedLocator, found: Verified, onward: BoundaryContext, clock: Clock
    ) -> StrategyAnswer:
        """What follows from the answer to REFLECT's question about a subtask."""
        done = bool(found.satisfied)
        verdict = replace(checked(VERIFIED, done, found.why), exchanges=found.exchanges)
        if done:
            return StrategyAnswer(Decision.PROCEED, verdict, seconds=clock.items())
        told = self._located(locator, onward)
        diagnosis = told.diagnosis or Diagnosis(
            f"{onward.subtask} did not do what it is for: {found.why}",
            (),
            producer=locator.name,
            exchanges=told.exchanges,
        )
        diagnosis = self._with_facts(diagnosis, onward, clock) or diagnosis
        clock.lap("diagnose")
        return self._intervention.alarm(onward, verdict, diagnosis, clock)

    def _located(self, locator: AskedLocator, context: BoundaryContext) -> Located:
        """Why the newest subtask went wrong, from the story until then."""
        return locator.explain(context, tuple(self._story.told), self._story.told[-1])

    def _compared(
        self, context: BoundaryContext, onward: BoundaryContext, clock: Clock
    ) -> StrategyAnswer:
        """By the scenes after the subtask in the demonstrations."""
        if self._intervention.repairs(context):
            return self._intervention.check_rest(onward, clock)
        references = self._references(context)
        after = tuple(
            replace(r, graph=self._scope(r.after, r.subtask))
            for r in references
            if r.after is not None
        )
        clock.lap("retrieve")
        verdict = self._detector.judge(context.scoped, context.observation, after)
        clock.lap("compare")
        if verdict.decision is Decision.LOOK_AGAIN and context.may_look:
            return look_again(verdict, clock)
        if verdict.decision is Decision.PROCEED:
            return StrategyAnswer(Decision.PROCEED, verdict, seconds=clock.items())
        verdict = replace(verdict, decision=Decision.REPLAN)
        diagnosis = self._reasoner.diagnose(replace(context, references=after), verdict)
        diagnosis = self._outcome_only(diagnosis, references, verdict)
        clock.lap("diagnose")
        return self._intervention.alarm(onward, verdict, diagnosis, clock)

    def after_episode(self, context: BoundaryContext) -> StrategyAnswer:
        """Go on: the outcome of the last subtask has been verified, the goal is not its affair."""
        return _GO_ON

    def _failed(
        self, context: BoundaryContext, status: SkillStatus, clock: Clock
    ) -> StrategyAnswer:
        """What does the subtask need that does not hold now? It is still to be done."""
        verdict = checked(
            SKILL_STATUS, False, f"the robot reports that the skill was {_SAID[status]}"
        )
        diagnosis = None
        if not self._intervention.repairs(context):
            references = self._references(context)
            clock.lap("retrieve")
            needs = replace(context, references=references, when=When.BEFORE)
            told = None if self._locator is None else self._located(self._locator, context)
            diagnosis = None if told is None else told.diagnosis
            if diagnosis is None:
                diagnosis = self._reasoner.diagnose(needs, verdict)
                asked = () if told is None else told.exchanges
                diagnosis = replace(diagnosis, exchanges=(*asked, *diagnosis.exchanges))
            clock.lap("diagnose")
        diagnosis = self._with_facts(diagnosis, context, clock)
        if diagnosis is None:
            diagnosis = Diagnosis(f"nothing is seen that stands against {context.subtask}", ())
        if not diagnosis.must_change and context.may_look:
            return look_again(verdict, clock, diagnosis.cause)
        return self._intervention.alarm(context, verdict, diagnosis, clock)

    def _with_facts(
        self, diagnosis: Diagnosis | None, context: BoundaryContext, clock: Clock
    ) -> Diagnosis | None:
        """Where a diagnosis names no fact, those that the check of the plan lacks; words stay."""
        if diagnosis is not None and diagnosis.must_change:
            return diagnosis
        missing = self._intervention.why_not(context, clock)
        if missing is None or diagnosis is None:
            return missing or diagnosis
        if not diagnosis.advice:
            return replace(missing, exchanges=diagnosis.exchanges)
        return replace(diagnosis, must_change=missing.must_change, refusal=missing.refusal)

    def _references(self, context: BoundaryContext) -> tuple[Reference, ...]:
        return scenes(self._retriever.retrieve(context.subtask, context.task.name, context.done))

    def _outcome_only(
        self, diagnosis: Diagnosis, references: tuple[Reference, ...], verdict: Verdict
    ) -> Diagnosis:
        """The diagnosis without what was wrong before and is no affair of the subtask."""
        if self._inherited or self._before is None or not diagnosis.must_change:
            return diagnosis
        before = replace(self._before, references=references)
        earlier = self._reasoner.diagnose(before, verdict)
        exchanges = (*diagnosis.exchanges, *earlier.exchanges)
        diagnosis, known = replace(diagnosis, exchanges=exchanges), set(earlier.must_change)
        own = tuple(
            x
            for x in diagnosis.must_change
            if x not in known or _of_the_receiver(x, before.subtask)
        )
        if own == diagnosis.must_change:
            return diagnosis
        if not own:
            cause = f"nothing was found that the subtask did wrong; before it: {diagnosis.cause}"
        elif own[0] == diagnosis.must_change[0]:
            cause = diagnosis.cause
        else:
            cause = f"after {before.subtask} it is not so that {', '.join(map(str, own))}"
        return replace(diagnosis, cause=cause, must_change=own)


class OnlineScene(Online):
    """As `Online`, but whatever is wrong after a subtask counts, whoever did it.

    Shows what the restriction to the outcome is worth: a scene after a subtask is nearly the scene
    before the next one, so that this strategy sees ahead, too.
    """

    name = "online-scene"

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **{"inherited": True, **kwargs})


def _with(answer: StrategyAnswer, asked: tuple[Exchange, ...]) -> StrategyAnswer:
    """An answer with what was asked in vain before it."""
    if not asked or answer.verdict is None:
        return answer
    verdict = replace(answer.verdict, exchanges=(*asked, *answer.verdict.exchanges))
    return replace(answer, verdict=verdict)


def _of_the_receiver(literal: Literal, subtask: Subtask) -> bool:
    """Whether a fact is a state of the thing that the subtask puts something into or onto."""
    args = subtask.args
    return len(args) == 2 and literal.is_state and args[1] in literal.args


_SAID = {
    SkillStatus.SUCCEEDED: "done",
    SkillStatus.REFUSED: "refused",
    SkillStatus.FAILED: "begun and went wrong",
}
