"""The world, and the parts that perceive and judge, behind calls that end in time.

Built by the loop and the monitor, which say nothing to either but through these. What comes back
is of the type that it should be, times are numbers that do not run backwards, and whatever else
happens is a `PartError` that names the call.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from forestall.errors import ForestallError, ObservationError, PartError
from forestall.seams.acting import Unnamed, Vantages
from forestall.supervision import Supervisor, checked_answer
from forestall.types.episode import SkillOutcome
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation, Vec3
from forestall.types.plan import Subtask
from forestall.types.runtime import StrategyAnswer
from forestall.types.verdict import Decision, Diagnosis, Replan, Verdict

if TYPE_CHECKING:
    from forestall.domain.model import Domain
    from forestall.seams.acting import Environment
    from forestall.seams.judging import Strategy
    from forestall.seams.perceiving import Perceiver

Where = Mapping[str, Vec3 | None]
Scope = Callable[[SceneGraph, Subtask], SceneGraph]


class SupervisedWorld:
    """An environment whose calls end in time.

    Every call raises PartError: the world raised, was late, gave something else, or shows what
    cannot be so now.
    """

    def __init__(self, environment: Environment, calls: Supervisor) -> None:
        self._environment, self._calls = environment, calls
        self._now_s = -math.inf

    def reset(self, seed: int) -> None:
        """Put the world into its start state."""
        self._now_s = -math.inf
        self._calls.call("reset", lambda: self._environment.reset(seed), "reset")

    def scan(self, thorough: bool = False) -> Observation:
        """Look all around."""
        return self._seen("scan", lambda: self._environment.scan(thorough))

    def observe(self, focus: Sequence[Vec3] = ()) -> Observation:
        """Look towards points."""
        return self._seen("observe", lambda: self._environment.observe(focus))

    def approach(self, name: str, where: Where) -> None:
        """Drive to a thing; `where` things are is told to a world that shares no names."""
        world = self._environment

        def drive() -> float:
            if isinstance(world, Unnamed):
                return world.approach_at(name, where)
            return world.approach(name)

        self._calls.call("approach", drive, "approach")

    def vantages(self, point: Vec3) -> tuple[Vec3, ...]:
        """Where the camera could be to look at a point, besides where it is."""
        world = self._environment
        if not isinstance(world, Vantages):
            return ()
        return self._calls.call("vantages", lambda: tuple(world.vantages(point)), "observe")

    def look_from(self, place: Vec3, point: Vec3) -> None:
        """Bring the camera to one of them."""
        world = self._environment
        assert isinstance(world, Vantages), "it has offered the place"
        self._calls.call("look_from", lambda: world.look_from(place, point), "approach")

    def execute(self, subtask: Subtask, where: Where) -> SkillOutcome:
        """Run one skill."""
        world = self._environment

        def do() -> SkillOutcome:
            if isinstance(world, Unnamed):
                return world.execute_at(subtask, where)
            return world.execute(subtask)

        return self._calls.call("execute", do, "execute", gives=SkillOutcome)

    def time_s(self) -> float:
        """The world's clock, which does not go back; what it said last where nobody can ask it."""
        if self._calls.late is not None:
            return self._now_s
        now_s = self._calls.call("time", lambda: _finite(self._environment.time_s), "time")
        if now_s < self._now_s:
            raise _unbelievable("time", f"went back from {self._now_s:.1f} s to {now_s:.1f} s")
        self._now_s = now_s
        return now_s

    def hold(self) -> str:
        """Tell the robot to stop where it is, at once; what came of that, in words."""
        hold = getattr(self._environment, "hold", None)
        if hold is None:
            return "hold: this world has none; whether anything still moves is not known"
        try:
            self._calls.aside("hold", hold, "hold")
        except PartError as error:
            return f"hold: the robot could not be told: {error}"
        return "hold: the robot was told and has answered"

    def _seen(self, call: str, look: Callable[[], Observation]) -> Observation:
        asked_s = self.time_s()
        observation = self._calls.call(call, look, call, gives=Observation)
        age_s = asked_s - observation.time_s
        if not age_s <= self._calls.limits.max_age_s:
            raise _unbelievable(call, f"shows what was seen {age_s:.1f} s before it was asked for")
        return observation


class SupervisedParts:
    """Perceiver and strategy, whose answers come in time.

    Args:
        strategy: judges.
        perceiver: None where scene graphs are given.
        scope: the part of a graph that concerns a subtask.
        domain: what plans are checked against.
        calls: makes the calls.
    """

    def __init__(
        self,
        strategy: Strategy,
        perceiver: Perceiver | None,
        scope: Scope,
        domain: Domain,
        calls: Supervisor,
    ) -> None:
        self._name = f"strategy {strategy.name}"
        self._domain = domain
        self._perceiver, self._scope, self._calls = perceiver, scope, calls

    @property
    def perceives(self) -> bool:
        """Whether there is a perceiver."""
        return self._perceiver is not None

    def reset(self) -> None:
        """The perceiver forgets; also what was late is forgotten, if it has come back.

        Raises:
            PartError: it has not, or the perceiver cannot be reset.
        """
        self._calls.renew()
        if self._perceiver is not None:
            self._calls.call("perceiver", self._perceiver.reset, "perceive")

    def perceive(self, observation: Observation) -> SceneGraph:
        """The whole graph as believed now.

        Raises:
            PartError: it failed, was late, or does not believe what it was given.
        """
        assert self._perceiver is not None, "the monitor has seen to that"
        perceive = self._perceiver.perceive
        return self._calls.call(
            "perceiver", lambda: perceive(observation), "perceive", gives=SceneGraph
        )

    def acted(self, subtask: Subtask, succeeded: bool) -> None:
        """A skill was carried out, and the robot says whether it succeeded.

        Raises:
            PartError: the perceiver failed or was late.
        """
        told = getattr(self._perceiver, "acted", None)
        if told is not None:
            self._calls.call("perceiver", lambda: told(subtask, succeeded), "perceive")

    def best_vantage(self, eyes: Sequence[Vec3], points: Sequence[Vec3]) -> int | None:
        """Which of some places of the camera is worth going to; None for none.

        Raises:
            PartError: the perceiver failed or was late, or named a place that is not there.
        """
        asked = getattr(self._perceiver, "best_vantage", None)
        if asked is None or not eyes:
            return None
        best = self._calls.call("perceiver", lambda: asked(eyes, points), "perceive")
        if best is not None and best not in range(len(eyes)):
            raise PartError("perceiver", f"named place {best!r} of {len(eyes)}")
        return None if best is None else int(best)

    @property
    def domain(self) -> Domain:
        """What plans are checked against and decisions are told in."""
        return self._domain

    def scope(self, graph: SceneGraph, subtask: Subtask) -> SceneGraph:
        """The part of a graph that concerns a subtask.

        Raises:
            PartError: the perceiver failed or was late.
        """
        scope = self._scope
        return self._calls.call(
            "perceiver", lambda: scope(graph, subtask), "perceive", gives=SceneGraph
        )

    def judge(self, ask: Callable[..., StrategyAnswer], *about: Any) -> StrategyAnswer:
        """What the strategy answers.

        Raises:
            PartError: it failed, was late, or gave no answer that can be followed.
        """
        name = self._name
        answer = self._calls.call(name, lambda: ask(*about), "judge", gives=StrategyAnswer)
        for given, kinds in (
            (answer.decision, Decision),
            (answer.verdict, Verdict | None),
            (answer.diagnosis, Diagnosis | None),
            (answer.replan, Replan | None),
        ):
            checked_answer(name, given, kinds)
        plan = None if answer.replan is None else answer.replan.plan
        if plan is not None:
            try:
                self._domain.check_plan(plan)
            except ForestallError as error:
                raise PartError(name, f"gave a plan that cannot be: {error}") from error
        return answer


def described(perceiver: Perceiver, calls: Supervisor) -> Mapping[str, str]:
    """What a perceiver says of itself.

    Raises:
        PartError: it failed or was late.
    """
    return calls.call("perceiver", perceiver.describe, "perceive")


def _finite(seconds: float) -> float:
    if not math.isfinite(seconds):
        raise ValueError(f"{seconds} is no time")
    return float(seconds)


def _unbelievable(call: str, why: str) -> PartError:
    error = PartError(call, why)
    error.__cause__ = ObservationError(why)
    return error
