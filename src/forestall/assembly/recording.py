"""Recording demonstrations: successful runs of seeded scenes, a process for each at once.

Called by `demonstrations` and the command line; calls make, memory, tasks. Demonstration scenes
have seeds of their own range, which runs refuse.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field, replace
from pathlib import Path

import forestall
from forestall.assembly.configuration import Given, RunConfig, digest_of, run_config
from forestall.assembly.kept import KeptObservations
from forestall.assembly.make import Prepared, make_world, prepare, run_episode
from forestall.assembly.parts import Assembly
from forestall.config import DEMONSTRATION_SEEDS
from forestall.domain.model import Domain
from forestall.embeddings.views import view_of
from forestall.errors import ForestallError
from forestall.fingerprint import JUDGING, sources_digest, weights_of
from forestall.kinds import (
    CAPTIONER,
    DOMAIN,
    FINDER,
    IMAGE_ENCODER,
    OUTLINER,
    PERCEIVER,
    SEGMENTER,
    STATES,
    WORLD,
)
from forestall.memory.recording import demonstration_from
from forestall.memory.store import SqliteStore
from forestall.processes import pool
from forestall.tasks.files import LoadedTask, Scenario
from forestall.tasks.judging import play
from forestall.tasks.variation import room_fixtures, vary
from forestall.types.demonstration import Demonstration, View
from forestall.types.episode import BoundaryRecord
from forestall.types.observation import Observation

KITCHENS_PER_TASK = 4
"""Successful demonstrations per task (paper, Sec. 4 "Experimental Pipeline")."""

TRIES = 10
"""Seeds that one demonstration may take until a run succeeds."""

VARIED_TRIES = 100
"""The same where it is done as people do, slips included."""

RECORDED = tuple(
    k.name
    for k in (WORLD, SEGMENTER, FINDER, OUTLINER, STATES, PERCEIVER, IMAGE_ENCODER, CAPTIONER)
)
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
            given=recorded_given(self.given),
            strategy="none",
        )


def jobs_for(
    tasks: Sequence[str],
    kitchens: int = KITCHENS_PER_TASK,
    seed: int = DEMONSTRATION_SEEDS,
    given: Given | None = None,
    keep: Path | None = None,
    varied: bool = False,
    second: Given | None = None,
) -> list[RecordingJob]:
    """`kitchens` jobs for each task, each with seeds of its own.

    Args:
        tasks: names or files.
        kitchens: how many of each.
        seed: the first one.
        given: what was said about the parts.
        keep: see `RecordingJob`.
        varied: whether each is another way to do the task, as people do them.
        second: what is said besides of every second one, such as rooms of another kind.
    """
    said = given or Given()
    other = said if second is None else second.over(said)
    return [
        RecordingJob(
            task,
            seed + k * (VARIED_TRIES if varied else TRIES),
            other if k % 2 else said,
            tries=VARIED_TRIES if varied and k else TRIES,
            keep=keep,
            variant=k if varied else 0,
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
        config = job.config(seed)
        prepared = as_people_do(prepare(config), job.variant)
        first = seed == job.first_seed and not job.variant
        if not first and (why := _failures_of(prepared)):
            continue
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


def _failures_of(prepared: Prepared) -> tuple[str, ...]:
    """What goes wrong when the same is done without a picture: a try that costs next to nothing."""
    loaded = prepared.loaded
    world = make_world(prepared.config, loaded.domain)
    played = play(world, loaded, prepared.scenario, prepared.config.seed)
    if played.success and not played.refused:
        return ()
    return (*played.failures, *(why for _, why in played.refused), played.problem)


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

    def view(boundary: BoundaryRecord) -> View | None:
        if not isinstance(boundary.observation, Observation) or not boundary.observation.frames:
            return None
        encoder, captioner = parts.part(IMAGE_ENCODER), parts.part(CAPTIONER)
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
    for job in {wanted[key].task: wanted[key] for key in left}.values():
        prepare(job.config(job.first_seed))  # what cannot be run at all is said here, at once
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
        except BaseException:  # an interrupt, too, ends what is still waiting
            hands.shutdown(wait=False, cancel_futures=True)
            raise


def keyed(jobs: Sequence[RecordingJob]) -> dict[str, RecordingJob]:
    """Jobs by what they come to: the sources, the task, the parts, the seeds."""
    digests: dict[str, str] = {}
    found = {}
    for job in jobs:
        said = repr((job.task, job.given))
        if said not in digests:
            digests[said] = content_of(job.config(job.first_seed))
        way = f" variant {job.variant}" if job.variant else ""
        kept = "" if job.keep is None else " with observations"
        found[f"{digests[said]} {job.first_seed} {job.tries}{way}{kept}"] = job
    return found


def content_of(config: RunConfig) -> str:
    """A digest of everything that a recording could depend on, its seeds apart."""
    loaded = config.load()
    parts = [(c.kind, c.name, sorted(c.options.items())) for c in config.choices]
    parts = [p for p in parts if p[0] in RECORDED]
    weights = weights_of(p[1] for p in parts)
    inputs = [loaded.task, digest_of(loaded.domain), parts, weights]
    said = [forestall.__version__, KITCHENS_PER_TASK, TRIES, *inputs]
    return sources_digest(said, without=JUDGING)


def recorded_given(given: Given) -> Given:
    """What was said about parts that a demonstration depends on, and of its domain."""
    return Given(tuple(part for part in given.parts if part[0] in (*RECORDED, DOMAIN.name)))
