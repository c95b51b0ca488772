from __future__ import annotations

import json
import os
import time
from dataclasses import replace
from pathlib import Path

import pytest

import forestall.view.index as indexing
from forestall.files import alone
from forestall.records.record import RunRecorder, write_record
from forestall.view.choosing import EACH, Shown, choose
from forestall.view.index import Index
from forestall.view.rows import Outcome, RunRow, outcome_of, read_row, source_of
from report import records

from .folders import make


def row_of(folder: Path) -> RunRow:
    source = source_of(folder)
    assert source is not None
    return read_row("run", source, source.stat().st_mtime)


def test_every_run_and_experiment_is_found_with_what_its_record_says(tmp_path: Path) -> None:
    folder = tmp_path / "runs"
    make(folder)
    index = Index(folder)
    found = index.now()
    assert set(found.runs) == {"good", "deep/bad", "begun", "damaged", "experiment/episodes/one"}
    good = found.runs["good"]
    assert (good.task, good.scenario, good.seed) == ("heat-potato", "microwave-occupied", 7)
    assert (good.alarms, good.replans, good.executed, good.simulated_s) == (1, 1, 13, 52.0)
    assert good.over and good.success
    begun = found.runs["begun"]
    assert not begun.over and begun.alarms == 1 and begun.executed == 8
    assert "damaged" in found.runs["damaged"].problem
    (experiment,) = found.experiments.values()
    assert (experiment.name, experiment.split, experiment.episodes) == ("experiment", "dev", 2)
    assert experiment.page


def test_the_head_of_a_record_says_the_same_as_the_record(tmp_path: Path) -> None:
    record = records.potato_record()
    path = write_record(tmp_path, record)
    row = row_of(tmp_path)
    path.write_text(json.dumps(json.loads(path.read_text())))  # on one line: nothing to stop at
    assert replace(row_of(tmp_path), changed_s=row.changed_s) == row


def test_what_has_not_changed_is_not_read_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, read = tmp_path / "runs", []
    make(folder)

    def counted(place: str, source: Path, changed_s: float) -> RunRow:
        read.append(place)
        return read_row(place, source, changed_s)

    monkeypatch.setattr(indexing, "read_row", counted)
    first = Index(folder).now()
    assert sorted(read) == ["begun", "damaged", "deep/bad", "experiment/episodes/one", "good"]
    write_record(folder / "good", replace(records.potato_record(), seed=8))
    again = Index(folder).now()
    assert read[5:] == ["good"]
    assert again.runs["good"].seed == 8
    assert again.runs["deep/bad"] == first.runs["deep/bad"]


@pytest.mark.parametrize("damage", ["", "[]", '{"format": 1, "rows": {"good": [[1], "run", {}]}}'])
def test_a_damaged_cache_is_read_over(tmp_path: Path, own_cache: Path, damage: str) -> None:
    folder = tmp_path / "runs"
    make(folder)
    Index(folder).now()
    (file,) = (own_cache / "view").iterdir()
    file.write_text(damage)
    assert len(Index(folder).now().runs) == 5


def test_a_cache_that_cannot_be_written_is_done_without(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make(tmp_path / "runs")
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("FORESTALL_CACHE", str(tmp_path / "file"))
    assert len(Index(tmp_path / "runs").now().runs) == 5


def test_a_run_is_at_work_while_its_process_lives_or_it_was_written_lately(tmp_path: Path) -> None:
    records.follow(RunRecorder(tmp_path), records.potato_record(), 3)
    row = row_of(tmp_path)
    assert outcome_of(row, tmp_path) is Outcome.RUNNING
    assert outcome_of(replace(row, changed_s=time.time() - 3600), tmp_path) is Outcome.BROKEN_OFF
    with alone(tmp_path):
        old = replace(row, changed_s=time.time() - 3600)
        assert outcome_of(old, tmp_path) is Outcome.RUNNING
        holder = tmp_path / ".lock.holder"
        holder.write_text(holder.read_text().replace(f"process {os.getpid()}", "process 999999999"))
        assert outcome_of(row, tmp_path) is Outcome.BROKEN_OFF


def test_outcomes_of_runs_that_are_over(tmp_path: Path) -> None:
    for success, outcome in (
        (True, Outcome.SUCCEEDED),
        (False, Outcome.FAILED),
        (None, Outcome.NOT_SCORED),
    ):
        write_record(tmp_path, replace(records.potato_record(), success=success))
        assert outcome_of(row_of(tmp_path), tmp_path) is outcome
    (tmp_path / "record.json").write_text("")
    assert outcome_of(row_of(tmp_path), tmp_path) is Outcome.UNREADABLE


def test_filters_and_pages() -> None:
    runs = [
        Shown(
            RunRow(
                f"r{k}", 0.0, "a" if k % 2 else "b", scenario=None if k % 3 else "s", alarms=k % 5
            ),
            Outcome.SUCCEEDED if k % 7 else Outcome.FAILED,
        )
        for k in range(250)
    ]
    everything = choose(runs, {})
    assert (everything.count, everything.pages, len(everything.runs)) == (250, 3, EACH)
    assert dict(everything.filters[0].values) == {"a": 125, "b": 125}
    asked = {"task": "a", "scenario": "undisturbed", "outcome": "failed", "alarm": "without"}
    found = choose(runs, asked)
    assert [r.row.place for r in found.runs] == [
        f"r{k}" for k in range(250) if k % 2 and k % 3 and not k % 7 and not k % 5
    ]
    last = choose(runs, {"page": "99"})
    assert last.page == 3 and len(last.runs) == 50
    for odd in ("0", "-1", "²", "x", "9" * 30):
        assert choose(runs, {"page": odd}).page == 1
    gone = choose(runs, {"task": "gone"})
    assert gone.count == 0 and ("gone", 0) in gone.filters[0].values
