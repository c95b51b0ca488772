"""Episodes of one's own choice, counted: `forestall bench episodes`.

A case of the experiment runner: calls `conduct` like the paper's experiments, with tasks, scenarios
and seeds instead of a split.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from forestall.assembly.configuration import digest_of
from forestall.config import DEMONSTRATION_SEEDS
from forestall.domain.model import Domain
from forestall.errors import InputError
from forestall.experiments.conduct import Experiment, Progress, check, conduct
from forestall.experiments.runs import Run
from forestall.statistics.cases import UNDISTURBED, Case
from forestall.statistics.rows import EpisodeRow, Judged
from forestall.tasks.files import load_scenario, load_task, scenario_names, task_names

KIND = "episodes"

STRATEGIES = ("none", "proactive")
"""What is run when nothing is said."""

SEEDS = "100:105"
"""The scenes when nothing is said."""


@dataclass(frozen=True, slots=True)
class Episodes:
    """Undisturbed runs of tasks, and runs of scenarios, with each strategy and seed.

    Args:
        tasks: names or files.
        scenarios: names or files.
        strategies: see `forestall parts strategy`.
        seeds: of the scenes.
    """

    tasks: tuple[str, ...]
    scenarios: tuple[str, ...]
    strategies: tuple[str, ...] = STRATEGIES
    seeds: tuple[int, ...] = ()

    def runs(self) -> tuple[Run, ...]:
        """Every episode, each once, strategy by strategy."""
        pairs: list[tuple[str, str, str | None]] = [(UNDISTURBED, t, None) for t in self.tasks]
        for name in self.scenarios:
            scenario = load_scenario(name)
            pairs.append((scenario.set, scenario.task, name))
        found = [
            Run(Case(of, task, scenario, seed), strategy)
            for strategy in self.strategies
            for of, task, scenario in pairs
            for seed in self.seeds
        ]
        return tuple(dict.fromkeys(found))

    def about(self, domain: Domain | None = None) -> dict[str, Any]:
        """The content of files of one's own; other episodes may share a folder otherwise.

        Args:
            domain: that the tasks are read in, None for their own.
        """
        shipped = {*task_names(None), *scenario_names(domain=None)}
        loaded = {t: load_task(t, domain) for t in self.tasks}
        read = {t: f"{one.task} {digest_of(one.domain)}" for t, one in loaded.items()}
        read |= {s: repr(load_scenario(s)) for s in self.scenarios}
        digests = {
            name: hashlib.blake2b(text.encode(), digest_size=8).hexdigest()
            for name, text in read.items()
            if name not in shipped
        }
        return {"files": digests}


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


def folder_for(experiment: Experiment, out: Path | None) -> Path:
    """Where the results go: by default a folder that only the same settings, memory and code share.

    Raises:
        InputError: `out` is a file, or is named like one; or what is wanted cannot be run.
    """
    if out is None:
        check(experiment, experiment.choice.runs())
        return Path("runs") / f"{KIND}-{experiment.about().digest}"
    if out.suffix == ".jsonl" or out.is_file():
        raise InputError(f"--out {out}: give a folder; the lines are in its episodes.jsonl")
    return out


def count(experiment: Experiment, out: Path, progress: Progress) -> list[dict[str, Any]]:
    """Run what the folder does not hold yet; the lines of the table."""
    return table(conduct(experiment, out, progress))


def table(rows: Sequence[EpisodeRow]) -> list[dict[str, Any]]:
    """One line for each task or scenario and strategy, with exact 95 % intervals (Clopper-Pearson).

    `alarms` counts boundaries with an alarm; on undisturbed runs every alarm is a false one.
    """
    from scipy.stats import binomtest

    groups: dict[tuple[str, str | None, str], list[EpisodeRow]] = {}
    for row in rows:
        groups.setdefault((row.strategy, row.scenario, row.task), []).append(row)
    lines = []
    for (strategy, scenario, task), group in groups.items():
        good = sum(r.success for r in group)
        interval = binomtest(good, len(group)).proportion_ci(0.95)
        alarms = [{j.index for j in r.judged if _alarm(j)} for r in group]
        lines.append(
            {
                "strategy": strategy,
                "task": task,
                "scenario": scenario,
                "n": len(group),
                "succeeded": good,
                "low": float(interval.low),
                "high": float(interval.high),
                "boundaries": sum(len({j.index for j in r.judged}) for r in group),
                "alarms": sum(map(len, alarms)),
                "runs_with_alarm": sum(map(bool, alarms)),
                "replans": sum(r.replans for r in group),
                "broken": sum(bool(r.error) for r in group),
            }
        )
    return lines


def _alarm(judged: Judged) -> bool:
    """Whether it asked for a new plan; a last look that wished for another was not explained."""
    return judged.decision == "replan" and bool(judged.cause)
