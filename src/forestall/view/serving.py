"""The view on this machine: HTTP with the standard library, nothing loaded from elsewhere.

Called by the command line; calls `index.py`, `pages.py` and `forestall/serving.py`. It only reads:
what it serves are runs and experiments of its index, and files inside their folders. What happens
meanwhile is told over server-sent events.
"""

from __future__ import annotations

import base64
import hashlib
import os
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from http import HTTPStatus
from pathlib import Path
from urllib.parse import parse_qs, unquote_to_bytes, urlsplit

from forestall.errors import InputError
from forestall.reading.files import inside, read_bytes
from forestall.records.beside import records_beside
from forestall.records.record import LINES_NAME, RECORD_NAME, read_record
from forestall.report.experiment_page import experiment_script
from forestall.report.page import page_html, page_script
from forestall.serving import POLICY, PageHandler, PageServer, Refused
from forestall.view.batch import batch_of, size_of
from forestall.view.choosing import Shown, choose
from forestall.view.comparing import compare
from forestall.view.index import ExperimentRow, Index
from forestall.view.live import happened, progress
from forestall.view.pages import (
    ASSETS,
    asset,
    batch_page,
    compare_page,
    index_page,
    live_page,
    message_page,
    run_link,
)
from forestall.view.rows import Outcome, RunRow, at_work, outcome_of, source_of

PORT = 8766
_LOCAL = ("127.0.0.1", "localhost", "::1")
_KEPT = 8
_LOOK_S, _ALIVE_S = 0.4, 10.0
_KINDS = {
    ".svg": "image/svg+xml",
    ".csv": "text/csv; charset=utf-8",
    ".md": "text/plain; charset=utf-8",
    ".json": "application/json",
    ".jpg": "image/jpeg",
}
"""Ending → type of the files that pages of runs and experiments lead to."""


class ViewServer(PageServer):
    """Serves the runs and experiments under one folder.

    Args:
        folder: that is viewed.
        host: name or address to listen on.
        port: 0 for any that is free.

    Raises:
        InputError: nothing can listen there.
    """

    def __init__(self, folder: Path, host: str, port: int) -> None:
        self.index = Index(folder)
        self.local = host in _LOCAL
        self.stopping = threading.Event()
        self._lock = threading.Lock()
        self._pages: OrderedDict[tuple[str, tuple[tuple[int, int], ...]], str] = OrderedDict()
        super().__init__(host, port, _Handler)

    def shutdown(self) -> None:
        """Stop; pages that wait for what happens are let go."""
        self.stopping.set()
        super().shutdown()

    def page_of(self, place: str) -> str:
        """The page of a finished run, drawn once while its record stays what it is.

        Raises:
            FileFormatError: its record is damaged.
        """
        folder = self.index.folder_of(place)
        sources = (source_of(folder) or folder, *records_beside(folder))
        stats = tuple((s.st_mtime_ns, s.st_size) for s in (source.stat() for source in sources))
        key = (place, stats)
        with self._lock:
            found = self._pages.get(key)
        if found is None:
            found = page_html(read_record(folder), folder, home="/")
            with self._lock:
                self._pages[key] = found
                while len(self._pages) > _KEPT:
                    self._pages.popitem(last=False)
        return found


@contextmanager
def viewing(folder: Path, host: str = "127.0.0.1", port: int = PORT) -> Iterator[ViewServer]:
    """A server that listens; call `serve_forever` or `answering`.

    Raises:
        InputError: there is no such folder, or nothing can listen there.
    """
    if not folder.is_dir():
        raise InputError(f"{folder} is no folder: name one that holds runs or experiments")
    with ViewServer(folder, host, port) as server:
        yield server


class _Handler(PageHandler):
    """One request."""

    server: ViewServer

    def do_GET(self) -> None:
        self.answered(self._get)

    def message(self, text: str) -> str:
        return message_page(text)

    def _get(self) -> None:
        self._see_host()
        url = urlsplit(self.path)
        first, _, rest = url.path[1:].partition("/")
        asked = parse_qs(url.query, errors="surrogateescape")
        found: Mapping[str, Callable[[], None]] = {
            "": lambda: self._index({k: v[-1] for k, v in asked.items()}),
            "run": lambda: self._run(_name(rest)),
            "experiment": lambda: self._experiment(_name(rest)),
            "compare": lambda: self._compare(asked.get("run", [])),
            "events": lambda: self._events({k: v[-1] for k, v in asked.items()}),
        }
        if url.path[1:] in ASSETS:
            self.send(asset(url.path[1:]), f"{ASSETS[url.path[1:]]}; charset=utf-8")
        elif first in found and (rest == "" or first in ("run", "experiment")):
            found[first]()
        else:
            raise Refused(HTTPStatus.NOT_FOUND, "There is no such page.")

    def _see_host(self) -> None:
        """A page of another site that calls itself this machine gets nothing."""
        said = self.headers.get("Host", "")
        name = urlsplit(f"//{said}").hostname if said else None
        if self.server.local and name not in _LOCAL:
            raise Refused(HTTPStatus.FORBIDDEN, "This server answers to its own machine alone.")

    def _index(self, asked: Mapping[str, str]) -> None:
        index = self.server.index
        found = index.now()
        runs = [Shown(r, outcome_of(r, index.folder_of(r.place))) for r in found.runs.values()]
        choice = choose(runs, asked)
        experiments = [(e, self._works(e)) for e in found.experiments.values()]
        self.page(index_page(index.folder, choice, experiments, len(runs), found.version))

    def _run(self, rest: str) -> None:
        place, pictures, name = f"/{rest}".rpartition("/images/")
        if pictures and rest.removesuffix("/") not in self.server.index.now().runs:
            self._file(self._known(place[1:]).place, f"images/{name}")
            return
        if rest.endswith("/index.html"):  # as pages of folders lead to each other
            self._go(run_link(self._known(rest.removesuffix("/index.html")).place))
            return
        row = self._known(rest.removesuffix("/"))
        folder = self.server.index.folder_of(row.place)
        if (folder / RECORD_NAME).is_file():
            self.page(self.server.page_of(row.place), policy=_with_script(page_script()))
            return
        events, offset = happened(folder / LINES_NAME, 0)
        if not events:
            raise Refused(HTTPStatus.SERVICE_UNAVAILABLE, "The run has not begun yet.")
        outcome = outcome_of(row, folder)
        self.page(live_page(row.place, progress(events), outcome, offset))

    def _experiment(self, rest: str) -> None:
        found = self.server.index.now()
        place = rest.removesuffix("/")
        if rest.endswith("/index.html") and place.removesuffix("/index.html") in found.runs:
            self._go(run_link(place.removesuffix("/index.html")))
            return
        if place in found.experiments:
            row = found.experiments[place]
            file = self.server.index.folder_of(place) / "index.html"
            busy = self._works(row)
            if busy or (row.wanted > row.episodes and not file.is_file()):
                self.page(batch_page(row, batch_of(file.parent, busy), busy))
                return
            if not file.is_file():
                raise Refused(
                    HTTPStatus.NOT_FOUND,
                    f"This experiment has no page yet: forestall bench report {file.parent}",
                )
            text = read_bytes(file, "page of an experiment").decode("utf-8", "replace")
            self.page(text, policy=_with_script(experiment_script()))
            return
        for parent in found.experiments:
            if rest.startswith(f"{parent}/" if parent else ""):
                self._file(parent, rest[len(parent) + bool(parent) :])
                return
        raise Refused(HTTPStatus.NOT_FOUND, "There is no such experiment in this folder.")

    def _works(self, row: ExperimentRow) -> bool:
        """Whether episodes of an experiment are still to come."""
        folder = self.server.index.folder_of(row.place)
        return row.wanted > row.episodes and at_work(folder, row.changed_s)

    def _file(self, place: str, name: str) -> None:
        """A file inside the folder of a run or an experiment."""
        path = inside(self.server.index.folder_of(place), name)
        kind = _KINDS.get(path.suffix)
        if kind is None or not path.is_file():
            raise Refused(HTTPStatus.NOT_FOUND, "There is no such file.")
        data = read_bytes(path, "file of a page")
        policy = "default-src 'none'; style-src 'unsafe-inline'; sandbox"
        self.send(data, kind, keep=path.suffix == ".jpg", policy=policy)

    def _compare(self, places: list[str]) -> None:
        if len(places) != 2:
            raise Refused(
                HTTPStatus.BAD_REQUEST,
                f"Choose two runs to compare; {len(places)} were chosen.",
            )
        left, right = (self._known(p).place for p in places)
        folders = [self.server.index.folder_of(p) for p in (left, right)]
        sides = compare(*(read_record(f) for f in folders))
        self.page(compare_page((left, right), sides))

    def _known(self, place: str) -> RunRow:
        row = self.server.index.now().runs.get(place)
        if row is None:
            raise Refused(HTTPStatus.NOT_FOUND, "There is no such run in this folder.")
        return row

    def _go(self, place: str) -> None:
        self.send_response(HTTPStatus.SEE_OTHER)
        self.headers_of(0)
        self.send_header("Location", place)
        self.end_headers()

    # --- what happens ----------------------------------------------------------------------------

    def _events(self, asked: Mapping[str, str]) -> None:
        """Tell when the index, or a run, is no longer what the page has seen."""
        said = asked.get("seen", "")
        seen = int(said) if said.isascii() and said.isdigit() and len(said) < 16 else 0
        state = self._version
        if "run" in asked:
            state = self._written(self._known(asked["run"]))
        elif "experiment" in asked:
            state = self._finished(asked["experiment"])
        self.close_connection = True
        self.send_response(HTTPStatus.OK)
        self.headers_of(None)
        self.send_header("Content-Type", "text/event-stream")
        self.send_header("Connection", "close")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self._tell("retry: 1000\n\n")
        told = time.monotonic()
        while not self.server.stopping.is_set():
            now = state()
            if now != seen:
                self._tell(f"event: changed\ndata: {now}\n\n")
                return
            if time.monotonic() - told > _ALIVE_S:
                self._tell(": nothing new\n\n")
                told = time.monotonic()
            self.server.stopping.wait(_LOOK_S)

    def _version(self) -> int:
        return self.server.index.now().version

    def _written(self, row: RunRow) -> Callable[[], int]:
        """Bytes of a run so far; another number when it is over or no longer at work."""
        folder = self.server.index.folder_of(row.place)

        def size() -> int:
            try:
                return (folder / LINES_NAME).stat().st_size if self._is_busy(row) else -1
            except OSError:
                return -1

        return size

    def _finished(self, place: str) -> Callable[[], int]:
        """Bytes of episodes so far; another number when the experiment is no longer at work."""
        if place not in self.server.index.now().experiments:
            raise Refused(HTTPStatus.NOT_FOUND, "There is no such experiment in this folder.")

        def size() -> int:
            found = self.server.index.now().experiments.get(place)
            if found is None or not self._works(found):
                return -1
            return size_of(self.server.index.folder_of(place))

        return size

    def _is_busy(self, row: RunRow) -> bool:
        folder = self.server.index.folder_of(row.place)
        if (folder / RECORD_NAME).exists():
            return False
        return outcome_of(row, folder) is Outcome.RUNNING

    def _tell(self, text: str) -> None:
        self.wfile.write(text.encode())
        self.wfile.flush()


def _name(rest: str) -> str:
    """A part of an address as names of files are; they need not be text."""
    return os.fsdecode(unquote_to_bytes(rest))


def _with_script(script: str) -> str:
    """Only our own script of a page that carries it may run, whatever names the page tells."""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    own = f"script-src 'sha256-{digest}'"
    inline = POLICY.replace("style-src 'self'", "style-src 'unsafe-inline'")
    return inline.replace("script-src 'self'", own)
