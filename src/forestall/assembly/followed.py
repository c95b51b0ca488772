"""A monitor of somebody's own robot whose runs are kept in a folder while they happen.

Called by users; calls the monitor and the recorder, through the same audience as the episode loop:
what cannot be written holds no robot up. `forestall view` shows the folder, robots at work first of
all; `forestall page` draws a run of it.

    robot = Followed(monitor, "robots/arm-1")
    robot.start(plan)
    decision = robot.before(scene)
    robot.after(outcome)
    robot.end(success=True)
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from types import TracebackType

from forestall.audience import Audience
from forestall.errors import InputError
from forestall.files import alone, make_folder
from forestall.handed import Scene
from forestall.monitor import Monitor
from forestall.records.record import RunRecorder
from forestall.types.decision import MonitorDecision
from forestall.types.episode import BoundaryRecord, EpisodeEnd, EpisodeRecord, SkillOutcome
from forestall.types.plan import Plan, Subtask
from forestall.types.task import Task

LISTEN_S = 5.0
"""How long the robot waits for the disk; what is late is written when the disk comes back."""


class Followed:
    """Asks a monitor, and keeps what it is asked and says.

    Args:
        monitor: it answers; what is not asked here may be asked of it.
        folder: of this robot; each run has a folder in it.
        clock: seconds, monotonic: the robot's time counts from `start`.

    Raises:
        InputError: the folder cannot be made.
    """

    def __init__(
        self, monitor: Monitor, folder: Path | str, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.monitor = monitor
        self.folder = Path(folder)
        self.notes: tuple[str, ...] = ()
        """What befell the writing of the run, in words."""
        self._clock = clock
        self._started_s = 0.0
        self._record: EpisodeRecord | None = None
        self._audience: Audience | None = None
        self._boundaries: list[BoundaryRecord] = []
        self._held = ExitStack()
        make_folder(self.folder)

    def start(self, task: Task | Plan | Sequence[str], plan: Plan | None = None) -> Path:
        """A run begins, see `Monitor.start`; one that was going on is over.

        Returns:
            The folder of the run.
        """
        self.end()
        self.monitor.start(task, plan)
        first = self.monitor.plan
        run = self._held.enter_context(_room_in(self.folder))
        self._record = EpisodeRecord(
            task=_named(self.monitor.task),
            scenario=None,
            strategy=self.monitor.strategy,
            seed=0,
            initial_plan=first,
            boundaries=(),
            executed=(),
            end=EpisodeEnd.UNFINISHED,
            provenance=(("robot", self.folder.name),),
        )
        self._started_s, self._boundaries = self._clock(), []
        self._audience = Audience([RunRecorder(run)], LISTEN_S)
        self._audience.tell("on_start", self._record)
        return run

    def observe(self, scene: Scene) -> None:
        """The first look around, see `Monitor.observe`."""
        self.monitor.observe(scene)

    def before(self, scene: Scene, subtask: Subtask | str | None = None) -> MonitorDecision:
        """May the next subtask start? See `Monitor.before`."""
        return self._noted(self.monitor.before(scene, subtask))

    def after(
        self, outcome: SkillOutcome | str, scene: Scene | None = None, reason: str = ""
    ) -> MonitorDecision | None:
        """The subtask is over, see `Monitor.after`."""
        known = len(self.monitor.executed)
        decision = self.monitor.after(outcome, scene, reason)
        for executed in self.monitor.executed[known:]:
            self._tell("on_executed", executed, self._clock() - self._started_s)
        return None if decision is None else self._noted(decision)

    def finish(self, scene: Scene | None = None) -> MonitorDecision:
        """The plan is finished: is the task? See `Monitor.finish`."""
        return self._noted(self.monitor.finish(scene))

    def end(
        self, success: bool | None = None, failures: Sequence[str] = ()
    ) -> EpisodeRecord | None:
        """The run is over.

        Args:
            success: whether the goal was reached, as the owner knows it; None: nobody knows.
            failures: what was not reached, in words.

        Returns:
            Its record, None where none was going on.
        """
        record, audience = self._record, self._audience
        if record is None or audience is None:
            return None
        over = self.monitor.finished
        record = replace(
            record,
            boundaries=tuple(self._boundaries),
            executed=self.monitor.executed,
            end=EpisodeEnd.PLAN_FINISHED if over else EpisodeEnd.STOPPED,
            success=success,
            failures=tuple(failures),
            simulated_s=self._clock() - self._started_s,
            compute_s=self.monitor.seconds,
            final=self.monitor.final,
        )
        audience.tell_last(0, "on_end", record)
        audience.leave()
        self.notes = audience.notes
        self._record = self._audience = None
        self._held.close()
        return record

    def __enter__(self) -> Followed:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.end()

    def _noted(self, decision: MonitorDecision) -> MonitorDecision:
        record, context = decision.record, decision.context
        if record is not None and context is not None:
            record = replace(record, time_s=self._clock() - self._started_s)
            self._boundaries.append(record)
            self._tell("on_boundary", record, context)
        return decision

    def _tell(self, what: str, *about: object) -> None:
        if self._audience is None:
            raise InputError("the run was not started: call start(task) first")
        self._audience.tell(what, *about)


@contextmanager
def _room_in(folder: Path) -> Iterator[Path]:
    """A folder for one more run, held by this process while the run goes on."""
    stamp = time.strftime("%Y%m%d-%H%M%S")
    for number in itertools.count(1):
        run = folder / (stamp if number == 1 else f"{stamp}+{number}")
        try:
            run.mkdir()
        except FileExistsError:
            continue
        with alone(run):
            yield run
        return


def _named(task: Task) -> Task:
    """A task that a plan alone stands for has no name, and a record wants one."""
    return task if task.name else replace(task, name="a plan", title=task.title or "A plan")
