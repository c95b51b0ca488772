"""Demonstrations from everything that shows one."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from forestall.assembly.sources import demonstrations_from, gathered, written
from forestall.errors import FileFormatError, InputError
from forestall.memory.store import open_store
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.types.symbolic import scene_graph
from stranger import TWELVE, scene


def test_a_list_of_steps_is_one_demonstration_and_a_list_of_lists_are_many() -> None:
    (one,) = demonstrations_from(TWELVE[0])
    assert [str(s.subtask) for s in one.steps] == [
        "unscrew(lid-1, hole-1)",
        "grasp(peg-1)",
        "insert(peg-1, hole-1, driver-1)",
    ]
    assert one.final == scene_graph(TWELVE[0][-1])
    assert one.steps[1].graph.subtask == one.steps[1].subtask
    found = demonstrations_from(TWELVE)
    assert len(found) == len({d.id for d in found}) == 12


def test_a_category_means_the_only_node_of_it() -> None:
    (one,) = demonstrations_from([("grasp(peg)", scene())])
    assert one.steps[0].subtask == Subtask.parse("grasp(peg-1)")
    with pytest.raises(InputError, match=r"step 1: 'peg' of grasp.peg. can be peg-1 or peg-2"):
        demonstrations_from([("grasp(peg)", scene(more=["peg-2"]))])


def test_a_mixture_of_files_folders_and_lists(tmp_path: Path) -> None:
    with open_store(tmp_path / "memory.db", create=True) as store:
        for d in demonstrations_from(TWELVE[:3]):
            store.add(d)
    folder = tmp_path / "more"
    folder.mkdir()
    steps = [{"subtask": "grasp(peg-1)", "scene": scene()}]
    (folder / "a.json").write_text(json.dumps({"task": "t", "steps": steps}))
    named = [{"subtask": "grasp(peg-1)", "scene": "scenes/one.json"}]
    (folder / "b.json").write_text(json.dumps({"task": "u", "steps": named}))
    (folder / "scenes").mkdir()
    (folder / "scenes" / "one.json").write_text(json.dumps(scene()))
    graph = demonstrations_from(TWELVE[3])[0].steps[0].graph
    (folder / "c.json").write_text(json.dumps(graph.to_json()))
    (folder / "notes.txt").write_text("not a demonstration")
    found = demonstrations_from([tmp_path / "memory.db", str(folder), TWELVE[4]])
    assert len(found) == 3 + 3 + 1
    assert [d.task for d in found[3:5]] == ["t", "u"]
    assert found[3].steps[0].graph == found[4].steps[0].graph
    assert found[5].steps[0].graph == graph


def test_the_same_in_several_files_is_one_and_a_different_one_of_its_name_has_a_number(
    tmp_path: Path,
) -> None:
    steps = [{"subtask": "grasp(peg-1)", "scene": scene()}]
    for name in ("a.json", "b.json"):
        (tmp_path / name).write_text(json.dumps({"task": "t", "steps": steps}))
    (one,), repeated = gathered([tmp_path / "a.json", tmp_path / "a.json", tmp_path / "b.json"])
    assert repeated == 2
    with open_store(tmp_path / "memory.db", create=True) as store:
        store.add(one)
    assert demonstrations_from([tmp_path, tmp_path / "memory.db"]) == [one]
    other = replace(demonstrations_from(TWELVE[0])[0], id=one.id)
    found, repeated = gathered([one, other, one, other])
    assert [d.id for d in found] == [one.id, f"{one.id}-2"] and repeated == 2


BAD: list[tuple[Any, str]] = [
    ([], "no demonstration was found"),
    (3, "int shows no demonstration"),
    ({"steps": []}, "needs one step"),
    ({"steps": "grasp"}, "needs 'steps'"),
    ({"stepps": []}, "no entry 'stepps'"),
    ([("grasp(peg-1)", scene()), ("insert", 1, 2), scene()], "step 2: a subtask and its scene"),
    ([("grasp peg-1", scene())], "step 1: cannot read 'grasp peg-1'"),
    ([("grasp(peg-1)", {"things": []})], "step 1: unknown entry of a scene 'things'"),
    ([("grasp(peg-1)", "a.json")], "the scene 'a.json' is a name"),
]


@pytest.mark.parametrize(("source", "said"), BAD)
def test_what_shows_no_demonstration_is_refused_with_its_place(source: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        demonstrations_from(source)


def test_files_that_show_none(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="there is no such file"):
        demonstrations_from(tmp_path / "gone.db")
    for name, text, said in (
        ("a.json", "{", "damaged or truncated"),
        ("b.json", '{"nodes": []}', "neither a demonstration"),
        (
            "c.json",
            '{"steps": [{"subtask": "x(y)", "scene": "../c.json"}]}',
            "is no file inside",
        ),
        ("d.txt", "", "files may be"),
    ):
        (tmp_path / name).write_text(text)
        with pytest.raises(FileFormatError, match=said):
            demonstrations_from(tmp_path / name)
    empty = tmp_path / "empty"
    empty.mkdir()
    for source in (empty, (empty,)):
        with pytest.raises(InputError, match=f"no demonstration was found in {empty}$"):
            demonstrations_from(source)


def test_graphs_are_taken_as_they_are() -> None:
    graph = scene_graph(scene())
    assert isinstance(graph, SceneGraph)
    assert written([("grasp(peg-1)", graph)]).steps[0].whole == graph
