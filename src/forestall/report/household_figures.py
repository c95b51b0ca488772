"""Figures of both households: curves with their bands, risk, and what demonstrations are worth.

Called by the experiment's page; calls `figure_style.py`. Each function takes what is to be seen and
returns an SVG file. Colour never tells alone: lines differ in dash and marker, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from forestall.report.figure_style import (
    DASHES,
    MARKERS,
    NOTHING,
    WIDE,
    colour,
    new_figure,
    percent_axis,
    series_colour,
    styled,
    svg_bytes,
)
from forestall.report.figure_values import Banded

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_PER_HOUR = 30.0
"""False alarms per hour up to which curves are shown, or farther where a threshold in use lies."""


def in_time(panels: Sequence[tuple[str, Sequence[Banded]]]) -> bytes:
    """Detection in time against false alarms, over all thresholds."""
    count = max(1, len(panels))
    with styled():
        most = max((len(lines) for _, lines in panels), default=0)
        figure = new_figure(WIDE / 2 if count == 1 else WIDE, 520 + 18 * most)
        grid = figure.subplots(1, count, squeeze=False)[0]
        for axes, (title, lines) in zip(grid, panels, strict=False):
            axes.set_title(title)
            axes.set_box_aspect(1)
            axes.set_anchor("N")
            axes.plot([0, 1], [0, 1], color=colour("line"), linestyle=(0, (2, 3)), linewidth=1)
            for index, line in enumerate(lines):
                _line(axes, line, index)
            percent_axis(axes, "x")
            percent_axis(axes, "y")
            axes.set_xlabel("false alarms: share of runs without a failure")
            axes.set_ylabel("detected in time: share of foreseeable failures")
            _legend(axes, -0.13)
        return svg_bytes(figure)


def risk(panels: Sequence[tuple[str, Sequence[Banded]]]) -> bytes:
    """Runs that fail without an alarm in time against false alarms per hour."""
    count = max(1, len(panels))
    with styled():
        most = max((len(lines) for _, lines in panels), default=0)
        figure = new_figure(WIDE / 2 if count == 1 else WIDE, 430 + 18 * most)
        grid = figure.subplots(1, count, squeeze=False)[0]
        for axes, (title, lines) in zip(grid, panels, strict=False):
            axes.set_title(title)
            for index, line in enumerate(lines):
                _line(axes, line, index)
            marks = [line.mark[0] for line in lines if line.mark is not None]
            axes.set_xlim(-0.02 * MOST_PER_HOUR, max([MOST_PER_HOUR, *(1.1 * x for x in marks)]))
            axes.set_ylim(bottom=0)
            axes.yaxis.set_major_formatter(lambda y, _: f"{100 * y:.0f} %")
            axes.set_xlabel("false alarms per hour of robot time")
            axes.set_ylabel("runs that fail without an alarm in time")
            _legend(axes, -0.17)
        return svg_bytes(figure)


def demonstrations(panels: Sequence[tuple[str, str, Sequence[Banded]]]) -> bytes:
    """What judges are worth by number of demonstrations."""
    columns = 2 if len(panels) > 1 else 1
    rows = max(1, -(-len(panels) // columns))
    with styled():
        figure = new_figure(WIDE if columns == 2 else WIDE / 2, 300 * rows)
        grid = figure.subplots(rows, columns, squeeze=False)
        flat = list(grid.ravel())
        for axes, (title, words, lines) in zip(flat, panels, strict=False):
            axes.set_title(f"{title}: {words}", fontsize=11)
            for index, line in enumerate(lines):
                _line(axes, line, index, marked=True)
            axes.set_xscale("log", base=2)
            ticks = sorted({x for line in lines for x, _, _, _ in line.points})
            axes.set_xticks(ticks, [f"{x:g}" for x in ticks])
            axes.minorticks_off()
            axes.set_xlabel("demonstrations")
            axes.legend(loc="best", handlelength=3.4)
        for axes in flat[len(panels) :]:
            axes.set_axis_off()
        return svg_bytes(figure)


def _line(axes: Axes, line: Banded, index: int, marked: bool = False) -> None:
    shade = series_colour(index)
    if line.points:
        axes.plot(
            *([p[0] for p in line.points], [p[1] for p in line.points]),
            color=shade,
            linewidth=2.8 if index == 0 else 1.8,
            linestyle=DASHES[index % len(DASHES)],
            drawstyle="steps-post" if line.steps else "default",
            marker=MARKERS[index % len(MARKERS)] if marked else NOTHING,
            label=line.label,
            zorder=3 - 0.1 * index,
        )
    band = [
        (a, low, high) for a, _, low, high in line.points if low is not None and high is not None
    ]
    if band:
        axes.fill_between(
            [a for a, _, _ in band],
            [low for _, low, _ in band],
            [high for _, _, high in band],
            step="post" if line.steps else None,
            color=shade,
            alpha=0.11,
            linewidth=0,
            zorder=1,
        )
    if line.mark is not None and line.span is not None:
        x = line.mark[0]
        axes.plot([x, x], line.span, color=shade, linewidth=2, alpha=0.6, zorder=4)
    if line.mark is not None:
        axes.plot(
            *([line.mark[0]], [line.mark[1]]),
            color=shade,
            marker=MARKERS[index % len(MARKERS)],
            markersize=9,
            markeredgecolor=colour("card"),
            linestyle=NOTHING,
            label="" if line.points else line.label,
            clip_on=False,
            zorder=5,
        )


def _legend(axes: Axes, below: float) -> None:
    axes.legend(
        loc="upper left",
        bbox_to_anchor=(0.0, below),
        handlelength=3.4,
        labelspacing=0.45,
        alignment="left",
    )
