"""Looking for what nobody has seen: which places, which plan, and how a run goes on."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from forestall import Goal, Literal, Monitor, Plan, Subtask
from forestall.domain.load import shipped
from forestall.domain.looked import looked_into, looked_over, not_there
from forestall.planning.validate import GraphValidator
from forestall.replanning.hidden import hiding_places, sought
from forestall.replanning.searching import with_shutting, without
from forestall.replanning.symbolic import PlannerReplanner
from forestall.types.graph import SceneGraph
from forestall.types.symbolic import scene_graph
from forestall.types.verdict import Diagnosis, Reference, Replan
from planning import episodes
from planning.corpus import PLANS, home_of
from planning.corpus import scene as stated
from planning.playing import begun, played

DOMAIN = shipped("household")
PLAN = Plan.parse(["pick_up(Egg)", "put_on(Egg, CounterTop)"])
SHUT = ("Fridge-1", "Cabinet-1", "Microwave-1")


def box(x: float) -> list[list[float]]:
    return [[x, 0, 0], [x + 0.5, 0.5, 0.9]]


class Kitchen:
    """Closed things in a row; the egg is in one of them."""

    def __init__(self, egg_in: str) -> None:
        self.egg_in: str | None = egg_in
        self.open: dict[str, bool] = dict.fromkeys(SHUT, False)
        self.opened: list[str] = []
        self.place = egg_in

    def look(self) -> dict[str, Any]:
        shown = self.egg_in is None or self.open.get(self.egg_in, True)
        objects: dict[str, Any] = {
            name: {"open": "open" if self.open[name] else "closed", "box": box(k)}
            for k, name in enumerate(SHUT)
        }
        objects["Microwave-1"]["toggled"] = "off"
        objects["CounterTop-1"] = {"box": box(4)}
        relations: list[Any] = []
        if shown:
            objects["Egg-1"] = {"box": [[0.1, 0.1, 0.1], [0.2, 0.2, 0.2]]}
            where = ("inside", self.egg_in) if self.egg_in in SHUT else ("on_top_of", self.egg_in)
            relations = [["Egg-1", *(("held_by", "gripper") if self.egg_in is None else where)]]
        hidden = [n for n in SHUT if not self.open[n]]
        return {"objects": objects, "relations": relations, "hidden": hidden}

    def do(self, step: Subtask) -> str:
        if step.skill == "open_obj":
            self.open[step.args[0]] = True
            self.opened.append(step.args[0])
        elif step.skill == "close_obj":
            self.open[step.args[0]] = False
        elif step.skill == "pick_up":
            self.egg_in = None
        elif step.skill == "put_on":
            self.egg_in = step.args[1]
        return "done"


def graph(*names: str) -> SceneGraph:
    return scene_graph({"objects": {name: {"open": "closed"} for name in names}})


def test_only_what_is_shut_and_takes_it_is_looked_into() -> None:
    scene = scene_graph(
        {
            "objects": {
                "Fridge-1": {"open": "closed"},
                "Fridge-2": {"open": "open"},
                "Toaster-1": {},
                "Cabinet-1": {"open": "closed"},
                "CounterTop-1": {},
            }
        }
    )
    places = hiding_places("Egg", scene, DOMAIN, ())
    assert set(places) <= {"Fridge-1", "Cabinet-1"} and "Fridge-1" in places


def test_where_demonstrations_had_it_comes_first() -> None:
    scene = graph("Fridge-1", "Microwave-1", "Cabinet-1")
    usual = hiding_places("Plate", scene, DOMAIN, ())
    last = usual[-1]
    shown = scene_graph({"objects": ["Plate-1", last], "relations": [["Plate-1", "inside", last]]})
    reference = Reference("d", "t", 0, Subtask.parse("pick_up(Plate-1)"), 1.0, shown)
    assert hiding_places("Plate", scene, DOMAIN, [reference])[0] == last


def test_of_places_as_likely_the_near_one_comes_first() -> None:
    scene = scene_graph(
        {
            "objects": {
                "Cabinet-1": {"open": "closed", "box": box(6)},
                "Cabinet-2": {"open": "closed", "box": box(1)},
                "Fridge-1": {"open": "closed", "box": box(9)},
            }
        }
    )
    assert hiding_places("Mug", scene, DOMAIN, (), (0, 0)) == ["Cabinet-2", "Cabinet-1", "Fridge-1"]
    assert hiding_places("Mug", scene, DOMAIN, (), (9, 0))[0] == "Fridge-1"


def unseen_on(told: dict[str, Any], areas_m2: dict[str, float]) -> SceneGraph:
    """A scene of which views have not shown so much of some places."""
    scene = scene_graph(told)
    nodes = [replace(n, unseen_m2=areas_m2.get(n.id, 0.0)) for n in scene.nodes]
    return replace(scene, nodes=tuple(nodes))


def test_of_what_is_open_that_counts_which_no_view_has_shown() -> None:
    told = {
        "objects": {
            "Cabinet-1": {"open": "closed", "box": box(3)},
            "CounterTop-1": {"box": box(3)},
            "CounterTop-2": {"box": box(3)},
            "CounterTop-3": {"box": box(3)},
            "StoveBurner-1": {"box": box(3)},
            "Floor-1": {"box": box(3)},
        }
    }
    assert hiding_places("Mug", scene_graph(told), DOMAIN, (), (0, 0)) == ["Cabinet-1"]
    areas = {"CounterTop-1": 0.05, "CounterTop-3": 0.1, "StoveBurner-1": 0.2, "Floor-1": 0.2}
    scene = unseen_on(told, areas)
    where = hiding_places("Mug", scene, DOMAIN, (), (0, 0))
    assert where == ["Cabinet-1", "CounterTop-3", "CounterTop-1"]


def test_what_a_plan_takes_from_the_open_is_looked_for_there_first() -> None:
    told = {
        "objects": {
            "Cabinet-1": {"open": "closed", "box": box(3)},
            "Fridge-1": {"open": "closed", "box": box(3)},
            "CounterTop-1": {"box": box(3)},
        }
    }
    scene = unseen_on(told, {"CounterTop-1": 0.1})
    plain = Plan.parse(["navigate_to_obj(Egg)", "pick_up(Egg)"])
    opening = Plan.parse(["open_obj(Fridge)", "navigate_to_obj(Egg)", "pick_up(Egg)"])
    for plan, first in ((None, "Fridge-1"), (plain, "CounterTop-1"), (opening, "Fridge-1")):
        assert hiding_places("Egg", scene, DOMAIN, (), (0, 0), plan)[0] == first


def test_what_is_looked_over_is_where_the_last_step_was_done() -> None:
    told = {
        "objects": {"Egg-1": {}, "Plate-1": {}, "CounterTop-1": {}, "CounterTop-2": {}},
        "relations": [["Egg-1", "on_top_of", "Plate-1"], ["Plate-1", "on_top_of", "CounterTop-1"]],
    }
    over = looked_over(scene_graph(told), Subtask.parse("pick_up(Egg-1)"), DOMAIN)
    assert over == {"Egg-1", "Plate-1", "CounterTop-1"}
    put = Subtask.parse("put_on(Plate-1, CounterTop)")
    assert looked_over(scene_graph(told), put, DOMAIN) == {"Plate-1", "CounterTop-1"}
    drive = Subtask.parse("navigate_to_obj(CounterTop)")
    assert looked_over(scene_graph(told), drive, DOMAIN) == frozenset(), "of two nobody knows which"
    shut = scene_graph({**told, "hidden": ["CounterTop-1"]})
    assert looked_over(shut, Subtask.parse("navigate_to_obj(CounterTop-1)"), DOMAIN) == frozenset()


def test_what_holds_many_things_comes_before_what_holds_one() -> None:
    assert hiding_places("Mug", graph("Microwave-1", "Cabinet-1"), DOMAIN, ())[0] == "Cabinet-1"


def test_a_place_that_must_not_stay_open_is_shut_once_the_thing_is_out_of_it() -> None:
    opening = Plan.parse(["navigate_to_obj(Fridge-1)", "open_obj(Fridge-1)"]).subtasks
    shutting = Plan.parse(["navigate_to_obj(Fridge-1)", "close_obj(Fridge-1)"]).subtasks

    def rest(*texts: str) -> list[str]:
        left = Plan.parse(texts).subtasks
        return [str(s) for s in with_shutting(left, opening, shutting, "Egg", DOMAIN)]

    assert rest("navigate_to_obj(Egg)", "pick_up(Egg)", "put_on(Egg, CounterTop)") == [
        "navigate_to_obj(Egg)", "pick_up(Egg)", "close_obj(Fridge-1)", "put_on(Egg, CounterTop)"
    ]  # fmt: skip
    shut_anyway = ("pick_up(Egg)", "close_obj(Fridge)")
    assert rest(*shut_anyway) == list(shut_anyway)
    opened_again = ("pick_up(Egg)", "open_obj(Fridge)", "close_obj(Fridge)")
    assert rest(*opened_again) == [opened_again[0], "close_obj(Fridge-1)", *opened_again[1:]]
    own_way = ("open_obj(Fridge)", "pick_up(Egg)", "put_in(Egg, Fridge)", "close_obj(Fridge)")
    assert rest(*own_way) == list(own_way), "shut in between, nothing could be put in"
    assert rest("crack_obj(Egg)")[1:] == [str(s) for s in shutting]


def test_what_was_shut_early_is_not_shut_again() -> None:
    shutting = Plan.parse(["navigate_to_obj(Fridge-1)", "close_obj(Fridge-1)"]).subtasks

    def rest(*texts: str) -> list[str]:
        return [str(s) for s in without(Plan.parse(texts).subtasks, shutting, DOMAIN)]

    late = ("pick_up(Egg)", "navigate_to_obj(Fridge)", "close_obj(Fridge)", "navigate_to_obj(Egg)")
    assert rest(*late) == ["pick_up(Egg)", "navigate_to_obj(Egg)"]
    needed = ("open_obj(Fridge)", "close_obj(Fridge)")
    assert rest(*needed) == list(needed)


def test_what_is_in_sight_is_not_looked_for() -> None:
    wanted = (Literal.parse("located(Egg)"), Literal.parse("open(Fridge-1)=open"))
    assert sought(wanted, graph("Fridge-1")) == ("Egg",)
    assert sought(wanted, graph("Fridge-1", "Egg-3")) == ()


def test_what_can_be_made_is_made_before_it_is_looked_for() -> None:
    """A cut that came to nothing: the bread lies there whole, and no slice is anywhere."""
    shut = "Cabinet-1 hidden, Drawer-1 hidden, Knife-1 held"
    whole = stated(home_of("toast-bread"), shut)
    wanted = Diagnosis("no slice", (Literal.parse("located(BreadSliced)"),))
    replanner = PlannerReplanner(GraphValidator(DOMAIN), DOMAIN)

    def answer(seen: SceneGraph) -> Replan:
        at = PLANS["toast-bread"].texts().index("put_on(Knife, CounterTop)")
        return replanner.replan(
            episodes.context("toast-bread", PLANS["toast-bread"], at, seen), wanted
        )

    made = answer(whole)
    assert made.looking_for == () and made.plan is not None
    assert "slice_obj(Bread-1)" in made.plan.texts()
    nowhere = replace(
        whole,
        nodes=tuple(n for n in whole.nodes if n.category != "Bread"),
        relations=tuple(r for r in whole.relations if not r.subject.startswith("Bread-")),
    )
    assert set(answer(nowhere).looking_for) == {"BreadSliced", "Bread"}, "it may have been cut"


def play(kitchen: Kitchen) -> Monitor:
    goal = Goal("the egg is out", (), (Literal.parse("on_top_of(Egg, CounterTop)"),))
    return played(begun(goal, PLAN, "pick_up(Egg-1)", "Egg-1"), kitchen)


def test_it_is_found_wherever_it_is() -> None:
    for place in SHUT:
        if not DOMAIN.accepts(place, "Egg"):
            continue
        kitchen = Kitchen(place)
        monitor = play(kitchen)
        assert kitchen.egg_in == "CounterTop", (place, kitchen.opened)
        assert monitor.finished
        assert kitchen.opened[-1] == place and len(set(kitchen.opened)) == len(kitchen.opened)
        assert not kitchen.open["Fridge-1"], "no fridge is left open"


def test_not_found_after_all_is_a_stated_end() -> None:
    kitchen = Kitchen("nowhere")
    kitchen.open["nowhere"] = False
    monitor = play(kitchen)
    assert not monitor.finished
    accepting = {p for p in SHUT if DOMAIN.accepts(p, "Egg")}
    assert set(kitchen.opened) == accepting and len(kitchen.opened) == len(accepting)
    assert not kitchen.open["Fridge-1"]


def test_where_the_goal_holds_already_nothing_is_done() -> None:
    kitchen = Kitchen("CounterTop-1")
    monitor = play(kitchen)
    assert monitor.finished and kitchen.opened == []
    assert monitor.executed == () and len(monitor.plan) == 0


def test_after_all_places_it_says_where_it_looked() -> None:
    kitchen = Kitchen("nowhere")
    kitchen.open = {"nowhere": False, **dict.fromkeys(SHUT, True)}
    shown = kitchen.look()
    wanted = (Literal.parse("located(Egg)"),)
    seen = scene_graph({"objects": shown["objects"]})
    looked = looked_into(seen, DOMAIN)
    assert looked == set(SHUT)
    context = episodes.context("store-egg", PLANS["store-egg"], 0, seen)
    replanner = PlannerReplanner(GraphValidator(DOMAIN), DOMAIN)
    facts = not_there("Egg", looked, DOMAIN)
    answer = replanner.replan(context, Diagnosis("a cause", wanted, facts))
    assert answer.plan is None
    assert "Egg was looked for in Cabinet-1, Fridge-1, Microwave-1 and is not there" in answer.note


def test_where_something_may_stand_behind_a_thing_it_is_gone_to_and_nothing_opened() -> None:
    scene = unseen_on(Kitchen("Fridge-1").look(), {"CounterTop-1": 0.1})
    wanted = Diagnosis("a cause", (Literal.parse("located(Egg)"),))
    context = episodes.context("store-egg", PLANS["store-egg"], 0, scene)
    replanner = PlannerReplanner(GraphValidator(DOMAIN), DOMAIN)
    places: list[str] = []
    while (answer := replanner.replan(context, wanted)).plan is not None:
        places.append(answer.note.removeprefix("looking for Egg in "))
        assert answer.looking_for == ("Egg",)
        first, *rest = answer.plan.subtasks
        if places[-1] == "CounterTop-1":
            assert str(first) == "navigate_to_obj(CounterTop-1)"
            assert tuple(rest) == context.remaining()
        wanted = replace(wanted, must_stay=not_there("Egg", places, DOMAIN))
    assert "CounterTop-1" in places and len(set(places)) == len(places) > 1
