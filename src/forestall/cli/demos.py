"""`forestall demos`: record and list demonstrations; and the memory that a run uses."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import App

from forestall.cli.flags import Flag, Json, Names, SeeingFlags

if TYPE_CHECKING:
    from collections.abc import Sequence

    from forestall.assembly.configuration import RunConfig
    from forestall.types.demonstration import Demonstration


DEFAULTS = SeeingFlags()

MOST_TOLD = 12

demos = App(name="demos", help="Record and list demonstrations.")


@demos.command
def record(
    memory: Path,
    /,
    *,
    task: Names = None,
    kitchens: int | None = None,
    seed: int | None = None,
    varied: Flag = False,
    parts: SeeingFlags = DEFAULTS,
    jobs: int | None = None,
    keep_observations: Flag = False,
    quiet: Flag = False,
) -> int:
    """Run nominal plans in seeded kitchens and keep the successful runs; goes on after a kill.

    Args:
        memory: the demonstration file to add to; made when it does not exist.
        task: task names or files; all shipped tasks by default.
        kitchens: demonstrations per task; as many as the paper has by default.
        seed: first seed of the demonstration scenes.
        varied: do the tasks as people do: in other orders, with other places and tools, with
            detours and slips that are mended; the first of each task is the nominal plan.
        parts: which parts; the feature "image" keeps the look of every object.
        jobs: how many processes; all cores by default.
        keep_observations: keep pictures, depth and masks beside the memory, so that it can be
            perceived anew (about 1.5 MB a picture of 640 × 480).
        quiet: no progress bar.
    """
    from forestall.assembly.configuration import run_config
    from forestall.assembly.recording import KITCHENS_PER_TASK, jobs_for, record_into
    from forestall.cli.progress import bar
    from forestall.config import DEMONSTRATION_SEEDS
    from forestall.errors import InputError
    from forestall.memory.store import open_store
    from forestall.tasks.files import task_names
    from forestall.tasks.variation import MOST

    kitchens = KITCHENS_PER_TASK if kitchens is None else kitchens
    first = DEMONSTRATION_SEEDS if seed is None else seed
    if kitchens < 1:
        raise InputError(f"--kitchens {kitchens}: at least 1 is needed")
    if jobs is not None and jobs < 1:
        raise InputError(f"--jobs {jobs}: at least 1 is needed")
    given, names = parts.given(), task or list(task_names())
    for name in names:
        run_config(name, given=given)
    if varied and kitchens > MOST:
        raise InputError(f"--kitchens {kitchens}: at most {MOST} varied ones of a task")
    todo = jobs_for(names, kitchens, first, given, memory if keep_observations else None, varied)
    for job in todo[:1]:
        job.config(first)
    with open_store(memory, create=True) as store, bar("recording", quiet=quiet) as feed:
        count = record_into(store, todo, jobs or os.cpu_count() or 1, feed)
    there = f"; {len(todo) - count} were there" if count < len(todo) else ""
    print(f"{count} demonstrations added to {memory}{there}")
    return 0


@demos.command
def add(memory: Path, /, *sources: Path, parts: SeeingFlags = DEFAULTS) -> int:
    """Keep what shows a successful run as demonstrations; what is equal in content is kept once.

    What in a folder is read as none of these is said on standard error.

    Args:
        memory: the demonstration file to add to; made when it does not exist.
        sources: folders of `forestall run`, every one of which must have succeeded without a
            replanning, a refusal or a failure on the way; another memory; a demonstration that
            somebody wrote, or a graph with its subtask (JSON, docs/your-robot.md); or folders of
            these.
        parts: what pictures are seen with; they need --domain.
    """
    from forestall.assembly.eyes import eyes_for
    from forestall.assembly.sources import MEMORY_SUFFIXES, gathered, passed_over
    from forestall.cli.listing import warn
    from forestall.errors import InputError

    if not sources:
        raise InputError("no source was named: give the folder of at least one run, or a file")
    eyes = None if parts.domain is None else eyes_for(parts.given())
    found, there = gathered(sources, eyes)
    known = ", ".join((".json", *MEMORY_SUFFIXES))
    others = passed_over(sources)
    for other in others[:MOST_TOLD]:
        why = "no folder of a run" if other.is_dir() else f"files may be {known}"
        warn(f"left out: {other}: {why}")
    if len(others) > MOST_TOLD:
        warn(f"left out: ... and {len(others) - MOST_TOLD} more")
    return _kept(memory, found, there)


@demos.command
def perceive(
    memory: Path,
    out: Path,
    /,
    *,
    parts: SeeingFlags = DEFAULTS,
) -> int:
    """See what the demonstrations of a memory saw once more, with other eyes.

    Needs a memory that was recorded with --keep-observations. Masks are those that were kept
    unless --segmenter says otherwise, states are read off the pictures; what was seen between two
    subtasks is not kept. A demonstration in which these eyes do not see what a subtask is about is
    left out, and why is said.

    Args:
        memory: the demonstration file to read.
        out: the demonstration file to add to; made when it does not exist.
        parts: with which parts; --domain where it is not the household.
    """
    from forestall.assembly.kept import seen_anew
    from forestall.cli.listing import warn
    from forestall.memory.store import open_store

    with open_store(memory) as store:
        found, unseen = seen_anew(memory, store.required(), parts.given())
    for why in unseen:
        warn(f"left out: {why}")
    return _kept(out, found)


@demos.command
def label(
    memory: Path,
    scene: Path | None = None,
    /,
    *,
    subtask: str,
    fact: Names = None,
    task: str = "",
    domain: str | None = None,
    new: Flag = False,
) -> int:
    """Keep what somebody says should hold before a subtask.

    One label is enough for an alarm; its cause says that it is one. A word that is nearly one of
    the memory, of the scene or of the domain is taken for a slip of the pen.

    Args:
        memory: the demonstration file to add to; made when it does not exist.
        scene: a scene graph (JSON, docs/your-robot.md) as it should be.
        subtask: before which, e.g. "insert(peg-1, hole-1)".
        fact: instead of a scene, or beside it: "surface(hole-1)=clean", "held_by(peg-1, gripper)".
        task: the name of its task.
        domain: whose words it is in, by name or file; by default those of the memory.
        new: words that are nearly known ones are new ones.
    """
    from forestall.assembly.labels import KnownWords, check_label
    from forestall.assembly.sources import labelled
    from forestall.domain.load import load_domain
    from forestall.memory.store import open_store
    from forestall.types.facts import Literal
    from forestall.types.plan import Subtask

    known = KnownWords()
    if domain is not None:
        known.add_domain(load_domain(domain))
    if memory.exists() and memory.stat().st_size:
        with open_store(memory) as store:
            known.add_demonstrations(store.all())
    if scene is not None:
        known.add_graph(labelled(subtask, scene).steps[0].whole)
    check_label(Subtask.parse(subtask), list(map(Literal.parse, fact or ())), known, new=new)
    return _kept(memory, [labelled(subtask, scene, fact or (), task)])


def _kept(memory: Path, found: Sequence[Demonstration], there: int = 0) -> int:
    """Add demonstrations and say how many; `there` were left out before as there already."""
    from forestall.memory.store import open_store

    added = 0
    with open_store(memory, create=True) as store:
        for demonstration in found:
            if store.holds(demonstration):
                there += 1
                continue
            store.add(demonstration)
            added += 1
    known = f", {there} were there already" if there else ""
    print(f"{added} demonstrations added to {memory}{known}")
    return 0


@demos.command(name="list")
def list_(memory: Path | None = None, /, *, as_json: Json = False) -> int:
    """List the demonstrations of a memory.

    Args:
        memory: a demonstration file; by default every ready-made one in the cache.
        as_json: print JSON.
    """
    from forestall.config import cache_dir
    from forestall.memory.store import open_store

    paths = [memory] if memory else sorted((cache_dir() / "memory").glob("*.db"))
    rows: list[dict[str, Any]] = []
    for path in paths:
        with open_store(path) as store:
            for d in store.all():
                row = {"id": d.id, "task": d.task, "scene": d.scene, "steps": len(d.steps)}
                rows.append({"memory": str(path), **row, **dict(d.perception)})
    if as_json:
        print(json.dumps(rows, indent=2))
        return 0
    from forestall.cli.listing import print_table

    print_table(
        ("id", "task", "scene", "steps", "states from", "memory"),
        [
            (
                r["id"],
                r["task"],
                r["scene"],
                str(r["steps"]),
                r.get("state_estimator", ""),
                r["memory"],
            )
            for r in rows
        ],
    )
    return 0


def memory_of(config: RunConfig, quiet: bool) -> tuple[list[Demonstration], str]:
    """Every demonstration that a run compares with, and where they come from.

    Args:
        config: of the run.
        quiet: no progress on standard error.

    Raises:
        MemoryFileError: see `memory.store`.
    """
    from forestall.assembly.demonstrations import load_memory, memory_path, ready_made
    from forestall.cli.progress import bar
    from forestall.errors import MemoryFileError

    def announce(text: str) -> None:
        print(f"forestall: {text}", file=sys.stderr)

    if memory_path(config) is None:
        with bar("recording", quiet=quiet) as feed:
            ready_made(config, announce, feed)
    try:
        return load_memory(config)
    except MemoryFileError as error:
        path = memory_path(config)
        if path is None or not config.task or Path(path).exists():
            raise
        own = "" if config.domain is None else f" --domain {config.domain}"
        how = f"'forestall demos record {path} --task {config.task}{own}'"
        raise MemoryFileError(f"{error}, or record the task's own with {how}") from error
