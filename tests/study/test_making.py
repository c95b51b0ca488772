"""From watched runs to a study: symbolic runs with drawn pictures, every detector's explanation."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from forestall.assembly.configuration import Given, run_config
from forestall.assembly.make import prepare, run_episode
from forestall.assembly.recording import RecordingJob, record_one
from forestall.cli.main import call
from forestall.config import DEMONSTRATION_SEEDS
from forestall.errors import InputError, UnknownNameError
from forestall.experiments.runs import Run
from forestall.experiments.settings import Settings
from forestall.experiments.worker import broken_row, prepared_run
from forestall.llm.explaining import ModelWriter, TemplateWriter
from forestall.memory.store import open_store
from forestall.records.record import read_record, write_record
from forestall.statistics.cases import Case
from forestall.statistics.rows import EpisodeRow
from forestall.study.explaining import REASONING, Explainer, memory_of
from forestall.study.making import Asked, make_study
from forestall.study.model import read_study
from forestall.study.runs import runs_in
from forestall.types.demonstration import Demonstration, View
from forestall.types.episode import EpisodeRecord
from forestall.types.observation import Observation
from llm.scenes import Scripted
from report.records import frame

SYMBOLIC = Given.named({"world": "symbolic", "perceiver": "given-graph"})
TASK, SCENARIO, SEED = "heat-potato", "robofail-heat-potato-2", 10_003
AGAINST = ("objects", "preconditions", REASONING)


@cache
def demonstrations() -> tuple[Demonstration, ...]:
    seeds = (DEMONSTRATION_SEEDS + 10 * k for k in range(2))
    return tuple(record_one(RecordingJob(TASK, seed, SYMBOLIC)) for seed in seeds)


@cache
def watched(scenario: str | None, strategy: str = "watch") -> EpisodeRecord:
    config = run_config(TASK, scenario, seed=SEED, given=SYMBOLIC, strategy=strategy)
    return run_episode(prepare(config), list(demonstrations()))


def kept(folder: Path, record: EpisodeRecord, pictures: bool = True, memory: str = "") -> Path:
    """The record in a folder, with drawn pictures where a symbolic world has none."""
    boundaries = []
    for b in record.boundaries:
        seen: Any = b.observation
        if pictures:
            hand = seen.gripper
            shown = (frame(7 * b.index), frame(b.index + 100 * (record.scenario is None)))
            seen = Observation(shown, hand, b.time_s)
        boundaries.append(replace(b, observation=seen))
    provenance = dict(record.provenance) | ({"memory": memory} if memory else {})
    record = replace(
        record, boundaries=tuple(boundaries), provenance=tuple(sorted(provenance.items()))
    )
    write_record(folder, record)
    return folder


def asked(**what: Any) -> Asked:
    return Asked(**{"against": AGAINST, **what})


def test_a_watched_failure_becomes_an_item(tmp_path: Path) -> None:
    results = tmp_path / "runs"
    kept(results / "failing", watched(SCENARIO))
    kept(results / "twin", watched(None))
    kept(results / "stepped-in", watched(SCENARIO, "proactive"))
    study = make_study(tmp_path / "study", [results], asked())
    assert read_study(tmp_path / "study") == study
    (item,) = study.items
    assert item.cause.startswith("A bowl stands in the closed microwave")
    assert item.expected_from == "the same room without the disturbance"
    assert item.expected != item.actual and item.source["scenario"] == SCENARIO
    assert item.source["known"] <= item.source["boundary"] <= item.source["effect"]
    said = {e.detector: e for e in item.explanations}
    assert list(said) == ["scene-graph", *AGAINST]
    assert "the bowl is inside the microwave" in said["scene-graph"].text
    assert "something is in or on the microwave" in said["preconditions"].text
    assert "now: 1 bowl" in said["objects"].text and "-1" not in said["scene-graph"].text
    assert all(e.writer == "templates" for e in said.values())
    assert any("strategy proactive" in why for why in study.left_out)


def test_what_cannot_be_asked_about_is_counted_by_reason(tmp_path: Path) -> None:
    kept(tmp_path / "no-pictures", watched(SCENARIO), pictures=False)
    with pytest.raises(InputError, match="1 the picture was not kept"):
        make_study(tmp_path / "a", [tmp_path / "no-pictures"], asked())
    kept(tmp_path / "alone", watched(SCENARIO))
    with pytest.raises(InputError, match="no picture of what was expected"):
        make_study(tmp_path / "b", [tmp_path / "alone"], asked())
    with pytest.raises(InputError, match="no alarm in time by image"):
        make_study(tmp_path / "c", [tmp_path / "alone"], asked(against=("image",)))
    with pytest.raises(UnknownNameError, match="objects"):
        make_study(tmp_path / "d", [tmp_path / "alone"], asked(against=("object",)))
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(InputError, match="no run lies in"):
        make_study(tmp_path / "e", [empty], asked())
    with pytest.raises(InputError, match="name a folder of runs"):
        make_study(tmp_path / "f", [tmp_path / "nowhere"], asked())
    with pytest.raises(InputError, match="holds no study"):
        make_study(tmp_path / "alone", [tmp_path / "alone"], asked())
    assert not (tmp_path / "a" / "study.json").exists()


def test_the_memory_gives_the_expected_picture_and_the_caption(tmp_path: Path) -> None:
    memory = tmp_path / "memory.db"
    with open_store(memory, create=True) as store:
        for d in demonstrations():
            seen = View(None, "A clean plate.", "", "listing (stand-in)")
            image = store.put_image(frame(d.seed).rgb)
            steps = tuple(replace(s, image=image, view=seen) for s in d.steps)
            store.add(replace(d, steps=steps, id=""))
    results = kept(tmp_path / "run", watched(SCENARIO), memory=str(memory))
    record = read_record(results)
    remembered = memory_of(record)
    assert remembered is not None and memory_of(record, memory) == remembered
    (failure,) = runs_in([results]).failures
    alarmed = next(
        (b, v) for b in record.boundaries for v in b.watched
        if v.detector == "scene-graph" and v.nearest is not None and v.score is not None
        and v.score < v.threshold
    )  # fmt: skip
    boundary, verdict = alarmed
    known = set(remembered.demonstrations)
    assert verdict.nearest is not None
    nearest = replace(verdict.nearest, demonstration=min(known))
    verdict = replace(verdict, nearest=nearest)
    picture = remembered.picture(nearest, failure.domain)
    assert picture is not None and picture.shape == (48, 64, 3)
    lines = Explainer(failure, remembered, TemplateWriter()).lines(boundary, "caption", verdict)
    assert lines[0].startswith("now: ") and lines[1] == "then: A clean plate."
    assert memory_of(watched(SCENARIO)) is None


def test_a_model_writes_where_it_answers_and_is_named(tmp_path: Path) -> None:
    results = kept(tmp_path / "runs" / "x", watched(SCENARIO)).parent
    kept(results / "twin", watched(None))
    model = Scripted([{"explanation": "Bowl-1 is in the way."}, "nonsense"])
    study = make_study(tmp_path / "s", [results], asked(against=("objects",)), ModelWriter(model))
    first, second = study.items[0].explanations
    assert first.text == "The bowl is in the way." and first.writer == "model"
    assert second.writer == "templates" and "now: 1 bowl" in second.text


def experiment(folder: Path, *rows: EpisodeRow, **records: EpisodeRecord) -> Path:
    """A folder of results with a page for each of its watched episodes."""
    folder.mkdir()
    (folder / "experiment.json").write_text("{}")
    lines = [json.dumps(row.to_json()) for row in rows]
    (folder / "episodes.jsonl").write_text("\n".join([*lines, ""]))
    for row in rows:
        kept(folder / "episodes" / row.key, records[(row.scenario and "failing") or "twin"])
    return folder


def row_of(scenario: str | None, **fields: Any) -> EpisodeRow:
    case = Case("robofail" if scenario else "undisturbed", TASK, scenario, SEED)
    run = Run(case, "watch")
    empty = broken_row(run, "", prepared_run(run, Settings(SYMBOLIC)))
    return replace(empty, **{"profile": "honest", "known": None, "effect": None, **fields})


def test_an_experiment_says_when_a_run_was_lost(tmp_path: Path) -> None:
    records = {"failing": watched(SCENARIO), "twin": watched(None)}
    twin = row_of(None, success=True)
    lost = row_of(SCENARIO, known=8, effect=9)
    results = experiment(tmp_path / "lost", lost, twin, **records)
    (failure,) = runs_in([results]).failures
    assert (failure.known, failure.effect, failure.profile) == (8, 9, "honest")
    study = make_study(tmp_path / "study", [results], asked())
    assert study.items[0].source["boundary"] in (8, 9)
    for fields, why in (
        ({"known": 8, "effect": 8, "slips": 1}, "failed for more than one reason"),
        ({"known": 9, "effect": 8}, "could not be known before it came"),
        ({}, "could not be known before it came"),
    ):
        place = tmp_path / f"results-{len(list(tmp_path.iterdir()))}"
        runs = runs_in([experiment(place, row_of(SCENARIO, **fields), twin, **records)])
        assert not runs.failures and any(why in told for told in runs.left_out)


def test_a_run_without_a_scenario_was_lost_by_facts(tmp_path: Path) -> None:
    row = row_of(
        None, known=8, effect=9, causes=("vacant(Microwave-1)", "held_by(Plate-1, gripper)")
    )
    record = replace(watched(SCENARIO), scenario=None)
    (failure,) = runs_in([experiment(tmp_path / "x", row, twin=record)]).failures
    assert failure.cause[0].isupper() and "microwave" in failure.cause


def test_answered_studies_are_not_made_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = kept(tmp_path / "runs" / "x", watched(SCENARIO)).parent
    kept(results / "twin", watched(None))
    folder = str(tmp_path / "s")
    line = ["study", "make", folder, "--from", str(results), "--against", "objects", "--seed", "4"]
    assert call(line) == 0 and call(line) == 0
    assert "1 items, scene-graph against objects; 15 raters" in capsys.readouterr().out
    answers = tmp_path / "s" / "answers"
    answers.mkdir()
    (answers / "rater-001.jsonl").write_text("")
    assert call(line) == 2
    assert "holds answers to its study" in capsys.readouterr().err
