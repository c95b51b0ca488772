"""What readers said of the starts, one by one: each is there, and enough of each set are read.

`tests/tasks/reading/SET.toml` has an entry for each start read: its name, a verdict (ok, mended,
left in spite of a doubt, removed) and why. Counts of docs/experiments.md are held against them.
`slips.toml` has the same of undisturbed runs of the honest household, by task and seed.
"""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from pathlib import Path

import pytest

from forestall.tasks.files import load_scenario, scenario_names, task_names

READ = {
    p.stem: tomllib.loads(p.read_text("utf-8"))["read"]
    for p in sorted(Path(__file__).with_name("reading").glob("*.toml"))
}
SLIPS = READ.pop("slips")
DOCS = Path(__file__).parents[2] / "docs" / "experiments.md"
LEAST = 40
VERDICTS = ("ok", "mended", "left", "removed")


@pytest.mark.parametrize("of", READ)
def test_what_was_read_is_a_start_of_the_set_or_no_longer_one(of: str) -> None:
    names = set(scenario_names(of))
    said = [entry["name"] for entry in READ[of]]
    assert len(said) == len(set(said))
    for entry in READ[of]:
        assert entry.keys() == {"name", "verdict", "reason"}
        assert entry["verdict"] in VERDICTS
        assert (entry["name"] in names) == (entry["verdict"] != "removed"), entry["name"]
        assert entry["reason"].endswith((".", "?")) and len(entry["reason"]) < 160


@pytest.mark.parametrize("of", READ)
def test_enough_of_each_set_is_read_over_all_its_tasks_and_kinds(of: str) -> None:
    starts = [load_scenario(n) for n in scenario_names(of)]
    stays = {e["name"] for e in READ[of] if e["verdict"] != "removed"}
    read = [s for s in starts if s.name in stays]
    assert len(read) >= min(LEAST, len(starts))
    assert {s.task for s in read} == {s.task for s in starts}
    missed = {s.kind for s in starts} - {s.kind for s in read}
    assert not missed, missed


@pytest.mark.parametrize("of", READ)
def test_the_docs_count_what_was_read(of: str) -> None:
    counts = Counter(e["verdict"] for e in READ[of])
    numbers = [sum(counts.values()), *(counts[v] for v in VERDICTS)]
    row = re.search(rf"^\| `{of}` \|((?: \d+ \|){{5}})$", DOCS.read_text("utf-8"), re.MULTILINE)
    assert row is not None, f"docs/experiments.md has no row of what was read of {of}"
    assert [int(n) for n in re.findall(r"\d+", row[1])] == numbers


def test_enough_runs_of_the_honest_household_are_read_in_rooms_to_look_at() -> None:
    runs = {(entry["task"], entry["seed"]) for entry in SLIPS}
    assert LEAST <= len(runs) == len(SLIPS)
    assert {task for task, _ in runs} == set(task_names())
    assert all(10_000 <= seed < 20_000 for _, seed in runs)
    for entry in SLIPS:
        assert entry.keys() == {"task", "seed", "verdict", "reason"}
        assert entry["verdict"] in VERDICTS[:3]
        assert entry["reason"].endswith(".") and len(entry["reason"]) < 160


def test_the_sets_that_were_read_are_still_over_all_tasks() -> None:
    assert {"everyday", "planner-harmless", "composed", "harmless"} <= READ.keys()
    for of in ("everyday", "composed", "harmless"):
        assert {load_scenario(n).task for n in scenario_names(of)} == set(task_names())
