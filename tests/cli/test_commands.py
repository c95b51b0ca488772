"""The command line without pictures: listings, comparison, errors and exit codes."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from forestall.assembly.sources import demonstrations_from
from forestall.cli.main import call
from forestall.memory.store import open_store
from forestall.types.facts import GRIPPER
from forestall.types.graph import ObjectNode, Relation, SceneGraph
from forestall.types.plan import Subtask
from stranger import TWELVE


def graph_file(folder: Path, name: str, *, bowl: bool) -> str:
    nodes = [
        ObjectNode("Microwave-1", "Microwave", (("open", "open"),)),
        ObjectNode("Plate-1", "Plate", (("dirty", "clean"),)),
        ObjectNode(GRIPPER, "Gripper"),
    ]
    relations = [Relation("Plate-1", "held_by", GRIPPER)]
    if bowl:
        nodes.append(ObjectNode("Bowl-1", "Bowl"))
        relations.append(Relation("Bowl-1", "inside", "Microwave-1"))
    graph = SceneGraph(
        tuple(nodes), tuple(relations), Subtask.parse("put_in(Plate-1, Microwave-1)")
    )
    path = folder / name
    path.write_text(json.dumps(graph.to_json()))
    return str(path)


def test_listings_are_complete(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["tasks", "--json"]) == 0
    tasks = json.loads(capsys.readouterr().out)
    assert len(tasks) == 16 and all(t["plan"] and t["literals"] for t in tasks)
    assert call(["scenarios", "--task", "heat-potato", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert {r["task"] for r in rows} == {"heat-potato"} and len(rows) >= 3
    assert call(["scenarios"]) == 0
    assert "mug-dropped" in capsys.readouterr().out
    assert call(["scenarios", "--schema"]) == 0
    assert "faults" in json.loads(capsys.readouterr().out)["properties"]


def test_compare_prints_score_and_difference(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one = graph_file(tmp_path, "a.json", bowl=True)
    two = graph_file(tmp_path, "b.json", bowl=False)
    assert call(["compare", one, two, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert 0 < data["score"] < 0.9
    assert any("Bowl-1 is inside Microwave-1" in d["text"] for d in data["discrepancies"])
    assert call(["compare", one, one]) == 0
    assert capsys.readouterr().out.startswith("score 1.000")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["run", "heat-potatoe"], "did you mean heat-potato"),
        (["run", "heat-potato", "--scenario", "mug-droped"], "did you mean mug-dropped"),
        (["run", "heat-potato", "--scenario", "mug-dropped"], "is for the task make-coffee"),
        (
            ["run", "heat-potato", "--strategy", "psychic"],
            "known: none, online, online-scene",
        ),
        (["run", "heat-potato", "--seed", "-1"], "seed -1"),
        (["run", "heat-potato", "--threshold", "2"], "threshold 2"),
        (["run", "heat-potato", "--sed", "1"], "--seed"),
        (["check", "x", "--strategy", "watch"], "Name the strategy with --strategy.name NAME."),
        (["compare", "x", "y", "--strategy", "watch"], "Unknown option: --strategy."),
        (["scenarios", "--strategy=watch"], "Unknown option: --strategy"),
        (["rnu"], "run"),
        (["tasks", "extra"], "extra"),
        (["compare", "absent.json", "absent.json"], "cannot read scene graph"),
        (["demos", "record", "x.db", "--kitchens", "0"], "at least 1"),
        (["demos", "list", "absent.db"], "absent.db"),
        (["bench", "speed", "--repeat", "0"], "at least 1"),
    ],
)
def test_wrong_input_is_one_clear_line(
    arguments: list[str], says: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert call(arguments) in (2, 3)
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("forestall: error: ")
    assert printed.err.count("\n") == 1
    assert says in printed.err


def test_a_memory_is_listed_with_what_tells_its_demonstrations_apart(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    memory = tmp_path / "pegs.db"
    with open_store(memory, create=True) as store:
        for d in demonstrations_from(TWELVE):
            store.add(d)
        ids = [d.id for d in store.all()]
    assert call(["demos", "list", str(memory)]) == 0
    told = capsys.readouterr().out
    assert len(ids) == len(set(ids)) == 12 and all(i in told for i in ids)


@pytest.mark.parametrize(
    ("content", "says"),
    [(b"", "empty"), (b"hello, this is no database at all" * 9, "SQLite"), (None, "memory.db")],
)
def test_a_memory_that_cannot_be_used_ends_a_run_before_it_starts(
    content: bytes | None, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    memory = tmp_path / "memory.db"
    if content is not None:
        memory.write_bytes(content)
    out = tmp_path / "run"
    assert call(["run", "toast-bread", "--memory", str(memory), "--out", str(out)]) == 3
    printed = capsys.readouterr()
    assert printed.out == "" and printed.err.count("\n") == 1
    assert says in printed.err


def test_a_folder_that_cannot_be_made_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("x")
    out = tmp_path / "file" / "run"
    assert call(["run", "toast-bread", "--strategy", "none", "--out", str(out)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_dangling_relation_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.json"
    data = json.loads(Path(graph_file(tmp_path, "ok.json", bowl=True)).read_text())
    data["relations"].append(["Bowl-1", "inside", "Oven-1"])
    path.write_text(json.dumps(data))
    assert call(["compare", str(path), str(path)]) == 2
    assert "Oven-1" in capsys.readouterr().err


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys; from forestall.cli.main import call; call(['--help']);"
        "heavy = {'numpy', 'scipy', 'mujoco', 'pydantic', 'PIL', 'networkx'} & set(sys.modules);"
        "sys.exit(f'imported: {heavy}' if heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "run" in done.stdout


def test_the_cases_of_the_experiments_are_counted(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["cases", "list", "--json"]) == 0
    rows = {r["set"]: r for r in json.loads(capsys.readouterr().out)}
    assert (rows["robofail"]["starts"], rows["robofail"]["test"]) == (100, 20_000)
    assert (rows["eyes"]["starts"], rows["eyes"]["test"]) == (7, 40_000)
    assert rows["everyday"]["fails"] is False and rows["composed"]["fails"] is True
    assert call(["cases", "list", "--set", "everyday", "--kinds"]) == 0
    assert "second-other" in capsys.readouterr().out
    assert call(["cases", "list", "--set", "everydya"]) == 2
    assert "did you mean everyday" in capsys.readouterr().err


def test_starts_are_judged_by_playing_them(capsys: pytest.CaptureFixture[str]) -> None:
    flags = ["--task", "heat-potato", "--world", "symbolic", "--rounds", "2", "--quiet"]
    assert call(["cases", "judge", "--set", "eyes", "long-undisturbed", *flags]) == 0
    assert capsys.readouterr().out.splitlines()[1].split() == ["eyes", "2", "2", "0", "0"]
    assert call(["cases", "judge", "--set", "eyes", *flags, "--json"]) == 0
    assert [r["success"] for r in json.loads(capsys.readouterr().out)] == [False, False]
    assert call(["cases", "judge", "--set", "long", *flags]) == 2
    assert "no start is of these sets and tasks" in capsys.readouterr().err


def test_sets_are_drawn_into_a_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from forestall.experiments import starts
    from forestall.tasks import drawing
    from forestall.testing.part import SymbolicWorlds

    monkeypatch.setattr(starts, "_world", lambda *_: SymbolicWorlds())
    sizes = dict.fromkeys(drawing.SIZES, 2)
    monkeypatch.setattr(drawing, "SIZES", sizes)
    assert call(["cases", "draw", str(tmp_path), "--task", "boil-water", "--quiet"]) == 0
    assert f"scenarios written to {tmp_path}" in capsys.readouterr().out
    text = (tmp_path / "everyday" / "boil-water.toml").read_text()
    assert text.count("[[scenarios]]") == 2 and 'task = "boil-water"' in text
