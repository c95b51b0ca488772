"""Episodes of one's own choice: seeds, runs, resuming, tables."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from experiments.episodes import computed_row
from forestall.assembly.configuration import Given
from forestall.cli.main import call
from forestall.errors import InputError
from forestall.experiments.conduct import Experiment, conduct
from forestall.experiments.episodes import KIND, Episodes, folder_for, parse_seeds, table
from forestall.experiments.folder import ABOUT, ROWS
from forestall.experiments.runs import Run
from forestall.experiments.settings import Settings
from forestall.experiments.worker import Work
from forestall.statistics.cases import Case
from forestall.statistics.rows import EpisodeRow

EPISODES = Episodes(("toast-bread",), ("knife-blocked",), ("none",), (1, 2))
TOAST = Experiment(
    EPISODES,
    settings=Settings(pages="none"),
    kind=KIND,
    engine="inline",
)


def play(experiment: Experiment, out: Path) -> list[EpisodeRow]:
    return conduct(experiment, out, lambda *a: None, computed_row, lambda *a: None)


def test_seeds_are_read_and_those_of_demonstrations_refused() -> None:
    assert list(parse_seeds("100:103")) == [100, 101, 102]
    assert list(parse_seeds("7")) == [7]
    for text in ("a", "5:5", "-3:2", "1000000:1000001", "1:2:3"):
        with pytest.raises(InputError, match="seeds"):
            parse_seeds(text)


def test_runs_are_checked_before_anything_runs(tmp_path: Path) -> None:
    assert [(r.case.task, r.case.scenario, r.case.seed) for r in TOAST.choice.runs()] == [
        ("toast-bread", None, 1),
        ("toast-bread", None, 2),
        ("toast-bread", "knife-blocked", 1),
        ("toast-bread", "knife-blocked", 2),
    ]
    wrong = replace(TOAST, choice=Episodes(("toast-bred",), (), ("none",), (1,)))
    with pytest.raises(InputError, match="toast-bread"):
        play(wrong, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_finished_episodes_are_not_run_again_and_others_join_them(tmp_path: Path) -> None:
    first = play(TOAST, tmp_path)
    before = (tmp_path / ROWS).read_text()
    assert play(TOAST, tmp_path) == first
    assert (tmp_path / ROWS).read_text() == before
    more = replace(TOAST, choice=replace(EPISODES, seeds=(2, 3)))
    assert len(play(more, tmp_path)) == 4
    assert len((tmp_path / ROWS).read_text().splitlines()) == 6


def test_rows_of_other_code_settings_or_memory_do_not_pass_for_current(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    play(TOAST, tmp_path / "a")
    oracle = replace(TOAST, settings=Settings(Given.named({"states": "oracle"}), pages="none"))
    with pytest.raises(InputError, match="states 'learned'"):
        play(oracle, tmp_path / "a")
    assert folder_for(oracle, None) != folder_for(TOAST, None)
    memory = tmp_path / "memory.db"
    memory.write_bytes(b"one")
    given = replace(TOAST, settings=Settings(Given.named({"memory": str(memory)})))
    one = given.about()
    memory.write_bytes(b"two")
    assert given.about().sources != one.sources
    monkeypatch.setattr("forestall.experiments.folder.sources_digest", lambda *a, **k: "other")
    with pytest.raises(InputError, match="sources"):
        play(TOAST, tmp_path / "a")


def test_a_changed_file_of_ones_own_is_another_experiment(tmp_path: Path) -> None:
    document = (Path(__file__).parents[2] / "docs" / "task-format.md").read_text(encoding="utf-8")
    task, _, _ = re.findall(r"```toml\n(.*?)```", document, re.DOTALL)
    path = tmp_path / "own.toml"
    path.write_text(task)
    mine = replace(TOAST, choice=Episodes((str(path),), (), ("none",), (1,)))
    assert len(play(mine, tmp_path / "out")) == 1
    path.write_text(task.replace('title = "', 'title = "Quickly: '))
    with pytest.raises(InputError, match="files"):
        play(mine, tmp_path / "out")


def test_a_file_is_no_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "episodes.jsonl"
    assert call(["bench", "episodes", "--task", "toast-bread", "--out", str(out)]) == 2
    assert "give a folder" in capsys.readouterr().err
    play(TOAST, tmp_path / "made")
    assert json.loads((tmp_path / "made" / ABOUT).read_text())["kind"] == KIND
    assert call(["bench", "report", str(tmp_path / "made")]) == 2
    assert "no experiment" in capsys.readouterr().err


def test_the_table_counts_and_gives_exact_intervals() -> None:
    runs = [Run(Case("undisturbed", "toast-bread", None, seed), "none") for seed in range(20)]
    rows = [EpisodeRow.from_json(computed_row(Work(run, Settings()))) for run in runs]
    told = replace(rows[3].judged[1], decision="replan", cause="the knife is gone")
    rows[3] = replace(rows[3], judged=(rows[3].judged[0], told, rows[3].judged[2]))
    (line,) = table(rows)
    assert (line["succeeded"], line["n"], line["alarms"], line["runs_with_alarm"]) == (20, 20, 1, 1)
    assert line["boundaries"] == 60
    assert line["low"] == pytest.approx(0.025 ** (1 / 20))  # Clopper-Pearson, no failure
    assert line["high"] == 1.0
