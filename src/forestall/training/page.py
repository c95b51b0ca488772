"""The page on which a person sees what an encoder gets right: one file that needs nothing else.

Called by the command line; calls `measure.py` for figures, `page_pictures.py` for the strips of
crops, and the style sheet of the run's page. The template escapes every text. The same measurement
gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from itertools import groupby
from pathlib import Path

import numpy as np
import numpy.typing as npt
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from forestall.errors import InputError
from forestall.files import replace_file
from forestall.training.measure import (
    UNOBSERVED,
    Answers,
    Figures,
    Group,
    Measurement,
    Share,
    share,
)
from forestall.training.measure_tables import DEFINITION, percent
from forestall.training.page_pictures import Strip, strips

AIM_BALANCED, AIM_ANSWERED = 0.97, 0.90

Pixels = npt.NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Synonym:
    """Where a word that was not trained on landed.

    Args:
        word: what was asked.
        nearest: the category whose text is nearest.
        expected: the category that is meant.
        similarity: cosine to the nearest.
        right: whether that is right.
        group: kind of test, e.g. "spelling" or "meaning".
    """

    word: str
    nearest: str
    expected: str
    similarity: float
    right: bool
    group: str


@dataclass(frozen=True, slots=True)
class ZeroShot:
    """Figures for an attribute or a category that was not trained on; None: there is no figure.

    Args:
        what: a thing.
        attribute: of it.
        n: answers.
        balanced: balanced accuracy of what was answered.
        answered: share answered.
        forced: balanced accuracy if everything had been answered; a value that is never answered
            does not drop out of this one.
    """

    what: str
    attribute: str
    n: int
    balanced: float | None
    answered: float | None
    forced: float | None


@dataclass(frozen=True, slots=True)
class Aim:
    """A figure and what it should be."""

    name: str
    value: float | None
    least: float

    @property
    def met(self) -> bool:
        """Whether the figure is there and large enough."""
        return self.value is not None and self.value >= self.least


@dataclass(frozen=True, slots=True)
class ConfusionCell:
    """One cell of a confusion matrix; `kind` is "right", "wrong" or "unobserved"."""

    count: int
    of_row: float
    kind: str


@dataclass(frozen=True, slots=True)
class ReliabilityBar:
    """One bin of a reliability diagram, all from 0 to 1; `weight` is n against the fullest bin."""

    low: float
    high: float
    confidence: float
    accuracy: float
    weight: float
    title: str


@dataclass(frozen=True, slots=True)
class SizePoint:
    """Accuracy in one band of mask area; heights from 0 (foot of the drawing) to 1 (100 %)."""

    band: str
    n: str
    answered: str
    height: float | None
    low: float
    high: float
    title: str


@dataclass(frozen=True, slots=True)
class SizePlot:
    """Accuracy by mask area; `foot` is the accuracy at the foot of the drawing."""

    foot: float
    points: tuple[SizePoint, ...]


@dataclass(frozen=True, slots=True)
class AttributeCard:
    """What the page shows of one attribute."""

    group: Group
    rows: tuple[tuple[str, tuple[ConfusionCell, ...]], ...]
    bars: tuple[ReliabilityBar, ...]
    sizes: SizePlot


@dataclass(frozen=True, slots=True)
class View:
    """Everything that the template needs beside the measurement."""

    aims: tuple[Aim, ...]
    cards: tuple[AttributeCard, ...]
    heat: tuple[tuple[Group, tuple[Group | None, ...]], ...]
    sizes: SizePlot
    confusions: tuple[Strip, ...]
    unobserved: tuple[Strip, ...]
    synonyms: tuple[tuple[str, Share, tuple[Synonym, ...]], ...]
    zero_shot: tuple[ZeroShot, ...]
    facts: tuple[tuple[str, str], ...]


def write_page(
    measurement: Measurement,
    crops_pixels: Pixels,
    answers: Answers,
    out: Path,
    facts: Mapping[str, str],
    synonyms: Sequence[Synonym] = (),
    zero_shot: Sequence[ZeroShot] = (),
) -> Path:
    """Write the page.

    Args:
        measurement: of these answers.
        crops_pixels: (crops, edge, edge, 3 or 4) uint8, colour and mask; `answers.crop` counts
            its rows.
        answers: what was measured.
        out: the HTML file; its folder is made when it is not there.
        facts: where the figures come from, name → text, shown in this order.
        synonyms: where unseen words landed.
        zero_shot: attributes and categories that were not trained on.

    Returns:
        The path.

    Raises:
        InputError: the answers are not those measured, or are about crops that are not there.
    """
    text = page_html(measurement, crops_pixels, answers, facts, synonyms, zero_shot)
    out = Path(out)
    out.parent.mkdir(parents=True, exist_ok=True)
    replace_file(out, text.encode("utf-8"))
    return out


def page_html(
    measurement: Measurement,
    crops_pixels: Pixels,
    answers: Answers,
    facts: Mapping[str, str],
    synonyms: Sequence[Synonym] = (),
    zero_shot: Sequence[ZeroShot] = (),
) -> str:
    """The page as text; arguments as for `write_page`."""
    if len(answers.truth) != measurement.overall.figures.n:
        raise InputError("the page needs the answers that were measured")
    if answers.crop.min() < 0 or answers.crop.max() >= len(crops_pixels):
        raise InputError(f"answers about crops beyond the {len(crops_pixels)} that were given")
    confusions, unobserved = strips(measurement, crops_pixels, answers)
    overall = measurement.overall.figures
    view = View(
        aims=(
            Aim("Balanced accuracy", overall.balanced, AIM_BALANCED),
            Aim("Answered", overall.answered.value, AIM_ANSWERED),
        ),
        cards=tuple(_card(g) for g in measurement.attributes),
        heat=_heat(measurement),
        sizes=_sizes(measurement.overall),
        confusions=confusions,
        unobserved=unobserved,
        synonyms=_by_kind(synonyms),
        zero_shot=tuple(zero_shot),
        facts=tuple(facts.items()),
    )
    environment = Environment(
        loader=PackageLoader("forestall.training"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"percent": percent, "shade": _shade}
    style = files("forestall.report").joinpath("templates/page.css").read_text(encoding="utf-8")
    return environment.get_template("encoder.html.j2").render(
        measurement=measurement,
        view=view,
        definition=DEFINITION,
        unobserved=UNOBSERVED,
        style=Markup(style),
    )


def _shade(figures: Figures) -> str:
    """The class of a cell: a colour for balanced accuracy, another where little was answered."""
    if figures.balanced is None:
        return "v-none"
    good = figures.balanced >= AIM_BALANCED
    grade = "v-good" if good else "v-fair" if figures.balanced >= 0.9 else "v-poor"
    return grade if (figures.answered.value or 0.0) >= AIM_ANSWERED else f"{grade} v-shy"


def _heat(measurement: Measurement) -> tuple[tuple[Group, tuple[Group | None, ...]], ...]:
    """A row for each category: its group, its group with each attribute, and itself again."""
    pairs = {(g.category, g.attribute): g for g in measurement.pairs}
    names = [g.attribute for g in measurement.attributes]
    return tuple(
        (group, (*(pairs.get((group.category, name)) for name in names), group))
        for group in measurement.categories
    )


def _card(group: Group) -> AttributeCard:
    fullest = max((b.n for b in group.bins), default=1)
    bars = tuple(
        ReliabilityBar(
            *(b.low, b.high, b.confidence, b.accuracy, b.n / fullest),
            f"{b.n:,} with confidence {b.low:.2f} to {b.high:.2f}: "
            f"{percent(b.accuracy)} right, {percent(b.confidence)} claimed",
        )
        for b in group.bins
    )
    rows = []
    for i, counts in enumerate(group.confusion):
        kinds = ["right" if i == j else "wrong" for j in range(len(counts) - 1)]
        of = max(1, sum(counts))
        cells = zip(counts, [*kinds, UNOBSERVED], strict=True)
        rows.append((group.values[i], tuple(ConfusionCell(n, n / of, kind) for n, kind in cells)))
    return AttributeCard(group, tuple(rows), bars, _sizes(group))


def _sizes(group: Group) -> SizePlot:
    found = [f.accuracy for _, f in group.sizes]
    values = [a.value for a in found if a.value is not None]
    lows = [max(a.low, 0.5) for a in found if a.low is not None]
    foot = min(0.9, int(min([*values, *lows], default=0.9) * 10) / 10)

    def height(value: float | None) -> float | None:
        return None if value is None else max(0.0, (value - foot) / (1 - foot))

    points = tuple(
        SizePoint(
            band=band,
            n=f"{f.n:,}",
            answered=f"{100 * (f.answered.value or 0.0):.0f} %",
            height=height(f.accuracy.value),
            low=height(f.accuracy.low) or 0.0,
            high=height(f.accuracy.high) or 0.0,
            title=f"{band} px: {percent(f.accuracy.value)} of {f.accuracy.n:,} right, "
            f"{percent(f.answered.value)} of {f.n:,} answered",
        )
        for band, f in group.sizes
    )
    return SizePlot(foot, points)


def _by_kind(rows: Sequence[Synonym]) -> tuple[tuple[str, Share, tuple[Synonym, ...]], ...]:
    """By group: how many are right, and the rows with the wrong ones first."""
    found = []
    for group, part in groupby(sorted(rows, key=lambda r: r.group), key=lambda r: r.group):
        ordered = tuple(sorted(part, key=lambda r: (r.right, r.expected, r.word)))
        found.append((group, share(sum(r.right for r in ordered), len(ordered)), ordered))
    return tuple(found)
