"""A study on the local network: HTTP with the standard library, nothing loaded from elsewhere.

Called by the command line; calls `pages.py`, `answers.py` and `forestall/serving.py`. One process
serves a folder. A rater is known by a random token in a cookie, of which the folder keeps a digest
alone; an answer is acknowledged when it is on the disk.
"""

from __future__ import annotations

import hashlib
import math
import secrets
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

from forestall.errors import ForestallError
from forestall.files import alone
from forestall.serving import PageHandler, PageServer, Refused
from forestall.study.answers import (
    CHOICES,
    MOST_NAME,
    Answer,
    AnswerFile,
    Rater,
    Start,
    file_of,
    now,
    read_answers,
)
from forestall.study.model import Study, read_study
from forestall.study.pages import (
    ASSETS,
    Progress,
    asset,
    done_page,
    message_page,
    trial_page,
    welcome_page,
)

COOKIE = "rater"
MOST_BODY = 8192
"""Bytes of a form: a name of 300 characters, each of four bytes written as %XX, and the rest."""

_MOST_SECONDS = 86_400.0


class Raters:
    """Everybody who has begun, in memory and on the disk; one thread at a time.

    Args:
        folder: of the study.
        study: of it.

    Raises:
        FileFormatError: a file of answers is damaged, or of another study.
    """

    def __init__(self, folder: Path, study: Study) -> None:
        self._folder, self._study = folder, study
        self._lock = threading.Lock()
        self._files: dict[int, AnswerFile] = {}
        self._raters: dict[int, Rater] = {}
        self._tokens: dict[str, int] = {}
        for number in range(1, len(study.raters) + 1):
            path = file_of(folder, number)
            if not path.exists():
                continue
            file, rater = AnswerFile(path), read_answers(path, study)
            if rater is None:  # killed while its first line was written: nobody was told of it
                path.unlink()
                continue
            self._files[number], self._raters[number] = file, rater
            if rater.start.token:
                self._tokens[rater.start.token] = number

    def begin(self, name: str) -> str:
        """Give a rater the next free place; returns the token.

        Raises:
            Refused: there is none left.
        """
        with self._lock:
            free = [k for k in range(1, len(self._study.raters) + 1) if k not in self._raters]
            if not free:
                raise Refused(HTTPStatus.CONFLICT, "Everybody who was asked for has taken part.")
            token = secrets.token_urlsafe(12)
            start = Start(self._study.digest, free[0], False, name, _digest(token), now())
            self._files[free[0]] = AnswerFile(file_of(self._folder, free[0]), start)
            self._raters[free[0]] = Rater(start, {})
            self._tokens[start.token] = free[0]
            return token

    def known(self, token: str) -> Rater | None:
        """The rater of a token."""
        number = self._tokens.get(_digest(token))
        return None if number is None else self._raters[number]

    def add(self, rater: Rater, answer: Answer) -> Rater:
        """Keep an answer; the same one sent twice is kept once."""
        number = rater.start.rater
        with self._lock:
            rater = self._raters[number]
            before = rater.answers.get(answer.trial)
            if before is None or before.choice != answer.choice:
                self._files[number].add(answer)
                rater = replace(rater, answers={**rater.answers, answer.trial: answer})
                self._raters[number] = rater
            return rater


class StudyServer(PageServer):
    """Serves one study.

    Args:
        folder: of it; kept alone while the server lives (`serving`).
        study: of it.
        host: name or address to listen on.
        port: 0 for any that is free.

    Raises:
        InputError: nothing can listen there.
    """

    def __init__(self, folder: Path, study: Study, host: str, port: int) -> None:
        self.folder, self.study = folder, study
        self.raters = Raters(folder, study)
        pictures = {p for i in study.items for p in (i.expected, i.actual)}
        self.pictures = {f"/{p}": folder / p for p in pictures}
        super().__init__(host, port, _Handler)


@contextmanager
def serving(folder: Path, host: str = "127.0.0.1", port: int = 8765) -> Iterator[StudyServer]:
    """A server that listens; call `serve_forever`. Nobody else writes to the folder meanwhile.

    Raises:
        InputError: there is no study, another process serves it, or nothing can listen there.
        FileFormatError: study or answers are damaged.
    """
    study = read_study(folder)
    with alone(folder), StudyServer(folder, study, host, port) as server:
        yield server


class _Handler(PageHandler):
    """One request."""

    server: StudyServer

    def do_GET(self) -> None:
        self.answered(self._get)

    def do_POST(self) -> None:
        self.answered(self._post)

    def message(self, text: str) -> str:
        return message_page("This did not work", text)

    def failed(self, error: ForestallError | OSError) -> str:
        return "This could not be kept. Please tell whoever runs the study."

    def _get(self) -> None:
        url = urlsplit(self.path)
        path = url.path
        if path in self.server.pictures:
            self.send(self.server.pictures[path].read_bytes(), "image/jpeg", keep=True)
        elif path[1:] in ASSETS:
            self.send(asset(path[1:]), f"{ASSETS[path[1:]]}; charset=utf-8")
        elif path.startswith("/resume/"):
            token = path.removeprefix("/resume/")
            if self.server.raters.known(token) is None:
                raise Refused(HTTPStatus.NOT_FOUND, "This link belongs to nobody in this study.")
            self._go("/trial", token)
        elif path == "/":
            if self._rater() is not None:
                self._go("/trial")
            else:
                self.page(welcome_page(self.server.study))
        elif path == "/trial":
            self._trial(parse_qs(url.query).get("n", [""])[0])
        else:
            raise Refused(HTTPStatus.NOT_FOUND, "There is no such page.")

    def _post(self) -> None:
        form = self._form()
        if self.path == "/start":
            self._start(form)
        elif self.path == "/answer":
            self._answer(form)
        elif self.path == "/leave":
            self._go("/", "")
        else:
            raise Refused(HTTPStatus.NOT_FOUND, "There is no such page.")

    def _start(self, form: Mapping[str, str]) -> None:
        if self._rater() is not None:
            self._go("/trial")
            return
        name = form.get("name", "").strip()
        problem = ""
        if form.get("consent") != "yes":
            problem = "Please say that you take part, or close the page."
        elif len(name) > MOST_NAME:
            problem = f"A name has at most {MOST_NAME} characters; this one has {len(name)}."
        if problem:
            self.page(welcome_page(self.server.study, problem), HTTPStatus.BAD_REQUEST)
            return
        self._go("/trial", self.server.raters.begin(name))

    def _trial(self, asked: str) -> None:
        rater = self._rater()
        if rater is None:
            self._go("/")
            return
        trials = self.server.study.raters[rater.start.rater - 1]
        following = rater.next_trial(len(trials))
        last = len(trials) if following is None else following
        position = int(asked) if asked.isascii() and asked.isdigit() and len(asked) < 6 else last
        position = min(position, last)
        progress = Progress(position, len(trials), len(rater.answers), f"/resume/{self._token()}")
        if position == len(trials):
            self.page(done_page(progress))
            return
        given = rater.answers.get(position)
        self.page(trial_page(self.server.study, trials[position], progress, given))

    def _answer(self, form: Mapping[str, str]) -> None:
        rater = self._rater()
        if rater is None:
            self._go("/")
            return
        trials = self.server.study.raters[rater.start.rater - 1]
        following = rater.next_trial(len(trials))
        last = len(trials) - 1 if following is None else following
        said = form.get("trial", "")
        position = int(said) if said.isascii() and said.isdigit() and len(said) < 6 else -1
        choice = next((c for c in CHOICES if c == form.get("choice")), None)
        if choice is None or not 0 <= position <= last:
            raise Refused(HTTPStatus.BAD_REQUEST, "This is no answer to the comparison shown.")
        revising = position in rater.answers
        self.server.raters.add(rater, Answer(position, choice, _seconds(form), now()))
        self._go(f"/trial?n={position + 1}" if revising else "/trial")

    # --- requests --------------------------------------------------------------------------------

    def _form(self) -> dict[str, str]:
        """The fields of a form that this very site has sent."""
        said = self.headers.get("Content-Length", "")
        length = int(said) if said.isascii() and said.isdigit() and len(said) < 10 else -1
        if not 0 <= length <= MOST_BODY:
            self.close_connection = True
            raise Refused(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, "This is too much.")
        body = self.rfile.read(length)
        origin = self.headers.get("Origin")
        if origin is not None and urlsplit(origin).netloc != self.headers.get("Host"):
            raise Refused(HTTPStatus.FORBIDDEN, "This form comes from another site.")
        try:
            fields = parse_qs(body.decode("utf-8"), keep_blank_values=True, max_num_fields=10)
        except ValueError as error:
            raise Refused(HTTPStatus.BAD_REQUEST, "This is no form.") from error
        return {name: values[-1] for name, values in fields.items()}

    def _token(self) -> str:
        try:
            cookie = SimpleCookie(self.headers.get("Cookie", "")).get(COOKIE)
        except CookieError:
            return ""
        return "" if cookie is None else cookie.value[:100]

    def _rater(self) -> Rater | None:
        return self.server.raters.known(self._token())

    def _go(self, place: str, token: str | None = None) -> None:
        self.send_response(HTTPStatus.SEE_OTHER)
        self.headers_of(0)
        self.send_header("Location", place)
        if token is not None:
            age = 31_536_000 if token else 0
            self.send_header(
                "Set-Cookie",
                f"{COOKIE}={token}; Path=/; HttpOnly; SameSite=Lax; Max-Age={age}",
            )
        self.end_headers()


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode()).hexdigest()


def _seconds(form: Mapping[str, str]) -> float | None:
    """What the browser measured, None where it is no sensible number."""
    try:
        seconds = float(form.get("seconds", ""))
    except ValueError:
        return None
    return seconds if math.isfinite(seconds) and 0 <= seconds <= _MOST_SECONDS else None
