"""`forestall bench speed`: timings of the parts on this machine.

Calls: command line → here → build and the timing helpers of each part. Numbers are wall-clock
times of this process; quote medians, and ratios rather than single values.
"""

from __future__ import annotations

import os
import platform
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from forestall.build import STATES, RunConfig, prepare, run_episode
from forestall.comparison.timing import score_times
from forestall.demonstrations import ready_made
from forestall.domain.load import domain_of
from forestall.memory.store import open_store
from forestall.parts import make_state_estimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import InstanceSegmenter
from forestall.planning.validate import GraphValidator
from forestall.replanning.symbolic import PlannerReplanner
from forestall.tasks.files import load_task
from forestall.types.episode import EpisodeRecord
from forestall.types.facts import Literal
from forestall.types.plan import Subtask
from forestall.types.runtime import BoundaryContext
from forestall.types.verdict import Diagnosis
from forestall.worlds.kitchen.environment import KitchenEnvironment

Progress = Callable[[int, int, str], None]


def measure(repeat: int, seed: int, progress: Progress) -> dict[str, Any]:
    """Every row: what, unit, median, least, most, n, aim.

    Args:
        repeat: how often each part is timed.
        seed: of the scene.
        progress: told (done, total, what).
    """
    rows: list[dict[str, Any]] = []
    parts: list[tuple[str, Callable[[], list[dict[str, Any]]]]] = [
        ("pictures and graphs", lambda: _pictures(repeat, seed)),
        ("comparisons", lambda: _comparisons(repeat, seed)),
        ("episodes", lambda: _episodes(seed)),
    ]
    for number, (name, part) in enumerate(parts):
        progress(number, len(parts), name)
        rows += part()
    progress(len(parts), len(parts), "done")
    return {"machine": _machine(), "seed": seed, "repeat": repeat, "rows": rows}


def _pictures(repeat: int, seed: int) -> list[dict[str, Any]]:
    loaded = load_task("heat-potato")
    rows = []
    kitchen = KitchenEnvironment(loaded.task.scene, loaded.vocabulary)
    try:
        started = time.perf_counter()
        kitchen.reset(seed)
        rows.append(_row("scene built", "ms", [1000 * (time.perf_counter() - started)], None))
        focus = _fixture_centre(kitchen, "Microwave-1")
        kitchen.execute(Subtask("navigate_to_obj", ("Microwave",)))
        times, observations = [], []
        for _ in range(repeat):
            started = time.perf_counter()
            observations.append(kitchen.observe((focus,)))
            times.append(1000 * (time.perf_counter() - started))
        rows.append(_row("RGB-D-and-ids frame", "ms", times, 300))
        perceiver = GraphPerceiver(
            InstanceSegmenter(),
            make_state_estimator(STATES, loaded.vocabulary),
            loaded.vocabulary,
        )
        around = kitchen.scan()
        perceiver.perceive(around)
        counts = [len(InstanceSegmenter().segment(f)) for f in around.frames]
        masks = max(counts)
        full = replace(around, frames=(around.frames[counts.index(masks)],))
        times = []
        for _ in range(repeat):
            started = time.perf_counter()
            perceiver.perceive(full)
            times.append(1000 * (time.perf_counter() - started))
        graph = perceiver.perceive(observations[-1])
        rows.append(_row(f"frame → graph ({masks} masks)", "ms", times, 60))
        subtask = Subtask.parse("put_in(Plate-1, Microwave-1)")
        context = BoundaryContext(
            loaded.task,
            loaded.task.plan,
            8,
            8,
            subtask,
            graph,
            perceiver.scope(graph, subtask),
            observations[-1],
        )
        rows.append(_row("repair plan", "ms", _plans(context, loaded.vocabulary, repeat), 50))
    finally:
        kitchen.close()
    return rows


def _plans(context: BoundaryContext, vocabulary: Any, repeat: int) -> list[float]:
    wanted = (Literal("open", ("Microwave-1",), "open"), Literal("held_by", ("Plate-1", "gripper")))
    domain = domain_of(vocabulary)
    replanner = PlannerReplanner(GraphValidator(domain), domain)
    times = []
    for _ in range(repeat):
        started = time.perf_counter()
        replanner.replan(context, Diagnosis("a measurement", wanted))
        times.append(1000 * (time.perf_counter() - started))
    return times


def _comparisons(repeat: int, seed: int) -> list[dict[str, Any]]:
    rows = []
    for count, aim in ((1, None), (100, None), (1000, 50.0)):
        times = [1000 * t for t in score_times(count, 30, seed, repeat)]
        rows.append(_row(f"1 graph against {count} of 30 nodes", "ms", times, aim))
    return rows


def _episodes(seed: int) -> list[dict[str, Any]]:
    path = ready_made("heat-potato")
    started = time.perf_counter()
    with open_store(path) as store:
        demonstrations = list(store.required())
    opened = 1000 * (time.perf_counter() - started)
    rows = [_row(f"memory of {len(demonstrations)} demonstrations opened", "ms", [opened], None)]
    for strategy, scenario in (
        ("none", None),
        ("proactive", None),
        ("proactive", "microwave-occupied"),
    ):
        config = RunConfig("heat-potato", scenario, strategy, seed)
        started = time.perf_counter()
        record: EpisodeRecord = run_episode(prepare(config), demonstrations)
        what = f"heat-potato, {scenario or 'undisturbed'}, {strategy}"
        what = f"episode of {len(record.executed)} subtasks: {what}"
        rows.append(_row(what, "s", [time.perf_counter() - started], None))
    return rows


def _fixture_centre(kitchen: KitchenEnvironment, name: str) -> tuple[float, float, float]:
    node = kitchen.oracle.truth().get(name)
    assert node is not None and node.centroid_m is not None, f"every kitchen has a {name}"
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
