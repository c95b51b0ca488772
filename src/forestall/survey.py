"""Many episodes, counted: `forestall bench episodes`.

Calls: command line → here → build, demonstrations. Each finished episode is one JSON line, written
at once, so that a survey can be killed and taken up again; what is in the file is not run twice.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import forestall
from forestall.build import STATES, RunConfig, prepare, run_episode
from forestall.config import DEMONSTRATION_SEEDS
from forestall.demonstrations import ready_made
from forestall.errors import FileFormatError, InputError
from forestall.memory.store import open_store
from forestall.records.codec import record_to_json
from forestall.records.record import replace_file
from forestall.tasks.files import load_scenario
from forestall.types.demonstration import Demonstration

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True, slots=True, order=True)
class Job:
    """One episode."""

    task: str
    scenario: str | None
    strategy: str
    seed: int
    memory: str | None = None
    states: str = STATES
    feature: str = "parts"
    encoder: str = "hashed-words"

    @property
    def key(self) -> str:
        """What makes an episode the same one."""
        return json.dumps([forestall.__version__, *asdict(self).values()])

    @property
    def config(self) -> RunConfig:
        """The run of this episode; its pictures are not kept."""
        return RunConfig(
            self.task,
            self.scenario,
            self.strategy,
            self.seed,
            states=self.states,
            feature=self.feature,
            encoder=self.encoder,
            keep_observations=False,
        )


def parse_seeds(text: str) -> range:
    """Read "100:120" (100 to 119) or "7".

    Raises:
        InputError: no such range, or seeds of demonstrations.
    """
    first, colon, last = text.partition(":")
    try:
        seeds = range(int(first), int(last) if colon else int(first) + 1)
    except ValueError as error:
        raise InputError(f"seeds {text!r}: write 100:120 for 100 to 119, or one number") from error
    if not seeds or seeds[0] < 0:
        raise InputError(f"seeds {text!r} hold no seed: write 100:120 for 100 to 119")
    if seeds[-1] >= DEMONSTRATION_SEEDS:
        raise InputError(f"seeds from {DEMONSTRATION_SEEDS} on are those of demonstrations")
    return seeds


def jobs_for(
    tasks: Iterable[str],
    scenarios: Iterable[str],
    strategies: Iterable[str],
    seeds: Iterable[int],
    memory: str | None = None,
    states: str = STATES,
    feature: str = "parts",
    encoder: str = "hashed-words",
) -> list[Job]:
    """Undisturbed runs of the tasks, and runs of the scenarios, with each strategy and seed."""
    pairs: list[tuple[str, str | None]] = [(t, None) for t in tasks]
    pairs += [(load_scenario(s).task, s) for s in scenarios]
    seeds = list(seeds)
    jobs = [
        Job(t, s, strategy, seed, memory, states, feature, encoder)
        for strategy in strategies
        for t, s in pairs
        for seed in seeds
    ]
    for job in {(j.task, j.scenario, j.strategy): j for j in jobs}.values():
        prepare(job.config)
    return jobs


def survey(
    jobs: Sequence[Job], workers: int, out: Path, progress: Progress
) -> list[dict[str, Any]]:
    """Run what `out` does not hold yet; every row in the order of the jobs."""
    rows = _read(out)
    todo = [j for j in jobs if j.key not in rows]
    for task in sorted({j.task for j in todo if j.memory is None and j.strategy != "none"}):
        first = todo[0]
        ready_made(task, first.states, progress=progress, workers=workers, feature=first.feature)
    out.parent.mkdir(parents=True, exist_ok=True)
    progress(len(jobs) - len(todo), len(jobs), "episodes")
    with (
        out.open("a", encoding="utf-8") as lines,
        ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool,
    ):
        futures = {pool.submit(run_job, job): job for job in todo}
        try:
            for done, future in enumerate(as_completed(futures), len(jobs) - len(todo) + 1):
                job = futures[future]
                rows[job.key] = future.result()
                lines.write(json.dumps({"key": job.key, "row": rows[job.key]}) + "\n")
                lines.flush()
                progress(done, len(jobs), job.scenario or job.task)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return [rows[j.key] for j in jobs]


def run_job(job: Job) -> dict[str, Any]:
    """Run one episode and keep what is counted."""
    demonstrations = None if job.strategy == "none" else _demonstrations(job)
    record = run_episode(prepare(job.config), demonstrations)
    data = record_to_json(record)
    kept = ("success", "weak_success", "failures", "end", "replans", "simulated_s", "reasoning_s")
    return (
        asdict(job)
        | {name: data[name] for name in kept}
        | {
            "boundaries": len({b.index for b in record.boundaries}),
            "executed": len(record.executed),
            "alarms": data["alarms"],
            "perception": data["perception"],
        }
    )


def table(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """One line for each task or scenario and strategy, with exact 95 % intervals (Clopper-Pearson).

    `alarms` counts boundaries with an alarm; on undisturbed runs every alarm is a false one.
    """
    from scipy.stats import binomtest

    groups: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    for row in rows:
        key = (row["strategy"], "" if row["scenario"] is None else row["scenario"], row["task"])
        groups.setdefault(key, []).append(row)
    lines = []
    for (strategy, scenario, task), group in groups.items():
        good = sum(bool(r["success"]) for r in group)
        interval = binomtest(good, len(group)).proportion_ci(0.95)
        lines.append(
            {
                "strategy": strategy,
                "task": task,
                "scenario": scenario or None,
                "n": len(group),
                "succeeded": good,
                "low": float(interval.low),
                "high": float(interval.high),
                "boundaries": sum(r["boundaries"] for r in group),
                "alarms": sum(len({a["index"] for a in r["alarms"]}) for r in group),
                "runs_with_alarm": sum(bool(r["alarms"]) for r in group),
                "replans": sum(r["replans"] for r in group),
            }
        )
    return lines


@cache
def _opened(path: str) -> tuple[Demonstration, ...]:
    with open_store(path) as store:
        return tuple(store.required())


def _demonstrations(job: Job) -> tuple[Demonstration, ...]:
    return _opened(job.memory or str(ready_made(job.task, job.states, feature=job.feature)))


def _read(out: Path) -> dict[str, dict[str, Any]]:
    if not out.exists():
        return {}
    rows: dict[str, dict[str, Any]] = {}
    whole, newline, half = out.read_text(encoding="utf-8").rpartition("\n")
    if half:  # a kill may leave half a last line; that episode is run again
        replace_file(out, (whole + newline).encode())
    for number, line in enumerate(whole.splitlines(), 1):
        try:
            entry = json.loads(line)
            rows[entry["key"]] = entry["row"]
        except (json.JSONDecodeError, KeyError, TypeError) as error:
            raise FileFormatError(f"{out}, line {number}: not a result of this command") from error
    return rows
