"""The client over real HTTP: whatever the endpoint does, an answer or a sentence, and in time."""

import dataclasses
import json
import time
from typing import Any

import pytest

from forestall.deadline import Deadline
from forestall.errors import InputError
from forestall.llm.bodies import Form
from forestall.llm.client import ClientConfig, OpenAIModel
from forestall.types.exchange import Exchange, Request
from llm.server import Reply, Script, failed, fitted, having, in_turn, said, serving

REQUEST = Request(
    "reasoning", (("system", "be short"), ("user", "why?")), json.dumps({"type": "object"})
)
KEY = "sk-secret-0123456789"


@pytest.fixture(autouse=True)
def key(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", KEY)
    monkeypatch.setenv("NO_PROXY", "*")


def asked(script: Script, **options: object) -> tuple[Exchange, list[dict[str, Any]]]:
    with serving(script) as server:
        config = ClientConfig(model="m", base_url=server.url, **options)  # type: ignore[arg-type]
        return OpenAIModel(config).ask(REQUEST), server.asked


def test_a_question_and_its_answer() -> None:
    with serving(in_turn(said({"a": 1}))) as server:
        model = OpenAIModel(
            ClientConfig(model="m", base_url=server.url, dollars_in=2.0, dollars_out=10.0)
        )
        found = model.ask(REQUEST)
    assert (found.answer, found.problem, found.tries) == ('{"a": 1}', "", 1)
    assert (found.prompt_tokens, found.answer_tokens) == (300, 50)
    assert found.cost == pytest.approx(300 * 2e-6 + 50 * 10e-6)
    body = server.asked[0]
    assert body["model"] == "m" and body["temperature"] == 0.0 and body["max_tokens"] == 1000
    assert body["response_format"]["json_schema"] == {
        "name": "reasoning", "strict": True, "schema": {"type": "object"},
    }  # fmt: skip
    assert server.keys == [f"Bearer {KEY}"]
    assert KEY not in repr(found)


def test_what_an_endpoint_does_not_say_is_unknown_and_not_zero() -> None:
    found, _ = asked(in_turn(said("{}", prompt_tokens=7)))
    assert (found.prompt_tokens, found.answer_tokens, found.cost) == (7, None, None)


def test_pictures_go_with_the_first_message_of_the_user() -> None:
    with serving(in_turn(said("{}"))) as server:
        model = OpenAIModel(ClientConfig(model="m", base_url=server.url))
        shown = Request("reasoning", REQUEST.messages, REQUEST.schema, (b"jpeg",))
        assert model.ask(shown).images == 1
    text, picture = server.asked[0]["messages"][1]["content"]
    assert text == {"type": "text", "text": "why?"}
    assert picture["image_url"]["url"] == "data:image/jpeg;base64,anBlZw=="
    assert shown.key("m") != REQUEST.key("m")


def test_an_endpoint_without_schemas_is_told_in_words() -> None:
    _, bodies = asked(in_turn(said("{}")), form=Form.TEXT, temperature=None)
    assert "response_format" not in bodies[0] and "temperature" not in bodies[0]
    assert '{"type": "object"}' in bodies[0]["messages"][0]["content"]


LONG = {"cause": "a bowl — ü", "why": "x" * 300}
BODY = {"stream": True, "response_format": {"json_schema": {"name": "reasoning"}}}


@pytest.mark.parametrize("form", Form)
@pytest.mark.parametrize("stream", [False, True])
def test_an_answer_is_the_same_in_every_form_whole_or_streamed(form: Form, stream: bool) -> None:
    found, (body,) = asked(in_turn(said(LONG)), form=form, stream=stream)
    assert (found.answer, found.problem) == (json.dumps(LONG), "")
    assert (found.prompt_tokens, found.answer_tokens) == (300, 50)
    assert ("stream" in body, "stream_options" in body) == (stream, stream)
    assert ("tools" in body) == (form is Form.FUNCTION)
    if form is Form.FUNCTION:
        (tool,) = body["tools"]
        assert tool["function"]["name"] == "reasoning"
        assert tool["function"]["parameters"] == {"type": "object"}
        assert body["tool_choice"] == {"type": "function", "function": {"name": "reasoning"}}


def test_a_tool_that_nobody_named_is_not_taken_for_an_answer() -> None:
    call = {"function": {"name": "os.system", "arguments": "{}"}}
    message = {"message": {"content": None, "tool_calls": [call]}}
    body = json.dumps({"choices": [message]}).encode()
    found, _ = asked(lambda b: Reply(pieces=(body, b"")), form=Form.FUNCTION, retries=0)
    assert found.answer is None and "calls 'os.system', which it was not asked to" in found.problem


STREAM = fitted(said(LONG), BODY)
WHOLE = b"".join(STREAM.pieces)


@pytest.mark.parametrize("size", [0, 3, 250, 700, len(WHOLE) // 2, len(WHOLE) - 400])
@pytest.mark.parametrize("how", ["ended early", "broken off"])
def test_of_a_stream_that_is_cut_what_came_is_kept_and_is_no_answer(size: int, how: str) -> None:
    promised = None if how == "ended early" else len(WHOLE)
    found, _ = asked(in_turn(STREAM.cut(size, promised)), stream=True, retries=0)
    assert found.problem and not (found.problem == "" and found.answer)
    assert json.dumps(LONG).startswith(found.answer or "")
    assert bool(found.answer) == (size > 500), (found.answer, found.problem)


def test_a_stream_that_has_ended_is_not_waited_for() -> None:
    started = time.monotonic()
    open_end = dataclasses.replace(STREAM, pieces=(WHOLE, b""), pause_s=15.0)
    found, _ = asked(in_turn(open_end), stream=True, timeout_s=60)
    assert found.answer == json.dumps(LONG) and found.seconds < 14
    assert time.monotonic() - started < 60


def test_a_stream_that_is_slow_costs_its_time_limit_and_keeps_what_came() -> None:
    started = time.monotonic()
    slow = dataclasses.replace(STREAM, pause_s=0.3)
    found, _ = asked(in_turn(slow), stream=True, timeout_s=5)
    assert found.problem and found.seconds < 10 and time.monotonic() - started < 40
    assert found.answer and json.dumps(LONG).startswith(found.answer)
    assert "in time" in found.problem or "within 5 s" in found.problem


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b'data: {"error": {"message": "out of memory"}}\n\n', "out of memory"),
        (b'data: {"choices": [{"delta": null}]}\n\n', "cannot be read"),
        (b'data: {"choices": [{"delta": {"content": ["x"]}}]}\n\ndata: [DONE]\n\n', "empty"),
        (b"data: {\n\n", "cannot be read"),
        (b"data: \xff\n\n", "cannot be read"),
        (b": keep-alive\n\n" * 3, "ended before"),
        (b"data: [DONE]\n\n", "empty"),
        (b"x" * (4 * 2**20 + 1), "larger than"),
        (b"".join(fitted(said(None, refusal="I cannot"), BODY).pieces), "refuses: I cannot"),
        (b"".join(fitted(said("{}", ended="length"), BODY).pieces), "cut off"),
    ],
    ids=["error", "null", "no text", "json", "utf-8", "nothing", "done", "large", "refusal",
         "length"],
)  # fmt: skip
def test_a_stream_that_says_nothing_is_a_sentence(data: bytes, words: str) -> None:
    found, _ = asked(in_turn(Reply(pieces=(data, b""))), stream=True, retries=0)
    assert words in found.problem


@pytest.mark.parametrize("status", [408, 409, 429, 500, 503])
def test_what_may_pass_is_tried_again(status: int) -> None:
    found, bodies = asked(in_turn(failed(status, Retry_After="0"), said("{}")))
    assert (found.problem, found.tries, len(bodies)) == ("", 2, 2)


def test_what_does_not_pass_is_not_tried_again_and_no_message_tells_the_key() -> None:
    found, bodies = asked(in_turn(failed(401, f"Incorrect API key provided: {KEY}")))
    assert len(bodies) == 1 and "401" in found.problem
    assert KEY not in found.problem and "***" in found.problem


def test_it_waits_as_long_as_it_is_asked_to() -> None:
    started = time.monotonic()
    found, _ = asked(in_turn(failed(429, Retry_After="1"), said("{}")), timeout_s=30)
    assert found.problem == "" and time.monotonic() - started >= 1


def test_it_does_not_wait_longer_than_there_is_time() -> None:
    started = time.monotonic()
    found, bodies = asked(in_turn(failed(429, Retry_After="3600")), timeout_s=20)
    assert len(bodies) == 1 and time.monotonic() - started < 20
    assert "429" in found.problem and "asks to wait 3600 s" in found.problem


def test_further_tries_are_bounded() -> None:
    found, bodies = asked(in_turn(failed(500, Retry_After="0")), retries=2)
    assert len(bodies) == 3 and found.tries == 3 and "500" in found.problem


TRICKLE = Reply(pieces=(b" ",) * 400, pause_s=0.1)


@pytest.mark.parametrize(
    "reply", [Reply(wait_s=5, pieces=(b"{}",)), TRICKLE], ids=["silent", "a trickle"]
)
def test_a_slow_endpoint_costs_its_time_limit_and_no_more(reply: Reply) -> None:
    started = time.monotonic()
    found, _ = asked(in_turn(reply), timeout_s=1.0)
    assert found.answer is None and found.problem
    assert found.seconds < 2.0
    assert time.monotonic() - started < 20


def test_nobody_listening_is_told_in_time() -> None:
    model = OpenAIModel(
        ClientConfig(model="m", base_url="http://127.0.0.1:9/v1", timeout_s=10, retries=0)
    )
    started = time.monotonic()
    found = model.ask(REQUEST)
    assert found.answer is None and "cannot be reached" in found.problem
    assert time.monotonic() - started < 10


def test_a_deadline_of_the_caller_counts() -> None:
    with serving(in_turn(Reply(wait_s=4, pieces=(b"{}",)))) as server:
        model = OpenAIModel(ClientConfig(model="m", base_url=server.url, timeout_s=60))
        started = time.monotonic()
        assert model.ask(REQUEST, Deadline(0.5)).problem
        assert time.monotonic() - started < 3
        assert model.ask(REQUEST, Deadline(0.0)).tries == 0


@pytest.mark.parametrize(
    ("reply", "words"),
    [
        (Reply(pieces=(b'{"choices": [{"mess',), promised=500), "failed"),
        (Reply(pieces=(b"x" * 2**20,)), "larger than"),
        (Reply(pieces=(b"\xff\xfe",)), "cannot be read"),
        (Reply(pieces=(b"{}",)), "cannot be read"),
        (Reply(pieces=(b'{"choices": []}',)), "cannot be read"),
        (Reply(pieces=(b'{"choices": [{"message": null}]}',)), "cannot be read"),
        (Reply(pieces=(b"[" * 5000,)), "cannot be read"),
        (said(None, refusal="I cannot help with that"), "refuses: I cannot help"),
        (said(""), "empty"),
        (said('{"a"', ended="length"), "cut off"),
        (said("{}", ended="content_filter"), "filter"),
    ],
    ids=["cut", "megabyte", "no text", "no choices", "none", "null", "deep", "refusal", "empty",
         "length", "filter"],
)  # fmt: skip
def test_an_answer_that_is_none_is_a_sentence(reply: Reply, words: str) -> None:
    found, _ = asked(in_turn(reply), retries=0)
    assert words in found.problem
    assert found.answer is None or found.problem


def test_a_budget_ends_the_asking() -> None:
    with serving(in_turn(said("{}"))) as server:
        model = OpenAIModel(ClientConfig(model="m", base_url=server.url, max_calls=2))
        assert [bool(model.ask(REQUEST).problem) for _ in range(3)] == [False, False, True]
        model = OpenAIModel(ClientConfig(model="m", base_url=server.url, max_tokens=400))
        answers = [model.ask(REQUEST) for _ in range(3)]
    assert [bool(a.problem) for a in answers] == [False, False, True]
    assert "700 tokens of 400" in answers[2].problem and answers[2].tries == 0
    assert len(server.asked) == 4


@pytest.mark.parametrize(
    "url", ["localhost:8000", "ftp://x/v1", "http://", "http://u:secret@host/v1", "http://h/?k=1"]
)
def test_an_address_that_is_none_or_holds_a_secret_is_refused(url: str) -> None:
    with pytest.raises(InputError) as caught:
        ClientConfig(base_url=url)
    assert "secret@" not in str(caught.value)


def test_without_a_key_and_an_address_there_is_nobody_to_ask(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("OPENAI_API_KEY")
    with pytest.raises(InputError, match="OPENAI_API_KEY is not set"):
        OpenAIModel()


def test_the_only_model_of_an_endpoint_is_taken_and_stands_in_what_is_recorded() -> None:
    with serving(in_turn(said("{}"))) as server:
        found = OpenAIModel(ClientConfig(base_url=server.url)).ask(REQUEST)
    assert found.model == "scripted" == server.asked[0]["model"]
    assert found.key == REQUEST.key("scripted")


@pytest.mark.parametrize(
    ("models", "why"),
    [
        (having("small", "large"), "it has 2 models: small, large"),
        (having(), "it has no model"),
        (having(*(f"m{k}" for k in range(40))), r"40 models: m0, .*m11, \.\.\."),
        (failed(404), "the endpoint answered 404"),
        (Reply(pieces=(b'{"models": []}',)), "its list of models cannot be read"),
        (Reply(pieces=(b"x" * 300_000,)), "larger than"),
        (Reply(wait_s=3), "no answer within 0.5 s|timed out"),
    ],
)
def test_else_the_message_says_what_there_is(models: Reply, why: str) -> None:
    with serving(in_turn(said("{}"))) as server:
        server.models = models
        limit_s = 0.5 if models.wait_s else 30.0
        with pytest.raises(InputError, match=rf"--llm\.model NAME: .*({why})"):
            OpenAIModel(ClientConfig(base_url=server.url, timeout_s=limit_s))


def test_at_openai_the_papers_model_is_asked() -> None:
    assert OpenAIModel(ClientConfig()).name == "gpt-4o"
