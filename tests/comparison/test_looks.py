"""Nodes compared by image features."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from graph_pairs import scene
from hypothesis import given, settings
from hypothesis import strategies as st

from forestall.comparison.looks import NEVER, NOTHING, QUANTUM, joined, looks_of, seen
from forestall.comparison.score import BatchScorer, Feature, ScoreConfig, compare
from forestall.comparison.timing import random_graph, score_times
from forestall.domain.load import shipped
from forestall.embeddings import HashedTextEncoder
from forestall.errors import InputError
from forestall.types.feature import quantised
from forestall.types.graph import SceneGraph
from forestall.types.verdict import ScoreParts

ENCODER = HashedTextEncoder()
DOMAIN = shipped("household")
IMAGE = ScoreConfig(feature=Feature.IMAGE)
EAST, NORTH, BETWEEN, NEARLY = (
    quantised(v) for v in ([1.0, 0.0], [0.0, 1.0], [127 * 0.5, 110.0], [4.0, 3.0])
)


def looking(graph: SceneGraph, **features: bytes) -> SceneGraph:
    """The same graph with features; `Mug_1` stands for "Mug-1"."""
    named = {name.replace("_", "-"): f for name, f in features.items()}
    return replace(
        graph, nodes=tuple(replace(n, feature=named.get(n.id, n.feature)) for n in graph.nodes)
    )


def score(
    observed: SceneGraph, expected: SceneGraph, config: ScoreConfig = IMAGE
) -> tuple[ScoreParts, tuple[tuple[str, str], ...]]:
    """Parts and matches, the parts the same in a batch and the other way round."""
    plain = compare(observed, expected, config, ENCODER, DOMAIN)
    batch = BatchScorer(config, ENCODER, DOMAIN)
    assert batch.scores(observed, [expected, observed, expected]) == [
        plain.parts,
        compare(observed, observed, config, ENCODER, DOMAIN).parts,
        plain.parts,
    ]
    assert batch.scores(expected, [observed]) == [plain.parts]
    return plain.parts, plain.matches


MUG = looking(scene("Mug-1"), Mug_1=EAST)


def test_the_cosine_is_that_of_the_pictures() -> None:
    parts, matches = score(looking(scene("Mug-1"), Mug_1=NEARLY), MUG)
    assert parts.node == pytest.approx(0.8, abs=0.005)
    assert matches == (("Mug-1", "Mug-1"),)


def test_another_category_matches_when_it_looks_alike() -> None:
    cup = looking(scene("Cup-1"), Cup_1=NEARLY)
    parts, matches = score(cup, MUG)
    assert matches == (("Cup-1", "Mug-1"),)
    assert parts.node == pytest.approx(0.8, abs=0.005)
    assert score(cup, MUG, ScoreConfig())[1] == ()


def test_below_the_floor_not_even_the_same_category_matches() -> None:
    other = looking(scene("Mug-1"), Mug_1=BETWEEN)
    assert score(other, MUG)[0].node == 0.0
    low = replace(IMAGE, image_floor=0.4)
    assert score(other, MUG, low)[0].node == pytest.approx(0.5, abs=0.005)
    assert score(looking(scene("Mug-1"), Mug_1=NORTH), MUG, low)[0].node == 0.0


def test_looks_decide_which_of_two_is_meant() -> None:
    observed = looking(scene("Mug-1; Mug-2"), Mug_1=NORTH, Mug_2=EAST)
    expected = looking(scene("Mug-1; Mug-2"), Mug_1=EAST, Mug_2=NORTH)
    parts, matches = score(observed, expected)
    assert set(matches) == {("Mug-1", "Mug-2"), ("Mug-2", "Mug-1")}
    assert parts.node == 1.0
    assert ("Mug-1", "Mug-1") in score(observed, expected, ScoreConfig())[1]


def test_equally_good_matchings_are_exchanged_with_the_graphs() -> None:
    """Each mug looks like the two others: two matchings are best, and nothing but looks differs."""
    mugs = ("Mug_1", "Mug_2", "Mug_3")
    one, other = (
        looking(
            scene("Mug-1; Mug-2; Mug-3"),
            **{m: quantised(r) for m, r in zip(mugs, rows, strict=True)},
        )
        for rows in (np.eye(3), 1 - np.eye(3))
    )
    there, back = score(one, other)[1], score(other, one)[1]
    assert len(there) == 3 and all(o != e for o, e in there)
    assert sorted(there) == sorted((o, e) for e, o in back)


def test_known_states_that_differ_keep_their_meaning() -> None:
    dirty = looking(scene("Mug-1 dirty=dirty"), Mug_1=NEARLY)
    clean = looking(scene("Mug-1 dirty=clean"), Mug_1=EAST)
    assert score(dirty, clean)[1] == ()
    allowed, _ = score(dirty, clean, replace(IMAGE, state_changes_match=True))
    assert allowed.node == pytest.approx(0.8, abs=0.005)
    unsure = looking(scene("Mug-1 dirty=?"), Mug_1=NEARLY)
    assert score(unsure, clean)[0] == allowed


def test_burners_are_told_apart_by_number_and_not_by_look() -> None:
    first = looking(scene("StoveBurner-1"), StoveBurner_1=EAST)
    fourth = looking(scene("StoveBurner-4"), StoveBurner_4=EAST)
    assert score(fourth, first)[1] == ()
    fourth_on, first_on = (
        replace(g, subtask=scene("", "", f"toggle_on({g.nodes[0].id})").subtask)
        for g in (fourth, first)
    )
    assert score(fourth_on, first_on)[0].score == 1.0


@pytest.mark.parametrize("things", ["Mug-1", "Cup-1", "Mug-1 dirty=dirty"])
def test_without_a_picture_of_one_of_them_the_texts_decide(things: str) -> None:
    expected = scene("Mug-1 dirty=clean; Sink-1; gripper", "Mug-1 inside Sink-1")
    observed = scene(f"{things}; Sink-1; gripper")
    seen_one = looking(expected, Mug_1=EAST, Sink_1=EAST)
    assert score(observed, seen_one) == score(observed, expected, ScoreConfig())


def test_supports_are_one_node_whatever_they_look_like() -> None:
    table = looking(scene("DiningTable-1"), DiningTable_1=NORTH)
    counter = looking(scene("CounterTop-1"), CounterTop_1=EAST)
    assert score(table, counter)[0].node == 1.0
    assert score(table, counter, replace(IMAGE, merge_supports=False))[0].node == 1.0
    assert score(table, counter, replace(IMAGE, generic_supports=False))[0].node == 0.0


@pytest.mark.parametrize("feature", [Feature.TEXT, Feature.PARTS])
def test_other_features_do_not_look(feature: Feature) -> None:
    config = ScoreConfig(feature=feature)
    rng = np.random.default_rng(2)
    one, other = (random_graph(12, rng, DOMAIN, feature_size=8) for _ in range(2))
    bare_one, bare_other = (
        replace(g, nodes=tuple(replace(n, feature=None) for n in g.nodes)) for g in (one, other)
    )
    assert score(one, other, config) == score(bare_one, bare_other, config)


def test_features_of_two_encoders_do_not_compare() -> None:
    other = looking(scene("Mug-1"), Mug_1=quantised([1.0, 2.0, 3.0]))
    with pytest.raises(InputError, match="of 2 and 3 numbers do not compare"):
        compare(other, MUG, IMAGE, ENCODER, DOMAIN)
    with pytest.raises(InputError, match="record the demonstrations with"):
        BatchScorer(IMAGE, ENCODER, DOMAIN).scores(scene("Mug-1"), [other, MUG])
    assert compare(other, MUG, ScoreConfig(), ENCODER, DOMAIN).parts.score == 1.0


def test_a_floor_out_of_range() -> None:
    with pytest.raises(InputError, match="floor 0"):
        ScoreConfig(image_floor=0)


# two sizes on either side of what float32 sums exactly
@given(st.sampled_from((1, 7, 1024, 1500)), st.integers(0, 2**20), st.sampled_from((0.1, 0.6)))
@settings(max_examples=30, deadline=None)
def test_cosines_are_those_of_whole_numbers(size: int, seed: int, floor: float) -> None:
    rng = np.random.default_rng(seed)
    rows = rng.integers(-128, 128, (5, size)) | 1
    rows[3] = rows[0]
    ours, theirs = (looks_of([r.astype(np.int8).tobytes() for r in x]) for x in (rows, rows[2:]))
    found = seen(np.zeros((5, 3)), ours, theirs, floor)
    for i in range(5):
        for j in range(3):
            a, b = ([int(x) for x in row] for row in (rows[i], rows[2 + j]))
            product = sum(x * y for x, y in zip(a, b, strict=True))
            lengths = math.sqrt(sum(x * x for x in a)) * math.sqrt(sum(x * x for x in b))
            cosine = min(round(product / lengths / QUANTUM) * QUANTUM, 1.0)
            assert found[i, j] == (cosine if cosine >= floor else 0.0)
    assert found[0, 1] == 1.0


def test_where_one_has_no_picture_or_may_not_match() -> None:
    table = np.array([[0.9, NEVER], [0.9, 0.9]])
    ours, theirs = looks_of([EAST, None]), looks_of([EAST, EAST])
    assert seen(table, ours, theirs, 0.6).tolist() == [[1.0, 0.0], [0.9, 0.9]]
    assert seen(table, ours, NOTHING, 0.6).tolist() == [[0.9, 0.0], [0.9, 0.9]]
    assert looks_of([None, None]) is NOTHING
    row = joined([theirs, NOTHING, ours], stride=3)
    assert row.at.tolist() == [0, 1, 6]
    assert joined([NOTHING], stride=3) is NOTHING


def test_timing_with_images() -> None:
    times = score_times(3, 8, 1, DOMAIN, repeat=2, feature=Feature.IMAGE, feature_size=16)
    assert len(times) == 2
    plain = random_graph(20, np.random.default_rng(5), DOMAIN)
    assert all(n.feature is None for n in plain.nodes)
    pictured = random_graph(20, np.random.default_rng(5), DOMAIN, feature_size=16)
    assert {len(n.feature) for n in pictured.nodes if n.feature is not None} == {16}
