"""Recordings for the Rerun viewer, read back with that package's own reader."""

from __future__ import annotations

import json
import resource
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rerun", reason="the extra [viz] is not installed")

from log_samples import CAMERA, HEAD, HEIGHT, WIDTH, Run, observation, run, write

from forestall.assembly.log_folder import FolderWriter
from forestall.assembly.logs import export, logging_to, showing
from forestall.cli.main import call
from forestall.errors import InputError
from forestall.logs.outlines import detections_of
from forestall.logs.rerun_out import RerunWriter, sentence_of
from forestall.logs.writing import EpisodeLog, Executed
from forestall.records.derived import is_alarm, moments
from forestall.records.pictures import rgb_of
from forestall.records.record import RunRecorder, read_record, write_record
from forestall.types.episode import EpisodeRecord, SkillStatus, StoredObservation
from forestall.types.graph import ObjectNode, Relation
from forestall.types.observation import Frame
from forestall.types.plan import Subtask
from fuzz import scene
from report import records

Row = tuple[int | None, float | None, list[Any]]
"""Position of the boundary, seconds of the robot's clock (None: always), and values."""


class Recording:
    """What the reader finds in a file: entity → component → rows in the order of writing."""

    def __init__(self, path: Path) -> None:
        from rerun.chunk import RrdReader

        reader = RrdReader(path)
        (self.store,) = reader.recordings()
        self.rows: dict[str, dict[str, list[Row]]] = {}
        self.timelines: set[str] = set()
        chunks = [
            (c.entity_path, c.to_record_batch(), set(c.timeline_names)) for c in reader.stream()
        ]
        for entity, batch, timelines in chunks:
            self.timelines |= timelines
            for index in range(batch.num_rows):
                self._add(entity, batch.slice(index, 1), bool(timelines))
        for components in self.rows.values():
            for rows in components.values():
                rows.sort(key=lambda row: (row[0] if row[0] is not None else -1, row[1] or 0))

    def _add(self, entity: str, row: Any, timed: bool) -> None:
        at, robot_s = None, None
        if timed:
            at = row.column("boundary")[0].as_py()
            robot_s = row.column("robot")[0].value / 1e9
        for name in row.schema.names:
            if ":" in name and (value := row.column(name)[0].as_py()) is not None:
                found = self.rows.setdefault(entity, {}).setdefault(name, [])
                found.append((at, robot_s, value))

    def of(self, entity: str, component: str) -> list[Row]:
        return self.rows[entity][component]

    def latest(self, entity: str, component: str, boundary: int) -> list[Any]:
        """What a viewer shows at a boundary."""
        rows = [
            values
            for at, _, values in self.of(entity, component)
            if at is not None and at <= boundary
        ]
        return rows[-1]

    def always(self, entity: str, component: str) -> list[Any]:
        ((_, _, values),) = self.of(entity, component)
        return values


def exported(record: EpisodeRecord, folder: Path | None, path: Path) -> Recording:
    export(record, folder, showing(f"rerun:{path}"))
    return Recording(path)


def pixels(recording: Recording, entity: str, kind: str, boundary: int, dtype: Any) -> Any:
    (data,) = recording.latest(entity, f"{kind}:buffer", boundary)
    return np.frombuffer(bytes(data), dtype).reshape(HEIGHT, WIDTH, -1)


def test_a_look_is_kept_to_the_last_bit(tmp_path: Path) -> None:
    told = run(overlapping=True)
    write(RerunWriter(tmp_path / "a.rrd"), told)
    found = Recording(tmp_path / "a.rrd")
    newest = told.looks[-1]
    for number, frame in enumerate(newest.frames):
        place = f"/world/camera_{number}"
        rgb = pixels(found, f"{place}/rgb", "Image", 0, np.uint8)
        assert np.array_equal(rgb, frame.rgb)
        depth_m = pixels(found, f"{place}/depth", "DepthImage", 0, np.float32)[..., 0]
        assert np.array_equal(depth_m, frame.depth_m)
        assert found.latest(f"{place}/depth", "DepthImage:meter", 0) == [1.0]
        (matrix,) = found.latest(place, "Pinhole:image_from_camera", 0)
        wanted = np.array([[CAMERA.fx, 0, CAMERA.cx], [0, CAMERA.fy, CAMERA.cy], [0, 0, 1]])
        assert np.allclose(np.reshape(matrix, (3, 3)).T, wanted)
        assert found.latest(place, "Pinhole:resolution", 0) == [[WIDTH, HEIGHT]]
        (turned,) = found.latest(place, "Transform3D:mat3x3", 0)
        assert np.allclose(np.reshape(turned, (3, 3)).T, frame.camera_to_world[:3, :3], atol=1e-6)
        (moved,) = found.latest(place, "Transform3D:translation", 0)
        assert np.allclose(moved, frame.camera_to_world[:3, 3])
        assert masks_of(found, place) == {
            d.instance: d.mask.tolist() for d in detections_of(frame) or ()
        }


def masks_of(found: Recording, place: str) -> dict[str, Any]:
    """Name → where it is, over all layers that a viewer shows at the end."""
    (classes,) = found.latest("/world", "AnnotationContext:context", 0)
    names = {c["class_id"]: c["class_description"]["info"]["label"] for c in classes}
    masks: dict[str, Any] = {}
    for layer in [e for e in found.rows if e.startswith(f"{place}/masks")]:
        numbers = pixels(found, layer, "SegmentationImage", 0, np.uint16)[..., 0]
        for number in np.unique(numbers[numbers > 0]).tolist():
            masks[names[number]] = masks.get(names[number], False) | (numbers == number)
    return {name: mask.tolist() for name, mask in masks.items()}


def test_a_thing_has_the_same_number_in_every_picture_and_among_the_boxes(tmp_path: Path) -> None:
    record = records.potato_record()
    found = exported(record, None, tmp_path / "a.rrd")
    last = len(record.boundaries) - 1
    (classes,) = found.latest("/world", "AnnotationContext:context", last)
    names = {c["class_id"]: c["class_description"]["info"]["label"] for c in classes}
    assert len(set(names.values())) == len(names)
    for _, _, numbers in found.of("/world/nodes", "Boxes3D:class_ids"):
        assert numbers
    labels = found.latest("/world/nodes", "Boxes3D:labels", last)
    assert [names[k] for k in found.latest("/world/nodes", "Boxes3D:class_ids", last)] == labels


def test_cameras_that_did_not_look_again_are_taken_away(tmp_path: Path) -> None:
    writer = RerunWriter(tmp_path / "a.rrd")
    writer.begin(HEAD)
    writer.look(observation(0, 0.0, 3))
    writer.look(observation(1, 2.0, 1))
    writer.finish(None, "")
    found = Recording(tmp_path / "a.rrd")
    gone = {e for e, parts in found.rows.items() if "Clear:is_recursive" in parts}
    below = {f"/world/camera_{n}{b}" for n in (1, 2) for b in ("", "/rgb", "/depth", "/masks")}
    assert gone == below
    assert all(found.of(e, "Clear:is_recursive") == [(0, 2.0, [False])] for e in below)


def test_scores_sentences_and_plans_are_those_of_the_record(tmp_path: Path) -> None:
    record = records.potato_record()
    found = exported(record, None, tmp_path / "a.rrd")
    assert found.timelines == {"boundary", "robot", "log_time"}
    at = list(enumerate(record.boundaries))
    verdicts = [(n, b, b.verdict) for n, b in at if b.verdict is not None]
    assert found.of("/verdict/score", "Scalars:scalars") == [
        (n, b.time_s, [v.score]) for n, b, v in verdicts if v.score is not None
    ]
    assert found.of("/verdict/threshold", "Scalars:scalars") == [
        (n, b.time_s, [v.threshold]) for n, b, v in verdicts
    ]
    said = [(n, b.time_s, [sentence_of(b)]) for n, b in at]
    assert found.of("/said", "TextLog:text") == said
    assert records.SENTENCE in said[records.ALARM_INDEX][2][0]
    levels = [level for _, _, (level,) in found.of("/said", "TextLog:level")]
    assert levels == ["WARN" if is_alarm(b) else "INFO" for b in record.boundaries]
    assert levels.count("WARN") == 1
    judged = [m for m in moments(record) if m.boundary is not None]
    assert [text for _, _, (text,) in found.of("/plan/before", "TextDocument:text")] == [
        "\n".join(map(str, m.before)) for m in judged
    ]
    assert [text for _, _, (text,) in found.of("/plan/after", "TextDocument:text")] == [
        "the plan stays" if m.after is None else "\n".join(map(str, m.after)) for m in judged
    ]
    assert [text for _, _, (text,) in found.of("/executed", "TextLog:text")] == [
        f"{e.subtask} succeeded" for e in record.executed
    ]
    assert found.always("/ended", "TextDocument:text") == ["success"]
    assert record.task.goal.text in found.always("/about", "TextDocument:text")[0]


def test_nodes_have_their_boxes_and_relations_their_lines(tmp_path: Path) -> None:
    bare = ObjectNode("Spoon-1", "Spoon", centroid_m=(0.5, 0.25, 1.0))
    nowhere = ObjectNode("Fork-1", "Fork")
    record = records.potato_record()
    first = record.boundaries[0]
    graph = replace(
        first.graph,
        nodes=(*first.graph.nodes, bare, nowhere),
        relations=(*first.graph.relations, Relation("Fork-1", "near", "Spoon-1")),
    )
    record = replace(record, boundaries=(replace(first, graph=graph), *record.boundaries[1:]))
    found = exported(record, None, tmp_path / "a.rrd")
    boxed = [(n.id, n.box_m) for n in graph.nodes if n.box_m is not None]
    assert found.latest("/world/nodes", "Boxes3D:labels", 0) == [name for name, _ in boxed]
    half = found.latest("/world/nodes", "Boxes3D:half_sizes", 0)
    centres = found.latest("/world/nodes", "Boxes3D:centers", 0)
    assert np.allclose(half, [np.array(b.size) / 2 for _, b in boxed], atol=1e-6)
    assert np.allclose(centres, [b.centre for _, b in boxed], atol=1e-6)
    assert "Spoon-1" in found.latest("/world/places", "Points3D:labels", 0)
    assert "Spoon-1" not in found.latest("/world/places", "Points3D:labels", 1)
    located = {n.id for n in graph.nodes if n.box_m is not None or n.centroid_m is not None}
    lines = [str(r) for r in graph.relations if {r.subject, r.object} <= located]
    assert lines and found.latest("/world/relations", "LineStrips3D:labels", 0) == lines
    assert found.latest("/graph/all", "TextDocument:text", 0) == [graph.text()]
    assert "Fork-1 near Spoon-1" in graph.text()
    assert found.latest("/graph/scoped", "TextDocument:text", 0) == [first.scoped.text()]


def test_a_run_that_is_followed_says_the_same_as_its_record(tmp_path: Path) -> None:
    record = records.potato_record()
    followed = EpisodeLog(RerunWriter(tmp_path / "live.rrd"))
    records.follow(followed, record)
    assert followed.complete
    live = Recording(tmp_path / "live.rrd")
    again = exported(record, None, tmp_path / "again.rrd")
    assert live.store.application_id == "forestall"
    assert live.store.recording_id != again.store.recording_id
    for entity in (
        "/verdict/score",
        "/said",
        "/plan/before",
        "/plan/after",
        "/executed",
        "/world/nodes",
    ):
        assert live.rows[entity] == again.rows[entity], entity


def test_the_folder_of_a_run_is_exported_with_its_pictures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record = records.potato_record(frames=2)
    write_record(tmp_path / "run", record)
    out = tmp_path / "run.rrd"
    assert call(["export", str(tmp_path / "run"), f"rerun:{out}"]) == 0
    assert capsys.readouterr().out.strip() == str(out)
    found = Recording(out)
    seen = read_record(tmp_path / "run").boundaries[0].observation
    assert isinstance(seen, StoredObservation)
    picture = rgb_of(seen.frames[1], tmp_path / "run")
    (data,) = found.latest("/world/camera_1/rgb", "Image:buffer", 0)
    assert picture is not None and bytes(data) == picture.tobytes()
    assert "/world/camera_1/depth" not in found.rows, "a record has no depth"
    assert [v for _, _, v in found.of("/verdict/score", "Scalars:scalars")] == [
        [b.verdict.score] for b in record.boundaries if b.verdict is not None
    ]
    assert call(["export", str(tmp_path / "run"), f"rerun:{out}"]) == 2
    assert "is there already" in capsys.readouterr().err


def test_a_killed_run_and_one_that_nobody_judged_are_exported(tmp_path: Path) -> None:
    records.follow(RunRecorder(tmp_path / "run"), records.potato_record(), 4)
    assert call(["export", str(tmp_path / "run"), f"rerun:{tmp_path / 'a.rrd'}"]) == 0
    found = Recording(tmp_path / "a.rrd")
    assert len(found.of("/said", "TextLog:text")) == 4
    assert found.always("/ended", "TextDocument:text") == ["nobody scored it"]
    unjudged = records.unjudged_record()
    found = exported(unjudged, None, tmp_path / "b.rrd")
    assert "/verdict/score" not in found.rows
    levels = [level for _, _, (level,) in found.of("/executed", "TextLog:level")]
    refused = [e.outcome.status is SkillStatus.REFUSED for e in unjudged.executed]
    assert levels == ["WARN" if r else "INFO" for r in refused] and any(refused)
    assert found.always("/ended", "TextDocument:text")[0].startswith("failed: ")


def test_what_a_broken_picture_leaves_is_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_record(tmp_path / "run", records.potato_record())
    for path in (tmp_path / "run" / "images").iterdir():
        path.write_bytes(b"no picture")
    assert call(["export", str(tmp_path / "run"), f"rerun:{tmp_path / 'a.rrd'}"]) == 2
    assert "is not a picture" in capsys.readouterr().err
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_a_replayed_log_is_shown_with_its_depth_and_what_was_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    grasp = Executed(Subtask.parse("pick_up(Plate-1)"), SkillStatus.SUCCEEDED)
    looks = tuple(replace(scene.observation(), time_s=t) for t in (0.0, 4.0))
    write(FolderWriter(tmp_path / "log"), Run(looks, ((grasp,), ())))
    out = tmp_path / "a.rrd"
    asked = ["--strategy", "plan-check", "--states", "given", "--log", f"rerun:{out}", "--json"]
    code = call(["replay", f"folder:{tmp_path / 'log'}", *asked])
    (replayed,) = json.loads(capsys.readouterr().out)
    assert code == any(moment["alarm"] for moment in replayed["timeline"])
    found = Recording(out)
    said = [text for _, _, (text,) in found.of("/said", "TextLog:text")]
    assert len(said) == len(replayed["timeline"])
    for text, moment in zip(said, replayed["timeline"], strict=True):
        assert text.startswith(f"{moment['moment']} {moment['subtask']}: {moment['outcome']}")
    (frame,) = looks[0].frames
    (data,) = found.latest("/world/camera_0/depth", "DepthImage:buffer", 0)
    assert bytes(data) == frame.depth_m.tobytes()
    assert "Plate-1" in found.latest("/world/nodes", "Boxes3D:labels", 0)
    assert (tmp_path / "log").is_dir() and found.of("/executed", "TextLog:level")


def test_only_logs_that_show_judgements_are_exported_to(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_record(tmp_path / "run", records.potato_record())
    assert call(["export", str(tmp_path / "run"), f"folder:{tmp_path / 'a'}"]) == 2
    assert "rerun:FILE" in capsys.readouterr().err
    assert not (tmp_path / "a").exists()


def test_nothing_is_there_before_the_end(tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    with logging_to(f"rerun:{path}") as (log,):
        log.on_start(records.begun(records.potato_record()))
        log.on_look(observation(0, 0.0))
        assert not path.exists()
    assert list(tmp_path.iterdir()) == []


def test_refusals_are_told_with_their_reason(tmp_path: Path) -> None:
    told = run((SkillStatus.SUCCEEDED, SkillStatus.REFUSED, SkillStatus.SUCCEEDED))
    write(RerunWriter(tmp_path / "a.rrd"), told, success=False, why="the plate is empty")
    found = Recording(tmp_path / "a.rrd")
    assert found.of("/executed", "TextLog:text")[1][2] == ["pick_up(Potato-1) refused: stuck"]
    assert found.always("/ended", "TextDocument:text") == ["failed: the plate is empty"]


def test_frames_without_depth_and_a_switched_off_rerun(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = RerunWriter(tmp_path / "a.rrd")
    seen = observation(0, 0.0)
    (frame,) = seen.frames
    nothing = np.zeros_like(frame.depth_m)
    bare = Frame(frame.rgb, nothing, CAMERA, frame.camera_to_world, colour_only=True)
    writer.begin(HEAD)
    writer.look(replace(seen, frames=(bare,)))
    writer.finish(True, "")
    assert {e for e in Recording(tmp_path / "a.rrd").rows if "camera" in e} == {
        "/world/camera_0",
        "/world/camera_0/rgb",
    }
    monkeypatch.setenv("RERUN", "off")
    off = RerunWriter(tmp_path / "b.rrd")
    with pytest.raises(InputError, match="switched off by the environment variable RERUN"):
        off.begin(HEAD)
    off.abandon()
    assert not (tmp_path / "b.rrd").exists()


def test_a_full_disk_leaves_no_half_recording(tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limits[1]))
    try:
        with pytest.raises(OSError, match="not written whole"):
            export(records.potato_record(frames=2), None, showing(f"rerun:{path}"))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, before)
    assert list(tmp_path.iterdir()) == []
