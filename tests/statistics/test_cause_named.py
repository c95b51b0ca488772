"""Whether a named cause is the cause: the rule, and how often it says what a reader says."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from forestall.errors import InputError
from forestall.statistics.causes import Agreement, cause_named

EXACT, SAME, OTHER, NOTHING = Agreement

OCCUPIED = ["inside(Bowl-1, Microwave-1)", "not vacant(Microwave-1)"]
FALLEN = ["not held_by(Potato-1, gripper)", "on_top_of(Potato-1, Floor-1)"]


@pytest.mark.parametrize(
    ("named", "causes", "expected"),
    [
        (["vacant(Microwave-1)"], OCCUPIED, EXACT),
        (["not inside(Bowl-1, Microwave-1)"], OCCUPIED, EXACT),
        (["open(Fridge-1)=open"], ["open(Fridge-1)=closed"], EXACT),
        (["open(Fridge)=open"], ["open(Fridge-1)=closed"], EXACT),  # a category: any of its things
        (["hand_empty()"], ["not hand_empty()"], EXACT),
        (["held_by(Potato-1, gripper)"], FALLEN, EXACT),
        (["located(Plate-1)"], ["not located(Plate)"], EXACT),
        (["dirty(Cup-1)=clean", "vacant(Microwave-1)"], OCCUPIED, EXACT),  # the best pair counts
        (["vacant(Microwave-1)"], OCCUPIED[:1], SAME),
        (["on_top_of(Potato-1, Plate-1)"], FALLEN[1:], SAME),
        (["accessible(Potato-1)"], ["inside(Potato-1, Cabinet-1)"], SAME),
        (["held_by(Pot-1, gripper)"], ["not unblocked(Pot-1)"], OTHER),
        (["open(Cabinet-2)=open"], ["open(Cabinet-1)=closed"], SAME),  # numbers may be perceived
        (["open(Fridge-1)=closed"], ["open(Fridge-1)=closed"], OTHER),  # what is so need not change
        (["dirty(Plate-1)=clean"], ["broken(Plate-1)=broken"], OTHER),
        (["temperature(Mug-1)=hot"], ["inside(Mug-1, Sink-1)"], OTHER),
        (["on_top_of(Egg-1, Plate-1)"], ["on_top_of(Apple-1, Plate-1)"], OTHER),
        (["held_by(Mug-1, gripper)"], ["held_by(Bowl-1, gripper)"], OTHER),
        (["unblocked(Mug-1)"], OCCUPIED, OTHER),
        (["vacant(Microwave-1)"], [], OTHER),
        ([], OCCUPIED, NOTHING),
        ([], [], NOTHING),
    ],
)
def test_what_must_hold_is_compared_with_what_is_so(
    named: list[str], causes: list[str], expected: Agreement
) -> None:
    assert cause_named(named, causes) is expected
    assert expected.right is (expected in (EXACT, SAME))


def test_a_text_that_is_no_fact_is_refused() -> None:
    with pytest.raises(InputError, match="cannot read 'the fridge' as a fact"):
        cause_named(["the fridge"], OCCUPIED)


SAMPLE = json.loads((Path(__file__).parent / "causes_by_hand.json").read_text(encoding="utf-8"))
"""A hundred alarms in runs of a flat household on development seeds, kind and honest, read singly.

Each has the story of its run (what the scenario changed, slips, ways of the law, what was refused,
what failed), what a judge named and when, the true causes, and in `right` whether a reader who
knows the story holds one of the named facts for a reason why the run failed, and not for a
consequence. `numbers` is "perceived" where the judge's numbers of things are not the world's. Batch
1 are first alarms of five judges; 2 and 3 are what validators with exact, coarse and wrong models
say later on, which is mostly consequences, and hard. The rule was changed after 1 and after 2 were
read; batch 3 was judged after that and before the rule was asked.
"""


def agreement(several: list[dict[str, Any]]) -> tuple[float, Counter[tuple[str, bool]]]:
    """Share of records of which rule and reader say the same, and the confusion."""
    said = [cause_named(s["named"], s["causes"]) for s in several]
    same = sum(a.right is s["right"] for a, s in zip(said, several, strict=True))
    pairs = ((a.value, s["right"]) for a, s in zip(said, several, strict=True))
    return same / len(several), Counter(pairs)


def test_the_sample_is_a_hundred_of_several_judges_sets_and_tasks() -> None:
    assert len(SAMPLE) == 100
    assert len({s["judge"] for s in SAMPLE}) == 5
    assert len({s["task"] for s in SAMPLE}) == 10
    assert {s["profile"] for s in SAMPLE} == {"kind", "honest"}
    assert all(10_000 <= s["seed"] < 20_000 for s in SAMPLE)
    assert sum(s["right"] for s in SAMPLE) == 49


@pytest.mark.parametrize(("batch", "least"), [(1, 0.97), (2, 0.86), (3, 0.9), (None, 0.91)])
def test_the_rule_says_what_a_reader_says(batch: int | None, least: float) -> None:
    several = [s for s in SAMPLE if batch in (None, s["batch"])]
    share, confusion = agreement(several)
    print(f"batch {batch or 'all'}: the reader agrees in {share:.2f} of {len(several)}")  # noqa: T201
    for (said, right), count in sorted(confusion.items()):
        print(f"  {said:14} reader: {'the cause' if right else 'not':9} {count}")  # noqa: T201
    assert share >= least


def test_an_exact_fact_is_seldom_no_cause_to_a_reader() -> None:
    exact = [s for s in SAMPLE if cause_named(s["named"], s["causes"]) is EXACT]
    assert sum(s["right"] for s in exact) / len(exact) >= 0.95
