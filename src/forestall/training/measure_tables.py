"""What was measured as JSON data, Markdown and CSV.

Called by the command line and `page.py`; calls `measure.py` for its types.
"""

from __future__ import annotations

import csv
import dataclasses
import io
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from forestall.files import replace_file
from forestall.training.measure import UNOBSERVED, Figures, Group, Measurement, Share

JSON_NAME, MARKDOWN_NAME = "measurement.json", "measurement.md"
FIGURES_NAME, CONFUSION_NAME = "figures.csv", "confusion.csv"

FIGURE_COLUMNS = (
    *("attribute", "category", "mask_px", "n", "answered", "answered_low", "answered_high"),
    *("accuracy", "accuracy_low", "accuracy_high", "balanced_accuracy"),
    *("calibration_error", "calibration_error_all", "silent"),
)
CONFUSION_COLUMNS = ("attribute", "category", "truth", "said", "n")

DEFINITION = (
    "Balanced accuracy: mean over the true values of the share named rightly, of what was "
    "answered; over several attributes the mean over the attributes. Intervals are exact 95 % ones."
)


@dataclass(frozen=True, slots=True)
class Condition:
    """All answers about some of the crops, or about crops through worse eyes."""

    name: str
    group: Group


_HEAD = ("n", "answered", "accuracy", "balanced accuracy", "ECE", "ECE, all answered", "silent")


def as_json(measurement: Measurement) -> dict[str, Any]:
    """Everything as dict, list, str, int, float, bool and None."""
    data: dict[str, Any] = json.loads(json.dumps(dataclasses.asdict(measurement)))
    return data


def markdown(measurement: Measurement, conditions: Sequence[Condition] = ()) -> str:
    """Everything as tables: overall, by condition, attribute, category, mask area, confusions."""
    overall = measurement.overall
    parts = [
        f"{measurement.crops:,} crops, {overall.figures.n:,} answers. {DEFINITION}",
        _markdown_table(("", *_HEAD), [("overall", *_cells(overall.figures))]),
    ]
    attributes = [(g.attribute or "", *_cells(g.figures)) for g in measurement.attributes]
    categories = [(g.category or "", *_cells(g.figures)) for g in measurement.categories]
    pairs = [(g.attribute or "", g.category or "", *_cells(g.figures)) for g in measurement.pairs]
    sizes = [
        (g.attribute or "all", band, *_cells(f))
        for g in (overall, *measurement.attributes)
        for band, f in g.sizes
    ]
    harder = [(c.name, *_cells(c.group.figures)) for c in conditions]
    for title, first, rows in (
        *((("By condition", ("condition",), harder),) if harder else ()),
        ("By attribute", ("attribute",), attributes),
        ("By category", ("category",), categories),
        ("By attribute and category", ("attribute", "category"), pairs),
        ("By mask area in pixels", ("attribute", "mask"), sizes),
    ):
        parts += [f"## {title}", _markdown_table((*first, *_HEAD), rows)]
    parts.append("## Confusions")
    for group in measurement.attributes:
        counts = [(v, *map(str, row)) for v, row in zip(group.values, group.confusion, strict=True)]
        head = (f"{group.attribute}: true ↓, said →", *group.values, UNOBSERVED)
        parts.append(_markdown_table(head, counts))
    return "\n\n".join(parts) + "\n"


def figures_csv(measurement: Measurement) -> str:
    """One line for each group and band of mask area; an empty field is "all" or "none"."""
    return _csv(FIGURE_COLUMNS, _figure_rows(measurement))


def confusion_csv(measurement: Measurement) -> str:
    """One line for each truth and answer of each attribute, of all categories and of each one."""
    rows = (
        (group.attribute, group.category, truth, said, n)
        for group in (*measurement.attributes, *measurement.pairs)
        for truth, counts in zip(group.values, group.confusion, strict=True)
        for said, n in zip((*group.values, UNOBSERVED), counts, strict=True)
    )
    return _csv(CONFUSION_COLUMNS, rows)


def write_tables(
    measurement: Measurement, conditions: Sequence[Condition], folder: Path
) -> tuple[Path, ...]:
    """Write measurement.json, measurement.md, figures.csv and confusion.csv; their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    texts = {
        JSON_NAME: json.dumps(as_json(measurement), indent=1) + "\n",
        MARKDOWN_NAME: markdown(measurement, conditions),
        FIGURES_NAME: figures_csv(measurement),
        CONFUSION_NAME: confusion_csv(measurement),
    }
    for name, text in texts.items():
        replace_file(folder / name, text.encode("utf-8"))
    return tuple(folder / name for name in texts)


def _figure_rows(measurement: Measurement) -> Iterator[Sequence[object]]:
    for group in measurement.groups():
        yield _figure_row(group, None, group.figures)
        for band, figures in group.sizes:
            yield _figure_row(group, band, figures)


def _figure_row(group: Group, band: str | None, f: Figures) -> Sequence[object]:
    answered, accuracy = f.answered, f.accuracy
    return (
        *(group.attribute, group.category, band, f.n),
        *(answered.value, answered.low, answered.high),
        *(accuracy.value, accuracy.low, accuracy.high, f.balanced),
        *(f.calibration_error, f.calibration_error_all, " ".join(f.silent)),
    )


def _csv(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    for row in rows:
        writer.writerow([round(v, 6) if isinstance(v, float) else v for v in row])
    return text.getvalue()


def _cells(f: Figures) -> tuple[str, ...]:
    return (
        f"{f.n:,}",
        _share(f.answered),
        _share(f.accuracy),
        percent(f.balanced),
        _number(f.calibration_error),
        _number(f.calibration_error_all),
        ", ".join(f.silent),
    )


def _share(s: Share) -> str:
    if s.value is None or s.low is None or s.high is None:
        return "none"
    return f"{percent(s.value)} ({100 * s.low:.1f} to {100 * s.high:.1f})"


def percent(value: float | None) -> str:
    """0.971 → "97.1 %"; "none" where there is no figure."""
    return "none" if value is None else f"{100 * value:.1f} %"


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.3f}"


def _markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(c.replace("|", "\\|") for c in r) + " |" for r in lines)
