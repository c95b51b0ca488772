from __future__ import annotations

from dataclasses import replace

from forestall.records.derived import (
    Mark,
    RowKind,
    done_before,
    moments,
    plan_rows,
    provenance_of,
)
from forestall.types.episode import SkillStatus
from forestall.types.plan import Plan, Subtask, same_step
from forestall.types.runtime import When
from forestall.types.verdict import Decision
from report import records


def test_moments_follow_the_run_and_track_the_plan() -> None:
    found = moments(records.potato_record())
    assert [m.mark for m in found].count(Mark.PROCEEDED) == 13
    alarm = found[records.ALARM_INDEX]
    assert alarm.mark is Mark.REPLANNED
    assert alarm.executed is None
    assert [str(s) for s in alarm.before] == list(records.NOMINAL[7:])
    assert [str(s) for s in alarm.after or ()][:2] == list(records.INSERTED)
    for m in found:
        if m.executed is not None:
            assert same_step(m.before[0], m.executed.subtask)
    assert len(found[-1].before) == 1


def test_every_mark_has_its_occasion() -> None:
    assert [m.mark for m in moments(records.troubled_record())] == [
        Mark.DISMISSED,
        Mark.FAILED,
        Mark.UNSOLVED,
    ]
    unjudged = moments(records.unjudged_record())
    assert [m.mark for m in unjudged].count(Mark.UNJUDGED) == 10
    assert unjudged[8].mark is Mark.REFUSED
    assert (unjudged[9].boundary, unjudged[9].position) == (None, None)
    record = records.potato_record()
    first = record.boundaries[0]
    assert first.verdict is not None
    for decision, mark in ((Decision.LOOK_AGAIN, Mark.LOOKED), (Decision.STOP, Mark.STOPPED)):
        changed = replace(first, verdict=replace(first.verdict, decision=decision))
        (moment, *_) = moments(replace(record, boundaries=(changed,)))
        assert moment.mark is mark
    assert moments(records.empty_record()) == ()


def test_moments_after_a_subtask_are_their_own() -> None:
    found = moments(records.looked_after_record())
    assert [m.when for m in found] == [When.BEFORE, When.AFTER] * 15 + [When.END]
    assert all((m.executed is not None) == (m.when is When.BEFORE) for m in found)
    start, over = found[16:18]
    assert (start.mark, over.mark) == (Mark.REFUSED, Mark.REPLANNED)
    assert len(start.before) == len(over.before) + 1 == 3
    assert over.boundary is not None
    assert len(done_before(records.looked_after_record(), over.boundary)) == 9
    assert found[18].before == over.after
    assert found[-1].before == ()


def test_an_alarm_that_was_only_watched_is_unsolved_if_something_must_change() -> None:
    record = records.potato_record()
    watched = replace(record.boundaries[records.ALARM_INDEX], replan=None)
    (moment, *_) = moments(replace(record, boundaries=(watched,), executed=()))
    assert moment.mark is Mark.UNSOLVED
    assert watched.diagnosis is not None
    harmless = replace(watched, diagnosis=replace(watched.diagnosis, must_change=()))
    (moment, *_) = moments(replace(record, boundaries=(harmless,), executed=()))
    assert moment.mark is Mark.DISMISSED


def test_plan_rows_tell_done_kept_removed_and_inserted() -> None:
    done = records.potato_record().executed[:1]
    before = Plan.parse(["pick_up(Plate)", "open_obj(Microwave)"]).subtasks
    after = Plan.parse(["pick_up(Bowl-1)", "pick_up(Plate-1)"]).subtasks
    rows = plan_rows(done, before, after)
    assert [r.kind for r in rows] == [
        RowKind.DONE,
        RowKind.INSERTED,
        RowKind.KEPT,
        RowKind.REMOVED,
    ]
    assert rows[0].status is SkillStatus.SUCCEEDED
    assert str(rows[2].before) == "pick_up(Plate)"
    assert str(rows[2].after) == "pick_up(Plate-1)"


def test_the_same_step_may_name_the_instance() -> None:
    plate = Subtask.parse("pick_up(Plate)")
    assert same_step(plate, Subtask.parse("pick_up(Plate-1)"))
    assert not same_step(Subtask.parse("pick_up(Plate-2)"), Subtask.parse("pick_up(Plate-1)"))
    assert not same_step(plate, Subtask.parse("slice_obj(Plate)"))


def test_provenance_as_mapping_pairs_or_word() -> None:
    record = replace(
        records.empty_record(),
        provenance=(("perception", (("segmenter", "s"),)), ("memory", "demos.db")),
    )
    assert provenance_of(record, "perception") == {"segmenter": "s"}
    assert provenance_of(record, "memory") == {"memory": "demos.db"}
    assert provenance_of(record, "versions") == {}
