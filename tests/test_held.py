"""What holds a robot of the user's own, and a run: limits, dead senses, errors, interruption."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from forestall.assembly.configuration import Given, run_config
from forestall.assembly.make import prepare, run_episode
from forestall.conclusion import MonitorConfig
from forestall.domain.load import shipped
from forestall.errors import InputError, ObservationError, PartError
from forestall.monitor import Monitor
from forestall.records.record import RunRecorder, read_record
from forestall.runtime import Runtime, RuntimeConfig
from forestall.strategies.none import NoReplanning
from forestall.supervision import Limits
from forestall.tasks.files import load_task
from forestall.testing.misbehaving import Fault, changes, raises
from forestall.testing.symbolic_world import SymbolicWorld
from forestall.types.decision import Hold, Outcome
from forestall.types.episode import EpisodeEnd, SkillStatus, TroubleKind
from forestall.types.graph import SceneGraph
from forestall.types.observation import GripperState, Observation
from forestall.types.plan import Subtask
from forestall.types.runtime import When
from test_monitor import ALARM, DONE, GO, PLAN, REFUSED, REPLAN, Scripted, scene, started


class Seeing:
    """Sees the scene, as long as nothing keeps it."""

    def __init__(self) -> None:
        self.until = threading.Event()
        self.until.set()
        self.resets = 0

    def reset(self) -> None:
        self.resets += 1

    def perceive(self, observation: Observation) -> SceneGraph:
        self.until.wait(10)
        if observation.time_s == 13:
            raise ObservationError("the picture is black")
        return scene()

    def scope(self, graph: SceneGraph, subtask: Subtask) -> SceneGraph:
        return replace(graph, subtask=subtask)

    def describe(self) -> Mapping[str, str]:
        return {}


def seen(time_s: float) -> Observation:
    return Observation((), GripperState(None, (0, 0, 0)), time_s, graph=scene())


def seeing(limits: Limits, *answers: object) -> tuple[Monitor, Seeing]:
    eye = Seeing()
    config = MonitorConfig(limits=limits)
    monitor = Monitor(Scripted(*answers), shipped("household"), eye, config)  # type: ignore[arg-type]
    monitor.start(PLAN)
    return monitor, eye


def test_perception_that_does_not_answer_holds_and_nothing_is_asked_before_a_new_start() -> None:
    monitor, eye = seeing(Limits(perceive_s=0.1))
    eye.until.clear()
    decision = monitor.before(seen(1))
    assert (decision.outcome, decision.hold) == (Outcome.HOLD, Hold.INTERNAL)
    assert decision.why == "perceiver did not answer within 0.1 s"
    assert decision.command is None and not decision.may_start
    assert decision.record is not None and decision.record.outcome is Outcome.HOLD
    again = monitor.before(seen(2))
    assert again.why == "perceiver has not come back since its time ran out"
    with pytest.raises(PartError, match="has not come back"):
        monitor.start(PLAN)
    with pytest.raises(InputError, match="judged before"):
        monitor.after(DONE)
    eye.until.set()
    monitor.start(PLAN)
    assert monitor.before(seen(3)).outcome is Outcome.PROCEED


def test_perception_is_told_what_was_carried_out_and_holds_where_it_fails_then() -> None:
    monitor, eye = seeing(Limits())
    told: list[tuple[Subtask, bool]] = []
    eye.acted = lambda *what: told.append(what)  # type: ignore[attr-defined]
    monitor.before(seen(1))
    monitor.after(REFUSED)
    assert told == [], "nothing was done"
    monitor.start(PLAN)
    monitor.before(seen(2))
    monitor.after(replace(DONE, status=SkillStatus.FAILED))
    monitor.before(seen(2.5))
    monitor.after(DONE)
    assert [(s.skill, done) for s, done in told] == [("pick_up", False), ("put_in", True)]

    def breaks(subtask: Subtask, succeeded: bool) -> None:
        raise ValueError(subtask.skill)

    eye.acted = breaks  # type: ignore[attr-defined]
    monitor.start(PLAN)
    monitor.before(seen(3))
    held = monitor.after(DONE)
    assert held is not None and (held.outcome, held.hold) == (Outcome.HOLD, Hold.INTERNAL)


def test_what_cannot_be_believed_is_looked_at_once_more_and_then_holds() -> None:
    monitor, _ = seeing(Limits())
    first = monitor.before(seen(13))
    assert (first.outcome, first.why) == (Outcome.LOOK, "perceiver: the picture is black")
    second = monitor.before(seen(13))
    assert (second.outcome, second.hold) == (Outcome.HOLD, Hold.SENSES)
    assert [r.looks for r in (first.record, second.record) if r is not None] == [1, 2]
    assert monitor.before(seen(14)).outcome is Outcome.PROCEED  # it sees again


def test_time_that_runs_back_is_not_believed() -> None:
    monitor, _ = seeing(Limits())
    assert monitor.before(seen(5)).may_start
    monitor.after(DONE)
    decision = monitor.before(seen(4))
    assert (decision.outcome, decision.why) == (
        Outcome.LOOK,
        "senses: time runs back: 4 s after 5 s",
    )


def test_a_scene_that_never_changes_is_not_believed_after_three_subtasks() -> None:
    monitor, strategy = started()
    monitor.start(type(PLAN)(PLAN.subtasks * 3))
    for _ in range(3):
        assert monitor.before(scene()).may_start
        monitor.after(DONE)
    assert monitor.before(scene()).outcome is Outcome.LOOK
    decision = monitor.before(scene())
    assert (decision.outcome, decision.hold) == (Outcome.HOLD, Hold.SENSES)
    assert "nothing that is seen has changed over 3 subtasks" in decision.why
    assert len(strategy.asked) == 3
    assert monitor.before(scene("Mug-2")).may_start


def test_driving_changes_no_scene_and_one_skill_may_fail_unseen() -> None:
    monitor, _ = started()
    drive = Subtask("navigate_to_obj", ("Mug",))
    put, pick = PLAN.subtasks[1], PLAN.subtasks[0]
    monitor.start(type(PLAN)((drive, drive, pick, drive, drive, put, drive)))
    for _ in range(6):
        assert monitor.before(scene()).may_start
        monitor.after(DONE)
    decision = monitor.before(scene())
    assert decision.outcome is Outcome.LOOK
    assert "nothing that is seen has changed over 6 subtasks" in decision.why


def test_alarms_in_a_row_hold_where_each_would_be_let_pass() -> None:
    alarm = replace(GO, verdict=ALARM)
    limits = Limits(max_alarms_in_a_row=2)
    monitor, _ = started(alarm, alarm, GO, alarm, alarm, alarm, on_alarm="proceed", limits=limits)
    monitor.start(type(PLAN)(PLAN.subtasks * 4))
    held = ["Mug-2", None] * 3
    for k in range(5):
        assert monitor.before(scene(held[k])).may_start, k
        monitor.after(DONE)
    decision = monitor.before(scene(held[5]))
    assert (decision.outcome, decision.hold) == (Outcome.HOLD, Hold.TOO_MANY)
    assert decision.why == "3 alarms in a row, and 2 are the most"


def test_alarms_of_who_only_watches_hold_nothing() -> None:
    alarm = replace(GO, verdict=ALARM, watched=(ALARM, ALARM), only_watched=True)
    limits = Limits(max_alarms_in_a_row=1)
    monitor, _ = started(alarm, alarm, alarm, on_alarm="proceed", limits=limits)
    monitor.start(type(PLAN)(PLAN.subtasks * 2))
    for held in ("Mug-2", None, "Mug-2"):
        assert monitor.before(scene(held)).may_start
        monitor.after(DONE)


def test_new_plans_in_a_row_hold_and_the_last_one_is_not_followed() -> None:
    monitor, _ = started(REPLAN, REPLAN, limits=Limits(max_repairs_in_a_row=1))
    assert monitor.before(scene()).outcome is Outcome.REPLAN
    plan = monitor.plan
    decision = monitor.before(scene())
    assert (decision.outcome, decision.hold, decision.plan) == (
        Outcome.HOLD,
        Hold.TOO_MANY,
        None,
    )
    assert monitor.plan == plan


def test_failures_in_a_row_hold() -> None:
    monitor, _ = started(limits=Limits(max_failures_in_a_row=1))
    monitor.before(scene())
    assert monitor.after(REFUSED) is None
    monitor.before(scene())
    decision = monitor.after(REFUSED)
    assert decision is not None
    assert (decision.outcome, decision.hold) == (Outcome.HOLD, Hold.TOO_MANY)
    assert decision.why == "2 subtasks refused or failed in a row, and 1 are the most"


def _runtime(fault: Fault, recorder: RunRecorder | None = None) -> tuple[Runtime, SymbolicWorld]:
    loaded = load_task("glue-peg")
    world = SymbolicWorld(loaded.domain, loaded.task.scene)

    class Given(Seeing):
        def perceive(self, observation: Observation) -> SceneGraph:
            assert observation.graph is not None
            return observation.graph

    return (
        Runtime(
            fault.around(world),
            Given(),
            NoReplanning(),
            loaded.domain,
            [] if recorder is None else [recorder],
            RuntimeConfig(limits=Limits(max_failures_in_a_row=2)),
        ),
        world,
    )


def test_a_held_run_has_a_record_that_reads_back(tmp_path: Path) -> None:
    fault = Fault("observe", raises(RuntimeError("no picture")), 2)
    runtime, world = _runtime(fault, RunRecorder(tmp_path))
    loaded = load_task("glue-peg")
    record = runtime.run(loaded.task, loaded.task.plan, 3)
    assert record.end is EpisodeEnd.ERROR
    assert record.failures == ("the run broke off: observe: RuntimeError: no picture",)
    again = read_record(tmp_path)
    assert (again.trouble, again.notes, again.end) == (record.trouble, record.notes, record.end)
    assert again.trouble is not None and again.trouble.kind is TroubleKind.WORLD
    assert [b.when for b in again.boundaries] == [When.BEFORE] * 2
    held = world.execute(loaded.task.plan.subtasks[0])
    assert (held.status, held.reason) == (SkillStatus.REFUSED, "the robot was told to hold")


@pytest.fixture
def ctrl_c() -> Iterator[None]:
    """Ctrl-C as Python has it, whoever set it before."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("ctrl_c")
def test_who_interrupts_a_run_finds_the_robot_held(tmp_path: Path) -> None:
    def interrupt(observation: Observation) -> Observation:
        ident = threading.main_thread().ident
        assert ident is not None, "the main thread runs"
        signal.pthread_kill(ident, signal.SIGINT)  # to whoever waits, as Ctrl-C comes
        time.sleep(0.05)
        return observation

    fault = Fault("observe", changes(interrupt), 2)
    runtime, world = _runtime(fault, RunRecorder(tmp_path))
    loaded = load_task("glue-peg")
    with pytest.raises(KeyboardInterrupt):
        runtime.run(loaded.task, loaded.task.plan, 3)
    assert world.execute(loaded.task.plan.subtasks[0]).status is SkillStatus.REFUSED
    left = read_record(tmp_path)
    assert left.end is EpisodeEnd.UNFINISHED
    assert len(left.boundaries) == 2  # what was written as it happened


def test_a_recorder_that_cannot_write_changes_no_run_and_is_not_complete(tmp_path: Path) -> None:
    recorder = RunRecorder(tmp_path / "run")
    (tmp_path / "run").write_text("a file where a folder should be")
    runtime, _ = _runtime(Fault("close", raises(RuntimeError("never called"))), recorder)
    loaded = load_task("glue-peg")
    record = runtime.run(loaded.task, loaded.task.plan, 3)
    assert record.end is EpisodeEnd.PLAN_FINISHED and not recorder.complete
    assert record.notes[0].startswith("listener RunRecorder failed in on_start: FileExistsError")
    again = RunRecorder(tmp_path / "good")
    runtime, _ = _runtime(Fault("close", raises(RuntimeError("never called"))), again)
    runtime.run(loaded.task, loaded.task.plan, 3)
    assert again.complete


def test_limits_are_options_of_a_run_and_stand_in_its_record() -> None:
    given = Given.said(["limit.observe_s=7", "limit.max_failures_in_a_row=0"])
    config = run_config(
        "glue-peg", given=given, strategy="none", world="symbolic", perceiver="given-graph"
    )
    limits = dict(run_episode(prepare(config), None).provenance)["loop"]["limits"]
    assert (limits["observe_s"], limits["max_failures_in_a_row"]) == (7.0, 0)
    assert limits["scan_s"] == Limits().scan_s
    with pytest.raises(InputError, match="did you mean observe_s"):
        run_config("glue-peg", given=Given.said(["limit.observes_s=7"]))
    with pytest.raises(InputError, match="observe_s is -1"):
        run_config("glue-peg", given=Given.said(["limit.observe_s=-1"]))


def test_a_run_may_follow_a_held_one() -> None:
    fault = Fault("scan", raises(RuntimeError("once")))
    runtime, _ = _runtime(fault)
    loaded = load_task("glue-peg")
    assert runtime.run(loaded.task, loaded.task.plan, 3).end is EpisodeEnd.ERROR
    fault.after = 100
    assert runtime.run(loaded.task, loaded.task.plan, 3).end is EpisodeEnd.PLAN_FINISHED
