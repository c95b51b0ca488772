"""Judging by what always held: the heaviest mined precondition that a scene violates.

Called like every detector at a boundary; calls the mining of the comparison. It needs no score:
clutter that no demonstration had changes nothing, and one decisive fact is not diluted by a scene
that is otherwise alike. Told the plan, it needs no reference either: it asks the counts of the
whole memory, and looks at what later steps need, too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import partial

from forestall.calibration.fitted import JudgeThresholds
from forestall.comparison.corrections import Corrections
from forestall.comparison.expectations import NoExpectations, shown
from forestall.comparison.lacking import Knowledge, lacking, step_of
from forestall.comparison.preconditions import MiningConfig, mine, needed, violations
from forestall.comparison.relevance import counts
from forestall.comparison.unasked import Unasked, not_judged, unasked
from forestall.detection.scene_graph import NO_REFERENCE, drawn, rarity
from forestall.domain.asked import not_understood
from forestall.domain.model import Domain
from forestall.errors import InputError
from forestall.seams.judging import Expectations
from forestall.types.facts import Literal, Truth, category_of
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation
from forestall.types.plan import Subtask
from forestall.types.runtime import BoundaryContext, When
from forestall.types.verdict import (
    Calibration,
    Decision,
    Precondition,
    Reference,
    Verdict,
    Violation,
    demonstrations_of,
    scenes,
)

_TOLD = 3
"""How many facts a note names."""

_SILENT = "no alarm, because too many good runs had one, so nothing was judged"
"""What is told of a violation where a calibration leaves no alarm."""

_KEPT = 256
"""How many sets of mined preconditions are remembered."""


@dataclass(frozen=True, slots=True)
class PreconditionConfig:
    """When a violated precondition is an alarm.

    Args:
        threshold: alarm where the score, 1 minus the weight of the heaviest violated precondition,
            is below. The weight is the probability that it is a need and no habit
            (`comparison.tally`): where nothing is known of other times one demonstration weighs
            0.67, twelve weigh 0.93; what varied at other times weighs more, what never varied
            less. With 0.5 every violation is an alarm; a lower one asks for more demonstrations
            than one.

    Raises:
        InputError: a threshold that is not between 0 and 1.
    """

    threshold: float = 0.5

    def __post_init__(self) -> None:
        if not 0 <= self.threshold <= 1:
            raise InputError(f"threshold {self.threshold} is not between 0 and 1")


class PreconditionDetector:
    """Judges by mined preconditions (implements `Detector`).

    - a precondition is violated whose weight the threshold asks for: replan;
    - none is, but one could not be observed, or an argument has a relation or an attribute that
      the domain does not know: look again, because what was not seen or not known is neither;
    - all hold: proceed; a note says what other tasks ask and does not hold, where nobody has shown
      such a subtask in the task at hand;
    - nothing was mined: proceed without a score and with a note; nothing was judged;
    - a calibration leaves no alarm, and a precondition is violated that no person added: the same.

    Args:
        domain: what facts there are about arguments.
        mining: how much evidence a precondition needs.
        config: the threshold.
        thresholds: from a calibration, which has counted the alarms of good runs: as a judge that
            says yes or no it may alarm or it may not, whatever the weight; what a person added
            alarms all the same.
        corrections: what a person says of what is mined.
        knowledge: what is known of the whole memory and of the plan; None: only the references of
            a boundary are.
        expectations: what should hold before subtasks that no demonstration in the whole memory
            shows.
    """

    name = "preconditions"

    def __init__(
        self,
        domain: Domain,
        mining: MiningConfig | None = None,
        config: PreconditionConfig | None = None,
        thresholds: JudgeThresholds | None = None,
        corrections: Corrections | None = None,
        *,
        knowledge: Knowledge | None = None,
        expectations: Expectations | None = None,
    ) -> None:
        self._expectations = expectations or NoExpectations()
        self._domain = domain
        self._knowledge = knowledge
        self._mining = mining or MiningConfig()
        self._config = config or PreconditionConfig()
        self._thresholds = thresholds
        self._corrections = corrections
        self._mined: dict[object, tuple[Precondition, ...]] = {}
        self._unasked: dict[object, tuple[Unasked, ...]] = {}

    def knowing(self, knowledge: Knowledge) -> PreconditionDetector:
        """The same detector with another memory."""
        other = copy(self)
        other._knowledge, other._mined, other._unasked = knowledge, {}, {}
        return other

    def judge(
        self,
        observed: SceneGraph,
        observation: Observation | None,
        references: Sequence[Reference],
        context: BoundaryContext | None = None,
    ) -> Verdict:
        """See which mined preconditions hold on the scoped graph of a boundary."""
        line = None
        if self._thresholds is not None:
            line = drawn(self._thresholds, observed.subtask, 1.0)
        silent = line is not None and line.value <= 0
        verdict = self._judge(observed, references, context, silent)
        if context is not None:
            verdict = replace(verdict, exchanges=self._expectations.asked(context))
        alarm = verdict.decision is Decision.REPLAN
        if line is None or verdict.score is None or (silent and alarm):
            return verdict
        return replace(
            verdict,
            calibration=line.calibration,
            note="; ".join(n for n in (verdict.note, line.note) if n),
            p_value=rarity(self._thresholds, observed.subtask, 0.0 if alarm else 1.0),
        )

    def _judge(
        self,
        observed: SceneGraph,
        references: Sequence[Reference],
        context: BoundaryContext | None,
        silent: bool,
    ) -> Verdict:
        subtask, knowledge = observed.subtask, self._knowledge
        if context is None or context.when is not When.BEFORE:
            knowledge = None
        if subtask is None or (knowledge is None and not references):
            return self._verdict(Decision.PROCEED, None, references, NO_REFERENCE)
        if not scenes(references) and not all(observed.matches(a) for a in subtask.args):
            return self._verdict(Decision.PROCEED, None, references, NO_REFERENCE)
        if knowledge is None or context is None:
            mined = self._preconditions(references, subtask)
            found = [
                v
                for v in violations(mined, observed, subtask, self._domain)
                if counts(v, subtask, observed, When.BEFORE, self._domain)
            ]
        else:
            here = replace(context, subtask=subtask, scoped=observed, references=tuple(references))
            step = step_of(references, here.task.name, here.done)
            mined = self._known(knowledge, here, subtask, step)
            found = lacking(here, partial(self._known, knowledge, here), knowledge, self._domain)
        if not mined and not found:
            note = f"nothing always held before {subtask.skill}, so nothing was judged"
            note = note if references else NO_REFERENCE
            if left := self._not_judged(knowledge, observed, subtask, context):
                note = f"{note}; {left}"
            return self._verdict(Decision.PROCEED, None, references, note)
        false = [v for v in found if v.truth is Truth.FALSE]
        score = 1.0 - max((weight(v) for v in false), default=0.0)
        if score < self._config.threshold:
            if silent:
                by_hand = [v for v in false if v.precondition.by_hand]
                if not by_hand:
                    note = f"{_SILENT}; {_listed('violated', false)}"
                    return self._verdict(Decision.PROCEED, None, references, note)
                false = by_hand
            asked = [v for v in false if 1.0 - weight(v) < self._config.threshold]
            facts = tuple(dict.fromkeys(v.literal for v in asked))
            note = _listed("violated", false)
            verdict = self._verdict(Decision.REPLAN, score, references, note, facts)
            return replace(verdict, expected_by=max(false, key=weight).precondition.expected_by)
        unseen = [v for v in found if v.truth is Truth.UNOBSERVED]
        strange = not_understood(observed, subtask, self._domain)
        strange += self._never_shown(subtask, references)
        if unseen or strange:
            seen_not = [_listed("not observed", unseen)] if unseen else []
            note = "; ".join([*strange, *seen_not])
            return self._verdict(Decision.LOOK_AGAIN, score, references, note)
        models = dict.fromkeys(p.expected_by for p in mined if p.expected_by)
        if not models:
            note = self._not_judged(knowledge, observed, subtask, context)
            return self._verdict(Decision.PROCEED, score, references, note)
        by = " and ".join(models)
        note = f"no demonstration of it; it is as the language model {by} expects"
        return replace(self._verdict(Decision.PROCEED, score, references, note), expected_by=by)

    def _never_shown(self, subtask: Subtask, references: Sequence[Reference]) -> list[str]:
        """Arguments of a kind that the skill does not take, as far as anybody knows or has shown.

        Needs of the other arguments would else let it start.
        """
        skill = self._domain.skills.get(subtask.skill)
        if skill is None:
            return []
        shown = {
            (place, category_of(name))
            for r in references
            if r.subtask.skill == subtask.skill
            for place, name in enumerate(r.subtask.args)
        }
        found = []
        for place, (name, taken) in enumerate(zip(subtask.args, skill.parameters, strict=True)):
            category = category_of(name)
            known = self._domain.find(category)
            fits = known is not None and self._domain.is_a(known.name, taken.kind)
            if taken.kind is not None and not fits and (place, category) not in shown:
                of = f"no demonstration of {subtask.skill} has a {category} there"
                found.append(f"{name} is no {taken.kind}, and {of}")
        return found

    def _not_judged(
        self,
        knowledge: Knowledge | None,
        observed: SceneGraph,
        subtask: Subtask,
        context: BoundaryContext | None,
    ) -> str:
        """What another task asks and does not hold here; "" where there is nothing of the kind."""
        if knowledge is None or context is None:
            return ""
        memory, task = knowledge.counts(), context.task.name
        key = (subtask.skill, tuple(memory.kinds(subtask).values()), task, memory.runs)
        if key not in self._unasked:
            if len(self._unasked) >= _KEPT:
                self._unasked.clear()
            self._unasked[key] = unasked(memory, subtask, task, self._mining)
        return not_judged(self._unasked[key], observed, subtask, task, memory)

    def _preconditions(
        self, references: Sequence[Reference], subtask: Subtask
    ) -> tuple[Precondition, ...]:
        """What always held; mined once for the same references and the same kinds of arguments."""
        key = (subtask, references[0].task, tuple((r.demonstration, r.index) for r in references))
        return self._once(
            key,
            lambda: self._corrected(
                mine(references, self._domain, self._mining, subtask=subtask),
                subtask,
                references[0].task,
            ),
        )

    def _known(
        self, knowledge: Knowledge, context: BoundaryContext, subtask: Subtask, step: int | None
    ) -> tuple[Precondition, ...]:
        """What always held in the whole memory; mined once for the same kinds of arguments."""
        memory, task = knowledge.counts(), context.task.name
        key = (subtask.skill, tuple(memory.kinds(subtask).values()), task, step, memory.runs)
        mined = self._once(key, lambda: needed(memory, subtask, task, step, self._mining))
        known = self._expectations.over(mined, subtask, context, partial(shown, memory))
        return self._corrected(known, subtask, task)

    def _corrected(
        self, mined: tuple[Precondition, ...], subtask: Subtask, task: str
    ) -> tuple[Precondition, ...]:
        if self._corrections is None:
            return mined
        return self._corrections.over(mined, subtask, task, self._domain)

    def _once(
        self, key: object, mined: Callable[[], tuple[Precondition, ...]]
    ) -> tuple[Precondition, ...]:
        if key not in self._mined:
            if len(self._mined) >= _KEPT:
                self._mined.clear()
            self._mined[key] = mined()
        return self._mined[key]

    def _verdict(
        self,
        decision: Decision,
        score: float | None,
        references: Sequence[Reference],
        note: str = "",
        lacking: tuple[Literal, ...] = (),
    ) -> Verdict:
        return Verdict(
            decision,
            self.name,
            score,
            self._config.threshold,
            Calibration.UNCALIBRATED if score is None else Calibration.FIXED,
            nearest=next(iter(scenes(references)), None),
            references=demonstrations_of(references),
            note=note,
            lacking=lacking,
        )


def weight(violation: Violation) -> float:
    """How much a precondition weighs by its evidence."""
    return violation.precondition.weight


def _listed(what: str, found: Sequence[Violation]) -> str:
    texts = [f"{v.literal} ({_evidence(v)})" for v in found[:_TOLD]]
    more = f" and {len(found) - _TOLD} more" if len(found) > _TOLD else ""
    return f"{what}: {', '.join(texts)}{more}"


def _evidence(violation: Violation) -> str:
    p = violation.precondition
    if p.by_hand:
        return "a correction by hand"
    later = f", before {p.skill}, {violation.ahead} steps ahead" if violation.ahead else ""
    if p.expected_by:
        return f"no demonstration, but the language model {p.expected_by} expects it{later}"
    many = "demonstration" if p.total == 1 else "demonstrations"
    return f"held in {p.support} of {p.total} {many}{later}"
