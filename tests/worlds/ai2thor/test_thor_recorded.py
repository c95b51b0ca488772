"""Episodes in RoboFail's layout: demonstrations, labelled failures, and judges on them."""

import json
import os
import pickle
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from robofail_set import BOIL_WATER, write_episode

from forestall.assembly.configuration import Given
from forestall.assembly.recorded import (
    FAILING,
    LABELS,
    MEMORY,
    REPORT,
    Opened,
    Progress,
    SeenRun,
    import_into,
    named_data,
    open_data,
    report_of,
)
from forestall.cli.main import call
from forestall.errors import InputError, UnknownNameError
from forestall.experiments.recorded import JudgedRun, judge_recorded, lines_of
from forestall.memory.store import open_store
from forestall.types.demonstration import Demonstration
from forestall.types.graph import SceneGraph
from forestall.types.recorded import ReadReport

PLAN = BOIL_WATER[:7]
"""The pot is filled and taken out again."""


class Runs:
    """A program, for Python's own unpickler."""

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.system, ("touch ran",)


def _broken(root: Path, name: str = "fillPot-5") -> None:
    """An episode whose one event is a program."""
    folder = root / "fillPot" / name
    (folder / "events").mkdir(parents=True)
    (folder / "events" / "step_1.pickle").write_bytes(pickle.dumps([{"a": Runs()}]))
    for file in ("interact", "nav"):
        (folder / f"{file}_actions.pickle").write_bytes(pickle.dumps({}))
    about = {"scene": "FloorPlan1", "actions": ["(navigate_to_obj, Pot)"]}
    label = {"gt_failure_step": "00:01", "gt_failure_reason": "Dropped Pot"}
    (folder / "task.json").write_text(json.dumps(about | label))


@dataclass
class Data:
    """The set as it was seen once, since looking takes its time."""

    opened: Opened
    runs: list[SeenRun]
    report: ReadReport


class Again(Opened):
    """A data set that was seen already."""

    runs: tuple[SeenRun, ...] = ()
    told = ReadReport()

    def seen(
        self, report: ReadReport, progress: Progress = lambda done, total, what: None
    ) -> Iterator[SeenRun]:
        report.good, report.failing = self.told.good, self.told.failing
        report.unread, report.notes = self.told.unread, self.told.notes
        yield from self.runs


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Data:
    root = tmp_path_factory.mktemp("robofail")
    write_episode(root, "fillPot-1", PLAN)
    write_episode(root, "fillPot-2", PLAN, start=(0.5, -0.5))
    write_episode(
        root, "fillPot-3", PLAN, nothing=4, step=["00:15"], reason="The faucet did not turn on."
    )
    write_episode(
        root, "fillPot-4", PLAN, drops=2, step="00:09", reason="Dropped Pot", chosen_failure="drop"
    )
    _broken(root)
    opened, report = open_data("robofail", root, Given()), ReadReport()
    runs = list(opened.seen(report))
    Again.runs, Again.told = tuple(runs), report
    return Data(Again(opened.data, opened.domain, opened.eyes), runs, report)


@pytest.fixture(scope="module")
def out(data: Data, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("imported") / "new"
    import_into(data.opened, folder)
    return folder


@pytest.fixture(scope="module")
def demonstrations(out: Path) -> list[Demonstration]:
    with open_store(out / MEMORY) as store:
        return list(store.all())


def state(graph: SceneGraph, name: str, attribute: str) -> str | None:
    """The state of a thing in a graph."""
    found = graph.get(name)
    assert found is not None
    return found.state(attribute)


def test_good_runs_become_demonstrations(demonstrations: list[Demonstration]) -> None:
    assert [(d.id, d.task, len(d.steps)) for d in demonstrations] == [
        ("fillPot-1", "fill-pot", 7),
        ("fillPot-2", "fill-pot", 7),
    ]
    steps = demonstrations[0].steps
    assert str(steps[1].subtask) == "pick_up(Pot-1)"
    assert str(steps[3].subtask) == "put_in(Pot-1, Sink-1)"


def test_each_step_has_what_was_seen_before_it(demonstrations: list[Demonstration]) -> None:
    steps = demonstrations[0].steps
    held = [s.whole.in_hands(("gripper",)) for s in steps]
    assert held == [(), (), ("Pot-1",), ("Pot-1",), (), (), ()]
    filled = [state(s.whole, "Pot-1", "filled") for s in (steps[1], steps[6])]
    assert filled == ["empty", "water"]
    toggled = [state(s.whole, "Faucet-1", "toggled") for s in steps[4:]]
    assert toggled == ["off", "on", "off"]
    assert ("Pot-1", "inside", "Sink-1") in {
        (r.subject, r.predicate, r.object) for r in steps[6].whole.relations
    }
    final = demonstrations[0].final
    assert final is not None and final.in_hands(("gripper",)) == ("Pot-1",)


def test_things_are_where_the_metadata_has_them(data: Data) -> None:
    """The pot of the stand-in's kitchen: x -0.60, z 2.02 there, on a worktop of 0.90 m."""
    pot = data.runs[0].run.scenes[1].get("Pot-1")
    assert pot is not None
    assert pot.centroid_m == pytest.approx((-0.60, 2.02, 0.965), abs=0.06)


def test_failing_runs_are_labelled_and_keep_their_scenes(out: Path) -> None:
    labels = json.loads((out / LABELS).read_text())
    said = [(x["run"], x["fails_at_step"], x["seconds"], x["kind"]) for x in labels]
    assert said == [("fillPot-3", 5, [15, 15], ""), ("fillPot-4", 3, [9, 9], "drop")]
    assert labels[0]["why"] == "The faucet did not turn on."
    assert labels[0]["plan"][4] == "toggle_on(Faucet)"
    scenes = sorted(p.name for p in (out / FAILING / "fillPot-3").iterdir())
    assert scenes == [*(f"00{n}.json" for n in range(1, 8)), "plan.txt"]


def test_what_could_not_be_used_is_counted_and_told_with_its_name(out: Path) -> None:
    report = json.loads((out / REPORT).read_text())
    assert (report["good"], report["failing"], report["not_read"]) == (2, 2, 1)
    assert report["why_not"][0]["run"] == "fillPot-5"
    assert f"names '{os.system.__module__}.system'" in report["why_not"][0]["why"]
    assert not Path("ran").exists()


def test_the_imported_scenes_are_checked_with_the_imported_memory(
    out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = out / FAILING / "fillPot-4"
    scene, memory = str(folder / "004.json"), str(out / MEMORY)
    said = ["--subtask", "put_in(Pot, Sink)", "--memory", memory, "--domain", "ai2thor", "--json"]
    code = call(["check", scene, *said])
    told = json.loads(capsys.readouterr().out)
    assert code == 1
    assert told["scenes"][0]["outcome"] in ("replan", "hold")


@pytest.fixture(scope="module")
def judged(data: Data) -> list[JudgedRun]:
    def silent(done: int, total: int, what: str) -> None: ...

    return judge_recorded(data.opened, [], ReadReport(), silent, silent)


def test_every_run_is_judged_at_every_step(judged: list[JudgedRun]) -> None:
    assert [(j.judged.run, len(j.judged.said), j.fails) for j in judged] == [
        ("fillPot-1", 7, None),
        ("fillPot-2", 7, None),
        ("fillPot-3", 7, 4),
        ("fillPot-4", 7, 2),
    ]
    assert {j.judged.program for j in judged} == {"fillPot-1", "fillPot-2", "fill-pot"}
    assert [len(j.until(1).said) for j in judged] == [7, 7, 6, 4]


def test_failures_of_carrying_out_show_before_the_step_after(judged: list[JudgedRun]) -> None:
    lines = {line.judge: line for line in lines_of(judged)}
    together = lines["any of three"]
    assert together.by_next.value == 1.0
    assert (together.by_next.n, together.false_alarms.n) == (2, 2)
    assert lines["plan check"].false_alarms.value == 0.0
    assert together.ever.low is not None
    assert {"judge", "by_the_step_after", "false_alarms"} <= together.to_json().keys()


def test_a_data_set_of_which_nothing_can_be_read_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _broken(tmp_path / "set")
    assert call(["import", "robofail", str(tmp_path / "set"), str(tmp_path / "out")]) == 0
    told = capsys.readouterr().out
    assert "0 good runs" in told and "1 runs could not be used" in told
    assert call(["bench", "detection", "--data", f"robofail:{tmp_path / 'set'}"]) == 2
    assert "no run of robofail can be judged: fillPot-5" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["--data", "robofail"], "a data set and its folder are expected"),
        (["--data", "robofial:x"], "unknown data set 'robofial'"),
        (["--data", "robofail:nowhere"], "nowhere is no folder"),
        (["--data", "robofail:x", "--seeds", "3"], "--seeds says nothing of recorded runs"),
    ],
)
def test_what_the_bench_cannot_use_is_told(
    arguments: list[str], why: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(["bench", "detection", *arguments]) == 2
    assert why in capsys.readouterr().err


def test_a_folder_that_is_there_is_not_written_to(data: Data, out: Path) -> None:
    with pytest.raises(InputError, match="name a new folder"):
        import_into(data.opened, out)


def test_data_are_named_with_their_folder() -> None:
    assert named_data("robofail:/a:b") == ("robofail", Path("/a:b"))
    with pytest.raises(UnknownNameError):
        open_data("robofial", Path(), Given())


def test_a_report_is_plain(data: Data) -> None:
    assert report_of(data.report)["failing"] == 2
