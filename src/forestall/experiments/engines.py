"""Where episodes are computed: processes of this machine, workers of a Ray cluster, or right here.

Called by `conduct`. Work comes in groups of jobs that share a scene; a group stays with one worker,
which remembers what it drew. A worker that dies is replaced, its job is tried once more, and a
second death is handed back as the answer to that job alone.
"""

from __future__ import annotations

import importlib.util
import logging
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from typing import Any, Generic, Protocol, TypeVar

from forestall.errors import InputError, UnknownNameError
from forestall.processes import pool

Job = TypeVar("Job")
Answer = TypeVar("Answer")

ENGINES = ("inline", "local", "ray")


class WorkerDiedError(Exception):
    """The process that computed an episode ended twice without an answer."""


class Lane(Protocol):
    """One worker with one job at a time."""

    def submit(self, function: Callable[[Any], Any], job: Any) -> Future[Any]:
        """Start a job."""

    def renew(self) -> None:
        """Replace a worker that died."""

    def close(self) -> None:
        """End the worker; a job under way is given up."""

    def died(self, error: BaseException) -> bool:
        """Whether an error means that the worker is gone."""


class LocalLane:
    """A process of its own, which ends with this one."""

    def __init__(self) -> None:
        self._pool = self._started()

    def submit(self, function: Callable[[Any], Any], job: Any) -> Future[Any]:
        """Start a job."""
        return self._pool.submit(function, job)

    def renew(self) -> None:
        """Replace the process."""
        self.close()
        self._pool = self._started()

    def close(self) -> None:
        """End the process."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    def died(self, error: BaseException) -> bool:
        """A broken pool is a dead process."""
        return isinstance(error, BrokenProcessPool)

    @staticmethod
    def _started() -> ProcessPoolExecutor:
        return pool(1)


class InlineLane:
    """This very process: for a debugger, and for work that is done sooner than a process starts."""

    def submit(self, function: Callable[[Any], Any], job: Any) -> Future[Any]:
        """Do the job at once."""
        future: Future[Any] = Future()
        try:
            future.set_result(function(job))
        except Exception as error:  # noqa: BLE001 - handed on by the future, as of other lanes
            future.set_exception(error)
        return future

    def renew(self) -> None:
        """Nothing died."""

    def close(self) -> None:
        """Nothing is under way."""

    def died(self, error: BaseException) -> bool:
        """Never: the process would be gone."""
        return False


class RayLane:
    """An actor on a Ray cluster; `ray` is the module."""

    def __init__(self, ray: Any) -> None:
        self._ray = ray
        self._actor = self._started()

    def submit(self, function: Callable[[Any], Any], job: Any) -> Future[Any]:
        """Start a job."""
        future: Future[Any] = self._actor.call.remote(function, job).future()
        return future

    def renew(self) -> None:
        """Start another actor."""
        self._actor = self._started()

    def close(self) -> None:
        """End the actor."""
        self._ray.kill(self._actor)

    def died(self, error: BaseException) -> bool:
        """Ray tells a dead actor by an error of its own."""
        return isinstance(error, self._ray.exceptions.RayActorError)

    def _started(self) -> Any:
        class Worker:
            def call(self, function: Callable[[Any], Any], job: Any) -> Any:
                return function(job)

        return self._ray.remote(num_cpus=1)(Worker).remote()


def check_engine(engine: str) -> None:
    """See that an engine is there.

    Raises:
        UnknownNameError: no such engine.
        InputError: Ray is not installed.
    """
    if engine not in ENGINES:
        raise UnknownNameError("engine", engine, ENGINES)
    if engine == "ray" and importlib.util.find_spec("ray") is None:
        raise InputError("the engine 'ray' needs Ray: pip install 'forestall[cluster]'")


def make_lanes(engine: str, workers: int, address: str | None = None) -> list[Lane]:
    """Workers of an engine.

    Args:
        engine: one of `ENGINES`.
        workers: how many.
        address: of a running Ray cluster; a local one is started by default.

    Raises:
        UnknownNameError: no such engine.
        InputError: Ray is not installed, or its cluster is not to be reached.
    """
    check_engine(engine)
    if engine == "inline":
        return [InlineLane()]
    if engine == "local":
        return [LocalLane() for _ in range(workers)]
    import ray

    if not ray.is_initialized():
        try:
            own: dict[str, Any] = {"num_cpus": workers, "include_dashboard": False}
            options = own if address is None else {"address": address}
            ray.init(log_to_driver=False, logging_level=logging.ERROR, **options)
        except (ConnectionError, ValueError, RuntimeError) as error:
            raise InputError(f"no Ray cluster at {address or 'this machine'}: {error}") from error
    return [RayLane(ray) for _ in range(workers)]


@dataclass(slots=True)
class _Worker(Generic[Job]):
    lane: Lane
    jobs: deque[Job] = field(default_factory=deque)
    tries: int = 0


def computed(
    groups: Sequence[Sequence[Job]],
    lanes: Sequence[Lane],
    function: Callable[[Job], Answer],
    spared: Callable[[Job], Answer | None] = lambda job: None,
) -> Iterator[tuple[Job, Answer | WorkerDiedError]]:
    """Every job with its answer, as they come.

    Args:
        groups: jobs that one worker does one after the other.
        lanes: the workers; closed at the end.
        function: what a worker calls; importable by name, its argument and answer picklable.
        spared: asked here before a job is given away: its answer, if it need not be computed.
    """
    waiting = deque(deque(g) for g in groups)
    active: dict[Future[Answer], _Worker[Job]] = {}
    idle = [_Worker[Job](lane) for lane in lanes]
    try:
        while True:
            for worker in idle:
                yield from _taken(worker, waiting, spared)
                if worker.jobs:
                    active[_submitted(worker.lane, function, worker.jobs[0])] = worker
            if not active:
                return
            done, _ = wait(active, return_when=FIRST_COMPLETED)
            idle = []
            for future in done:
                worker = active.pop(future)
                error = future.exception()
                if error is None:
                    yield worker.jobs.popleft(), future.result()
                elif not worker.lane.died(error):
                    raise error
                else:
                    worker.lane.renew()
                    worker.tries += 1
                    if worker.tries == 2:
                        died = WorkerDiedError(f"the worker died twice on this episode: {error}")
                        yield worker.jobs.popleft(), died
                worker.tries = worker.tries % 2 if error is not None else 0
                idle.append(worker)
    finally:
        for lane in lanes:
            lane.close()


def _submitted(lane: Lane, function: Callable[[Any], Any], job: Any) -> Future[Any]:
    """Start a job; a worker that died while it had none is replaced."""
    try:
        return lane.submit(function, job)
    except Exception as error:  # only the lane knows how a dead worker shows
        if not lane.died(error):
            raise
        lane.renew()
        return lane.submit(function, job)


def _taken(
    worker: _Worker[Job],
    waiting: deque[deque[Job]],
    spared: Callable[[Job], Answer | None],
) -> Iterator[tuple[Job, Answer]]:
    """Give an idle worker a next job that must be computed; hands out those that need not be."""
    while worker.jobs or waiting:
        if not worker.jobs:
            worker.jobs = waiting.popleft()
            continue
        known = spared(worker.jobs[0])
        if known is None:
            return
        yield worker.jobs.popleft(), known
