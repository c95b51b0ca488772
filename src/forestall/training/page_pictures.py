"""Strips of crops for the encoder's page: what was confused, and what was not answered.

Called by `page.py`; calls nothing but Pillow. Each strip is one contact sheet, of which the page
shows a window for each crop.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageFilter

from forestall.training.measure import UNOBSERVED, Answers, Measurement

EDGE = 96
MOST_CROPS, MOST_CONFUSIONS = 12, 16

_BYTES = 2_000_000
_QUALITIES = (86, 76, 64, 50, 35, 20)
_OUTLINE = (255, 64, 200)

Pixels = npt.NDArray[np.uint8]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Caption:
    """What is written under one crop."""

    category: str
    truth: str
    said: str
    confidence: str
    area: str


@dataclass(frozen=True, slots=True)
class Strip:
    """Crops side by side in one picture, `EDGE` pixels each.

    Args:
        attribute: what was asked.
        truth: the true value, None where the crops differ in it.
        said: the value said.
        count: how many there are of this kind.
        of: out of how many.
        uri: the contact sheet as data URI.
        captions: one for each crop, from left to right.
    """

    attribute: str
    truth: str | None
    said: str
    count: int
    of: int
    uri: str
    captions: tuple[Caption, ...]


@dataclass(frozen=True, slots=True)
class _Chosen:
    attribute: str
    truth: str | None
    said: str
    count: int
    of: int
    rows: Ints
    captions: tuple[Caption, ...]


def strips(
    measurement: Measurement, pixels: Pixels, answers: Answers
) -> tuple[tuple[Strip, ...], tuple[Strip, ...]]:
    """The confusions with the most errors, and for each attribute what was not answered.

    The worst confusion of every attribute is among them. Confused crops are those with the greatest
    confidence; unanswered ones are spread evenly over the mask areas.
    """
    confused, silent = _confused(measurement, answers), _silent(measurement, answers)
    chosen = [*confused, *silent]
    sheets = [contact_sheet(pixels[answers.crop[c.rows]]) for c in chosen]
    uris = _encoded(sheets)
    made = tuple(
        Strip(c.attribute, c.truth, c.said, c.count, c.of, uri, c.captions)
        for c, uri in zip(chosen, uris, strict=True)
    )
    return made[: len(confused)], made[len(confused) :]


def contact_sheet(pixels: Pixels) -> Image.Image:
    """(n, edge, edge, 3 or 4) side by side, enlarged to `EDGE`; the mask is outlined."""
    sheet = Image.new("RGB", (EDGE * len(pixels), EDGE))
    for i, crop in enumerate(pixels):
        tile = Image.fromarray(np.ascontiguousarray(crop[..., :3]))
        tile = tile.resize((EDGE, EDGE), Image.Resampling.BICUBIC)
        if crop.shape[-1] == 4:
            mask = Image.fromarray(np.ascontiguousarray(crop[..., 3]))
            mask = mask.resize((EDGE, EDGE), Image.Resampling.BILINEAR)
            inside = np.asarray(mask) > 127
            around = np.asarray(
                Image.fromarray(inside).convert("L").filter(ImageFilter.MaxFilter(3))
            )
            drawn = np.array(tile)
            drawn[(around > 0) & ~inside] = _OUTLINE
            tile = Image.fromarray(drawn)
        sheet.paste(tile, (EDGE * i, 0))
    return sheet


def _confused(measurement: Measurement, answers: Answers) -> list[_Chosen]:
    counts = [
        (-n, group.attribute or "", truth, said)
        for group in measurement.attributes
        for truth, row in enumerate(group.confusion)
        for said, n in enumerate(row[:-1])
        if n and said != truth
    ]
    counts.sort()
    worst = {c[1]: c for c in reversed(counts)}.values()
    others = [c for c in counts if c not in worst]
    wanted = sorted([*worst, *others[: max(0, MOST_CONFUSIONS - len(worst))]])
    groups = {g.attribute: g for g in measurement.attributes}
    said_of, confidence = answers.said(), answers.confidence()
    found = []
    for less, attribute, truth, said in wanted:
        group = groups[attribute]
        names = group.values
        rows = np.flatnonzero(
            answers.answered
            & (answers.attribute == attribute)
            & (answers.truth == truth)
            & (said_of == said)
        )
        rows = rows[np.argsort(-confidence[rows], kind="stable")][:MOST_CROPS]
        captions, of = _captions(answers, rows, names), sum(group.confusion[truth])
        found.append(_Chosen(attribute, names[truth], names[said], -less, of, rows, captions))
    return found


def _silent(measurement: Measurement, answers: Answers) -> list[_Chosen]:
    found = []
    for group in measurement.attributes:
        rows = np.flatnonzero(~answers.answered & (answers.attribute == group.attribute))
        if not rows.size:
            continue
        count = len(rows)
        rows = rows[np.argsort(answers.area[rows], kind="stable")]
        rows = rows[np.unique(np.linspace(0, count - 1, MOST_CROPS).round().astype(np.int64))]
        captions = _captions(answers, rows, group.values)
        attribute, n = group.attribute or "", group.figures.n
        found.append(_Chosen(attribute, None, UNOBSERVED, count, n, rows, captions))
    return found


def _captions(answers: Answers, rows: Ints, names: Sequence[str]) -> tuple[Caption, ...]:
    said, confidence = answers.said()[rows], answers.confidence()[rows]
    return tuple(
        Caption(
            category=str(answers.category[row]),
            truth=names[int(answers.truth[row])],
            said=names[int(said[i])],
            confidence=f"{confidence[i]:.2f}",
            area=f"{int(answers.area[row]):,} px",
        )
        for i, row in enumerate(rows)
    )


def _encoded(sheets: Sequence[Image.Image]) -> list[str]:
    """Data URIs in the best quality in which all of them together are small enough."""
    uris: list[str] = []
    for quality in _QUALITIES:
        uris = [_uri(sheet, quality) for sheet in sheets]
        if sum(map(len, uris)) <= _BYTES:
            break
    return uris


def _uri(sheet: Image.Image, quality: int) -> str:
    buffer = io.BytesIO()
    sheet.save(buffer, "JPEG", quality=quality, optimize=True)
    return "data:image/jpeg;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")
