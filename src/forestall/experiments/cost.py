"""What an experiment will cost, before it starts.

Called by the command line; reads the runs that are still to be done. The numbers were measured as
`docs/experiments.md` says, on one core of the machine that is named there; another machine is
faster or slower by a factor, and so is the estimate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from forestall.experiments.runs import Run
from forestall.statistics.rows import NOBODY, PERFECT

FIRST_S = 1.3
"""Seconds of one core for a step of the watched run: nearly all is drawn for the first time, and
every judge has the second looks that it asks for. This and the others: so that the published run of
544 episodes comes out as it did, 72 minutes, 21 of them for demonstrations."""

SENSED_S = 0.7
"""For a step of a run through another sensor, whose pictures were drawn for the one without."""

AGAIN_S = 0.3
"""For a step of a run in which nobody steps in: it sees what was drawn for the watched one."""

APART_S = 0.8
"""For a step of a run in which somebody does: it parts from the watched one sooner or later."""

DEMONSTRATION_S = 1.1
"""For a step of a demonstration, tries that did not succeed included."""

ROW_BYTES = 10_000
"""Of an episode in the folder, its page apart."""


@dataclass(frozen=True, slots=True)
class Cost:
    """An estimate.

    Args:
        episodes: how many are to be run or taken from the watched one.
        episodes_s: their seconds of one core.
        demonstrations_s: likewise of the demonstrations that have to be recorded.
        workers: how many work at once.
    """

    episodes: int
    episodes_s: float
    demonstrations_s: float
    workers: int

    @property
    def text(self) -> str:
        """In words."""
        minutes = (self.episodes_s + self.demonstrations_s) / self.workers / 60
        recorded = self.demonstrations_s / self.workers / 60
        first = f", {recorded:.0f} min of it for demonstrations" if recorded >= 0.5 else ""
        return (
            f"{self.episodes:,} episodes: about {minutes:.0f} min with {self.workers} "
            f"process{'es' if self.workers > 1 else ''}{first}, "
            f"{self.episodes * ROW_BYTES / 1e6:.0f} MB"
        )


def cost_of(runs: Sequence[tuple[Run, int]], recorded_steps: int, workers: int) -> Cost:
    """Estimate what is still to be done.

    Args:
        runs: each with the number of steps of its task's plan.
        recorded_steps: steps of all demonstrations that have to be recorded first.
        workers: how many episodes at once.
    """
    seconds = 0.0
    for run, steps in runs:
        if run.sensor != PERFECT:
            seconds += SENSED_S * steps
        elif run.strategy == "watch":
            seconds += FIRST_S * steps
        else:
            seconds += (AGAIN_S if run.strategy in NOBODY else APART_S) * steps
    return Cost(len(runs), seconds, DEMONSTRATION_S * recorded_steps, workers)
