"""Forty faulty worlds and parts and more: each run ends in time, and its record says why."""

from __future__ import annotations

import pytest

from forestall.records.codec import record_from_json, record_to_json
from forestall.types.decision import Outcome
from forestall.types.episode import EpisodeEnd
from robot.bench import Robot, play
from robot.cases import CASES, Case

MOST_S = 10.0
"""A run takes some 0.1 s, what hangs 0.2 s; the rest is for a busy machine."""

AFTER_DEATH = 3
"""Commands that may follow when senses have died."""


@pytest.mark.parametrize("case", CASES, ids=lambda c: c.name.replace(" ", "-"))
def test_it_ends_held_or_judged_and_says_why(case: Case) -> None:
    played = case.play()
    record = played.record
    assert played.seconds < MOST_S
    if case.end is not None:
        assert record.end is case.end, (record.end, record.trouble)
    if case.kind is None:
        assert record.trouble is None or case.end is None
    else:
        assert record.trouble is not None
        assert (record.trouble.kind, record.trouble.part) == (case.kind, case.blamed)
        assert record.trouble.text
        assert record.trouble.text in record.failures[0]
        assert record.success is (case.call == "after_episode")  # by then all was done
    assert any(case.note in note for note in record.notes) or not case.note, record.notes
    if record.end in (EpisodeEnd.HELD, EpisodeEnd.ERROR, EpisodeEnd.STOPPED):
        assert played.holds == 1
        assert record.notes[0].startswith("hold: ")
    else:
        assert played.holds == 0
    if case.dead:
        assert played.after_fault <= AFTER_DEATH
    assert len(record.executed) <= played.commands <= len(record.executed) + 1
    assert played.listener.heard.count("executed") == len(record.executed)
    assert played.listener.heard.count("boundary") == len(record.boundaries)
    assert played.listener.heard[-1] == "end"
    assert played.listener.record is not None
    assert played.listener.record.end is record.end
    assert record_from_json(record_to_json(record)).trouble == record.trouble
    assert record_from_json(record_to_json(record)).notes == record.notes


def test_a_held_run_says_so_at_the_boundary_where_it_was_held() -> None:
    case = next(c for c in CASES if c.name == "detector raises")
    record = case.play().record
    last = record.boundaries[-1]
    assert last.outcome is Outcome.HOLD
    assert last.why == record.trouble.text if record.trouble else ""
    assert record.trouble is not None
    assert record.trouble.text == "internal error in detector scene-graph: KeyError: 'Mug-7'"
    assert "raise error" in record.trouble.trace


def test_there_are_at_least_forty_and_without_a_fault_nothing_happens() -> None:
    assert len({c.name for c in CASES}) == len(CASES) >= 40
    played = play(Robot())
    assert played.record.success
    assert (played.holds, played.record.notes, played.record.trouble) == (0, (), None)
