"""Pages served by this machine: HTTP with the standard library, nothing loaded from elsewhere.

Called by the servers of the study and of the view; calls only errors.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread

from forestall.errors import ForestallError, InputError

POLICY = (
    "default-src 'none'; img-src 'self' data:; style-src 'self'; script-src 'self'; "
    "connect-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
)
"""What a page may load: what this server has, and no more."""

_TIMEOUT_S = 30.0


class Refused(Exception):
    """A request that is answered with a message."""

    def __init__(self, status: HTTPStatus, text: str) -> None:
        super().__init__(text)
        self.status, self.text = status, text


class PageServer(ThreadingHTTPServer):
    """Listens for browsers; one thread for each request.

    Args:
        host: name or address to listen on.
        port: 0 for any that is free.
        handler: answers the requests.

    Raises:
        InputError: nothing can listen there.
    """

    daemon_threads = True
    request_queue_size = 64

    def __init__(self, host: str, port: int, handler: type[PageHandler]) -> None:
        try:
            super().__init__((host, port), handler)
        except (OSError, OverflowError) as error:
            raise InputError(
                f"nothing can listen on {host}:{port} ({error}): name another --port or --host"
            ) from error

    @property
    def address(self) -> str:
        """What to open in a browser."""
        host, port = map(str, self.server_address[:2])
        return f"http://{'127.0.0.1' if host == '0.0.0.0' else host}:{port}/"

    @contextmanager
    def answering(self) -> Iterator[None]:
        """Answer in a thread of its own until the block ends."""
        thread = Thread(target=self.serve_forever, args=(0.05,), daemon=True)
        thread.start()
        try:
            yield
        finally:
            self.shutdown()
            thread.join()

    def handle_error(self, request: object, client_address: object) -> None:
        """A connection that broke off is nobody's fault."""


class PageHandler(BaseHTTPRequestHandler):
    """One request; who serves says what a message looks like and what is told of a failure."""

    protocol_version = "HTTP/1.1"
    server_version, sys_version = "forestall", ""
    timeout = _TIMEOUT_S

    def message(self, text: str) -> str:
        """A page with one message."""
        raise NotImplementedError

    def failed(self, error: ForestallError | OSError) -> str:
        """What is told where something could not be read or kept."""
        return str(error)

    def log_message(self, format: str, *args: object) -> None:
        """Nothing is logged: requests may hold secrets."""

    def answered(self, respond: Callable[[], None]) -> None:
        """Answer a request, with a message where that fails."""
        try:
            respond()
        except Refused as error:
            self.page(self.message(error.text), error.status)
        except (ForestallError, OSError) as error:
            if isinstance(error, ConnectionError | TimeoutError):
                raise
            self.page(self.message(self.failed(error)), HTTPStatus.INTERNAL_SERVER_ERROR)

    def page(self, text: str, status: HTTPStatus = HTTPStatus.OK, policy: str = POLICY) -> None:
        """Answer with a page."""
        data = text.encode("utf-8", "replace")
        self.send(data, "text/html; charset=utf-8", status, policy=policy)

    def send(
        self,
        data: bytes,
        kind: str,
        status: HTTPStatus = HTTPStatus.OK,
        *,
        keep: bool = False,
        policy: str = POLICY,
    ) -> None:
        """Answer with some bytes; the browser may keep them for a day where `keep` says so."""
        self.send_response(status)
        self.headers_of(len(data), policy)
        self.send_header("Content-Type", kind)
        self.send_header("Cache-Control", "private, max-age=86400" if keep else "no-store")
        self.end_headers()
        self.wfile.write(data)

    def headers_of(self, length: int | None, policy: str = POLICY) -> None:
        """The headers of every answer; one without a length goes on until it is closed."""
        if length is not None:
            self.send_header("Content-Length", str(length))
        self.send_header("Content-Security-Policy", policy)
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "same-origin")
