"""Measures answers about object states against what is true.

Called by the command line, `page.py` and whoever trains an encoder; knows no encoder, only arrays.
`fitting.py` has what is fitted on development answers.

Balanced accuracy of one attribute is the mean, over the true values among the answered, of the
share of them that is named rightly. Over several attributes (overall, and for a category) it is the
mean over the attributes: a frequent attribute counts as much as a seldom one. A value that is never
answered has no recall and drops out of the mean; `Figures.silent` names it. Intervals are exact
ones for independent rows; crops of one frame are not quite independent.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from forestall.errors import InputError, UnknownNameError
from forestall.training.questions import ATTRIBUTES

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]
Values = Mapping[str, Sequence[str]]

BINS = 15
BAND_EDGES = (20, 60, 120, 500, 2000)
BANDS = ("<20", "20-60", "60-120", "120-500", "500-2000", ">2000")
"""Mask areas in pixels; a band starts at its first number and ends before its second."""

UNOBSERVED = "unobserved"


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """n answers, one for each crop and attribute that it has.

    Args:
        category: (n) str.
        attribute: (n) str.
        truth: (n) int, index of the true value among the attribute's values.
        probability: (n, most values) float32 over the attribute's values, then zeros.
        answered: (n) bool, False where the answer was "unobserved".
        area: (n) int, mask pixels in the frame.
        crop: (n) int, which crop it is about.

    Raises:
        InputError: lengths differ, or a probability is not one.
    """

    category: npt.NDArray[np.str_]
    attribute: npt.NDArray[np.str_]
    truth: npt.NDArray[np.integer]
    probability: npt.NDArray[np.floating]
    answered: npt.NDArray[np.bool_]
    area: npt.NDArray[np.integer]
    crop: npt.NDArray[np.integer]

    def __post_init__(self) -> None:
        lengths = {f.name: len(getattr(self, f.name)) for f in dataclasses.fields(self)}
        if len(set(lengths.values())) > 1:
            told = ", ".join(f"{name} {n}" for name, n in lengths.items())
            raise InputError(f"answers need arrays of one length, got {told}")
        if self.probability.ndim != 2 or self.answered.dtype != np.bool_:
            raise InputError("answers need probability (n, most values) and answered bool")
        inside = (self.probability >= 0) & (self.probability <= 1 + 1e-4)
        if not (inside.all() and np.allclose(self.probability.sum(axis=1), 1, atol=1e-3)):
            raise InputError("answers need probabilities that sum to 1 in every row")

    def said(self) -> Ints:
        """(n) index of the most probable value."""
        return np.asarray(self.probability.argmax(axis=1), dtype=np.int64)

    def confidence(self) -> Floats:
        """(n) probability of the most probable value."""
        return np.asarray(self.probability.max(axis=1), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Share:
    """`count` of `n`, with its exact 95 % interval (Clopper-Pearson); None where n is 0."""

    count: int
    n: int
    value: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True, slots=True)
class Figures:
    """What is counted for one set of answers.

    Args:
        n: answers, "unobserved" included.
        answered: share of them that was answered.
        accuracy: share of the answered that is right.
        balanced: balanced accuracy of the answered; None where nothing was answered.
        calibration_error: expected calibration error (15 bins of equal width) of the answered.
        calibration_error_all: the same as if everything had been answered.
        silent: "attribute=value" of the true values that occur and were never answered.
    """

    n: int
    answered: Share
    accuracy: Share
    balanced: float | None
    calibration_error: float | None
    calibration_error_all: float | None
    silent: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Bin:
    """Answers with a confidence in (low, high]: how many, how sure on average, how often right."""

    low: float
    high: float
    n: int
    confidence: float
    accuracy: float


@dataclass(frozen=True, slots=True)
class Group:
    """Figures of one attribute, one category, one of each, or (both None) of everything.

    Args:
        sizes: figures for each band of mask area that occurs.
        bins: reliability of what was answered, bins that are not empty.
        values: of the attribute; empty without one.
        confusion: counts, a row for each true value, a column for each value said and a last one
            for "unobserved"; empty without an attribute.
    """

    attribute: str | None
    category: str | None
    figures: Figures
    sizes: tuple[tuple[str, Figures], ...]
    bins: tuple[Bin, ...]
    values: tuple[str, ...] = ()
    confusion: tuple[tuple[int, ...], ...] = ()


@dataclass(frozen=True, slots=True)
class Measurement:
    """Figures of every group, groups in alphabetical order."""

    crops: int
    overall: Group
    attributes: tuple[Group, ...]
    categories: tuple[Group, ...]
    pairs: tuple[Group, ...]

    def groups(self) -> Iterator[Group]:
        """Every group, the overall one first."""
        yield self.overall
        for family in (self.attributes, self.categories, self.pairs):
            yield from family


def measure(answers: Answers, values: Values = ATTRIBUTES) -> Measurement:
    """Every figure of these answers.

    Args:
        answers: from held-out pictures.
        values: attribute → its values, in the order of truth and probability.

    Raises:
        InputError: no answers, or a truth or a probability beyond the attribute's values.
        UnknownNameError: an attribute without values.
    """
    if not len(answers.truth):
        raise InputError("there is nothing to measure: no answers")
    rows = _Rows(answers, values)
    everything = np.arange(len(answers.truth))
    of_attribute, of_category = _places(answers.attribute), _places(answers.category)
    return Measurement(
        crops=len(np.unique(answers.crop)),
        overall=rows.group(everything, None, None),
        attributes=tuple(rows.group(found, a, None) for a, found in of_attribute.items()),
        categories=tuple(rows.group(found, None, c) for c, found in of_category.items()),
        pairs=tuple(
            rows.group(found[within], a, c)
            for a, found in of_attribute.items()
            for c, within in _places(answers.category[found]).items()
        ),
    )


def _places(names: npt.NDArray[np.str_]) -> dict[str, Ints]:
    """Name → where it stands, in alphabetical order."""
    found, place = np.unique(names, return_inverse=True)
    return {str(name): np.flatnonzero(place == i) for i, name in enumerate(found)}


class _Rows:
    """Answers with everything worked out that is needed of each single one."""

    def __init__(self, answers: Answers, values: Values) -> None:
        self._values = {str(a): values_of(str(a), values) for a in np.unique(answers.attribute)}
        self._attributes = sorted(self._values)
        self._width = max(len(v) for v in self._values.values())
        known = np.array([len(self._values[a]) for a in self._attributes])
        self._attribute = np.searchsorted(np.array(self._attributes), answers.attribute)
        count = known[self._attribute]
        beyond = np.arange(answers.probability.shape[1]) >= count[:, None]
        if np.any((answers.truth < 0) | (answers.truth >= count)):
            raise InputError("a true value lies beyond the values of its attribute")
        if np.any(answers.probability[beyond] > 1e-6):
            raise InputError("a probability lies beyond the values of its attribute")
        self._truth = answers.truth.astype(np.int64)
        self._said = answers.said()
        self._right = self._said == self._truth
        self._answered = answers.answered
        self._confidence = answers.confidence()
        self._bin = np.clip(np.ceil(self._confidence * BINS).astype(np.int64) - 1, 0, BINS - 1)
        self._band = np.searchsorted(BAND_EDGES, answers.area, side="right")

    def group(self, rows: Ints, attribute: str | None, category: str | None) -> Group:
        band = self._band[rows]
        sizes = tuple((BANDS[i], self._figures(rows[band == i])) for i in np.unique(band))
        bins = self._bins(rows[self._answered[rows]])
        group = Group(attribute, category, self._figures(rows), sizes, bins)
        if attribute is None:
            return group
        values = self._values[attribute]
        wide = len(values) + 1
        column = np.where(self._answered[rows], self._said[rows], len(values))
        counts = np.bincount(self._truth[rows] * wide + column, minlength=len(values) * wide)
        confusion = tuple(tuple(int(c) for c in row) for row in counts.reshape(-1, wide))
        return dataclasses.replace(group, values=values, confusion=confusion)

    def _figures(self, rows: Ints) -> Figures:
        given = rows[self._answered[rows]]
        right = given[self._right[given]]
        occur, answered, named = (self._by_value(r) for r in (rows, given, right))
        silent = tuple(
            f"{self._attributes[a]}={self._values[self._attributes[a]][v]}"
            for a, v in np.argwhere((occur > 0) & (answered == 0))
        )
        return Figures(
            n=len(rows),
            answered=share(len(given), len(rows)),
            accuracy=share(len(right), len(given)),
            balanced=_balanced(answered, named),
            calibration_error=_calibration_error(self._bins(given)),
            calibration_error_all=_calibration_error(self._bins(rows)),
            silent=silent,
        )

    def _by_value(self, rows: Ints) -> Ints:
        """(attributes, most values) how many of these rows have it as true value."""
        place = self._attribute[rows] * self._width + self._truth[rows]
        counts = np.bincount(place, minlength=len(self._attributes) * self._width)
        return counts.reshape(-1, self._width)

    def _bins(self, rows: Ints) -> tuple[Bin, ...]:
        place = self._bin[rows]
        n = np.bincount(place, minlength=BINS)
        sure = np.bincount(place, self._confidence[rows], minlength=BINS)
        right = np.bincount(place, self._right[rows], minlength=BINS)
        return tuple(
            Bin(b / BINS, (b + 1) / BINS, int(n[b]), float(sure[b] / n[b]), float(right[b] / n[b]))
            for b in np.flatnonzero(n).tolist()
        )


def share(count: int, n: int) -> Share:
    """`count` of `n` with its exact 95 % interval (Clopper-Pearson)."""
    from scipy.special import betaincinv

    if n == 0:
        return Share(0, 0, None, None, None)
    low = float(betaincinv(count, n - count + 1, 0.025)) if count else 0.0
    high = float(betaincinv(count + 1, n - count, 0.975)) if count < n else 1.0
    return Share(count, n, count / n, low, high)


def values_of(attribute: str, values: Values) -> tuple[str, ...]:
    """The values of an attribute, in the order of truth and probability."""
    if attribute not in values:
        raise UnknownNameError("attribute", attribute, values)
    return tuple(values[attribute])


def _balanced(answered: Ints, named: Ints) -> float | None:
    """The mean over attributes of the mean over values of recall, from (attributes, values)."""
    occur = answered > 0
    some = occur.any(axis=1)
    if not some.any():
        return None
    recall = named / np.maximum(answered, 1)
    return float((recall.sum(axis=1)[some] / occur.sum(axis=1)[some]).mean())


def _calibration_error(bins: Sequence[Bin]) -> float | None:
    """Expected calibration error (Guo et al. 2017, eq. 3)."""
    n = sum(b.n for b in bins)
    return sum(b.n * abs(b.accuracy - b.confidence) for b in bins) / n if n else None
