"""Chat completions as they go over the wire: the body of a request, and what an answer's body says.

Called by the client; knows no network. An answer comes whole or as a stream of server-sent events;
of a stream that breaks off, what came until then is kept.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

from forestall.errors import FileFormatError, ForestallError
from forestall.reading.documents import parse_json
from forestall.reading.fields import Field
from forestall.types.exchange import Request

LONGEST = 300
"""Characters of somebody else's message."""

STREAM_END = b"data: [DONE]\n"
"""The last event of a stream."""


class Form(Enum):
    """How an endpoint is told what an answer looks like."""

    SCHEMA = "schema"  # by a JSON schema of the answer
    FUNCTION = "function"  # by a function that it must call; its arguments are the answer
    TEXT = "text"  # in words


@dataclass(frozen=True, slots=True)
class Body:
    """What an answer's body says.

    Args:
        answer: the text, None where there is none.
        problem: why it is no answer, "" where it is one.
        prompt_tokens: as the endpoint counted them, None: it did not say.
        answer_tokens: the same of the answer.
    """

    answer: str | None
    problem: str = ""
    prompt_tokens: int | None = None
    answer_tokens: int | None = None


def request_body(
    request: Request, model: str, form: Form, temperature: float | None, stream: bool
) -> dict[str, Any]:
    """The arguments of a chat completion."""
    messages: list[dict[str, Any]] = [{"role": r, "content": t} for r, t in request.messages]
    first = next((m for m in messages if m["role"] == "user"), None)
    if request.images and first is not None:
        first["content"] = [{"type": "text", "text": first["content"]}]
        for image in request.images:
            shown = {"type": "image_url", "image_url": {"url": _data_url(image)}}
            first["content"].append(shown)
    body: dict[str, Any] = {
        "model": model, "messages": messages, "max_tokens": request.max_tokens,
    }  # fmt: skip
    if temperature is not None:
        body |= dict(temperature=temperature)
    if stream:
        body |= {"stream": True, "stream_options": {"include_usage": True}}
    name, schema = tool_name(request), json.loads(request.schema)
    if form is Form.SCHEMA:
        described = {"name": name, "strict": True, "schema": schema}
        body["response_format"] = {"type": "json_schema", "json_schema": described}
    elif form is Form.FUNCTION:
        function = {"name": name, "description": "Gives the answer.", "parameters": schema}
        body["tools"] = [{"type": "function", "function": function}]
        body["tool_choice"] = {"type": "function", "function": {"name": name}}
    else:
        text = f"Answer with JSON alone that fits this schema: {request.schema}"
        messages.insert(0, {"role": "system", "content": text})
    return body


def tool_name(request: Request) -> str:
    """What the answer of a request is called on the wire."""
    return request.purpose.replace(" ", "_")


def answer_of(body: bytes, name: str) -> Body:
    """Read a whole answer.

    Args:
        body: of the response.
        name: of the function that may be called.
    """
    try:
        field = Field(parse_json(body.decode("utf-8")))
        sent, came = _usage(field.value)
        choice = field["choices"].items()[0]
        message: Mapping[str, Any] = choice["message"].value
        refusal, content = message.get("refusal"), message.get("content")
        ended = choice.value.get("finish_reason")
        calls = [(c["function"]["name"], c["function"]["arguments"])
                 for c in message.get("tool_calls") or ()]  # fmt: skip
    except (ForestallError, ValueError, LookupError, AttributeError, TypeError) as error:
        return Body(None, f"the endpoint's answer cannot be read: {_short(error)}")
    return Body(*_taken(content, calls, refusal, ended, name), sent, came)


def streamed(body: bytes, name: str, broken: str = "") -> Body:
    """Read the events of a stream, as far as they came.

    Args:
        body: of the response.
        name: of the function that may be called.
        broken: why no more came, "" where the stream ended by itself.
    """
    parts = _Parts()
    try:
        for data in _events(body):
            if data == "[DONE]":
                parts.done = True
                break
            parts.add(Field(parse_json(data)))
    except (ForestallError, ValueError, LookupError, AttributeError, TypeError) as error:
        broken = broken or f"the endpoint's answer cannot be read: {_short(error)}"
    text = "".join(parts.text)
    calls = [(parts.called, "".join(parts.arguments))] if parts.called else []
    counted = (parts.sent, parts.came)
    if not broken and not parts.done and parts.ended is None:
        broken = "the stream ended before the answer did"
    if broken:
        return Body(text or "".join(parts.arguments) or None, broken, *counted)
    refusal = "".join(parts.refusal)
    return Body(*_taken(text, calls, refusal, parts.ended, name), *counted)


def models_of(body: bytes) -> tuple[tuple[str, ...], str]:
    """The names of an endpoint's models, and why they cannot be read."""
    try:
        listed = Field(parse_json(body.decode("utf-8")))["data"].items()
        return tuple(dict.fromkeys(m["id"].text() for m in listed)), ""
    except (ForestallError, ValueError) as error:
        return (), f"its list of models cannot be read: {_short(error)}"


class _Parts:
    """What the events of a stream have said so far."""

    def __init__(self) -> None:
        self.text: list[str] = []
        self.arguments: list[str] = []
        self.refusal: list[str] = []
        self.called = ""
        self.ended: Any = None
        self.sent: int | None = None
        self.came: int | None = None
        self.done = False

    def add(self, event: Field) -> None:
        """One more event.

        Raises:
            ForestallError: it is none, or tells of an error.
        """
        if (error := event.find("error")) is not None:
            raise FileFormatError(f"it tells of an error: {str(error.value)[:LONGEST]}")
        if isinstance(event.value.get("usage"), Mapping):
            self.sent, self.came = _usage(event.value)
        choices = event["choices"].items()
        if not choices:
            return
        choice = choices[0]
        delta = choice["delta"].value
        self.text.append(_text(delta.get("content")))
        self.refusal.append(_text(delta.get("refusal")))
        for call in delta.get("tool_calls") or ():
            function = call["function"]
            self.called = self.called or _text(function.get("name"))
            self.arguments.append(_text(function.get("arguments")))
        self.ended = choice.value.get("finish_reason") or self.ended


def _events(body: bytes) -> Iterator[str]:
    """The data of each event; a last one that is not ended by a line is none."""
    for line in body.split(b"\n")[:-1]:
        if line.startswith(b"data:"):
            yield line[5:].decode("utf-8").strip()


def _taken(
    content: Any, calls: list[tuple[Any, Any]], refusal: Any, ended: Any, name: str
) -> tuple[str | None, str]:
    """Answer and problem of what a model said."""
    if refusal:
        return None, f"the model refuses: {str(refusal)[:LONGEST]}"
    if calls and not (isinstance(content, str) and content.strip()):
        called, content = calls[0]
        if called != name:
            return None, f"the model calls {str(called)[:80]!r}, which it was not asked to"
    if not isinstance(content, str) or not content.strip():
        return None, "the model's answer is empty"
    if ended == "length":
        return content, "the answer was cut off at its greatest length"
    if ended == "content_filter":
        return content, "the endpoint's filter stopped the answer"
    return content, ""


def _text(value: Any) -> str:
    return value if isinstance(value, str) else ""


def _usage(body: Any) -> tuple[int | None, int | None]:
    usage = body.get("usage") if isinstance(body, Mapping) else None
    return _count(usage, "prompt_tokens"), _count(usage, "completion_tokens")


def _count(usage: Any, name: str) -> int | None:
    value = usage.get(name) if isinstance(usage, Mapping) else None
    good = isinstance(value, int) and not isinstance(value, bool) and value >= 0
    return value if good else None


def _data_url(jpeg: bytes) -> str:
    return "data:image/jpeg;base64," + base64.b64encode(jpeg).decode("ascii")


def _short(error: BaseException) -> str:
    return " ".join(str(error).split())[:LONGEST]
