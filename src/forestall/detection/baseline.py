"""What the baseline detectors share: the best score over the references against a threshold.

Called by `image.py`, `caption.py` and `objects.py`; calls nothing.
The paper flags a scene if no
expected configuration is more similar than a threshold (Sec. 4, "Analysis of Potential Failure
Detection", with 0.90, 0.85 and 0.80).
"""

from __future__ import annotations

from collections.abc import Sequence

from forestall.detection.scene_graph import DetectorConfig
from forestall.errors import InputError
from forestall.types.verdict import (
    Calibration,
    Decision,
    Reference,
    Verdict,
    demonstrations_of,
)

NOTHING_TO_COMPARE = "nothing to compare with: {}"


def judged(
    detector: str,
    config: DetectorConfig,
    scores: Sequence[tuple[float, Reference]],
    references: int,
    nothing: str,
) -> Verdict:
    """Replan if the best score is below the threshold; among equals the first reference is nearest.

    Args:
        detector: its name.
        config: the threshold.
        scores: each reference that could be compared, with its score.
        references: how many demonstrations the references come from.
        nothing: why there are no scores, where there are none.
    """
    if not scores:
        return Verdict(
            Decision.PROCEED,
            detector,
            None,
            config.threshold,
            Calibration.UNCALIBRATED,
            references=references,
            note=NOTHING_TO_COMPARE.format(nothing if references else "no reference was found"),
        )
    score, nearest = max(scores, key=lambda s: s[0])
    fits = score >= config.threshold
    compared = demonstrations_of([r for _, r in scores])
    return Verdict(
        Decision.PROCEED if fits else Decision.REPLAN,
        detector,
        score,
        config.threshold,
        Calibration.FIXED,
        nearest=nearest,
        references=references,
        note=f"compared with {compared} of {references} demonstrations",
    )


def of_nearest(verdict: Verdict, subject: str, what: str) -> tuple[str, ...]:
    """A line about the nearest reference and its score, none where nothing speaks against it."""
    nearest = verdict.nearest
    if nearest is None or verdict.score is None or verdict.decision is Decision.PROCEED:
        return ()
    where = f"demonstration {nearest.demonstration}, step {nearest.index + 1} of {nearest.task}"
    asked = f"{verdict.threshold:.2f} is asked for"
    return (f"{subject} is like the nearest {what} ({where}) to {verdict.score:.2f}; {asked}",)


def check_same(what: str, mine: str, theirs: str, reference: Reference) -> None:
    """See that both sides were made by the same encoder or captioner.

    Raises:
        InputError: they were not.
    """
    if mine != theirs:
        raise InputError(
            f"the {what} of demonstration {reference.demonstration} comes from {theirs}, "
            f"this run's from {mine}: record the memory with the same one"
        )
