"""The server over HTTP: consent, answers, kills, limits, names of any kind."""

from __future__ import annotations

import http.client
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from urllib.parse import urlencode

import pytest

from forestall.cli.main import call
from forestall.errors import InputError
from forestall.study.answers import file_of, read_raters
from forestall.study.assigning import Design
from forestall.study.pages import Progress, trial_page
from forestall.study.serving import MOST_BODY, StudyServer, serving

from .studies import LONG, MARKUP, NASTY, RIGHT_TO_LEFT, make, study_of


@contextmanager
def served(folder: Path) -> Iterator[StudyServer]:
    """A server in a thread of its own."""
    with serving(folder, port=0) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()


class Browser:
    """Keeps a cookie, follows what it is sent to."""

    def __init__(self, server: StudyServer | int) -> None:
        self.port = server if isinstance(server, int) else int(server.server_address[1])
        self.cookie = ""

    def ask(
        self, method: str, path: str, form: dict[str, str] | None = None, **headers: str
    ) -> tuple[int, str]:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        body = None if form is None else urlencode(form)
        connection.request(method, path, body, {"Cookie": self.cookie, **headers})
        response = connection.getresponse()
        text = response.read().decode("utf-8", "replace")
        self.cookie = (response.getheader("Set-Cookie") or self.cookie).partition(";")[0]
        place = response.getheader("Location")
        connection.close()
        return self.ask("GET", place) if place is not None else (response.status, text)

    def begin(self, name: str = "") -> str:
        return self.ask("POST", "/start", {"consent": "yes", "name": name})[1]

    def answer(self, trial: int, choice: str, seconds: str = "2.5") -> tuple[int, str]:
        form = {"trial": str(trial), "choice": choice, "seconds": seconds}
        return self.ask("POST", "/answer", form)


def test_a_rater_is_killed_off_and_goes_on(tmp_path: Path) -> None:
    study = make(tmp_path, 6, Design(2))
    count = len(study.raters[0])
    with served(tmp_path) as server:
        browser = Browser(server)
        assert "I take part" in browser.ask("GET", "/")[1]
        assert f"Comparison 1 <span>of {count}" in browser.begin("Ada")
        assert "Comparison 2" in browser.answer(0, "a")[1]
        assert "Comparison 3" in browser.answer(1, "both")[1]
        assert browser.answer(1, "both")[0] == 200
    with file_of(tmp_path, 1).open("ab") as file:  # the server was killed in the middle of a line
        file.write(b'{"trial": 2, "cho')
    with served(tmp_path) as server:
        browser.port = int(server.server_address[1])
        assert "Comparison 3" in browser.ask("GET", "/")[1]
        for k in range(2, count):
            assert browser.answer(k, "b")[0] == 200
        assert "Thank you" in browser.ask("GET", "/trial")[1]
        assert "given" in browser.ask("GET", "/trial?n=0")[1]
        assert "Comparison 2" in browser.answer(0, "b")[1]
    (rater,) = read_raters(tmp_path, study)
    assert [rater.answers[k].choice for k in range(count)] == ["b", "both", *["b"] * (count - 2)]
    assert rater.start.name == "Ada" and rater.answers[0].seconds == 2.5
    lines = file_of(tmp_path, 1).read_text().splitlines()
    assert len(lines) == 1 + count + 1  # what was sent twice is kept once, what was changed twice


def test_another_device_goes_on_by_the_link(tmp_path: Path) -> None:
    make(tmp_path, 6, Design(2))
    with served(tmp_path) as server:
        one, other, third = Browser(server), Browser(server), Browser(server)
        page = one.begin()
        one.answer(0, "a")
        link = page.partition('href="/resume/')[2].partition('"')[0]
        assert "Comparison 2" in other.ask("GET", f"/resume/{link}")[1]
        assert other.ask("GET", "/resume/wrong")[0] == 404
        third.begin()
        fourth = Browser(server)
        status = fourth.ask("POST", "/start", {"consent": "yes"})
        assert status[0] == 409 and "has taken part" in status[1]
        assert "I take part" in one.ask("POST", "/leave", {})[1]
    assert link not in file_of(tmp_path, 1).read_text()


@pytest.mark.parametrize("name", [MARKUP, RIGHT_TO_LEFT, LONG])
def test_names_of_any_kind_change_nothing(tmp_path: Path, name: str) -> None:
    study = make(tmp_path, 6, Design(2), NASTY)
    with served(tmp_path) as server:
        browser = Browser(server)
        pages = [browser.begin(name)]
        pages += [browser.answer(k, "a")[1] for k in range(5)]
    assert not any("<script>document" in p or "<b>bold" in p for p in pages)
    assert any("&lt;script&gt;" in p for p in pages)
    (rater,) = read_raters(tmp_path, study)
    assert rater.start.name == name and len(rater.answers) == 5


def test_what_is_no_answer_is_refused_and_not_kept(tmp_path: Path) -> None:
    study = make(tmp_path, 6, Design(2))
    with served(tmp_path) as server:
        browser = Browser(server)
        assert browser.ask("POST", "/start", {"name": "x"})[0] == 400
        assert browser.ask("POST", "/start", {"consent": "yes", "name": "x" * 301})[0] == 400
        assert "I take part" in browser.answer(0, "a")[1] and not read_raters(tmp_path, study)
        browser.begin()
        for trial, choice in ((1, "a"), (-1, "a"), (99, "a"), (0, "c"), (0, "")):
            assert browser.answer(trial, choice)[0] == 400
        for seconds in ("nan", "-1", "1e300", "x"):
            assert browser.answer(0, "a", seconds)[0] == 200
        large = {"Content-Length": str(MOST_BODY + 1)}
        assert browser.ask("POST", "/answer", {}, **large)[0] == 413
        assert browser.ask("POST", "/answer", {}, **{"Content-Length": "x"})[0] == 413
        elsewhere = {"Origin": "http://evil.example"}
        form = {"trial": "1", "choice": "a"}
        assert browser.ask("POST", "/answer", form, **elsewhere)[0] == 403
        for path in ("/study.json", "/answers/rater-001.jsonl", "/pictures/../study.json", "/x"):
            assert browser.ask("GET", path)[0] == 404
        for n in ("-5", "%C2%B2", "9" * 400):
            assert browser.ask("GET", f"/trial?n={n}")[0] == 200
        assert browser.ask("GET", "/pictures/actual.jpg")[0] == 200
    (rater,) = read_raters(tmp_path, study)
    assert set(rater.answers) == {0} and rater.answers[0].seconds is None


def test_pages_hold_nothing_that_tells_whose_an_explanation_is() -> None:
    study = study_of(12, Design(1))
    names = {d: f"detector-{k}" for k, d in enumerate((study.ours, *study.against))}
    items = [
        replace(i, explanations=tuple(
            replace(e, detector=names[e.detector], writer="nobody") for e in i.explanations
        ), source={})
        for i in study.items
    ]  # fmt: skip
    against = tuple(names[d] for d in study.against)
    renamed = replace(study, ours=names[study.ours], against=against, items=tuple(items))
    for position, trial in enumerate(study.raters[0]):
        progress = Progress(position, len(study.raters[0]), position, "/resume/x")
        again = trial if trial.check else replace(trial, against=names[trial.against])
        page = trial_page(study, trial, progress, None)
        assert page == trial_page(renamed, again, progress, None)
        assert "http" not in page and study.texts(trial)[0] in page


def test_one_process_serves_a_folder_at_a_port_that_is_free(tmp_path: Path) -> None:
    make(tmp_path, 6, Design(2))
    with served(tmp_path) as server:
        with pytest.raises(InputError, match="is being written"), serving(tmp_path, port=0):
            pass
        other = tmp_path / "other"
        make(other, 6, Design(2))
        port = int(server.server_address[1])
        with pytest.raises(InputError, match="nothing can listen"), serving(other, port=port):
            pass
    assert call(["study", "serve", str(tmp_path / "none")]) == 2


@pytest.mark.slow
def test_a_server_killed_between_answers_has_lost_none(tmp_path: Path) -> None:
    study = make(tmp_path, 6, Design(1))
    count = len(study.raters[0])
    command = [sys.executable, "-m", "forestall", "study", "serve", str(tmp_path), "--port", "0"]
    browser, done = None, 0
    while done < count:
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            port = int(process.stdout.readline().rstrip("/\n").rpartition(":")[2])
            if browser is None:
                browser = Browser(port)
                browser.begin()
            browser.port = port
            for _ in range(3):
                if done < count:
                    assert browser.answer(done, "both")[0] == 200
                    done += 1
            process.kill()
        (rater,) = read_raters(tmp_path, study)
        assert len(rater.answers) == done
