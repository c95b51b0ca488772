"""A server that speaks the protocol of OpenAI's chat completions; a script says its answers.

A completion is sent as it is asked for: whole or as a stream of events, in the message or as the
call of the tool that must be called.
"""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
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

    def cut(self, size: int, promised: int | None = None) -> Reply:
        """The same, its first bytes alone."""
        left = b"".join(self.pieces)[:size]
        return replace(self, pieces=(left,), promised=promised)


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
    if "tools" in body:
        tool: str = body["tools"][0]["function"]["name"]
        return tool
    name: str = body["response_format"]["json_schema"]["name"]
    return name


def fitted(reply: Reply, body: dict[str, Any]) -> Reply:
    """A completion in the form that a request asks for; any other reply as it is."""
    if reply.status != 200 or len(reply.pieces) != 1 or reply.promised is not None:
        return reply
    try:
        told = json.loads(reply.pieces[0])
        message = told["choices"][0]["message"]
    except (ValueError, LookupError, TypeError, RecursionError):
        return reply
    if "tools" in body and message["content"] is not None:
        function = {"name": purpose_of(body), "arguments": message["content"]}
        calls = [{"id": "call-1", "type": "function", "function": function}]
        message |= {"content": None, "tool_calls": calls}
    if body.get("stream"):
        return replace(reply, pieces=tuple(_events(told)))
    return replace(reply, pieces=(json.dumps(told).encode(),))


def _pieces(text: str) -> list[str]:
    """A text as it comes, a few characters an event."""
    size = max(7, len(text) // 400)
    return [text[k : k + size] for k in range(0, len(text), size)]


def _events(told: dict[str, Any]) -> Iterator[bytes]:
    """A completion as a stream of events: the role, the text in pieces, how it ended, the usage."""
    choice = told["choices"][0]
    message = choice["message"]
    deltas: list[dict[str, Any]] = [{"role": "assistant", "content": ""}]
    deltas += [{"content": piece} for piece in _pieces(message["content"] or "")]
    if message.get("refusal"):
        deltas.append({"refusal": message["refusal"]})
    for call in message.get("tool_calls", ()):
        name, said = call["function"]["name"], call["function"]["arguments"]
        deltas.append({"tool_calls": [{"index": 0, "function": {"name": name, "arguments": ""}}]})
        deltas += [
            {"tool_calls": [{"index": 0, "function": {"arguments": piece}}]}
            for piece in _pieces(said)
        ]
    head = {k: told[k] for k in ("id", "created", "model")} | {"object": "chat.completion.chunk"}
    for delta in deltas:
        yield _event({**head, "choices": [{"index": 0, "delta": delta, "finish_reason": None}]})
    ended = {"index": 0, "delta": {}, "finish_reason": choice["finish_reason"]}
    yield _event({**head, "choices": [ended]})
    yield _event({**head, "choices": [], "usage": told["usage"]})
    yield b"data: [DONE]\n\n"


def _event(data: Any) -> bytes:
    return f"data: {json.dumps(data)}\n\n".encode()


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
            self.answer(fitted(scripted.script(body), body), stream=bool(body.get("stream")))

        def do_GET(self) -> None:
            if self.path != "/v1/models":
                self.send_error(404)
                return
            self.answer(scripted.models)

        def answer(self, reply: Reply, stream: bool = False) -> None:
            time.sleep(reply.wait_s)
            length = sum(map(len, reply.pieces)) if reply.promised is None else reply.promised
            self.send_response(reply.status)
            kind = "text/event-stream" if stream and reply.status == 200 else "application/json"
            self.send_header("Content-Type", kind)
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
