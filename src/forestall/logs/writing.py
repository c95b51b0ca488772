"""What a log is told while it is written, and the listener that tells it of a run.

Called by the episode loop's audience; calls a writer (`mcap_out`, `lerobot_out`, `rerun_out`). A
listener cannot change an episode: a log that fails is said in the record's notes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from forestall.errors import InputError
from forestall.records.derived import left_at, new_plan
from forestall.types.episode import BoundaryRecord, EpisodeRecord, ExecutedRecord, SkillStatus
from forestall.types.observation import Observation
from forestall.types.plan import Subtask
from forestall.types.runtime import BoundaryContext


@dataclass(frozen=True, slots=True)
class Head:
    """What is known of a run when it begins.

    Args:
        name: of its own.
        task: what is to be done.
        scene: where.
        goal: in words.
        domain: in whose words its subtasks are.
    """

    name: str
    task: str
    scene: str
    goal: str
    domain: str


@dataclass(frozen=True, slots=True)
class Executed:
    """A subtask that was carried out after the last look and before the next one."""

    subtask: Subtask
    status: SkillStatus
    reason: str = ""


class LogWriter(Protocol):
    """Writes one run: looks and what was carried out between them, in their order.

    Nothing of it is seen where it is meant to be before `finish`.
    """

    def begin(self, head: Head) -> None:
        """The run begins."""

    def look(self, observation: Observation) -> None:
        """The robot looked."""

    def executed(self, executed: Executed) -> None:
        """A subtask was carried out since the last look."""

    def finish(self, success: bool | None, why: str) -> None:
        """The run is over: whether its task succeeded (None: nobody said), and what failed."""

    def abandon(self) -> None:
        """Take away what was written; after `finish` nothing happens."""


@runtime_checkable
class JudgedWriter(LogWriter, Protocol):
    """A writer that also shows what a monitor made of what was seen."""

    def judged(
        self,
        boundary: BoundaryRecord,
        before: Sequence[Subtask],
        after: Sequence[Subtask] | None,
    ) -> None:
        """A boundary was judged, on the newest look.

        Args:
            boundary: its record.
            before: what was left of the plan.
            after: the plan that was proposed for it; None where it stays.
        """


def head_of(record: EpisodeRecord) -> Head:
    """What a log of a run says when the run begins."""
    task = record.task
    scene = f"{task.scene.room or task.domain}-{record.seed}"
    name = "-".join((task.name, record.scenario or "undisturbed", str(record.seed)))
    return Head(name, task.name, scene, task.goal.text, task.domain)


class EpisodeLog:
    """Listener that writes all that a run sees and does (`seams.Listener`, `LookListener`).

    What is written once wrongly is no log: after a failure nothing more is written, and the end
    takes it away.

    Args:
        writer: of one run.
    """

    def __init__(self, writer: LogWriter) -> None:
        self._writer = writer
        self._whole = True
        self.complete = False
        """Whether the log of a whole run is written."""

    def on_start(self, record: EpisodeRecord) -> None:
        """The episode begins."""
        with self._wholly():
            self._writer.begin(head_of(record))

    def on_look(self, observation: Observation) -> None:
        """The robot has looked."""
        with self._wholly():
            self._writer.look(observation)

    def on_boundary(self, boundary: BoundaryRecord, context: BoundaryContext) -> None:
        """A boundary was judged: what was seen is written already."""
        if isinstance(self._writer, JudgedWriter):
            plan = new_plan(boundary.replan)
            after = None if plan is None else plan.subtasks
            with self._wholly():
                self._writer.judged(boundary, left_at(context), after)

    def on_executed(self, executed: ExecutedRecord, time_s: float) -> None:
        """A subtask was executed."""
        outcome = executed.outcome
        with self._wholly():
            self._writer.executed(Executed(executed.subtask, outcome.status, outcome.reason))

    def on_end(self, record: EpisodeRecord) -> None:
        """The episode is over."""
        with self._wholly():
            self._writer.finish(record.success, "; ".join(record.failures))
            self.complete = True

    @contextmanager
    def _wholly(self) -> Iterator[None]:
        """Around each call of the writer.

        Raises:
            InputError: an earlier one failed.
        """
        if not self._whole:
            raise InputError("the log broke off earlier")
        self._whole = False
        yield
        self._whole = True
