"""Why a run is lost: the true facts behind scenes, slips, other people and wrong plans."""

from __future__ import annotations

import pytest
from lost_runs import lost, run

from forestall.domain.formula import normal
from forestall.domain.load import shipped
from forestall.planning.observed import state_of
from forestall.planning.state import State
from forestall.tasks.causes import causes
from forestall.tasks.fault_facts import fault_facts
from forestall.tasks.faults import parse_fault
from forestall.tasks.reasons import because, denied
from forestall.types.facts import Literal
from forestall.types.graph import ObjectNode, Relation, SceneGraph

HOUSEHOLD = shipped("household")

OCCUPIED = {"inside(Bowl-1, Microwave-1)", "not vacant(Microwave-1)"}
FALLEN = {"not held_by(Mug-1, gripper)", "on_top_of(Mug-1, Floor-1)"}
SHUT_AWAY = {
    *("not accessible(Potato-1)", "inside(Potato-1, Cabinet-1)", "open(Cabinet-1)=closed"),
}

EXPECTED = {
    "microwave-occupied": OCCUPIED,
    "knife-blocked": {"blocking(Pot-1, Knife-1)", "not unblocked(Knife-1)"},
    "microwave-left-closed": {"open(Microwave-1)=closed"},
    "mug-dropped": FALLEN,
    "composed-heat-potato-2": SHUT_AWAY,
    "composed-heat-potato-5": {"not located(Plate)", "not located(Plate-1)"},
    "irreversible-heat-potato-2-sink": {"dirty(Plate-1)=dirty"},
    "irreversible-store-egg-1-wine": {"filled(Bowl-1)=wine"},
    "irreversible-make-coffee-4-water": {"filled(Mug-1)=water"},
    "robofail-warm-water-9": {"filled(Mug-1)=empty"},
    "hole-full-of-chips": {"dirt(BoltHole-1)=dirty"},
    "irreversible-fasten-plate-1-thread": {"dirt(Bolt-1)=dirty"},
    "hole-occupied": {"not free(RoundHole-1)", "seated_in(Bolt-1, RoundHole-1)"},
    "tray-full": {
        *("not free(Tray-1)", "lying_on(Nut-1, Tray-1)", "lying_on(Nut-2, Tray-1)"),
    },
}


@pytest.mark.parametrize("scenario", EXPECTED)
def test_the_facts_behind_a_loss_in_both_domains(scenario: str) -> None:
    _, why, _ = lost(scenario)
    assert set(why) == EXPECTED[scenario]


def test_a_switch_that_did_not_take_is_the_cause_and_not_what_stays_cold() -> None:
    _, why, _ = lost("robofail-heat-potato-4")
    assert set(why) == {"open(Microwave-1)=closed"}
    _, why, _ = lost("robofail-water-plant-8")
    assert "toggled(Faucet-1)=off" in why


def test_a_thing_that_a_wrong_plan_needs_is_no_cause() -> None:
    _, why, _ = lost("robofail-make-salad-2")
    assert not any("CounterTop" in text for text in why)
    assert {"inside(PotatoSliced-1, Pan-1)", "not inside(PotatoSliced-1, Bowl-1)"} <= set(why)


def test_what_two_faults_change_is_all_named() -> None:
    _, why, _ = lost("double-heat-potato-2")
    assert {"blocking(Kettle-1, Potato-1)", "inside(Mug-1, Microwave-1)"} <= set(why)


def test_what_somebody_will_put_into_the_hand_fills_it() -> None:
    _, why, _ = lost("double-switch-devices-2")
    assert {"held_by(Plate-1, gripper)", "not hand_empty()", "not unblocked(Laptop-1)"} <= set(why)


def test_an_undisturbed_run_has_no_cause_after_its_end() -> None:
    record, trace, domain = run("glue-peg")
    assert record.success and all(m.reachable and not m.lacking for m in trace.moments)
    assert len(trace.left) == len(trace.moments) + 1
    assert causes(trace, (), domain, len(trace.left)) == ()
    assert causes(trace, (), domain, len(trace.moments)) == ()


def kitchen(*relations: Relation, door: str = "open") -> State:
    nodes = (
        ObjectNode("gripper", "gripper"),
        ObjectNode("Bowl-1", "Bowl"),
        ObjectNode("Mug-1", "Mug"),
        ObjectNode("Fridge-1", "Fridge", (("open", door),)),
        ObjectNode("Microwave-1", "Microwave", (("open", "open"),)),
    )
    return state_of(SceneGraph(nodes, relations), HOUSEHOLD)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("not vacant(Microwave-1)", {"inside(Bowl-1, Microwave-1)"}),
        ("not accessible(Mug-1)", {"inside(Mug-1, Fridge-1)", "open(Fridge-1)=closed"}),
        ("not held_by(Mug-1, gripper)", {"not held_by(Mug-1, gripper)", "inside(Mug-1, Fridge-1)"}),
        ("vacant(Microwave-1)", set()),  # it is not
        ("hand_empty()", set()),  # of all that is not in the hand nothing is said
        ("not located(Potato-1)", {"not located(Potato-1)"}),
    ],
)
def test_definitions_are_followed_down_to_what_is_so(text: str, found: set[str]) -> None:
    scene = kitchen(
        Relation("Bowl-1", "inside", "Microwave-1"),
        Relation("Mug-1", "inside", "Fridge-1"),
        door="closed",
    )
    assert {str(x) for x in because(normal(Literal.parse(text)), scene)} == found


def test_only_what_is_true_or_false_has_an_opposite() -> None:
    assert denied(Literal.parse("vacant(Cup-1)")) == Literal.parse("not vacant(Cup-1)")
    assert denied(Literal.parse("not vacant(Cup-1)")) == Literal.parse("vacant(Cup-1)")
    assert denied(Literal.parse("open(Fridge-1)=open")) is None


@pytest.mark.parametrize(
    ("table", "facts"),
    [
        ({"kind": "add_object", "category": "Bowl", "places": ["Microwave-1"]},
         ["inside(Bowl-1, Microwave-1)"]),
        ({"kind": "add_object", "category": "Bowl", "places": ["CounterTop"]}, []),
        ({"kind": "add_object", "category": "Bowl", "in_front_of": "Mug-1"},
         ["blocking(Bowl, Mug-1)"]),
        ({"kind": "set_state", "object": "Fridge", "attribute": "open", "value": "closed"},
         ["open(Fridge-1)=closed"]),
        ({"kind": "move_object", "object": "Mug", "places": ["Fridge"]},
         ["inside(Mug-1, Fridge-1)"]),
        ({"kind": "remove_object", "object": "Potato-1"}, ["not located(Potato-1)"]),
        ({"kind": "meanwhile", "object": "Mug-1", "place": "Microwave-1"},
         ["inside(Mug-1, Microwave-1)"]),
        ({"kind": "meanwhile", "object": "Mug-1", "attribute": "dirty", "value": "dirty"},
         ["dirty(Mug-1)=dirty"]),
        ({"kind": "drop_step", "step": "pick_up(Mug)"}, []),
    ],
)  # fmt: skip
def test_what_a_fault_makes_so_is_grounded_where_it_holds(
    table: dict[str, object], facts: list[str]
) -> None:
    scene = kitchen(
        Relation("Bowl-1", "inside", "Microwave-1"),
        Relation("Mug-1", "inside", "Fridge-1"),
        door="closed",
    )
    assert [str(x) for x in fault_facts([parse_fault(table)], HOUSEHOLD, [scene])] == facts


def test_a_thing_that_somebody_moves_later_is_told_of_where_it_comes() -> None:
    faults = [
        parse_fault({"kind": "add_object", "category": "Bowl", "places": ["Fridge-1"]}),
        parse_fault({"kind": "meanwhile", "object": "Bowl-1", "place": "Microwave-1"}),
    ]
    found = fault_facts(faults, HOUSEHOLD, [kitchen()])
    assert [str(x) for x in found] == ["inside(Bowl-1, Microwave-1)"]
