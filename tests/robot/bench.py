"""One run on the bench with something wrong in it, in a world of facts alone."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

from forestall.assembly.configuration import Given, run_config
from forestall.assembly.make import prepare
from forestall.assembly.parts import Assembly
from forestall.assembly.recording import RecordingJob, record_one
from forestall.config import DEMONSTRATION_SEEDS
from forestall.domain.model import Domain
from forestall.kinds import DETECTOR, PERCEIVER, REASONER, REPLANNER, RETRIEVER, VALIDATOR
from forestall.runtime import Runtime, RuntimeConfig
from forestall.seams import OracleView
from forestall.strategies.online import Online
from forestall.strategies.proactive import Proactive
from forestall.supervision import Limits
from forestall.tasks.faults import apply_scene_faults
from forestall.tasks.goals import TruthGoalChecker
from forestall.testing.misbehaving import Fault
from forestall.testing.symbolic_world import SymbolicWorld
from forestall.types.demonstration import Demonstration
from forestall.types.episode import EpisodeRecord, SkillOutcome
from forestall.types.observation import Observation
from forestall.types.plan import Subtask

TASK = "glue-peg"
DISTURBED = "hole-occupied"
SYMBOLIC = Given.named({"world": "symbolic", "perceiver": "given-graph"})


@dataclass(slots=True)
class Robot:
    """What a run is put together from; a case changes one thing of it.

    `world`, `perceiver` and the parts of the strategy are put together by `play`.
    """

    faults: dict[str, Fault] = field(default_factory=dict)
    scenario: str | None = None
    online: bool = False
    limits: dict[str, float] = field(default_factory=dict)
    release: threading.Event = field(default_factory=threading.Event)

    def with_fault(self, name: str, good: Any) -> Any:
        """A part with what is wrong with it."""
        return self.faults[name].around(good) if name in self.faults else good


class Watched:
    """A world that counts what it is told."""

    def __init__(self, inner: Any, faults: Mapping[str, Fault]) -> None:
        self._inner, self._faults = inner, faults
        self.commands = 0
        self.after_fault = 0
        self.holds = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)

    def execute(self, subtask: Subtask) -> SkillOutcome:
        self.commands += 1
        self.after_fault += any(f.happened for f in self._faults.values())
        outcome: SkillOutcome = self._inner.execute(subtask)
        return outcome

    def hold(self) -> None:
        self.holds += 1
        self._inner.hold()


class Telling:
    """A listener that keeps what it hears."""

    def __init__(self) -> None:
        self.heard: list[str] = []
        self.record: EpisodeRecord | None = None

    def on_start(self, record: EpisodeRecord) -> None:
        self.heard.append("start")

    def on_boundary(self, boundary: Any, context: Any) -> None:
        self.heard.append("boundary")

    def on_executed(self, executed: Any, time_s: float) -> None:
        self.heard.append("executed")

    def on_end(self, record: EpisodeRecord) -> None:
        self.heard.append("end")
        self.record = record


@dataclass(frozen=True, slots=True)
class Played:
    """What came of a run."""

    record: EpisodeRecord
    listener: Telling
    seconds: float
    commands: int
    after_fault: int
    holds: int


@cache
def memory() -> tuple[Demonstration, ...]:
    """Demonstrations of the task."""
    found = []
    for k in range(4):
        seed = DEMONSTRATION_SEEDS + 10 * k
        found.append(replace(record_one(RecordingJob(TASK, seed, SYMBOLIC)), id=f"{TASK}-{seed}"))
    return tuple(found)


def play(robot: Robot, perceiver: Any = None, world: Callable[[Any], Any] | None = None) -> Played:
    """Run the task once.

    Args:
        robot: what is wrong.
        perceiver: another one than that of given graphs.
        world: put around the world of facts.
    """
    prepared = prepare(run_config(TASK, scenario=robot.scenario, seed=3, given=SYMBOLIC))
    loaded = prepared.loaded
    domain = loaded.domain
    parts = Assembly(prepared.config.choices, domain, memory())
    true = SymbolicWorld(domain, apply_scene_faults(loaded.task.scene, prepared.faults, domain))
    seen = true if world is None else world(true)
    watched = Watched(robot.with_fault("world", seen), robot.faults)
    perceive = robot.with_fault("perceiver", perceiver or parts.part(PERCEIVER))
    retriever, detector, reasoner, replanner, validator = (
        robot.with_fault(name, parts.part(kind))  # type: ignore[misc]
        for name, kind in (
            ("retriever", RETRIEVER),
            ("detector", DETECTOR),
            ("reasoner", REASONER),
            ("replanner", REPLANNER),
            ("validator", VALIDATOR),
        )
    )
    strategy: Any = Proactive(retriever, detector, reasoner, replanner, validator)
    if robot.online:
        scope = perceive.scope
        strategy = Online(retriever, detector, reasoner, replanner, validator, scope)
    first = Telling()
    runtime = Runtime(
        watched,
        perceive,
        robot.with_fault("strategy", strategy),
        domain,
        [first, robot.with_fault("listener", Telling())],
        RuntimeConfig(limits=Limits(**robot.limits)),  # type: ignore[arg-type]
    )
    score = robot.with_fault("scorer", _Scorer(domain, true)).score
    started = time.perf_counter()
    try:
        record = runtime.run(loaded.task, prepared.plan, 3, robot.scenario, score)
    finally:
        seconds = time.perf_counter() - started
        robot.release.set()
    return Played(record, first, seconds, watched.commands, watched.after_fault, watched.holds)


class _Scorer:
    def __init__(self, domain: Domain, oracle: OracleView) -> None:
        self._checker, self._oracle = TruthGoalChecker(domain), oracle

    def score(self, record: EpisodeRecord) -> EpisodeRecord:
        """The record with the truth."""
        strict, weak, failures = self._checker.check(record.task.goal, self._oracle)
        failures = (*record.failures, *failures)
        return replace(record, success=strict, weak_success=weak, failures=failures)


def frozen(fresh: bool) -> Callable[..., Any]:
    """Shows for ever what it showed first; `fresh`: and says that it sees it now."""
    kept: list[Observation] = []

    def instead(call: Callable[..., Observation], *args: Any, **named: Any) -> Observation:
        now = call(*args, **named)
        kept.append(now)
        return replace(kept[0], time_s=now.time_s) if fresh else kept[0]

    return instead
