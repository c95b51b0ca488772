"""A sentence for people from what a detector noticed: by templates, by a model, by both in turn."""

import pytest

from forestall.llm.explaining import ModelWriter, TemplateWriter
from forestall.types.plan import Subtask
from llm.scenes import Scripted

STEP = Subtask.parse("put_in(Plate-1, Microwave-1)")
LINES = ("Bowl-1 is inside Microwave-1", "b", "c", "d", "e")


def test_templates_string_lines_together() -> None:
    text, asked = TemplateWriter().write(STEP, "scene-graph", LINES)
    assert text == f"Before {STEP}: Bowl-1 is inside Microwave-1; b; c; 2 more." and not asked
    assert "nothing was noticed" in TemplateWriter().write(STEP, "scene-graph", ())[0]


def test_a_model_is_told_what_the_detector_noticed_and_no_more() -> None:
    model = Scripted([{"explanation": "The bowl is\nin the way."}])
    text, (asked,) = ModelWriter(model).write(STEP, "scene-graph", LINES)
    assert text == "The bowl is in the way." and not asked.problem
    ((_, _), (_, sent)) = model.asked[0].messages
    assert sent.splitlines() == [
        "Next step: put_in(Plate-1, Microwave-1)",
        'The detector ("scene-graph") noticed:',
        *(f'"{line}"' for line in LINES),
    ]


@pytest.mark.parametrize("answer", ["no", {"explanation": ""}, {}, ConnectionError("dead")])
def test_where_the_model_does_not_write_templates_do(answer: object) -> None:
    text, (asked,) = ModelWriter(Scripted([answer])).write(STEP, "image", LINES[:1])
    assert text == f"Before {STEP}: Bowl-1 is inside Microwave-1." and asked.problem


def test_nothing_is_asked_about_nothing() -> None:
    model = Scripted([""])
    assert ModelWriter(model).write(STEP, "image", ())[1] == () and not model.asked
