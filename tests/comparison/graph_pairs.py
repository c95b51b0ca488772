"""Small scenes, written shortly, and pairs of them with the score computed by hand."""

from __future__ import annotations

from dataclasses import dataclass, field

from forestall.comparison.score import EmptyRule, ScoreConfig
from forestall.types.facts import GRIPPER, category_of
from forestall.types.graph import Box, ObjectNode, Relation, SceneGraph
from forestall.types.plan import Subtask

BOX = Box((0.0, 0.0, 0.0), (0.1, 0.1, 0.1))


def scene(
    things: str, links: str = "", subtask: str | None = None, hidden: tuple[str, ...] = ()
) -> SceneGraph:
    """`things`: "Plate-1 dirty=clean; gripper"; "?" is unobserved, `links`: "A inside B; ..."."""
    nodes = []
    for part in filter(None, (p.strip() for p in things.split(";"))):
        name, *states = part.split()
        pairs = (s.split("=") for s in states)
        nodes.append(
            ObjectNode(
                name,
                GRIPPER if name == GRIPPER else category_of(name),
                tuple((a, None if v == "?" else v) for a, v in pairs),
                centroid_m=BOX.centre,
                box_m=BOX,
            )
        )
    relations = [Relation(*p.split()) for p in links.split(";") if p.strip()]
    return SceneGraph(
        tuple(nodes), tuple(relations), Subtask.parse(subtask) if subtask else None, hidden
    )


@dataclass(frozen=True)
class Pair:
    name: str
    observed: SceneGraph
    expected: SceneGraph
    node: float | None
    edge: float | None
    structure: float | None
    score: float
    config: ScoreConfig = field(default_factory=ScoreConfig)


PUT = "put_in(Plate-1, Microwave-1)"
MEAL = "gripper; Plate-1 dirty=clean broken=intact; Potato-1 cooked=raw; Microwave-1 open=open"
HELD = "Plate-1 held_by gripper; Potato-1 on_top_of Plate-1"
EXPECTED = scene(MEAL, HELD, PUT)
OCCUPIED = scene(MEAL + "; Bowl-1 filled=empty", HELD + "; Bowl-1 inside Microwave-1", PUT)
DIRTY = scene(MEAL.replace("clean", "dirty"), HELD, PUT)
CLOSED = scene(MEAL.replace("open=open", "open=closed"), HELD, PUT)

SPREAD = scene(
    "Plate-1; Potato-1; CounterTop-1; DiningTable-1",
    "Plate-1 on_top_of CounterTop-1; Potato-1 on_top_of DiningTable-1",
)
TOGETHER = scene(
    "Plate-1; Potato-1; CounterTop-2",
    "Plate-1 on_top_of CounterTop-2; Potato-1 on_top_of CounterTop-2",
)

COFFEE = "put_in(Mug-1, CoffeeMachine-1)"
MUG_HELD = scene("gripper; Mug-1; CoffeeMachine-1", "Mug-1 held_by gripper", COFFEE)
MUG_DROPPED = scene("gripper; Mug-1; CoffeeMachine-1; Floor-1", "Mug-1 on_top_of Floor-1", COFFEE)

KNIFE = scene(
    "gripper; Knife-1; CounterTop-1", "Knife-1 on_top_of CounterTop-1", "pick_up(Knife-1)"
)
BLOCKED = scene(
    "gripper; Knife-1; CounterTop-1; Pot-1",
    "Knife-1 on_top_of CounterTop-1; Pot-1 on_top_of CounterTop-1; Pot-1 blocking Knife-1",
    "pick_up(Knife-1)",
)
NOTHING = scene("")

PAIRS = [
    Pair("the same scene", EXPECTED, EXPECTED, 1, 1, 1, 1),
    # 5 of 6 nodes; 2 of 3 edges; the microwave has one edge more, D = 2 (the plate), N = 5
    Pair("bowl in the microwave", OCCUPIED, EXPECTED, 5 / 6, 2 / 3, 0.9, 0.8),
    # the plates do not match and take both edges along: 4 of 6 nodes, 0 of 4 edges
    Pair("dirty plate", DIRTY, EXPECTED, 4 / 6, 0, 1, 5 / 9),
    Pair(
        "dirty plate, states not looked at",
        DIRTY,
        EXPECTED,
        1,
        1,
        1,
        1,
        ScoreConfig(state_changes_match=True, state_weight=0),
    ),
    Pair(
        "dirt not counted", DIRTY, EXPECTED, 1, 1, 1, 1, ScoreConfig(ignored_attributes=("dirty",))
    ),
    # the microwave is an end of no edge: 4 of 6 nodes
    Pair("closed microwave", CLOSED, EXPECTED, 4 / 6, 1, 1, 8 / 9),
    # 4 of 5 nodes; no edge in common; the gripper has one edge less, D = 1, N = 4
    Pair("dropped mug", MUG_DROPPED, MUG_HELD, 4 / 5, 0, 0.75, 1.55 / 3),
    # 4 of 5 nodes; 1 of 3 edges; knife and support have one more each, D = 2, N = 4
    Pair("blocked knife", BLOCKED, KNIFE, 4 / 5, 1 / 3, 0.75, (0.8 + 1 / 3 + 0.75) / 3),
    Pair("on other supports", SPREAD, TOGETHER, 1, 1, 1, 1),
    # 3 of 4 nodes; 1 of 3 edges; the counter has one edge less, D = 2, N = 3
    Pair(
        "on other supports, told apart",
        SPREAD,
        TOGETHER,
        3 / 4,
        1 / 3,
        5 / 6,
        23 / 36,
        ScoreConfig(generic_supports=False),
    ),
    Pair(
        "on other supports, alike but not one",
        SPREAD,
        TOGETHER,
        3 / 4,
        1 / 3,
        5 / 6,
        23 / 36,
        ScoreConfig(merge_supports=False),
    ),
    Pair(
        "a state that could not be seen",
        scene("Mug-1 filled=?"),
        scene("Mug-1 filled=empty"),
        1,
        1,
        1,
        1,
    ),
    # without subtask nodes: 4 of 5 nodes, N = 4
    Pair(
        "bowl in the microwave, no subtask node",
        OCCUPIED,
        EXPECTED,
        4 / 5,
        2 / 3,
        0.875,
        (4 / 5 + 2 / 3 + 0.875) / 3,
        ScoreConfig(subtask_node=False),
    ),
    Pair(
        "bowl in the microwave, edges alone",
        OCCUPIED,
        EXPECTED,
        None,
        2 / 3,
        None,
        2 / 3,
        ScoreConfig(use_node=False, use_structure=False),
    ),
    Pair("nothing, as expected", NOTHING, NOTHING, 1, 1, 1, 1),
    Pair(
        "nothing to compare",
        NOTHING,
        NOTHING,
        None,
        None,
        None,
        1,
        ScoreConfig(empty=EmptyRule.SKIP),
    ),
    Pair("nothing of what was expected", NOTHING, scene("Mug-1"), 0, 1, 0, 1 / 3),
    Pair(
        "another burner",
        scene("StoveBurner-4"),
        scene("StoveBurner-1"),
        0,
        1,
        0,
        1 / 3,
    ),
    Pair(
        "another burner as the same argument",
        scene("StoveBurner-4", "", "toggle_on(StoveBurner-4)"),
        scene("StoveBurner-1", "", "toggle_on(StoveBurner-1)"),
        1,
        1,
        1,
        1,
    ),
]
