"""Reasoning by templates, by a model and without, in one ablation: runs, rows, the table."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from experiments.episodes import computed_row
from forestall.assembly.configuration import Given
from forestall.assembly.language import named_llm
from forestall.assembly.make import run_episode
from forestall.cli.flags import AblationFlags
from forestall.experiments.conduct import Experiment, conduct
from forestall.experiments.folder import episodes_in
from forestall.experiments.results import present
from forestall.experiments.runs import Choice, Run, runs_for
from forestall.experiments.settings import Settings
from forestall.experiments.worker import Work, config_of, prepared_run
from forestall.kinds import LLM, REASONER, REPLANNER
from forestall.statistics.cases import Case
from forestall.statistics.outcomes import name_of
from forestall.statistics.rows import MODEL, MODEL_PLANS, TEMPLATES, EpisodeRow
from llm.episodes import SYMBOLIC, good_answers, memory
from llm.server import Reply, purpose_of, said, serving

CHOICE = Choice(
    "ablation", "development", limit=2, sets=("robofail",), strategies=("proactive",),
    profiles=("kind",), models=True,
)  # fmt: skip
CASE = Case("robofail", "heat-potato", "robofail-heat-potato-1", 10_000)


def test_a_model_reasons_in_runs_of_its_own() -> None:
    plain = runs_for(Choice("ablation", profiles=("kind",)))
    both = runs_for(Choice("ablation", profiles=("kind",), models=True))
    assert set(plain) < set(both) and len({r.key for r in both}) == len(both)
    more = [r for r in both if r not in plain]
    assert {r.reasoning for r in more} == {MODEL, MODEL_PLANS}
    assert all(r.strategy == "proactive" and r.without is None for r in more)
    assert {name_of(r.setup) for r in more} == {
        "proactive, reasoning by model", "proactive, reasoning by model that plans",
    }  # fmt: skip
    assert {r.reasoning for r in plain} == {TEMPLATES}
    assert plain[0].key == both[0].key, "what was run before is not run again"


@pytest.mark.parametrize(
    ("reasoning", "reasoner", "replanner"),
    [
        (TEMPLATES, "preconditions", "planner"),
        (MODEL, "model", "planner"),
        (MODEL_PLANS, "model", "model"),
    ],
)
def test_who_explains_and_who_plans(reasoning: str, reasoner: str, replanner: str) -> None:
    settings = Settings(AblationFlags(llm="http://localhost:9/v1").given())
    assert settings.asks and not Settings().asks
    config = config_of(Run(CASE, "proactive", reasoning=reasoning), settings)
    assert (config.choice(REASONER).name, config.choice(REPLANNER).name) == (reasoner, replanner)
    assert config.choice(LLM).name == "openai"
    alone = [c for c in (config.choice(REASONER), config.choice(REPLANNER)) if c.name == "model"]
    assert all(c.options["otherwise"] == "none" for c in alone)
    without = config_of(Run(CASE, "proactive", without="reasoning"), settings)
    assert (without.choice(REASONER).name, without.choice(REPLANNER).name) == ("none", "anew")


@pytest.mark.slow
def test_the_table_has_all_of_them_with_intervals(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NO_PROXY", "*")
    runs = runs_for(CHOICE)
    answers = {r.case.task: scripted(r) for r in runs if r.reasoning == MODEL_PLANS}
    assert len(answers) == 2
    goals = {task: goal for task, (goal, _) in answers.items()}
    asked: dict[tuple[str, str], int] = {}

    def script(body: dict[str, Any]) -> Reply:
        text, purpose = body["messages"][1]["content"], purpose_of(body)
        (task,) = (t for t, goal in goals.items() if json.dumps(goal) in text)
        number = asked[task, purpose] = asked.get((task, purpose), -1) + 1
        of = answers[task][1][purpose]
        return said(of[number % len(of)])

    with serving(script) as server:
        given = named_llm(server.url).over(SYMBOLIC)
        experiment = Experiment(CHOICE, engine="inline", settings=Settings(given, pages="none"))
        rows = conduct(experiment, tmp_path, lambda *a: None)
    by = {(r.case.scenario, name_of(r.setup)): row for r, row in zip(runs, rows, strict=True)}
    assert not any(row.error for row in rows)
    for (_, name), row in by.items():
        if name in ("proactive", "proactive, reasoning by model that plans"):
            assert row.success, (name, row.failures)
        asks = row.reasoning != TEMPLATES
        assert bool(row.model_calls) == asks and (not asks or row.replans)
    kept = episodes_in(tmp_path).rows()
    assert {r.reasoning for r in kept.values()} == {TEMPLATES, MODEL, MODEL_PLANS}
    _, tables = present(tmp_path)
    (table,) = (t for t in tables if t.name.startswith("ablation-parts"))
    told = {row[1]: row for row in table.rows}
    assert len(told) == 5 and any("reasoning by model" in name for name in told)
    assert all("[" in "".join(row[2:]) for row in told.values())
    assert "A model stands alone" in table.note


def scripted(run: Run) -> tuple[str, dict[str, list[Any]]]:
    """The goal of a run, and what a good model answers in it."""
    plain = prepared_run(Run(run.case, "proactive"), Settings(SYMBOLIC))
    record = run_episode(plain, memory(run.case.task))
    assert record.success, run.case
    return record.task.goal.text, good_answers(record)


def test_rows_without_the_column_are_of_templates() -> None:
    row = computed_row(Work(Run(CASE, "proactive", reasoning=MODEL), Settings(Given())))
    assert EpisodeRow.from_json(row).reasoning == MODEL
    del row["reasoning"]
    assert EpisodeRow.from_json(row).reasoning == TEMPLATES
