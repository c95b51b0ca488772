"""Calls that end in time, and who is blamed when they do not."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import pytest

from forestall.deadline import Deadline
from forestall.errors import InputError, ObservationError, PartError, PerceptionError
from forestall.strategies.asked import AskedReplanner
from forestall.supervision import Limits, Supervisor, ask, deadline, doing
from forestall.types.verdict import Replan, ReplanOutcome

SHORT = Limits(perceive_s=0.1, judge_s=0.1, detect_s=0.05, observe_s=0.1, hold_s=0.1)


@pytest.fixture
def event() -> Iterator[threading.Event]:
    """Set at the end, so that nothing that hangs outlives its test."""
    until = threading.Event()
    yield until
    until.set()


def test_all_calls_come_from_one_thread_that_is_not_the_callers() -> None:
    calls = Supervisor()
    found = {calls.call("part", threading.get_ident, "perceive") for _ in range(5)}
    assert len(found) == 1
    assert threading.get_ident() not in found


def test_what_is_raised_names_the_innermost_part() -> None:
    def judge() -> None:
        with doing("strategy", "judge"), doing("detector", "detect"):
            raise KeyError("x")

    with pytest.raises(PartError, match="internal error in detector: KeyError: 'x'") as caught:
        Supervisor().call("monitor", judge, "judge")
    assert (caught.value.part, caught.value.internal, caught.value.late) == (
        "detector",
        True,
        False,
    )
    assert isinstance(caught.value.__cause__, KeyError)


def test_an_error_that_was_handled_blames_nobody() -> None:
    def judge() -> None:
        try:
            with doing("detector", "detect"):
                raise KeyError("x")
        except KeyError:
            pass
        raise ValueError("y")

    with pytest.raises(PartError, match="internal error in strategy: ValueError: y"):
        Supervisor().call("strategy", judge, "judge")


def test_an_error_on_purpose_is_told_as_it_is() -> None:
    def perceive() -> None:
        raise PerceptionError("the camera is gone")

    with pytest.raises(PartError, match=r"^perceiver: the camera is gone$") as caught:
        Supervisor().call("perceiver", perceive, "perceive")
    assert not caught.value.internal and not caught.value.senses

    def disbelieve() -> None:
        raise ObservationError("black")

    with pytest.raises(PartError) as caught:
        Supervisor().call("perceiver", disbelieve, "perceive")
    assert caught.value.senses


def test_what_does_not_come_back_is_named_and_nobody_is_asked_after_it(
    event: threading.Event,
) -> None:
    calls = Supervisor(SHORT)
    started = time.monotonic()
    with pytest.raises(PartError, match=r"^perceiver did not answer within 0.1 s$") as caught:
        calls.call("perceiver", event.wait, "perceive")
    assert time.monotonic() - started < 5
    assert caught.value.late and calls.late == "perceiver"
    with pytest.raises(PartError, match="perceiver has not come back"):
        calls.call("detector", lambda: 1, "detect")
    assert calls.aside("hold", lambda: "held", "hold") == "held"
    with pytest.raises(PartError, match="perceiver has not come back"):
        calls.renew()
    event.set()
    calls.renew()
    assert calls.call("detector", lambda: 1, "detect") == 1


def test_the_shorter_limit_of_what_is_going_on_holds(event: threading.Event) -> None:
    with pytest.raises(PartError, match=r"^detector did not answer within 0.05 s$"):
        Supervisor(SHORT).call(
            "strategy", lambda: ask("detector", "detect", bool, event.wait), "judge"
        )


def test_python_that_goes_round_for_ever_is_stopped_but_no_world_is() -> None:
    seen: list[threading.Thread] = []
    stop = threading.Event()

    def spin() -> None:
        seen.append(threading.current_thread())
        while not stop.is_set():
            time.sleep(0)

    for limit in ("perceive", "observe"):
        with pytest.raises(PartError, match="did not answer"):
            Supervisor(SHORT).call("part", spin, limit)
    of_ours, of_the_world = seen
    of_ours.join(5)
    assert not of_ours.is_alive()
    assert of_the_world.is_alive()
    stop.set()
    of_the_world.join(5)
    assert not of_the_world.is_alive()


def test_work_that_asks_its_deadline_is_told_to_stop() -> None:
    stopped = threading.Event()

    def plan() -> None:
        with doing("replanner", "detect"):
            until = deadline()
            assert 0 < until.left() <= 0.05
            while not until.cancelled:
                time.sleep(0.001)
        stopped.set()

    with pytest.raises(PartError, match="replanner"):
        Supervisor(SHORT).call("strategy", plan, "observe")  # as of a world: not interrupted
    assert stopped.wait(5)
    assert deadline().left() == float("inf")


def test_an_answer_of_another_type_is_an_error_of_the_part() -> None:
    with pytest.raises(PartError, match="internal error in perceiver: gave int instead of str"):
        Supervisor().call("perceiver", lambda: 1, "perceive", gives=str)  # type: ignore[arg-type, return-value]
    with pytest.raises(PartError, match="detector: gave None"):
        ask("detector", "detect", str, lambda: None)


def test_a_part_that_exits_has_failed() -> None:
    def leave() -> None:
        raise SystemExit(0)

    with pytest.raises(PartError, match="internal error in plug-in: SystemExit: 0"):
        Supervisor().call("plug-in", leave, "perceive")


@pytest.mark.parametrize("wrong", [{"observe_s": 0.0}, {"hold_s": -1.0}, {"max_unchanged": -1}])
def test_a_limit_that_cannot_be(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        Limits(**wrong)  # type: ignore[arg-type]


def test_a_limit_that_is_no_number() -> None:
    with pytest.raises(InputError, match="observe_s"):
        Limits(observe_s=float("nan"))


def test_a_supervisor_leaves_no_thread_behind() -> None:
    calls = Supervisor()
    thread = calls.call("part", threading.current_thread, "perceive")
    del calls
    thread.join(5)
    assert not thread.is_alive()


def test_a_replanner_that_takes_a_deadline_is_told_when_its_time_is_over() -> None:
    told: list[float] = []

    class Stopping:
        name = "stopping"

        def replan(self, context: object, diagnosis: object, deadline: object = None) -> Replan:
            assert isinstance(deadline, Deadline)
            told.append(deadline.left())
            return Replan(ReplanOutcome.NOT_FOUND)

    class Plain:
        name = "plain"

        def replan(self, context: object, diagnosis: object) -> Replan:
            return Replan(ReplanOutcome.NOT_FOUND)

    calls = Supervisor(Limits(replan_s=3.0))
    for part in (Stopping(), Plain()):
        asked = AskedReplanner(part)
        answer = calls.call("strategy", lambda a=asked: a.replan(None, None), "judge")  # type: ignore[misc]
        assert answer.outcome is ReplanOutcome.NOT_FOUND
    (left,) = told
    assert 0 < left <= 0.9 * 3.0
