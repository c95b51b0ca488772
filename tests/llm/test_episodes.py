"""Whole runs by the model path, over real HTTP."""

import os
from pathlib import Path

import pytest

from forestall.records.exchanges import exchanges_of, taken
from forestall.records.record import read_record, write_record
from forestall.tasks.files import load_scenario
from forestall.types.episode import EpisodeEnd, EpisodeRecord
from forestall.types.exchange import Exchange
from llm.episodes import ALONE, good_model, played
from llm.server import Reply, failed, in_turn, purpose_of, said, serving

pytestmark = pytest.mark.slow

MAIN = (
    "bowl-filled-with-wine", "burner-occupied", "coffee-machine-occupied", "knife-blocked",
    "microwave-left-closed", "microwave-occupied", "mug-dropped", "pan-dirty", "plate-dirty",
    "potato-in-pan",
)  # fmt: skip
"""The scenarios of the main job."""

ROBOFAIL = tuple(
    f"robofail-{task}-{k}"
    for task, of in (
        ("boil-water", (1, 2, 3)), ("cook-egg", (1, 2, 3)), ("heat-potato", (1, 2, 3)),
        ("make-coffee", (1, 2, 3)), ("make-salad", (1, 2, 3)), ("store-egg", (1, 2, 3)),
        ("switch-devices", (1, 2, 5)), ("toast-bread", (1, 2, 3)), ("warm-water", (1, 2, 4)),
        ("water-plant", (1, 2, 3)),
    )
    for k in of
)  # fmt: skip
"""Thirty, the first three of each task that the planner solves in the symbolic household."""


@pytest.fixture(autouse=True)
def no_key(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    monkeypatch.setenv("NO_PROXY", "*")


def asked(record: EpisodeRecord) -> list[Exchange]:
    return [e for b in record.boundaries for e in exchanges_of(b)]


@pytest.mark.parametrize("name", (*MAIN, *ROBOFAIL))
def test_the_model_path_alone_solves_what_the_planner_solves(name: str) -> None:
    task = load_scenario(name).task
    with good_model(task, name) as (server, by_planner):
        record = played(task, name, server.url, **ALONE)
    assert record.success, record.failures
    replans = [b.replan for b in record.boundaries if b.replan is not None]
    assert replans and all(r.producer == "model" for r in replans if r.plan is not None)
    assert all(r.check is not None and r.check.ok for r in replans if r.plan is not None)
    assert [str(e.subtask) for e in record.executed] == [
        str(e.subtask) for e in by_planner.executed
    ]
    assert all(not e.problem for e in asked(record))


@pytest.mark.simulator
@pytest.mark.skipif(not os.environ.get("FORESTALL_TEST_LLM_KITCHEN"), reason="takes minutes")
@pytest.mark.parametrize("name", ("microwave-occupied", "robofail-make-coffee-1"))
def test_in_the_kitchen_the_model_path_alone_does_what_the_planner_does(name: str) -> None:
    task = load_scenario(name).task
    with good_model(task, name, kitchen=True) as (server, by_planner):
        record = played(task, name, server.url, kitchen=True, **ALONE)
    assert record.success == by_planner.success
    replans = [b.replan for b in record.boundaries if b.replan is not None]
    assert replans and all(r.producer == "model" for r in replans if r.plan is not None)
    assert [str(e.subtask) for e in record.executed] == [
        str(e.subtask) for e in by_planner.executed
    ]


TASK, OCCUPIED = "heat-potato", "microwave-occupied"


def test_a_run_is_recorded_and_repeats_without_a_network(tmp_path: Path) -> None:
    file = tmp_path / "answers.jsonl"
    with good_model(TASK, OCCUPIED) as (server, _):
        first = played(TASK, OCCUPIED, server.url, **{"llm.record": str(file)}, **ALONE)
    assert first.success and asked(first)
    again = played(TASK, OCCUPIED, f"replay:{file}", **ALONE)
    assert asked(again) == asked(first)
    assert [b.replan and b.replan.plan for b in again.boundaries] == [
        b.replan and b.replan.plan for b in first.boundaries
    ]
    written = write_record(tmp_path / "run", again)
    assert asked(read_record(written)) == asked(first)
    with pytest.raises(Exception, match="is there already"):
        played(
            TASK,
            OCCUPIED,
            f"record:{file}",
            **{"llm.base_url": "http://127.0.0.1:9/v1", "llm.model": "m"},
        )
    lines = file.read_text(encoding="utf-8").splitlines()
    file.write_text("\n".join(lines[:-1]) + "\n", encoding="utf-8")
    lacking = played(TASK, OCCUPIED, f"replay:{file}", **ALONE)
    assert lacking.end is EpisodeEnd.HELD and lacking.trouble is not None
    last = asked(first)[-1]
    assert f"no answer to the replanning request {last.key}" in lacking.trouble.text


def test_a_model_that_is_wrong_three_times_ends_in_the_planners_plan() -> None:
    old = {"idea": "", "steps": [{"skill": "put_in", "args": ["Plate-1", "Microwave-1"]}]}
    script = good_script_but(old)
    with serving(script) as server:
        record = played(TASK, OCCUPIED, server.url)
    assert record.success
    (replan,) = (b.replan for b in record.boundaries if b.replan is not None)
    assert replan.producer == "planner" and len(replan.exchanges) == 3
    assert "no plan of the language model was accepted in 3 answers" in replan.note
    with serving(script) as server:
        record = played(TASK, OCCUPIED, server.url, **ALONE)
    assert record.end is EpisodeEnd.STOPPED and not record.success
    stopped = record.boundaries[-1]
    assert "stopped" in stopped.why and stopped.replan is not None


def good_script_but(plan: object):  # type: ignore[no-untyped-def]
    explained = {
        "cause": "a bowl is in the microwave", "why": "no room", "because_of": ["Bowl-1"],
        "must_change": ["vacant(Microwave-1)"], "must_stay": [], "advice": "take it out",
    }  # fmt: skip
    return lambda body: said(explained if purpose_of(body) == "reasoning" else plan)


def test_words_alone_lead_to_a_plan_that_the_validator_decides_on() -> None:
    with good_model(TASK, OCCUPIED) as (server, _):
        good = server.script

        def words(body):  # type: ignore[no-untyped-def]
            if purpose_of(body) == "replanning":
                return good(body)
            told = {"cause": "a bowl is in the way", "why": "", "because_of": [], "must_stay": [],
                    "must_change": ["the bowl must go"], "advice": "take the bowl out"}  # fmt: skip
            return said(told)

        server.script = words
        record = played(TASK, OCCUPIED, server.url, **ALONE)
    assert record.success
    (boundary,) = (b for b in record.boundaries if b.replan is not None)
    assert boundary.diagnosis is not None and not boundary.diagnosis.must_change
    assert boundary.diagnosis.advice == "take the bowl out"
    assert "left out" in boundary.diagnosis.exchanges[0].note


@pytest.mark.parametrize(
    "reply", [failed(500), Reply(wait_s=3, pieces=(b"{}",))], ids=["errors", "silence"]
)
def test_a_dead_endpoint_costs_its_time_limit_and_the_run_goes_on(reply: Reply) -> None:
    with serving(in_turn(reply)) as server:
        record = played(TASK, OCCUPIED, server.url, **{"llm.timeout_s": 1.0})
    assert record.success
    found = asked(record)
    assert {e.purpose for e in found} == {"reasoning", "replanning"}
    assert all(e.problem and e.answer is None and e.seconds < 2.0 for e in found)
    (boundary,) = (b for b in record.boundaries if b.replan is not None)
    assert boundary.diagnosis is not None and boundary.replan is not None
    assert "the language model gave no explanation" in boundary.diagnosis.producer
    assert "the language model gave no plan" in boundary.replan.note
    assert boundary.replan.producer == "planner"


def test_what_a_run_took_is_told() -> None:
    with good_model(TASK, OCCUPIED) as (server, _):
        record = played(TASK, OCCUPIED, server.url, **ALONE)
    all_of = taken(asked(record))
    assert (all_of.asked, all_of.accepted, all_of.cost) == (2, 2, None)
    assert (all_of.prompt_tokens, all_of.answer_tokens) == (600, 100)
