"""Recording demonstrations, and the memory of a run: a given one, or one made on first use.

Calls: command line, experiments → here → make, memory. Demonstration scenes have seeds of their own
range, which runs refuse.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import forestall
from forestall.assembly.configuration import Choice, Given, RunConfig, digest_of, run_config
from forestall.assembly.kept import KeptObservations
from forestall.assembly.make import Prepared, prepare, run_episode
from forestall.assembly.parts import Assembly
from forestall.config import DEMONSTRATION_SEEDS, cache_dir
from forestall.domain.model import Domain
from forestall.embeddings.views import view_of
from forestall.errors import ForestallError, MemoryFileError
from forestall.files import alone
from forestall.fingerprint import sources_digest, weights_of
from forestall.kinds import (
    CAPTIONER,
    DOMAIN,
    IMAGE_ENCODER,
    PERCEIVER,
    SEGMENTER,
    STATES,
    STORE,
    WORLD,
)
from forestall.memory.recording import demonstration_from
from forestall.memory.store import SqliteStore, open_store
from forestall.processes import pool
from forestall.tasks.files import LoadedTask, Scenario
from forestall.tasks.variation import room_fixtures, vary
from forestall.types.demonstration import Demonstration, View
from forestall.types.episode import BoundaryRecord
from forestall.types.observation import Observation

KITCHENS_PER_TASK = 4
"""Successful demonstrations per task (paper, Sec. 4 "Experimental Pipeline")."""

TRIES = 5
"""Seeds that one demonstration may take until a run succeeds."""

RECORDED = tuple(k.name for k in (WORLD, SEGMENTER, STATES, PERCEIVER, IMAGE_ENCODER, CAPTIONER))
"""The kinds of parts that a demonstration depends on."""

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True, slots=True)
class RecordingJob:
    """One demonstration to record: the first succeeding seed of a range of its own.

    Args:
        task: name or file.
        first_seed: of the range.
        given: what was said about the parts; only `RECORDED` ones and the domain count.
        tries: length of the range.
        keep: the memory beside which all that is seen is kept; None: it is not.
        variant: which way to do the task, see `variation.vary`; 0 is the nominal plan.
    """

    task: str
    first_seed: int
    given: Given = field(default_factory=Given)
    tries: int = TRIES
    keep: Path | None = None
    variant: int = 0

    def config(self, seed: int) -> RunConfig:
        """The nominal run of one seed, with all that a demonstration keeps."""
        return run_config(
            self.task,
            seed=seed,
            keep_observations=True,
            final_look=True,
            given=_recorded(self.given),
            strategy="none",
        )


def jobs_for(
    tasks: Sequence[str],
    kitchens: int = KITCHENS_PER_TASK,
    seed: int = DEMONSTRATION_SEEDS,
    given: Given | None = None,
    keep: Path | None = None,
    varied: bool = False,
) -> list[RecordingJob]:
    """`kitchens` jobs for each task, each with seeds of its own; `varied`: as people do them."""
    said = given or Given()
    return [
        RecordingJob(task, seed + 10 * k, said, keep=keep, variant=k if varied else 0)
        for task in tasks
        for k in range(kitchens)
    ]


def record_one(job: RecordingJob) -> Demonstration:
    """Run a nominal plan in seeded scenes until one run succeeds.

    Raises:
        ForestallError: no seed of the range succeeded.
    """
    why: tuple[str, ...] = ()
    for seed in range(job.first_seed, job.first_seed + job.tries):
        config = job.config(seed)
        prepared = as_people_do(prepare(config), job.variant)
        viewer = make_viewer(config, prepared.loaded.domain)
        record = run_episode(prepared, None)
        keep = None if job.keep is None else KeptObservations(job.keep).keep
        demonstration = demonstration_from(record, forestall.__version__, view_of=viewer, keep=keep)
        if demonstration is not None:
            return demonstration
        why = record.failures
    raise ForestallError(
        f"no successful run of {job.task} in seeds {job.first_seed} to "
        f"{job.first_seed + job.tries - 1}: {'; '.join(why)}"
    )


def as_people_do(prepared: Prepared, variant: int) -> Prepared:
    """A run of another way to do its task, slips included; the same run for variant 0."""
    if not variant:
        return prepared
    loaded = prepared.loaded
    way = vary(loaded.task, loaded.domain, variant, fixtures=room_fixtures(loaded))
    task = replace(loaded.task, plan=way.plan, scene=way.scene)
    slips = Scenario("slips", task.name, "", "slips", "; ".join(way.varied), way.slips)
    scenario = slips if way.slips else None
    return replace(prepared, loaded=LoadedTask(task, loaded.domain), scenario=scenario)


def make_viewer(config: RunConfig, domain: Domain) -> Callable[[BoundaryRecord], View | None]:
    """What keeps the pictures of a run as views: an image feature and a caption."""
    parts = Assembly(config.choices, domain)
    encoder, captioner = parts.part(IMAGE_ENCODER), parts.part(CAPTIONER)

    def view(boundary: BoundaryRecord) -> View | None:
        if not isinstance(boundary.observation, Observation) or not boundary.observation.frames:
            return None
        return view_of(boundary.observation, boundary.scoped, encoder, captioner)

    return view


def record_into(
    store: SqliteStore,
    jobs: Sequence[RecordingJob],
    workers: int,
    progress: Progress | None = None,
) -> int:
    """Record what a memory does not hold yet; each demonstration is kept as soon as it is made.

    Killed at any moment, the same call goes on with what is left. Several processes may fill one
    memory: what one of them has recorded the others leave out. The order in which demonstrations
    come changes nothing.

    Args:
        store: where to.
        jobs: what is wanted.
        workers: how many processes.
        progress: told (done, total, what).

    Returns:
        How many were recorded now.

    Raises:
        ForestallError: a run that does not succeed, or a process that died.
    """
    wanted = keyed(jobs)
    left = deque(key for key in wanted if key not in store.recorded())
    found, tell = len(wanted) - len(left), progress or (lambda done, total, what: None)
    added = 0
    if left:
        tell(found, len(wanted), wanted[left[0]].task)
    for key, demonstration in _recorded_now(wanted, left, workers, store):
        store.add(demonstration, key)
        added += 1
        tell(found + added, len(wanted), wanted[key].task)
    return added


def _recorded_now(
    wanted: Mapping[str, RecordingJob], left: deque[str], workers: int, store: SqliteStore
) -> Iterator[tuple[str, Demonstration]]:
    """What nobody has recorded when its turn comes, as it comes."""
    if workers <= 1 or len(left) <= 1:
        for key in left:
            if key not in store.recorded():
                yield key, record_one(wanted[key])
        return
    running: dict[Future[Demonstration], str] = {}
    with pool(min(workers, len(left))) as hands:
        try:
            while left or running:
                while left and len(running) < workers:
                    key = left.popleft()
                    if key not in store.recorded():
                        running[hands.submit(record_one, wanted[key])] = key
                ended, _ = wait(running, return_when=FIRST_COMPLETED)
                for future in sorted(ended, key=lambda f: f.exception() is not None):
                    yield running.pop(future), future.result()  # what succeeded is kept first
        except BrokenProcessPool as error:
            raise ForestallError(
                "a process that recorded has died (killed, or out of memory): what was finished "
                "is kept; run the same command again to go on"
            ) from error
        except BaseException:
            hands.shutdown(wait=False, cancel_futures=True)
            raise


def keyed(jobs: Sequence[RecordingJob]) -> dict[str, RecordingJob]:
    """Jobs by what they come to: the sources, the task, the parts, the seeds."""
    digests: dict[str, str] = {}
    found = {}
    for job in jobs:
        said = repr((job.task, job.given))
        if said not in digests:
            digests[said] = _content(job.config(job.first_seed))
        way = f" variant {job.variant}" if job.variant else ""
        kept = "" if job.keep is None else " with observations"
        found[f"{digests[said]} {job.first_seed} {job.tries}{way}{kept}"] = job
    return found


def _content(config: RunConfig) -> str:
    """A digest of everything that a recording could depend on, its seeds apart."""
    loaded = config.load()
    parts = [(c.kind, c.name, sorted(c.options.items())) for c in config.choices]
    parts = [p for p in parts if p[0] in RECORDED]
    weights = weights_of(p[1] for p in parts)
    inputs = [loaded.task, digest_of(loaded.domain), parts, weights]
    return sources_digest([forestall.__version__, KITCHENS_PER_TASK, TRIES, *inputs])


def load_memory(config: RunConfig, workers: int | None = None) -> tuple[list[Demonstration], str]:
    """Every demonstration that a run compares with, and where they come from.

    Args:
        config: of the run; its store says which memory, the ready-made one by default.
        workers: see `ready_made`.

    Raises:
        MemoryFileError: see `memory.store`.
    """
    given = memory_path(config)
    path = given or str(ready_made(config, workers=workers))
    try:
        return _demonstrations(config, path), path
    except MemoryFileError:
        if given is not None:
            raise
    discard(Path(path))  # damaged deep inside, and can be made again
    return _demonstrations(config, str(ready_made(config, workers=workers))), path


def _demonstrations(config: RunConfig, path: str) -> list[Demonstration]:
    store = config.choice(STORE)
    choice = Choice(store.kind, store.name, (*_but_path(store), ("path", path)))
    domain = config.load_domain()
    with closing(Assembly([choice], domain).part(STORE)) as opened:
        return list(opened.required())


def memory_path(config: RunConfig) -> str | None:
    """The memory that was asked for, None for the ready-made one."""
    path = config.choice(STORE).options.get("path")
    return None if path is None else str(path)


def _but_path(store: Choice) -> tuple[tuple[str, object], ...]:
    return tuple((name, value) for name, value in store.given if name != "path")


def ready_made(
    config: RunConfig,
    announce: Callable[[str], None] | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
) -> Path:
    """The path of a task's ready-made memory, made now if it is not in the cache.

    It holds this task's demonstrations only, so that a first run starts soon and does not depend
    on which other tasks were run before; `forestall demos record` makes larger ones. It is keyed
    by everything that it could depend on: the sources (command line and pages apart), the task and
    the content of its domain, the parts that it is recorded with.

    Args:
        config: of a run that wants it.
        announce: told once, in words, when something has to be made.
        progress: told (done, total, what).
        workers: processes; all cores by default.
    """
    name = config.load().task.name
    path = cache_dir() / "memory" / f"{name}-{_content(config)}.db"
    own = DOMAIN.name if config.domain is None else ""
    said = {c.kind: (c.name, dict(c.given)) for c in config.choices if c.kind != own}
    jobs = jobs_for([config.task], given=_recorded(Given.of(said)))
    wanted = frozenset(keyed(jobs))
    if _complete(path, wanted):
        return path
    tell = announce or (lambda text: None)
    with _kept_alone(path, lambda who: tell(f"{name}: waiting for {who}, which records it")):
        if _complete(path, wanted):
            return path
        discard(path)  # damaged or empty
        tell(f"first use of {name}: recording {len(jobs)} demonstrations (once; kept in {path})")
        partial = path.with_suffix(".part")
        if not _opens(partial):
            discard(partial)
        with open_store(partial, create=True) as store:
            record_into(store, jobs, workers or os.cpu_count() or 1, progress)
        if partial.with_name(partial.name + "-wal").exists():
            raise MemoryFileError(f"memory {partial} could not be finished: run it again")
        os.replace(partial, path)
    return path


@contextmanager
def _kept_alone(path: Path, waits: Callable[[str], None]) -> Iterator[None]:
    """Nobody else makes this memory meanwhile; a cache that cannot be written is said."""
    with ExitStack() as held:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            held.enter_context(alone(path.parent, path.stem, waits))
        except OSError as error:
            raise MemoryFileError(
                f"the cache {path.parent} cannot be written ({error.strerror}): set "
                "FORESTALL_CACHE to a folder that can, or name a memory with --memory"
            ) from error
        yield


def _complete(path: Path, wanted: frozenset[str]) -> bool:
    """Whether a ready-made memory is there and whole."""
    if not path.exists():
        return False
    try:
        with open_store(path) as store:
            return wanted <= store.recorded()
    except MemoryFileError:
        return False


def _opens(path: Path) -> bool:
    try:
        with open_store(path, create=True):
            return True
    except MemoryFileError:
        return False


def discard(path: Path) -> None:
    """Take a memory that can be made again out of the way."""
    for ending in ("", "-wal", "-shm"):
        path.with_name(path.name + ending).unlink(missing_ok=True)


def _recorded(given: Given) -> Given:
    """What was said about parts that a demonstration depends on, and of its domain."""
    return Given(tuple(part for part in given.parts if part[0] in (*RECORDED, DOMAIN.name)))
