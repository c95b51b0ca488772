"""Figures of detectors: ROC, rates by kind, when alarms come, how scores are spread.

Called by the experiment's page; calls `figure_style.py`. Each function takes what is to be seen and
returns an SVG file. Colour never tells alone: series differ in marker or dash, too.
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
    key,
    new_figure,
    patches,
    percent_axis,
    series_colour,
    styled,
    svg_bytes,
    wrapped,
)
from forestall.report.figure_values import Curve, Distribution, Estimate, Shares

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def roc(panels: Sequence[tuple[str, Sequence[Curve]]]) -> bytes:
    """Detection against false alarms, over all thresholds."""
    count = max(1, len(panels))
    with styled():
        most = max((len(curves) for _, curves in panels), default=0)
        figure = new_figure(WIDE / 2 if count == 1 else WIDE, 566 + 18 * most)
        grid = figure.subplots(1, count, squeeze=False)[0]
        for axes, (title, curves) in zip(grid, panels, strict=False):
            axes.set_title(title)
            axes.set_box_aspect(1)
            axes.set_anchor("N")
            axes.plot([0, 1], [0, 1], color=colour("line"), linestyle=(0, (2, 3)), linewidth=1)
            for index, curve in enumerate(c for c in curves if not c.single):
                _curve(axes, curve, index)
            for index, curve in enumerate(c for c in curves if c.single):
                _single(axes, curve, index)
            percent_axis(axes, "x")
            percent_axis(axes, "y")
            axes.set_xlabel("false alarms: share of runs without a failure")
            axes.set_ylabel("detected: share of failing runs")
            axes.legend(
                loc="upper left",
                bbox_to_anchor=(0.0, -0.13),
                handlelength=3.4,
                labelspacing=0.45,
                alignment="left",
            )
        return svg_bytes(figure)


def _curve(axes: Axes, curve: Curve, index: int) -> None:
    shade = series_colour(index)
    area = "" if curve.area is None else f"  (area {curve.area:.2f})"
    axes.plot(
        [x for x, _ in curve.points],
        [y for _, y in curve.points],
        color=shade,
        linewidth=2.8 if index == 0 else 1.8,
        linestyle=DASHES[index % len(DASHES)],
        label=curve.label + area,
        zorder=3 - 0.1 * index,
    )
    axes.plot(
        [x for _, x, _ in curve.marks],
        [y for _, _, y in curve.marks],
        color=shade,
        marker=MARKERS[index % len(MARKERS)],
        markersize=8,
        markeredgecolor=colour("card"),
        linestyle=NOTHING,
        clip_on=False,
        zorder=5,
    )
    if index == 0:
        _name_marks(axes, curve)


def _single(axes: Axes, curve: Curve, index: int) -> None:
    x, y = curve.points[0]
    axes.plot(
        *([x], [y]),
        color=colour("ink"),
        marker=MARKERS[index % len(MARKERS)],
        markersize=9,
        markerfacecolor=NOTHING,
        markeredgewidth=1.6,
        linestyle=NOTHING,
        label=curve.label,
        clip_on=False,
        zorder=6,
    )


def _name_marks(axes: Axes, curve: Curve) -> None:
    """Thresholds beside their marks; those that share a place are named together."""
    places: dict[tuple[float, float], list[str]] = {}
    for threshold, x, y in curve.marks:
        places.setdefault((round(x, 2), round(y, 2)), []).append(f"{threshold:.2f}")
    for (x, y), names in sorted(places.items()):
        right = x < 0.8
        axes.annotate(
            ", ".join(names),
            (x, y),
            xytext=(8 if right else -8, -13),
            textcoords="offset points",
            ha="left" if right else "right",
            fontsize=10,
            color=colour("ink"),
            zorder=6,
        )


def by_kind(
    kinds: Sequence[tuple[str, int]], series: Sequence[tuple[str, Sequence[Estimate]]]
) -> bytes:
    """Detection by kind of failure, one column of dots for each detector.

    Args:
        kinds: (kind, how many runs), from top to bottom.
        series: (detector, an estimate for each kind).
    """
    with styled():
        figure = new_figure(WIDE, 92 + 27 * max(1, len(kinds)))
        grid = figure.subplots(1, max(1, len(series)), squeeze=False, sharey=True)[0]
        rows = range(len(kinds))
        for place, (name, estimates) in enumerate(series):
            axes = grid[place]
            axes.set_title(wrapped(name), fontsize=11)
            shade, marker = series_colour(place), MARKERS[place % len(MARKERS)]
            for i, estimate in enumerate(estimates):
                y = len(kinds) - 1 - i
                if estimate.value is None:
                    continue
                if estimate.low is not None and estimate.high is not None:
                    axes.plot(
                        *([estimate.low, estimate.high], [y, y]),
                        color=shade,
                        linewidth=2,
                        alpha=0.5,
                        solid_capstyle="butt",
                    )
                axes.plot(
                    *([estimate.value], [y]),
                    color=shade,
                    marker=marker,
                    markersize=7,
                    clip_on=False,
                )
            percent_axis(axes, "x")
            axes.set_xticks([0.0, 0.5, 1.0], ["0", "50", "100 %"])
            axes.set_ylim(-0.6, len(kinds) - 0.4)
            axes.spines["left"].set_visible(False)
        first = grid[0]
        first.set_yticks(rows, [f"{kind} ({n})" for kind, n in reversed(kinds)])
        first.tick_params(axis="y", labelcolor=colour("ink"))
        figure.supxlabel("detected: share of runs with an alarm", fontsize=11, color=colour("soft"))
        return svg_bytes(figure)


_MET = (
    ("alarm in time", "s1", ""),
    ("only after the harm", "s6", "///"),
    ("only before anything was wrong", "s7", "..."),
    ("no alarm", None, ""),
)
"""How a failure can be met: its name, colour and hatch."""


def knowability(groups: Sequence[tuple[str, Sequence[Shares]]]) -> bytes:
    """Alarms in time, late and missing, for what can be known early and what cannot."""
    most = max((len(rows) for _, rows in groups), default=1)
    with styled():
        figure = new_figure(WIDE, 104 + 29 * most)
        grid = figure.subplots(1, max(1, len(groups)), squeeze=False, sharey=True)[0]
        for place, (title, rows) in enumerate(groups):
            axes = grid[place]
            n = max((r.n for r in rows), default=0)
            axes.set_title(f"{title} (n = {n})", fontsize=11)
            for i, row in enumerate(rows):
                y = len(rows) - 1 - i
                left = 0.0
                missed = max(0.0, 1 - row.in_time - row.late - row.early)
                parts = (row.in_time, row.late, row.early, missed)
                for width, (_, face, hatch) in zip(parts, _MET, strict=True):
                    axes.barh(
                        *(y, width, 0.66),
                        left=left,
                        facecolor=NOTHING if face is None else colour(face),
                        edgecolor=colour("hair" if face is None else "card"),
                        linewidth=1 if face is None else 0,
                        hatch=hatch,
                    )
                    left += width
                if row.in_time >= 0.16:
                    axes.text(
                        *(0.02, y, f"{100 * row.in_time:.0f}"),
                        va="center",
                        fontsize=10,
                        color=colour("card"),
                    )
            percent_axis(axes, "x")
            axes.set_xticks([0.0, 0.5, 1.0], ["0", "50", "100 %"])
            axes.grid(False)
            axes.spines["left"].set_visible(False)
            if place == 0:
                axes.set_yticks(range(len(rows)), [wrapped(r.label) for r in reversed(rows)])
                axes.tick_params(axis="y", labelcolor=colour("ink"))
        key(figure, patches(_MET))
        return svg_bytes(figure)


def scores(detectors: Sequence[Distribution]) -> bytes:
    """How low the lowest score of a run is, for runs with and without a failure."""
    columns = min(3, max(1, len(detectors)))
    lines = max(1, -(-len(detectors) // columns))
    with styled():
        figure = new_figure(WIDE, 50 + 210 * lines)
        grid = figure.subplots(lines, columns, squeeze=False, sharey=True)
        flat = list(grid.ravel())
        for axes, detector in zip(flat, detectors, strict=False):
            axes.set_title(wrapped(detector.label, 48), fontsize=11)
            for i, (name, values) in enumerate(detector.groups):
                if values:
                    axes.ecdf(
                        sorted(values),
                        color=series_colour((1, 0, 2)[i % 3]),
                        linestyle=DASHES[i % len(DASHES)],
                        linewidth=2.4 if i == 0 else 1.8,
                        label=name,
                    )
            if detector.threshold is not None:
                axes.axvline(detector.threshold, color=colour("ink"), linewidth=1.2)
                axes.annotate(
                    f"{detector.threshold:.2f}",
                    (detector.threshold, 1.0),
                    xytext=(-4, -3),
                    textcoords="offset points",
                    ha="right",
                    va="top",
                    fontsize=10,
                    color=colour("ink"),
                )
            percent_axis(axes, "y")
        for axes in flat[len(detectors) :]:
            axes.set_axis_off()
        handles, labels = flat[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper left", ncols=max(1, len(labels)))
        figure.supxlabel("lowest score of the run", fontsize=11, color=colour("soft"))
        figure.supylabel("share of runs at or below", fontsize=11, color=colour("soft"))
        return svg_bytes(figure)
