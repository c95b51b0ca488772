from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forestall.domain.load import extend, shipped
from forestall.domain.model import Domain
from forestall.errors import PerceptionError
from forestall.perception.config import PerceptionConfig, ScopeConfig
from forestall.perception.geometry import Stack, Thing
from forestall.perception.given import GivenStateEstimator
from forestall.perception.oracle import OracleStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.relations import directions
from forestall.perception.segmenters import GivenMasks, InstanceSegmenter
from forestall.perception.support import parents
from forestall.perception.timing import perception_times
from forestall.perception.unproject import clouds, label_image
from forestall.seams import Perceiver, Segmenter, StateEstimator
from forestall.types.graph import ObjectNode, Relation, SceneGraph
from forestall.types.observation import Detection, Frame, Observation
from forestall.types.plan import Subtask

from .synthetic import Solid, at, looking, observed

EYE = looking((0.0, -0.7, 1.65), (0.0, 0.3, 0.9))
COUNTER = Solid("CounterTop-1", (-1.0, 0.0, 0.86), (1.0, 0.6, 0.9))
MUG = (0.085, 0.085, 0.10)
SCENE = [
    COUNTER,
    at("Plate-1", 0.1, 0.3, 0.9, (0.22, 0.22, 0.02), True),
    at("Potato-1", 0.1, 0.3, 0.92, (0.1, 0.07, 0.065)),
    at("Mug-1", -0.3, 0.3, 0.9, MUG, True),
    at("Mug-2", 0.4, 0.35, 0.9, MUG, True),
]


def as_detections(observation: Observation, named: bool, order: Sequence[int] = ()) -> Observation:
    """The same frames with detections in place of instance ids."""
    frames = []
    for frame in observation.frames:
        found = list(InstanceSegmenter().segment(frame))
        found = [found[i] for i in order] if order else found
        if not named:
            found = [replace(d, instance=None) for d in found]
        frames.append(replace(frame, instance_ids=None, detections=tuple(found)))
    return replace(observation, frames=tuple(frames))


def test_the_parts_fulfil_their_protocols() -> None:
    segmenter: Segmenter = InstanceSegmenter()
    other: Segmenter = GivenMasks()
    oracle: StateEstimator = OracleStateEstimator(lambda name: {}, shipped("household"))
    perceiver: Perceiver = GraphPerceiver(segmenter, oracle, shipped("household"))
    assert perceiver.describe() == {
        "segmenter": "simulator instance ids",
        "state_estimator": "oracle states",
    }
    assert other.name == "given masks"


@settings(max_examples=8, deadline=None)
@given(st.permutations(range(len(SCENE))))
def test_the_order_of_detections_does_not_matter(order: list[int]) -> None:
    observation = observed(SCENE, EYE)
    graphs = []
    for chosen in (list(range(len(SCENE))), order):
        perceiver = GraphPerceiver(GivenMasks(), GivenStateEstimator({}), shipped("household"))
        graphs.append(perceiver.perceive(as_detections(observation, named=True, order=chosen)))
    assert graphs[0] == graphs[1]


def test_untracked_detections_keep_their_names_over_time() -> None:
    perceiver = GraphPerceiver(GivenMasks(), GivenStateEstimator({}), shipped("household"))
    first = perceiver.perceive(as_detections(observed(SCENE, EYE), named=False))
    assert {n.id for n in first.of_category("Mug")} == {"Mug-1", "Mug-2"}
    other = looking((0.3, -0.7, 1.65), (0.0, 0.3, 0.9))
    second = perceiver.perceive(as_detections(observed(SCENE, other, time_s=1.0), named=False))
    for name in ("Mug-1", "Mug-2"):
        a, b = first.get(name), second.get(name)
        assert a is not None and b is not None
        assert np.allclose(a.centroid_m or (), b.centroid_m or (1, 1, 1), atol=0.05)
    assert len(second.nodes) == len(first.nodes)


def test_overlapping_masks_give_the_pixel_to_the_smaller_one() -> None:
    big = np.ones((4, 4), bool)
    small = np.zeros((4, 4), bool)
    small[1, 1] = True
    labels = label_image([Detection("Plate", big), Detection("Egg", small)], (4, 4))
    assert labels[1, 1] == 1
    assert (labels == 0).sum() == 15


def test_flying_pixels_do_not_stretch_a_box() -> None:
    frame = observed([COUNTER, at("Mug-1", 0.0, 0.3, 0.9, MUG, True)], EYE).frames[0]
    depth = frame.depth_m.copy()
    mug = next(d for d in InstanceSegmenter().segment(frame) if d.category == "Mug").mask
    rows, columns = np.nonzero(mug)
    depth[rows[:2], columns[:2]] += 1.0
    noisy = replace(frame, depth_m=depth)
    found = clouds(
        noisy, label_image([Detection("Mug", mug)], mug.shape), [0.008], PerceptionConfig()
    )
    assert found[0] is not None
    assert np.all(found[0].high_m - found[0].low_m < 0.12)


def test_a_mask_without_depth_gives_no_cloud() -> None:
    frame = observed([COUNTER], EYE).frames[0]
    empty = replace(frame, depth_m=np.zeros_like(frame.depth_m))
    labels = np.zeros(frame.depth_m.shape, np.int16)
    assert clouds(empty, labels, [0.01], PerceptionConfig()) == [None]
    assert clouds(empty, labels - 1, [], PerceptionConfig()) == []


boxes = st.lists(
    st.tuples(
        st.floats(-1, 1, allow_nan=False),
        st.floats(-1, 1, allow_nan=False),
        st.floats(0, 1.5, allow_nan=False),
        st.floats(0.02, 0.3, allow_nan=False),
    ),
    min_size=2,
    max_size=6,
)


def things(data: list[tuple[float, float, float, float]], offset: np.ndarray) -> Stack:
    made = []
    for i, (x, y, z, size) in enumerate(data):
        low = np.round(np.array([x, y, z]), 3) + offset
        corners = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1]), -1).reshape(-1, 3)
        high = low + np.round(size, 3)
        category = ("Mug", "Plate", "Potato", "Bowl")[i % 4]
        made.append(Thing(f"{category}-{i}", category, low + corners * (high - low), low, high))
    return Stack.of(made)


INVERSE = (("left_of", "right_of"), ("in_front_of", "behind"), ("above", "below"), ("near", "near"))


@settings(max_examples=60, deadline=None)
@given(boxes)
def test_directions_are_antisymmetric(data: list[tuple[float, float, float, float]]) -> None:
    found = set(directions(things(data, np.zeros(3)), EYE, (), (), PerceptionConfig()))
    for one, other in INVERSE:
        for r in found:
            if r.predicate == one:
                assert Relation(r.object, other, r.subject) in found
                if one != other:
                    assert Relation(r.object, one, r.subject) not in found
                    assert Relation(r.subject, other, r.object) not in found


@settings(max_examples=60, deadline=None)
@given(boxes, st.tuples(st.integers(-5, 5), st.integers(-5, 5), st.integers(-2, 2)))
def test_moving_the_world_changes_no_relation(
    data: list[tuple[float, float, float, float]], offset: tuple[int, int, int]
) -> None:
    shift = np.array(offset, float)
    pose = EYE.copy()
    pose[:3, 3] += shift
    config = PerceptionConfig()
    here, there = things(data, np.zeros(3)), things(data, shift)
    assert directions(here, EYE, (), (), config) == directions(there, pose, (), (), config)


def test_moving_the_world_moves_the_graph() -> None:
    shift = (2.0, -1.0, 0.24)
    pose = EYE.copy()
    pose[:3, 3] += shift
    graphs = []
    for solids, camera in ((SCENE, EYE), ([s.moved(shift) for s in SCENE], pose)):
        perceiver = GraphPerceiver(
            InstanceSegmenter(), GivenStateEstimator({}), shipped("household")
        )
        graphs.append(perceiver.perceive(observed(solids, camera)))
    assert graphs[0].relations == graphs[1].relations


@settings(max_examples=40, deadline=None)
@given(boxes)
def test_nothing_has_two_parents_or_is_its_own(
    data: list[tuple[float, float, float, float]],
) -> None:
    stack = things(data, np.zeros(3))
    every = {t.id for t in stack.things}
    found = parents(stack, every, {}, shipped("household"), PerceptionConfig())
    for name in found:
        passed = [name]
        while passed[-1] in found:
            passed.append(found[passed[-1]][1])
            assert passed.count(passed[-1]) == 1


def test_the_oracle_tells_only_what_a_camera_could() -> None:
    true = {"Mug-1": {"filled": "coffee", "dirty": "dirty", "temperature": "hot"}}
    asked: list[str] = []

    def states(name: str) -> dict[str, str]:
        asked.append(name)
        return true.get(name, {})

    frame = observed([COUNTER, at("Mug-1", 0.0, 0.3, 0.9, MUG, True)], EYE).frames[0]
    found = InstanceSegmenter().segment(frame)
    near = OracleStateEstimator(states, shipped("household")).estimate(frame, found)
    by_name = dict(zip([d.instance for d in found], near, strict=True))
    assert by_name["Mug-1"] == {"filled": "coffee", "dirty": "dirty"}
    assert set(asked) == {"CounterTop-1", "Mug-1"}
    far = OracleStateEstimator(states, shipped("household"), fine_pixels=10**6).estimate(
        frame, found
    )
    by_name = dict(zip([d.instance for d in found], far, strict=True))
    assert by_name["Mug-1"] == {"filled": None, "dirty": None}
    unnamed = [Detection("Mug", found[0].mask)]
    assert OracleStateEstimator(states, shipped("household")).estimate(frame, unnamed) == [{}]


def test_an_estimator_that_answers_for_too_few_is_refused() -> None:
    class Silent:
        name = "silent"

        def estimate(self, frame: Frame, detections: Sequence[Detection]) -> list[dict[str, str]]:
            return []

    perceiver = GraphPerceiver(InstanceSegmenter(), Silent(), shipped("household"))
    with pytest.raises(PerceptionError, match="silent"):
        perceiver.perceive(observed(SCENE, EYE))


def test_times_are_measured_one_by_one() -> None:
    perceiver = GraphPerceiver(InstanceSegmenter(), GivenStateEstimator({}), shipped("household"))
    times = perception_times(perceiver, observed(SCENE, EYE), 3)
    assert len(times) == 3
    assert min(times) > 0


def whole_graph() -> SceneGraph:
    names = {w for text in SCOPES.values() for w in text.split() if w != "gripper"}
    names |= {"CounterTop-2", "Faucet-2", "Mug-1"}
    nodes = [ObjectNode(n, n.rpartition("-")[0]) for n in sorted(names)]
    nodes.append(ObjectNode("gripper", "Gripper"))
    facts = [
        ("Plate-1", "held_by", "gripper"),
        ("Potato-1", "on_top_of", "Plate-1"),
        ("Bowl-1", "inside", "Microwave-1"),
        ("Egg-1", "inside", "Fridge-1"),
        ("Mug-1", "on_top_of", "CounterTop-1"),
        ("Knife-1", "on_top_of", "CounterTop-1"),
        ("Pot-1", "on_top_of", "CounterTop-1"),
        ("Pot-1", "blocking", "Knife-1"),
        ("Pot-1", "near", "Knife-1"),
        ("Tomato-1", "inside", "Sink-1"),
    ]
    hidden = ("Fridge-1", "Microwave-1")
    return SceneGraph(tuple(nodes), tuple(Relation(*f) for f in facts), hidden=hidden)


def scoped(
    text: str, config: ScopeConfig | None = None, domain: Domain | None = None
) -> SceneGraph:
    perceiver = GraphPerceiver(
        InstanceSegmenter(),
        GivenStateEstimator({}),
        domain or shipped("household"),
        scope_config=config,
    )
    return perceiver.scope(whole_graph(), Subtask.parse(text))


SCOPES = {
    "put_in(Plate-1, Microwave-1)": "Bowl-1 Microwave-1 Plate-1 Potato-1 gripper",
    "put_in(Plate, Microwave)": "Bowl-1 Microwave-1 Plate-1 Potato-1 gripper",
    "pick_up(Knife-1)": "CounterTop-1 Knife-1 Plate-1 Pot-1 Potato-1 gripper",
    "put_in(Plate-1, Fridge-1)": "Fridge-1 Plate-1 Potato-1 gripper",
    "put_in(Plate-1, Sink-1)": "Faucet-1 Plate-1 Potato-1 Sink-1 gripper",
    "put_on(Plate-1, CounterTop-1)": "CounterTop-1 Plate-1 Potato-1 gripper",
    "toggle_on(StoveBurner-3)": "Plate-1 Potato-1 StoveBurner-3 StoveKnob-3 gripper",
    "pick_up(Egg-1)": "Egg-1 Fridge-1 Plate-1 Potato-1 gripper",
    "pour(Plate-1, CounterTop-1)": "CounterTop-1 Plate-1 Potato-1 gripper",  # refused anyway
    "pick_up(Tomato-1)": "Faucet-1 Plate-1 Potato-1 Sink-1 Tomato-1 gripper",
}


@pytest.mark.parametrize("text", SCOPES)
def test_a_scope_keeps_what_concerns_the_subtask(text: str) -> None:
    graph = scoped(text)
    assert " ".join(n.id for n in graph.nodes) == SCOPES[text]
    assert str(graph.subtask) == text


COUNTED = "CounterTop-1 Knife-1 Mug-1 Plate-1 Pot-1 Potato-1 gripper"
UNCOUNTED = "CounterTop-1 Plate-1 Potato-1 gripper"


@pytest.mark.parametrize("counter", ["CounterTop-1", "CounterTop"])
@pytest.mark.parametrize(
    ("told", "kept"),
    [
        ({"tags": ["limited"], "capacity": 1}, COUNTED),
        ({"tags": ["limited"]}, UNCOUNTED),  # no number to count up to
        ({"capacity": 1}, UNCOUNTED),  # the skill asks for the number of what is limited alone
    ],
)
def test_a_scope_keeps_the_contents_of_a_support_that_the_skill_counts(
    told: dict[str, Any], kept: str, counter: str
) -> None:
    domain = extend(shipped("household"), {"CounterTop": told}, {})
    graph = scoped(f"put_on(Plate-1, {counter})", domain=domain)
    assert " ".join(n.id for n in graph.nodes if n.id != "CounterTop-2") == kept


def test_a_scope_keeps_semantic_relations_among_its_nodes() -> None:
    graph = scoped("pick_up(Knife-1)")
    assert {str(r) for r in graph.relations} == {
        "Knife-1 on top of CounterTop-1",
        "Plate-1 held by gripper",
        "Pot-1 blocking Knife-1",
        "Pot-1 on top of CounterTop-1",
        "Potato-1 on top of Plate-1",
    }
    assert graph.hidden == ()
    assert scoped("put_in(Plate-1, Microwave-1)").hidden == ("Microwave-1",)


def test_the_whole_graph_can_be_asked_for() -> None:
    graph = scoped("pick_up(Knife-1)", ScopeConfig(whole=True))
    assert graph.nodes == whole_graph().nodes
    assert graph.relations == whole_graph().relations
    assert str(graph.subtask) == "pick_up(Knife-1)"


def test_the_relations_that_the_domain_scores_are_kept() -> None:
    usual = shipped("household")
    predicates = {n: replace(p, scored=n == "near") for n, p in usual.predicates.items()}
    graph = scoped("pick_up(Knife-1)", domain=replace(usual, predicates=predicates))
    assert {str(r) for r in graph.relations} == {"Pot-1 near Knife-1"}
