from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from demonstration_samples import demonstration, with_id

from forestall.domain.load import shipped
from forestall.embeddings import HashedTextEncoder
from forestall.errors import InputError, MemoryFileError
from forestall.memory.retrieval import EmbeddingRetriever, RetrievalConfig, subtask_words
from forestall.memory.store import open_store
from forestall.types.demonstration import Demonstration, View
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.types.verdict import Reach, scenes

DOMAIN = shipped("household")
COFFEE = (
    "navigate_to_obj(Mug-1)",
    "pick_up(Mug-1)",
    "put_on(Mug-1, CounterTop-1)",
    "pick_up(Mug-1)",
    "put_in(Mug-1, CoffeeMachine-1)",
)
WATER = ("pick_up(Mug-2)", "put_in(Mug-2, Sink-1)")
SALAD = ("pick_up(Bowl-1)", "put_in(Bowl-1, Fridge-1)")


def sample(task: str, plan: tuple[str, ...], name: str) -> Demonstration:
    return with_id(demonstration(task, 1, plan), name)


MEMORY = [
    sample("warm-water", WATER, "w"),
    sample("make-coffee", COFFEE, "c1"),
    sample("make-coffee", COFFEE, "c2"),
    sample("make-salad", SALAD, "s"),
]


def retriever(**options: float) -> EmbeddingRetriever:
    config = RetrievalConfig(**options)  # type: ignore[arg-type]
    return EmbeddingRetriever(MEMORY, HashedTextEncoder(), DOMAIN, config)


def order(subtask: str, task: str, done: int, **options: float) -> list[tuple[str, int]]:
    found = retriever(**options).retrieve(Subtask.parse(subtask), task, done)
    return [(r.demonstration, r.index) for r in scenes(found)]


def test_the_same_step_of_the_same_task_comes_first() -> None:
    assert order("pick_up(Mug-7)", "make-coffee", 1)[:5] == [
        ("c1", 1),
        ("c2", 1),
        ("c1", 3),
        ("c2", 3),
        ("w", 0),
    ]
    assert order("pick_up(Mug-7)", "make-coffee", 3)[:2] == [("c1", 3), ("c2", 3)]
    assert order("pick_up(Mug-7)", "warm-water", 0)[:2] == [("w", 0), ("c1", 1)]


def test_less_similar_steps_come_later_with_their_similarity() -> None:
    found = retriever(floor=0.5).retrieve(Subtask.parse("pick_up(Mug-1)"), "make-coffee", 1)
    assert [r.similarity for r in found[:5]] == [1.0] * 5
    assert found[-1].demonstration == "s" and found[-1].reach is Reach.SCENE
    assert 0.5 <= found[-1].similarity < 0.8
    assert "s" not in {name for name, _ in order("pick_up(Mug-1)", "make-coffee", 1)}


def test_the_same_skill_on_other_things_says_what_it_needs_and_no_more() -> None:
    found = retriever().retrieve(Subtask.parse("pick_up(Cup-1)"), "toast-bread", 0)
    assert {r.reach for r in found} == {Reach.ROLE}
    assert str(found[0].subtask).startswith("pick_up(Mug"), "what is most like a cup comes first"
    assert {r.demonstration for r in found} == {"w", "c1", "c2", "s"}
    assert len(retriever(roles=2).retrieve(Subtask.parse("pick_up(Cup-1)"), "t", 0)) == 2
    assert not retriever(roles=0).retrieve(Subtask.parse("pick_up(Cup-1)"), "toast-bread", 0)
    with pytest.raises(InputError, match="roles"):
        RetrievalConfig(roles=-1)


def test_k_and_steps_per_demonstration() -> None:
    assert order("pick_up(Mug-1)", "make-coffee", 1, k=3) == [("c1", 1), ("c2", 1), ("c1", 3)]
    found = order("pick_up(Mug-1)", "make-coffee", 1, per_demonstration=1)
    assert found[:3] == [("c1", 1), ("c2", 1), ("w", 0)]


def test_nothing_above_the_floor() -> None:
    assert order("slice_obj(Lettuce-1)", "make-salad", 0) == []
    assert order("pick_up(Mug-1)", "make-coffee", 1, floor=1.1) == []


def test_only_the_same_skill_unless_asked() -> None:
    assert order("toggle_on(Mug-1)", "make-coffee", 0, floor=0.1) == []
    assert order("toggle_on(Mug-1)", "make-coffee", 0, floor=0.1, same_skill=False) != []


def test_put_on_and_put_in_are_one_skill() -> None:
    put = Subtask.parse("put_on(Mug-1, CoffeeMachine-1)")
    found = scenes(retriever().retrieve(put, "make-coffee", 4))
    assert [(r.index, r.similarity) for r in found] == [(4, 1.0), (4, 1.0)]


def test_later_is_the_rest_of_that_run() -> None:
    first = retriever().retrieve(Subtask.parse("pick_up(Mug-1)"), "make-coffee", 3)[0]
    assert [str(s) for s in first.later] == list(COFFEE[3:])
    assert first.graph is MEMORY[1].steps[3].graph
    assert first.task == "make-coffee"


def test_the_picture_and_what_came_after_are_handed_on() -> None:
    coffee = sample("make-coffee", COFFEE, "c")
    viewed = replace(coffee.steps[3], view=View(caption="A mug.", captioner="said"))
    final = SceneGraph(())
    steps = (*coffee.steps[:3], viewed, coffee.steps[4])
    memory = [replace(coffee, steps=steps, final=final)]
    found = EmbeddingRetriever(memory, HashedTextEncoder(), DOMAIN)
    first, second = found.retrieve(Subtask.parse("pick_up(Mug-1)"), "make-coffee", 3)
    assert (first.index, second.index) == (3, 1)
    assert first.view is viewed.view and second.view is None
    assert first.after is coffee.steps[4].whole
    last = found.retrieve(Subtask.parse("put_in(Mug-1, CoffeeMachine-1)"), "make-coffee", 4)[0]
    assert last.after is final
    unwatched = EmbeddingRetriever([coffee], HashedTextEncoder(), DOMAIN)
    assert unwatched.retrieve(coffee.steps[4].subtask, "make-coffee", 4)[0].after is None


def test_numbers_are_stripped() -> None:
    step = Subtask.parse("put_on(Pot-2, StoveBurner-4)")
    assert subtask_words(step, DOMAIN) == "put Pot StoveBurner"


def test_from_a_store(tmp_path: Path) -> None:
    with open_store(tmp_path / "demos.db", create=True) as store:
        with pytest.raises(MemoryFileError, match="holds no demonstrations"):
            EmbeddingRetriever(store, HashedTextEncoder(), DOMAIN)
        for d in MEMORY:
            store.add(d)
        found = EmbeddingRetriever(store, HashedTextEncoder(), DOMAIN).retrieve(
            Subtask.parse("pick_up(Mug-1)"), "make-coffee", 1
        )
    assert [(r.demonstration, r.index) for r in found[:2]] == [("c1", 1), ("c2", 1)]


def test_the_order_of_the_memory_does_not_matter() -> None:
    back = EmbeddingRetriever(MEMORY[::-1], HashedTextEncoder(), DOMAIN)
    subtask = Subtask.parse("pick_up(Mug-1)")
    assert back.retrieve(subtask, "make-coffee", 1) == retriever().retrieve(
        subtask, "make-coffee", 1
    )


def test_bad_config() -> None:
    with pytest.raises(InputError, match="at least 1"):
        RetrievalConfig(k=0)
