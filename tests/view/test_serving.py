"""The view over HTTP: pages, files, events, refusals, names of any kind."""

from __future__ import annotations

import http.client
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from urllib.parse import quote

import pytest

from forestall.cli.main import call
from forestall.errors import InputError
from forestall.records.record import RunRecorder, write_record
from forestall.view.comparing import compare
from forestall.view.serving import viewing
from report import records

from .folders import LONG, MARKUP, NASTY, ask, make, named, shown


def test_an_index_the_page_of_each_run_and_two_side_by_side(tmp_path: Path) -> None:
    folder = tmp_path / "runs"
    make(folder)
    with shown(folder) as server:
        status, text, _ = ask(server, "/")
        assert status == 200 and "5 of 5 runs" in text
        for words in ("/run/good/", "/run/deep/bad/", "broken off", "succeeded", "unreadable"):
            assert words in text, words
        assert "1 of 5 runs" in ask(server, "/?outcome=failed")[1]
        assert "No run is like that" in ask(server, "/?outcome=failed&alarm=with")[1]
        status, text, _ = ask(server, "/run/good/")
        assert status == 200 and 'href="/">‹ All runs' in text and records.CAUSE in text
        assert "broken off" in ask(server, "/run/begun/")[1]
        status, text, _ = ask(server, "/compare?run=good&run=deep/bad")
        assert status == 200 and "microwave-occupied" in text and "undisturbed" in text
        assert ask(server, "/view.css")[0] == ask(server, "/view.js")[0] == 200


def test_experiments_and_their_files(tmp_path: Path) -> None:
    folder = tmp_path / "runs"
    make(folder)
    with shown(folder) as server:
        text = ask(server, "/")[1]
        assert "/experiment/experiment/" in text and "2 episodes" in text
        assert "episodes/one" in ask(server, "/experiment/experiment/")[1]
        assert ask(server, "/experiment/experiment/tables/a.csv")[1] == "a,b\n"
        status, _, place = ask(server, "/experiment/experiment/episodes/one/index.html")
        assert status == 303 and place == "/run/experiment/episodes/one/"
        assert ask(server, place)[0] == 200
        (folder / "experiment" / "index.html").unlink()
        status, text, _ = ask(server, "/experiment/experiment/")
        assert status == 404 and "forestall bench report" in text


def test_only_what_belongs_to_runs_and_experiments_is_served(tmp_path: Path) -> None:
    folder = tmp_path / "runs"
    make(folder)
    (tmp_path / "secret.json").write_text("{}")
    (folder / "experiment" / "link.json").symlink_to(tmp_path / "secret.json")
    (folder / "good" / "images" / "page.html").write_text("<p>")
    with shown(folder) as server:
        picture = next((folder / "good" / "images").glob("*.jpg")).name
        assert ask(server, f"/run/good/images/{picture}")[0] == 200
        for path in (
            "/run/good/record.json",
            "/run/good/images/page.html",
            "/run/good/images/none.jpg",
            "/run/none/",
            "/run/..%2f..%2f/",
            "/run/good/images/..%2f..%2f..%2fsecret.json",
            "/experiment/none/",
            "/experiment/experiment/..%2f..%2fsecret.json",
            "/experiment/experiment/link.json",
            "/secret.json",
            "/x",
        ):
            assert ask(server, path)[0] in (404, 500), path
        for path in ("/compare", "/compare?run=good", "/compare?run=good&run=good&run=good"):
            assert ask(server, path)[0] == 400, path
        assert ask(server, "/compare?run=good&run=none")[0] == 404
        assert ask(server, "/run/damaged/")[0] == 500
        assert ask(server, "/", Host="evil.example")[0] == 403


@pytest.mark.parametrize("name", NASTY)
def test_names_of_any_kind_change_nothing(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "runs"
    place = name[:60].replace("/", "%?#")
    write_record(folder / place, named(records.potato_record(), name, name))
    records.follow(RunRecorder(folder / "live"), named(records.potato_record(), name, name), 9)
    link = quote(place)
    with shown(folder) as server:
        pages = [
            ask(server, path)
            for path in ("/", f"/run/{link}/", "/run/live/", f"/compare?run={link}&run=live")
        ]
        assert "1 of 2 runs" in ask(server, f"/?scenario={quote(name)}&outcome=succeeded")[1]
    assert [status for status, _, _ in pages] == [200] * 4
    texts = [text for _, text, _ in pages]
    assert not any("<script>document" in t or "<b>bold" in t for t in texts)
    if name == MARKUP:
        assert all("&lt;script&gt;" in t for t in texts)
    if name == LONG:
        assert all(LONG in t for t in texts)


def test_what_happens_is_told_while_a_run_goes_on(tmp_path: Path) -> None:
    record = records.potato_record()
    recorder = RunRecorder(tmp_path / "run")
    recorder.on_start(records.begun(record))
    with shown(tmp_path) as server:
        page = ask(server, "/run/run/")[1]
        follow = page.partition('data-follow="')[2].partition('"')[0].replace("&amp;", "&")
        connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=120)
        connection.request("GET", follow)
        stream = connection.getresponse()
        assert stream.getheader("Content-Type") == "text/event-stream"
        assert stream.readline() == b"retry: 1000\n"
        boundary, context = records.calls(record)[0]
        recorder.on_boundary(boundary, context)
        assert b"event: changed" in stream.read()
        connection.close()
        assert "before: proceed" in ask(server, "/run/run/")[1]
        records.follow(RunRecorder(tmp_path / "run"), record)
        text = ask(server, "/run/run/")[1]
        assert "data-follow" not in text and 'id="timeline"' in text


def test_an_index_follows_runs_that_come(tmp_path: Path) -> None:
    folder = tmp_path / "runs"
    folder.mkdir()
    with shown(folder) as server:
        page = ask(server, "/")[1]
        assert "No run lies in this folder yet" in page
        follow = page.partition('data-follow="')[2].partition('"')[0]
        connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=120)
        connection.request("GET", follow)
        stream = connection.getresponse()
        write_record(folder / "one", records.empty_record())
        assert b"event: changed" in stream.read()
        connection.close()
        assert "1 of 1 run<" in ask(server, "/")[1]


def test_moments_of_two_runs_stand_beside_what_is_like_them() -> None:
    good, bad = records.potato_record(), records.unjudged_record()
    sides = compare(good, bad)
    both = [row for row in sides.rows if None not in row]
    assert [c.what for c, _ in both if c][:2] == [
        "before navigate_to_obj(Potato)",
        "before pick_up(Potato)",
    ]
    left_alone = [left.what for left, right in sides.rows if left and right is None]
    assert "before pick_up(Bowl-1)" in left_alone
    differing = {f.name for f in sides.facts if f.differs}
    assert {"strategy", "outcome", "alarms"} <= differing and "task" not in differing
    assert not any(f.differs for f in compare(good, replace(good)).facts)


def test_a_folder_that_is_none_and_a_port_that_is_taken(tmp_path: Path) -> None:
    assert call(["view", str(tmp_path / "none")]) == 2
    with shown(tmp_path) as server:
        port = int(server.server_address[1])
        with pytest.raises(InputError, match="nothing can listen"), viewing(tmp_path, port=port):
            pass


@pytest.mark.slow
def test_the_command_serves_until_it_is_stopped(tmp_path: Path) -> None:
    make(tmp_path / "runs")
    command = [sys.executable, "-m", "forestall", "view", str(tmp_path / "runs"), "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        port = int(process.stdout.readline().rstrip("/\n").rpartition(":")[2])
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=120)
        connection.request("GET", "/")
        assert b"5 of 5 runs" in connection.getresponse().read()
        connection.close()
        process.kill()
