from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import permutations

import numpy as np
import pytest

from forestall.domain.load import shipped
from forestall.tasks.goals import TruthGoalChecker, irreversible
from forestall.types.episode import Event
from forestall.types.facts import Literal
from forestall.types.graph import ObjectNode, Relation, SceneGraph
from forestall.types.task import Goal

DOMAIN = shipped("household")


@dataclass
class _Oracle:
    graph: SceneGraph
    gone_bad: frozenset[str] = frozenset()
    told: tuple[Event, ...] = field(default_factory=tuple)

    def truth(self) -> SceneGraph:
        return self.graph

    def states(self, instance: str) -> dict[str, str]:
        node = self.graph.get(instance)
        return {} if node is None else {a: v for a, v in node.states if v is not None}

    def history(self) -> frozenset[Literal]:
        return frozenset(Literal("spoiled", (x,)) for x in self.gone_bad)

    def events(self) -> tuple[Event, ...]:
        return self.told


def _node(name: str, **states: str) -> ObjectNode:
    return ObjectNode(name, name.rpartition("-")[0], tuple(states.items()))


def _goal(
    *literals: str, never: Sequence[str] = (), weak: Sequence[str] = (), **variables: str
) -> Goal:
    return Goal(
        "",
        tuple((f"?{v}", c) for v, c in variables.items()),
        tuple(Literal.parse(x) for x in literals),
        tuple(Literal.parse(x) for x in never),
        tuple(Literal.parse(x) for x in weak),
    )


def _check(
    goal: Goal, graph: SceneGraph, spoiled: Sequence[str] = (), events: Sequence[Event] = ()
) -> tuple[bool, bool | None, tuple[str, ...]]:
    oracle = _Oracle(graph, frozenset(spoiled), tuple(events))
    return TruthGoalChecker(DOMAIN).check(goal, oracle)


MUGS = SceneGraph(
    (
        _node("Mug-1", filled="coffee", dirty="dirty"),
        _node("Mug-2", filled="coffee", dirty="clean"),
        _node("CounterTop-1"),
        _node("DiningTable-1"),
    ),
    (
        Relation("Mug-1", "on_top_of", "CounterTop-1"),
        Relation("Mug-2", "on_top_of", "DiningTable-1"),
    ),
)


def test_one_binding_must_fit_all_literals() -> None:
    goal = _goal("filled(?m)=coffee", "dirty(?m)=clean", m="Mug")
    assert _check(goal, MUGS) == (True, None, ())
    goal = _goal("filled(?m)=coffee", "dirty(?m)=clean", "on_top_of(?m, CounterTop)", m="Mug")
    strict, _, failures = _check(goal, MUGS)
    assert not strict
    assert failures == ("dirty(Mug-1)=clean does not hold in the end: it is dirty",)


def test_the_weaker_check_stands_beside() -> None:
    goal = _goal("on_top_of(?m, CounterTop)", "dirty(?m)=clean", weak=["dirty(?m)=clean"], m="Mug")
    assert _check(goal, MUGS)[:2] == (False, True)
    goal = _goal("dirty(?m)=clean", weak=["inside(?m, CounterTop)"], m="Mug")
    assert _check(goal, MUGS)[:2] == (True, False)


def test_what_was_spoiled_does_not_count_and_the_reason_is_told() -> None:
    goal = _goal("filled(?m)=coffee", never=["spoiled(?m)"], m="Mug")
    assert _check(goal, MUGS, ["Mug-1"])[0]
    events = [Event(1.0, "spoiled", ("Mug-2",), "brewed into dirt")]
    strict, _, failures = _check(
        _goal("on_top_of(?m, DiningTable)", never=["spoiled(?m)"], m="Mug"),
        MUGS,
        ["Mug-2"],
        events,
    )
    assert not strict
    assert failures == ("spoiled(Mug-2) must never be: brewed into dirt",)


def test_a_category_in_never_means_any_instance_even_one_that_is_gone() -> None:
    goal = _goal("dirty(?m)=clean", never=["spoiled(Egg)"], m="Mug")
    assert _check(goal, MUGS)[0]
    assert not _check(goal, MUGS, ["Egg-1"])[0]


def test_never_looks_into_the_history() -> None:
    goal = _goal("dirty(?m)=clean", never=["broken(Plate)=broken", "inside(?m, Fridge)"], m="Mug")
    assert _check(goal, MUGS)[0]
    broke = Event(2.0, "state", ("Plate-3",), "broken(Plate-3)=broken")
    was_in = Event(2.0, "relation", ("Mug-2", "Fridge-1"), "inside(Mug-2, Fridge-1)")
    other = Event(2.0, "relation", ("Mug-1", "Fridge-1"), "inside(Mug-1, Fridge-1)")
    words = Event(2.0, "dropped", ("Mug-2",), "inside(Mug-2, Fridge-1)")
    assert not _check(goal, MUGS, (), [broke])[0]
    assert not _check(goal, MUGS, (), [was_in])[0]
    assert _check(goal, MUGS, (), [other, words])[0]


def test_never_looks_at_the_end_state() -> None:
    goal = _goal("filled(?m)=coffee", never=["dirty(?m)=dirty"], m="Mug")
    assert _check(goal, MUGS)[0]  # Mug-2
    goal = _goal("on_top_of(?m, CounterTop)", never=["dirty(?m)=dirty"], m="Mug")
    assert not _check(goal, MUGS)[0]


@pytest.mark.parametrize(
    ("literal", "holds"),
    [
        ("not on_top_of(Mug, CounterTop)", False),
        ("not inside(Mug, CounterTop)", True),
        ("hand_empty()", True),
        ("vacant(CounterTop-1)", False),
        ("not spoiled(Mug)", True),
    ],
)
def test_negative_and_derived_literals(literal: str, holds: bool) -> None:
    assert _check(_goal(literal), MUGS)[0] is holds


def test_two_variables_of_one_category_are_two_things() -> None:
    goal = _goal("filled(?a)=coffee", "filled(?b)=coffee", a="Mug", b="Mug")
    assert _check(goal, MUGS)[0]
    one = SceneGraph((_node("Mug-1", filled="coffee"),))
    assert _check(goal, one)[2] == ("no binding of the goal's variables is possible",)


def test_a_category_that_is_not_there_is_named() -> None:
    strict, _, failures = _check(_goal("cooked(?e)=cooked", e="EggCracked"), MUGS)
    assert not strict
    assert failures[0] == "there is no EggCracked"


def test_a_variable_that_only_the_weak_check_uses_does_not_matter_to_the_strict_one() -> None:
    goal = _goal("dirty(?m)=clean", weak=["open(?f)=closed"], m="Mug", f="Fridge")
    assert _check(goal, MUGS)[:2] == (True, False)


# what cannot be undone


def _harm(
    goal: Goal, graph: SceneGraph, spoiled: Sequence[str] = (), events: Sequence[Event] = ()
) -> tuple[tuple[float, str], ...]:
    return irreversible(goal, _Oracle(graph, frozenset(spoiled), tuple(events)), DOMAIN)


def test_nothing_irreversible_has_happened() -> None:
    goal = _goal("filled(?m)=coffee", never=["spoiled(?m)", "broken(Mug)=broken"], m="Mug")
    assert _harm(goal, MUGS) == ()
    assert _harm(goal, MUGS, ["Egg-1"], [Event(1.0, "spoiled", ("Egg-1",), "it fell")]) == ()


def test_a_variable_means_any_instance_of_its_category() -> None:
    goal = _goal("filled(?m)=coffee", never=["spoiled(?m)"], m="Mug")
    events = [
        Event(3.0, "spoiled", ("Egg-1",), "another thing"),
        Event(5.0, "spoiled", ("Mug-2",), "brewed into dirt"),
        Event(9.0, "spoiled", ("Mug-1",), "brewed over an egg"),
    ]
    gone = ["Mug-1", "Mug-2", "Egg-1"]
    assert _harm(goal, MUGS, gone, events) == ((5.0, "brewed into dirt"),)


def test_harm_comes_in_the_order_of_time_with_its_first_event() -> None:
    goal = _goal(
        "dirty(?m)=clean",
        never=["spoiled(Egg)", "broken(Plate)=broken", "inside(?m, Fridge)"],
        m="Mug",
    )
    events = [
        Event(2.0, "relation", ("Mug-2", "Fridge-1"), "inside(Mug-2, Fridge-1)"),
        Event(1.0, "state", ("Plate-3",), "broken(Plate-3)=broken"),
        Event(4.0, "relation", ("Mug-2", "Fridge-1"), "inside(Mug-2, Fridge-1)"),
        Event(3.0, "spoiled", ("Egg-1",), "Egg-1 broke"),
    ]
    assert _harm(goal, MUGS, ["Egg-1"], events) == (
        (1.0, "broken(Plate-3)=broken"),
        (2.0, "inside(Mug-2, Fridge-1)"),
        (3.0, "Egg-1 broke"),
    )


def test_what_was_made_is_so_from_the_moment_when_it_was_made() -> None:
    graph = SceneGraph((_node("AppleSliced-1", sliced="sliced"),))
    goal = _goal("dirty(Mug)=clean", never=["sliced(AppleSliced)=sliced"])
    events = [
        Event(1.0, "relation", ("Apple-1", "CounterTop-1"), "on_top_of(Apple-1, CounterTop-1)"),
        Event(6.0, "sliced", ("Apple-1", "AppleSliced-1"), "Apple-1 was sliced"),
    ]
    assert _harm(goal, graph, (), events) == ((6.0, "Apple-1 was sliced"),)
    at_the_start = ((0.0, "sliced(AppleSliced)=sliced from the start"),)
    assert _harm(goal, graph) == at_the_start


@pytest.mark.parametrize("seed", range(30))
def test_the_nearest_binding_is_that_of_trying_them_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mugs = [
        _node(f"Mug-{k}", filled=str(rng.choice(["empty", "coffee"])), dirty="clean")
        for k in range(1, 4)
    ]
    places = (_node("CounterTop-1"), _node("DiningTable-1"))
    lie = tuple(
        Relation(m.id, "on_top_of", str(rng.choice(["CounterTop-1", "DiningTable-1"])))
        for m in mugs
    )
    graph = SceneGraph((*mugs, *places), lie)
    goal = _goal(
        *("filled(?a)=coffee", "on_top_of(?a, ?t)", "filled(?b)=empty", "on_top_of(?b, ?t)"),
        never=["dirty(?b)=dirty", "spoiled(?a)"],
        a="Mug",
        b="Mug",
        t="DiningTable",
    )
    spoiled = ["Mug-1"] if seed % 2 else []
    counts = [
        len(_check(_goal(*(str(x.bind({"?a": a.id, "?b": b.id, "?t": "DiningTable-1"}))
                           for x in goal.literals),
                         never=["dirty(Mug)=dirty", f"spoiled({a.id})"]), graph, spoiled)[2])
        for a, b in permutations(mugs, 2)
    ]  # fmt: skip
    assert len(_check(goal, graph, spoiled)[2]) == min(counts)


def test_many_variables_of_one_category_are_bound_one_after_the_other() -> None:
    mugs = tuple(_node(f"Mug-{k}", filled="coffee" if k > 8 else "empty") for k in range(1, 17))
    names = [f"m{k}" for k in range(8)]
    goal = _goal(*(f"filled(?{n})=coffee" for n in names), **dict.fromkeys(names, "Mug"))
    assert _check(goal, SceneGraph(mugs, ()))[0]
