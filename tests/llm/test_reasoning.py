"""The reasoning module: what is asked, and what of an answer is taken."""

from dataclasses import replace

import numpy as np
import pytest

from forestall.diagnosis.model import ModelReasoner
from forestall.diagnosis.none import NoReasoning
from forestall.types.episode import SkillStatus
from forestall.types.facts import Literal
from forestall.types.observation import Rgb
from forestall.types.verdict import Calibration, Decision, Diagnosis, Reference, Verdict
from llm.scenes import EXPLAINED, Scripted, alarm, occupied
from planning.corpus import DOMAIN


def diagnosed(*answers: object, behind: bool = False) -> tuple[Diagnosis, Scripted]:
    model = Scripted(list(answers))
    reasoner = ModelReasoner(model, DOMAIN, NoReasoning(DOMAIN) if behind else None)
    return reasoner.diagnose(occupied(), alarm()), model


def test_a_good_answer_is_the_diagnosis() -> None:
    found, _ = diagnosed(EXPLAINED)
    assert found.cause == "a bowl is in the microwave"
    assert found.must_change == (Literal.parse("vacant(Microwave-1)"),)
    assert found.must_stay == (Literal.parse("open(Microwave-1)=open"),)
    assert (found.why, found.advice) == (EXPLAINED["why"], EXPLAINED["advice"])
    assert found.culprits == ("Bowl-1", "Microwave-1") and found.producer == "model"
    (asked,) = found.exchanges
    assert asked.purpose == "reasoning" and not asked.problem


def test_what_is_asked_holds_what_the_paper_gives_and_what_else_is_known() -> None:
    said = (
        alarm(),
        Verdict(Decision.REPLAN, "plan-check", None, 0.0, Calibration.FIXED, note="is not vacant"),
    )
    context = occupied()
    failed = (context.plan.subtasks[0], SkillStatus.FAILED)
    context = replace(context, said=said, executed=(*context.executed, failed))
    _, (role, text) = ModelReasoner(Scripted([""]), DOMAIN).request(context, alarm()).messages
    assert role == "user"
    for words in (
        'Goal: "on_top_of(?potato, ?plate); ',
        "Next step: put_in(Plate-1, Microwave-1)",
        "navigate_to_obj(Potato) failed",
        "inside Microwave-1",
        "In a run that went well:",
        "the demonstration shows nothing there",
        'Judge plan-check: "is not vacant"',
        "vacant(A)",
    ):
        assert words in text, words
    seen, _, wanted = text.partition("In a run that went well:")
    assert ", inside Microwave-1\n" in seen and ", inside Microwave-1\n" not in wanted


@pytest.mark.parametrize(
    ("fact", "why"),
    [
        ("vacant(Fridge-9)", "there is no Fridge-9"),
        ("vakant(Microwave-1)", "did you mean vacant"),
        ("open(Microwave-1)=ajar", "value of open"),
        ("open(Microwave-1)=open", "holds already"),
        ("accepts(Microwave-1, Plate-1)", "no plan brings about"),
        ("spoiled(Potato-1)", "no plan brings about"),
        ("vacant(Microwave-1, Plate-1)", "takes 1 argument"),
        ("rm -rf /", "cannot read"),
        ("vacant(" * 40, "cannot read"),
    ],
)
def test_a_fact_that_means_nothing_is_dropped_and_told(fact: str, why: str) -> None:
    changed = {**EXPLAINED, "must_change": [fact, "vacant(Microwave-1)"]}
    found, _ = diagnosed(changed)
    assert found.must_change == (Literal.parse("vacant(Microwave-1)"),)
    (asked,) = found.exchanges
    assert not asked.problem and asked.note.startswith("left out: ") and why in asked.note


def test_words_alone_count() -> None:
    found, _ = diagnosed({**EXPLAINED, "must_change": ["something is off"], "must_stay": []})
    assert found.must_change == () and found.advice == EXPLAINED["advice"]
    assert found.found


def test_an_answer_that_cannot_be_read_is_asked_for_once_more_with_the_reason() -> None:
    found, model = diagnosed("the bowl is in the way", EXPLAINED)
    assert found.must_change and [bool(e.problem) for e in found.exchanges] == [True, False]
    roles = [r for r, _ in model.asked[1].messages]
    assert roles == ["system", "user", "assistant", "user"]
    assert model.asked[1].messages[2][1] == "the bowl is in the way"
    assert "cannot be read" in model.asked[1].messages[3][1]


@pytest.mark.parametrize(
    "answer", ["no", '{"cause": 1}', "[]", "null", "", '{"cause": "a"}', ConnectionError("dead")]
)
def test_whoever_stands_behind_explains_where_the_model_does_not(answer: object) -> None:
    found, _ = diagnosed(answer, behind=True)
    assert found.must_change and found.exchanges
    assert "none, since the language model gave no explanation" in found.producer
    alone, _ = diagnosed(answer)
    assert not alone.found and "gave no explanation" in alone.cause


def test_a_dead_endpoint_is_asked_once() -> None:
    _, model = diagnosed(ConnectionError("dead"))
    assert len(model.asked) == 1


def test_the_robots_picture_goes_with_the_question_where_it_is_wanted() -> None:
    seen = occupied()
    reasoner = ModelReasoner(Scripted([""]), DOMAIN, pictures=True)
    (jpeg,) = reasoner.request(seen, alarm(nearest=None)).images
    assert jpeg.startswith(b"\xff\xd8")
    assert not reasoner.request(replace(seen, observation=None), alarm(nearest=None)).images


def test_the_picture_of_the_demonstration_goes_with_it_where_the_memory_keeps_it() -> None:
    grey = np.full((4, 6, 3), 128, np.uint8)
    of: list[str] = []

    def shown(reference: Reference) -> Rgb | None:
        of.append(reference.demonstration)
        return grey if len(of) == 1 else None

    reasoner = ModelReasoner(Scripted([""]), DOMAIN, pictures=True, shown=shown)
    both = reasoner.request(occupied(), alarm())
    assert len(both.images) == 2 and of == ["demo-1"]
    assert "Picture 1: what is seen. Picture 2: a run that went well." in both.messages[1][1]
    alone = reasoner.request(occupied(), alarm())
    assert len(alone.images) == 1 and "Picture 2" not in alone.messages[1][1]
    unseen = replace(occupied(), observation=None)
    assert "Picture" not in reasoner.request(unseen, alarm()).messages[1][1]


def test_a_fence_around_an_answer_is_no_fault() -> None:
    import json

    found, _ = diagnosed(f"```json\n{json.dumps(EXPLAINED)}\n```")
    assert found.must_change
