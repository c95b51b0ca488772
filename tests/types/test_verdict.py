"""A verdict is one whoever made it: no decision of other words, no score that is no number."""

from typing import Any

import numpy as np
import pytest

from forestall.errors import InputError
from forestall.types.verdict import Calibration, Decision, Verdict


@pytest.mark.parametrize("score", [None, 0, 0.5, np.float32(0.5)])
@pytest.mark.parametrize("threshold", [0.9, float("inf"), -float("inf")])
def test_numbers_are_taken(score: Any, threshold: float) -> None:
    assert Verdict(Decision.PROCEED, "d", score, threshold, Calibration.FIXED).score == score


@pytest.mark.parametrize(
    ("decision", "score", "threshold", "says"),
    [
        (Decision.PROCEED, float("nan"), 0.9, "the score of a verdict is a number, not nan"),
        (Decision.PROCEED, "high", 0.9, "the score"),
        (Decision.PROCEED, 0.5, float("nan"), "the threshold"),
        (Decision.PROCEED, 0.5, None, "the threshold"),
        ("proceed", 0.5, 0.9, "a verdict decides proceed"),
        (True, 0.5, 0.9, "a verdict decides"),
    ],
)
def test_an_answer_that_is_none_is_refused(
    decision: Any, score: Any, threshold: Any, says: str
) -> None:
    with pytest.raises(InputError, match=says):
        Verdict(decision, "d", score, threshold, Calibration.FIXED)
