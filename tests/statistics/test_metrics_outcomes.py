import pytest
from rows_by_hand import failing, good, judged

from forestall.statistics.intervals import NOTHING
from forestall.statistics.orderings import (
    FAILS,
    HOLDS,
    UNDECIDED,
    UNMEASURED,
    Ordering,
    judges_differ,
    orderings,
    rates_differ,
    strategies_differ,
)
from forestall.statistics.outcomes import (
    by_setup,
    compared,
    of_set,
    outcome_metrics,
    prevented,
)
from forestall.statistics.rows import EpisodeRow
from forestall.statistics.watches import Watches


def irreversible(strategy: str, successes: int, n: int = 20) -> list[EpisodeRow]:
    return [failing(k, strategy, "irreversible", success=k < successes) for k in range(n)]


def test_a_run_that_broke_off_counts_as_failed() -> None:
    broken = failing(1, "proactive", success=True, weak_success=None, end="error", error="died")
    runs = [failing(0, "proactive", success=True, weak_success=True), broken]
    found = outcome_metrics(runs)
    for name in ("success", "weak_success", "prevented", "errors"):
        assert (found[name].count, found[name].n) == (1, 2), name


def test_the_weak_check_is_counted_where_there_is_one() -> None:
    runs = [failing(0, weak_success=True), failing(1, task="boil-water", weak_success=None)]
    assert outcome_metrics(runs)["weak_success"].n == 1


def test_execution_time_is_robot_time_and_computing_time() -> None:
    runs = [
        failing(0, "proactive", simulated_s=100.0, reasoning_s=2.0, success=True, replans=1),
        failing(1, "proactive", simulated_s=50.0, reasoning_s=4.0, end="stopped safely"),
    ]
    found = outcome_metrics(runs)
    assert found["tet_s"].value == 78.0
    assert (found["simulated_s"].value, found["reasoning_s"].value) == (75.0, 3.0)
    assert (found["tet_s_successful"].value, found["tet_s_successful"].n) == (102.0, 1)
    assert found["stopped"].count == found["replanned"].count == 1
    assert found["replans"].value == 0.5
    assert outcome_metrics([])["tet_s"].value is None


def test_a_watched_run_is_one_without_intervention() -> None:
    rows = [
        failing(0, "watch", reasoning_s=9.0, model_calls=3),
        failing(0, "none", simulated_s=80.0),
        failing(1, "watch", reasoning_s=9.0, simulated_s=60.0),
    ]
    setups = by_setup(rows)
    assert list(setups) == ["none"]
    found = outcome_metrics(of_set(setups["none"], "robofail"))
    assert (found["tet_s"].value, found["tet_s"].n) == (70.0, 2)
    assert found["model_calls"].value == 0.0


def test_a_strategy_is_named_by_what_differs() -> None:
    rows = [
        failing(0, "proactive"),
        failing(0, "proactive", threshold=0.85),
        failing(0, "proactive", detector="image", threshold=0.8),
        failing(0, "proactive", without="reasoning"),
        failing(0, "online", detector="", threshold=0.0),
        failing(0, "watch"),
    ]
    assert list(by_setup(rows)) == [
        "proactive",
        "online",
        "none",
        "proactive, detector image, threshold 0.8",
        "proactive, threshold 0.85",
        "proactive, without reasoning",
    ]


def test_strategies_are_compared_on_the_cases_that_both_were_run_on() -> None:
    setups = by_setup(
        irreversible("proactive", 3, 4)
        + irreversible("online", 1, 3)
        + [good(0, "proactive"), good(0, "online", success=False)]
    )
    found = compared(setups["proactive"], setups["online"], "irreversible")
    assert found.difference.value == pytest.approx(2 / 3)
    assert found.difference.n == 3
    harm = compared(setups["online"], setups["proactive"], "undisturbed")
    assert (harm.difference.value, harm.only_second) == (-1.0, 1)


def test_harm_counts_whatever_the_run_achieved() -> None:
    assert prevented(failing(0, success=False))
    assert not prevented(failing(0, success=True, harmed=("Egg broke",)))


def test_an_ordering_holds_fails_or_is_open() -> None:
    setups = by_setup(
        irreversible("proactive", 18)
        + irreversible("online", 6)
        + irreversible("post-hoc", 6)
        + irreversible("none", 5)
    )
    found = {
        (o.better, o.worse): o for o in orderings(setups, Watches.of([])) if o.topic == "strategies"
    }
    assert [o.verdict for o in found.values()] == [HOLDS, FAILS, UNDECIDED]
    assert (
        found["proactive", "online"]
        .sentence()
        .startswith(
            "proactive over online in success on the irreversible set: holds: 90.0 % against"
        )
    )
    assert "does not hold: 30.0 %" in found["online", "post-hoc"].sentence()
    assert "the interval includes 0" in found["post-hoc", "none"].sentence()
    worse = strategies_differ("strategies", setups, "none", "proactive", "irreversible")
    assert worse.verdict == FAILS


def test_few_runs_decide_nothing() -> None:
    setups = by_setup(irreversible("proactive", 4, 4) + irreversible("online", 0, 4))
    found = strategies_differ("strategies", setups, "proactive", "online", "irreversible")
    assert (found.verdict, found.difference.value) == (UNDECIDED, 1.0)
    assert "too few runs" in found.sentence()


def test_what_was_not_run_is_not_measured() -> None:
    found = orderings(by_setup(irreversible("proactive", 4)), Watches.of([]))
    assert {o.verdict for o in found} == {UNMEASURED}
    assert {o.topic for o in found} == {"strategies", "detectors", "ablations", "reasoning"}
    assert all(o.sentence().endswith(": not measured.") for o in found)


def test_detecting_more_by_alarming_more_is_not_better() -> None:
    always, sharp = "image", "scene-graph"
    rows = [failing(k, judged=judged({sharp: [0.95, 0.7], always: [0.8, 0.8]})) for k in range(20)]
    rows += [good(k, judged=judged({sharp: [0.95, 0.95], always: [0.8, 0.8]})) for k in range(20)]
    watched = Watches.of(rows)
    as_paper = rates_differ("detectors", watched, always, sharp, (0.9, 0.85, 0.8))
    assert as_paper.first == pytest.approx(2 / 3)
    assert as_paper.second == 1.0
    equal = judges_differ("detectors", watched, sharp, always, "detection at 5 % false alarms")
    assert (equal.first, equal.second, equal.verdict) == (1.0, 0.0, HOLDS)
    area = judges_differ("detectors", watched, sharp, always, "AUROC")
    assert (area.first, area.second) == (1.0, 0.5)


def test_names_of_detectors_are_shown_as_what_they_are() -> None:
    blank = Ordering("detectors", "scene-graph", "image", "AUROC", None, None, NOTHING)
    assert "over image (stand-in) in" in blank.sentence({"image": "image (stand-in)"})
