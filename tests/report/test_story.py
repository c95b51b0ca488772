from __future__ import annotations

from dataclasses import replace

from forestall.report.story import story
from forestall.types.episode import EpisodeEnd, Trouble, TroubleKind

from . import records


def test_a_story_says_what_went_wrong_when_it_was_seen_and_how_it_ended() -> None:
    assert story(records.potato_record()) == (
        "Before step 8, pick_up(Plate-1), after 28.0 s, the alarm was “There is a bowl inside the "
        "microwave, so I cannot put the plate into it”: a new plan took the place of the old one; "
        "the task succeeded after 52.0 s of robot time."
    )


def test_the_first_sentence_alone_is_told_and_further_alarms_are_counted() -> None:
    record = records.potato_record()
    more = [
        replace(b, sentence=f"{b.sentence} I put it on the counter and go on.") if b.sentence else b
        for b in record.boundaries
    ]
    later = records.boundary(10, record.boundaries[10].subtask, alarm=True)
    more[10] = replace(later, replan=None)
    told = story(replace(record, boundaries=tuple(more)))
    assert "put the plate into it”: a new plan" in told
    assert "on the counter" not in told
    assert ", 1 more alarm came; " in told


def test_nobody_judged_and_a_step_was_refused() -> None:
    assert story(records.unjudged_record()) == (
        "Nobody judged the scene, and put_in(Plate, Microwave) was refused (Microwave-1 has no "
        "room for Plate-1); the task failed after 52.0 s of robot time: inside(?plate, Microwave): "
        "the plate is on CounterTop-2."
    )


def test_nothing_went_wrong() -> None:
    record = records.potato_record()
    quiet = tuple(
        records.boundary(b.index, b.subtask) for b in record.boundaries if b.diagnosis is None
    )
    told = story(replace(record, boundaries=quiet))
    assert told.startswith("No alarm was raised in 13 subtasks, and none of them failed; ")


def test_an_alarm_that_changed_nothing_and_a_run_that_nobody_scored() -> None:
    told = story(records.troubled_record())
    assert told.startswith("Before step 1, navigate_to_obj(")
    assert ": the plan stayed (nothing to change), 1 more alarm came; " in told
    assert told.endswith("the end was “stopped safely”, and nobody scored it.")


def test_runs_that_broke_off() -> None:
    whole = records.potato_record()
    begun = replace(whole, end=EpisodeEnd.UNFINISHED, success=None, executed=whole.executed[:3])
    assert story(begun).endswith("; the record breaks off after 3 subtasks.")
    late = Trouble(TroubleKind.LATE, "perception", "perception did not answer within 60 s.")
    held = replace(whole, end=EpisodeEnd.HELD, success=False, trouble=late)
    assert story(held).endswith("; the end was “held”: perception did not answer within 60 s.")
    assert story(records.empty_record()).startswith("The run ended before its first subtask; ")


def test_harm_is_told_before_goals_that_were_missed() -> None:
    whole = records.unjudged_record()
    harmed = replace(whole, harmed=((12.0, "spoiled(Potato-1)"),))
    assert story(harmed).endswith("of robot time: spoiled(Potato-1).")


def test_the_same_start_without_a_monitor_is_told_of() -> None:
    run, alone = records.potato_record(), records.unjudged_record()
    told = story(run, [alone])
    assert told.startswith(story(run))
    assert told.endswith(
        " Run once more without a monitor, the task failed after 52.0 s of robot time: "
        "inside(?plate, Microwave): the plate is on CounterTop-2."
    )
    sooner = replace(run, strategy="online", simulated_s=40.0)
    assert story(run, [sooner]).endswith(
        "Run once more with the strategy online, the task succeeded after 40.0 s of robot time, "
        "12.0 s sooner."
    )
