"""Experiments while they run, and runs beside a run, as the view shows them."""

from __future__ import annotations

import http.client
import os
import time
from pathlib import Path

import pytest

from forestall.errors import FileFormatError
from forestall.files import alone
from forestall.records.beside import folder_beside
from forestall.records.record import write_record
from forestall.view.batch import NEWEST, batch_of
from forestall.view.index import Index
from forestall.view.pages import environment
from report import records

from .folders import add_episode, ask, begin_experiment, shown


def test_how_far_an_experiment_has_come(tmp_path: Path) -> None:
    folder = tmp_path / "batch"
    begin_experiment(folder, 40)
    assert batch_of(folder).newest == []
    for seed in range(NEWEST + 5):
        add_episode(folder, seed=seed, success=seed % 2 == 0, scenario="<b>" if seed else None)
    with (folder / "episodes.jsonl").open("a") as rows:
        rows.write('{"task": "half')
    batch = batch_of(folder)
    assert [e.seed for e in batch.newest] == [str(k) for k in range(NEWEST + 4, 4, -1)]
    assert batch.newest[0].success and not batch.newest[1].success
    assert batch.done == NEWEST + 5
    assert [(a.set, a.episodes) for a in batch.asked] == [("robofail", 40)]
    (row,) = Index(tmp_path).now().experiments.values()
    assert (row.episodes, row.wanted) == (NEWEST + 5, 40)


def written(folder: Path, began_s: float, last_s: float) -> None:
    """Date the call's beginning and its newest episode."""
    for name, at in (("effort.jsonl", began_s), ("episodes.jsonl", last_s)):
        os.utime(folder / name, (at, at))


def test_the_time_left_goes_by_the_pace_of_the_call(tmp_path: Path) -> None:
    folder, now = tmp_path / "batch", time.time()
    begin_experiment(folder, 12, before=2)
    for seed in range(2):  # of an earlier call
        add_episode(folder, seed=seed)
    written(folder, now - 600, now - 7000)
    assert batch_of(folder).left_s is None
    for seed in range(2, 6):
        add_episode(folder, seed=seed)
    written(folder, now - 600, now - 120)
    assert batch_of(folder).left_s == pytest.approx(6 * 480 / 4)
    assert batch_of(folder, busy=False).left_s is None
    with shown(tmp_path) as server, alone(folder):
        assert "6 of 12 episodes, about 12 min left" in ask(server, "/experiment/batch/")[1]


def test_without_a_note_of_the_beginning_no_time_is_told(tmp_path: Path) -> None:
    begin_experiment(tmp_path / "batch", 3)
    add_episode(tmp_path / "batch")
    written(tmp_path / "batch", 1e9, 1e9 + 60)
    assert batch_of(tmp_path / "batch").left_s is None


@pytest.mark.parametrize(
    ("seconds", "said"),
    [(0, "less than a minute"), (29, "less than a minute"), (95, "2 min"), (7300, "2 h 2 min")],
)
def test_an_estimate_is_said_in_no_finer_units(seconds: float, said: str) -> None:
    assert environment().filters["roughly"](seconds) == said


def test_damage_is_told(tmp_path: Path) -> None:
    begin_experiment(tmp_path / "batch", 2)
    (tmp_path / "batch" / "episodes.jsonl").write_text("[]\n")
    with pytest.raises(FileFormatError, match="no episode"):
        batch_of(tmp_path / "batch")


def test_a_batch_is_followed_until_it_is_over(tmp_path: Path) -> None:
    folder = tmp_path / "batch"
    begin_experiment(folder, 2)
    with shown(tmp_path) as server, alone(folder):
        status, text, _ = ask(server, "/experiment/batch/")
        assert status == 200 and "0 of 2 episodes" in text and "data-follow" in text
        assert "running" in ask(server, "/")[1]
        connection = http.client.HTTPConnection("127.0.0.1", int(server.server_address[1]))
        connection.request("GET", "/events?experiment=batch&seen=0")
        answer = connection.getresponse()
        add_episode(folder)
        assert b"event: changed" in answer.read()
        connection.close()
        text = ask(server, "/experiment/batch/")[1]  # the index may be a moment older
        assert "1 of 2 episodes" in text and "heat-potato, undisturbed" in text
        add_episode(folder)
        server.index._next_s = 0.0
        status, text, _ = ask(server, "/experiment/batch/")
        assert status == 404 and "bench report" in text
        assert ask(server, "/events?experiment=none&seen=0")[0] == 404


def test_a_batch_that_nobody_holds_broke_off(tmp_path: Path) -> None:
    folder = tmp_path / "batch"
    begin_experiment(folder, 2)
    os.utime(folder / "episodes.jsonl", (time.time() - 3600, time.time() - 3600))
    with shown(tmp_path) as server:
        status, text, _ = ask(server, "/experiment/batch/")
        assert status == 200 and "broken off" in text and "data-follow" not in text
        assert "goes on where it was" in text


def test_runs_beside_a_run_are_in_the_index_and_lead_back(tmp_path: Path) -> None:
    run = records.potato_record(width=160, height=120)
    write_record(tmp_path / "run", run)
    write_record(folder_beside(tmp_path / "run", "none"), records.unjudged_record())
    with shown(tmp_path) as server:
        assert set(server.index.now().runs) == {"run", "run/beside/none"}
        page = ask(server, "/run/run/")[1]
        assert "Run once more without a monitor" in page and 'href="beside/none/index.html"' in page
        status, _, place = ask(server, "/run/run/beside/none/index.html")
        assert (status, place) == (303, "/run/run/beside/none/")
        assert ask(server, place)[0] == 200
        pair = ask(server, "/compare?run=run&run=run/beside/none")
        assert pair[0] == 200 and "Two runs side by side" in pair[1]
