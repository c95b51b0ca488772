import threading
import time

import pytest

from forestall.deadline import Deadline, TimeUp


def test_without_a_limit_only_the_switch_stops_it() -> None:
    deadline = Deadline(None)
    assert not deadline.over
    assert deadline.left() == float("inf")
    deadline.check()
    deadline.cancel()
    assert deadline.over
    assert deadline.left() == 0.0
    with pytest.raises(TimeUp, match="cancelled"):
        deadline.check()


def test_time_runs_from_when_it_is_made() -> None:
    deadline = Deadline(0.01)
    assert 0.0 < deadline.left() <= 0.01
    time.sleep(0.02)
    assert deadline.over
    assert deadline.left() == 0.0
    with pytest.raises(TimeUp, match="out of time"):
        deadline.check()


def test_an_inner_deadline_never_outlasts_the_outer_one() -> None:
    outer = Deadline(0.05)
    assert outer.within(60.0).left() <= 0.05
    assert outer.within(0.0).over
    assert not outer.over


def test_cancelling_goes_inwards_and_not_outwards() -> None:
    outer = Deadline(None)
    inner = outer.within(60.0)
    innermost = inner.within(None)
    inner.cancel()
    assert inner.over
    assert innermost.over
    assert not outer.over
    other = outer.within(60.0)
    outer.cancel()
    assert other.over


def test_another_thread_may_stop_the_work() -> None:
    deadline = Deadline(30.0)
    stopped = threading.Event()

    def work() -> None:
        with pytest.raises(TimeUp):
            while True:
                deadline.check()
        stopped.set()

    worker = threading.Thread(target=work)
    worker.start()
    deadline.cancel()
    worker.join(5.0)
    assert stopped.is_set()
