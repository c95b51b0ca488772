"""The folder of a run: written as it happens, read back, and everything that can be wrong in it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from forestall.errors import FileFormatError, InputError
from forestall.records.codec import RECORD_FORMAT, record_to_json
from forestall.records.derived import alarms, replans
from forestall.records.record import (
    LINES_NAME,
    RECORD_NAME,
    RunRecorder,
    read_record,
    write_record,
)
from forestall.types.episode import EpisodeEnd, EpisodeRecord, StoredObservation
from report import records


def unseen(record: EpisodeRecord) -> EpisodeRecord:
    """The record without its observations: arrays do not compare."""
    return replace(
        record, boundaries=tuple(replace(b, observation=None) for b in record.boundaries)
    )


def test_write_and_read_again(tmp_path: Path) -> None:
    record = records.potato_record()
    path = write_record(tmp_path / "run", record, page="index.html")
    found = read_record(path)
    assert found == read_record(path.parent)
    assert json.loads(path.read_text("utf-8"))["page"] == "index.html"
    for boundary in found.boundaries:
        assert isinstance(boundary.observation, StoredObservation)
        for frame in boundary.observation.frames:
            assert frame.picture is not None
            assert (path.parent / frame.picture).read_bytes()[:2] == b"\xff\xd8"
    assert unseen(found) == unseen(record)
    again = write_record(tmp_path / "again", record, page="index.html")
    assert path.read_bytes() == again.read_bytes()
    assert not [p for p in path.parent.iterdir() if p.name.startswith(".")]


@pytest.mark.parametrize(
    "make",
    [records.unjudged_record, records.troubled_record, records.empty_record],
)
def test_odd_runs_are_written_too(tmp_path: Path, make: object) -> None:
    record = make()  # type: ignore[operator]
    path = write_record(tmp_path, record)
    assert unseen(read_record(path)) == unseen(record)
    data = json.loads(path.read_text("utf-8"))
    assert data["perception"].keys() >= {"segmenter", "state_estimator"}
    assert data["complete"] is True


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "is empty"),
        ('{"kind": "episode", "form', "damaged or truncated"),
        ("[]", "not the record of a run"),
        ('{"format": 1, "nodes": []}', "not the record of a run"),
        (json.dumps({"kind": "episode", "format": RECORD_FORMAT + 1}), "this version reads"),
        (json.dumps({"kind": "episode", "format": 1}), "this version reads 3"),
        (json.dumps({"kind": "episode", "format": RECORD_FORMAT}), "lacks task"),
    ],
)
def test_a_file_that_is_no_record(tmp_path: Path, text: str, says: str) -> None:
    (tmp_path / RECORD_NAME).write_text(text, encoding="utf-8")
    with pytest.raises(FileFormatError, match=says):
        read_record(tmp_path)


def test_no_file_and_no_text(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="cannot read record of a run"):
        read_record(tmp_path / "nowhere")
    with pytest.raises(FileFormatError, match="cannot read record of a run"):
        read_record(tmp_path)
    (tmp_path / RECORD_NAME).write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FileFormatError, match="not UTF-8 text"):
        read_record(tmp_path)


def test_a_killed_run_reads_back_as_far_as_it_came(tmp_path: Path) -> None:
    record = records.potato_record()
    records.follow(RunRecorder(tmp_path), record, 9)
    found = read_record(tmp_path)
    assert (found.end, found.success, found.final) == (EpisodeEnd.UNFINISHED, None, None)
    assert unseen(found) == replace(
        unseen(record),
        boundaries=unseen(record).boundaries[:9],
        executed=record.executed[:8],
        end=EpisodeEnd.UNFINISHED,
        success=None,
        weak_success=None,
        events=(),
        simulated_s=36.0,
        compute_s=record.boundaries[8].compute_s,
    )
    assert [a.cause for a in alarms(found)] == [records.CAUSE]
    assert replans(found) == 1
    data = record_to_json(found)
    assert (data["complete"], data["end"]) == (False, None)
    assert (tmp_path / data["boundaries"][3]["image"]).exists()
    assert data.keys() == record_to_json(record).keys()


@pytest.mark.parametrize("boundaries", [1, 4, 9])
def test_a_killed_run_has_the_seconds_that_the_whole_one_had_then(
    tmp_path: Path, boundaries: int
) -> None:
    record = records.potato_record()
    records.follow(RunRecorder(tmp_path), record, boundaries)
    killed = read_record(tmp_path)
    assert killed.compute_s == record.boundaries[boundaries - 1].compute_s
    assert [b.seconds for b in killed.boundaries] == [
        b.seconds for b in record.boundaries[:boundaries]
    ]


@pytest.mark.parametrize("cut", [1, 40, "inside a character"])
def test_a_line_that_was_being_written_is_left_out(tmp_path: Path, cut: int | str) -> None:
    records.follow(RunRecorder(tmp_path), records.troubled_record(), 2)
    lines = tmp_path / LINES_NAME
    whole = read_record(lines)
    head, last = lines.read_bytes().rstrip(b"\n").rsplit(b"\n", 1)
    size = cut if isinstance(cut, int) else last.index("熱".encode()) + 1
    lines.write_bytes(head + b"\n" + last[:size])
    found = read_record(tmp_path)
    assert found.boundaries == whole.boundaries
    assert found.executed == whole.executed[:-1]


def test_damage_in_the_middle_is_told_with_its_line(tmp_path: Path) -> None:
    records.follow(RunRecorder(tmp_path), records.potato_record(), 3)
    lines = tmp_path / LINES_NAME
    rows = lines.read_text(encoding="utf-8").split("\n")
    lines.write_text("\n".join([rows[0], rows[1][:50], *rows[2:]]), encoding="utf-8")
    with pytest.raises(FileFormatError, match="line 2"):
        read_record(tmp_path)
    lines.write_text(rows[0][:20], encoding="utf-8")
    with pytest.raises(FileFormatError, match="nothing of the run is left"):
        read_record(tmp_path)


def test_the_recorder_finishes_with_the_whole_record(tmp_path: Path) -> None:
    record = records.potato_record()
    recorder = RunRecorder(tmp_path, page="index.html")
    records.follow(recorder, record, 99)
    pictures = sorted((tmp_path / "images").iterdir())
    recorder.on_end(record)
    assert unseen(read_record(tmp_path)) == unseen(record)
    assert sorted((tmp_path / "images").iterdir()) == pictures
    assert json.loads((tmp_path / LINES_NAME).read_text("utf-8").splitlines()[-1]) == {
        "event": "end",
        "end": "plan finished",
    }


@pytest.mark.parametrize("make", [records.potato_record, records.looked_after_record])
def test_lines_and_record_say_the_same_of_a_boundary(tmp_path: Path, make: object) -> None:
    record = make()  # type: ignore[operator]
    records.follow(RunRecorder(tmp_path), record)
    whole = json.loads((tmp_path / RECORD_NAME).read_text("utf-8"))["boundaries"]
    rows = [json.loads(r) for r in (tmp_path / LINES_NAME).read_text("utf-8").splitlines()]
    lines = [r["boundary"] for r in rows if r["event"] == "boundary"]
    assert [{**b, "mark": None} for b in whole] == lines
    (tmp_path / RECORD_NAME).unlink()
    assert read_record(tmp_path).boundaries == read_record(tmp_path / LINES_NAME).boundaries


def test_a_second_run_in_the_same_folder_replaces_the_first(tmp_path: Path) -> None:
    record = records.potato_record()
    recorder = RunRecorder(tmp_path)
    recorder.on_start(records.begun(record))
    recorder.on_end(record)
    records.follow(recorder, record, 2)
    found = read_record(tmp_path)
    assert found.end is EpisodeEnd.UNFINISHED
    assert len(found.boundaries) == 2


def test_no_page_stays_beside_the_record_of_another_run(tmp_path: Path) -> None:
    write_record(tmp_path, records.potato_record())
    (tmp_path / "index.html").touch()
    for page in ("index.html", str(tmp_path / "index.html")):
        (tmp_path / "index.html").touch()
        records.follow(RunRecorder(tmp_path, page=page), records.potato_record(), 1)
        assert not (tmp_path / "index.html").exists()
        assert not (tmp_path / RECORD_NAME).exists()


def test_a_recorder_must_be_started(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="on_start"):
        RunRecorder(tmp_path).on_executed(records.potato_record().executed[0], 1.0)


def test_a_failed_write_leaves_the_old_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_record(tmp_path, records.empty_record())
    before = path.read_bytes()

    def no_space(source: object, target: object) -> None:
        raise OSError("no space left")

    monkeypatch.setattr("os.replace", no_space)
    with pytest.raises(OSError, match="no space"):
        write_record(tmp_path, records.empty_record(), page="other")
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == [RECORD_NAME]


Edit = Callable[[dict[str, Any]], object]


@pytest.mark.parametrize(
    ("edit", "place"),
    [
        (lambda d: d["boundaries"][3].pop("seconds"), r"boundaries\[3\] lacks 'seconds'"),
        (lambda d: d["boundaries"][3].update(looks="two"), r"boundaries\[3\].looks: a whole"),
        (lambda d: d["boundaries"][3].update(when="later"), r"boundaries\[3\].when: one of"),
        (lambda d: d.update(boundaries={}), "boundaries: a list"),
        (lambda d: d.update(boundaries=[None]), r"boundaries\[0\]: an object"),
        (lambda d: d["boundaries"][0].update(graph=[]), r"boundaries\[0\].graph"),
        (lambda d: d["boundaries"][0]["graph"].update(nodes=7), r"boundaries\[0\].graph"),
        (lambda d: d["boundaries"][7]["verdict"].update(score="high"), "verdict.score: a number"),
        (lambda d: d["boundaries"][7]["verdict"].update(threshold=10**400), "more than 64"),
        (lambda d: d["boundaries"][7]["verdict"]["matches"].append(["a"]), "a pair"),
        (lambda d: d["boundaries"][7]["diagnosis"].update(must_change=["?"]), "as a fact"),
        (lambda d: d["boundaries"][7]["replan"].update(plan=["fly(Mug)"]), "unknown skill"),
        (
            lambda d: d["boundaries"][0]["observation"]["cameras"][0].update(picture="../../x"),
            "inside the folder",
        ),
        (lambda d: d["executed"][0].update(index=-1), r"executed\[0\].index"),
        (lambda d: d["executed"][0].update(status="fine"), r"executed\[0\].status"),
        (lambda d: d.update(seed=True), "seed: a whole"),
        (lambda d: d.update(success="yes"), "success: true or false"),
        (lambda d: d.update(goal=None), "goal: an object"),
        (lambda d: d.update(scene={"room": "kitchen"}), "scene lacks"),
        (lambda d: d.update(compute_s={"perceive": None}), "compute_s.perceive: a number"),
        (lambda d: d.update(end="because"), "end: one of"),
    ],
)
def test_a_broken_value_is_told_with_file_and_place(tmp_path: Path, edit: Edit, place: str) -> None:
    path = write_record(tmp_path, records.potato_record())
    data = json.loads(path.read_text("utf-8"))
    edit(data)
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(FileFormatError, match=place) as caught:
        read_record(tmp_path)
    assert str(path) in str(caught.value)


def test_skills_are_those_of_the_domain_where_that_can_be_known(tmp_path: Path) -> None:
    """A domain that is not there, or another one of the same name, is no reason to refuse."""
    path = write_record(tmp_path, records.potato_record())
    data = json.loads(path.read_text("utf-8"))
    data["boundaries"][7]["replan"]["plan"] = ["fly(Mug)"]
    place = r"boundaries\[7\].replan.plan\[0\]: unknown skill"
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(FileFormatError, match=place):
        read_record(tmp_path)
    for edit in ({"domain": "warehouse"}, {"task_plan": ["fly(Mug)"]}):
        path.write_text(json.dumps({**data, **edit}), encoding="utf-8")
        found = read_record(tmp_path).boundaries[7].replan
        assert found is not None and found.plan is not None
        assert found.plan.texts() == ["fly(Mug)"]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[" * 100_000, "nests too deeply"),
        ('{"kind": "episode", "format": 3, "x": ' + "[" * 90 + "]" * 90 + "}", "nests more than"),
        ('{"kind": "episode", "format": NaN}', "no number"),
        ('{"kind": "episode", "format": ' + "9" * 5000 + "}", "64 bit"),
        ('{"kind": "episode", "format": 3, "task": "\\ud800"}', "half of a character"),
    ],
)
def test_json_that_no_record_is(tmp_path: Path, text: str, says: str) -> None:
    for name, content in ((RECORD_NAME, text), (LINES_NAME, text + "\n{}\n")):
        (tmp_path / name).write_text(content, encoding="utf-8")
        with pytest.raises(FileFormatError, match=says):
            read_record(tmp_path / name)


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("[]", "line 2: an object"),
        ("{}", "line 2 lacks 'event'"),
        ('{"event": "boundary"}', "line 2 lacks 'boundary'"),
        ('{"event": "boundary", "boundary": {"time_s": 1.0}}', "lacks 'compute_s'"),
        ('{"event": "executed", "time_s": "now", "executed": {}}', "line 2.time_s: a number"),
        ('{"event": "executed", "time_s": 1.0, "executed": {}}', r"executed\[0\] lacks 'status'"),
    ],
)
def test_a_broken_line_is_told_with_file_and_place(tmp_path: Path, line: str, says: str) -> None:
    records.follow(RunRecorder(tmp_path), records.potato_record(), 1)
    path = tmp_path / LINES_NAME
    first = path.read_text("utf-8").split("\n")[0]
    path.write_text(f"{first}\n{line}\n", encoding="utf-8")
    with pytest.raises(FileFormatError, match=says) as caught:
        read_record(tmp_path)
    assert str(path) in str(caught.value)
