"""Which episodes each experiment consists of.

Called by `conduct`; reads `statistics.cases`. In the run "watch" of every case all detectors judge
and none interrupts, so that they are compared on the same observations. "none" is the same without
them: the paper's detector sometimes asks for a second look, which takes the robot its time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from itertools import product
from typing import Any, TypeVar

from forestall.assembly.configuration import Given
from forestall.assembly.registry import find
from forestall.domain.model import Domain
from forestall.errors import InputError, UnknownNameError
from forestall.kinds import STRATEGY
from forestall.statistics.cases import CASE_SETS, FURTHER_SETS, UNDISTURBED, Case, cases
from forestall.statistics.judges import THRESHOLDS
from forestall.statistics.rows import (
    EXACT,
    HONEST,
    KIND,
    MODEL,
    MODEL_PLANS,
    PERFECT,
    PLAIN,
    TEMPLATES,
    Setup,
)
from forestall.statistics.watches import PAPER_SET
from forestall.tasks.files import task_names
from forestall.tasks.variation import MOST

EXPERIMENTS = ("proactive", "detection", "ablation", "transfer", "all")

BASELINES = ("objects", "caption", "image")

PROFILES = (HONEST, KIND)

MODELS = (EXACT, "coarse", "wrong")
"""What the monitor's domain is like; in the watched runs the plan is checked in all of them."""

ALONE = ("watch", "none", "retry-once")
"""Nobody judges in these, or nobody acts on it; run on every case."""

BEFORE, AFTER = ("proactive", "plan-check"), ("online", "online-scene", "post-hoc")
"""Strategies that step in before a subtask, and after one."""

IRREVERSIBLE = "irreversible"

DEMONSTRATIONS = 8
"""Of each task in the honest household."""

PART = 0.03
"""Of the cases of each set in "all": an hour on two cores. Of the undisturbed runs of the honest
household there are all that are another case's twin, too."""

STEPPING_IN = 1 / 6
"""Of these, in the honest household, those in which strategies step in."""

TURN = 3
"""By so many cases the sets of the honest household are apart, so that a part of each has rooms of
its own. A part of a set begins with another task than that of the set before."""

ABLATED = 0.5
"""Of RoboFail's cases in "all", those that are run without reasoning or validation, too."""

QUICK = 0.1
"""Of the cases that are run otherwise, in a quick experiment."""

QUICK_TASKS = 2
"""Of a quick experiment in the honest household; the longer ones beside. In the kind one 1."""

QUICK_DEMONSTRATIONS = 1
"""Of each task in the honest household, in a quick experiment."""

QUICK_TURN = 12
"""Of strategies that step in, and trying again, each twelfth acts on a case, others on the next."""

PAPER_DETECTOR = "scene-graph"


T = TypeVar("T")

_WITH_PART = ("transfer", "all")
"""Experiments that take a part of every set."""

_ELSEWHERE = " of other tasks"
"""Ends what is said of a memory without the task at hand."""


@cache
def paper_threshold() -> float:
    """The threshold of the paper's detector when nothing is said."""
    threshold: float = (
        Given.named({"detector": PAPER_DETECTOR}).chosen("detector").options["threshold"]
    )
    return threshold


@dataclass(frozen=True, slots=True, order=True)
class Run:
    """One episode: a case and who watches over it."""

    case: Case
    strategy: str
    detector: str = PAPER_DETECTOR
    threshold: float = field(default_factory=paper_threshold)
    without: str | None = None
    profile: str = KIND
    model: str = EXACT
    demonstrations: str = PLAIN
    reasoning: str = TEMPLATES
    sensor: str = PERFECT

    @property
    def setup(self) -> Setup:
        """Who watches over it, and what he knows."""
        return Setup.of(self)

    @property
    def shown_in(self) -> tuple[str, ...]:
        """The tasks whose demonstrations it has."""
        if not self.demonstrations.endswith(_ELSEWHERE):
            return (self.case.task,)
        return tuple(t for t in _tasks() if t != self.case.task)

    @property
    def key(self) -> str:
        """As `EpisodeRow.key`."""
        return self.setup.key(self.case)

    @property
    def scene(self) -> tuple[str, str, int]:
        """Runs of one scene see much the same and are done by one worker."""
        return self.profile, self.case.task, self.case.seed


@dataclass(frozen=True, slots=True)
class Choice:
    """Which episodes are wanted.

    Args:
        experiment: one of `EXPERIMENTS`.
        split: "development" or "test".
        rounds: how many scenes each scenario gets.
        limit: cases of each set at most, taken from all tasks in turn; all by default.
        sets: only cases of these; all by default.
        tasks: only cases of these; all by default.
        strategies: only these; all by default.
        profiles: of the household; by default the honest one, and for "all" both.
        part: of the cases of each set in "all" and "transfer", from all tasks in turn.
        quick: a tenth of that, of few tasks; of the strategies that step in one case of each set
            has a twelfth, and of the undisturbed runs there are no twins.
        demonstrations: of each task in the honest household, each another way to do it; by default
            `DEMONSTRATIONS`, `QUICK_DEMONSTRATIONS` in a quick experiment.
        models: whether a language model reasons in an ablation, too.
    """

    experiment: str
    split: str = "test"
    rounds: int = 1
    limit: int | None = None
    sets: tuple[str, ...] = ()
    strategies: tuple[str, ...] = ()
    profiles: tuple[str, ...] = ()
    part: float = PART
    quick: bool = False
    demonstrations: int | None = None
    models: bool = False
    tasks: tuple[str, ...] = ()

    @property
    def ways(self) -> int:
        """How many demonstrations of each task there are in the honest household."""
        if self.demonstrations is not None:
            return self.demonstrations
        return QUICK_DEMONSTRATIONS if self.quick else DEMONSTRATIONS

    def runs(self) -> tuple[Run, ...]:
        """See `runs_for`."""
        return runs_for(self)

    def about(self, domain: Domain | None = None) -> dict[str, Any]:
        """What all its episodes have in common, with others of the same folder, in any domain."""
        return {"split": self.split, "rounds": self.rounds}

    def takes(self, run: Run) -> bool:
        """Whether a run is among the wanted sets, tasks and strategies."""
        asked = (
            (self.sets, run.case.set),
            (self.tasks, run.case.task),
            (self.strategies, run.strategy),
        )
        return all(not some or one in some for some, one in asked)

    def households(self) -> tuple[str, ...]:
        """The profiles that it runs in, the honest one first."""
        default = PROFILES if self.experiment == "all" else (HONEST,)
        return tuple(p for p in PROFILES if p in (self.profiles or default))


def runs_for(choice: Choice) -> tuple[Run, ...]:
    """The wanted episodes, each once, the watched run of a case first.

    Raises:
        UnknownNameError: no such experiment, split, set, task, strategy or profile.
        InputError: a limit below 1, or nothing that fits.
    """
    _check(choice)
    runs = [run for profile in choice.households() for run in _in(profile, choice)]
    wanted = tuple(run for run in dict.fromkeys(runs) if choice.takes(run))
    if not wanted:
        raise InputError(
            f"the experiment {choice.experiment} has no run of strategy "
            f"{' or '.join(choice.strategies) or 'any kind'} on "
            f"{' or '.join(choice.sets) or 'any set'} of {' or '.join(choice.tasks) or 'any task'}"
        )
    return wanted


def _in(profile: str, choice: Choice) -> Iterator[Run]:
    """The episodes of an experiment in one household."""
    of_sets = _sets(profile, choice)
    honest = profile == HONEST
    told = f"{choice.ways} varied" if honest else PLAIN
    if choice.experiment == "transfer":
        found = (c for several in of_sets.values() for c in several)
        told = f"{told}{_ELSEWHERE}"
        yield from (Run(c, "watch", profile=profile, demonstrations=told) for c in found)
        return
    run = partial(Run, profile=profile, demonstrations=told)
    alone = ALONE[:2] if choice.quick else ALONE
    yield from (run(case, s) for found in of_sets.values() for case in found for s in alone)
    if choice.experiment in ("proactive", "all"):
        part = STEPPING_IN if honest and choice.experiment == "all" else 1.0
        turn = QUICK_TURN if choice.quick else 1
        for place, several in enumerate(of_sets.values()):
            for case in _some(several, part):
                more = [run(case, s) for s in ALONE[len(alone) :]]
                yield from [*more, *_stepping_in(case, run)][place % turn :: turn]
    robofail = of_sets[PAPER_SET]
    if choice.experiment == "detection":
        for case, detector in product(robofail, (PAPER_DETECTOR, *BASELINES)):
            yield from (run(case, "proactive", detector, t) for t in THRESHOLDS)
    if choice.experiment == "ablation" or (choice.experiment == "all" and not honest):
        for case in robofail if choice.experiment == "ablation" else _some(robofail, ABLATED):
            yield run(case, "proactive")
            yield from (run(case, "proactive", without=p) for p in ("reasoning", "validation"))
            asked = (MODEL, MODEL_PLANS) if choice.models else ()
            yield from (run(case, "proactive", reasoning=r) for r in asked)


def _stepping_in(case: Case, run: Callable[..., Run]) -> Iterator[Run]:
    """The strategies that step in, on one case."""
    yield from (run(case, s) for s in BEFORE)
    honest = run(case, "none").profile == HONEST
    if honest or case.set == IRREVERSIBLE:
        yield from (run(case, s) for s in AFTER)
    if honest:
        yield from (run(case, s, model=m) for m in MODELS[1:] for s in BEFORE)


def _sets(profile: str, choice: Choice) -> dict[str, Sequence[Case]]:
    """The cases of every set that is run in a household."""
    honest = profile == HONEST
    found = {}
    for place, of in enumerate((*CASE_SETS, *FURTHER_SETS) if honest else CASE_SETS):
        every: Sequence[Case] = cases(of, choice.split, choice.rounds, further=honest)
        part = choice.part if choice.experiment in _WITH_PART else 1.0
        if choice.quick:
            task = _tasks()[place % QUICK_TASKS if honest else 0]  # sets share rooms, and memories
            every = _some(every, part * QUICK, 0, _place(task, every))
        elif part < 1:
            every = _some(every, part, TURN * place if honest else 0, place)
        found[of] = every
    if honest and not choice.quick:
        chosen = {c.twin for several in found.values() for c in several}
        every = cases(UNDISTURBED, choice.split, choice.rounds, further=True)
        found[UNDISTURBED] = [c for c in every if c in chosen]
    return {of: in_turn(several, choice.limit) for of, several in found.items()}


def _some(found: Sequence[Case], part: float, turn: int = 0, task: int = 0) -> Sequence[Case]:
    """A balanced part of the cases of a set, at least one: so many of every task.

    `turn`: with which case of each task it begins, and `task`: with which task; whatever they are,
    a smaller part is in a larger.
    """
    return in_turn(found, max(1, round(len(found) * part)), turn, task)


def _place(task: str, found: Sequence[Case]) -> int:
    """The place of a task among those of a set; 0 if it is none of them."""
    return next((k for k, t in enumerate(dict.fromkeys(c.task for c in found)) if t == task), 0)


@cache
def _tasks() -> tuple[str, ...]:
    """Those of the undisturbed runs."""
    return tuple(sorted({c.task for c in cases(UNDISTURBED, "test")}))


def _check(choice: Choice) -> None:
    if choice.experiment not in EXPERIMENTS:
        raise UnknownNameError("experiment", choice.experiment, EXPERIMENTS)
    if choice.limit is not None and choice.limit < 1:
        raise InputError(f"--limit {choice.limit}: at least 1 case of each set is needed")
    if not 0 < choice.part <= 1:
        raise InputError(f"--part {choice.part}: give a number above 0, at most 1")
    if not 1 <= choice.ways <= MOST:
        raise InputError(f"--demonstrations {choice.demonstrations}: 1 to {MOST} are possible")
    for name in choice.sets:
        if name not in (*CASE_SETS, *FURTHER_SETS):
            raise UnknownNameError("set of cases", name, (*CASE_SETS, *FURTHER_SETS))
    for name in choice.tasks:
        if name not in task_names():
            raise UnknownNameError("task", name, task_names())
    for name in choice.profiles:
        if name not in PROFILES:
            raise UnknownNameError("profile of the household", name, PROFILES)
    for name in choice.strategies:
        find(STRATEGY.name, name)


def by_scene(runs: Iterable[Run]) -> list[list[Run]]:
    """Runs grouped by scene, in the order of the first of each; within a scene case by case.

    Runs of one case see the most alike; after the undisturbed one come those in the same room.
    """
    groups: dict[tuple[str, str, int], dict[Case, list[Run]]] = {}
    for run in runs:
        groups.setdefault(run.scene, {}).setdefault(run.case, []).append(run)
    return [
        [run for case in sorted(of, key=lambda c: c.scenario is not None) for run in of[case]]
        for of in groups.values()
    ]


def in_turn(
    found: Sequence[Case], limit: int | None, turn: int = 0, task: int = 0
) -> Sequence[Case]:
    """At most so many cases, from all tasks in turn; `turn`, `task`: with which it begins."""
    if limit is None:
        return found
    of_task: dict[str, list[Case]] = {}
    for case in found:
        of_task.setdefault(case.task, []).append(case)
    tasks = [_from(turn, several) for several in _from(task, list(of_task.values()))]
    most = max(map(len, tasks), default=0)
    every = [several[k] for k in range(most) for several in tasks if k < len(several)]
    return every[:limit]


def _from(first: int, things: list[T]) -> list[T]:
    """The same in a ring, from another one on."""
    at = first % len(things) if things else 0
    return things[at:] + things[:at]
