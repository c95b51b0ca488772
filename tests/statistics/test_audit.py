"""Runs that were judged by reading, and whether the success checks judge them alike.

`audit/records.json` is a list of runs. Each has

- `id`: a name;
- `task`, `seed`: what was asked for, in which flat scene;
- `kind`: what goes wrong, in RoboFail's terms; "variant" for an unusual way that is right, "none";
- `scenario`: a shipped scenario whose scene and execution faults apply, or null;
- `faults`: such faults written out, as scenario files have them;
- `steps`: every subtask that was executed, in order, repairs included;
- `verdict`: "succeeded" or "failed", decided from the goal's text and what happened;
- `reason`: why, in a sentence;
- `weak_agrees`: whether REFLECT's weaker check comes to the same verdict.

A strict check that differs from a verdict is a bug of a goal or of the household's effects.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from forestall.tasks.faults import apply_scene_faults, parse_fault, wrap
from forestall.tasks.files import load_scenario, load_task, task_names
from forestall.tasks.goals import TruthGoalChecker, irreversible
from forestall.types.plan import Subtask
from forestall.worlds.kitchen.flat_world import flat_environment

RECORDS: list[dict[str, Any]] = json.loads(
    (Path(__file__).parent / "audit" / "records.json").read_text(encoding="utf-8")
)
FIELDS = {
    "id", "task", "kind", "scenario", "faults", "seed", "steps", "verdict", "reason", "weak_agrees"
}  # fmt: skip
KINDS = {
    "ambiguous_plan", "blocking", "dirty", "drop", "failed_action", "filled", "missing_step",
    "occupied", "wrong_execution", "wrong_order", "wrong_perception", "wrong_plan",
}  # fmt: skip


def judged(record: dict[str, Any]) -> tuple[bool, bool | None, tuple[str, ...], bool]:
    """The strict and the weak check of a replayed record, failures, and whether harm was done."""
    loaded = load_task(record["task"])
    faults = [parse_fault(f) for f in record["faults"]]
    if record["scenario"] is not None:
        scenario = load_scenario(record["scenario"])
        assert scenario.task == record["task"]
        faults += scenario.faults
    needs = apply_scene_faults(loaded.task.scene, faults, loaded.domain)
    kitchen = flat_environment(needs, loaded.domain)
    faulty = wrap(kitchen, faults, kitchen, loaded.domain)
    faulty.reset(record["seed"])
    for step in record["steps"]:
        faulty.execute(Subtask.parse(step))
    goal = loaded.task.goal
    strict, weak, failures = TruthGoalChecker(loaded.domain).check(goal, kitchen.oracle)
    return strict, weak, failures, bool(irreversible(goal, kitchen.oracle, loaded.domain))


@pytest.mark.parametrize("record", RECORDS, ids=lambda r: r["id"])
def test_the_strict_check_comes_to_the_verdict_of_a_person(record: dict[str, Any]) -> None:
    strict, weak, failures, harmed = judged(record)
    succeeded = record["verdict"] == "succeeded"
    assert strict is succeeded, (record["reason"], failures)
    assert (weak is succeeded) is record["weak_agrees"]
    assert not (succeeded and harmed)


def test_the_sample_covers_every_task_and_every_kind_of_failure_both_ways() -> None:
    assert len(RECORDS) >= 30
    assert len({r["id"] for r in RECORDS}) == len(RECORDS)
    assert all(set(r) == FIELDS and r["reason"] for r in RECORDS)
    assert {r["verdict"] for r in RECORDS} == {"succeeded", "failed"}
    assert {r["kind"] for r in RECORDS} == KINDS | {"none", "variant"}
    for task in task_names():
        verdicts = {r["verdict"] for r in RECORDS if r["task"] == task}
        assert verdicts == {"failed", "succeeded"}
    assert not all(r["weak_agrees"] for r in RECORDS)
