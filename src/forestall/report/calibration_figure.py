"""The figure of a calibration: the smallest score of each good run, and where the line is drawn.

Called by `forestall calibrate`; calls `figure_style.py`. Parts of a run differ in marker, not only
in colour.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from forestall.report.figure_style import (
    MARKERS,
    NOTHING,
    WIDE,
    colour,
    key,
    new_figure,
    series_colour,
    styled,
    svg_bytes,
    wrapped,
)

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

_GOLDEN = 0.618034
"""Spreads dots over the height of their row, the same in every drawing."""


@dataclass(frozen=True, slots=True)
class Row:
    """One part of the runs of one task.

    Args:
        part: in words.
        scores: the smallest of each run in which there was one.
        threshold: None: there is none.
    """

    part: str
    scores: tuple[float, ...]
    threshold: float | None


@dataclass(frozen=True, slots=True)
class Panel:
    """One judge.

    Args:
        judge: its name.
        tasks: (name, its rows), from top to bottom.
        counted: whether it says yes or no.
    """

    judge: str
    tasks: tuple[tuple[str, tuple[Row, ...]], ...]
    counted: bool = False


def calibration_figure(panels: Sequence[Panel], level: float) -> bytes:
    """An SVG file with a column for each judge and a line for each task and part of its runs."""
    parts = list(dict.fromkeys(r.part for p in panels for _, rows in p.tasks for r in rows))
    most = max((sum(len(rows) for _, rows in p.tasks) for p in panels), default=1)
    with styled():
        figure = new_figure(WIDE, 120 + 34 * most)
        grid = figure.subplots(1, max(1, len(panels)), squeeze=False)[0]
        for place, (axes, panel) in enumerate(zip(grid, panels, strict=False)):
            _panel(axes, panel, parts, place == 0)
        figure.supxlabel(
            f"smallest score of each good run; left of a line is an alarm, in at most {level:g} of "
            "such runs",
            fontsize=11,
            color=colour("soft"),
        )
        key(figure, _key(parts))
        return svg_bytes(figure)


def _panel(axes: Axes, panel: Panel, parts: Sequence[str], named: bool) -> None:
    rows = [(task if i == 0 else "", row) for task, own in panel.tasks for i, row in enumerate(own)]
    axes.set_title(panel.judge)
    for place, (_, row) in enumerate(rows):
        y, index = len(rows) - 1 - place, parts.index(row.part)
        axes.plot(
            row.scores,
            [y + 0.56 * ((i * _GOLDEN) % 1 - 0.5) for i in range(len(row.scores))],
            color=series_colour(index),
            marker=MARKERS[index % len(MARKERS)],
            markersize=4.5,
            linestyle=NOTHING,
            alpha=0.7,
            clip_on=False,
        )
        if row.threshold is None:
            axes.annotate(
                "uncalibrated",
                (0.0, y),
                xycoords=("axes fraction", "data"),
                xytext=(3, 0),
                textcoords="offset points",
                va="center",
                fontsize=10,
                color=colour("bad"),
            )
        else:
            axes.plot(
                *([row.threshold] * 2, [y - 0.42, y + 0.42]), color=colour("bad"), linewidth=2.2
            )
    names = [task for task, _ in reversed(rows)] if named else [""] * len(rows)
    axes.set_yticks(range(len(rows)), [wrapped(n) for n in names])
    axes.tick_params(axis="y", labelcolor=colour("ink"))
    axes.set_ylim(-0.6, len(rows) - 0.4)
    axes.grid(False, axis="y")
    if panel.counted:
        axes.set_xlim(-0.15, 1.15)
        axes.set_xticks([0.0, 1.0], ["alarm", "no alarm"])


def _key(parts: Sequence[str]) -> list[Artist]:
    from matplotlib.lines import Line2D

    dots = [
        Line2D(
            [],
            [],
            color=series_colour(i),
            marker=MARKERS[i % len(MARKERS)],
            markersize=6,
            linestyle=NOTHING,
            label=part,
        )
        for i, part in enumerate(parts)
    ]
    return [*dots, Line2D([], [], color=colour("bad"), linewidth=2.2, label="threshold")]
