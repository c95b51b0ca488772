"""Needs of the rest of a plan: what it puts right is no alarm, what it never does is early."""

from __future__ import annotations

from dataclasses import replace

from forestall.comparison.lacking import Knowledge
from forestall.comparison.needs import Needs
from forestall.comparison.preconditions import mine, violations
from forestall.detection.preconditions import PreconditionDetector
from forestall.diagnosis.symbolic import SymbolicReasoner
from forestall.domain.load import shipped
from forestall.planning.ahead import Foresight, foresee
from forestall.strategies.intervention import rest_of
from forestall.types.demonstration import Demonstration, DemonstrationStep
from forestall.types.facts import Literal
from forestall.types.graph import ObjectNode, Relation, SceneGraph
from forestall.types.plan import Plan
from forestall.types.runtime import BoundaryContext
from forestall.types.scene import SceneNeeds
from forestall.types.task import Goal, Task
from forestall.types.verdict import Decision, Verdict

BENCH = shipped("bench")
SHORT = Plan.parse(["pick(Bolt-1)", "insert(Bolt-1, BoltHole-1)"])
CLEANS = Plan.parse(
    [
        "pick(Cloth-1)",
        "clean(BoltHole-1)",
        "place(Cloth-1, Workbench-1)",
        "pick(Bolt-1)",
        "insert(Bolt-1, BoltHole-1)",
    ]
)
DIRTY_HOLE = Literal.parse("dirt(BoltHole-1)=clean")


def scene(hole: str = "clean", bolt: str = "clean", held: bool = False) -> SceneGraph:
    nodes = [
        ObjectNode("gripper", "gripper"),
        ObjectNode("Jaws-1", "Jaws"),
        ObjectNode("Arm-1", "Arm"),
        ObjectNode("Workbench-1", "Workbench", (("dirt", "clean"),)),
        ObjectNode("Cloth-1", "Cloth"),
        ObjectNode("Bolt-1", "Bolt", (("dirt", bolt), ("glue", "dry"))),
        ObjectNode("BoltHole-1", "BoltHole", (("dirt", hole),)),
    ]
    at = ("gripped_by", "gripper") if held else ("lying_on", "Workbench-1")
    relations = (
        Relation("Jaws-1", "mounted_on", "Arm-1"),
        Relation("Cloth-1", "lying_on", "Workbench-1"),
        Relation("Bolt-1", *at),
    )
    return SceneGraph(tuple(nodes), relations)


def demonstration(name: str) -> Demonstration:
    graphs = (scene(), scene(held=True))
    steps = [
        DemonstrationStep(i, step, replace(g, subtask=step), g)
        for i, (step, g) in enumerate(zip(SHORT, graphs, strict=True))
    ]
    return Demonstration("other", "room", 1, tuple(steps), id=name)


COUNTS = Needs.of([demonstration(f"d{i}") for i in range(4)], BENCH)
KNOWLEDGE = Knowledge(lambda: COUNTS, foresee)
DETECTOR = PreconditionDetector(BENCH, knowledge=KNOWLEDGE)


def context(plan: Plan, graph: SceneGraph, index: int = 0) -> BoundaryContext:
    task = Task("new", "new", Goal(""), plan, SceneNeeds())
    step = plan.subtasks[index]
    return BoundaryContext(
        task, plan, index, index, step, graph, replace(graph, subtask=step), None
    )


def judge(plan: Plan, graph: SceneGraph, index: int = 0) -> Verdict:
    here = context(plan, graph, index)
    return DETECTOR.judge(here.scoped, None, (), here)


def test_a_task_of_which_there_is_no_reference_is_judged() -> None:
    verdict = judge(SHORT, scene())
    assert verdict.judged and verdict.decision is Decision.PROCEED


def test_what_no_step_puts_right_is_an_alarm_before_the_first_step() -> None:
    verdict = judge(SHORT, scene(hole="dirty"))
    assert verdict.decision is Decision.REPLAN
    assert verdict.lacking == (DIRTY_HOLE,)
    assert "before insert, 1 steps ahead" in verdict.note


def test_what_a_step_puts_right_before_it_matters_is_none() -> None:
    assert judge(CLEANS, scene(hole="dirty")).decision is Decision.PROCEED


def test_before_the_step_itself_it_is_an_alarm_wherever_it_is_cleaned_later() -> None:
    late = Plan.parse(["insert(Bolt-1, BoltHole-1)", *CLEANS.texts()[:2]])
    assert judge(late, scene(hole="dirty", held=True)).decision is Decision.REPLAN


def test_after_a_step_whose_skill_nobody_knows_the_next_is_judged() -> None:
    plan = Plan.parse(["hum(Bolt-1)", "insert(Bolt-1, BoltHole-1)"])
    assert judge(plan, scene(held=True), index=1).decision is Decision.PROCEED
    assert judge(plan, scene(hole="dirty", held=True), index=1).decision is Decision.REPLAN
    assert rest_of(context(plan, scene(held=True), 1), BENCH).texts() == plan.texts()[1:]


def test_the_reasoner_names_what_a_later_step_lacks() -> None:
    reasoner = SymbolicReasoner(mine, violations, BENCH, knowledge=KNOWLEDGE)
    here = context(SHORT, scene(hole="dirty"))
    found = reasoner.diagnose(here, judge(SHORT, scene(hole="dirty")))
    assert found.must_change == (DIRTY_HOLE,)
    assert found.cause == "BoltHole-1 is dirty; it was clean in all 4 demonstrations"
    again = reasoner.diagnose(context(CLEANS, scene(hole="dirty")), judge(CLEANS, scene()))
    assert again.must_change == ()


def test_what_a_plan_makes_of_a_fault() -> None:
    washed = Plan.parse(["pick(Cloth-1)", "clean(Bolt-1)", "place(Cloth-1, Workbench-1)"])
    clean = Literal.parse("dirt(Bolt-1)=clean")
    ahead = Foresight(scene(bolt="dirty"), washed, 0, BENCH)
    assert [str(s) for s in ahead.steps] == washed.texts()
    assert not ahead.holds(0, clean) and ahead.holds(2, clean)
    assert ahead.mends(0, clean) and ahead.undoable(0, clean)
    left = Foresight(scene(bolt="dirty"), Plan(washed.subtasks[:1]), 0, BENCH)
    assert not left.mends(0, clean)


def test_a_stripped_thread_cannot_be_undone() -> None:
    nodes = (*scene().nodes, ObjectNode("Nut-1", "Nut", (("dirt", "clean"), ("torque", "loose"))))
    seated = (
        Relation("Jaws-1", "mounted_on", "Arm-1"),
        Relation("Bolt-1", "seated_in", "BoltHole-1"),
        Relation("Nut-1", "gripped_by", "gripper"),
    )
    dirty = tuple(replace(n, states=(("dirt", "dirty"),)) if n.id == "Bolt-1" else n for n in nodes)
    ahead = Foresight(SceneGraph(dirty, seated), Plan.parse(["screw(Nut-1, Bolt-1)"]), 0, BENCH)
    assert not ahead.undoable(0, Literal.parse("dirt(Bolt-1)=clean"))
