"""The memory of a run: a given one, or one made on first use.

Calls: command line, experiments → here → recording, memory.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

from forestall.assembly.configuration import Choice, Given, RunConfig
from forestall.assembly.parts import Assembly
from forestall.assembly.recording import (
    KITCHENS_PER_TASK,
    Progress,
    RecordingJob,
    content_of,
    jobs_for,
    keyed,
    record_into,
    recorded_given,
)
from forestall.config import cache_dir
from forestall.errors import MemoryFileError
from forestall.files import alone
from forestall.kinds import (
    DOMAIN,
    STORE,
)
from forestall.memory.store import open_store
from forestall.types.demonstration import Demonstration


def load_memory(
    config: RunConfig,
    workers: int | None = None,
    varied: int = 0,
    second: Given | None = None,
) -> tuple[list[Demonstration], str]:
    """Every demonstration that a run compares with, and where they come from.

    Args:
        config: of the run; its store says which memory, the ready-made one by default.
        workers: see `ready_made`.
        varied: see `ready_made`.
        second: see `ready_made`.

    Raises:
        MemoryFileError: see `memory.store`.
    """
    given = memory_path(config)
    path = given or str(ready_made(config, workers=workers, varied=varied, second=second))
    try:
        return _demonstrations(config, path), path
    except MemoryFileError:
        if given is not None:
            raise
    discard(Path(path))  # damaged deep inside, and can be made again
    return _demonstrations(
        config, str(ready_made(config, workers=workers, varied=varied, second=second))
    ), path


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
    varied: int = 0,
    second: Given | None = None,
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
        varied: so many demonstrations, each another way to do the task; by default the nominal
            plan in `KITCHENS_PER_TASK` kitchens.
        second: what is said besides of every second one, see `recording.jobs_for`.
    """
    name = config.load().task.name
    path, jobs = _place(config, varied, second)
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


def to_record(config: RunConfig, varied: int = 0, second: Given | None = None) -> int:
    """How many demonstrations `ready_made` would have to record."""
    path, jobs = _place(config, varied, second)
    return 0 if _complete(path, frozenset(keyed(jobs))) else len(jobs)


def _place(config: RunConfig, varied: int, second: Given | None) -> tuple[Path, list[RecordingJob]]:
    """Where a ready-made memory lies, and what is recorded into it."""
    kitchens = varied or KITCHENS_PER_TASK
    ways = f"-{varied}-ways" if varied else ""
    ways += "-in-two" if second is not None else ""
    name = f"{config.load().task.name}-{content_of(config)}{ways}.db"
    own = DOMAIN.name if config.domain is None else ""
    said = {c.kind: (c.name, dict(c.given)) for c in config.choices if c.kind != own}
    given = recorded_given(Given.of(said))
    jobs = jobs_for([config.task], kitchens, given=given, varied=varied > 0, second=second)
    return cache_dir() / "memory" / name, jobs


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
