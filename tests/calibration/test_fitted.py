"""Groups, fallback, parts and several judges: what stands for whom, and what is said of it."""

from __future__ import annotations

import pytest
from calibration_tables import BREAK, TURN, run, runs, table

from forestall.calibration import conformal
from forestall.calibration.conformal import NOT_JUDGED
from forestall.calibration.scores import Column, JudgedRun, Parts, Scores, scores_of
from forestall.errors import InputError, UnknownNameError
from forestall.types.verdict import Calibration


def test_a_task_with_enough_runs_has_its_own_threshold_and_another_that_of_all() -> None:
    made = table()
    own, pooled = made.fit("many"), made.fit("few")
    assert (own.task, own.runs) == ("many", 99)
    assert (pooled.task, pooled.runs) == (None, 104)
    many, everything = made.scores.matrix("many"), made.scores.matrix()
    assert own.lines[0].threshold == conformal.threshold(many[:, 0].tolist(), 0.05)
    assert pooled.lines[0].threshold == conformal.threshold(everything[:, 0].tolist(), 0.05)
    line = made.of("likeness", "few").threshold(TURN, 0.9)
    assert line.calibration is Calibration.CALIBRATED
    assert line.note == "at most 0.05 false alarms per run by 104 good runs of all tasks"
    assert made.fit("never heard of") == pooled == made.fit(None)
    assert table(by_task=False).fit("many") == table(by_task=False).fit(None)


def test_too_few_runs_are_uncalibrated_and_the_own_threshold_stands() -> None:
    made = table(runs(many=7, few=5))
    line = made.of("likeness", "many").threshold(TURN, 0.9)
    assert (line.value, line.calibration) == (0.9, Calibration.UNCALIBRATED)
    assert line.note == (
        "uncalibrated: 12 good runs of all tasks bound nothing at 0.05 false alarms per run; "
        "7 more are needed"
    )
    assert made.fit_of("many", divided=False).smallest == 1 / 8
    wider = table(runs(many=7, few=5), level=0.15)
    assert wider.fit("many").usable and wider.fit("few").task is None


def test_what_cannot_be_undone_has_a_line_of_its_own_under_the_same_bound() -> None:
    made = table(parts=Parts.UNDO, level=0.1)
    asked = made.of("likeness", "many")
    assert made.fit("many").divided
    turning, breaking = asked.threshold(TURN, 0.9).value, asked.threshold(BREAK, 0.9).value
    columns = made.scores.matrix("many")
    for place, value in enumerate((turning, breaking)):
        spent = (columns[:, place] < value).mean()
        assert 0 < spent <= 0.1
    assert ((columns[:, 0] < turning) | (columns[:, 1] < breaking)).mean() <= 0.1
    tight, loose = (table(parts=Parts.UNDO, level=0.1, share=s) for s in (0.9, 0.1))
    lines = [t.of("likeness", "many").threshold(BREAK, 0.9).value for t in (loose, tight)]
    assert lines[0] < lines[1]


def test_what_is_too_few_to_be_divided_is_not() -> None:
    made = table(runs(many=25), parts=Parts.UNDO, share=0.9)
    fit = made.fit("many")
    assert (fit.task, fit.divided) == ("many", False)
    asked = made.of("likeness", "many")
    assert asked.threshold(BREAK, 0.9) == asked.threshold(TURN, 0.9)
    assert fit == made.fit_of("many", divided=False)


def test_each_skill_may_have_its_own() -> None:
    made = table(runs(many=199), parts=Parts.SKILL, level=0.1)
    asked = made.of("likeness", "many")
    assert [c.part for c in made.scores.columns] == [BREAK, TURN]
    assert asked.threshold(BREAK, 0.9).value != asked.threshold(TURN, 0.9).value
    unknown = asked.threshold("melt", 0.9)
    assert unknown.calibration is Calibration.UNCALIBRATED
    assert "no good run has likeness judged before melt" in unknown.note
    assert asked.p_value("melt", 0.5) is None


def test_a_judge_that_says_yes_or_no_may_alarm_if_good_runs_rarely_had_one() -> None:
    rare = table(runs(alarms=3), judges=("facts",)).of("facts", "many")
    often = table(runs(alarms=20), judges=("facts",)).of("facts", "many")
    assert rare.threshold(BREAK, 1.0).value == 1.0
    assert often.threshold(BREAK, 1.0).value == 0.0
    assert often.threshold(BREAK, 1.0).calibration is Calibration.CALIBRATED
    assert rare.p_value(BREAK, 0.0) == pytest.approx(4 / 100)
    assert rare.p_value(BREAK, 1.0) == 1.0


def test_two_judges_share_one_bound() -> None:
    both = table(runs(many=199, alarms=4), judges=("likeness", "facts"), level=0.1)
    fit = both.fit("many")
    assert fit.needed(0.1) == 19
    columns = both.scores.matrix("many")
    lines = [line.threshold for line in fit.lines]
    assert None not in lines
    alarmed = [
        any(t is not None and s < t for s, t in zip(row, lines, strict=True)) for row in columns
    ]
    assert 0.05 < sum(alarmed) / len(alarmed) <= 0.1
    with pytest.raises(UnknownNameError, match="judge of the calibration 'nobody'"):
        both.of("nobody", "many")


def test_scores_must_be_whole() -> None:
    with pytest.raises(InputError, match="nothing to calibrate with"):
        scores_of([JudgedRun("a", "t", ())])
    with pytest.raises(InputError, match="one is there twice"):
        scores_of([run("a", "t", 0.9), run("a", "t", 0.8)])
    with pytest.raises(InputError, match="each run needs 1 scores"):
        Scores((Column("j"),), ("a",), ("t",), ((0.1, 0.2),))
    with pytest.raises(InputError, match="not between 0 and 1"):
        scores_of([run("a", "t", 0.9)], share=1.0)
    with pytest.raises(InputError, match="level 2"):
        table(level=2)


def test_a_run_in_which_a_judge_was_silent_is_no_alarm_of_its() -> None:
    silent = JudgedRun("b", "t", run("b", "t", 0.9).boundaries[3:])
    scores = scores_of([run("a", "t", 0.8), silent])
    assert scores.extremes == ((0.8, 0.0 + 1.0), (NOT_JUDGED, 1.0))
