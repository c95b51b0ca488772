"""The progress line of a run, on standard error.

Listens to the episode loop; standard output stays free for the command's own answer.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from types import TracebackType

from rich.console import Console
from rich.live import Live
from rich.text import Text

from forestall.reading.printing import shown
from forestall.records.derived import in_words
from forestall.types.decision import Outcome
from forestall.types.episode import BoundaryRecord, EpisodeRecord, ExecutedRecord, SkillStatus
from forestall.types.runtime import BoundaryContext, When
from forestall.types.verdict import Decision


class ProgressLine:
    """One line that says how far a run has come; plain lines where nobody watches.

    On a terminal a single line is kept up to date. Elsewhere, or when quiet, each executed subtask
    and each alarm is a line of its own; with `quiet` only alarms and the end are. Also a context
    manager, so that a run that raises leaves the terminal as it was.

    Args:
        console: where to write; standard error by default.
        quiet: no moving line, and only what matters.
        clock: seconds, monotonic.
    """

    def __init__(
        self,
        console: Console | None = None,
        *,
        quiet: bool = False,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._console = console or Console(stderr=True, highlight=False)
        self._quiet = quiet
        self._clock = clock
        self._live: Live | None = None
        self._started = 0.0
        self._task = ""
        self._now = ""
        self._done = 0
        self._total = 0
        self._alarms = 0
        self._simulated_s = 0.0

    def on_start(self, record: EpisodeRecord) -> None:
        """The episode begins."""
        self.close()
        task, plan = record.task, record.initial_plan
        self._started = self._clock()
        self._task, self._now = task.name, "looking around"
        self._done, self._total, self._alarms, self._simulated_s = 0, len(plan), 0, 0.0
        if self._console.is_terminal and not self._quiet:
            self._live = Live(
                get_renderable=self._line,
                console=self._console,
                refresh_per_second=4,
                transient=True,
            )
            self._live.start()
        elif not self._quiet:
            self._say(f"{task.name}, seed {record.seed}: {len(plan)} subtasks")

    def on_boundary(self, boundary: BoundaryRecord, context: BoundaryContext) -> None:
        """A boundary was judged."""
        self._now = str(boundary.subtask)
        remaining = len(context.plan) - context.index - (boundary.when is When.AFTER)
        moment = f"{in_words(boundary.when)} {boundary.subtask}"
        verdict = boundary.verdict
        if verdict is not None and verdict.decision is Decision.REPLAN:
            self._alarms += 1
            cause = "" if boundary.diagnosis is None else f": {boundary.diagnosis.cause}"
            self._say(f"alarm {moment}{cause}", "yellow")
        plan = None if boundary.replan is None else boundary.replan.plan
        if boundary.outcome is Outcome.REPLAN and plan is not None:
            remaining = len(plan)
            self._say(f"new plan: {remaining} subtasks", "cyan")
        if boundary.outcome is Outcome.HOLD:
            self._say(f"stopped {moment}: {boundary.why}", "red")
        self._total = self._done + remaining
        self._refresh()

    def on_executed(self, executed: ExecutedRecord, time_s: float) -> None:
        """A subtask was executed."""
        subtask, outcome = executed.subtask, executed.outcome
        self._done += 1
        self._simulated_s = time_s
        fine = outcome.status is SkillStatus.SUCCEEDED
        if not fine and not self._quiet:
            self._say(f"{subtask} {outcome.status.value}: {outcome.reason}", "red")
        elif self._live is None and not self._quiet:
            self._say(f"{self._done}/{max(self._done, self._total)} {subtask}, {time_s:.0f} s")
        self._refresh()

    def on_end(self, record: EpisodeRecord) -> None:
        """The episode is over."""
        self.close()
        for note in (*([record.trouble.text] if record.trouble else []), *record.notes):
            self._say(note, "red")
        result = {True: "succeeded", False: "failed", None: "not scored"}[record.success]
        self._say(
            f"{record.task.name} {result}: {record.end.value}, {len(record.executed)} subtasks, "
            f"{self._count()}, {record.simulated_s:.0f} s simulated, "
            f"{self._clock() - self._started:.1f} s elapsed"
        )

    def close(self) -> None:
        """Take the moving line away."""
        if self._live is not None:
            self._live.stop()
            self._live = None

    def __enter__(self) -> ProgressLine:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _count(self) -> str:
        return f"{self._alarms} alarm{'s' * (self._alarms != 1)}"

    def _line(self) -> Text:
        elapsed = self._clock() - self._started
        left = ""
        if self._done:
            ahead = max(0, self._total - self._done)
            left = f", about {elapsed / self._done * ahead:.0f} s left"
        return Text.from_markup(
            f"[bold]{shown(self._task)}[/] "
            f"{min(self._done + 1, max(1, self._total))}/{max(1, self._total)} "
            f"[cyan]{shown(self._now)}[/] · {self._simulated_s:.0f} s simulated · "
            f"{self._count()} · {elapsed:.0f} s elapsed{left}",
            overflow="ellipsis",
        )

    def _say(self, text: str, style: str = "") -> None:
        if self._console.is_terminal:
            self._console.print(shown(text), style=style)
        else:
            self._console.print(shown(text), soft_wrap=True)

    def _refresh(self) -> None:
        if self._live is not None:
            self._live.refresh()
