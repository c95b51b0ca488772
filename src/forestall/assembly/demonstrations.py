"""Recording demonstrations, and the memory of a run: a given one, or one made on first use.

Calls: command line, experiments → here → make, memory. Demonstration scenes have seeds of their own
range, which runs refuse.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import closing
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path

import forestall
from forestall.assembly.configuration import Choice, Given, RunConfig, digest_of, run_config
from forestall.assembly.make import prepare, run_episode
from forestall.assembly.parts import Assembly
from forestall.config import DEMONSTRATION_SEEDS, cache_dir
from forestall.domain.model import Domain
from forestall.embeddings.views import view_of
from forestall.errors import ForestallError
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
from forestall.memory.store import open_store
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
    """

    task: str
    first_seed: int
    given: Given = field(default_factory=Given)
    tries: int = TRIES

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
) -> list[RecordingJob]:
    """`kitchens` jobs for each task, each with seeds of its own."""
    said = given or Given()
    return [RecordingJob(task, seed + 10 * k, said) for task in tasks for k in range(kitchens)]


def record_one(job: RecordingJob) -> Demonstration:
    """Run a nominal plan in seeded scenes until one run succeeds.

    Raises:
        ForestallError: no seed of the range succeeded.
    """
    why: tuple[str, ...] = ()
    for seed in range(job.first_seed, job.first_seed + job.tries):
        config = job.config(seed)
        prepared = prepare(config)
        viewer = make_viewer(config, prepared.loaded.domain)
        record = run_episode(prepared, None)
        demonstration = demonstration_from(record, forestall.__version__, view_of=viewer)
        if demonstration is not None:
            return demonstration
        why = record.failures
    raise ForestallError(
        f"no successful run of {job.task} in seeds {job.first_seed} to "
        f"{job.first_seed + job.tries - 1}: {'; '.join(why)}"
    )


def make_viewer(config: RunConfig, domain: Domain) -> Callable[[BoundaryRecord], View | None]:
    """What keeps the pictures of a run as views: an image feature and a caption."""
    parts = Assembly(config.choices, domain)
    encoder, captioner = parts.part(IMAGE_ENCODER), parts.part(CAPTIONER)

    def view(boundary: BoundaryRecord) -> View | None:
        if not isinstance(boundary.observation, Observation) or not boundary.observation.frames:
            return None
        return view_of(boundary.observation, boundary.scoped, encoder, captioner)

    return view


def record_all(
    jobs: Sequence[RecordingJob], workers: int, progress: Progress | None = None
) -> Iterator[Demonstration]:
    """Record in the order of the jobs, whatever the number of workers is."""
    finished = 0
    if progress is not None and jobs:
        progress(0, len(jobs), jobs[0].task)

    def done(job: RecordingJob) -> None:
        nonlocal finished
        finished += 1
        if progress is not None:
            progress(finished, len(jobs), job.task)

    if workers <= 1 or len(jobs) == 1:
        for job in jobs:
            demonstration = record_one(job)
            done(job)
            yield demonstration
        return
    with ProcessPoolExecutor(min(workers, len(jobs)), mp_context=get_context("spawn")) as pool:
        futures = {pool.submit(record_one, job): job for job in jobs}
        try:
            for future in as_completed(futures):
                future.result()
                done(futures[future])
            for future in futures:
                yield future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def load_memory(config: RunConfig, workers: int | None = None) -> tuple[list[Demonstration], str]:
    """Every demonstration that a run compares with, and where they come from.

    Args:
        config: of the run; its store says which memory, the ready-made one by default.
        workers: see `ready_made`.

    Raises:
        MemoryFileError: see `memory.store`.
    """
    path = memory_path(config) or str(ready_made(config, workers=workers))
    store = config.choice(STORE)
    choice = Choice(store.kind, store.name, (*_but_path(store), ("path", path)))
    domain = config.load_domain()
    with closing(Assembly([choice], domain).part(STORE)) as opened:
        return list(opened.required()), path


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
    loaded = config.load()
    name = loaded.task.name
    parts = [(c.kind, c.name, sorted(c.options.items())) for c in config.choices]
    parts = [p for p in parts if p[0] in RECORDED]
    weights = weights_of(p[1] for p in parts)
    inputs = [loaded.task, digest_of(loaded.domain), parts, weights]
    key = sources_digest([forestall.__version__, KITCHENS_PER_TASK, TRIES, *inputs])
    path = cache_dir() / "memory" / f"{name}-{key}.db"
    if path.exists():
        return path
    own = DOMAIN.name if config.domain is None else ""
    said = {c.kind: (c.name, dict(c.given)) for c in config.choices if c.kind != own}
    jobs = jobs_for([config.task], given=_recorded(Given.of(said)))
    if announce is not None:
        announce(
            f"first use of {name}: recording {len(jobs)} demonstrations (once; kept in {path})"
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(f".{os.getpid()}.part")
    try:
        with open_store(partial, create=True) as store:
            for demonstration in record_all(jobs, workers or os.cpu_count() or 1, progress):
                store.add(demonstration)
        os.replace(partial, path)
    finally:
        for leftover in path.parent.glob(f"{partial.name}*"):
            leftover.unlink(missing_ok=True)
    return path


def _recorded(given: Given) -> Given:
    """What was said about parts that a demonstration depends on, and of its domain."""
    return Given(tuple(part for part in given.parts if part[0] in (*RECORDED, DOMAIN.name)))
