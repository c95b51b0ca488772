from collections.abc import Sequence

import pytest
from pydantic import BaseModel, ValidationError

from forestall.domain.load import shipped
from forestall.errors import InputError, UnknownNameError
from forestall.seams import Environment
from forestall.tasks import faults as f
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.plan import Plan, Subtask
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.worlds.kitchen.environment import KitchenEnvironment
from forestall.worlds.kitchen.flat_world import flat_environment

DOMAIN = shipped("household")
NEEDS = SceneNeeds(
    objects=(ObjectNeed("Mug-1", "Mug", ("CounterTop-1",)), ObjectNeed("Pot-1", "Pot")),
    fixtures=(("Microwave-1", "open", "closed"),),
)
PLAN = Plan.parse(
    ["navigate_to_obj(Mug)", "pick_up(Mug)", "put_in(Mug, Sink)", "pick_up(Mug)", "pour(Mug, Sink)"]
)


def _scene(**table: object) -> SceneNeeds:
    return f.apply_scene_faults(NEEDS, [f.parse_fault(table)], DOMAIN)


def _plan(**table: object) -> list[str]:
    return f.apply_plan_faults(PLAN, [f.parse_fault(table)], DOMAIN).texts()


# scene


def test_add_object_takes_the_next_free_number_and_its_states() -> None:
    needs = _scene(
        kind="add_object", category="Mug", places=["SinkBasin"], states={"dirty": "dirty"}
    )
    assert needs.objects[-1] == ObjectNeed("Mug-2", "Mug", ("Sink",), (("dirty", "dirty"),))
    assert NEEDS.objects == needs.objects[:-1]


def test_add_object_in_front_of_a_category_means_the_object_of_the_task() -> None:
    needs = _scene(kind="add_object", category="Pan", in_front_of="Mug")
    assert needs.objects[-1].in_front_of == "Mug-1"


def test_set_state_of_an_object_and_of_a_fixture() -> None:
    assert _scene(kind="set_state", object="Mug", attribute="filled", value="wine").objects[
        0
    ].states == (("filled", "wine"),)
    needs = _scene(kind="set_state", object="Microwave", attribute="open", value="open")
    assert needs.fixtures == (("Microwave-1", "open", "open"),)
    needs = _scene(kind="set_state", object="StoveBurner-4", attribute="toggled", value="on")
    assert ("StoveBurner-4", "toggled", "on") in needs.fixtures


def test_move_and_remove() -> None:
    needs = _scene(kind="move_object", object="Mug-1", places=["CoffeeMachine"])
    assert needs.objects[0].places == ("CoffeeMachine",)
    assert [o.id for o in _scene(kind="remove_object", object="Mug").objects] == ["Pot-1"]


def test_scene_faults_compose_in_order() -> None:
    needs = f.apply_scene_faults(
        NEEDS,
        [
            f.parse_fault({"kind": "add_object", "category": "Cup", "places": ["CoffeeMachine"]}),
            f.parse_fault(
                {"kind": "set_state", "object": "Cup", "attribute": "dirty", "value": "dirty"}
            ),
            f.parse_fault({"kind": "drop_step", "step": "pick_up(Mug)"}),
        ],
        DOMAIN,
    )
    assert needs.objects[-1].states == (("dirty", "dirty"),)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"kind": "add_object", "category": "Mugg"}, "did you mean Mug"),
        ({"kind": "add_object", "category": "Fridge"}, "add_object.category: Fridge is a fixture"),
        ({"kind": "add_object", "category": "Mug", "id": "Mug-1"}, "Mug-1 is already in the scene"),
        ({"kind": "add_object", "category": "Mug", "id": "Cup-1"}, "must read Mug-<number>"),
        ({"kind": "add_object", "category": "Pan", "places": ["Microwave"]}, "does not take Pan"),
        ({"kind": "add_object", "category": "Pan", "places": ["Faucet"]}, "add_object.places"),
        (
            {"kind": "add_object", "category": "Mug", "states": {"open": "open"}},
            "known: broken, dirty",
        ),
        (
            {"kind": "add_object", "category": "Mug", "in_front_of": "Knife"},
            "known: Mug, Mug-1, Pot",
        ),
        (
            {"kind": "set_state", "object": "Cup", "attribute": "dirty", "value": "dirty"},
            "set_state.object",
        ),
        (
            {"kind": "set_state", "object": "Mug", "attribute": "dirty", "value": "filthy"},
            "known: clean, dirty",
        ),
        ({"kind": "move_object", "object": "Cup", "places": ["Sink"]}, "move_object.object"),
        ({"kind": "remove_object", "object": "Cup"}, "remove_object.object"),
    ],
)
def test_a_scene_fault_that_fits_nothing_says_which_field_and_what_would(
    table: dict[str, object], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        _scene(**table)


# plan


def test_drop_step_by_occurrence() -> None:
    assert _plan(kind="drop_step", step="pick_up(Mug)", occurrence=2) == [
        "navigate_to_obj(Mug)", "pick_up(Mug)", "put_in(Mug, Sink)", "pour(Mug, Sink)"
    ]  # fmt: skip


def test_insert_and_move_step() -> None:
    assert _plan(kind="insert_step", step="toggle_on(Faucet)", after="put_in(Mug, Sink)")[3] == (
        "toggle_on(Faucet)"
    )
    assert _plan(kind="insert_step", step="toggle_on(Faucet)", before="pick_up(Mug)", occurrence=2)[
        3
    ] == ("toggle_on(Faucet)")
    assert _plan(kind="move_step", step="pour(Mug, Sink)", before="navigate_to_obj(Mug)")[0] == (
        "pour(Mug, Sink)"
    )


def test_replace_argument_and_plan() -> None:
    assert _plan(kind="replace_argument", step="put_in(Mug, Sink)", argument="target", by="Bowl")[
        2
    ] == ("put_in(Mug, Bowl)")
    assert _plan(kind="replace_plan", plan=["(pick_up, Mug)"]) == ["pick_up(Mug)"]


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"kind": "drop_step", "step": "pick_up(Cup)"}, r"drop_step.step.*pick_up\(Mug\)"),
        ({"kind": "drop_step", "step": "pick_up(Mug)", "occurrence": 3}, "2 time"),
        (
            {"kind": "move_step", "step": "pick_up(Mug)", "after": "open_obj(Fridge)"},
            "move_step.after",
        ),
        (
            {"kind": "replace_argument", "step": "pick_up(Mug)", "argument": "target", "by": "Cup"},
            "has no target",
        ),
        ({"kind": "insert_step", "step": "pick_up(Mug)"}, "before"),
        ({"kind": "drop_step", "step": "pick_up Mug"}, "cannot read"),
        ({"kind": "drop_step", "step": "pick_up(Mug)", "occurence": 2}, "occurence"),
        ({"kind": "dropstep"}, "drop_step"),
        ({"kind": "drop", "step": "pick_up(Mug)", "times": 0}, "times"),
        (
            {"kind": "wrong_receptacle", "step": "pick_up(Mug)", "acts_on": "Cup"},
            "has no receptacle",
        ),
    ],
)
def test_a_plan_fault_that_fits_nothing_says_which_field_and_what_would(
    table: dict[str, object], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        _plan(**table)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (
            {"kind": "insert_step", "step": "grab(Mug)", "after": "pick_up(Mug)"},
            r"step 3, grab\(Mug\): unknown skill 'grab'",
        ),
        (
            {"kind": "replace_plan", "plan": ["pick_up(Mug, Sink)"]},
            r"pick_up takes 1 argument\(s\)",
        ),
        ({"kind": "drop", "step": "grab(Mug)"}, "unknown skill 'grab'"),
    ],
)
def test_a_skill_that_the_domain_does_not_have_is_named_when_the_steps_are_checked(
    table: dict[str, object], message: str
) -> None:
    fault = f.parse_fault(table)
    plan = f.apply_plan_faults(PLAN, [fault], DOMAIN)
    with pytest.raises(InputError, match=message):
        f.check_steps(plan, [fault], DOMAIN)


def test_faults_embed_in_a_file_schema() -> None:
    class File(BaseModel):
        faults: list[f.Fault]

    assert File.model_validate({"faults": [{"kind": "drop", "step": "pick_up(Mug)"}]}).faults == [
        f.Drop(step="pick_up(Mug)")
    ]
    with pytest.raises(ValidationError, match=r"faults\.0"):
        File.model_validate({"faults": [{"kind": "explode"}]})
    assert "discriminator" in str(File.model_json_schema())


# execution


def _run(
    *tables: dict[str, object], steps: Sequence[str]
) -> tuple[KitchenEnvironment, Environment, list[SkillOutcome]]:
    inner = flat_environment(NEEDS, DOMAIN)
    env = f.wrap(inner, [f.parse_fault(t) for t in tables], inner, DOMAIN)
    env.reset(0)
    return inner, env, [env.execute(Subtask.parse(s)) for s in steps]


def test_without_execution_faults_the_environment_is_not_wrapped() -> None:
    inner = flat_environment(NEEDS, DOMAIN)
    assert (
        f.wrap(inner, [f.parse_fault({"kind": "remove_object", "object": "Mug"})], inner, DOMAIN)
        is inner
    )


def test_drop_runs_the_skill_and_then_loses_the_object_once() -> None:
    steps = ["pick_up(Mug)", "navigate_to_obj(Sink-1)"]
    inner, env, outcomes = _run({"kind": "drop", "step": "navigate_to_obj(Sink)"}, steps=steps)
    assert outcomes[-1].status is SkillStatus.SUCCEEDED
    assert outcomes[-1].duration_s > 0
    assert not inner.oracle.truth().in_hands(("gripper",))
    assert inner.oracle.truth().parents("Mug-1", DOMAIN.containing) == ("Floor-1",)
    for step in steps:
        env.execute(Subtask.parse(step))
    assert inner.oracle.truth().in_hands(("gripper",)) == ("Mug-1",)


def test_drop_waits_for_a_full_hand() -> None:
    inner, _, _ = _run(
        {"kind": "drop", "step": "navigate_to_obj(Sink)"},
        steps=["navigate_to_obj(Sink)", "pick_up(Mug)", "navigate_to_obj(SinkBasin)"],
    )
    assert not inner.oracle.truth().in_hands(("gripper",))


def test_failed_action_does_nothing_and_reports_success_once() -> None:
    inner, env, outcomes = _run(
        {"kind": "failed_action", "step": "toggle_on(Faucet)"}, steps=["toggle_on(Faucet-1)"]
    )
    assert outcomes[0].status is SkillStatus.SUCCEEDED
    assert outcomes[0].duration_s == inner.time_s > 0
    assert inner.oracle.states("Faucet-1")["toggled"] == "off"
    env.execute(Subtask.parse("toggle_on(Faucet)"))
    assert inner.oracle.states("Faucet-1")["toggled"] == "on"


def test_occurrence_and_times() -> None:
    fault = {"kind": "failed_action", "step": "toggle_on(Faucet)", "occurrence": 2, "times": 2}
    steps = ["toggle_on(Faucet)", "toggle_off(Faucet)"]
    inner, env, _ = _run(fault, steps=steps)
    for expected in ("off", "off", "on"):
        env.execute(Subtask.parse(steps[0]))
        assert inner.oracle.states("Faucet-1")["toggled"] == expected


def test_wrong_object_and_wrong_receptacle() -> None:
    inner, _, _ = _run(
        {"kind": "wrong_object", "step": "pick_up(Mug)", "acts_on": "Pot"}, steps=["pick_up(Mug-1)"]
    )
    assert inner.oracle.truth().in_hands(("gripper",)) == ("Pot-1",)
    inner, _, _ = _run(
        {"kind": "wrong_receptacle", "step": "put_in(Mug, Sink)", "acts_on": "GarbageCan"},
        steps=["pick_up(Mug)", "put_in(Mug, Sink)"],
    )
    assert inner.oracle.truth().parents("Mug-1", DOMAIN.containing) == ("GarbageCan-1",)


def test_an_instance_in_a_fault_means_only_that_instance() -> None:
    inner, _, _ = _run(
        {"kind": "failed_action", "step": "toggle_on(StoveBurner-2)"},
        steps=["toggle_on(StoveBurner-1)", "toggle_on(StoveBurner-2)"],
    )
    assert inner.oracle.states("StoveBurner-1")["toggled"] == "on"
    assert inner.oracle.states("StoveBurner-2")["toggled"] == "off"


def test_reset_arms_the_faults_again_and_the_rest_is_handed_on() -> None:
    inner, env, _ = _run(
        {"kind": "failed_action", "step": "toggle_on(Faucet)"}, steps=["toggle_on(Faucet)"]
    )
    env.reset(0)
    env.execute(Subtask.parse("toggle_on(Faucet)"))
    assert inner.oracle.states("Faucet-1")["toggled"] == "off"
    assert env.scan().time_s == env.time_s == inner.time_s
    assert len(env.observe([(0.0, 1.0, 1.0)]).frames) == 1
    env.close()


def test_errors_of_unknown_names_carry_the_known_ones() -> None:
    with pytest.raises(UnknownNameError) as caught:
        _scene(kind="remove_object", object="Mugg")
    assert "Mug" in caught.value.known


def test_drop_at_a_placing_step_comes_before_the_hand_lets_go() -> None:
    inner, _, outcomes = _run(
        {"kind": "drop", "step": "put_in(Mug, Sink)"}, steps=["pick_up(Mug)", "put_in(Mug, Sink)"]
    )
    assert [o.status for o in outcomes] == [SkillStatus.SUCCEEDED, SkillStatus.REFUSED]
    assert [str(r) for r in inner.oracle.truth().relations if r.subject == "Mug-1"] == [
        "Mug-1 on top of Floor-1"
    ]
