"""What was asked stands in the record and on the page, whole and escaped."""

import json
from dataclasses import replace

import pytest

from forestall.assembly.language import said_llm
from forestall.errors import FileFormatError, InputError
from forestall.reading.fields import Field
from forestall.records.exchanges import taken
from forestall.records.verdicts import diagnosis_from, diagnosis_json, replan_from, replan_json
from forestall.report.exchange_view import exchange_views, laid_out
from forestall.report.page import page_html
from forestall.types.episode import BoundaryRecord, EpisodeEnd, EpisodeRecord
from forestall.types.exchange import Exchange
from forestall.types.verdict import Decision, Diagnosis, Replan, ReplanOutcome
from llm.scenes import alarm, occupied

ASKED = Exchange(
    "reasoning", "m", "ab" * 16, (("system", "be short"), ("user", "<b>why</b>?")),
    '{"cause": "<script>alert(1)</script>"}', "", "left out: 'x'", 1, 300, 50, 0.0123, 1.5, 2,
)  # fmt: skip
DEAD = Exchange("replanning", "m", "cd" * 16, (("user", "plan"),), None, "it is dead", tries=4)
DIAGNOSIS = Diagnosis(
    "a bowl is in it", (), advice="take it out", why="no room", exchanges=(ASKED,)
)
REPLAN = Replan(ReplanOutcome.NOT_FOUND, note="no plan", exchanges=(DEAD,))


def test_what_was_asked_is_read_back_as_it_was_written() -> None:
    written = json.loads(json.dumps(diagnosis_json(DIAGNOSIS)))
    assert diagnosis_from(Field(written)) == DIAGNOSIS
    replan = {**replan_json(REPLAN), "outcome": REPLAN.outcome.value}
    assert replan_from(Field(json.loads(json.dumps(replan)))) == REPLAN
    plain = diagnosis_json(replace(DIAGNOSIS, advice="", why="", exchanges=()))
    assert not {"advice", "why", "exchanges"} & plain.keys()
    with pytest.raises(FileFormatError, match="exchanges"):
        diagnosis_from(Field({**written, "exchanges": [{"purpose": 1}]}))


def test_sums_of_what_is_not_known_are_not_known() -> None:
    assert taken([ASKED]).cost == 0.0123 and taken([ASKED]).prompt_tokens == 300
    both = taken([ASKED, DEAD])
    assert (both.asked, both.accepted, both.cost, both.prompt_tokens) == (2, 1, None, None)


def record() -> EpisodeRecord:
    context = occupied()
    boundary = BoundaryRecord(
        0, context.subtask, context.graph, context.scoped, None, 1,
        alarm(decision=Decision.REPLAN), DIAGNOSIS, REPLAN,
    )  # fmt: skip
    return EpisodeRecord(
        context.task, None, "proactive", 0, context.plan, (boundary,), (), EpisodeEnd.STOPPED
    )


def test_the_page_shows_prompt_answer_problem_and_cost() -> None:
    page = page_html(record())
    assert "&lt;b&gt;why&lt;/b&gt;?" in page and "<b>why</b>" not in page
    assert "&lt;script&gt;alert(1)" in page
    for words in (
        "take it out", "no room", "300 + 50 tokens", "$0.0123", "1 picture", "2 tries",
        "no answer: it is dead", "cost unknown", "tokens unknown", "ab" * 16, "2<small>questions",
        "1 answer taken",
    ):  # fmt: skip
        assert words in page, words
    bare = replace(DIAGNOSIS, exchanges=()), replace(REPLAN, exchanges=())
    without = replace(record().boundaries[0], diagnosis=bare[0], replan=bare[1])
    assert "Language model" not in page_html(replace(record(), boundaries=(without,)))


def test_what_a_question_repeats_and_what_an_answer_says_are_laid_out() -> None:
    plan = '{"idea": "x\\ny: z", "steps": [{"skill": "put", "args": ["A", "B"]}], "more": []}'
    asked = (("system", "s"), ("user", "u"))
    first = Exchange("replanning", "m", "k", asked, plan, "it cannot run")
    again = replace(
        first, messages=(*asked, ("assistant", plan), ("user", "again")), answer="no", problem=""
    )
    other = replace(first, messages=asked, answer=None)
    views = exchange_views((first, again, other))
    assert [(v.number, v.follows, v.messages) for v in views] == [
        (1, 0, asked), (2, 1, (("user", "again"),)), (3, 0, asked),
    ]  # fmt: skip
    assert views[0].answer == "idea: x y: z\nsteps: \n  1. put(A, B)\nmore: none"
    assert (views[1].answer, views[2].answer) == ("no", "")
    steps = laid_out('{"steps": [{"step": 2, "must_hold": ["a", "b"]}, {"skill": "x", "args": 1}]}')
    assert steps == "steps: \n  - step: 2, must_hold: a; b\n  - skill: x, args: 1"


@pytest.mark.parametrize(
    ("text", "name", "options"),
    [
        ("http://localhost:1/v1", "openai", {"base_url": "http://localhost:1/v1"}),
        ("gpt-4o", "openai", {"model": "gpt-4o"}),
        ("llama3:8b", "openai", {"model": "llama3:8b"}),
        ("replay:a.jsonl", "replay", {"file": "a.jsonl"}),
        ("record:a.jsonl", "openai", {"record": "a.jsonl"}),
        ("my_package.models:Mine", "my_package.models:Mine", {}),
    ],
)
def test_what_the_flag_says(text: str, name: str, options: dict[str, str]) -> None:
    said = {kind: (n, dict(o)) for kind, n, o in said_llm(text).parts}
    assert said["llm"] == (name, options)
    assert said["reasoner"][0] == said["replanner"][0] == "model"


def test_what_the_flag_cannot_say() -> None:
    with pytest.raises(InputError, match="name the file"):
        said_llm("replay:")
    assert said_llm(None).parts == ()
    assert said_llm("none").kinds() == ("llm",)
