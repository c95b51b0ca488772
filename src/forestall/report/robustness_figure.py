"""The figure of robustness: shares of runs over the strengths of what a sensor gets wrong.

Called by the experiment; calls `figure_style.py`. Lines differ in marker and dash, not only in
colour; bars are 95 % intervals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from forestall.report.figure_style import (
    DASHES,
    MARKERS,
    WIDE,
    key,
    new_figure,
    percent_axis,
    series_colour,
    styled,
    svg_bytes,
    wrapped,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLUMNS = 3
_APART = 0.06


@dataclass(frozen=True, slots=True)
class Line:
    """One share.

    Args:
        label: what it is of.
        shares: (value, low, high) at each strength; None where nothing was counted.
    """

    label: str
    shares: tuple[tuple[float | None, float | None, float | None], ...]


@dataclass(frozen=True, slots=True)
class Panel:
    """One disturbance.

    Args:
        title: its name.
        strengths: in words, "0" for none.
        lines: with a share for each.
    """

    title: str
    strengths: tuple[str, ...]
    lines: tuple[Line, ...]


def robustness_figure(panels: Sequence[Panel]) -> bytes:
    """An SVG file with a panel for each disturbance."""
    rows = max(1, -(-len(panels) // _COLUMNS))
    with styled():
        figure = new_figure(WIDE, 60 + 240 * rows)
        grid = figure.subplots(rows, _COLUMNS, squeeze=False)
        for place, axes in enumerate(grid.ravel()):
            if place < len(panels):
                _panel(axes, panels[place])
            else:
                axes.set_axis_off()
        if panels:
            lines, _ = grid[0][0].get_legend_handles_labels()
            key(figure, lines)
        return svg_bytes(figure)


def _panel(axes: Axes, panel: Panel) -> None:
    axes.set_title(panel.title)
    for index, line in enumerate(panel.lines):
        known = [(x, *s) for x, s in enumerate(line.shares) if s[0] is not None]
        places = [x + _APART * (index - 0.5) for x, *_ in known]
        middle = [value for _, value, _, _ in known if value is not None]
        axes.plot(
            places,
            middle,
            color=series_colour(index),
            marker=MARKERS[index % len(MARKERS)],
            markersize=6,
            linewidth=2.0,
            linestyle=DASHES[index % len(DASHES)],
            label=line.label,
            clip_on=False,
        )
        for x, (_, _, low, high) in zip(places, known, strict=True):
            if low is not None and high is not None:
                axes.plot([x, x], [low, high], color=series_colour(index), linewidth=1.2)
    axes.set_xticks(range(len(panel.strengths)), [wrapped(s, 12) for s in panel.strengths])
    axes.set_xlim(-0.3, len(panel.strengths) - 0.7)
    axes.grid(False, axis="x")
    percent_axis(axes, "y")
