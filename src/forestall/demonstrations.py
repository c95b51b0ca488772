"""Recording demonstrations, and the ready-made memories that are made on first use.

Calls: command line → here → build, memory. Demonstration scenes have seeds of their own range,
which runs and surveys refuse.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import forestall
from forestall.build import STATES, RunConfig, prepare, run_episode
from forestall.config import DEMONSTRATION_SEEDS, cache_dir
from forestall.errors import ForestallError
from forestall.fingerprint import sources_digest
from forestall.memory.recording import demonstration_from
from forestall.memory.store import open_store
from forestall.parts import make_viewer
from forestall.tasks.files import load_task
from forestall.types.demonstration import Demonstration

KITCHENS_PER_TASK = 4
"""Successful demonstrations per task (paper, Sec. 4 "Experimental Pipeline")."""

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True, slots=True)
class RecordingJob:
    """One demonstration to record: the first succeeding seed of a range of its own.

    `image_encoder` and `captioner` make the views of its pictures.
    """

    task: str
    first_seed: int
    tries: int = 5
    states: str = STATES
    renderer: str = "auto"
    feature: str = "parts"
    image_encoder: str = "two-tower"
    captioner: str = "listing"


def jobs_for(
    tasks: Sequence[str],
    kitchens: int,
    seed: int = DEMONSTRATION_SEEDS,
    states: str = STATES,
    feature: str = "parts",
    image_encoder: str = "two-tower",
    captioner: str = "listing",
) -> list[RecordingJob]:
    """`kitchens` jobs for each task, each with `RecordingJob.tries` seeds of its own."""
    return [
        RecordingJob(
            task,
            seed + 10 * k,
            states=states,
            feature=feature,
            image_encoder=image_encoder,
            captioner=captioner,
        )
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
        config = RunConfig(
            job.task,
            strategy="none",
            seed=seed,
            states=job.states,
            renderer=job.renderer,
            feature=job.feature,
            image_encoder=job.image_encoder,
            captioner=job.captioner,
            keep_observations=True,
            final_look=True,
        )
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


def ready_made(
    task: str,
    states: str = STATES,
    announce: Callable[[str], None] | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
    feature: str = "parts",
    image_encoder: str = "two-tower",
    captioner: str = "listing",
) -> Path:
    """The path of a task's ready-made memory, made now if it is not in the cache.

    It holds this task's demonstrations only, so that a first run starts soon and does not depend
    on which other tasks were run before; `forestall demos record` makes larger ones. It is keyed
    by everything that it could depend on: the sources (command line and pages apart), the task,
    where states come from.

    Args:
        task: name or file.
        states: where object states come from.
        announce: told once, in words, when something has to be made.
        progress: told (done, total, what).
        workers: processes; all cores by default.
        feature: of nodes; pictures of them are kept where it is "image".
        image_encoder: of pictures as a whole, for image-level comparison.
        captioner: of pictures, for caption-based comparison.
    """
    name = load_task(task).task.name
    key = _key(task, states, feature, image_encoder, captioner)
    path = cache_dir() / "memory" / f"{name}-{key}.db"
    if path.exists():
        return path
    jobs = jobs_for(
        [task],
        KITCHENS_PER_TASK,
        states=states,
        feature=feature,
        image_encoder=image_encoder,
        captioner=captioner,
    )
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


def _key(task: str, states: str, feature: str, image_encoder: str, captioner: str) -> str:
    parts = [forestall.__version__, states, feature, KITCHENS_PER_TASK, repr(load_task(task))]
    parts += [image_encoder, captioner]
    if "clip" in (states, image_encoder):
        parts.append(os.environ.get("FORESTALL_CLIP"))
    if captioner == "blip":
        parts.append(os.environ.get("FORESTALL_BLIP"))
    return sources_digest(parts)
