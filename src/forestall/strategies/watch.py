"""The plan as given, judged by many judges at once and never interrupted.

Called by the runtime at each boundary; retriever, judges and reasoner come through the constructor.
One such run gives every judge the same observations, so that they can be compared boundary by
boundary.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from forestall.errors import InputError
from forestall.seams.judging import Detector, Reasoner, Retriever
from forestall.strategies.asked import AskedDetector, AskedReasoner, AskedRetriever
from forestall.strategies.intervention import Clock
from forestall.strategies.judges import Judge
from forestall.types.episode import SkillOutcome
from forestall.types.runtime import BoundaryContext, LooksAfter, StrategyAnswer
from forestall.types.verdict import Decision, Verdict

_GO_ON = StrategyAnswer(Decision.PROCEED)


class Watch:
    """Judges each subtask before it starts, and lets it start.

    The detector is the primary judge: it asks for another look whenever it wants one, and its alarm
    is diagnosed and stays in the record as an alarm that nothing came of. Every other judge has
    another look, too, before its first alarm of a run stands: that alarm tells whether the run was
    in time or falsely alarmed. Later ones come at the first look, as one who has alarmed would look
    again at every subtask that is left. All judge what is seen then.

    Args:
        retriever: finds the references, the same for all that bring none of their own.
        detector: the primary judge.
        judges: the others; their names tell them apart.
        reasoner: explains the primary one's alarms.

    Raises:
        InputError: two of the same name.
    """

    name = "watch"
    looks_after = LooksAfter.NOTHING

    def __init__(
        self,
        retriever: Retriever,
        detector: Detector,
        judges: Sequence[Judge],
        reasoner: Reasoner,
    ) -> None:
        names = [detector.name, *(j.name for j in judges)]
        twice = sorted(n for n, count in Counter(names).items() if count > 1)
        if twice:
            raise InputError(f"several judges are called {', '.join(twice)}")
        self._retriever = AskedRetriever(retriever)
        self._primary = AskedDetector(detector)
        self._judges = tuple(judges)
        self._reasoner = AskedReasoner(reasoner)
        self._settled: set[str] = set()

    def before_subtask(self, context: BoundaryContext) -> StrategyAnswer:
        """Let every judge judge; on an alarm of the primary one, diagnose; go on."""
        if context.index == 0 and context.looks == 1:
            self._settled.clear()
        clock = Clock()
        references = tuple(
            self._retriever.retrieve(context.subtask, context.task.name, context.done)
        )
        clock.lap("retrieve")
        context = replace(context, references=references)
        verdict = self._primary.judge(context.scoped, context.observation, references, context)
        clock.lap("compare")
        if verdict.decision is Decision.LOOK_AGAIN:
            if context.may_look:
                return StrategyAnswer(Decision.LOOK_AGAIN, verdict, seconds=clock.items())
            verdict = replace(verdict, decision=Decision.REPLAN)
        others = [judge.judge(context) for judge in self._judges]
        clock.lap("watch")
        if context.may_look and (asking := self._asking(others)):
            wanted = replace(verdict, decision=Decision.LOOK_AGAIN)
            why = f"another look for {', '.join(asking)}"
            return StrategyAnswer(Decision.LOOK_AGAIN, wanted, why=why, seconds=clock.items())
        self._settled.update(v.detector for v in others if v.decision is not Decision.PROCEED)
        diagnosis = None
        if verdict.decision is Decision.REPLAN:
            diagnosis = self._reasoner.diagnose(context, verdict)
            clock.lap("diagnose")
        return StrategyAnswer(
            Decision.PROCEED,
            verdict,
            diagnosis,
            seconds=clock.items(),
            watched=(verdict, *others),
            only_watched=True,
        )

    def _asking(self, verdicts: Sequence[Verdict]) -> list[str]:
        """Judges that want another look, and of which no alarm stands."""
        return [
            v.detector
            for v in verdicts
            if v.decision is Decision.LOOK_AGAIN and v.detector not in self._settled
        ]

    def after_subtask(self, context: BoundaryContext, outcome: SkillOutcome) -> StrategyAnswer:
        """Go on."""
        return _GO_ON

    def after_episode(self, context: BoundaryContext) -> StrategyAnswer:
        """Go on."""
        return _GO_ON
