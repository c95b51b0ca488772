"""What several hands hold, each by its own name."""

from __future__ import annotations

from dataclasses import replace

from graph_pairs import scene

from forestall.comparison.lifting import Kind, evaluate, kind_of, lift
from forestall.comparison.preconditions import mine, violations
from forestall.domain.load import shipped
from forestall.perception.config import ScopeConfig
from forestall.perception.scope import scope
from forestall.types.facts import Literal, Truth
from forestall.types.graph import SceneGraph
from forestall.types.verdict import Reference

ONE = shipped("household")
TWO = replace(ONE, robot=replace(ONE.robot, hands=("left", "right")))
HELD = Literal("held_by", ("?object", "left"))


def put_plate(*held: str) -> SceneGraph:
    return scene(
        "left; right; Apple-1; Plate-1; Microwave-1 open=open",
        "; ".join(held),
        "put_in(Plate-1, Microwave-1)",
    )


def told(graph: SceneGraph) -> set[str]:
    assert graph.subtask is not None
    return {str(x) for x in lift(graph, graph.subtask, TWO) if x.predicate == "held_by"}


def test_each_hand_is_told() -> None:
    left = put_plate("Plate-1 held_by left", "Apple-1 held_by right")
    said = {"held_by(?object, left)", "not held_by(?object, right)", "held_by(Apple, right)"}
    assert told(left) == said
    assert left.subtask is not None
    assert evaluate(HELD, left, left.subtask, TWO) is Truth.TRUE
    on_top = Literal("inside", ("?object", "?target"), "false")
    assert evaluate(on_top, left, left.subtask, TWO) is Truth.TRUE, "it is in a hand"
    assert kind_of(HELD, TWO) is Kind.SKILL
    assert kind_of(Literal("held_by", ("Apple", "right")), TWO) is Kind.CONTEXT


def test_what_one_hand_always_held_is_missed_in_it() -> None:
    good = [put_plate("Plate-1 held_by left") for _ in range(4)]
    task = good[0].subtask
    assert task is not None
    references = [Reference(f"d-{i}", "heat", 3, task, 1.0, g) for i, g in enumerate(good)]
    mined = mine(references, TWO, subtask=task)
    for other in (put_plate(), put_plate("Apple-1 held_by left")):
        broken = {str(v.literal) for v in violations(mined, other, task, TWO)}
        assert "held_by(Plate-1, left)" in broken
    assert not {v.literal for v in violations(mined, good[0], task, TWO)}


def test_what_is_in_any_hand_belongs_to_the_subtask() -> None:
    graph = put_plate("Apple-1 held_by right")
    assert graph.subtask is not None
    kept = scope(graph, graph.subtask, TWO, ScopeConfig())
    assert {"left", "right", "Apple-1"} <= {n.id for n in kept.nodes}
    assert "Apple-1" not in {n.id for n in scope(graph, graph.subtask, ONE, ScopeConfig()).nodes}
