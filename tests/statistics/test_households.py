"""What is counted anew: two households, together asked judges, chance, costs, causes, rooms."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rows_by_hand import failing, good, judged, seen

from forestall.statistics.comparisons import ADDED, FALSE, IN_TIME, comparisons
from forestall.statistics.curves import risk, roc_band
from forestall.statistics.intervals import (
    BOOTSTRAP,
    EXACT,
    PIGEONHOLE,
    Clusters,
    Unit,
    mean,
    proportion,
)
from forestall.statistics.judgements import by_demonstrations, judgements
from forestall.statistics.judges import Together, demonstrations_of, is_variant, together
from forestall.statistics.metrics import asked_together, at_thresholds, point_metrics
from forestall.statistics.orderings import ALPHA, HOLDS, UNDECIDED, Ordering, holm
from forestall.statistics.outcomes import (
    by_setup,
    false_alarm_cost,
    harm_prevented,
    shared_cases,
    time_between,
)
from forestall.statistics.pairs import paired
from forestall.statistics.rooms import over_rooms
from forestall.statistics.rows import HONEST, EpisodeRow, Judged
from forestall.statistics.summary import summary
from forestall.statistics.sweep import Line
from forestall.statistics.tables import tables
from forestall.statistics.watches import ALL, Watches


def honest(row: EpisodeRow, **changes: Any) -> EpisodeRow:
    return replace(row, profile=HONEST, demonstrations="16 varied", **changes)


def true(boundaries: tuple[Judged, ...], until: int = 99) -> tuple[Judged, ...]:
    """The same, with the truth: the goal is in reach before a boundary."""
    return tuple(replace(j, possible=True, reachable=j.index < until) for j in boundaries)


def test_in_the_honest_household_a_run_fails_if_it_does_whatever_its_set() -> None:
    rows = [
        honest(failing(0, judged=true(seen(0.95, 0.5, 0.95), 1))),
        honest(failing(1, known=None, effect=None, success=True, judged=true(seen(0.95, 0.5)))),
        honest(good(2, judged=true(seen(0.95, 0.95, 0.5), 1), known=1, effect=2, success=False)),
        honest(good(3, judged=true(seen(0.95, 0.95, 0.95)))),
    ]
    found = point_metrics(at_thresholds(Watches.of(rows), "scene-graph"), ALL)
    counted = {m: (found[m].count, found[m].n) for m in found if found[m].count is not None}
    assert counted["in_time"] == (2, 2)
    assert counted["false_alarms_per_run_all"] == (1, 2)
    assert counted["false_alarms_per_run_harmless"] == (1, 1)
    # faultless are one boundary of each failing run, and all of the others
    assert counted["false_alarms_per_boundary_all"] == (1, 1 + 2 + 1 + 3)


def test_households_are_never_mixed() -> None:
    kind = [failing(k, judged=seen(0.5, 0.5, 0.5)) for k in range(4)]
    kind += [good(k, judged=seen(1.0, 1.0)) for k in range(4)]
    other = [honest(failing(k, judged=seen(0.95, 0.95, 0.95))) for k in range(4)]
    other += [honest(good(k, judged=seen(0.5, 0.95))) for k in range(4)]
    alone = summary(kind, {})["profiles"]["kind"]
    both = summary(kind + other, {})
    assert both["shown"] == HONEST
    assert both["profiles"]["kind"] == alone
    assert both["profiles"][HONEST]["detectors"]["scene-graph"]["fdr@0.90"]["count"] == 0
    assert alone["detectors"]["scene-graph"]["fdr@0.90"]["count"] == 4
    first, second = next(t for t in tables(both) if t.name == "side-by-side").rows[:2]
    assert (first[:2], second[:2]) == (("scene-graph", "kind"), ("scene-graph", "honest"))
    assert "(4/4)" in first[2] and "(0/4)" in second[2]


def test_a_scenario_in_several_rooms_is_drawn_whole_and_so_is_a_room() -> None:
    units = [Unit(room, scenario) for scenario in "abcdef" for room in range(3)]
    of_scenario = [float(k < 9) for k in range(18)]
    crossed, by_room = mean(of_scenario, units), mean(of_scenario, [u.room for u in units])
    assert (crossed.method, by_room.method) == (PIGEONHOLE, BOOTSTRAP)
    assert by_room.low == by_room.high == 0.5, "each room has as many of each"
    assert crossed.low is not None and crossed.low < 0.3
    of_room = [float(k % 3 == 0) for k in range(18)]
    assert mean(of_room, units).low == 0.0


def test_a_scenario_in_one_room_only_is_drawn_with_it() -> None:
    values = [0.0, 1.0, 1.0, 0.0, 1.0, 1.0]
    alone = [Unit(k // 2, f"scenario {k}") for k in range(6)]
    assert mean(values, alone) == mean(values, [k // 2 for k in range(6)])


def test_an_exact_interval_is_for_runs_that_share_nothing() -> None:
    hits = [True, False, True, True]
    apart = [Unit(k, f"s{k}") for k in range(4)]
    assert proportion(hits, apart).method == EXACT
    assert proportion(hits, [Unit(k, None) for k in range(4)]).method == EXACT
    assert proportion(hits, [Unit(k // 2, f"s{k}") for k in range(4)]).method == BOOTSTRAP
    assert proportion(hits, [Unit(k, f"s{k // 2}") for k in range(4)]).method == PIGEONHOLE


def test_weights_of_crossed_draws_are_products() -> None:
    units = [Unit(room, scenario) for scenario in "abc" for room in range(4)]
    weights = Clusters.of(units).weights.reshape(-1, 3, 4)
    rooms, scenarios = weights.sum(axis=1), weights.sum(axis=2)
    whole = weights.sum(axis=(1, 2))
    some = whole > 0
    product = scenarios[:, :, None] * rooms[:, None, :] / np.where(some, whole, 1)[:, None, None]
    assert weights[some] == pytest.approx(product[some])
    assert whole.mean() == pytest.approx(12, rel=0.05)


def test_names_of_judges_are_read() -> None:
    assert demonstrations_of("preconditions, 8 demonstrations", 4) == ("preconditions", 8)
    assert demonstrations_of("scene-graph, 1 demonstration", 4) == ("scene-graph", 1)
    assert demonstrations_of("scene-graph, whole scene", 16) == ("scene-graph, whole scene", 16)
    assert is_variant("scene-graph, 16 varied demonstrations")
    assert not is_variant("plan-check, wrong")
    pairs = [p.name for p in together(["scene-graph", "plan-check, coarse", "preconditions"])]
    assert pairs == [
        "scene-graph or plan-check, coarse",
        "scene-graph and plan-check, coarse",
        "preconditions or plan-check, coarse",
        "preconditions and plan-check, coarse",
    ]


def watched_by_two() -> list[EpisodeRow]:
    """The score sees the first, the check the second, both the third, none the fourth."""
    seen_by = [(0.5, 1.0), (0.95, 0.0), (0.5, 0.0), (0.95, 1.0)]
    rows = [
        failing(k, judged=judged({"scene-graph": [1.0, a, 1.0], "plan-check": [1.0, b, None]}))
        for k, (a, b) in enumerate(seen_by)
    ]
    fine = {"scene-graph": [1.0, 0.85, 1.0], "plan-check": [1.0, 1.0, 1.0]}
    return rows + [good(k, judged=judged(fine)) for k in range(2)]


@pytest.mark.parametrize(("both", "hits", "false"), [(False, 3, 2), (True, 1, 0)])
def test_two_judges_are_asked_together(both: bool, hits: int, false: int) -> None:
    of, pair = Watches.of(watched_by_two()), Together("scene-graph", "plan-check", both)
    found = point_metrics(asked_together(of, pair))
    assert found["in_time"].count == hits
    assert found["false_alarms_per_run_all"].count == false
    score = Line.by(of, pair).score.reshape(6, 3)
    assert score[0].tolist() == ([1.0, 1.0, np.inf] if both else [1.0, 0.5, 1.0])


def test_what_demonstrations_add_is_the_two_minus_the_check_alone() -> None:
    rows = [replace(r, seed=r.seed + 100 * k) for k in range(5) for r in watched_by_two()]
    rows = [replace(r, scenario=r.scenario and f"{r.scenario}-{r.seed}") for r in rows]
    found = {
        (o.topic, o.better, o.measure): o for o in comparisons({}, Watches.of(rows), "robofail")
    }
    gain = found[ADDED, "scene-graph or plan-check", IN_TIME]
    assert (gain.first, gain.second) == (0.75, 0.5)
    assert gain.difference.value == pytest.approx(0.25)
    assert gain.p_holm is not None and gain.p is not None and gain.p_holm >= gain.p
    assert found[ADDED, "scene-graph or plan-check", FALSE].difference.value == 1.0


def test_chance_has_as_many_false_alarms_per_boundary() -> None:
    rows = [failing(k, judged=true(seen(0.95, 0.5, 0.95, 0.95), 1)) for k in range(10)]
    rows += [good(k, judged=true(seen(0.5, 0.95, 0.95, 0.95))) for k in range(10)]
    found = point_metrics(at_thresholds(Watches.of(rows), "scene-graph"))
    rate = 10 / (10 + 40)
    assert found["false_alarms_per_boundary_all"].value == pytest.approx(rate)
    assert found["chance_in_time"].value == pytest.approx(1 - (1 - rate) ** 2)
    assert found["over_chance"].value == pytest.approx((1 - rate) ** 2)
    assert found["over_chance"].p is not None and found["over_chance"].p < 0.01


def test_a_cause_is_named_right_at_the_first_alarm_in_time() -> None:
    def run(k: int, first: str, second: str, causes: tuple[str, ...]) -> EpisodeRow:
        moments = seen(0.5, 0.5, 0.5)
        facts: list[tuple[str, ...]] = [(), (first,) if first else (), (second,)]
        named = [{"scene-graph": f} for f in facts]
        told = tuple(replace(j, named=n) for j, n in zip(moments, named, strict=True))
        return failing(k, judged=told, causes=causes)

    cause, other = "dirty(Bowl-1)", "open(Fridge-1)"
    wanted = "not dirty(Bowl-1)"
    rows = [
        run(0, wanted, other, (cause,)),
        run(1, other, wanted, (cause,)),
        run(2, "", wanted, (cause,)),
        run(3, wanted, wanted, ()),
    ]
    found = point_metrics(at_thresholds(Watches.of(rows), "scene-graph"))
    assert (found["cause_right"].count, found["cause_right"].n) == (1, 3)
    assert (found["cause_named"].count, found["cause_named"].n) == (2, 3)


def test_a_false_alarm_costs_time_and_success_where_nobody_is_needed() -> None:
    rows = [good(k, "none", simulated_s=100.0) for k in range(4)]
    rows.append(good(4, "none", simulated_s=100.0, success=False))  # not counted: it fails alone
    rows += [
        good(k, "proactive", replans=int(k < 2), success=k > 0, simulated_s=120.0 if k < 2 else 100)
        for k in range(5)
    ]
    setups = by_setup(rows)
    found = false_alarm_cost(setups["proactive"], setups["none"], setups["none"])
    assert (found["seconds"].value, found["seconds"].n) == (10.0, 4)
    assert (found["changed"].count, found["changed"].n) == (2, 4)
    assert (found["seconds_changed"].value, found["seconds_changed"].n) == (20.0, 2)
    assert found["success"].value == -0.25
    same = false_alarm_cost(setups["none"], setups["none"], setups["none"])["success"]
    assert (same.low, same.value, same.high) == (0.0, 0.0, 0.0), "a difference, and no share"
    between = time_between(setups["proactive"], setups["none"], ALL)
    assert (between.value, between.n) == (8.0, 5)


def test_harm_is_prevented_where_it_was_done_without() -> None:
    rows = [failing(k, "none", harmed=("wine",) if k < 3 else ()) for k in range(5)]
    rows += [failing(k, "proactive", harmed=("wine",) if k in (0, 4) else ()) for k in range(5)]
    setups = by_setup(rows)
    found = harm_prevented(setups["proactive"], setups["none"])
    assert (found.count, found.n) == (2, 3)


def test_strategies_share_the_cases_that_all_were_run_on() -> None:
    rows = [failing(k, "none") for k in range(5)] + [failing(k, "retry-once") for k in range(4)]
    rows += [honest(failing(k, "proactive")) for k in range(1, 5)]
    rows += [honest(failing(k, "proactive"), model="coarse") for k in range(2)]
    setups = by_setup(replace(r, profile=HONEST) for r in rows)
    assert "proactive" in setups and "proactive, coarse model" in setups
    assert {c.seed for c in shared_cases(setups)} == {20_001, 20_002, 20_003}


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(0, 1), min_size=1, max_size=12))
def test_holms_method(ps: list[float]) -> None:
    blank = mean([0.0, 1.0], [0, 1])
    found = holm(Ordering("t", "a", "b", "m", 0.5, 0.4, blank, p) for p in ps)
    corrected = [o.p_holm for o in found]
    assert all(q is not None and p <= q <= 1 for p, q in zip(ps, corrected, strict=True))
    order = np.argsort(ps, kind="stable")
    steps = [min(1.0, (len(ps) - i) * ps[k]) for i, k in enumerate(order)]
    expected = np.maximum.accumulate(steps)
    assert [corrected[k] for k in order] == pytest.approx(list(expected))


def test_a_verdict_among_many_needs_more() -> None:
    sure = paired([True] * 18 + [False] * 12, [False] * 30, list(range(30)))
    blank = paired([True, False] * 15, [False, True] * 15, list(range(30))).difference
    alone = Ordering("t", "a", "b", "m", 0.2, 0.0, sure.difference, 0.02)
    others = [Ordering("t", "a", "b", "m", 0.5, 0.5, blank, 1.0)] * 4
    assert (alone.verdict, holm([alone])[0].corrected) == (HOLDS, HOLDS)
    among = holm([alone, *others])[0]
    assert among.p_holm is not None and among.p_holm > ALPHA
    assert (among.verdict, among.corrected) == (HOLDS, UNDECIDED)
    assert "not after Holm's correction" in among.sentence()


def test_judges_are_followed_over_demonstrations() -> None:
    names = (
        "scene-graph, 1 demonstration",
        "scene-graph",
        "scene-graph, 8 demonstrations",
        "image",
    )
    bad = judged({n: [1.0, v, 1.0] for n, v in zip(names, (1.0, 0.8, 0.5, 0.99), strict=True)})
    fine = judged({n: [1.0, v, 1.0] for n, v in zip(names, (0.8, 1.0, 1.0, 0.98), strict=True)})
    rows = [honest(failing(k, judged=bad)) for k in range(3)]
    rows += [honest(good(k, judged=fine)) for k in range(3)]
    of = Watches.of(rows)
    found = by_demonstrations(of, judgements(of, ALL))
    assert list(found) == ["scene-graph"]
    line = [(p["demonstrations"], p["auroc_in_time"].value) for p in found["scene-graph"]]
    assert line == [(1, 0.0), (8, 1.0), (16, 1.0)]
    assert found["scene-graph"][0]["false_alarms_per_boundary"].count == 3


def test_risk_falls_as_false_alarms_rise() -> None:
    rows = [failing(k, judged=true(seen(1.0, 0.5 + k / 10, 1.0), 1)) for k in range(4)]
    rows += [good(k, judged=true(seen(0.7, 1.0, 1.0)), simulated_s=360.0) for k in range(4)]
    found = risk(Line.by(Watches.of(rows), "scene-graph"))
    assert [(p["score"], p["per_hour"], p["failed"]) for p in found[:4]] == [
        (None, 0.0, 0.5),
        (0.5, 0.0, 0.375),
        (0.6, 0.0, 0.25),
        (0.7, 10.0, 0.125),
    ]
    assert all(p["failed_low"] <= p["failed"] <= p["failed_high"] for p in found)
    band = roc_band(Line.by(Watches.of(rows), "scene-graph"), "robofail")
    assert (band[0]["value"], band[-1]["value"]) == (0.5, 1.0)
    assert all(b["low"] <= b["value"] <= b["high"] for b in band)


def test_what_comes_out_otherwise_in_another_room_is_counted() -> None:
    rows = [
        replace(failing(0, "none"), scenario=name, seed=20_000 + room, success=room in wins)
        for name, wins in (("a", (0, 1)), ("b", (0,)), ("c", ()))
        for room in range(2)
    ]
    found = over_rooms(by_setup(rows), {})["strategies"]["none"]
    assert (found["scenarios"], found["runs"], found["mean"]) == (3, 6, 0.5)
    assert found["differing"] == pytest.approx(1 / 3)
    assert found["between"] == pytest.approx(0.5)
    assert found["within"] == pytest.approx((0.5 / 3) ** 0.5)
