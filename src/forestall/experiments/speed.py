"""`forestall bench speed`: timings of the parts on this machine.

A case of the experiment runner: each group of timings is one job for a worker and one line of a
folder, so that a measurement can be taken up again. Calls: command line → here → engines, assembly
and the timing helpers of each part. Numbers are wall-clock times of one worker; quote medians, and
ratios rather than single values.
"""

from __future__ import annotations

import os
import platform
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from forestall.assembly.configuration import Given, run_config
from forestall.assembly.demonstrations import load_memory
from forestall.assembly.make import make_world, prepare, run_episode
from forestall.assembly.parts import Assembly
from forestall.comparison.timing import score_times
from forestall.domain.model import Domain
from forestall.errors import ForestallError
from forestall.experiments import yard
from forestall.experiments.boundary_speed import boundary_times
from forestall.experiments.conduct import Progress
from forestall.experiments.engines import WorkerDiedError, computed, make_lanes
from forestall.experiments.folder import About, ResultsFolder
from forestall.files import replace_file
from forestall.kinds import PERCEIVER, REPLANNER, SEGMENTER
from forestall.planning.planner import plan_goal
from forestall.reading.fields import Field
from forestall.seams.acting import OpenWorld
from forestall.seams.judging import Replanner
from forestall.statistics.cells import Table
from forestall.tasks.files import LoadedTask, load_task
from forestall.types.episode import EpisodeRecord
from forestall.types.plan import Subtask
from forestall.types.runtime import BoundaryContext
from forestall.types.verdict import Diagnosis, ReplanOutcome

KIND = "speed"

TASK = "heat-potato"
"""What is timed."""

GROUPS = ("pictures and graphs", "comparisons", "boundaries", "plans", "episodes")
"""What is timed together, in this order."""

THINGS = 200
"""In the yard in which is planned."""

_STATELESS = Given.named({"states": "given"})
"""States that come with the masks, of which these have none."""

STORED = 1000
"""Demonstrations in the memory against which a boundary is judged."""

REPEAT = 10
"""How often each is timed when nothing is said."""


@dataclass(frozen=True, slots=True)
class Timing:
    """A group of timings to be taken.

    Args:
        group: one of `GROUPS`.
        repeat: how often each part is timed.
        seed: of the scene.
    """

    group: str
    repeat: int
    seed: int


@dataclass(frozen=True, slots=True)
class Timed:
    """A group of timings: each has what, unit, median, least, most, n, aim."""

    key: str
    rows: tuple[dict[str, Any], ...]
    machine: dict[str, Any]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self)

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Timed:
        """Read what `to_json` wrote.

        Raises:
            FileFormatError: fields that do not fit.
        """
        field = Field(data)
        return cls(
            field["key"].text(),
            field["rows"].tuple_of(_row_from),
            dict(field["machine"].pairs(lambda f: f.value)),
        )


def _row_from(field: Field) -> dict[str, Any]:
    for name in ("what", "unit"):
        field[name].text()
    for name in ("median", "least", "most"):
        field[name].number()
    field.maybe("aim", Field.number)
    return dict(field.pairs(lambda f: f.value))


def measure(repeat: int, seed: int, out: Path, progress: Progress) -> dict[str, Any]:
    """Take the timings that the folder does not hold yet; all of them, and the machine.

    Args:
        repeat: how often each part is timed.
        seed: of the scene.
        out: folder of the results; the table lies in it as `speed.csv`.
        progress: told (done, total, what).

    Raises:
        InputError: a folder of something else.
    """
    folder = ResultsFolder(out, Timed.from_json, KIND)
    what = {"repeat": repeat, "seed": seed, "machine": _machine()}
    with folder.alone():
        found = folder.open(About.now(KIND, what))
        todo = [Timing(group, repeat, seed) for group in GROUPS if group not in found]
        progress(len(found), len(GROUPS), todo[0].group if todo else "done")
        with folder.writing() as lines:
            for job, answer in computed([todo], make_lanes("local", 1), take):
                if isinstance(answer, WorkerDiedError):
                    raise ForestallError(f"{job.group} cannot be timed: {answer}")
                found[job.group] = answer
                folder.add(lines, answer)
                progress(len(found), len(GROUPS), job.group)
    rows = [row for group in GROUPS for row in found[group].rows]
    report = {"machine": _machine(), "seed": seed, "repeat": repeat, "rows": rows}
    replace_file(out / f"{KIND}.csv", table(report).csv().encode())
    return report


def table(report: dict[str, Any]) -> Table:
    """What `measure` found, with each median over its aim."""
    machine = report["machine"]
    return Table(
        KIND,
        "Speed",
        ("what", "median", "least", "most", "unit", "aim", "median / aim"),
        tuple(_cells(row) for row in report["rows"]),
        f"{machine['processor']}, {machine['cores']} cores, {machine['platform']}",
    )


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    aim = row["aim"]
    return (
        row["what"],
        *(f"{row[name]:.2f}" for name in ("median", "least", "most")),
        row["unit"],
        "" if aim is None else f"{aim:g}",
        "" if aim is None else f"{row['median'] / aim:.2f}",
    )


def take(job: Timing) -> Timed:
    """Take the timings of one group, in a worker."""
    parts: dict[str, Callable[[], list[dict[str, Any]]]] = {
        GROUPS[0]: lambda: _pictures(job.repeat, job.seed),
        GROUPS[1]: lambda: _comparisons(job.repeat, job.seed),
        GROUPS[2]: lambda: _boundaries(job.repeat),
        GROUPS[3]: lambda: _large_plans(job.repeat, job.seed),
        GROUPS[4]: lambda: _episodes(job.seed),
    }
    return Timed(job.group, tuple(parts[job.group]()), _machine())


def _pictures(repeat: int, seed: int) -> list[dict[str, Any]]:
    loaded = load_task(TASK)
    config = run_config(TASK)
    part = make_world(config, loaded.domain)
    with part.open(loaded.task.scene, loaded.domain) as world:
        environment = world.environment
        times = _timed(1, lambda: environment.reset(seed))
        rows = [_row("scene built", "ms", times, None)]
        domain, step = loaded.domain, _putting(loaded)
        thing, place = (f"{a}-1" for a in step.args)
        focus, drive = _centre(world, place), domain.driving()
        assert drive is not None
        environment.execute(Subtask(drive.name, (place,)))
        observations = []
        times = _timed(repeat, lambda: observations.append(environment.observe((focus,))))
        rows.append(_row("RGB-D-and-ids frame", "ms", times, 300))
        parts = Assembly(config.choices, loaded.domain, lent={"truth": world.oracle})
        perceiver, segmenter = parts.part(PERCEIVER), parts.part(SEGMENTER)
        around = environment.scan()
        perceiver.perceive(around)
        counts = [len(segmenter.segment(f)) for f in around.frames]
        masks = max(counts)
        full = replace(around, frames=(around.frames[counts.index(masks)],))
        times = _timed(repeat, lambda: perceiver.perceive(full))
        rows.append(_row(f"frame → graph ({masks} masks)", "ms", times, 60))
        without = run_config(TASK, given=_STATELESS).choices
        stateless = Assembly(without, loaded.domain, lent={"states": {}})
        geometry = stateless.part(PERCEIVER)
        geometry.perceive(around)
        times = _timed(repeat, lambda: geometry.perceive(full))
        rows.append(_row(f"frame → graph, no states ({masks} masks)", "ms", times, 25))
        seen = environment.observe((focus,))  # of now: time does not run back
        graph = perceiver.perceive(seen)
        subtask = Subtask(step.skill, (thing, place))
        context = BoundaryContext(
            loaded.task,
            loaded.task.plan,
            8,
            8,
            subtask,
            graph,
            perceiver.scope(graph, subtask),
            seen,
        )
        rows.append(
            _row("repair plan", "ms", _plans(context, parts.part(REPLANNER), domain, repeat), 50)
        )
    return rows


def _putting(loaded: LoadedTask) -> Subtask:
    """The last step of the task that puts what is in the hand somewhere."""
    plan, skills = loaded.task.plan, loaded.domain.skills
    return [s for s in plan if skills[s.skill].hand is not None and len(s.args) == 2][-1]


def _plans(
    context: BoundaryContext, replanner: Replanner, domain: Domain, repeat: int
) -> list[float]:
    """Plans for the facts that would help where the next subtask is refused from the start."""
    bound = domain.bound(context.subtask)
    needs = domain.skill(context.subtask.skill).needs
    lacking = [x.bind(bound) for n in needs for x in n.lacking]
    known = [x for x in lacking if not any(a.startswith("?") for a in x.args)]
    wanted = tuple(x for x in known if x.predicate == domain.roles.holding or x.is_state)[:2]
    return _timed(repeat, lambda: replanner.replan(context, Diagnosis("a measurement", wanted)))


def _large_plans(repeat: int, seed: int) -> list[dict[str, Any]]:
    """Plans among many things, each in another yard: nothing is remembered from the one before."""
    times, solved = [], 0
    for problem in (yard.drawn(THINGS, seed + k) for k in range(repeat)):
        started = time.perf_counter()
        planned = plan_goal(*problem)
        times.append(1000 * (time.perf_counter() - started))
        solved += planned.outcome is ReplanOutcome.SOLVED
    skills = len(yard.domain().skills)
    what = f"plan among {THINGS} things with {skills} skills ({solved} of {repeat} found)"
    return [_row(what, "ms", times, 1000)]


def _timed(repeat: int, what: Callable[[], object]) -> list[float]:
    """Milliseconds of each call."""
    times = []
    for _ in range(repeat):
        started = time.perf_counter()
        what()
        times.append(1000 * (time.perf_counter() - started))
    return times


def _comparisons(repeat: int, seed: int) -> list[dict[str, Any]]:
    rows, domain = [], load_task(TASK).domain
    for count, aim in ((1, None), (100, None), (1000, 50.0)):
        times = [1000 * t for t in score_times(count, 30, seed, domain, repeat)]
        rows.append(_row(f"1 graph against {count} of 30 nodes", "ms", times, aim))
    return rows


def _boundaries(repeat: int) -> list[dict[str, Any]]:
    """Of a task with the demonstrations that it has, repeated."""
    demonstrations, _ = load_memory(run_config(TASK))
    domain = load_task(TASK).domain
    times = boundary_times(demonstrations, STORED, repeat, domain)
    what = f"a boundary, three judges, {STORED} demonstrations"
    return [_row(what, "ms", [1000 * t for t in times], 20)]


def _episodes(seed: int) -> list[dict[str, Any]]:
    config = run_config(TASK)
    load_memory(config)
    started = time.perf_counter()
    demonstrations, _ = load_memory(config)
    opened = 1000 * (time.perf_counter() - started)
    rows = [_row(f"memory of {len(demonstrations)} demonstrations opened", "ms", [opened], None)]
    for strategy, scenario in (
        ("none", None),
        ("proactive", None),
        ("proactive", "microwave-occupied"),
    ):
        config = run_config(TASK, scenario, strategy=strategy, seed=seed)
        started = time.perf_counter()
        record: EpisodeRecord = run_episode(prepare(config), demonstrations)
        what = f"{TASK}, {scenario or 'undisturbed'}, {strategy}"
        what = f"episode of {len(record.executed)} subtasks: {what}"
        rows.append(_row(what, "s", [time.perf_counter() - started], None))
    return rows


def _centre(world: OpenWorld, name: str) -> tuple[float, float, float]:
    node = world.oracle.truth().get(name)
    assert node is not None and node.centroid_m is not None, f"every scene of {TASK} has a {name}"
    return node.centroid_m


def _row(what: str, unit: str, values: Sequence[float], aim: float | None) -> dict[str, Any]:
    return {
        "what": what,
        "unit": unit,
        "median": statistics.median(values),
        "least": min(values),
        "most": max(values),
        "n": len(values),
        "aim": aim,
    }


def _machine() -> dict[str, Any]:
    processor = platform.processor() or platform.machine()
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            for line in lines:
                if line.startswith("model name"):
                    processor = line.partition(":")[2].strip()
                    break
    except OSError:
        pass
    return {
        "processor": processor,
        "cores": os.cpu_count(),
        "platform": platform.platform(),
        "python": platform.python_version(),
    }
