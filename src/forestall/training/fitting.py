"""Temperatures and thresholds, fitted on development answers; never on those that are reported.

Called by `recipe.py`; calls `measure.py` for the values of an attribute.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from forestall.errors import InputError
from forestall.training.measure import Floats, Values, values_of
from forestall.training.questions import ATTRIBUTES

_TEMPERATURES = (0.5, 20.0)
"""An attribute that is always right on the development pictures would get ever surer."""


@dataclass(frozen=True, slots=True)
class Threshold:
    """Answers with a confidence of at least `value` are given.

    The rest is what that gave on `n` development answers: whether balanced accuracy reached the
    target (else `value` is the best there is), balanced accuracy, and the share answered.
    """

    value: float
    reached: bool
    balanced: float
    answered: float
    n: int


def fit_temperature(
    logits: npt.NDArray[np.floating],
    truth: npt.NDArray[np.integer],
    groups: npt.NDArray[np.str_],
    values: Values = ATTRIBUTES,
) -> dict[str, float]:
    """Attribute → the temperature between 0.5 and 20 with the least negative log likelihood.

    Args:
        logits: (n, most values) before division by the temperature; what stands beyond an
            attribute's values is not looked at.
        truth: (n) index of the true value.
        groups: (n) attribute.
        values: attribute → its values.

    Raises:
        InputError: a logit that is not finite.
    """
    from scipy.optimize import minimize_scalar
    from scipy.special import logsumexp

    found = {}
    for group in np.unique(groups).tolist():
        rows = groups == group
        part = logits[rows, : len(values_of(group, values))].astype(np.float64)
        if not np.isfinite(part).all():
            raise InputError(f"logits of {group} are not all finite")
        part -= part[np.arange(len(part)), truth[rows]][:, None]

        def loss(log_temperature: float, part: Floats = part) -> float:
            return float(np.mean(logsumexp(part / np.exp(log_temperature), axis=1)))

        bounds = (float(np.log(_TEMPERATURES[0])), float(np.log(_TEMPERATURES[1])))
        best = minimize_scalar(loss, bounds=bounds, method="bounded", options={"xatol": 1e-4})
        found[group] = float(np.exp(best.x))
    return found


def fit_threshold(
    probability: npt.NDArray[np.floating],
    truth: npt.NDArray[np.integer],
    target_accuracy: float,
    groups: npt.NDArray[np.str_],
    smallest: int = 20,
) -> dict[str, Threshold]:
    """Attribute → the lowest threshold at which balanced accuracy reaches the target.

    Of every true value at least `smallest` answers must be left (or all, where there are fewer): no
    value is dropped to look better. Where the target is out of reach the threshold is the lowest of
    those with the greatest balanced accuracy.

    Args:
        probability: (n, most values).
        truth: (n) index of the true value.
        target_accuracy: balanced accuracy to reach on what is answered, from 0 to 1.
        groups: (n) attribute.
        smallest: answers of a true value that must be left.
    """
    if not 0 <= target_accuracy <= 1 or smallest < 1:
        raise InputError("a target lies between 0 and 1, and at least one answer must be left")
    found = {}
    for group in np.unique(groups).tolist():
        rows = groups == group
        found[group] = _threshold(probability[rows], truth[rows], target_accuracy, smallest)
    return found


def _threshold(
    probability: npt.NDArray[np.floating],
    truth: npt.NDArray[np.integer],
    target: float,
    smallest: int,
) -> Threshold:
    confidence = probability.max(axis=1).astype(np.float64)
    order = np.argsort(-confidence, kind="stable")
    confidence, truth = confidence[order], truth[order]
    right = probability.argmax(axis=1)[order] == truth
    is_value = truth[:, None] == np.unique(truth)
    answered = np.cumsum(is_value, axis=0)
    named = np.cumsum(is_value & right[:, None], axis=0)
    balanced = (named / np.maximum(answered, 1)).mean(axis=1)
    enough = (answered >= np.minimum(answered[-1], smallest)).all(axis=1)
    last_of_its_confidence = np.append(confidence[1:] < confidence[:-1], True)
    allowed = np.flatnonzero(enough & last_of_its_confidence)
    reached = allowed[balanced[allowed] >= target]
    if reached.size:
        at = int(reached[-1])
    else:
        at = int(allowed[balanced[allowed] == balanced[allowed].max()][-1])
    n = len(truth)
    value = 0.0 if at == n - 1 else float(confidence[at])
    return Threshold(value, bool(reached.size), float(balanced[at]), (at + 1) / n, n)
