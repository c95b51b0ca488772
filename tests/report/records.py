"""Synthetic runs with every kind of boundary, made without a simulator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from forestall.seams import Listener
from forestall.types.decision import Outcome
from forestall.types.episode import (
    BoundaryRecord,
    EpisodeEnd,
    EpisodeRecord,
    Event,
    ExecutedRecord,
    SkillOutcome,
    SkillStatus,
)
from forestall.types.facts import Literal
from forestall.types.graph import Relation, SceneGraph
from forestall.types.observation import Frame, GripperState, Intrinsics, Observation
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext, When
from forestall.types.scene import SceneNeeds
from forestall.types.task import Goal, Task
from forestall.types.verdict import (
    Calibration,
    Change,
    Decision,
    Diagnosis,
    Discrepancy,
    PlanCheck,
    Reference,
    Replan,
    ReplanOutcome,
    ScoreParts,
    Verdict,
)

from .graphs import MATCHES, expected_graph, node, observed_graph

NOMINAL = (
    "navigate_to_obj(Potato)",
    "pick_up(Potato)",
    "put_on(Potato, Plate)",
    "pick_up(Plate)",
    "navigate_to_obj(Microwave)",
    "put_on(Plate, CounterTop)",
    "open_obj(Microwave)",
    "pick_up(Plate)",
    "put_in(Plate, Microwave)",
    "close_obj(Microwave)",
    "toggle_on(Microwave)",
)
INSERTED = ("pick_up(Bowl-1)", "put_on(Bowl-1, CounterTop-2)")
ALARM_INDEX = 7
CAUSE = "Bowl-1 stands inside Microwave-1, which takes one thing only"
SENTENCE = "There is a bowl inside the microwave, so I cannot put the plate into it."


def task() -> Task:
    return Task(
        name="heat-potato",
        title="Heat a potato on a clean plate in the microwave",
        goal=Goal(
            text="a cooked potato on a clean plate in the microwave, and nothing else in there",
            variables=(("?potato", "Potato"), ("?plate", "Plate")),
            literals=(
                Literal.parse("cooked(?potato)=cooked"),
                Literal.parse("on_top_of(?potato, ?plate)"),
                Literal.parse("inside(?plate, Microwave)"),
            ),
            never=(Literal.parse("spoiled(?potato)"),),
            weak=(Literal.parse("cooked(?potato)=cooked"),),
        ),
        plan=Plan.parse(NOMINAL),
        scene=SceneNeeds("kitchen"),
        domain="household",
    )


def frame(seed: int, width: int = 64, height: int = 48, noise: bool = True) -> Frame:
    rng = np.random.default_rng(seed)
    if noise:
        rgb = rng.integers(0, 256, (height, width, 3), dtype=np.uint8)
    else:
        y, x = np.mgrid[0:height, 0:width]
        rgb = np.stack(
            [120 + 100 * x / width, 150 + 60 * y / height, 140 + 40 * np.sin(x / 37 + seed)], -1
        ).astype(np.uint8)
        a, b = int(rng.integers(0, width // 2)), int(rng.integers(0, height // 2))
        rgb[b : b + height // 3, a : a + width // 4] = rng.integers(40, 240, 3)
    return Frame(
        rgb,
        np.ones((height, width), np.float32),
        Intrinsics.from_vertical_fov(width, height, 60.0),
        np.eye(4),
    )


def observation(seed: int, frames: int = 1, **kind: object) -> Observation:
    return Observation(
        tuple(frame(100 * seed + i, **kind) for i in range(frames)),  # type: ignore[arg-type]
        GripperState(None, (0.4, 0.2, 1.0)),
        time_s=4.0 * seed,
        robot_position_world_m=(1.0, 2.0, 0.0),
    )


DISCREPANCIES = (
    Discrepancy(
        Change.EXTRA_OBJECT, "Bowl-1", "no Bowl", "Bowl-1", "Bowl-1 is there and was not expected"
    ),
    Discrepancy(
        Change.EXTRA_RELATION,
        "Bowl-1",
        "nothing inside Microwave-1",
        "Bowl-1 inside Microwave-1",
        "Bowl-1 is inside Microwave-1, where nothing was expected",
    ),
    Discrepancy(
        Change.MISSING_OBJECT, "Book-1", "Book-1", "no Book", "a Book was expected and is not there"
    ),
    Discrepancy(
        Change.STATE, "Mug-1", "dirty=clean", "dirty=dirty", "Mug-1 is dirty, expected clean"
    ),
)


def reference(subtask: Subtask, index: int) -> Reference:
    return Reference(
        "demo-0003", "heat-potato", index, subtask, 0.97, expected_graph(subtask), (subtask,)
    )


def verdict(subtask: Subtask, index: int, alarm: bool) -> Verdict:
    score = 0.734 if alarm else 0.962
    return Verdict(
        Decision.REPLAN if alarm else Decision.PROCEED,
        "scene_graph",
        score,
        0.9,
        Calibration.FIXED,
        ScoreParts(score, 0.81 if alarm else 0.98, 0.50 if alarm else 0.93, 0.89),
        reference(subtask, index),
        MATCHES,
        DISCREPANCIES if alarm else (),
        references=4,
    )


def diagnosis() -> Diagnosis:
    return Diagnosis(
        CAUSE,
        (Literal.parse("vacant(Microwave-1)"),),
        (Literal.parse("on_top_of(Potato-1, Plate-1)"), Literal.parse("dirty(Plate-1)=clean")),
        ("Bowl-1",),
        "symbolic",
        Subtask.parse("put_in(Plate-1, Microwave-1)"),
        "Microwave-1 has no room: it already has Bowl-1",
        (4, 4),
    )


def solved() -> Replan:
    rest = (*INSERTED, "pick_up(Plate-1)", "put_in(Plate-1, Microwave-1)", *NOMINAL[9:])
    return Replan(
        ReplanOutcome.SOLVED,
        Plan.parse(rest),
        PlanCheck(True, assumed=(Literal.parse("temperature(Plate-1)=room"),)),
        "symbolic",
        expanded=143,
        seconds=0.021,
    )


PHASES = (("perceive", 0.182), ("retrieve", 0.004), ("compare", 0.011))


def boundary(
    index: int, subtask: Subtask, *, alarm: bool = False, **pictures: object
) -> BoundaryRecord:
    bowl = index >= ALARM_INDEX - 1
    more = (("diagnose", 0.006), ("replan", 0.021)) if alarm else ()
    return BoundaryRecord(
        index=index,
        subtask=subtask,
        graph=observed_graph(bowl=bowl),
        scoped=observed_graph(subtask, bowl=bowl),
        observation=observation(index, **pictures),  # type: ignore[arg-type]
        looks=1,
        verdict=verdict(subtask, index, alarm),
        diagnosis=diagnosis() if alarm else None,
        replan=solved() if alarm else None,
        seconds=PHASES + more,
        time_s=4.0 * index,
        outcome=Outcome.REPLAN if alarm else Outcome.PROCEED,
        compute_s=tuple((name, (index + 1) * seconds) for name, seconds in PHASES),
        sentence=SENTENCE if alarm else "",
    )


def potato_record(**pictures: object) -> EpisodeRecord:
    """Heat a potato with a bowl in the microwave: one alarm, a new plan, success."""
    rest = solved().plan
    assert rest is not None
    done = (*Plan.parse(NOMINAL).subtasks[:ALARM_INDEX], *rest.subtasks)
    judged = list(done)
    judged.insert(ALARM_INDEX, Subtask.parse("pick_up(Plate-1)"))
    boundaries = [boundary(i, s, alarm=i == ALARM_INDEX, **pictures) for i, s in enumerate(judged)]
    executed = tuple(
        ExecutedRecord(s, SkillOutcome(SkillStatus.SUCCEEDED, 4.0), i)
        for i, s in enumerate(judged)
        if i != ALARM_INDEX
    )
    return EpisodeRecord(
        task=task(),
        scenario="microwave-occupied",
        strategy="proactive",
        seed=7,
        initial_plan=Plan.parse(NOMINAL),
        boundaries=tuple(boundaries),
        executed=executed,
        end=EpisodeEnd.PLAN_FINISHED,
        success=True,
        weak_success=True,
        events=(
            Event(0.0, "placed", ("Bowl-1", "Microwave-1"), "a bowl stands in the microwave"),
            Event(52.0, "cooked", ("Potato-1",), "Potato-1 is cooked"),
        ),
        simulated_s=52.0,
        compute_s=(
            ("perceive", 2.548),
            ("retrieve", 0.056),
            ("compare", 0.154),
            ("diagnose", 0.006),
            ("replan", 0.021),
        ),
        provenance=(
            ("perception", {"segmenter": "instance-ids", "state_estimator": "oracle"}),
            ("memory", {"path": "demos.sqlite", "demonstrations": 40}),
            ("versions", {"forestall": "0.1.0", "mujoco": "4.0.0", "python": "3.11.9"}),
            ("renderer", "embree"),
        ),
    )


def unjudged_record() -> EpisodeRecord:
    """Strategy "none": no verdicts, no pictures; the last subtask is refused."""
    whole = potato_record()
    plan = whole.initial_plan.subtasks
    refused = SkillOutcome(SkillStatus.REFUSED, 1.0, "Microwave-1 has no room for Plate-1")
    fine = SkillOutcome(SkillStatus.SUCCEEDED, 4.0)
    return replace(
        whole,
        strategy="none",
        boundaries=tuple(
            replace(boundary(i, s), observation=None, verdict=None, seconds=(("perceive", 0.1),))
            for i, s in enumerate(plan[:9])
        ),
        executed=tuple(
            ExecutedRecord(s, refused if i == 8 else fine, i) for i, s in enumerate(plan)
        ),
        success=False,
        weak_success=None,
        failures=("inside(?plate, Microwave): the plate is on CounterTop-2",),
        events=(),
        compute_s=(),
        provenance=(),
    )


def troubled_record() -> EpisodeRecord:
    """Alarms without a change, without a plan and without a reference; odd names; stopped."""
    whole = potato_record()
    odd = 'Tasse <b>"Süß & 熱い"</b>'
    graph = SceneGraph(
        (
            node(odd, "Tasse <Ü>", filled="<wine>", dirty=None),
            node("Shelf-1"),
            node("'; alert(1) //", "x"),
        ),
        (Relation(odd, "on_top_of", "Shelf-1"), Relation(odd, "near", "'; alert(1) //")),
        Subtask("pick_up", (odd,)),
        ("Shelf-1",),
    )
    first = replace(
        boundary(0, Subtask("navigate_to_obj", (odd,)), alarm=True),
        diagnosis=Diagnosis("the difference is harmless", ()),
        replan=None,
        graph=graph,
        scoped=graph,
    )
    alone = Verdict(
        Decision.PROCEED,
        "scene_graph",
        None,
        0.9,
        Calibration.UNCALIBRATED,
        note="no demonstration is like it <0.5>",
    )
    second = replace(
        boundary(1, Subtask("pick_up", (odd,))), verdict=alone, graph=graph, scoped=graph
    )
    third = replace(
        boundary(2, Subtask.parse("put_in(Plate-1, Microwave-1)"), alarm=True),
        replan=Replan(
            ReplanOutcome.UNSOLVABLE,
            check=PlanCheck(False, 1, "no room <left>", (Literal.parse("vacant(Microwave-1)"),)),
            note="proven on the observed state",
        ),
        looks=2,
    )
    outcome = SkillOutcome(SkillStatus.FAILED, 2.0, 'dropped "it" <hard>')
    return replace(
        whole,
        task=replace(whole.task, title='Heat <script>alert("ü")</script> & serve'),
        scenario="wein & <bröt>",
        initial_plan=Plan((Subtask("navigate_to_obj", (odd,)), Subtask("pick_up", (odd,)))),
        boundaries=(first, second, third),
        executed=(
            ExecutedRecord(
                Subtask("navigate_to_obj", (odd,)), SkillOutcome(SkillStatus.SUCCEEDED, 3.0), 0
            ),
            ExecutedRecord(Subtask("pick_up", (odd,)), outcome, 1),
        ),
        end=EpisodeEnd.STOPPED,
        success=None,
        weak_success=None,
        failures=("<nothing> & more",),
        events=(Event(1.0, "note", (odd,), "it's <odd>"),),
    )


def looked_after_record() -> EpisodeRecord:
    """A strategy that judges after subtasks: the refused one is repaired, the end is looked at."""
    whole = potato_record()
    rest = solved().plan
    assert rest is not None
    refused = SkillOutcome(SkillStatus.REFUSED, 1.0, "Microwave-1 has no room for Plate-1")
    fine = SkillOutcome(SkillStatus.SUCCEEDED, 4.0)
    done = (*Plan.parse(NOMINAL).subtasks[:9], *rest.subtasks)
    boundaries, executed = [], []
    for i, s in enumerate(done):
        before = replace(boundary(i, s), verdict=None)
        after = replace(boundary(i, s, alarm=i == 8), when=When.AFTER)
        boundaries += [before, after]
        executed.append(ExecutedRecord(s, refused if i == 8 else fine, i))
    watching = (verdict(done[-1], 15, False), replace(verdict(done[-1], 15, True), detector="b"))
    end = replace(boundary(len(done), done[-1]), when=When.END, watched=watching)
    return replace(
        whole,
        strategy="online",
        boundaries=(*boundaries, end),
        executed=tuple(executed),
        final=end.graph,
    )


def empty_record() -> EpisodeRecord:
    """A run that ended before its first boundary."""
    return EpisodeRecord(
        task(), None, "proactive", 0, Plan(()), (), (), EpisodeEnd.ERROR, success=False
    )


def calls(record: EpisodeRecord) -> list[tuple[BoundaryRecord, BoundaryContext]]:
    """What a listener would have been told at the boundaries of a record."""
    found = []
    plan, index = record.initial_plan, 0
    for b in record.boundaries:
        index -= b.when is When.AFTER
        assert isinstance(b.observation, Observation)
        context = BoundaryContext(
            task=record.task,
            plan=plan,
            index=index,
            done=b.index,
            subtask=b.subtask,
            graph=b.graph,
            scoped=b.scoped,
            observation=b.observation,
            looks=b.looks,
            when=b.when,
        )
        found.append((b, context))
        index += 1
        if b.replan is not None and b.replan.outcome is ReplanOutcome.SOLVED:
            assert b.replan.plan is not None
            plan, index = b.replan.plan, 0
    return found


def begun(record: EpisodeRecord) -> EpisodeRecord:
    """What is known of a run before it begins."""
    return EpisodeRecord(
        task=record.task,
        scenario=record.scenario,
        strategy=record.strategy,
        seed=record.seed,
        initial_plan=record.initial_plan,
        boundaries=(),
        executed=(),
        end=EpisodeEnd.UNFINISHED,
        provenance=record.provenance,
    )


def follow(listener: Listener, record: EpisodeRecord, boundaries: int | None = None) -> None:
    """Tell a listener of a run, of its first boundaries only where a number is given."""
    listener.on_start(begun(record))
    executed = {e.index: e for e in record.executed}
    for boundary, context in calls(record)[:boundaries]:
        listener.on_boundary(boundary, context)
        if context.when is When.BEFORE and boundary.index in executed:
            step = executed[boundary.index]
            listener.on_executed(step, 4.0 * step.index + 4)
    if boundaries is None:
        listener.on_end(record)
