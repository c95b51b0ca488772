"""The codec: what stands in the JSON, and that it reads back into what was written."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forestall.records.boundaries import by_reference
from forestall.records.codec import record_from_json, record_to_json
from forestall.records.plain import plain
from forestall.types.decision import Outcome
from forestall.types.demonstration import View
from forestall.types.episode import (
    BoundaryRecord,
    EpisodeEnd,
    EpisodeRecord,
    ExecutedRecord,
    SkillOutcome,
    SkillStatus,
)
from forestall.types.facts import Literal
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation
from forestall.types.plan import Plan
from forestall.types.runtime import When
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.types.verdict import (
    Calibration,
    Change,
    Decision,
    Diagnosis,
    Discrepancy,
    PlanCheck,
    Reference,
    Replan,
    ReplanOutcome,
    ScoreParts,
    Verdict,
)
from report import records
from report.graphs import expected_graph, observed_graph

KEYS = {
    "kind": str,
    "format": int,
    "complete": bool,
    "task": str,
    "scenario": str,
    "strategy": str,
    "seed": int,
    "success": bool,
    "weak_success": bool,
    "failures": list,
    "alarms": list,
    "replans": int,
    "initial_plan": list,
    "executed": list,
    "end": str,
    "simulated_s": float,
    "compute_s": dict,
    "computed_s": float,
    "reasoning_s": float,
    "total_s": float,
    "perception": dict,
    "memory": dict,
    "versions": dict,
    "page": str,
    "boundaries": list,
}


def as_json(record: EpisodeRecord) -> dict[str, Any]:
    text = json.dumps(record_to_json(record, page="p.html"), allow_nan=False)
    read: dict[str, Any] = json.loads(text)
    return read


def test_every_key_is_there_with_its_type() -> None:
    record = records.potato_record()
    first, *rest = record.boundaries
    assert isinstance(first.observation, Observation)
    seen = by_reference(first.observation, ["images/a.jpg"])
    record = replace(record, boundaries=(replace(first, observation=seen), *rest))
    data = record_to_json(record, page="index.html")
    assert {k: type(data[k]) for k in KEYS} == KEYS
    assert data["boundaries"][0]["image"] == "images/a.jpg"
    assert data["boundaries"][1]["image"] is None
    assert json.loads(json.dumps(data, allow_nan=False)) == data


def test_the_alarm_says_what_where_and_why() -> None:
    data = record_to_json(records.potato_record())
    assert data["alarms"] == [
        {
            "position": records.ALARM_INDEX,
            "index": records.ALARM_INDEX,
            "when": "before",
            "subtask": "pick_up(Plate-1)",
            "score": 0.734,
            "threshold": 0.9,
            "cause": records.CAUSE,
            "sentence": records.SENTENCE,
            "must_change": ["vacant(Microwave-1)"],
            "culprits": ["Bowl-1"],
            "replanned": True,
            "outcome": "solved",
        }
    ]
    assert data["replans"] == 1
    assert data["executed"][0] == {
        "index": 0,
        "subtask": "navigate_to_obj(Potato)",
        "status": "succeeded",
        "reason": "",
        "duration_s": 4.0,
        "hand_world_m": None,
    }


def test_times_add_up_without_the_simulators_own() -> None:
    record = records.potato_record()
    record = replace(record, compute_s=(*record.compute_s, ("observe", 3.0), ("act", 1.0)))
    data = record_to_json(record)
    assert data["reasoning_s"] == pytest.approx(2.785)
    assert data["computed_s"] == pytest.approx(6.785)
    assert data["total_s"] == pytest.approx(52.0 + 2.785)


def test_a_dismissed_alarm_is_an_alarm_and_its_cause_says_so() -> None:
    first, second = as_json(records.troubled_record())["alarms"]
    assert first["cause"] == "nothing was found that must change: the difference is harmless"
    assert (first["replanned"], first["outcome"]) == (False, "nothing to change")
    assert (second["replanned"], second["outcome"]) == (False, "unsolvable")


def test_an_alarm_without_a_diagnosis_is_kept() -> None:
    record = records.potato_record()
    bare = replace(record.boundaries[7], diagnosis=None, replan=None)
    (alarm,) = as_json(replace(record, boundaries=(bare,)))["alarms"]
    assert alarm["cause"] == "no diagnosis was made"
    assert alarm["outcome"] is None


def test_a_plan_that_was_not_adopted_is_no_replan() -> None:
    record = records.potato_record()
    alarm = record.boundaries[7]
    went_on = replace(record.executed[7], subtask=alarm.subtask, index=alarm.index)
    over_the_limit = replace(record, executed=(*record.executed[:7], went_on))
    data = as_json(over_the_limit)
    assert data["replans"] == 0
    assert data["alarms"][0]["replanned"] is False
    rejected = Replan(ReplanOutcome.REJECTED, alarm.replan.plan if alarm.replan else None)
    changed = (*record.boundaries[:7], replace(alarm, replan=rejected))
    assert as_json(replace(record, boundaries=changed))["replans"] == 0


def test_boundaries_carry_graphs_verdict_and_plans() -> None:
    boundary = as_json(records.potato_record())["boundaries"][7]
    assert SceneGraph.from_json(boundary["scoped"]) == records.potato_record().boundaries[7].scoped
    assert SceneGraph.from_json(boundary["verdict"]["nearest"]["graph"]).get("Book-1") is not None
    assert boundary["verdict"]["parts"]["edge"] == 0.5
    assert boundary["verdict"]["discrepancies"][0]["change"] == "extra object"
    assert boundary["diagnosis"]["must_change"] == ["vacant(Microwave-1)"]
    assert boundary["plan_before"] == list(records.NOMINAL[7:])
    assert boundary["plan_after"][:2] == list(records.INSERTED)
    assert boundary["mark"] == "alarm, replanned"
    following = as_json(records.potato_record())["boundaries"][9]
    assert following["plan_before"][0] == records.INSERTED[1]
    assert following["plan_after"] is None


def test_plain_knows_numpy_and_refuses_no_value() -> None:
    assert plain({"a": np.float64(1.5), 2: (np.int32(3), float("nan")), "p": Path("a/b")}) == {
        "a": 1.5,
        "2": [3, None],
        "p": "a/b",
    }
    assert plain({"b", "a"}) == ["a", "b"]
    assert plain(EpisodeEnd.STOPPED) == "stopped safely"
    assert plain(np.zeros(2)) == [0.0, 0.0]


def test_moments_after_and_at_the_end_are_told_apart() -> None:
    record = records.looked_after_record()
    data = record_to_json(record)
    assert [b["when"] for b in data["boundaries"]] == ["before", "after"] * 15 + ["end"]
    (alarm,) = data["alarms"]
    assert (alarm["when"], alarm["index"], alarm["position"]) == ("after", 8, 17)
    assert alarm["replanned"] is True
    assert data["replans"] == 1
    assert data["final"] == data["boundaries"][-1]["graph"]
    assert [(w["detector"], w["score"]) for w in data["boundaries"][-1]["watched"]] == [
        ("scene_graph", 0.962),
        ("b", 0.734),
    ]
    after = data["boundaries"][17]
    assert after["plan_before"] == list(records.NOMINAL[9:])
    assert data["boundaries"][18]["plan_before"][0] == records.INSERTED[0]


def stored(record: EpisodeRecord) -> EpisodeRecord:
    """The same record with its observations by reference."""
    return replace(
        record,
        boundaries=tuple(
            replace(b, observation=by_reference(b.observation))
            if isinstance(b.observation, Observation)
            else b
            for b in record.boundaries
        ),
    )


def through_json(record: EpisodeRecord) -> EpisodeRecord:
    return record_from_json(json.loads(json.dumps(record_to_json(record), allow_nan=False)))


@pytest.mark.parametrize(
    "make",
    [
        records.potato_record,
        records.unjudged_record,
        records.troubled_record,
        records.looked_after_record,
        records.empty_record,
    ],
)
def test_a_record_reads_back_equal(make: object) -> None:
    record = stored(make())  # type: ignore[operator]
    assert through_json(record) == record


def test_a_threshold_that_is_not_finite_is_kept() -> None:
    record = stored(records.potato_record())
    first, *rest = record.boundaries
    assert first.verdict is not None
    never = replace(first, verdict=replace(first.verdict, threshold=float("-inf")))
    record = replace(record, boundaries=(never, *rest))
    assert through_json(record) == record


SUBTASKS = st.sampled_from(Plan.parse(records.NOMINAL).subtasks)
PLANS = st.builds(Plan, st.lists(SUBTASKS, max_size=4).map(tuple), st.text(max_size=9))
FACTS = st.lists(
    st.sampled_from(
        [
            Literal.parse("dirty(Plate-1)=clean"),
            Literal.parse("not inside(Bowl-1, Microwave-1)"),
            Literal.parse("hand_empty()"),
        ]
    ),
    max_size=3,
).map(tuple)
WORDS = st.text(max_size=12)
NAMES = st.lists(WORDS, max_size=2).map(tuple)
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
POSITIVE = st.floats(0, 1e9)
POINTS = st.tuples(NUMBERS, NUMBERS, NUMBERS)
PHASES = st.dictionaries(WORDS, POSITIVE, max_size=3).map(lambda d: tuple(d.items()))
GRAPHS = st.sampled_from(
    [SceneGraph(()), observed_graph(), expected_graph(Plan.parse(records.NOMINAL).subtasks[0])]
)
VIEWS = st.builds(View, st.none() | st.binary(max_size=6), WORDS, WORDS, WORDS)
REFERENCES = st.builds(
    Reference,
    WORDS,
    WORDS,
    st.integers(0, 9),
    SUBTASKS,
    NUMBERS,
    GRAPHS,
    st.lists(SUBTASKS, max_size=2).map(tuple),
    st.none() | VIEWS,
    st.none() | GRAPHS,
)
VERDICTS = st.builds(
    Verdict,
    st.sampled_from(Decision),
    WORDS,
    st.none() | NUMBERS,
    st.floats(allow_nan=False),
    st.sampled_from(Calibration),
    st.none()
    | st.builds(ScoreParts, NUMBERS, st.none() | NUMBERS, st.none() | NUMBERS, st.none() | NUMBERS),
    st.none() | REFERENCES,
    st.lists(st.tuples(WORDS, WORDS), max_size=2).map(tuple),
    st.lists(
        st.builds(Discrepancy, st.sampled_from(Change), WORDS, WORDS, WORDS, WORDS), max_size=2
    ).map(tuple),
    st.integers(0, 99),
    WORDS,
    p_value=st.none() | NUMBERS,
)
CHECKS = st.builds(
    PlanCheck, st.booleans(), st.none() | st.integers(0, 9), WORDS, FACTS, FACTS, FACTS
)
REPLANS = st.builds(
    Replan,
    st.sampled_from(ReplanOutcome),
    st.none() | PLANS,
    st.none() | CHECKS,
    WORDS,
    st.integers(0, 9),
    POSITIVE,
    WORDS,
)
SEEN = st.sampled_from([None, by_reference(records.observation(1, 2), ["images/a.jpg", None])])
BOUNDARIES = st.builds(
    BoundaryRecord,
    index=st.integers(0, 9),
    subtask=SUBTASKS,
    graph=GRAPHS,
    scoped=GRAPHS,
    observation=SEEN,
    looks=st.integers(1, 3),
    verdict=st.none() | VERDICTS,
    diagnosis=st.none() | st.builds(Diagnosis, WORDS, FACTS, FACTS, NAMES, WORDS),
    replan=st.none() | REPLANS,
    why=WORDS,
    seconds=PHASES,
    time_s=POSITIVE,
    when=st.sampled_from(When),
    watched=st.lists(VERDICTS, max_size=1).map(tuple),
    outcome=st.none() | st.sampled_from(Outcome),
    compute_s=PHASES,
)
EXECUTED = st.builds(
    ExecutedRecord,
    SUBTASKS,
    st.builds(SkillOutcome, st.sampled_from(SkillStatus), POSITIVE, WORDS, st.none() | POINTS),
    st.integers(0, 9),
)
PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers(-9, 9) | WORDS,
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(WORDS, inner, max_size=2),
    max_leaves=4,
)
NEEDS = SceneNeeds(
    objects=(ObjectNeed("Mug-1", "Mug", ("Sink",), (("dirty", "dirty"),), "Pot-1"),),
    fixtures=(("Microwave-1", "open", "open"),),
    vary=(("light", 2),),
    undisturbed=SceneNeeds(clutter=(0, 1)),
)
RECORDS = st.builds(
    EpisodeRecord,
    task=st.builds(replace, st.just(records.task()), plan=PLANS, title=WORDS, scene=st.just(NEEDS)),
    scenario=st.none() | WORDS,
    strategy=WORDS,
    seed=st.integers(0, 10**9),
    initial_plan=PLANS,
    boundaries=st.lists(BOUNDARIES, max_size=2).map(tuple),
    executed=st.lists(EXECUTED, max_size=2).map(tuple),
    end=st.sampled_from(EpisodeEnd),
    success=st.none() | st.booleans(),
    weak_success=st.none() | st.booleans(),
    failures=NAMES,
    harmed=st.lists(st.tuples(POSITIVE, WORDS), max_size=2).map(tuple),
    simulated_s=POSITIVE,
    compute_s=PHASES,
    final=st.none() | GRAPHS,
    provenance=st.dictionaries(WORDS, PLAIN, max_size=3).map(lambda d: tuple(d.items())),
)


@settings(max_examples=60, deadline=None)
@given(RECORDS)
def test_any_record_reads_back_equal(record: EpisodeRecord) -> None:
    assert through_json(record) == record
