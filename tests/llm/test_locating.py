"""REFLECT's questions about a run: the summary in words, what is asked, what is made of answers."""

from __future__ import annotations

from typing import Any

import pytest

from forestall.diagnosis.locating import ModelLocator
from forestall.llm.prompts import estimated_tokens
from forestall.llm.words import told_steps
from forestall.records.exchanges import exchanges_of
from forestall.types.episode import EpisodeRecord, SkillStatus
from forestall.types.plan import Subtask
from forestall.types.story import Tried
from llm.episodes import ALONE, played, steps
from llm.scenes import EXPLAINED, Scripted, occupied, scene_of, scoped
from llm.server import Reply, failed, in_turn, purpose_of, said, serving
from planning.corpus import DOMAIN

OPENED = "Potato-1 on Plate-1, Plate-1 held, Bowl-1 in Microwave-1, Microwave-1 is open"


def tried(number: int, step: str, seen: str = OPENED, status: str = "succeeded") -> Tried:
    graph = scoped(scene_of(seen))
    return Tried(number, Subtask.parse(step), SkillStatus(status), graph)


STORY = (
    tried(1, "open_obj(Microwave-1)", OPENED.replace("is open", "is closed")),
    tried(2, "pick_up(Plate-1)"),
    tried(3, "navigate_to_obj(Microwave-1)"),
    tried(4, "put_in(Plate-1, Microwave-1)", OPENED, "refused"),
)
LOCATED = {**EXPLAINED, "step": 4}


def test_the_summary_has_a_line_for_each_step_and_tells_what_is_new() -> None:
    lines = told_steps(STORY, DOMAIN)
    assert [line.partition(" | ")[0] for line in lines] == [
        "1. open_obj(Microwave-1)", "2. pick_up(Plate-1)", "3. navigate_to_obj(Microwave-1)",
        "4. put_in(Plate-1, Microwave-1) refused",
    ]  # fmt: skip
    assert "Microwave-1: closed" in lines[0] and "Plate-1: " in lines[0]
    assert "Microwave-1: open" in lines[1] and "Plate-1: " not in lines[1]
    assert " | " not in lines[2] and " | " not in lines[3]


def test_a_subgoal_is_verified_by_what_is_seen_after_it() -> None:
    model = Scripted([{"why": "it is\nheld", "done": True}, {"why": "no", "done": False}])
    locator = ModelLocator(model, DOMAIN)
    first, second = (locator.verify(occupied(), STORY[k]) for k in (1, 3))
    assert (first.satisfied, first.why, second.satisfied) == (True, "it is held", False)
    text = model.asked[0].messages[1][1]
    assert text.startswith("Step: pick_up(Plate-1)\nSeen after it:\n") and "Plate-1:" in text
    assert "refused" not in model.asked[1].messages[1][1], "only what is seen counts"
    assert estimated_tokens(model.asked[0]) < 120


@pytest.mark.parametrize("answer", ["yes", {"done": "yes", "why": ""}, {}, ConnectionError("dead")])
def test_what_cannot_be_read_is_no_yes_and_no_no(answer: Any) -> None:
    found = ModelLocator(Scripted([answer]), DOMAIN).verify(occupied(), STORY[1])
    assert found.satisfied is None and found.why
    assert len(found.exchanges) == (1 if isinstance(answer, Exception) else 2)


def test_a_failure_is_explained_from_the_story_until_then() -> None:
    model = Scripted([LOCATED])
    found = ModelLocator(model, DOMAIN).explain(occupied(), STORY, STORY[3])
    assert found.step == STORY[3] and found.diagnosis is not None
    assert found.diagnosis.cause == (
        "located at step 4, put_in(Plate-1, Microwave-1): a bowl is in the microwave"
    )
    assert [str(x) for x in found.diagnosis.must_change] == ["vacant(Microwave-1)"]
    assert found.diagnosis.advice == "take the bowl out first"
    text = model.asked[0].messages[1][1]
    assert "Step 4 did not do what it is for" in text and "4. put_in" in text
    assert estimated_tokens(model.asked[0]) <= 400
    early = ModelLocator(Scripted([{**LOCATED, "step": 2}]), DOMAIN)
    assert early.explain(occupied(), STORY, STORY[3]).step == STORY[1]
    later = Scripted([LOCATED, {**LOCATED, "step": 1}])
    assert ModelLocator(later, DOMAIN).explain(occupied(), STORY, STORY[1]).step == STORY[0]
    assert "there is no step 4" in later.asked[1].messages[3][1]


def test_where_no_step_failed_the_plan_is_asked_about() -> None:
    model = Scripted([LOCATED])
    ModelLocator(model, DOMAIN).explain(occupied(), STORY, None)
    assert "what is wrong with the plan?" in model.asked[0].messages[1][1]
    dead = ModelLocator(Scripted([ConnectionError("dead")]), DOMAIN)
    found = dead.explain(occupied(), STORY, None)
    assert found.diagnosis is None and found.exchanges[0].problem == "dead"


TASK, SCENARIO = "toast-bread", "robofail-toast-bread-1"


@pytest.fixture(autouse=True)
def no_key(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    monkeypatch.setenv("NO_PROXY", "*")


def by_model(strategy: str, url: str) -> EpisodeRecord:
    named = {"strategy.name": strategy, "strategy.locate": "model"}
    return played(TASK, SCENARIO, url, **named, **ALONE)


@pytest.mark.slow
@pytest.mark.parametrize("strategy", ["post-hoc", "online"])
def test_a_whole_run_by_reflects_questions_alone(strategy: str) -> None:
    plain = played(TASK, SCENARIO, None, **{"strategy.name": strategy})
    repair = next(b.replan for b in plain.boundaries if b.replan is not None and b.replan.plan)
    at = next(b for b in plain.boundaries if b.replan is repair)
    assert repair is not None and repair.plan is not None and at.diagnosis is not None
    wrong = [f"Step: {at.subtask}\n"]  # the step after which the run was corrected, once

    def script(body: dict[str, Any]) -> Reply:
        purpose, text = purpose_of(body), body["messages"][1]["content"]
        if purpose == "verifying":
            bad = bool(wrong) and text.startswith(wrong[0])
            return said({"why": "", "done": not (bad and wrong.pop())})
        if purpose == "replanning":
            return said(steps(repair.plan))  # type: ignore[arg-type]
        facts = [str(x) for x in at.diagnosis.must_change]  # type: ignore[union-attr]
        last = max(int(n.split(".")[0]) for n in text.splitlines() if n.split(".")[0].isdigit())
        return said({**EXPLAINED, "because_of": [], "must_change": facts, "must_stay": [],
                     "step": last})  # fmt: skip

    with serving(script) as server:
        record = by_model(strategy, server.url)
    purposes = [e.purpose for b in record.boundaries for e in exchanges_of(b)]
    assert record.success == plain.success
    assert "locating" in purposes and "replanning" in purposes
    if strategy == "post-hoc":  # driving is not verified, so that online finds it a step later
        assert [e.subtask for e in record.executed] == [e.subtask for e in plain.executed]
        assert purposes[0] == "verifying" and purposes.index("locating") == purposes.count(
            "verifying"
        )


@pytest.mark.slow
@pytest.mark.parametrize("strategy", ["post-hoc", "online"])
def test_a_dead_endpoint_leaves_the_baseline_as_it_is_without_a_model(strategy: str) -> None:
    plain = played(TASK, SCENARIO, None, **{"strategy.name": strategy})
    with serving(in_turn(failed(401))) as server:
        named = {"strategy.name": strategy, "strategy.locate": "model", "reasoner": "preconditions",
                 "replanner": "planner"}  # fmt: skip
        record = played(TASK, SCENARIO, server.url, **named)
    assert record.success == plain.success
    assert [str(e.subtask) for e in record.executed] == [str(e.subtask) for e in plain.executed]
    assert any(e.problem for b in record.boundaries for e in exchanges_of(b))
