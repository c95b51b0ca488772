from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from forestall.errors import FileFormatError, InputError
from forestall.records.as_json import RECORD_FORMAT, plain, record_json
from forestall.records.record import (
    LINES_NAME,
    RECORD_NAME,
    RunRecorder,
    read_record,
    write_record,
)
from forestall.seams import Listener
from forestall.types.episode import EpisodeEnd, EpisodeRecord, SkillOutcome, SkillStatus
from forestall.types.graph import SceneGraph
from forestall.types.runtime import When
from forestall.types.verdict import Replan, ReplanOutcome

from report import records

KEYS = {
    "kind": str,
    "format": int,
    "complete": bool,
    "task": str,
    "scenario": str,
    "strategy": str,
    "seed": int,
    "success": bool,
    "weak_success": bool,
    "failures": list,
    "alarms": list,
    "replans": int,
    "initial_plan": list,
    "executed": list,
    "end": str,
    "simulated_s": float,
    "compute_s": dict,
    "computed_s": float,
    "reasoning_s": float,
    "total_s": float,
    "perception": dict,
    "memory": dict,
    "versions": dict,
    "page": str,
    "boundaries": list,
}


def as_json(record: EpisodeRecord) -> dict[str, object]:
    return json.loads(json.dumps(record_json(record, page="p.html", images={}), allow_nan=False))


def test_every_key_is_there_with_its_type() -> None:
    data = record_json(records.potato_record(), page="index.html", images={0: "images/a.jpg"})
    assert {k: type(data[k]) for k in KEYS} == KEYS
    assert data["boundaries"][0]["image"] == "images/a.jpg"
    assert data["boundaries"][1]["image"] is None
    assert json.loads(json.dumps(data, allow_nan=False)) == data


def test_the_alarm_says_what_where_and_why() -> None:
    data = record_json(records.potato_record(), page=None, images={})
    assert data["alarms"] == [
        {
            "position": records.ALARM_INDEX,
            "index": records.ALARM_INDEX,
            "when": "before",
            "subtask": "pick_up(Plate-1)",
            "score": 0.734,
            "threshold": 0.9,
            "cause": records.CAUSE,
            "must_change": ["vacant(Microwave-1)"],
            "culprits": ["Bowl-1"],
            "replanned": True,
            "outcome": "solved",
        }
    ]
    assert data["replans"] == 1
    assert data["executed"][0] == {
        "index": 0,
        "subtask": "navigate_to_obj(Potato)",
        "status": "succeeded",
        "reason": "",
        "duration_s": 4.0,
    }


def test_times_add_up_without_the_simulators_own() -> None:
    record = records.potato_record()
    record = replace(record, compute_s=(*record.compute_s, ("observe", 3.0), ("act", 1.0)))
    data = record_json(record, page=None, images={})
    assert data["reasoning_s"] == pytest.approx(2.785)
    assert data["computed_s"] == pytest.approx(6.785)
    assert data["total_s"] == pytest.approx(52.0 + 2.785)


def test_a_dismissed_alarm_is_an_alarm_and_its_cause_says_so() -> None:
    first, second = as_json(records.troubled_record())["alarms"]
    assert first["cause"] == "nothing was found that must change: the difference is harmless"
    assert (first["replanned"], first["outcome"]) == (False, "nothing to change")
    assert (second["replanned"], second["outcome"]) == (False, "unsolvable")


def test_an_alarm_without_a_diagnosis_is_kept() -> None:
    record = records.potato_record()
    bare = replace(record.boundaries[7], diagnosis=None, replan=None)
    (alarm,) = as_json(replace(record, boundaries=(bare,)))["alarms"]
    assert alarm["cause"] == "no diagnosis was made"
    assert alarm["outcome"] is None


def test_a_plan_that_was_not_adopted_is_no_replan() -> None:
    record = records.potato_record()
    alarm = record.boundaries[7]
    went_on = replace(record.executed[7], subtask=alarm.subtask, index=alarm.index)
    over_the_limit = replace(record, executed=(*record.executed[:7], went_on))
    data = as_json(over_the_limit)
    assert data["replans"] == 0
    assert data["alarms"][0]["replanned"] is False
    rejected = Replan(ReplanOutcome.REJECTED, alarm.replan.plan if alarm.replan else None)
    changed = (*record.boundaries[:7], replace(alarm, replan=rejected))
    assert as_json(replace(record, boundaries=changed))["replans"] == 0


def test_boundaries_carry_graphs_verdict_and_plans() -> None:
    boundary = as_json(records.potato_record())["boundaries"][7]
    assert SceneGraph.from_json(boundary["scoped"]) == records.potato_record().boundaries[7].scoped
    assert SceneGraph.from_json(boundary["verdict"]["nearest"]["graph"]).get("Book-1") is not None
    assert boundary["verdict"]["parts"]["edge"] == 0.5
    assert boundary["verdict"]["discrepancies"][0]["change"] == "extra object"
    assert boundary["diagnosis"]["must_change"] == ["vacant(Microwave-1)"]
    assert boundary["plan_before"] == list(records.NOMINAL[7:])
    assert boundary["plan_after"][:2] == list(records.INSERTED)
    assert boundary["mark"] == "alarm, replanned"
    following = as_json(records.potato_record())["boundaries"][9]
    assert following["plan_before"][0] == records.INSERTED[1]
    assert following["plan_after"] is None


def test_plain_knows_numpy_and_refuses_no_value() -> None:
    assert plain({"a": np.float64(1.5), 2: (np.int32(3), float("nan")), "p": Path("a/b")}) == {
        "a": 1.5,
        "2": [3, None],
        "p": "a/b",
    }
    assert plain({"b", "a"}) == ["a", "b"]
    assert plain(EpisodeEnd.STOPPED) == "stopped safely"
    assert plain(np.zeros(2)) == [0.0, 0.0]


def test_write_and_read_again(tmp_path: Path) -> None:
    record = records.potato_record()
    path = write_record(tmp_path / "run", record, page="index.html")
    data = read_record(path)
    assert data == read_record(path.parent)
    assert data["page"] == "index.html"
    for boundary in data["boundaries"]:
        assert (path.parent / boundary["image"]).read_bytes()[:2] == b"\xff\xd8"
    again = write_record(tmp_path / "again", record, page="index.html")
    assert path.read_bytes() == again.read_bytes()
    assert not [p for p in path.parent.iterdir() if p.name.startswith(".")]


@pytest.mark.parametrize(
    "make",
    [records.unjudged_record, records.troubled_record, records.empty_record],
)
def test_odd_runs_are_written_too(tmp_path: Path, make: object) -> None:
    data = read_record(write_record(tmp_path, make()))  # type: ignore[operator]
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
        (json.dumps({"kind": "episode", "format": RECORD_FORMAT}), "lacks alarms"),
    ],
)
def test_a_file_that_is_no_record(tmp_path: Path, text: str, says: str) -> None:
    (tmp_path / RECORD_NAME).write_text(text, encoding="utf-8")
    with pytest.raises(FileFormatError, match=says):
        read_record(tmp_path)


def test_no_file_and_no_text(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="no record of a run"):
        read_record(tmp_path / "nowhere")
    with pytest.raises(FileFormatError, match="no record of a run"):
        read_record(tmp_path)
    (tmp_path / RECORD_NAME).write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FileFormatError, match="not text"):
        read_record(tmp_path)


def run_until(recorder: Listener, record: EpisodeRecord, boundaries: int) -> None:
    recorder.on_start(record.task, record.initial_plan, record.seed)
    executed = {e.index: e for e in record.executed}
    for context, answer in records.calls(record)[:boundaries]:
        recorder.on_boundary(context, answer)
        if context.when is When.BEFORE and context.done in executed:
            step = executed[context.done]
            recorder.on_executed(step.subtask, step.outcome, 4.0 * step.index + 4)


def test_a_killed_run_can_be_read(tmp_path: Path) -> None:
    record = records.potato_record()
    recorder = RunRecorder(
        tmp_path,
        scenario="microwave-occupied",
        strategy="proactive",
        provenance=dict(record.provenance),
    )
    run_until(recorder, record, 9)
    data = read_record(tmp_path)
    assert data["complete"] is False
    assert (data["end"], data["success"]) == (None, None)
    assert (data["task"], data["scenario"], data["strategy"]) == (
        "heat-potato",
        "microwave-occupied",
        "proactive",
    )
    assert len(data["boundaries"]) == 9
    assert [a["cause"] for a in data["alarms"]] == [records.CAUSE]
    assert [e["index"] for e in data["executed"]] == [0, 1, 2, 3, 4, 5, 6, 8]
    assert data["perception"]["state_estimator"] == "oracle"
    assert data["replans"] == 1
    assert (tmp_path / data["boundaries"][3]["image"]).exists()
    whole = record_json(record, page=None, images={})
    assert data.keys() == whole.keys()
    assert data["boundaries"][7]["scoped"] == json.loads(
        json.dumps(whole["boundaries"][7]["scoped"])
    )


@pytest.mark.parametrize("cut", [1, 40, "inside a character"])
def test_a_line_that_was_being_written_is_left_out(tmp_path: Path, cut: int | str) -> None:
    run_until(RunRecorder(tmp_path), records.troubled_record(), 2)
    lines = tmp_path / LINES_NAME
    whole = read_record(lines)
    head, last = lines.read_bytes().rstrip(b"\n").rsplit(b"\n", 1)
    size = cut if isinstance(cut, int) else last.index("熱".encode()) + 1
    lines.write_bytes(head + b"\n" + last[:size])
    data = read_record(tmp_path)
    assert len(data["boundaries"]) == len(whole["boundaries"])
    assert len(data["executed"]) == len(whole["executed"]) - 1


def test_damage_in_the_middle_is_told_with_its_line(tmp_path: Path) -> None:
    run_until(RunRecorder(tmp_path), records.potato_record(), 3)
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
    run_until(recorder, record, 99)
    pictures = sorted((tmp_path / "images").iterdir())
    recorder.on_end(record)
    data = read_record(tmp_path)
    assert data["complete"] is True
    assert data["page"] == "index.html"
    assert sorted((tmp_path / "images").iterdir()) == pictures
    assert json.loads((tmp_path / LINES_NAME).read_text("utf-8").splitlines()[-1]) == {
        "event": "end",
        "end": "plan finished",
    }


def test_a_second_run_in_the_same_folder_replaces_the_first(tmp_path: Path) -> None:
    record = records.potato_record()
    recorder = RunRecorder(tmp_path)
    recorder.on_start(record.task, record.initial_plan, 1)
    recorder.on_end(record)
    run_until(recorder, record, 2)
    data = read_record(tmp_path)
    assert data["complete"] is False
    assert len(data["boundaries"]) == 2


def test_a_recorder_must_be_started(tmp_path: Path) -> None:
    outcome = SkillOutcome(SkillStatus.SUCCEEDED, 1.0)
    with pytest.raises(InputError, match="on_start"):
        RunRecorder(tmp_path).on_executed(records.potato_record().executed[0].subtask, outcome, 1.0)


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


def test_moments_after_and_at_the_end_are_told_apart(tmp_path: Path) -> None:
    record = records.looked_after_record()
    data = record_json(record, page=None, images={})
    assert [b["when"] for b in data["boundaries"]] == ["before", "after"] * 15 + ["end"]
    (alarm,) = data["alarms"]
    assert (alarm["when"], alarm["index"], alarm["position"]) == ("after", 8, 17)
    assert alarm["replanned"] is True
    assert data["replans"] == 1
    assert data["final"] == data["boundaries"][-1]["graph"]
    assert [(w["detector"], w["score"]) for w in data["boundaries"][-1]["watched"]] == [
        ("scene_graph", 0.962),
        ("b", 0.734),
    ]
    after = data["boundaries"][17]
    assert after["plan_before"] == list(records.NOMINAL[9:])
    assert data["boundaries"][18]["plan_before"][0] == records.INSERTED[0]
    recorder = RunRecorder(tmp_path)
    run_until(recorder, record, 99)
    killed = read_record(tmp_path)
    for key in ("when", "index", "subtask", "plan_before", "plan_after", "watched"):
        assert [b[key] for b in killed["boundaries"]] == [b[key] for b in data["boundaries"]], key
    assert [e["index"] for e in killed["executed"]] == [e["index"] for e in data["executed"]]
    assert killed["final"] is None
