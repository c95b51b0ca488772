"""The report of a study: files and a page of what people answered, and what simulated raters did.

Called by the command line; calls `measuring.py`, `exporting.py` and the template. People and
simulated raters are counted apart and never together.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from forestall.files import make_folder, replace_file
from forestall.study.answers import Rater, read_raters
from forestall.study.exporting import answer_rows, write_rows
from forestall.study.measuring import power_of, summary
from forestall.study.model import Study, read_study
from forestall.study.pages import environment

PAPER = {
    "raters": 15,
    "against": ["objects", "caption", "image"],
    "choices": "the better of two explanations, or both",
    "said": "our method significantly outperforms all baselines in explanation quality",
    "source": "Section 4, Analysis of Anticipatory Failure Reasoning; the shares are drawn in Fig. "
    "(b) of failure detection, and no number of them is in the text",
}
"""What the paper says of its human study."""

_SHOWN = ("wins", "both", "losses", "preference")


@dataclass(frozen=True, slots=True)
class Report:
    """What was written, and the numbers in it."""

    data: dict[str, Any]
    files: tuple[Path, ...]


def report_of(study: Study, raters: Sequence[Rater]) -> dict[str, Any]:
    """All numbers of a study and its raters, as plain data."""
    people = [r for r in raters if not r.start.simulated]
    simulated = [r for r in raters if r.start.simulated]
    return {
        "kind": "report of a human study",
        "study": study.digest,
        "version": study.version,
        "ours": study.ours,
        "against": list(study.against),
        "items": len(study.items),
        "places": len(study.raters),
        "writers": sorted({e.writer for i in study.items for e in i.explanations}),
        "left_out": study.left_out,
        "people": summary(study, people) if people else None,
        "simulated": summary(study, simulated) if simulated else None,
        "power": power_of(study),
        "paper": PAPER,
    }


def write_report(folder: Path, out: Path | None = None) -> Report:
    """Count the answers of a study; write report.json, report.html, answers.csv and answers.json.

    Args:
        folder: of the study.
        out: where to; the study's folder by default.

    Raises:
        InputError: there is no study.
        FileFormatError: study or answers are damaged.
    """
    study = read_study(folder)
    raters = read_raters(folder, study)
    data = report_of(study, raters)
    out = out or folder
    make_folder(out)
    plain, page = out / "report.json", out / "report.html"
    replace_file(plain, f"{json.dumps(data, indent=1, ensure_ascii=False)}\n".encode())
    replace_file(page, report_page(data).encode("utf-8"))
    rows = answer_rows(study, raters)
    return Report(data, (page, plain, *write_rows(out / "answers", rows)))


def report_page(data: dict[str, Any]) -> str:
    """The numbers as one HTML file that needs nothing but itself."""
    from markupsafe import Markup

    from forestall.study.pages import asset

    engine = environment()
    engine.filters |= {"share": share, "number": number}
    return engine.get_template("report.html.jinja").render(
        data=data, style=Markup(asset("report.css").decode("utf-8")), shown=_SHOWN
    )


def share(metric: dict[str, Any], interval: bool = True) -> str:
    """A share in percent with its interval."""
    if metric["value"] is None:
        return "–"
    text = f"{100 * metric['value']:.0f} %"
    if interval and metric["low"] is not None:
        text += f" [{100 * metric['low']:.0f}, {100 * metric['high']:.0f}]"
    return text


def number(found: dict[str, Any], how: str = ".2f") -> str:
    """A number that is no share, with its interval.

    Args:
        found: value, low and high.
        how: they are written, as `format` has it.
    """
    text = f"{found['value']:{how}}"
    if found["low"] is not None and found["high"] is not None:
        text += f" [{found['low']:{how}}, {found['high']:{how}}]"
    return text


def table_of(data: dict[str, Any]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """The main table as text, of people or of simulated raters.

    Args:
        data: a summary.
    """
    header = ("against", "wins", "both", "losses", "preference", "odds", "answers")
    rows = []
    for name, row in data.get("against", {}).items():
        odds = row["odds"]
        told = "–" if odds is None or odds["value"] is None else number(odds)
        cells = [share(row[what]) for what in _SHOWN]
        rows.append((name, *cells, told, str(row["wins"]["n"])))
    return header, rows
