"""Which episodes each experiment consists of.

Called by `conduct`; reads `statistics.cases`. In the run "watch" of every case all detectors judge
and none interrupts, so that they are compared on the same observations. "none" is the same without
them: the paper's detector sometimes asks for a second look, which takes the robot its time.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from forestall.assembly.configuration import Choice as Part
from forestall.assembly.configuration import Given, choices, domain_of, said_domain
from forestall.assembly.registry import find
from forestall.domain.model import Domain
from forestall.errors import InputError, UnknownNameError
from forestall.kinds import DETECTOR, STRATEGY
from forestall.statistics.cases import CASE_SETS, UNDISTURBED, Case, cases
from forestall.statistics.metrics import THRESHOLDS
from forestall.statistics.rows import EXACT, KIND, PLAIN, Setup

EXPERIMENTS = ("proactive", "detection", "ablation", "all")

PAGES = ("all", "telling", "none")
"""Telling are the proactive runs of failing cases, and those in which it raised a false alarm."""

BASELINES = ("objects", "caption", "image")

PAPER_DETECTOR = "scene-graph"


OWN = (DETECTOR.name, STRATEGY.name)
"""The kinds of parts that an experiment chooses by itself, run by run."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What is the same for every episode of an experiment.

    Args:
        given: what was said about the parts; strategy and detector are the experiment's own.
        pages: which episodes get a page of their own, one of `PAGES`.
    """

    given: Given = field(default_factory=Given)
    pages: str = "telling"

    def parts(self) -> tuple[Part, ...]:
        """The checked choice of every kind but the experiment's own.

        Raises:
            InputError: one that is not valid, or one that is the experiment's own.
        """
        for kind in self.given.kinds():
            if kind in OWN:
                raise InputError(f"an experiment chooses the {kind} of each run by itself")
        return tuple(part for part in choices(self.given) if part.kind not in OWN)

    def domain(self) -> Domain | None:
        """The domain that every task is read in, None for their own.

        Raises:
            InputError: it cannot be read.
        """
        said = said_domain(self.given)
        return None if said is None else domain_of(said)

    def to_json(self) -> dict[str, Any]:
        """As it stands in the folder of the results."""
        return {"parts": {p.kind: p.to_json() for p in self.parts()}, "pages": self.pages}


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

    @property
    def key(self) -> str:
        """As `EpisodeRow.key`."""
        return Setup(
            self.strategy,
            self.detector,
            self.threshold,
            self.without,
            self.profile,
            self.model,
            self.demonstrations,
        ).key(self.case)

    @property
    def scene(self) -> tuple[str, int]:
        """Runs of one scene see much the same and are done by one worker."""
        return self.case.task, self.case.seed


@dataclass(frozen=True, slots=True)
class Choice:
    """Which episodes are wanted.

    Args:
        experiment: one of `EXPERIMENTS`.
        split: "development" or "test".
        rounds: how many scenes each scenario gets.
        limit: cases of each set at most, taken from all tasks in turn; all by default.
        sets: only cases of these; all by default.
        strategies: only these; all by default.
    """

    experiment: str
    split: str = "test"
    rounds: int = 1
    limit: int | None = None
    sets: tuple[str, ...] = ()
    strategies: tuple[str, ...] = ()

    def runs(self) -> tuple[Run, ...]:
        """See `runs_for`."""
        return runs_for(self)

    def about(self, domain: Domain | None = None) -> dict[str, Any]:
        """What all its episodes have in common, with others of the same folder, in any domain."""
        return {"split": self.split, "rounds": self.rounds}

    def takes(self, run: Run) -> bool:
        """Whether a run is among the wanted sets and strategies."""
        of_set = not self.sets or run.case.set in self.sets
        return of_set and (not self.strategies or run.strategy in self.strategies)


def runs_for(choice: Choice) -> tuple[Run, ...]:
    """The wanted episodes, each once, the watched run of a case first.

    Raises:
        UnknownNameError: no such experiment, split, set or strategy.
        InputError: a limit below 1, or nothing that fits.
    """
    _check(choice)
    sets = {of: _limited(cases(of, choice.split, choice.rounds), choice.limit) for of in CASE_SETS}
    runs = [Run(c, s) for of in CASE_SETS for c in sets[of] for s in ("watch", "none")]
    if choice.experiment in ("proactive", "all"):
        for strategy in ("proactive", "online", "online-scene", "post-hoc"):
            runs += [Run(c, strategy) for c in sets["irreversible"]]
        for of in ("robofail", UNDISTURBED, "harmless"):
            runs += [Run(c, "proactive") for c in sets[of]]
    if choice.experiment in ("detection", "all"):
        for detector in (PAPER_DETECTOR, *BASELINES):
            for threshold in THRESHOLDS:
                runs += [Run(c, "proactive", detector, threshold) for c in sets["robofail"]]
    if choice.experiment in ("ablation", "all"):
        runs += [Run(c, "proactive") for c in sets["robofail"]]
        for part in ("reasoning", "validation"):
            runs += [Run(c, "proactive", without=part) for c in sets["robofail"]]
    wanted = tuple(run for run in dict.fromkeys(runs) if choice.takes(run))
    if not wanted:
        raise InputError(
            f"the experiment {choice.experiment} has no run of strategy "
            f"{' or '.join(choice.strategies)} on {' or '.join(choice.sets) or 'any set'}"
        )
    return wanted


def _check(choice: Choice) -> None:
    if choice.experiment not in EXPERIMENTS:
        raise UnknownNameError("experiment", choice.experiment, EXPERIMENTS)
    if choice.limit is not None and choice.limit < 1:
        raise InputError(f"--limit {choice.limit}: at least 1 case of each set is needed")
    for name in choice.sets:
        if name not in CASE_SETS:
            raise UnknownNameError("set of cases", name, CASE_SETS)
    for name in choice.strategies:
        find(STRATEGY.name, name)


def by_scene(runs: Iterable[Run]) -> list[list[Run]]:
    """Runs grouped by scene, in the order of the first of each; within a scene case by case.

    Runs of one case see the most alike; after the undisturbed one come those in the same room.
    """
    groups: dict[tuple[str, int], dict[Case, list[Run]]] = {}
    for run in runs:
        groups.setdefault(run.scene, {}).setdefault(run.case, []).append(run)
    return [
        [run for case in sorted(of, key=lambda c: c.set != UNDISTURBED) for run in of[case]]
        for of in groups.values()
    ]


def _limited(found: Sequence[Case], limit: int | None) -> Sequence[Case]:
    if limit is None:
        return found
    of_task: dict[str, list[Case]] = {}
    for case in found:
        of_task.setdefault(case.task, []).append(case)
    most = max(map(len, of_task.values()), default=0)
    in_turn = [several[k] for k in range(most) for several in of_task.values() if k < len(several)]
    return in_turn[:limit]
