"""Figures of runs: success and time by strategy, and one case as lanes over time.

Called by the experiment's page; calls `figure_style.py`. Each function takes what is to be seen and
returns an SVG file. Colour never tells alone: strategies differ in marker, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from forestall.report.figure_style import (
    MARKERS,
    NOTHING,
    WIDE,
    colour,
    key,
    new_figure,
    paper_mark,
    patches,
    percent_axis,
    styled,
    svg_bytes,
    wrapped,
)
from forestall.report.figure_values import Dot, Lane, Spent

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes


STRATEGY_COLOURS = ("s7", "s6", "s3", "s1", "s4", "s5", "s8")


def dots(panels: Sequence[tuple[str, Sequence[Dot]]], label: str) -> bytes:
    """Estimates with their intervals and the paper's value, one panel for each set.

    All panels have the same lines; the first one names them.
    """
    most = max((len(rows) for _, rows in panels), default=1)
    with styled():
        figure = new_figure(WIDE, 96 + 34 * most)
        grid = figure.subplots(1, max(1, len(panels)), squeeze=False, sharey=False)[0]
        for place, (title, rows) in enumerate(panels):
            axes = grid[place]
            axes.set_title(title)
            for i, dot in enumerate(rows):
                _dot(axes, len(rows) - 1 - i, dot, i)
            axes.set_ylim(-0.6, most - 0.4 if len(rows) == most else len(rows) - 0.4)
            labels = [wrapped(d.label) for d in reversed(rows)] if place == 0 else []
            axes.set_yticks(range(len(rows)), labels or [""] * len(rows))
            axes.tick_params(axis="y", labelcolor=colour("ink"))
            axes.grid(False, axis="y")
            axes.spines["left"].set_visible(False)
            percent_axis(axes, "x")
        figure.supxlabel(label, fontsize=11, color=colour("soft"))
        if any(d.paper is not None for _, rows in panels for d in rows):
            figure.legend(handles=[paper_mark(0, 0)], loc="outside upper right")
        return svg_bytes(figure)


def _dot(axes: Axes, y: float, dot: Dot, index: int) -> None:
    shade = colour(STRATEGY_COLOURS[index % len(STRATEGY_COLOURS)])
    marker = MARKERS[index % len(MARKERS)]
    estimate = dot.estimate
    if estimate.value is None:
        axes.text(0.0, y, "no run", va="center", fontsize=10, color=colour("soft"))
    else:
        if estimate.low is not None and estimate.high is not None:
            axes.plot(
                *([estimate.low, estimate.high], [y, y]),
                color=shade,
                linewidth=2.2,
                solid_capstyle="butt",
                alpha=0.55,
                clip_on=False,
            )
        axes.plot([estimate.value], [y], color=shade, marker=marker, markersize=8, clip_on=False)
        end = max(estimate.value, estimate.high or 0.0)
        at_right = end < 0.72
        axes.annotate(
            f"{100 * estimate.value:.0f} % of {estimate.n}",
            (end if at_right else min(estimate.value, estimate.low or 1.0), y),
            xytext=(9 if at_right else -9, 0),
            textcoords="offset points",
            va="center",
            ha="left" if at_right else "right",
            fontsize=10,
            color=colour("soft"),
        )
    if dot.paper is not None:
        axes.add_line(paper_mark(dot.paper, y - 0.32))


def timelines(lanes: Sequence[Lane]) -> bytes:
    """Strategies as lanes over simulated time (the paper's figure of execution timelines)."""
    with styled():
        figure = new_figure(WIDE, 84 + 52 * max(1, len(lanes)))
        axes = figure.subplots()
        longest = max((lane.end_s for lane in lanes), default=1.0) or 1.0
        for i, lane in enumerate(lanes):
            _lane(axes, len(lanes) - 1 - i, lane, longest)
        axes.set_ylim(-0.55, len(lanes) - 0.35)
        axes.set_xlim(-0.01 * longest, 1.13 * longest)
        axes.set_yticks(range(len(lanes)), [wrapped(lane.label) for lane in reversed(lanes)])
        axes.tick_params(axis="y", labelcolor=colour("ink"))
        axes.grid(False, axis="y")
        axes.spines["left"].set_visible(False)
        axes.set_xlabel("simulated seconds")
        key(figure, _timeline_key(lanes))
        return svg_bytes(figure)


_SIGNS = (
    ("between subtasks", "|", "line", 11.0),
    ("failure can be known", "^", "s1", 9.0),
    ("alarm", "s", "s2", 8.0),
    ("new plan", "D", "s3", 8.0),
    ("harm done", "X", "bad", 11.0),
)
"""What is marked on a lane: its name, marker, colour and size."""


def _seen(lane: Lane) -> tuple[tuple[float, ...], ...]:
    """The times of what is marked on a lane, in the order of `_SIGNS`."""
    return (
        lane.ticks,
        () if lane.known_s is None else (lane.known_s,),
        lane.alarms,
        lane.replans,
        () if lane.harmed_s is None else (lane.harmed_s,),
    )


def _lane(axes: Axes, y: float, lane: Lane, longest: float) -> None:
    axes.plot([0, lane.end_s], [y, y], color=colour("line"), linewidth=2, zorder=1)
    raised = (0.0, -0.26, 0.24, 0.24, 0.0)
    shifted = (0.0, 0.0, 0.0, 0.012 * longest, 0.0)
    for times, (_, marker, role, size), up, right in zip(
        _seen(lane), _SIGNS, raised, shifted, strict=True
    ):
        axes.plot(
            [t + right for t in times],
            [y + up] * len(times),
            color=colour(role),
            marker=marker,
            markersize=size,
            markeredgecolor=colour("line" if marker == "|" else "card"),
            linestyle=NOTHING,
            zorder=4 if marker == "X" else 3,
            clip_on=False,
        )
    axes.plot(
        *([lane.end_s], [y]),
        color=colour("good" if lane.success else "bad"),
        marker="o",
        markersize=10,
        markerfacecolor=colour("good") if lane.success else colour("card"),
        markeredgewidth=2,
        zorder=5,
    )
    axes.annotate(
        "reached" if lane.success else "not reached",
        (lane.end_s, y),
        xytext=(11, 0),
        textcoords="offset points",
        va="center",
        fontsize=10.5,
        color=colour("good" if lane.success else "bad"),
    )


def _timeline_key(lanes: Sequence[Lane]) -> list[Artist]:
    """What the signs mean that are there."""
    from matplotlib.lines import Line2D

    seen = [_seen(lane) for lane in lanes]
    there = [any(times[k] for times in seen) for k in range(len(_SIGNS))]
    return [
        Line2D(
            *([], []),
            color=colour(role),
            marker=marker,
            markersize=size,
            markeredgecolor=colour("line" if marker == "|" else "card"),
            linestyle=NOTHING,
            label=name,
        )
        for (name, marker, role, size), shown in zip(_SIGNS, there, strict=True)
        if shown
    ]


def time_spent(rows: Sequence[Spent]) -> bytes:
    """Mean seconds of a run: what the robot took and what computing took on top."""
    with styled():
        figure = new_figure(WIDE * 0.8, 104 + 38 * max(1, len(rows)))
        axes = figure.subplots()
        for i, row in enumerate(rows):
            y = len(rows) - 1 - i
            total = row.robot_s + row.computing_s
            if row.paper is not None:
                axes.add_line(paper_mark(row.paper, y - 0.42))
            axes.barh(y, row.robot_s, height=0.58, color=colour("s5"))
            axes.barh(
                *(y, row.computing_s, 0.58), left=row.robot_s, color=colour("s2"), hatch="///"
            )
            axes.annotate(
                f"{total:.1f} s ({row.robot_s:.1f} + {row.computing_s:.1f}), n = {row.n}",
                (total, y),
                xytext=(9, 0),
                textcoords="offset points",
                va="center",
                fontsize=10.5,
                color=colour("soft"),
            )
        longest = max((max(r.robot_s + r.computing_s, r.paper or 0) for r in rows), default=1.0)
        axes.set_xlim(0, 1.35 * (longest or 1.0))
        axes.set_ylim(-0.6, len(rows) - 0.5)
        axes.set_yticks(range(len(rows)), [wrapped(r.label) for r in reversed(rows)])
        axes.tick_params(axis="y", labelcolor=colour("ink"))
        axes.grid(False, axis="y")
        axes.spines["left"].set_visible(False)
        axes.set_xlabel("mean seconds of a run")
        handles = patches([("robot (simulated)", "s5", ""), ("computing", "s2", "///")])
        if any(r.paper is not None for r in rows):
            handles.append(paper_mark(0, 0))
        key(figure, handles)
        return svg_bytes(figure)
