"""Calls that end in time: to the world, to perception, to whatever judges and plans.

A `Supervisor` makes them one after the other on a thread of its own and waits no longer than the
limit; the loop and the monitor, which decide and give commands, stay on the caller's thread, so
that nothing that comes back late can give a further command. Parts say with `doing` what they are
at, so that an error or a limit that has passed names the part. Called by the loop, the monitor
and the strategies; calls nothing of ours but the deadline that it hands down.
"""

from __future__ import annotations

import contextvars
import ctypes
import queue
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from typing import Any, TypeVar

from forestall.deadline import Deadline
from forestall.errors import ForestallError, InputError, PartError

T = TypeVar("T")

WORLD_CALLS = ("reset", "scan", "observe", "approach", "execute", "time", "hold")
"""What the loop asks of a world; the names are those of the limits, too."""


@dataclass(frozen=True, slots=True)
class Limits:
    """How long each call may take, in seconds of the wall clock, and how often it may go wrong.

    The times are no measure of what is normal: they are what the slowest part of this project, a
    kitchen that draws its pictures on two busy processors, never needs. A robot wants shorter ones.

    Args:
        reset_s: the world's start.
        scan_s: a look all around.
        observe_s: a look ahead.
        approach_s: a drive.
        execute_s: a skill.
        time_s: the world's clock.
        hold_s: stopping; a world that does not hold in this time is said to go on.
        perceive_s: from an observation to the scene graph.
        judge_s: a strategy's whole answer, with all that it asks.
        retrieve_s: finding references.
        detect_s: one judgement.
        diagnose_s: one explanation.
        replan_s: one corrected plan, from grounding to the last check.
        validate_s: one check of a plan.
        listen_s: what a listener may take before the run goes on without it; and how long the end
            of a run waits for what a listener has not written yet.
        score_s: the scorer.
        max_age_s: how much older than the world's clock an observation may be when it is asked for.
        max_alarms_in_a_row: further alarms, without a moment that fits between them, hold the
            robot; 0: no limit.
        max_repairs_in_a_row: the same for new plans without a subtask that succeeds between them.
        max_failures_in_a_row: the same for subtasks that were refused or failed.
        max_unchanged: subtasks that may be reported as done, two of them with an effect, while a
            given scene graph stays the same; 0: any number.

    Raises:
        InputError: a time that is not above 0, or a number below 0.
    """

    reset_s: float = 600.0
    scan_s: float = 180.0
    observe_s: float = 120.0
    approach_s: float = 120.0
    execute_s: float = 600.0
    time_s: float = 10.0
    hold_s: float = 10.0
    perceive_s: float = 180.0
    judge_s: float = 300.0
    retrieve_s: float = 60.0
    detect_s: float = 120.0
    diagnose_s: float = 60.0
    replan_s: float = 120.0
    validate_s: float = 60.0
    listen_s: float = 30.0
    score_s: float = 120.0
    max_age_s: float = 10.0
    max_alarms_in_a_row: int = 8
    max_repairs_in_a_row: int = 8
    max_failures_in_a_row: int = 8
    max_unchanged: int = 3

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if each.name.endswith("_s") and not value > 0:
                raise InputError(f"limit {each.name} is {value}: a time above 0 is needed")
            if not each.name.endswith("_s") and value < 0:
                raise InputError(f"limit {each.name} is {value}: at least 0 is needed")

    def of(self, name: str) -> float:
        """The seconds of a call, e.g. "observe"."""
        seconds: float = getattr(self, f"{name}_s")
        return seconds


def patient(limits: Limits | None = None) -> Limits:
    """The part `limit` of a run."""
    return limits or Limits()


@dataclass(slots=True)
class _Doing:
    """What is going on: which part, with which limit, until when."""

    part: str
    limit_s: float
    ends_s: float
    deadline: Deadline


@dataclass(slots=True, eq=False)
class _Job:
    """One call on the thread of a supervisor; `lock` guards what both threads touch."""

    do: Callable[[], Any]
    limits: Limits
    lock: threading.Condition = field(default_factory=threading.Condition)
    doing: list[_Doing] = field(default_factory=list)
    failed: tuple[BaseException, str] | None = None  # an error, and the innermost part it came from
    done: bool = False
    answer: Any = None
    error: BaseException | None = None

    def begin(self, part: str, limit_s: float) -> None:
        """Something begins, inside of what is going on."""
        with self.lock:
            outer = self.doing[-1].deadline if self.doing else None
            ends_s = time.monotonic() + limit_s
            by_itself = Deadline(_BY_ITSELF * limit_s, outer)
            self.doing.append(_Doing(part, limit_s, ends_s, by_itself))
            self.lock.notify_all()

    def end(self) -> None:
        """What began last is over."""
        with self.lock:
            self.doing.pop()
            self.lock.notify_all()

    def work(self) -> None:
        """Run it; whatever comes of it is kept."""
        _job.set(self)
        try:
            self.answer = self.do()
        except BaseException as error:  # noqa: BLE001 - a part that exits has failed, no more
            self.error = error
        with self.lock:
            self.done = True
            self.lock.notify_all()

    def late(self) -> _Doing | None:
        """Wait until it is done, or until something has not come back in time."""
        with self.lock:
            while not self.done:
                soonest = min(self.doing, key=lambda d: d.ends_s)
                left_s = soonest.ends_s - time.monotonic()
                if left_s <= 0:
                    for each in self.doing:
                        each.deadline.cancel()
                    return soonest
                self.lock.wait(left_s)
        return None

    def blamed(self, part: str) -> str:
        """The innermost part that the error came out of."""
        error, chain = self.error, []
        while error is not None and error not in chain:
            chain.append(error)
            error = error.__cause__ or error.__context__
        return self.failed[1] if self.failed is not None and self.failed[0] in chain else part


_job: contextvars.ContextVar[_Job | None] = contextvars.ContextVar("job", default=None)


class _Cancelled(BaseException):
    """Raised in a part that has not come back in time, wherever it is; nobody waits for it."""


class Supervisor:
    """Makes calls on one thread of its own, and waits no longer than their limits.

    A part that has not come back is not asked again, and neither is any other until it has, and
    `renew` was called.

    Args:
        limits: how long each call may take.
    """

    def __init__(self, limits: Limits | None = None) -> None:
        self.limits = limits or Limits()
        self._jobs: queue.SimpleQueue[Callable[[], None] | None] | None = None
        self._thread: threading.Thread | None = None
        self._late: tuple[str, _Job] | None = None

    @property
    def late(self) -> str | None:
        """The part that has not come back in time, None where all have."""
        return None if self._late is None else self._late[0]

    def call(
        self, part: str, do: Callable[[], T], limit: str, *, gives: type[T] | None = None
    ) -> T:
        """What `do` answers.

        Args:
            part: who is asked, for messages.
            do: the call.
            limit: which of the limits holds for it. A call of `WORLD_CALLS` is never interrupted,
                whatever it moves; a part of ours is, where it runs Python.
            gives: the type of the answer; another one is an error of the part.

        Raises:
            PartError: it raised, did not answer in time, or gave something else.
        """
        if self._late is not None:
            raise PartError(self._late[0], _STILL, late=True, world=limit in WORLD_CALLS)
        job = _Job(do, self.limits)
        job.begin(part, self.limits.of(limit))
        context = contextvars.copy_context()
        self._send(lambda: context.run(job.work))
        world = limit in WORLD_CALLS
        try:
            late = job.late()
        except BaseException:  # interrupted by the user: what goes on is nobody's any more
            self._abandon(part, job, world)
            raise
        if late is not None:
            self._abandon(late.part, job, world)
            why = f"did not answer within {late.limit_s:g} s"
            raise PartError(late.part, why, late=True, world=world)
        if isinstance(job.error, PartError):
            raise job.error
        if job.error is not None:
            raise part_error(job.blamed(part), job.error, world=world) from job.error
        answer: T = checked_answer(part, job.answer, gives, world=world)
        return answer

    def aside(self, part: str, do: Callable[[], T], limit: str) -> T:
        """As `call`; at once and on another thread where a call has not come back."""
        if self._late is None:
            return self.call(part, do, limit)
        return Supervisor(self.limits).call(part, do, limit)

    def renew(self) -> None:
        """Begin anew after a call that did not come back in time.

        Raises:
            PartError: it still has not; to ask it once more would ask two things of it at once.
        """
        if self._late is None:
            return
        part, job = self._late
        with job.lock:
            job.lock.wait_for(lambda: job.done, timeout=0.2)
        if not job.done:
            raise PartError(part, _STILL, late=True)
        self._late = None

    def _send(self, work: Callable[[], None]) -> None:
        if self._jobs is None:
            self._jobs = queue.SimpleQueue()
            self._thread = threading.Thread(
                target=_serve, args=(self._jobs,), name="forestall parts", daemon=True
            )
            self._thread.start()
            weakref.finalize(self, self._jobs.put, None)
        self._jobs.put(work)

    def _abandon(self, part: str, job: _Job, world: bool) -> None:
        """Nobody waits for a job any more; its thread ends with it."""
        self._late = (part, job)
        thread, jobs = self._thread, self._jobs
        self._thread = self._jobs = None
        assert thread is not None and jobs is not None
        jobs.put(None)
        if not world and thread.ident is not None:
            ctypes.pythonapi.PyThreadState_SetAsyncExc(
                ctypes.c_ulong(thread.ident), ctypes.py_object(_Cancelled)
            )


@contextmanager
def doing(part: str, limit: str) -> Iterator[None]:
    """Say what is being done inside of a supervised call; without one it says it to nobody.

    Args:
        part: who does it, for messages.
        limit: which of the limits holds for it.
    """
    job = _job.get()
    if job is None:
        yield
        return
    job.begin(part, job.limits.of(limit))
    try:
        yield
    except BaseException as error:  # a part that exits has failed, too; only whose it is is noted
        if job.failed is None or job.failed[0] is not error:
            job.failed = (error, part)
        raise
    finally:
        job.end()


def ask(part: str, limit: str, gives: type[T], do: Callable[..., Any], *args: Any) -> T:
    """What a part answers; see `doing`.

    Raises:
        PartError: it gave something else than what it should.
    """
    with doing(part, limit):
        answer: T = checked_answer(part, do(*args), gives)
        return answer


def deadline() -> Deadline:
    """Until when what is being done may take, for work that stops by itself; without limit else."""
    job = _job.get()
    if job is None:
        return Deadline()
    with job.lock:
        return job.doing[-1].deadline


def part_error(part: str, error: BaseException, *, world: bool = False) -> PartError:
    """What a part raised, as the error that names it."""
    if isinstance(error, ForestallError):
        return PartError(part, in_words(error), world=world)
    return PartError(part, in_words(error), internal=True, world=world)


def checked_answer(part: str, answer: Any, gives: Any, *, world: bool = False) -> Any:
    """The answer, if it is of the type that it should be.

    Raises:
        PartError: it is not.
    """
    if gives is None or isinstance(answer, gives):
        return answer
    wanted = getattr(gives, "__name__", str(gives))
    why = f"gave {type(answer).__name__} instead of {wanted}"
    raise PartError(part, why, internal=True, world=world)


def in_words(error: BaseException) -> str:
    """An error on one line; its type with it where it is none of ours."""
    try:
        text = " ".join(str(error).split())
    except Exception:  # noqa: BLE001 - an error of somebody else's that cannot even be told
        text = ""
    if len(text) > _LONGEST:
        text = f"{text[:_LONGEST]} …"
    if isinstance(error, ForestallError):
        return text
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def _serve(jobs: queue.SimpleQueue[Callable[[], None] | None]) -> None:
    """Calls one after the other, until nobody has any more."""
    try:
        while (work := jobs.get()) is not None:
            work()
            del work
    except _Cancelled:
        return


_BY_ITSELF = 0.9
"""Share of a limit after which work that asks its deadline stops: its own answer is the better."""

_STILL = "has not come back since its time ran out"
_LONGEST = 400
"""Characters of somebody else's message."""
