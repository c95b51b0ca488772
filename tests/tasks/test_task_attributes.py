"""An attribute that only a task file knows goes through everything: from the scene to the plan."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from forestall.assembly.configuration import run_config
from forestall.comparison.batch import BatchScorer
from forestall.comparison.options import ScoreConfig
from forestall.comparison.preconditions import mine
from forestall.embeddings.hashed import HashedTextEncoder
from forestall.memory.recording import demonstration_from
from forestall.perception.given import GivenStateEstimator
from forestall.perception.oracle import OracleStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import GivenMasks
from forestall.planning.execute import apply
from forestall.planning.observed import state_of
from forestall.planning.state import State
from forestall.planning.validate import GraphValidator
from forestall.tasks.files import LoadedTask, load_task
from forestall.types.demonstration import Demonstration
from forestall.types.graph import ObjectNode, Relation, SceneGraph
from forestall.types.observation import Detection, Frame, GripperState, Intrinsics, Observation
from forestall.types.plan import Plan, Subtask
from forestall.types.task import Goal
from forestall.types.verdict import Decision, Reference, ReplanOutcome
from forestall.worlds.kitchen.flat_world import flat_environment
from test_runtime import play

TASK = """
name = "fetch-tomato"
title = "Fetch a ripe tomato"
plan = [
  "navigate_to_obj(Tomato)",
  "pick_up(Tomato)",
  "navigate_to_obj(DiningTable)",
  "put_on(Tomato, DiningTable)",
]

[goal]
text = "A ripe tomato lies on the dining table."
variables = { "?tomato" = "Tomato" }
all = ["on_top_of(?tomato, DiningTable)", "ripe(?tomato)=ripe"]

[scene]
clutter = [0, 0]

[[scene.objects]]
category = "Tomato"
places = ["CounterTop"]
states = { ripe = "ripe" }

[attributes.ripe]
values = ["unripe", "ripe"]
phrases = { unripe = ["a green {thing}"], ripe = ["a red {thing}", "a ripe {thing}"] }

[attributes.heavy]
values = ["light", "heavy"]
camera = false

[categories.Tomato]
attributes = ["ripe", "heavy"]

[categories.TomatoSliced]
attributes = ["ripe"]
"""

SCENARIO = """
name = "unripe-tomato"
task = "fetch-tomato"
title = "The tomato is unripe"
kind = "state"
cause = "The tomato is unripe."

[[faults]]
kind = "set_state"
object = "Tomato"
attribute = "ripe"
value = "unripe"
"""


@pytest.fixture
def task(tmp_path: Path) -> str:
    path = tmp_path / "fetch-tomato.toml"
    path.write_text(TASK, encoding="utf-8")
    return str(path)


@pytest.fixture
def loaded(task: str) -> LoadedTask:
    return load_task(task)


def seen(loaded: LoadedTask, **states: str) -> SceneGraph:
    """What perception makes of a picture of one tomato with given states."""
    camera = Intrinsics.from_vertical_fov(64, 48, 60.0)
    mask = np.zeros((48, 64), dtype=np.bool_)
    mask[15:35, 20:40] = True
    frame = Frame(
        rgb=np.where(mask[:, :, None], (200, 40, 30), (90, 90, 90)).astype(np.uint8),
        depth_m=np.where(mask, 0.2, 0.3).astype(np.float32),
        intrinsics=camera,
        camera_to_world=np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 1], [0, 0, 0, 1.0]]),
        detections=(Detection("Tomato", mask, "Tomato-1"),),
    )
    perceiver = GraphPerceiver(
        GivenMasks(), GivenStateEstimator({"Tomato-1": states}), loaded.domain
    )
    observation = Observation((frame,), GripperState(None, (0.0, 0.2, 1.0)), 0.0, (0.0, 0.0, 0.0))
    return replace(perceiver.perceive(observation), subtask=PICK_UP)


PICK_UP = Subtask("pick_up", ("Tomato-1",))


def test_perception_carries_it_and_the_score_counts_it(loaded: LoadedTask) -> None:
    ripe, unripe = seen(loaded, ripe="ripe"), seen(loaded, ripe="unripe")
    tomato = ripe.get("Tomato-1")
    assert tomato is not None
    assert tomato.state("ripe") == "ripe"
    assert tomato.state("sliced") is None
    scorer = BatchScorer(ScoreConfig(), HashedTextEncoder(), loaded.domain)
    same, other = scorer.scores(ripe, [seen(loaded, ripe="ripe"), unripe])
    assert same.score == pytest.approx(1.0)
    assert other.score < 0.9
    verdict = scorer.best(unripe, [Reference("d", "fetch-tomato", 1, PICK_UP, 1.0, ripe)])
    assert verdict is not None
    texts = [d.text for d in verdict.discrepancies]
    assert "Tomato-1 is unripe; the demonstration shows it ripe" in texts


def test_it_is_mined_as_what_this_task_needs(loaded: LoadedTask) -> None:
    graph = seen(loaded, ripe="ripe", heavy="heavy")
    references = [Reference(f"d{k}", "fetch-tomato", 1, PICK_UP, 1.0, graph) for k in range(4)]

    def texts(task: str) -> set[str]:
        mined = mine(references, loaded.domain, subtask=PICK_UP, task=task)
        return {str(p.literal) for p in mined}

    assert "ripe(?object)=ripe" in texts("fetch-tomato")
    assert "ripe(?object)=ripe" not in texts("another-task")
    assert not any(t.startswith("heavy") for t in texts("fetch-tomato"))


def test_planning_takes_it_as_a_fact_that_no_skill_changes(loaded: LoadedTask) -> None:
    fixtures = [
        ObjectNode("DiningTable-1", "DiningTable"),
        ObjectNode("CounterTop-1", "CounterTop"),
    ]
    knife = ObjectNode("Knife-1", "Knife")
    for value, ok in (("ripe", True), ("unripe", False)):
        tomato = ObjectNode("Tomato-1", "Tomato", (("ripe", value),))
        on_counter = [Relation(n, "on_top_of", "CounterTop-1") for n in ("Tomato-1", "Knife-1")]
        graph = SceneGraph((*fixtures, knife, tomato), tuple(on_counter))
        check = GraphValidator(loaded.domain).check(loaded.task.plan, graph, loaded.task.goal)
        assert check.ok is ok
        assert [str(x) for x in check.unmet] == ([] if ok else ["ripe(Tomato-1)=ripe"])
        state: object = state_of(graph, loaded.domain)
        for step in ("pick_up(Knife)", "slice_obj(Tomato)"):
            assert isinstance(state, State)
            state = apply(state, Subtask.parse(step))
        assert isinstance(state, State)
        assert state.value("TomatoSliced-2", "ripe") == value


def test_the_household_keeps_it(loaded: LoadedTask) -> None:
    kitchen = flat_environment(loaded.task.scene, loaded.domain)
    kitchen.reset(0)
    assert kitchen.oracle.states("Tomato-1")["ripe"] == "ripe"
    tomato = kitchen.oracle.truth().get("Tomato-1")
    assert tomato is not None
    assert tomato.state("heavy") == "light"
    estimator = OracleStateEstimator(kitchen.oracle.states, loaded.domain)
    mask = np.ones((20, 20), dtype=np.bool_)
    frame = kitchen.observe().frames[0]
    (told,) = estimator.estimate(frame, [Detection("Tomato", mask, "Tomato-1")])
    assert told == {"ripe": "ripe", "sliced": "whole"}
    kitchen.close()


def test_a_run_names_it_as_the_cause(task: str, tmp_path: Path) -> None:
    scenario = tmp_path / "unripe.toml"
    scenario.write_text(SCENARIO, encoding="utf-8")
    memory: list[Demonstration] = []
    for seed in range(1000, 1004):
        demonstration = demonstration_from(play(run_config(task, strategy="none", seed=seed)), "t")
        assert demonstration is not None
        memory.append(replace(demonstration, id=f"d{seed}"))
    calm = play(run_config(task, seed=2), memory)
    assert calm.success
    assert all(b.verdict and b.verdict.decision is Decision.PROCEED for b in calm.boundaries)
    alarmed = play(run_config(task, str(scenario), seed=2), memory)
    assert alarmed.success is False
    first = next(b for b in alarmed.boundaries if b.diagnosis is not None)
    assert first.diagnosis is not None and first.replan is not None
    assert [str(x) for x in first.diagnosis.must_change] == ["ripe(Tomato-1)=ripe"]
    assert first.diagnosis.cause == "Tomato-1 is unripe; it was ripe in all 4 demonstrations"
    assert first.replan.outcome is ReplanOutcome.UNSOLVABLE


def test_a_memory_that_knows_more_attributes_does_no_harm(loaded: LoadedTask) -> None:
    plain = load_task("make-salad").domain
    graph = seen(loaded, ripe="ripe", sliced="whole")
    references = [Reference(f"d{k}", "fetch-tomato", 1, PICK_UP, 1.0, graph) for k in range(4)]
    mined = mine(references, plain, subtask=PICK_UP, task="fetch-tomato")
    assert "sliced(?object)=whole" in {str(p.literal) for p in mined}
    assert "ripe" not in {p.literal.predicate for p in mined}
    check = GraphValidator(plain).check(Plan((PICK_UP,)), graph, Goal("any", literals=()))
    assert check.ok
