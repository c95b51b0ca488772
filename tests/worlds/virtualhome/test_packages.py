"""Programs and start graphs out of the packages' files, and what is said of files that are none."""

import json
from pathlib import Path

import pytest
from flats import (
    CUP,
    FETCH,
    FRIDGE,
    LAMP,
    LIGHT,
    ME,
    PLATE,
    graph,
    installed,
)

from forestall.errors import FileFormatError, InputError
from forestall.types.plan import Subtask
from forestall.worlds.virtualhome.changes import changes
from forestall.worlds.virtualhome.packages import Line, Packages, Program, read_program, read_start
from forestall.worlds.virtualhome.plans import plan


def test_programs_are_read_with_their_task_and_steps(tmp_path: Path) -> None:
    packages = Packages.found(installed(tmp_path, {"b": LIGHT, "a": FETCH}))
    first, second = packages.programs()
    assert (first.name, first.task, second.task) == ("a", "Fetch a plate", "Light")
    assert first.lines[0] == Line("WALK", (("fridge", FRIDGE),))
    assert str(first.lines[3]) == f"[GRAB] <plate> ({PLATE})"
    assert second.ids == {2, LAMP}


def test_a_program_becomes_a_plan_of_who_acts(tmp_path: Path) -> None:
    packages = Packages.found(installed(tmp_path, {"a": FETCH, "b": LIGHT}))
    fetch, light = packages.programs()
    made = plan(fetch, read_start(fetch.graphs))
    assert made.subtasks[0] == Subtask("walk_towards", (f"character-{ME}", f"fridge-{FRIDGE}"))
    assert made.goal == "Fetch a plate"
    assert plan(light, read_start(light.graphs)).subtasks[0].skill == "walk_into"


def test_packages_that_are_not_there_say_how_to_get_them(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="pip install --no-deps"):
        Packages.found(tmp_path)
    (tmp_path / "virtualhome_eval").mkdir()
    (tmp_path / "virtualhome").mkdir()
    with pytest.raises(InputError, match="no program is there"):
        Packages.found(tmp_path).programs()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "a program is a line with its task"),
        ("Light\non\n", "a program is a line with its task"),
        ("Light\n\n[SWITCHON] lamp", "line 3: '.SWITCHON. lamp' is no step"),
    ],
)
def test_a_file_that_is_no_program_is_refused(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "p.txt"
    file.write_text(text)
    with pytest.raises(FileFormatError, match=said):
        read_program(file, file)


def test_a_graph_that_is_none_is_refused_with_its_place(tmp_path: Path) -> None:
    file = tmp_path / "g.json"
    start = graph()
    start["edges"].append({"from_id": PLATE, "relation_type": "ON", "to_id": 99})
    file.write_text(json.dumps({"init_graph": start}))
    with pytest.raises(FileFormatError, match="edge 4 ON 99 leads to no node"):
        read_start(file)
    start["edges"][-1] = {"from_id": "plate"}
    file.write_text(json.dumps({"init_graph": start}))
    with pytest.raises(FileFormatError, match=r"edges\[8\]: an edge has from_id"):
        read_start(file)
    file.write_text("{}")
    with pytest.raises(FileFormatError, match="lacks 'init_graph'"):
        read_start(file)


def test_every_change_is_one_and_leaves_the_start_alone(tmp_path: Path) -> None:
    packages = Packages.found(installed(tmp_path, {"a": FETCH, "b": LIGHT}))
    fetch, light = packages.programs()
    start = read_start(fetch.graphs)
    found = {c.sort: c for c in changes(fetch, start)}
    assert set(found) == {"no WALK", "no OPEN", "no GRAB", "open already", "sitting"}
    assert [x.verb for x in found["no OPEN"].program.lines] == ["WALK", "FIND", "GRAB"]
    assert found["open already"].start.nodes[FRIDGE].states == {"OPEN", "CLEAN"}
    assert start.nodes[FRIDGE].states == {"CLOSED", "CLEAN"}
    more = {c.sort: c for c in changes(light, start)}
    assert more["on already"].start.nodes[LAMP].states == {"ON", "PLUGGED_IN"}
    assert more["unplugged"].start.nodes[LAMP].states == {"OFF", "PLUGGED_OUT"}
    assert (ME, "HOLDS_RH", PLATE) in more["hands full"].start.edges
    assert (ME, "HOLDS_LH", CUP) in more["hands full"].start.edges


def test_what_is_grabbed_is_shut_into_what_is_never_opened(tmp_path: Path) -> None:
    packages = Packages.found(installed(tmp_path, {"b": LIGHT}))
    start = read_start(packages.programs()[0].graphs)
    grab = Program("x", "Cup", (Line("GRAB", (("cup", CUP),)),), tmp_path)
    shut = next(c for c in changes(grab, start) if c.sort == "shut in")
    assert (CUP, "INSIDE", FRIDGE) in shut.start.edges
    assert shut.about == {FRIDGE}
