"""How often the nominal plans reach their goals in the honest household without a monitor.

    PYTHONPATH=src python tests/worlds/kitchen/honest_rates.py [--seeds 20] [--first 10000]
        [--law known|drawn] [--perfect]

Real rooms, true rules, the project's own loop and strategies; nothing is drawn as a picture: the
monitor is given the true graph, which neither strategy reads for anything but names.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from forestall.domain.load import shipped
from forestall.runtime import Runtime, RuntimeConfig
from forestall.seams import Strategy
from forestall.strategies.none import NoReplanning
from forestall.strategies.retry import RetryOnce
from forestall.tasks.files import load_task, task_names
from forestall.tasks.goals import TruthGoalChecker
from forestall.types.episode import SkillStatus
from forestall.types.graph import SceneGraph
from forestall.types.observation import Frame, Intrinsics, Observation
from forestall.types.plan import Subtask
from forestall.worlds.kitchen.environment import KitchenEnvironment
from forestall.worlds.kitchen.imperfection import AS_MEANT, DRAW_EVENT, PERFECT, Rates
from forestall.worlds.kitchen.imperfection import WAYS as WAYS_OF
from forestall.worlds.kitchen.law import LAW_EVENT, WAYS
from forestall.worlds.kitchen.layout import Draw

DOMAIN = shipped("household")


class Blank:
    """Implements `Renderer`: pictures of nothing."""

    name = "blank"

    def __init__(self, intrinsics: Intrinsics) -> None:
        shape = (intrinsics.height, intrinsics.width)
        self._rgb = np.zeros((*shape, 3), dtype=np.uint8)
        self._depth_m = np.ones(shape, dtype=np.float32)
        self._intrinsics = intrinsics

    def render(self, data: Any, camera_to_world: npt.NDArray[np.float64]) -> Frame:
        """See the Protocol."""
        return Frame(self._rgb, self._depth_m, self._intrinsics, camera_to_world.copy())


class Given:
    """Implements `Perceiver`: the true graph."""

    def __init__(self, environment: KitchenEnvironment) -> None:
        self._environment = environment

    def reset(self) -> None:
        """See the Protocol."""

    def perceive(self, observation: Observation) -> SceneGraph:
        """See the Protocol."""
        return self._environment.oracle.truth()

    def scope(self, graph: SceneGraph, subtask: Subtask) -> SceneGraph:
        """See the Protocol."""
        return graph

    def describe(self) -> dict[str, str]:
        """See the Protocol."""
        return {"states": "given"}


def blank_kitchen(
    task: str, rates: Rates | None, drawn: bool, draws: Mapping[str, Draw] | None = None
) -> KitchenEnvironment:
    """The real kitchen of a task, without pictures."""
    return KitchenEnvironment(
        load_task(task).task.scene,
        DOMAIN,
        intrinsics=Intrinsics.from_vertical_fov(8, 6, 60.0),
        make=lambda _, intrinsics: Blank(intrinsics),
        rates=rates,
        ways=WAYS if drawn else (),
        draws=draws,
    )


@dataclass
class Counts:
    """What the runs of one or all tasks came to."""

    won: Counter[str] = field(default_factory=Counter)
    ways: Counter[str] = field(default_factory=Counter)
    attempts: Counter[str] = field(default_factory=Counter)
    executed: int = 0
    failed: int = 0
    by_law: Counter[str] = field(default_factory=Counter)
    unexplained: list[str] = field(default_factory=list)


def count(
    task: str, seeds: range, rates: Rates, drawn: bool, strategies: Sequence[Strategy]
) -> Counts:
    """Run a task's plan on every seed with every strategy; what went wrong is that of the first."""
    kitchen, loaded, counts = blank_kitchen(task, rates, drawn), load_task(task).task, Counts()
    for seed in seeds:
        for strategy in strategies:
            config = RuntimeConfig(keep_observations=False)
            runtime = Runtime(kitchen, Given(kitchen), strategy, DOMAIN, (), config)
            record = runtime.run(loaded, loaded.plan, seed)
            won, _, _ = TruthGoalChecker(DOMAIN).check(loaded.goal, kitchen.oracle)
            events = kitchen.oracle.events()
            draws = [e.text for e in events if e.kind == DRAW_EVENT]
            ends = [text.rpartition(", ")[2] for text in draws]
            wrong = [w for w in ends if w != AS_MEANT]
            counts.won[strategy.name] += won
            if strategy is strategies[0]:
                counts.attempts.update(text.split(" ")[0] for text in draws)
                counts.ways.update(wrong)
                counts.executed += len(record.executed)
                failed = (e.outcome.status is SkillStatus.FAILED for e in record.executed)
                counts.failed += sum(failed)
            if not won and not wrong:
                counts.by_law[strategy.name] += 1
                if all(e.kind != LAW_EVENT for e in events):
                    counts.unexplained.append(f"{strategy.name} {task} {seed}")
    return counts


def report(by_task: Mapping[str, Counts], seeds: int, names: Sequence[str]) -> list[str]:
    """The table, and what went wrong."""
    lines = [f"{'task':<16}" + "".join(f"{n:>14}" for n in names)]
    for task, counts in by_task.items():
        cells = "".join(f"{f'{counts.won[n]} of {seeds}':>14}" for n in names)
        lines.append(f"{task:<16}{cells}")
    runs, every = seeds * len(by_task), list(by_task.values())
    won = {n: sum(c.won[n] for c in every) for n in names}
    lines.append(f"{'all':<16}" + "".join(f"{f'{won[n]} of {runs}':>14}" for n in names))
    lines.append(f"{'':<16}" + "".join(f"{won[n] / runs:>14.1%}" for n in names))
    ways = sum((c.ways for c in every), Counter[str]())
    attempts = sum((c.attempts for c in every), Counter[str]())
    for motion, several in attempts.most_common():
        wrong = {w: ways[w] for w in WAYS_OF[motion] if ways[w]}
        share = sum(wrong.values()) / several
        lines.append(f"{motion:<10}{several:>6} attempts, {share:.1%} went wrong: {wrong}")
    drives = attempts["set_out"]
    share = (ways.total() - ways["stall"]) / (attempts.total() - drives)
    lines.append(f"{'all but drives':<16} {share:.1%} went wrong")
    executed, failed = sum(c.executed for c in every), sum(c.failed for c in every)
    lines.append(f"{executed} skills executed, {failed} reported as failed ({names[0]})")
    by_law = {n: sum(c.by_law[n] for c in every) for n in names}
    lines.append(f"lost although every motion went as meant: {by_law}")
    lines.append(f"lost without any reason: {[u for c in every for u in c.unexplained]}")
    return lines


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=10000)
    parser.add_argument("--law", choices=("known", "drawn"), default="drawn")
    parser.add_argument("--perfect", action="store_true")
    given = parser.parse_args()
    rates = PERFECT if given.perfect else Rates()
    seeds = range(given.first, given.first + given.seeds)
    strategies: tuple[Strategy, ...] = (NoReplanning(), RetryOnce())
    by_task = {t: count(t, seeds, rates, given.law == "drawn", strategies) for t in task_names()}
    lines = report(by_task, given.seeds, [s.name for s in strategies])
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
