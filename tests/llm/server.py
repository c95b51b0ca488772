"""A server that speaks the protocol of OpenAI's chat completions; a script says its answers."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from socketserver import TCPServer
from typing import Any


@dataclass(frozen=True)
class Reply:
    """One answer over HTTP.

    `pieces` are written with `pause_s` between them; `promised` bytes are announced, so that fewer
    pieces are a cut-off answer.
    """

    status: int = 200
    headers: tuple[tuple[str, str], ...] = ()
    pieces: tuple[bytes, ...] = ()
    pause_s: float = 0.0
    wait_s: float = 0.0
    promised: int | None = None


def said(content: Any, *, refusal: str | None = None, ended: str = "stop", **usage: Any) -> Reply:
    """A completion: a text, or a value that is written as JSON."""
    text = content if isinstance(content, str) or content is None else json.dumps(content)
    message = {"role": "assistant", "content": text, "refusal": refusal}
    body = {
        "id": "chatcmpl-1",
        "object": "chat.completion",
        "created": 0,
        "model": "scripted",
        "choices": [{"index": 0, "message": message, "finish_reason": ended}],
        "usage": usage or {"prompt_tokens": 300, "completion_tokens": 50, "total_tokens": 350},
    }
    return Reply(pieces=(json.dumps(body).encode(),))


def having(*models: str) -> Reply:
    """The list of an endpoint's models."""
    listed = [{"id": m, "object": "model", "created": 0, "owned_by": "x"} for m in models]
    return Reply(pieces=(json.dumps({"object": "list", "data": listed}).encode(),))


def failed(status: int, message: str = "no", **headers: str) -> Reply:
    body = json.dumps({"error": {"message": message, "type": "error", "code": None}})
    named = tuple((k.replace("_", "-"), v) for k, v in headers.items())
    return Reply(status, named, (body.encode(),))


Script = Callable[[dict[str, Any]], Reply]


@dataclass
class Scripted:
    """A server that runs: its address, and what it was sent."""

    script: Script
    url: str = ""
    asked: list[dict[str, Any]] = field(default_factory=list)
    keys: list[str] = field(default_factory=list)
    models: Reply = field(default_factory=lambda: having("scripted"))

    def purpose(self, number: int = -1) -> str:
        return purpose_of(self.asked[number])


def purpose_of(body: dict[str, Any]) -> str:
    """What a request is for: the name of its schema."""
    name: str = body["response_format"]["json_schema"]["name"]
    return name


def in_turn(*replies: Reply) -> Script:
    """One after the other, the last one from then on."""
    left = list(replies)
    return lambda body: left.pop(0) if len(left) > 1 else left[0]


@contextmanager
def serving(script: Script) -> Iterator[Scripted]:
    """A server on a free port of this machine."""
    scripted = Scripted(script)

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_POST(self) -> None:
            size = int(self.headers["Content-Length"])
            body = json.loads(self.rfile.read(size))
            if self.path != "/v1/chat/completions":
                self.send_error(404)
                return
            scripted.asked.append(body)
            scripted.keys.append(self.headers.get("Authorization", ""))
            self.answer(scripted.script(body))

        def do_GET(self) -> None:
            if self.path != "/v1/models":
                self.send_error(404)
                return
            self.answer(scripted.models)

        def answer(self, reply: Reply) -> None:
            time.sleep(reply.wait_s)
            length = sum(map(len, reply.pieces)) if reply.promised is None else reply.promised
            self.send_response(reply.status)
            self.send_header("Content-Type", "application/json")
            self.send_header("Content-Length", str(length))
            for name, value in reply.headers:
                self.send_header(name, value)
            self.end_headers()
            for piece in reply.pieces:
                self.wfile.write(piece)
                self.wfile.flush()
                time.sleep(reply.pause_s)
            if reply.promised is not None:
                self.close_connection = True

        def handle(self) -> None:
            with suppress(OSError):  # whoever asked has gone away
                super().handle()

        def log_message(self, format: str, *args: Any) -> None:
            pass

    class Server(ThreadingHTTPServer):
        daemon_threads = True

        def server_bind(self) -> None:
            TCPServer.server_bind(self)  # without asking a name server what this machine is called
            self.server_name, self.server_port = self.server_address[:2]  # type: ignore[assignment]

        def handle_error(self, request: Any, client_address: Any) -> None:
            pass

    server = Server(("127.0.0.1", 0), Handler)
    scripted.url = f"http://127.0.0.1:{server.server_address[1]}/v1"
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    try:
        yield scripted
    finally:
        server.shutdown()
        thread.join()
        server.server_close()
