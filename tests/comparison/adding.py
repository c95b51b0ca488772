"""What one more demonstration costs: `python tests/comparison/adding.py` prints the ratios."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from statistics import median
from time import process_time

from forestall.comparison.needs import Needs
from forestall.domain.load import shipped
from forestall.testing.symbolic_scene import start_scene
from forestall.types.demonstration import Demonstration, DemonstrationStep
from forestall.types.plan import Subtask
from forestall.types.scene import SceneNeeds

DOMAIN = shipped("bench")
PLAN = ("pick(Cloth-1)", "place(Cloth-1, Tray-1)", "open_lid(PartsBox-1)", "close_lid(PartsBox-1)")


def sample(number: int) -> Demonstration:
    """A run of one of seven tasks; its scene is one of seven, too."""
    graph = start_scene(DOMAIN, SceneNeeds(clutter=(2, 4)), number % 7)
    steps = [DemonstrationStep(i, Subtask.parse(t), graph, graph) for i, t in enumerate(PLAN)]
    return Demonstration(f"task-{number % 7}", "room", number, tuple(steps), id=f"d{number}")


def medians(sizes: Sequence[int], repeats: int = 25) -> list[float]:
    """Median seconds of computing for one more, in memories of so many."""
    runs = [sample(n) for n in range(7)]
    counts, found, have = Needs(DOMAIN), [], 0
    for size in sorted(sizes):
        while have < size:
            counts.learn(replace(runs[have % 7], id=f"d{have}"))
            have += 1
        spent = []
        for _ in range(repeats):
            began = process_time()
            counts.learn(runs[have % 7])
            spent.append(process_time() - began)
            have += 1
        found.append(median(spent))
    return found


if __name__ == "__main__":
    sizes = tuple(int(a) for a in sys.argv[1:]) or (100, 1_000, 10_000)
    took = medians(sizes)
    for size, seconds in zip(sizes, took, strict=True):
        ratio = f"{seconds / took[0]:.2f} of that at {sizes[0]}"
        sys.stdout.write(f"{size:>6}: {seconds * 1e3:6.2f} ms, {ratio}\n")
