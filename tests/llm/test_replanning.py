"""The replanning module: the validator decides, and its reason is sent back."""

import json
from dataclasses import replace

import pytest

from forestall.deadline import Deadline
from forestall.replanning.model import ModelReplanner
from forestall.replanning.symbolic import PlannerReplanner
from forestall.types.facts import Literal
from forestall.types.plan import Plan, Subtask
from forestall.types.task import Goal
from forestall.types.verdict import Diagnosis, Replan, ReplanOutcome
from llm.scenes import REPAIR, VALIDATOR, Scripted, occupied, planned
from planning.corpus import DOMAIN

VACANT = Diagnosis(
    "a bowl is in the microwave", (Literal.parse("vacant(Microwave-1)"),),
    must_stay=(Literal.parse("on_top_of(Potato, Plate-1)"),), culprits=("Bowl-1", "Microwave-1"),
    advice="take the bowl out",
)  # fmt: skip
OLD = planned("put_in(Plate-1, Microwave-1)", "close_obj(Microwave-1)", "toggle_on(Microwave-1)")
OTHER_TASK = planned("navigate_to_obj(Mug-1)", "pick_up(Mug-1)")
DEAD = ConnectionError("the endpoint cannot be reached")


def replanned(
    *answers: object, diagnosis: Diagnosis = VACANT, planner: bool = True, attempts: int = 3
) -> tuple[Replan, Scripted]:
    model = Scripted(list(answers))
    behind = PlannerReplanner(VALIDATOR, DOMAIN) if planner else None
    replanner = ModelReplanner(model, VALIDATOR, DOMAIN, behind, attempts=attempts)
    return replanner.replan(occupied(), diagnosis), model


def test_a_good_plan_is_taken_as_the_validator_checked_it() -> None:
    found, model = replanned(planned(*REPAIR), planner=False)
    assert found.outcome is ReplanOutcome.SOLVED and found.plan is not None
    assert found.check is not None and found.check.ok and found.producer == "model"
    assert found.plan.texts() == list(REPAIR) and len(model.asked) == 1


def test_what_is_asked_names_state_skills_places_and_diagnosis() -> None:
    _, model = replanned(planned(*REPAIR))
    _, (_, text) = model.asked[0].messages
    for words in (
        "Make true: vacant(Microwave-1)", "Keep true: on_top_of(Potato, Plate-1)",
        "Never: spoiled(potato)\n",
        'Advice: "take the bowl out"', "holds Plate-1", "inside Microwave-1",
        "pick_up(object) needs no h: held_by(h, gripper)", "room for Bowl-1, Plate-1: ",
        "Old plan: put_in(Plate, Microwave); close_obj(Microwave); toggle_on(Microwave)",
    ):  # fmt: skip
        assert words in text, (words, text)
    schema = json.loads(model.asked[0].schema)
    of_step = schema["properties"]["steps"]["items"]["properties"]
    assert of_step["skill"]["enum"] == sorted(DOMAIN.skills)
    here = {n.id for n in occupied().graph.nodes} - {"gripper"}
    assert here <= set(of_step["args"]["items"]["enum"])


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        (OLD, "step 1, put_in(Plate-1, Microwave-1): "),
        (OTHER_TASK, "step 2, pick_up(Mug-1): "),
        (planned(*REPAIR[:-1]), "its goal is not met"),
        (planned("fly(Plate-1)"), "there is no skill 'fly'"),
        (planned("pick_up(Bowl-7)"), "there is no thing 'Bowl-7'"),
        (planned("pick_up(Bowl-1, Plate-1)"), "step 1: pick_up takes 1 argument"),
        ({"idea": "", "steps": []}, "its goal is not met"),
        ("navigate to the counter", "cannot be read"),
        ({"steps": "all of them"}, "cannot be read"),
        ({"idea": "", "steps": [{"skill": "pick_up", "args": ["Bowl-1"]}] * 61}, "cannot be read"),
    ],
    ids=["the old plan", "another task's", "too short", "no such skill", "no such thing",
         "arguments", "nothing", "prose", "no list", "too long"],
)  # fmt: skip
def test_the_exact_reason_goes_back_and_the_next_answer_counts(answer: object, why: str) -> None:
    found, model = replanned(answer, planned(*REPAIR), planner=False)
    assert found.outcome is ReplanOutcome.SOLVED
    first, second = found.exchanges
    assert why in first.problem and not second.problem
    sent = model.asked[1].messages[-1][1]
    assert json.dumps(first.problem, ensure_ascii=False)[1:40] in sent


def test_after_three_wrong_answers_the_planner_plans_and_it_is_said() -> None:
    found, model = replanned(OLD)
    assert len(model.asked) == 3 == len(found.exchanges)
    assert found.outcome is ReplanOutcome.SOLVED and found.producer == "planner"
    assert "no plan of the language model was accepted in 3 answers" in found.note


def test_without_a_planner_three_wrong_answers_are_the_end() -> None:
    found, model = replanned(OLD, planner=False)
    assert len(model.asked) == 3
    assert found.outcome is ReplanOutcome.REJECTED
    assert found.check is not None and not found.check.ok and "3 answers" in found.note


def test_a_dead_endpoint_is_asked_once_and_the_planner_plans() -> None:
    found, model = replanned(DEAD)
    assert len(model.asked) == 1 and found.producer == "planner"
    assert "cannot be reached" in found.note and found.exchanges[0].problem == str(DEAD)
    alone, _ = replanned(DEAD, planner=False)
    assert alone.outcome is ReplanOutcome.NOT_FOUND and "cannot be reached" in alone.note


def test_advice_without_facts_goes_on_and_the_validator_decides() -> None:
    words = Diagnosis("something is in the microwave", (), advice="take the bowl out")
    found, _ = replanned(planned(*REPAIR), diagnosis=words, planner=False)
    assert found.outcome is ReplanOutcome.SOLVED
    found, _ = replanned(DEAD, diagnosis=words)  # the planner goes by what would fail
    assert found.outcome is ReplanOutcome.SOLVED and found.producer == "planner"


def test_without_facts_and_advice_nothing_is_asked() -> None:
    found, model = replanned(planned(*REPAIR), diagnosis=Diagnosis("nothing was found", ()))
    assert found.outcome is ReplanOutcome.NOTHING_TO_CHANGE and not model.asked


def test_a_plan_that_does_not_do_what_must_change_is_sent_back() -> None:
    asked = replace(VACANT, must_change=(Literal.parse("dirty(Microwave-1)=dirty"),))
    model = Scripted([planned(*REPAIR)])
    hot = Literal.parse("temperature(Bowl-1)=hot")
    found = ModelReplanner(model, VALIDATOR, DOMAIN, attempts=1).replan(
        occupied(), replace(asked, must_change=(hot,))
    )
    assert found.outcome is ReplanOutcome.REJECTED
    assert "never brings about temperature(Bowl-1)=hot" in found.exchanges[0].problem


def test_what_the_robot_has_refused_is_not_planned_again() -> None:
    context = replace(occupied(), refused=(Subtask.parse("pick_up(Bowl-1)"),))
    found = ModelReplanner(Scripted([planned(*REPAIR)]), VALIDATOR, DOMAIN, attempts=1).replan(
        context, VACANT
    )
    assert found.outcome is ReplanOutcome.REJECTED and "has refused pick_up" in found.note


def test_what_was_tried_in_vain_is_told_as_that_and_not_as_refused() -> None:
    step = Subtask.parse("pick_up(Bowl-1)")
    context = replace(occupied(), refused=(step,), vain=(step,))
    model = Scripted([planned(*REPAIR)])
    found = ModelReplanner(model, VALIDATOR, DOMAIN, attempts=1).replan(context, VACANT)
    assert found.outcome is ReplanOutcome.REJECTED
    assert "pick_up(Bowl-1) was tried time and again" in found.note and "refused" not in found.note
    text = model.asked[0].messages[1][1]
    assert "came to nothing: pick_up(Bowl-1)" in text and "has refused" not in text


def test_without_a_goal_a_plan_must_end_with_what_was_left() -> None:
    context = occupied()
    context = replace(context, task=replace(context.task, goal=Goal("heat it")))
    model = Scripted([planned(*REPAIR[:6]), planned(*REPAIR)])
    found = ModelReplanner(model, VALIDATOR, DOMAIN).replan(context, VACANT)
    assert found.outcome is ReplanOutcome.SOLVED and found.plan is not None
    assert "it must end with what was left" in found.exchanges[0].problem
    assert found.plan.subtasks[-3:] == Plan.parse(REPAIR).subtasks[-3:]


def test_the_model_leaves_time_for_the_planner() -> None:
    seen: list[float] = []

    class Slow(Scripted):
        def ask(self, request, deadline=None):  # type: ignore[no-untyped-def]
            seen.append(deadline.left())
            return super().ask(request, deadline)

    replanner = ModelReplanner(Slow([DEAD]), VALIDATOR, DOMAIN, PlannerReplanner(VALIDATOR, DOMAIN))
    assert replanner.replan(occupied(), VACANT, Deadline(100.0)).plan is not None
    assert 50 < seen[0] <= 60
