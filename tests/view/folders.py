"""Folders with runs and experiments, made without a simulator; a server that shows them."""

from __future__ import annotations

import http.client
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from forestall.records.record import LINES_NAME, RunRecorder, write_record
from forestall.types.episode import EpisodeRecord
from forestall.view.serving import ViewServer, viewing
from report import records

MARKUP = '<script>document.title = "taken"</script><b>bold</b>'
RIGHT_TO_LEFT = "\u202eצלחת נקייה במיקרוגל"
LONG = "Überlanges" * 30
"""Three hundred characters without a space."""

NASTY = (MARKUP, RIGHT_TO_LEFT, LONG)


def named(record: EpisodeRecord, title: str, scenario: str | None = None) -> EpisodeRecord:
    """A record whose names are others."""
    return replace(record, task=replace(record.task, title=title), scenario=scenario)


def make(folder: Path) -> None:
    """Runs that succeeded, failed, broke off and are damaged; an experiment with one more."""
    write_record(folder / "good", records.potato_record(width=160, height=120))
    write_record(folder / "deep" / "bad", replace(records.unjudged_record(), scenario=None))
    records.follow(RunRecorder(folder / "begun"), records.potato_record(), 9)
    os.utime(folder / "begun" / LINES_NAME, (1e9, 1e9))  # long ago
    (folder / "damaged").mkdir()
    (folder / "damaged" / "record.json").write_text('{"kind": "episode", ')
    experiment = folder / "experiment"
    write_record(experiment / "episodes" / "one", records.looked_after_record())
    (experiment / "experiment.json").write_text(json.dumps({"kind": "experiment", "split": "dev"}))
    (experiment / "episodes.jsonl").write_text("{}\n{}\n")
    (experiment / "index.html").write_text('<a href="episodes/one/index.html">one</a>')
    (experiment / "tables").mkdir()
    (experiment / "tables" / "a.csv").write_text("a,b\n")


def begin_experiment(folder: Path, wanted: int, before: int | None = None) -> None:
    """An experiment of which no episode is finished yet, whose call says what was there before."""
    asked = {"set": "robofail", "profile": "kind", "strategy": "watch", "setup": "watch"}
    call: dict[str, object] = {
        "jobs": 2,
        "engine": "local",
        "machine": "m",
        "python": "3",
        "date": "2026-01-01",
    }
    if before is not None:
        call["before"] = before
    effort = {**call, "episodes": 0, "seconds": 0.0, "asked": [{**asked, "episodes": wanted}]}
    folder.mkdir(parents=True)
    (folder / "experiment.json").write_text(json.dumps({"kind": "experiment", "split": "dev"}))
    (folder / "effort.jsonl").write_text(json.dumps(effort) + "\n")
    (folder / "episodes.jsonl").write_text("")


def add_episode(folder: Path, **said: object) -> None:
    """One more is finished."""
    row = {"task": "heat-potato", "scenario": None, "strategy": "watch", "seed": 3, "end": "over"}
    with (folder / "episodes.jsonl").open("a") as rows:
        rows.write(json.dumps({**row, "success": True, "simulated_s": 52.0, **said}) + "\n")


@contextmanager
def shown(folder: Path) -> Iterator[ViewServer]:
    """A server that answers."""
    with viewing(folder, port=0) as server, server.answering():
        yield server


def ask(server: ViewServer, path: str, **headers: str) -> tuple[int, str, str]:
    """Status, text and the place that it leads to."""
    port = int(server.server_address[1])
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=120)
    connection.request("GET", path, headers=headers)
    response = connection.getresponse()
    text = response.read().decode("utf-8", "replace")
    connection.close()
    return response.status, text, response.getheader("Location") or ""
