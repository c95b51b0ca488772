"""What a language model expects where no demonstration speaks: asked once, weighed less, said."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from forestall.assembly.configuration import Given, run_config
from forestall.assembly.expecting import keep, read_expected
from forestall.assembly.make import prepare, run_episode
from forestall.assembly.parts import Assembly
from forestall.comparison.expectations import LEAST_SHOWN, WEIGHT, Expected, beside
from forestall.comparison.lacking import Knowledge
from forestall.comparison.needs import Needs
from forestall.comparison.preconditions import mine, needed, violations
from forestall.detection.preconditions import PreconditionConfig, PreconditionDetector
from forestall.diagnosis.expecting import ModelExpectations
from forestall.diagnosis.model import ModelReasoner
from forestall.diagnosis.symbolic import SymbolicReasoner
from forestall.domain.load import shipped
from forestall.errors import FileFormatError, InputError
from forestall.kinds import EXPECTATIONS
from forestall.llm.prompts import estimated_tokens
from forestall.planning.ahead import foresee
from forestall.reading.fields import Field
from forestall.records.exchanges import exchanges_of
from forestall.records.sentences import _judges
from forestall.records.verdicts import verdict_from, verdict_json
from forestall.report.page import page_html
from forestall.types.demonstration import Demonstration, DemonstrationStep
from forestall.types.episode import EpisodeRecord
from forestall.types.facts import Literal
from forestall.types.graph import ObjectNode, Relation, SceneGraph
from forestall.types.plan import Plan
from forestall.types.runtime import BoundaryContext
from forestall.types.scene import SceneNeeds
from forestall.types.task import Goal, Task
from forestall.types.verdict import Decision, Diagnosis, Verdict
from llm.episodes import SEED, SYMBOLIC, memory
from llm.scenes import Scripted
from llm.server import Reply, Script, serving
from llm.server import Scripted as Scripting
from llm.server import said as said_over_http
from llm.test_record import record

BENCH = shipped("bench")
PLAN = Plan.parse(["pick(Bolt)", "insert(Bolt, BoltHole)", "pick(Cloth)"])
INSERT = 1
LIFTED = Literal("dirt", (BENCH.skills["insert"].parameters[1].name,), "clean")
DIRTY = Literal.parse("dirt(BoltHole-1)=clean")


@pytest.fixture(autouse=True)
def no_key(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    monkeypatch.setenv("NO_PROXY", "*")


def scene(hole: str | None = "clean", bolt: str = "clean") -> SceneGraph:
    nodes = (
        ObjectNode("gripper", "gripper"),
        ObjectNode("Jaws-1", "Jaws"),
        ObjectNode("Arm-1", "Arm"),
        ObjectNode("Workbench-1", "Workbench", (("dirt", "clean"),)),
        ObjectNode("Cloth-1", "Cloth"),
        ObjectNode("Bolt-1", "Bolt", (("dirt", bolt), ("glue", "dry"))),
        ObjectNode("BoltHole-1", "BoltHole", (("dirt", hole),)),
    )
    relations = (
        Relation("Jaws-1", "mounted_on", "Arm-1"),
        Relation("Cloth-1", "lying_on", "Workbench-1"),
        Relation("Bolt-1", "gripped_by", "gripper"),
    )
    return SceneGraph(nodes, relations)


def at(graph: SceneGraph, index: int = INSERT, **changes: Any) -> BoundaryContext:
    step = Plan.parse(["pick(Bolt-1)", "insert(Bolt-1, BoltHole-1)"]).subtasks[index]
    task = Task("new", "new", Goal("the bolt is in its hole"), PLAN, SceneNeeds())
    scoped = replace(graph, subtask=step)
    context = BoundaryContext(task, PLAN, index, index, step, graph, scoped, None)
    return replace(context, **changes)


def counts(*graphs: SceneGraph) -> Needs:
    """Of demonstrations of the insertion."""
    step = at(scene()).subtask
    steps = [DemonstrationStep(0, step, replace(g, subtask=step), g) for g in graphs]
    shown = [Demonstration("other", "room", 1, (s,), id=f"d{i}") for i, s in enumerate(steps)]
    return Needs.of(shown, BENCH)


def said(**facts: list[str]) -> dict[str, Any]:
    """An answer: step_2=[...]."""
    return {
        "steps": [
            {"step": int(name.removeprefix("step_")), "must_hold": of, "why": "chips fall through"}
            for name, of in facts.items()
        ]
    }


CLEAN = said(step_1=["dirt(BoltHole)=clean"])
Made = tuple[PreconditionDetector, SymbolicReasoner, Scripted]


def parts(
    *answers: Any, memory: Needs | None = None, threshold: float = 0.5, **options: Any
) -> Made:
    model = Scripted(list(answers))
    expectations = ModelExpectations(model, BENCH, WEIGHT, **options)
    found = Needs(BENCH) if memory is None else memory
    knowledge = Knowledge(lambda: found, foresee)
    detector = PreconditionDetector(
        BENCH, None, PreconditionConfig(threshold), knowledge=knowledge, expectations=expectations
    )
    reasoner = SymbolicReasoner(
        mine, violations, BENCH, knowledge=knowledge, expectations=expectations
    )
    return detector, reasoner, model


def judged(context: BoundaryContext, *answers: Any, **options: Any) -> tuple[Verdict, Scripted]:
    detector, _, model = parts(*answers, **options)
    return detector.judge(context.scoped, None, (), context), model


def test_what_a_model_expects_is_an_alarm_that_says_whose_it_is() -> None:
    verdict, model = judged(at(scene(hole="dirty")), CLEAN)
    assert verdict.decision is Decision.REPLAN and verdict.lacking == (DIRTY,)
    assert verdict.score == pytest.approx(1 - WEIGHT) and verdict.references == 0
    assert "no demonstration, but the language model scripted expects it" in verdict.note
    assert verdict.expected_by == "scripted"
    assert _judges(verdict, ()).endswith("needs that the language model scripted expects")
    (asked,) = verdict.exchanges
    assert asked.purpose == "expecting" and not asked.problem and len(model.asked) == 1
    fine, _ = judged(at(scene()), CLEAN)
    assert fine.decision is Decision.PROCEED and fine.judged and fine.expected_by == "scripted"
    assert fine.note == "no demonstration of it; it is as the language model scripted expects"


def test_it_weighs_less_than_one_demonstration() -> None:
    assert WEIGHT < LEAST_SHOWN == pytest.approx(2 / 3)
    dirty = at(scene(hole="dirty"))
    strict = 1 - (WEIGHT + LEAST_SHOWN) / 2
    assert judged(dirty, CLEAN, threshold=strict)[0].decision is Decision.PROCEED
    shown = counts(scene())
    assert judged(dirty, CLEAN, memory=shown, threshold=strict)[0].decision is Decision.REPLAN


def test_where_there_is_a_demonstration_the_model_is_not_asked_and_has_no_say() -> None:
    both = counts(scene(bolt="dirty"), scene())
    answer = said(step_1=["dirt(Bolt)=clean"])
    verdict, model = judged(at(scene(bolt="dirty")), answer, memory=both)
    assert verdict.decision is Decision.PROCEED
    asked = [r.messages[1][1].partition("For these steps:")[2] for r in model.asked]
    assert not any("insert" in steps for steps in asked)


def test_what_demonstrations_of_other_kinds_say_stands_over_it() -> None:
    mined = needed(counts(scene()), at(scene()).subtask, "other", 0)
    assert LIFTED in {p.literal for p in mined}
    expected = Expected(
        "insert", ("Bolt", "BoltHole"), "new", (replace(LIFTED, value="dirty"),), "m"
    )
    assert beside(mined, expected, WEIGHT) == mined
    without = [p for p in mined if p.literal != LIFTED]
    (added,) = (p for p in beside(without, expected, WEIGHT) if p.expected_by)
    assert (added.support, added.total, added.weight) == (0, 0, WEIGHT)


def test_one_question_about_all_that_no_demonstration_shows_and_none_twice() -> None:
    detector, reasoner, model = parts(said(step_2=["dirt(BoltHole)=clean"]))
    for index in (0, INSERT):
        context = at(scene(hole="dirty"), index)
        verdict = detector.judge(context.scoped, None, (), context)
        reasoner.diagnose(context, verdict)
    (request,) = model.asked
    text = request.messages[1][1]
    assert "1: pick(Bolt)\n2: insert(Bolt, BoltHole)\n3: pick(Cloth)\n" in text
    assert 'Goal: "the bolt is in its hole"' in text and "dirty\n" not in text
    assert "dirt(A)=" in text and estimated_tokens(request) < 300
    assert verdict.exchanges == ()  # it was asked at the boundary before
    of_step = json.loads(request.schema)["properties"]["steps"]["items"]["properties"]
    assert of_step["step"]["enum"] == [1, 2, 3]


def test_the_cause_says_whose_it_is_and_nothing_of_it_counts_as_demonstrated() -> None:
    _, reasoner, _ = parts(said(step_1=["dirt(BoltHole)=clean", "dirt(Bolt)=clean"]))
    context = at(scene(hole="dirty"))
    found = reasoner.diagnose(context, Verdict(Decision.REPLAN, "x", 0.4, 0.5, VERDICT.calibration))
    assert found.must_change == (DIRTY,) and found.must_stay == () and found.support is None
    assert "no demonstration shows it, but the language model scripted says" in found.cause
    assert "must be clean before insert" in found.cause and found.exchanges


VERDICT, _ = judged(at(scene(hole="dirty")), CLEAN)


@pytest.mark.parametrize(
    ("fact", "why"),
    [
        ("shiny(BoltHole)=yes", "unknown predicate"),
        ("dirt(BoltHole)=spotless", "value of dirt"),
        ("dirt(Cloth)=clean", "is no thing of insert(Bolt, BoltHole)"),
        ("glue(BoltHole)=dry", "nothing that such a thing has"),
        ("dirt(BoltHole)=dirty", "contradicts"),
        ("rm -rf /", "cannot read"),
    ],
)
def test_a_fact_that_means_nothing_is_left_out_counted_and_told(fact: str, why: str) -> None:
    answer = said(step_1=["dirt(BoltHole)=clean", fact], step_9=["dirt(Bolt)=clean"])
    verdict, _ = judged(at(scene(hole="dirty")), answer)
    assert verdict.decision is Decision.REPLAN
    (asked,) = verdict.exchanges
    assert asked.note.startswith("2 of its facts left out: ") and why in asked.note
    assert "nobody asked about step 9" in asked.note


@pytest.mark.parametrize("answer", ["no", "[]", '{"steps": 1}', '{"steps": [{"step": "2"}]}'])
def test_an_answer_that_cannot_be_read_is_asked_for_once_more(answer: str) -> None:
    verdict, model = judged(at(scene(hole="dirty")), answer, CLEAN)
    assert verdict.decision is Decision.REPLAN and len(model.asked) == 2
    assert [bool(e.problem) for e in verdict.exchanges] == [True, False]
    assert "cannot be read" in model.asked[1].messages[3][1]


def test_without_an_answer_all_is_as_if_nobody_had_been_asked() -> None:
    detector, _, model = parts(ConnectionError("dead"))
    plain = PreconditionDetector(BENCH, knowledge=Knowledge(lambda: Needs(BENCH), foresee))
    context = at(scene(hole="dirty"))
    for _ in range(2):
        verdict = detector.judge(context.scoped, None, (), context)
        (asked,) = verdict.exchanges
        assert asked.problem == "dead" and len(model.asked) == 1
        assert replace(verdict, exchanges=()) == plain.judge(context.scoped, None, (), context)


@pytest.mark.parametrize("may_look", [True, False])
def test_what_cannot_be_seen_is_never_said_to_be_as_expected(may_look: bool) -> None:
    unseen = replace(at(scene(hole=None)), may_look=may_look)
    verdict, _ = judged(unseen, CLEAN)
    assert verdict.decision is Decision.LOOK_AGAIN
    assert "not observed: dirt(BoltHole-1)=clean" in verdict.note
    assert "it is as the language model" not in verdict.note


def test_what_was_said_is_kept_in_a_file_of_its_own(tmp_path: Path) -> None:
    file = tmp_path / "bench.expectations.toml"
    answer = said(step_1=["dirt(BoltHole)=clean"], step_2=[])

    first, _ = judged(at(scene(hole="dirty")), answer, keep=partial(keep, file))
    known = read_expected(file, BENCH)
    assert [(e.skill, e.facts, e.model) for e in known] == [
        ("insert", (LIFTED,), "scripted"), ("pick", (), "scripted"),
    ]  # fmt: skip
    text = file.read_text(encoding="utf-8")
    assert 'source = "model"' in text and 'why = "chips fall through"' in text
    again, model = judged(at(scene(hole="dirty")), ConnectionError("dead"), known=known)
    assert again.decision is Decision.REPLAN and again.note == first.note and not model.asked
    first_step = at(scene(hole="dirty"), 0)
    _, model = judged(first_step, ConnectionError("dead"), known=known)
    assert "For these steps:\n1: pick(Bolt)\n" in model.asked[0].messages[1][1]
    keep(file, known[:1])
    assert len(read_expected(file, BENCH)) == 3


@pytest.mark.parametrize(
    ("edit", "why"),
    [
        (lambda t: t.replace("=clean", "=spotless"), r"expected\[1\]\.facts\[0\].*value of dirt"),
        (lambda t: t.replace('"model"', '"demonstration"', 1), r"expected\[0\]\.source"),
        (lambda t: t.replace("insert(", "insrt("), "did you mean insert"),
        (lambda t: t.replace("why =", "whi ="), "did you mean why"),
        (lambda t: t.replace("[[expected]]", "[[shown]]", 1), "table of expectations"),
    ],
)
def test_a_file_that_says_nonsense_is_refused_with_its_place(
    tmp_path: Path, edit: Callable[[str], str], why: str
) -> None:
    file = tmp_path / "e.toml"
    keep(file, [Expected("pick", ("Bolt",), "new", (), "m")])
    keep(file, [Expected("insert", ("Bolt", "BoltHole"), "new", (LIFTED,), "m")])
    file.write_text(edit(file.read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(FileFormatError, match=why):
        read_expected(file, BENCH)


def test_it_is_off_by_default_and_its_weight_is_bounded() -> None:
    def made(**named: Any) -> Any:
        llm = {"name": "openai", "base_url": "http://localhost:9/v1", "model": "m"}
        config = run_config("heat-potato", llm=llm, **named)
        return Assembly(config.choices, shipped("household")).part(EXPECTATIONS)

    assert made().name == "none"
    assert made(expectations="model").name == "model"
    with pytest.raises(InputError, match=r"weight 0\.7.*below 0\.67"):
        made(expectations={"name": "model", "weight": 0.7})


def test_record_and_page_have_the_question() -> None:
    written = json.loads(json.dumps(verdict_json(VERDICT), default=lambda e: e.value))
    assert verdict_from(Field(written)) == VERDICT
    assert "exchanges" not in verdict_json(replace(VERDICT, exchanges=()))
    plain = record()
    boundary = replace(plain.boundaries[0], verdict=VERDICT, watched=(VERDICT,))
    assert [e.purpose for e in exchanges_of(boundary)] == ["expecting", "reasoning", "replanning"]
    page = page_html(replace(plain, boundaries=(boundary,)))
    assert "expecting" in page and "dirt(BoltHole)=clean" in page


def test_behind_a_model_that_explains_both_questions_are_told() -> None:
    _, behind, _ = parts(CLEAN)
    found: Diagnosis = ModelReasoner(Scripted([ConnectionError("dead")]), BENCH, behind).diagnose(
        at(scene(hole="dirty")), VERDICT
    )
    assert found.must_change == (DIRTY,)
    assert [e.purpose for e in found.exchanges] == ["reasoning", "expecting"]


def expecting(**facts: list[str]) -> Script:
    """Says of the first step of a skill that these facts must hold."""

    def script(body: dict[str, Any]) -> Reply:
        text = body["messages"][1]["content"].partition("For these steps:")[2]
        steps = [(int(n), s) for n, s in re.findall(r"^(\d+): (\w+)\(", text, re.MULTILINE)]
        first = {s: n for n, s in reversed(steps)}
        return said_over_http(said(**{f"step_{first[s]}": f for s, f in facts.items()}))

    return script


def without_demonstrations(expectations: str, script: Script) -> tuple[EpisodeRecord, Scripting]:
    """A dirty plate, and demonstrations of another task alone."""
    with serving(script) as server:
        llm = {"name": "openai", "base_url": server.url}
        named = {"detector": "preconditions", "expectations": expectations, "llm": llm}
        given = Given.named(named).over(SYMBOLIC)
        config = run_config("heat-potato", "plate-dirty", seed=SEED, given=given)
        return run_episode(prepare(config), memory("water-plant")), server


@pytest.mark.slow
def test_a_whole_run_is_saved_by_what_a_model_expects() -> None:
    script = expecting(put_on=["dirty(Plate)=clean"])
    blind, server = without_demonstrations("none", script)
    assert not blind.success and not server.asked
    record, server = without_demonstrations("model", script)
    assert record.success and len(server.asked) == 1
    (alarm,) = (b for b in record.boundaries if b.diagnosis is not None)
    assert alarm.verdict is not None and alarm.verdict.expected_by == "scripted"
    assert "no demonstration shows it, but the language model scripted says" in alarm.sentence
    assert alarm.sentence.endswith("needs that the language model scripted expects.")
    assert "demonstrations" not in alarm.sentence
    (asked,) = (e for b in record.boundaries for e in exchanges_of(b))
    assert (asked.purpose, asked.model) == ("expecting", "scripted")


@pytest.mark.slow
@pytest.mark.parametrize(
    "fact", ["broken(Potato)=broken", "cooked(Potato)=cooked", "vacant(Potato)"]
)
def test_nonsense_that_is_expected_costs_no_run(fact: str) -> None:
    blind, _ = without_demonstrations("none", expecting())
    record, _ = without_demonstrations("model", expecting(pick_up=[fact]))
    assert record.end is blind.end and record.trouble is None
