"""Playing many starts without a monitor: whether what a set says of its scenarios is so.

Called by the command line; calls assembly for the world, `tasks.judging` for each start and
`tasks.drawing` for new ones. Worker processes do a task each; results come in the order asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from typing import TypeVar

from forestall.assembly.configuration import Given, run_config
from forestall.assembly.make import make_world
from forestall.seams.acting import WorldPart
from forestall.statistics.cases import FURTHER_SPLITS, ROUNDS, Case, room
from forestall.tasks.drawing import Drawer, Drawn
from forestall.tasks.files import LoadedTask, load_scenario, load_task, long_task_names
from forestall.tasks.judging import Played, play

T = TypeVar("T")
R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Judged:
    """A case, and what came of playing it."""

    case: Case
    played: Played

    @property
    def as_said(self) -> bool:
        """Whether it fails or succeeds as its set says."""
        return not self.played.problem and self.played.success != self.case.failing


def judge(
    cases: Sequence[Case], jobs: int = 1, world: str = "", told: Callable[[Case], None] = print
) -> Iterator[Judged]:
    """Play every case.

    Args:
        cases: to play.
        jobs: processes.
        world: name of the world part; the domain's own where nothing is said.
        told: of each case when it is done.
    """
    groups: dict[str, list[Case]] = {}
    for case in cases:
        groups.setdefault(case.task, []).append(case)
    several = [(tuple(of), world) for of in groups.values()]
    for found in _spread(_judge_some, several, jobs):
        for judged in found:
            told(judged.case)
            yield judged


def draw(tasks: Sequence[str], seed: int, jobs: int = 1) -> Iterator[tuple[str, Drawn]]:
    """Fill the further sets of some tasks anew."""
    wanted = [(task, seed) for task in tasks]
    for (task, _), drawn in zip(wanted, _spread(_draw_one, wanted, jobs), strict=True):
        yield task, drawn


def _judge_some(several: tuple[tuple[Case, ...], str]) -> list[Judged]:
    cases, world = several
    loaded = load_task(cases[0].task)
    part = _world(loaded, cases[0].task, world)
    found = []
    for case in cases:
        scenario = None if case.scenario is None else load_scenario(case.scenario)
        found.append(Judged(case, play(part, loaded, scenario, case.seed)))
    return found


def _draw_one(wanted: tuple[str, int]) -> Drawn:
    task, seed = wanted
    loaded = load_task(task)
    drawer = Drawer(loaded, _world(loaded, task), _development_rooms, seed)
    return drawer.sets(long=task in long_task_names(None))


def _development_rooms(place: int) -> list[int]:
    return [room(FURTHER_SPLITS["development"], place, number) for number in range(ROUNDS)]


def _world(loaded: LoadedTask, task: str, name: str = "") -> WorldPart:
    given = Given.named({"strategy": "none"} | ({"world": name} if name else {}))
    return make_world(run_config(task, given=given), loaded.domain)


def _spread(do: Callable[[T], R], what: Sequence[T], jobs: int) -> Iterator[R]:
    if jobs <= 1 or len(what) <= 1:
        yield from map(do, what)
        return
    context = get_context("spawn")
    with ProcessPoolExecutor(min(jobs, len(what)), mp_context=context) as pool:
        yield from pool.map(do, what)
