"""A study for crowd platforms, and answers for whoever counts them elsewhere: CSV and JSON.

Called by the command line and the report. What raters are shown (`trials`) says nowhere whose an
explanation is; that is in the key beside it, which stays with whoever runs the study.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from forestall.files import make_folder, replace_file
from forestall.study.answers import Rater
from forestall.study.model import Study

Row = dict[str, Any]


def trial_rows(study: Study) -> list[Row]:
    """One row for each comparison of each rater, blinded."""
    rows = []
    for number, trials in enumerate(study.raters, 1):
        for position, trial in enumerate(trials, 1):
            item = study.item(trial.item)
            left, right = study.texts(trial)
            rows.append(
                {
                    "rater": number,
                    "position": position,
                    "task": item.task,
                    "step": item.step,
                    "expected_picture": item.expected,
                    "actual_picture": item.actual,
                    "true_cause": item.cause,
                    "explanation_a": left,
                    "explanation_b": right,
                }
            )
    return rows


def key_rows(study: Study) -> list[Row]:
    """Whose the explanations are, by rater and position."""
    return [
        {
            "rater": number,
            "position": position,
            "item": trial.item,
            "against": trial.against,
            "ours": trial.ours,
            "check": trial.check,
        }
        for number, trials in enumerate(study.raters, 1)
        for position, trial in enumerate(trials, 1)
    ]


def answer_rows(study: Study, raters: Sequence[Rater]) -> list[Row]:
    """One row for each answer that stands; names of raters are left out."""
    rows = []
    for rater in raters:
        number = rater.start.rater
        for place, answer in sorted(rater.answers.items()):
            trial = study.raters[number - 1][place]
            better = "both" if answer.choice == "both" else (
                "ours" if answer.choice == trial.ours else "other"
            )  # fmt: skip
            rows.append(
                {
                    "rater": number,
                    "simulated": rater.start.simulated,
                    "position": place + 1,
                    "item": trial.item,
                    "against": trial.against,
                    "check": trial.check,
                    "choice": answer.choice,
                    "better": better,
                    "seconds": answer.seconds,
                    "at": answer.at,
                }
            )
    return rows


def export(study: Study, folder: Path) -> list[Path]:
    """Write what is shown and the key to it, each as CSV and as JSON.

    Pictures are named relative to the study's folder.

    Returns:
        The files.
    """
    make_folder(folder)
    written = []
    for name, rows in (("trials", trial_rows(study)), ("key", key_rows(study))):
        written += write_rows(folder / name, rows)
    return written


def write_rows(stem: Path, rows: Sequence[Row]) -> list[Path]:
    """Rows as `stem`.csv and `stem`.json."""
    table, plain = stem.with_suffix(".csv"), stem.with_suffix(".json")
    replace_file(table, _csv(rows).encode("utf-8"))
    replace_file(plain, f"{json.dumps(rows, indent=1, ensure_ascii=False)}\n".encode())
    return [table, plain]


def _csv(rows: Sequence[Row]) -> str:
    text = io.StringIO()
    if rows:
        writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows({name: _cell(value) for name, value in row.items()} for row in rows)
    return text.getvalue()


def _cell(value: Any) -> Any:
    """A text that a spreadsheet would take for a formula gets an apostrophe before it."""
    return f"'{value}" if isinstance(value, str) and value[:1] in tuple("=+-@\t\r") else value
