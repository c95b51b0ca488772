"""What figures are drawn from: plain values, no rows and no colours.

Made by `figure_data.py`, drawn by `figures.py` and `run_figures.py`.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Estimate:
    """A figure with its interval and how many it is of; None: there is none."""

    value: float | None
    low: float | None = None
    high: float | None = None
    n: int = 0


@dataclass(frozen=True, slots=True)
class Curve:
    """What a detector does over all thresholds.

    Args:
        label: its name as shown.
        points: (false alarms per run, detection), in the order of the threshold.
        marks: (threshold, false alarms per run, detection) of the thresholds in use.
        area: under the curve.
        single: it knows one decision and no threshold; drawn as a point.
    """

    label: str
    points: tuple[tuple[float, float], ...]
    marks: tuple[tuple[float, float, float], ...] = ()
    area: float | None = None
    single: bool = False


@dataclass(frozen=True, slots=True)
class Dot:
    """One line of a panel: an estimate, and the paper's value where it has one."""

    label: str
    estimate: Estimate
    paper: float | None = None


@dataclass(frozen=True, slots=True)
class Shares:
    """How the failures of one group were met: shares that add up to at most 1.

    Args:
        label: the detector.
        in_time: with an alarm between the moment of knowing and the harm.
        late: with one after the harm only.
        early: with none but before anything was wrong.
        n: how many failures.
    """

    label: str
    in_time: float
    late: float
    early: float
    n: int


@dataclass(frozen=True, slots=True)
class Lane:
    """One run over its simulated seconds.

    Args:
        label: the strategy.
        ticks: when one subtask was over and the next one to begin.
        alarms: when an alarm was raised.
        replans: when a new plan was adopted.
        known_s: when the failure could be known.
        harmed_s: when what cannot be undone was done.
        end_s: when the run ended.
        success: whether the goal was reached.
    """

    label: str
    ticks: tuple[float, ...]
    alarms: tuple[float, ...]
    replans: tuple[float, ...]
    known_s: float | None
    harmed_s: float | None
    end_s: float
    success: bool


@dataclass(frozen=True, slots=True)
class Distribution:
    """The lowest score of each run, by group, for one detector."""

    label: str
    groups: tuple[tuple[str, tuple[float, ...]], ...]
    threshold: float | None = None


@dataclass(frozen=True, slots=True)
class Spent:
    """Mean seconds of one strategy; `paper` is the total that the paper reports."""

    label: str
    robot_s: float
    computing_s: float
    n: int
    paper: float | None = None


@dataclass(frozen=True, slots=True)
class Banded:
    """A line with its band, or a single point with its interval.

    Args:
        label: its name as shown.
        points: (x, y, low, high) in the order of the line; without low and high there is no band.
        steps: whether it keeps its height up to the next point.
        mark: (x, y) of the threshold in use, if there is one. `span`: (low, high) of its y.
    """

    label: str
    points: tuple[tuple[float, float, float | None, float | None], ...]
    steps: bool = False
    mark: tuple[float, float] | None = None
    span: tuple[float, float] | None = None
