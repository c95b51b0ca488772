"""The same start under other strategies: with the run, afterwards, and what cannot be run again."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from forestall.assembly.again import config_of, under
from forestall.assembly.configuration import RunConfig, run_config
from forestall.assembly.make import prepare, run_episode
from forestall.cli.main import call
from forestall.errors import FileFormatError, InputError
from forestall.kinds import STRATEGY
from forestall.records.beside import beside, folder_beside
from forestall.records.codec import record_from_json, record_to_json
from forestall.records.record import read_record, write_record
from report import records

CHIPS = ["run", "fasten-plate", "--scenario", "hole-full-of-chips", "--seed", "3", "--quiet"]


def without_memory(folder: Path, *more: str) -> list[str]:
    return [*CHIPS, "--strategy", "plan-check", "--out", str(folder), *more]


def test_what_no_monitor_would_have_cost_stands_beside_the_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code = call(without_memory(tmp_path / "run", "--beside", "none", "--json"))
    printed = json.loads(capsys.readouterr().out)
    run = read_record(tmp_path / "run")
    (other,) = beside(tmp_path / "run", run)
    assert code == (0 if run.success else 1)  # of the run itself, whatever is beside it
    assert (other.success, other.strategy) == (False, "none")
    assert dict(other.provenance)["beside"] == {"run": "../..", "strategy": "plan-check"}
    (said,) = printed["beside"]
    assert said["failures"] == list(other.failures) and said["success"] is False
    assert read_record(said["folder"]) == other
    page = (tmp_path / "run" / "index.html").read_text("utf-8")
    assert "Run once more without a monitor, the task failed after" in page
    assert 'href="beside/none/index.html"' in page
    assert (tmp_path / "run" / "beside" / "none" / "index.html").is_file()
    assert b"not reached" in (tmp_path / "run" / "beside" / "timeline.svg").read_bytes()


def test_a_stored_run_is_run_again_and_its_page_drawn_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    assert call(without_memory(run)) in (0, 1)
    assert "Run once more" not in (run / "index.html").read_text("utf-8")
    capsys.readouterr()
    assert call(["beside", str(run), "--quiet"]) == 0
    out = capsys.readouterr().out
    assert [line.split()[0] for line in out.splitlines()[1:3]] == ["plan-check", "none"]
    assert out.splitlines()[2].split()[1] == "failed"
    assert "Run once more without a monitor" in (run / "index.html").read_text("utf-8")
    assert call(["beside", str(run), "--strategy", "retry-once", "--quiet"]) == 0
    assert [r.strategy for r in beside(run, read_record(run))] == ["none", "retry-once"]
    for name, words in (("plan-check", "name another one"), ("noone", "none")):
        assert call(["beside", str(run), "--strategy", name, "--quiet"]) == 2
        assert words in capsys.readouterr().err


@pytest.mark.slow
def test_all_is_the_four_of_the_paper(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call([*CHIPS, "--strategy", "all", "--out", str(tmp_path)]) == 0
    run = read_record(tmp_path)
    assert run.strategy == "proactive"
    assert [r.strategy for r in beside(tmp_path, run)] == ["none", "online", "post-hoc"]
    page = (tmp_path / "index.html").read_text("utf-8")
    assert page.count("this run") == 1 and "The same start, other strategies" in page
    table = capsys.readouterr().out
    assert all(name in table for name in ("proactive", "none", "online", "post-hoc"))


def test_what_had_another_start_is_not_beside(tmp_path: Path) -> None:
    run = records.potato_record(width=160, height=120)
    write_record(tmp_path, run)
    other = records.unjudged_record()
    write_record(folder_beside(tmp_path, "none"), other)
    assert [r.strategy for r in beside(tmp_path, run)] == ["none"]
    again = replace(run, seed=run.seed + 1)
    assert beside(tmp_path, again) == ()


def test_a_record_that_does_not_say_how_it_was_made_is_not_run_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_record(tmp_path, records.empty_record())
    with pytest.raises(FileFormatError, match="does not say how it was made"):
        config_of(read_record(tmp_path))
    assert call(["beside", str(tmp_path)]) == 2
    assert "cannot be run again" in capsys.readouterr().err


@pytest.mark.parametrize(
    "how",
    [
        {},
        {"scenario": "hole-full-of-chips", "seed": 5, "strategy": "plan-check"},
        {"detector": {"name": "scene-graph", "threshold": 0.8}, "without": "structure"},
        {"domain": "bench", "keep_observations": False, "final_look": True},
    ],
)
def test_a_record_gives_the_configuration_back(how: dict[str, Any]) -> None:
    config = run_config("fasten-plate", **how)
    quick = under(config, "none") if config.choice(STRATEGY).name != "none" else config
    record = run_episode(prepare(quick), None)
    read = record_from_json(json.loads(json.dumps(record_to_json(record))))
    assert config_of(read) == quick
    assert differs(config, quick) == {"strategy"}


def test_a_run_is_not_beside_itself() -> None:
    with pytest.raises(InputError, match="the run itself has the strategy 'none'"):
        under(run_config("fasten-plate", strategy="none"), "none")


def differs(one: RunConfig, other: RunConfig) -> set[str]:
    return {a.kind for a, b in zip(one.choices, other.choices, strict=True) if a != b}
