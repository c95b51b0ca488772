"""Alarms and repairs of the published rows that were read singly, and what documents say of that.

`alarms_by_hand.json` has the first alarm in time of three judges in each watched failing run of the
default experiment: `right` is whether what is named is a reason why the run fails at that moment,
and no consequence; `complete` whether no further reason that holds then is left out. `causes` are
the record's. `repairs_by_hand.json` has runs of two strategies with an exact model in which a plan
was corrected: `needless` is whether it does something and undoes it where nothing asks for that.
Searches for what is nowhere were left out.
"""

from __future__ import annotations

import json
import lzma
import re
from pathlib import Path
from typing import Any

import pytest

HERE, ROOT = Path(__file__).parent, Path(__file__).parents[2]
ALARMS, REPAIRS = (
    json.loads((HERE / f"{name}_by_hand.json").read_text(encoding="utf-8"))
    for name in ("alarms", "repairs")
)
Key = tuple[str, str, str, int, str, str]


@pytest.fixture(scope="module")
def rows() -> dict[Key, dict[str, Any]]:
    """The published rows by household, task, scenario, seed, strategy and model."""
    with lzma.open(ROOT / "results" / "test" / "episodes.jsonl.xz", "rt", encoding="utf-8") as file:
        found = [json.loads(line) for line in file]
    return {
        (
            row["profile"],
            row["task"],
            row["scenario"] or "undisturbed",
            row["seed"],
            row["strategy"],
            row["model"],
        ): row
        for row in found
        if row["without"] is None
    }


def key(entry: dict[str, Any], strategy: str) -> Key:
    case = (entry["household"], entry["task"], entry["scenario"], entry["seed"])
    return (*case, strategy, "exact")


def test_the_alarms_that_were_read_are_those_of_the_rows(rows: dict[Key, dict[str, Any]]) -> None:
    for entry in ALARMS:
        row = rows[key(entry, "watch")]
        number, subtask = entry["before"].split(" ", 1)
        (moment,) = (j for j in row["judged"] if j["index"] == int(number))
        assert (moment["subtask"], row["causes"]) == (subtask, entry["causes"])
        assert moment["named"][entry["judge"]] == entry["named"]
        assert not entry["complete"] or entry["right"]
        assert entry["complete"] or entry["why"], "what is not so is said why"


def test_the_repairs_that_were_read_are_those_of_the_rows(rows: dict[Key, dict[str, Any]]) -> None:
    for entry in REPAIRS:
        assert rows[key(entry, entry["strategy"])]["replans"] > 0
        assert not entry["needless"] or entry["why"]
    assert len({key(e, e["strategy"]) for e in REPAIRS}) == len(REPAIRS)


def test_documents_say_what_was_read() -> None:
    runs = {key(e, "watch") for e in ALARMS}
    text = (ROOT / "docs" / "experiments.md").read_text(encoding="utf-8")
    said = (
        (
            f"{len(ALARMS)} alarms in time of three judges in {len(runs)} failing runs: "
            f"{sum(e['right'] for e in ALARMS)} name a reason and no consequence, "
            f"{sum(e['complete'] for e in ALARMS)} all that there is"
        ),
        (
            f"{len(REPAIRS)} corrected runs: {sum(e['needless'] for e in REPAIRS)} does something "
            "and undoes it without need"
        ),
    )
    for sentence in said:
        assert sentence in re.sub(r"\s+", " ", text)
