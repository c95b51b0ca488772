"""How a table's cells are written, and a table as Markdown and CSV.

Called by `tables` and `orderings`; knows metrics as plain data, as a summary holds them.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from forestall.statistics.judges import THRESHOLDS

DASH = "–"

Metric = Mapping[str, Any]
Names = Mapping[str, str]
"""What is shown in place of a detector's name, so that a stand-in is called one."""

Form = Callable[[Metric], str]

EMPTY: Metric = {"value": None, "low": None, "high": None, "n": 0}


@dataclass(frozen=True, slots=True)
class Table:
    """A table with what has to be said about it.

    Args:
        name: of its files.
        title: one line.
        header: of the columns.
        rows: as many cells each.
        note: below it.
        timed: whether it holds measured computing time, which differs from run to run.
    """

    name: str
    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""
    timed: bool = False

    def of(self, profile: str) -> Table:
        """The same of a household that is not the one shown first."""
        return replace(self, name=f"{self.name}-{profile}", title=f"{self.title}: {profile}")

    def markdown(self) -> str:
        """With its title as a heading and its note below."""
        lines = [f"### {self.title}", "", _line(self.header), _line(["---"] * len(self.header))]
        lines += [_line(row) for row in self.rows] or [_line([DASH] * len(self.header))]
        return "\n".join([*lines, *(["", self.note] if self.note else []), ""])

    def csv(self) -> str:
        """Header and rows; title and note are left to the other form."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.header)
        writer.writerows(self.rows)
        return text.getvalue()


def share(metric: Metric) -> str:
    """71.0 % [61.1, 79.6] (71/100)."""
    if metric["value"] is None:
        return DASH
    count = metric.get("count")
    whole = f"n = {metric['n']}" if count is None else f"{count}/{metric['n']}"
    return f"{100 * metric['value']:.1f} %{_interval(metric, 100, '.1f')} ({whole})"


def points(metric: Metric) -> str:
    """A difference of shares: +22.0 points [+2.0, +42.0] (n = 50)."""
    if metric["value"] is None:
        return DASH
    between = _interval(metric, 100, "+.1f")
    return f"{100 * metric['value']:+.1f} points{between} (n = {metric['n']})"


def probability(p: float | None) -> str:
    """Of a test, to three places."""
    if p is None:
        return DASH
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def number(form: str, unit: str = "") -> Form:
    """109.2 s [100.0, 118.0] (n = 50), with as many digits as `form` says."""

    def written(metric: Metric) -> str:
        if metric["value"] is None:
            return DASH
        return f"{metric['value']:{form}}{unit}{_interval(metric, 1, form)} (n = {metric['n']})"

    return written


seconds = number(".1f", " s")
area = number(".3f")
mean = number(".2f")

Columns = Sequence[tuple[str, str, Form]]
"""Heading, metric and how it is written."""


def cells(metrics: Mapping[str, Any], columns: Columns, suffix: str = "") -> list[str]:
    """A cell for each column, whether its metric's name ends in a threshold or not."""
    ends = [f"@{suffix}" if suffix else "", f"@{THRESHOLDS[0]:.2f}", ""]
    found = []
    for _, name, form in columns:
        known = [metrics[name + end] for end in ends if name + end in metrics]
        found.append(form(known[0] if known else EMPTY))
    return found


def heads(columns: Columns) -> list[str]:
    """The headings of columns."""
    return [head for head, _, _ in columns]


def shown(name: str, names: Names) -> str:
    """A name with every detector in it shown as what it is."""
    if name in names:
        return names[name]
    for mark in (", detector ", ", threshold ", ", without ", " + ", "@", " or ", " and ", ", "):
        first, found, rest = name.partition(mark)
        if found:
            between = " at " if mark == "@" else mark
            return f"{shown(first, names)}{between}{shown(rest, names)}"
    return name


def _interval(metric: Metric, scale: float, form: str) -> str:
    if metric["low"] is None or metric["high"] is None:
        return ""
    return f" [{scale * metric['low']:{form}}, {scale * metric['high']:{form}}]"


def _line(cells: Iterable[str]) -> str:
    return "| " + " | ".join(c.replace("|", "\\|").replace("\n", " ") for c in cells) + " |"
