"""Any OpenAI-compatible endpoint, through the package openai (extra [llm]).

Built by `assembly`, asked by reasoner and replanner. Whatever the endpoint does, `ask` comes back
within its time and says what happened; it never raises for what is outside. The key comes from the
environment, and no message of ours repeats it.
"""

from __future__ import annotations

import os
import threading
import time
import weakref
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from email.utils import parsedate_to_datetime
from functools import partial
from typing import Any
from urllib.parse import urlsplit

from forestall.deadline import Deadline
from forestall.errors import InputError
from forestall.llm.bodies import (
    LONGEST,
    STREAM_END,
    Body,
    Form,
    answer_of,
    models_of,
    request_body,
    streamed,
    tool_name,
)
from forestall.types.exchange import Exchange, Request

OPENAI_MODEL = "gpt-4o"
"""The paper's."""

MOST_BYTES = 256 * 1024
"""How large the body of an answer may be; ours are a few kilobytes."""

MOST_STREAMED_BYTES = 16 * MOST_BYTES
"""The same of a stream, in which each token comes in an event of its own."""

_AGAIN = (408, 409, 429)
_FIRST_WAIT_S, _MOST_WAIT_S, _POLL_S = 0.5, 8.0, 0.05
_TOLD = 12
"""How many models a message names."""


@dataclass(frozen=True, slots=True)
class ClientConfig:
    """How an endpoint is asked.

    Args:
        model: its name there; by default gpt-4o at OpenAI, elsewhere the only one that there is.
        base_url: of the endpoint, up to and with "/v1"; OpenAI's own by default.
        key_variable: the environment variable that holds the key.
        timeout_s: of one question, every further try and every pause between them included.
        retries: further tries after an answer that says "later", or none at all.
        temperature: of the model; None where the endpoint takes none.
        form: how the endpoint is told what an answer looks like: a JSON schema, a function to call,
            or the text alone.
        stream: whether the answer comes piece by piece; of one that does not end in time, what came
            is kept.
        max_calls: tries of one run.
        max_tokens: of one run, as the endpoint counts them, prompts and answers.
        dollars_in: price of a million tokens of prompt; None: not known.
        dollars_out: the same of answers.

    Raises:
        InputError: a number that cannot be, or an address that is none or holds a secret.
    """

    model: str | None = None
    base_url: str | None = None
    key_variable: str = "OPENAI_API_KEY"
    timeout_s: float = 20.0
    retries: int = 3
    temperature: float | None = 0.0
    form: Form = Form.SCHEMA
    stream: bool = False
    max_calls: int = 60
    max_tokens: int = 200_000
    dollars_in: float | None = None
    dollars_out: float | None = None

    def __post_init__(self) -> None:
        for name in ("timeout_s", "max_calls", "max_tokens"):
            if not getattr(self, name) > 0:
                raise InputError(f"{name} is {getattr(self, name)}: it must be above 0")
        if self.retries < 0:
            raise InputError(f"retries is {self.retries}: it must be at least 0")
        if self.base_url is not None:
            _check_address(self.base_url)


def _check_address(text: str) -> None:
    try:
        parts = urlsplit(text)
        valid = parts.scheme in ("http", "https") and bool(parts.hostname)
        _ = parts.port
    except ValueError:
        valid = False
    if not valid:
        raise InputError(f"base_url {text!r} is no address: write http://host:port/v1")
    if parts.username or parts.password or parts.query or parts.fragment:
        raise InputError(
            "base_url must hold no user, password or query, since it goes into the record: the key "
            "belongs into an environment variable (key_variable)"
        )


@dataclass(frozen=True, slots=True)
class _Got:
    """What one try came to: a body, or a problem and whether another try may help."""

    body: bytes = b""  # with a problem: what came before it, of a stream
    problem: str = ""
    again: bool = False
    wait_s: float | None = None


class OpenAIModel:
    """Implements `LanguageModel`.

    Args:
        config: which endpoint, and how it is asked.

    Raises:
        InputError: the package is not installed, there is no key for OpenAI's own endpoint, or no
            model is named and the endpoint does not have exactly one.
    """

    def __init__(self, config: ClientConfig | None = None) -> None:
        self._config = config or ClientConfig()
        self._key = os.environ.get(self._config.key_variable, "")
        if not self._key and self._config.base_url is None:
            raise InputError(
                f"the environment variable {self._config.key_variable} is not set: it holds the "
                "key of the language model; one that runs here is named by its address, as in "
                "--llm http://localhost:8000/v1"
            )
        try:
            import openai
        except ImportError as error:
            raise InputError(
                "a language model needs the package openai: pip install 'forestall[llm]'"
            ) from error
        self._sdk: Any = openai
        client = openai.OpenAI(
            api_key=self._key or "none", base_url=self._config.base_url, max_retries=0
        )
        self._create: Any = client.chat.completions.with_streaming_response.create
        weakref.finalize(self, client.close)
        self.name = self._config.model or self._only_model(client)
        self._calls = self._tokens = 0
        self._lock = threading.Lock()

    def _only_model(self, client: Any) -> str:
        """The name of the model that an endpoint has, where nobody names one."""
        address = self._config.base_url
        if address is None:
            return OPENAI_MODEL
        list_models = client.models.with_streaming_response.list
        got = self._once(list_models, Deadline(self._config.timeout_s))
        names, problem = ((), got.problem) if got.problem else models_of(got.body)
        if len(names) == 1:
            return names[0]
        if not problem:
            told = ", ".join(names[:_TOLD]) + (", ..." if len(names) > _TOLD else "")
            problem = f"it has {len(names)} models: {told}" if names else "it has no model"
        raise InputError(
            f"say which model of {address} is meant, as in --llm.model NAME: {problem}"
        )

    def ask(self, request: Request, deadline: Deadline | None = None) -> Exchange:
        """See the Protocol."""
        started_s = time.perf_counter()
        limit = (deadline or Deadline()).within(self._config.timeout_s)
        tries, got = 0, _Got(problem="nothing was asked")
        pause_s = _FIRST_WAIT_S
        while tries <= self._config.retries:
            if problem := self._spent():
                got = _Got(problem=problem)
                break
            if limit.over:
                got = _Got(problem=got.problem if tries else "there was no time left to ask")
                break
            tries += 1
            c = self._config
            body = request_body(request, self.name, c.form, c.temperature, c.stream)
            got = self._once(partial(self._create, **body), limit)
            if not got.again or tries > self._config.retries:
                break
            wait_s = pause_s if got.wait_s is None else got.wait_s
            if wait_s >= limit.left():
                waiting = f"; it asks to wait {wait_s:g} s" if got.wait_s is not None else ""
                why = f"{got.problem}{waiting}, and the time is over before"
                got = replace(got, problem=why)
                break
            _sleep(wait_s, limit)
            pause_s = min(2 * pause_s, _MOST_WAIT_S)
        seconds = time.perf_counter() - started_s
        return self._exchange(request, got, tries, seconds)

    def _spent(self) -> str:
        """Why nothing more is asked in this run, "" while there is something left."""
        c = self._config
        with self._lock:
            if self._calls >= c.max_calls:
                return f"the budget of this run is used up: {self._calls} calls of {c.max_calls}"
            if self._tokens >= c.max_tokens:
                return f"the budget of this run is used up: {self._tokens} tokens of {c.max_tokens}"
            self._calls += 1
        return ""

    def _once(self, call: Callable[..., Any], limit: Deadline) -> _Got:
        """One try, on a thread of its own: neither a name server nor a trickle takes longer."""
        box: list[_Got] = []
        came = bytearray()
        thread = threading.Thread(
            target=lambda: box.append(self._sent(call, limit, came)), name="language model",
            daemon=True,
        )  # fmt: skip
        thread.start()
        while thread.is_alive() and not limit.over:
            thread.join(min(_POLL_S, max(limit.left(), 0.001)))
        if box:
            return box[0]
        what = "no whole answer" if came else "no answer"
        return _Got(bytes(came), f"{what} within {self._config.timeout_s:g} s", again=True)

    def _sent(self, call: Callable[..., Any], limit: Deadline, body: bytearray) -> _Got:
        sdk = self._sdk
        most = MOST_STREAMED_BYTES if self._config.stream else MOST_BYTES
        try:
            left_s = max(limit.left(), 0.001)
            with call(timeout=left_s) as response:
                for piece in response.iter_bytes():
                    body += piece
                    if len(body) > most:
                        return _Got(problem=f"the answer is larger than {most} bytes")
                    if self._config.stream and STREAM_END in body[-len(piece) - len(STREAM_END) :]:
                        break  # whether the endpoint hangs up or not
                    if limit.over:
                        return _Got(bytes(body), "the answer did not end in time", again=True)
                return _Got(bytes(body))
        except sdk.APIStatusError as error:
            again = error.status_code in _AGAIN or error.status_code >= 500
            why = f"the endpoint answered {error.status_code}: {self._told(error)}"
            return _Got(problem=why, again=again, wait_s=_asked_to_wait(error.response.headers))
        except sdk.APIConnectionError as error:
            cause = error.__cause__ or error
            return _Got(problem=f"the endpoint cannot be reached: {self._told(cause)}", again=True)
        except Exception as error:  # noqa: BLE001 - transports of others, which differ by version
            return _Got(bytes(body), f"the call failed: {self._told(error)}", again=True)

    def _told(self, error: BaseException) -> str:
        """An error on one line, without the key."""
        text = " ".join(str(error).split())
        if self._key:
            text = text.replace(self._key, "***")
        return f"{type(error).__name__}: {text[:LONGEST]}"

    def _exchange(self, request: Request, got: _Got, tries: int, seconds: float) -> Exchange:
        said = Body(None, got.problem)
        if self._config.stream and got.body:
            said = streamed(got.body, tool_name(request), got.problem)
        elif not got.problem:
            said = answer_of(got.body, tool_name(request))
        answer, sent, came = said.answer, said.prompt_tokens, said.answer_tokens
        if self._key and answer is not None:
            answer = answer.replace(self._key, "***")
        with self._lock:
            self._tokens += (sent or 0) + (came or 0)
        return Exchange(
            request.purpose,
            self.name,
            request.key(self.name),
            request.messages,
            answer,
            said.problem,
            "",
            len(request.images),
            sent,
            came,
            self._cost(sent, came),
            seconds,
            tries,
        )

    def _cost(self, sent: int | None, came: int | None) -> float | None:
        c = self._config
        if sent is None or came is None or c.dollars_in is None or c.dollars_out is None:
            return None
        return (sent * c.dollars_in + came * c.dollars_out) / 1e6


def _asked_to_wait(headers: Mapping[str, str]) -> float | None:
    """Seconds that an answer asks to wait (Retry-After), None where it does not."""
    text = headers.get("retry-after")
    if not text:
        return None
    try:
        return max(0.0, float(text))
    except ValueError:
        pass
    try:
        return max(0.0, parsedate_to_datetime(text).timestamp() - time.time())
    except (ValueError, TypeError):
        return None


def _sleep(seconds: float, limit: Deadline) -> None:
    until_s = time.monotonic() + seconds
    while (left_s := until_s - time.monotonic()) > 0 and not limit.over:
        time.sleep(min(_POLL_S, left_s))
