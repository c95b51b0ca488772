"""The paper's detector: replan if no retrieved reference is similar enough (Sec. 3, S < 0.9).

Called by the proactive strategy at each boundary; calls the graph scorer that it was given.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from forestall.calibration.fitted import JudgeThresholds
from forestall.errors import InputError
from forestall.seams.judging import GraphScorer
from forestall.types.graph import ObjectNode, SceneGraph, Seen
from forestall.types.observation import Observation
from forestall.types.plan import Subtask
from forestall.types.verdict import (
    Calibration,
    Decision,
    Reference,
    Threshold,
    Verdict,
    demonstrations_of,
    scenes,
)

NO_REFERENCE = (
    "no demonstration has a subtask similar enough to compare with, so nothing was judged"
)
NOT_COMPARABLE = "no demonstration had found {} at this point, so nothing was judged"


@dataclass(frozen=True, slots=True)
class DetectorConfig:
    """Threshold of the score below which a scene does not fit (paper: 0.9).

    `located_share` is the share of the references that must have located an argument for its
    absence to call for another look.
    """

    threshold: float = 0.9
    located_share: float = 0.5

    def __post_init__(self) -> None:
        if not 0 <= self.threshold <= 1:
            raise InputError(f"threshold {self.threshold} is not between 0 and 1")


class SceneGraphDetector:
    """Judges by the best score over the references (implements `Detector`).

    - any reference at or above the threshold: proceed;
    - none, and an argument of the subtask that the references had located was not located here:
      look again, because what was not seen cannot be called wrong;
    - none otherwise: replan;
    - no reference at all: proceed with score None and a note; nothing was judged.

    A reference that had not yet found an argument that is in sight here cannot say how it should
    be, and is not compared with.

    Args:
        scorer: compares graphs.
        config: the threshold.
        name: told apart where several, each with a part of the score left out, watch one run.
        thresholds: from a calibration; where it has none, the configured one stands and is called
            uncalibrated.
    """

    name = "scene-graph"

    def __init__(
        self,
        scorer: GraphScorer,
        config: DetectorConfig | None = None,
        name: str = name,
        thresholds: JudgeThresholds | None = None,
    ) -> None:
        self.name = name
        self._scorer = scorer
        self._config = config or DetectorConfig()
        self._thresholds = thresholds

    def noticed(
        self, verdict: Verdict, observed: SceneGraph, observation: Observation | None
    ) -> tuple[str, ...]:
        """What it sees of a mismatch: each difference from the nearest demonstration."""
        if verdict.decision is Decision.PROCEED:
            return ()
        return tuple(d.text for d in verdict.discrepancies)

    def judge(
        self, observed: SceneGraph, observation: Observation | None, references: Sequence[Reference]
    ) -> Verdict:
        """Compare the scoped graph of a boundary with every reference."""
        line = drawn(self._thresholds, observed.subtask, self._config.threshold)
        references = scenes(references)
        able = [r for r in references if not unseen_by(r, observed)]
        best = self._scorer.best(observed, able)
        if best is None or best.score is None:
            unknown = sorted({name for r in references for name in unseen_by(r, observed)})
            return Verdict(
                Decision.PROCEED,
                self.name,
                None,
                line.value,
                Calibration.UNCALIBRATED,
                references=demonstrations_of(references),
                note=NOT_COMPARABLE.format(", ".join(unknown)) if references else NO_REFERENCE,
            )
        verdict = replace(
            best,
            detector=self.name,
            threshold=line.value,
            calibration=line.calibration,
            references=demonstrations_of(able),
            note=line.note,
            p_value=rarity(self._thresholds, observed.subtask, best.score),
        )
        if best.score >= line.value:
            return replace(verdict, decision=Decision.PROCEED)
        unseen = unseen_arguments(observed, references, self._config.located_share)
        if unseen:
            note = f"not located here, but in the demonstrations: {', '.join(unseen)}"
            return replace(verdict, decision=Decision.LOOK_AGAIN, note=note)
        return replace(verdict, decision=Decision.REPLAN)


def drawn(thresholds: JudgeThresholds | None, subtask: Subtask | None, own: float) -> Threshold:
    """Where a detector draws the line before a subtask: calibrated, or by its own threshold."""
    if thresholds is None or subtask is None:
        return Threshold(own)
    return thresholds.threshold(subtask.skill, own)


def rarity(
    thresholds: JudgeThresholds | None, subtask: Subtask | None, score: float
) -> float | None:
    """The p-value of a score; None where nothing was calibrated."""
    if thresholds is None or subtask is None:
        return None
    return thresholds.p_value(subtask.skill, score)


def unseen_arguments(
    observed: SceneGraph, references: Sequence[Reference], share: float
) -> tuple[str, ...]:
    """Arguments of the subtask that are not located here and were in the references."""
    subtask = observed.subtask
    if subtask is None:
        return ()
    same = [r for r in references if r.subtask.skill == subtask.skill] or list(references)
    unseen = []
    for role, name in enumerate(subtask.args):
        if any(is_located(observed.get(i)) for i in observed.matches(name)):
            continue
        shown = [
            is_located(r.graph.get(r.subtask.args[role]))
            for r in same
            if role < len(r.subtask.args)
        ]
        if shown and sum(shown) >= share * len(shown):
            unseen.append(name)
    return tuple(unseen)


def unseen_by(reference: Reference, observed: SceneGraph) -> tuple[str, ...]:
    """Arguments that are in sight here and were not known in a reference of the same skill."""
    subtask, other = observed.subtask, reference.subtask
    if subtask is None or len(subtask.args) != len(other.args):
        return ()
    return tuple(
        name
        for name, there in zip(subtask.args, other.args, strict=True)
        if observed.matches(name) and not reference.graph.matches(there)
    )


def is_located(node: ObjectNode | None) -> bool:
    """Whether an object is there with a box, in view or remembered."""
    return node is not None and node.box_m is not None and node.seen is not Seen.UNOBSERVED
