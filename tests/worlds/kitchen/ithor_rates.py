"""How often the nominal plans reach their goals in the rooms after AI2-THOR's.

    PYTHONPATH=src python tests/worlds/kitchen/ithor_rates.py [--seeds 30] [--first 10000]

The kind household, one layout after the other, without pictures; see `honest_rates`.
"""

from __future__ import annotations

import argparse
import sys

from honest_rates import DOMAIN, Given, blank_kitchen

from forestall.errors import ForestallError
from forestall.runtime import Runtime, RuntimeConfig
from forestall.strategies.none import NoReplanning
from forestall.tasks.files import load_task, task_names
from forestall.tasks.goals import TruthGoalChecker
from forestall.worlds.kitchen import ithor
from forestall.worlds.kitchen.ithor_layouts import Layout, layouts


def won(task: str, layout: Layout, seeds: range) -> tuple[int, list[str]]:
    """Runs that reached the goal, and what became of the others."""
    loaded = load_task(task).task
    kitchen = blank_kitchen(task, None, False, ithor.draws(layout.name))
    config = RuntimeConfig(keep_observations=False)
    runtime = Runtime(kitchen, Given(kitchen), NoReplanning(), DOMAIN, (), config)
    count, lost = 0, []
    for seed in seeds:
        try:
            record = runtime.run(loaded, loaded.plan, seed)
        except ForestallError as error:
            lost.append(f"{task} {layout.name} {seed}: {error}")
            continue
        reached, _, _ = TruthGoalChecker(DOMAIN).check(loaded.goal, kitchen.oracle)
        count += reached
        if not reached:
            lost.append(f"{task} {layout.name} {seed}: {'; '.join(record.failures)}")
    return count, lost


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=30)
    parser.add_argument("--first", type=int, default=10000)
    given = parser.parse_args()
    seeds = range(given.first, given.first + given.seeds)
    lost: list[str] = []
    _say(f"{'task':<16}" + "".join(f"{n:>13}" for n in layouts()))
    for task in task_names():
        cells = []
        for layout in layouts().values():
            if layout.room != load_task(task).task.scene.room:
                cells.append("-")
                continue
            count, why = won(task, layout, seeds)
            cells.append(f"{count} of {given.seeds}")
            lost += why
        _say(f"{task:<16}" + "".join(f"{c:>13}" for c in cells))
    for line in lost:
        _say(line)


def _say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
