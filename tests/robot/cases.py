"""What can go wrong with a robot, its world and its parts, and how each run has to end."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from forestall.errors import ObservationError, PerceptionError
from forestall.testing.misbehaving import Fault, Instead, changes, gives, hangs, raises, spins
from forestall.types.episode import EpisodeEnd, SkillOutcome, SkillStatus, TroubleKind
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation
from forestall.types.plan import Plan, Subtask
from forestall.types.verdict import Calibration, Decision, Replan, ReplanOutcome, Verdict
from robot.bench import DISTURBED, Played, Robot, frozen, play
from robot.pictures import (
    Looking,
    Pictured,
    black,
    flat,
    grey,
    in_millimetres,
    leapt,
    pictures,
    stuck,
    without_depth,
)

SHORT_S = 0.2
"""The limit of a call that hangs."""

HANGS: Instead = hangs
"""Stands for a call that does not come back before its run is over."""


@dataclass(frozen=True)
class Case:
    """One thing that goes wrong.

    Args:
        name: of the case.
        part: which is at fault: world, perceiver, a part of the strategy, listener, scorer.
        call: of it.
        instead: what is done instead.
        after: calls that go well before.
        limit: the limit that is short here.
        limits: others.
        disturbed: whether there is something to warn of and to repair.
        online: whether the strategy judges after subtasks.
        end: how the run has to end; None: any end, so that nothing follows from the fault.
        kind: the sort of trouble that the record has to name, None for none.
        blamed: the part that it has to name.
        note: what its notes have to say.
        also: another fault: part, call, what is done instead, and after how many calls.
        camera: whether there are pictures.
        dead: whether the senses are dead, so that no more than three commands may follow.
    """

    name: str
    part: str
    call: str
    instead: Instead
    after: int = 0
    limit: str = ""
    limits: Mapping[str, float] = field(default_factory=dict)
    disturbed: bool = False
    online: bool = False
    end: EpisodeEnd | None = EpisodeEnd.HELD
    kind: TroubleKind | None = None
    blamed: str = ""
    note: str = ""
    also: tuple[str, str, Instead, int] | None = None
    camera: bool = False
    dead: bool = False

    def play(self) -> Played:
        """Run it."""
        robot = Robot(scenario=DISTURBED if self.disturbed else None, online=self.online)
        robot.limits = dict(self.limits)
        if self.limit:
            robot.limits[f"{self.limit}_s"] = SHORT_S
        instead = hangs(robot.release) if self.instead is HANGS else self.instead
        robot.faults[self.part] = Fault(self.call, instead, self.after)
        if self.also is not None:
            part, call, other, after = self.also
            robot.faults[part] = Fault(call, other, after)
        return play(robot, Looking(), Pictured) if self.camera else play(robot)


class UnspeakableError(Exception):
    """An error that cannot even be told."""

    def __str__(self) -> str:
        raise RuntimeError("no words")


MOTOR = RuntimeError("motor off")
BUG = KeyError("Mug-7")
REFUSED = SkillOutcome(SkillStatus.REFUSED, 0.0, "no")
FAILED = SkillOutcome(SkillStatus.FAILED, 1.0, "slipped")
DONE = SkillOutcome(SkillStatus.SUCCEEDED, 1.0)
WORLD, LATE, SENSES = TroubleKind.WORLD, TroubleKind.LATE, TroubleKind.SENSES
INTERNAL, TOO_MANY = TroubleKind.INTERNAL, TroubleKind.TOO_MANY
ERROR, FINISHED = EpisodeEnd.ERROR, EpisodeEnd.PLAN_FINISHED
ALARM = Verdict(Decision.REPLAN, "liar", 0.1, 0.9, Calibration.FIXED)


def _raising(call: str, **more: Any) -> Case:
    after = 0 if call in ("reset", "scan") else 1
    return Case(
        f"world raises in {call}",
        "world",
        call,
        raises(MOTOR),
        after,
        end=ERROR,
        kind=WORLD,
        blamed="time" if call == "time_s" else call,
        **more,
    )


def _hanging(call: str, **more: Any) -> Case:
    after = 0 if call in ("reset", "scan") else 1
    limit = "time" if call == "time_s" else call
    name = f"world hangs in {call}"
    return Case(name, "world", call, HANGS, after, limit, kind=LATE, blamed=limit, **more)


def _camera(name: str, instead: Instead, after: int = 2) -> Case:
    return Case(
        f"camera {name}",
        "world",
        "scan|observe",
        instead,
        after,
        kind=SENSES,
        blamed="perceiver",
        camera=True,
        dead=True,
    )


def _time(change: Callable[[float], Any]) -> Instead:
    return changes(change)


def _observed(change: Callable[[Observation], Observation]) -> Instead:
    return changes(change)


def _graph(change: Callable[[SceneGraph], SceneGraph]) -> Instead:
    def of(observation: Observation) -> Observation:
        assert observation.graph is not None
        return replace(observation, graph=change(observation.graph))

    return changes(of)


def _black(graph: SceneGraph) -> SceneGraph:
    return SceneGraph(())


_serial = iter(range(10**6))


def _renamed(graph: SceneGraph) -> SceneGraph:
    """Every movable thing under a new name at every look: a detector that tracks nothing."""
    new = {n.id: f"{n.category}-{100 + next(_serial)}" for n in graph.nodes if "-" in n.id}
    return SceneGraph(
        tuple(replace(n, id=new.get(n.id, n.id)) for n in graph.nodes),
        tuple(
            replace(r, subject=new.get(r.subject, r.subject), object=new.get(r.object, r.object))
            for r in graph.relations
        ),
    )


def _flooded(graph: SceneGraph) -> SceneGraph:
    """Fifteen hundred things that are not there."""
    like = next(n for n in graph.nodes if n.box_m is not None)
    more = tuple(replace(like, id=f"{like.category}-{1000 + k}") for k in range(1500))
    return SceneGraph((*graph.nodes, *more), graph.relations, None, graph.hidden)


def _jumping(graph: SceneGraph) -> SceneGraph:
    """Everything somewhere else at every look."""
    step = 0.5 * (1 + next(_serial) % 7)

    def moved(point: Any) -> Any:
        return None if point is None else (point[0] + step, point[1] - step, point[2])

    def box(b: Any) -> Any:
        return None if b is None else replace(b, low=moved(b.low), high=moved(b.high))

    nodes = (replace(n, centroid_m=moved(n.centroid_m), box_m=box(n.box_m)) for n in graph.nodes)
    return SceneGraph(tuple(nodes), graph.relations, None, graph.hidden)


def _forgetful(graph: SceneGraph) -> SceneGraph:
    """Half of the things, other ones each time."""
    odd = next(_serial) % 2
    kept = {n.id for k, n in enumerate(graph.nodes) if k % 2 == odd or "-" not in n.id}
    return SceneGraph(
        tuple(n for n in graph.nodes if n.id in kept),
        tuple(r for r in graph.relations if {r.subject, r.object} <= kept),
    )


def _nonsense(replan: Replan) -> Replan:
    plan = Plan((Subtask("fly", ("Moon-1",)),))
    return replace(replan, outcome=ReplanOutcome.SOLVED, plan=plan)


def _mine(name: str, part: str, call: str, instead: Instead, **more: Any) -> Case:
    kind = more.pop("kind", INTERNAL)
    return Case(f"{part} {name}", part, call, instead, kind=kind, **more)


CASES: tuple[Case, ...] = (
    # --- the world ---
    *(_raising(c) for c in ("reset", "scan", "observe", "execute", "time_s")),
    _raising("approach", disturbed=True),
    *(_hanging(c) for c in ("reset", "scan", "observe", "execute", "time_s")),
    _hanging("approach", disturbed=True),
    Case(
        "world exits the program",
        "world",
        "execute",
        raises(SystemExit(0)),
        1,
        end=ERROR,
        kind=WORLD,
        blamed="execute",
    ),
    Case(
        "world raises what cannot be told",
        "world",
        "observe",
        raises(UnspeakableError()),
        1,
        end=ERROR,
        kind=WORLD,
        blamed="observe",
    ),
    Case(
        "world cannot hold",
        "world",
        "hold",
        raises(MOTOR),
        also=("perceiver", "perceive", raises(BUG), 2),
        kind=INTERNAL,
        blamed="perceiver",
        note="hold: the robot could not be told: hold: RuntimeError: motor off",
    ),
    Case(
        "world hangs in hold",
        "world",
        "hold",
        HANGS,
        limit="hold",
        also=("perceiver", "perceive", raises(BUG), 2),
        kind=INTERNAL,
        blamed="perceiver",
        note="hold: the robot could not be told: hold did not answer within 0.2 s",
    ),
    Case(
        "world shows nothing",
        "world",
        "observe",
        gives(None),
        1,
        end=ERROR,
        kind=WORLD,
        blamed="observe",
        dead=True,
    ),
    Case(
        "world says what no skill says",
        "world",
        "execute",
        gives("done"),
        1,
        end=ERROR,
        kind=WORLD,
        blamed="execute",
    ),
    Case(
        "world says that all is done and does nothing",
        "world",
        "execute",
        gives(DONE),
        kind=SENSES,
        blamed="senses",
        limits={"max_repairs_in_a_row": 3},
    ),
    Case(
        "world refuses everything",
        "world",
        "execute",
        gives(REFUSED),
        end=EpisodeEnd.STOPPED,
    ),
    Case(
        "world fails in everything",
        "world",
        "execute",
        gives(FAILED),
        kind=TOO_MANY,
        blamed="monitor",
        limits={"max_failures_in_a_row": 3},
    ),
    Case(
        "clock is no number",
        "world",
        "time_s",
        gives(float("nan")),
        3,
        end=ERROR,
        kind=WORLD,
        blamed="time",
    ),
    Case(
        "clock runs backwards",
        "world",
        "time_s",
        _time(lambda t: -t),
        8,
        kind=SENSES,
        blamed="time",
        dead=True,
    ),
    Case(
        "pictures run backwards",
        "world",
        "observe",
        _observed(lambda o: replace(o, time_s=-o.time_s)),
        2,
        kind=SENSES,
        blamed="senses",
        limits={"max_age_s": 1e6},
        dead=True,
    ),
    # --- senses ---
    _camera("goes black", pictures(black)),
    _camera("has no signal", pictures(grey)),
    _camera("measures the same distance everywhere", pictures(flat)),
    _camera("measures no distance", pictures(without_depth)),
    _camera("changes its unit", pictures(in_millimetres)),
    _camera("leaps", pictures(leapt)),
    _camera("shows the same picture for ever", stuck()),
    Case(
        "observations are old",
        "world",
        "observe",
        frozen(fresh=False),
        1,
        kind=SENSES,
        dead=True,
        blamed="observe",
        limits={"max_age_s": 6},
    ),
    Case(
        "observations are old and stamped anew",
        "world",
        "observe",
        frozen(fresh=True),
        1,
        kind=SENSES,
        dead=True,
        blamed="senses",
        limits={"max_unchanged": 1},  # before a judge stops for what it takes to be so
    ),
    Case(
        "nothing is seen any more",
        "world",
        "observe",
        _graph(_black),
        1,
        kind=SENSES,
        dead=True,
        blamed="senses",
    ),
    Case("things jump", "world", "observe", _graph(_jumping), 1, end=None),
    Case("things have new names at every look", "world", "observe", _graph(_renamed), 1, end=None),
    Case("a flood of things", "world", "observe", _graph(_flooded), 1, end=None),
    Case("half of the things at a time", "world", "observe", _graph(_forgetful), 1, end=None),
    # --- perception ---
    _mine("raises", "perceiver", "perceive", raises(BUG), after=2, blamed="perceiver"),
    _mine(
        "says that a camera is gone",
        "perceiver",
        "perceive",
        raises(PerceptionError("the camera is gone")),
        after=2,
        kind=TroubleKind.FAILED,
        blamed="perceiver",
    ),
    _mine(
        "does not believe it",
        "perceiver",
        "perceive",
        raises(ObservationError("the picture is black")),
        after=2,
        kind=SENSES,
        blamed="perceiver",
        dead=True,
    ),
    _mine(
        "does not believe the first look",
        "perceiver",
        "perceive",
        raises(ObservationError("the picture is black")),
        kind=SENSES,
        blamed="perceiver",
        dead=True,
    ),
    _mine(
        "hangs",
        "perceiver",
        "perceive",
        HANGS,
        after=2,
        limit="perceive",
        kind=LATE,
        blamed="perceiver",
        dead=True,
    ),
    _mine(
        "goes round for ever",
        "perceiver",
        "perceive",
        spins(),
        after=2,
        limit="perceive",
        kind=LATE,
        blamed="perceiver",
    ),
    _mine(
        "sees nothing that is a graph",
        "perceiver",
        "perceive",
        gives({"nodes": []}),
        after=2,
        blamed="perceiver",
    ),
    _mine(
        "forgets everything",
        "perceiver",
        "perceive",
        gives(SceneGraph(())),
        after=2,
        end=None,
        kind=None,
    ),
    _mine("cannot be reset", "perceiver", "reset", raises(BUG), blamed="perceiver"),
    _mine("cannot say what it is", "perceiver", "describe", raises(BUG), blamed="perceiver"),
    _mine("cannot cut a graph", "perceiver", "scope", raises(BUG), after=1, blamed="perceiver"),
    # --- what judges ---
    _mine(
        "raises", "strategy", "before_subtask", raises(BUG), after=1, blamed="strategy proactive"
    ),
    _mine(
        "raises after a subtask",
        "strategy",
        "after_subtask",
        raises(BUG),
        after=1,
        blamed="strategy proactive",
    ),
    _mine(
        "raises at the end", "strategy", "after_episode", raises(BUG), blamed="strategy proactive"
    ),
    _mine(
        "hangs",
        "strategy",
        "before_subtask",
        HANGS,
        after=1,
        limit="judge",
        kind=LATE,
        blamed="strategy proactive",
    ),
    _mine(
        "says nothing",
        "strategy",
        "before_subtask",
        gives(None),
        after=1,
        blamed="strategy proactive",
    ),
    _mine("raises", "retriever", "retrieve", raises(BUG), after=1, blamed="retriever"),
    _mine(
        "finds what is no reference",
        "retriever",
        "retrieve",
        gives(["a page"]),
        after=1,
        blamed="retriever",
    ),
    _mine("raises", "detector", "judge", raises(BUG), after=1, blamed="detector scene-graph"),
    _mine(
        "raises after a subtask",
        "detector",
        "judge",
        raises(BUG),
        online=True,
        blamed="detector scene-graph",
    ),
    _mine(
        "hangs",
        "detector",
        "judge",
        HANGS,
        after=1,
        limit="detect",
        kind=LATE,
        blamed="detector scene-graph",
    ),
    _mine(
        "goes round for ever",
        "detector",
        "judge",
        spins(),
        after=1,
        limit="detect",
        kind=LATE,
        blamed="detector scene-graph",
    ),
    _mine(
        "says what is no verdict",
        "detector",
        "judge",
        gives(0.97),
        after=1,
        blamed="detector scene-graph",
    ),
    _mine(
        "scores with no number",
        "detector",
        "judge",
        changes(lambda v: replace(v, score=float("nan"))),
        after=1,
        kind=TroubleKind.FAILED,
        blamed="detector scene-graph",
    ),
    _mine(
        "alarms at everything",
        "detector",
        "judge",
        gives(ALARM),
        kind=TOO_MANY,
        blamed="monitor",
        limits={"max_alarms_in_a_row": 3},
    ),
    _mine(
        "raises",
        "reasoner",
        "diagnose",
        raises(BUG),
        disturbed=True,
        blamed="reasoner preconditions",
    ),
    _mine(
        "hangs",
        "reasoner",
        "diagnose",
        HANGS,
        disturbed=True,
        limit="diagnose",
        kind=LATE,
        blamed="reasoner preconditions",
    ),
    _mine(
        "explains with a number",
        "reasoner",
        "diagnose",
        gives(7),
        disturbed=True,
        blamed="reasoner preconditions",
    ),
    _mine("raises", "replanner", "replan", raises(BUG), disturbed=True, blamed="replanner planner"),
    _mine(
        "hangs",
        "replanner",
        "replan",
        HANGS,
        disturbed=True,
        limit="replan",
        kind=LATE,
        blamed="replanner planner",
    ),
    _mine(
        "plans with a skill that nobody has",
        "replanner",
        "replan",
        changes(_nonsense),
        disturbed=True,
        kind=TroubleKind.FAILED,
        blamed="strategy proactive",
    ),
    _mine("raises", "validator", "check", raises(BUG), after=2, disturbed=True, blamed="validator"),
    # --- who only listens or scores ---
    *(
        _mine(
            f"raises in {call}",
            "listener",
            call,
            raises(OSError("no space left on device")),
            end=FINISHED,
            kind=None,
            note=f"listener Telling failed in {call}: OSError: no space",
        )
        for call in ("on_start", "on_boundary", "on_executed", "on_end")
    ),
    _mine(
        "exits the program",
        "listener",
        "on_boundary",
        raises(SystemExit(1)),
        end=FINISHED,
        kind=None,
        note="listener Telling failed in on_boundary: SystemExit",
    ),
    *(
        _mine(
            f"hangs in {call}",
            "listener",
            call,
            HANGS,
            limit="listen",
            end=FINISHED,
            kind=None,
            note=f"listener Telling did not come back from {call} within 0.2 s",
        )
        for call in ("on_start", "on_boundary", "on_end")
    ),
    _mine(
        "raises",
        "scorer",
        "score",
        raises(BUG),
        end=FINISHED,
        kind=None,
        note="not scored: internal error in scorer: KeyError",
    ),
    _mine(
        "hangs",
        "scorer",
        "score",
        HANGS,
        limit="score",
        end=FINISHED,
        kind=None,
        note="not scored: scorer did not answer within 0.2 s",
    ),
    _mine(
        "says nothing",
        "scorer",
        "score",
        gives(None),
        end=FINISHED,
        kind=None,
        note="not scored: internal error in scorer: gave NoneType",
    ),
)
