"""How long judging one boundary takes against a large memory, all judges together.

Called by `speed`; calls assembly. Nothing is perceived: the scenes are those of the demonstrations.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

from forestall.assembly.configuration import run_config
from forestall.assembly.parts import Assembly
from forestall.domain.model import Domain
from forestall.kinds import STRATEGY
from forestall.tasks.files import load_task
from forestall.types.demonstration import Demonstration
from forestall.types.plan import Plan
from forestall.types.runtime import BoundaryContext

JUDGES = ("score", "preconditions", "plan-check")


def boundary_times(
    demonstrations: Sequence[Demonstration], count: int, repeat: int, domain: Domain
) -> list[float]:
    """Seconds of each look at each boundary of a demonstrated run, the memory known by then.

    Every judge judges and nothing is alarming. A first round over the run is not counted: in it the
    memory is mined and its graphs are prepared, once for good.

    Args:
        demonstrations: of one task; repeated under other names until there are enough.
        count: how many the memory holds.
        repeat: rounds that are counted.
        domain: of the task.
    """
    first = demonstrations[0]
    memory = [_copy(demonstrations[k % len(demonstrations)], k) for k in range(count)]
    choices = run_config(first.task, strategy={"name": "proactive", "judges": JUDGES}).choices
    strategy = Assembly(choices, domain, memory).part(STRATEGY)
    task, plan = load_task(first.task).task, Plan(tuple(s.subtask for s in first.steps))
    times = []
    for turn in range(repeat + 1):
        for index, step in enumerate(first.steps):
            graph, scoped = replace(step.whole), replace(step.graph)  # nobody has seen them yet
            context = BoundaryContext(
                task, plan, index, index, step.subtask, graph, scoped, observation=None
            )
            started = time.perf_counter()
            strategy.before_subtask(context)
            if turn:
                times.append(time.perf_counter() - started)
    return times


def _copy(demonstration: Demonstration, number: int) -> Demonstration:
    """The same under another name, with graphs of its own."""
    steps = tuple(
        replace(s, graph=replace(s.graph), whole=replace(s.whole)) for s in demonstration.steps
    )
    return replace(demonstration, id=f"{demonstration.id}-{number}", steps=steps)
