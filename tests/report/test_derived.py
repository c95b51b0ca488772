from __future__ import annotations

from dataclasses import replace

from forestall.report.derived import (
    Mark,
    RowKind,
    moments,
    plan_rows,
    provenance_of,
)
from forestall.types.episode import SkillStatus
from forestall.types.plan import Plan, Subtask, same_step
from forestall.types.verdict import Decision

from . import records


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
