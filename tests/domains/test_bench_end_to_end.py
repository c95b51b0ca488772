# mypy: disable-error-code="operator, union-attr"
"""The bench from demonstrations to the corrected plan and its page, in symbolic worlds."""

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from forestall.assembly.configuration import Given, run_config
from forestall.assembly.make import prepare, run_episode
from forestall.assembly.recording import RecordingJob, record_one
from forestall.cli.main import call
from forestall.config import DEMONSTRATION_SEEDS
from forestall.memory.store import open_store
from forestall.planning.goals import alternatives
from forestall.planning.observed import state_of
from forestall.planning.planner import plan_goal, plan_to
from forestall.records.record import read_record, write_record
from forestall.report.page import page_html
from forestall.tasks.files import load_scenario, load_task, scenario_names, task_names
from forestall.testing.symbolic_scene import start_scene
from forestall.types.demonstration import Demonstration
from forestall.types.episode import EpisodeEnd, EpisodeRecord, SkillStatus
from forestall.types.verdict import Decision, ReplanOutcome

pytestmark = pytest.mark.slow

SYMBOLIC = Given.named({"world": "symbolic", "perceiver": "given-graph"})
TASKS = ("fasten-plate", "glue-peg", "hand-over-washer")
SCENARIOS = {
    "hole-full-of-chips": "BoltHole-1 is dirty; it was clean in all 4 demonstrations",
    "hole-occupied": "Bolt-1 is seated in RoundHole-1, which is empty in all 4 demonstrations",
    "tray-full": "Nut-1 and Nut-2 are lying on Tray-1, which is empty in all 4 demonstrations",
    "irreversible-fasten-plate-1-thread": "Bolt-1 is dirty; it was clean in all 4 demonstrations",
}
"""Scenario → how its cause begins."""

Memory = Callable[[str], Sequence[Demonstration]]
"""Task → its demonstrations."""


@pytest.fixture(scope="module")
def memory(tmp_path_factory: pytest.TempPathFactory) -> Memory:
    folder = tmp_path_factory.mktemp("memory")

    @cache
    def of(task: str) -> Sequence[Demonstration]:
        with open_store(folder / f"{task}.db", create=True) as store:
            for k in range(4):
                store.add(record_one(RecordingJob(task, DEMONSTRATION_SEEDS + 10 * k, SYMBOLIC)))
            return store.required()

    return of


def _run(
    memory: Memory,
    task: str,
    scenario: str | None = None,
    strategy: str = "proactive",
    seed: int = 3,
) -> EpisodeRecord:
    config = run_config(task, scenario=scenario, seed=seed, given=SYMBOLIC, strategy=strategy)
    return run_episode(prepare(config), memory(task))


def test_its_files_are_found_by_name() -> None:
    assert task_names("bench") == TASKS
    assert set(SCENARIOS) == set(scenario_names(domain="bench"))
    for name in SCENARIOS:
        scenario = load_scenario(name)
        task = load_task(scenario.task)
        assert task.domain.name == "bench"
        known, effect = scenario.moments(task.task.plan)
        assert known <= effect


@pytest.mark.parametrize("task", TASKS)
def test_an_undisturbed_run_is_let_alone(memory: Memory, task: str) -> None:
    for seed in range(3):
        record = _run(memory, task, seed=seed)
        assert record.success, record.failures
        assert all(b.verdict.decision is Decision.PROCEED for b in record.boundaries)


@pytest.mark.parametrize("task", task_names("household"))
def test_the_tasks_of_the_household_run_in_a_symbolic_world(task: str) -> None:
    for seed in range(3):
        config = run_config(task, seed=seed, given=SYMBOLIC, strategy="none")
        record = run_episode(prepare(config), None)
        assert record.success, record.failures


def test_a_run_in_the_bench_has_its_own_parts_unless_others_are_said() -> None:
    def names(**named: Any) -> dict[str, str]:
        return {c.kind: c.name for c in run_config("glue-peg", **named).choices}

    assert (names()["world"], names()["perceiver"]) == ("symbolic", "given-graph")
    assert names(perceiver="graph")["perceiver"] == "graph"
    assert {c.kind: c.name for c in run_config("make-coffee").choices}["world"] == "kitchen"


def test_pictures_are_asked_for_in_a_sentence() -> None:
    config = run_config("glue-peg", perceiver="graph", strategy="none")
    record = run_episode(prepare(config), None)
    assert "use the perceiver given-graph" in record.failures[0]


@pytest.mark.parametrize("name", SCENARIOS)
def test_without_a_warning_the_scenario_fails_where_it_says(memory: Memory, name: str) -> None:
    scenario = load_scenario(name)
    record = _run(memory, scenario.task, name, strategy="none")
    assert record.success is False
    _, effect = scenario.moments(record.initial_plan)
    refused = [e.outcome.status is SkillStatus.REFUSED for e in record.executed]
    assert any(refused[: effect + 1]) or record.harmed
    assert not any(refused[:effect])


@pytest.mark.parametrize(("name", "cause"), SCENARIOS.items())
def test_the_alarm_comes_in_time_with_its_cause_and_a_plan_that_works(
    memory: Memory, name: str, cause: str
) -> None:
    scenario = load_scenario(name)
    record = _run(memory, scenario.task, name)
    _, effect = scenario.moments(record.initial_plan)
    first = next(b for b in record.boundaries if b.verdict.decision is Decision.REPLAN)
    assert first.index <= effect
    assert first.diagnosis.cause.startswith(cause)
    assert first.replan.outcome is ReplanOutcome.SOLVED
    assert record.end is EpisodeEnd.PLAN_FINISHED
    assert record.success, record.failures
    assert record.harmed == ()
    assert all(e.outcome.status is SkillStatus.SUCCEEDED for e in record.executed)


def test_a_plan_knows_what_its_needs_stand_on_and_leaves_the_floor_alone() -> None:
    """The arm and its jaws are no part of the goal, and every step needs them."""
    loaded = load_task("glue-peg")
    graph = start_scene(loaded.domain, loaded.task.scene, 3)
    planned = plan_goal(state_of(graph, loaded.domain), loaded.task.goal)
    assert planned.outcome is ReplanOutcome.SOLVED
    assert not any("Floor" in a for step in planned.subtasks for a in step.args)


def test_tools_are_changed_in_a_narrowed_problem() -> None:
    loaded = load_task("fasten-plate")
    state = state_of(start_scene(loaded.domain, loaded.task.scene, 3), loaded.domain)
    goals = alternatives(state, loaded.task.goal)
    planned = plan_to(state, goals, widen=False)
    assert planned.outcome is ReplanOutcome.SOLVED
    assert "change_tool(Screwdriver-1)" in map(str, planned.subtasks)


def test_watching_says_the_same_and_lets_the_thread_be_stripped(memory: Memory) -> None:
    name = "irreversible-fasten-plate-1-thread"
    record = _run(memory, "fasten-plate", name, strategy="watch")
    told = next(b.diagnosis for b in record.boundaries if b.diagnosis is not None)
    assert told.cause.startswith(SCENARIOS[name])
    assert {words for _, words in record.harmed} == {
        "the thread of Bolt-1 is stripped",
        "the thread of Nut-1 is stripped",
    }


def test_a_run_without_pictures_has_a_page_and_reads_back(memory: Memory, tmp_path: Path) -> None:
    record = _run(memory, "glue-peg", "hole-occupied")
    html = page_html(record)
    assert SCENARIOS["hole-occupied"] in html
    assert "place(RoundPeg-1, Workbench)" in html
    write_record(tmp_path / "run", record)
    again = read_record(tmp_path / "run")
    assert again.executed == record.executed
    assert page_html(again, tmp_path / "run") == html


def test_the_command_line_needs_to_be_told_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORESTALL_CACHE", str(tmp_path / "cache"))
    out = tmp_path / "run"
    args = ["run", "hand-over-washer", "--scenario", "tray-full", "--quiet", "--out", str(out)]
    assert call(args) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert SCENARIOS["tray-full"] in printed
    assert (out / "index.html").is_file()
