"""LeRobot data sets of others: videos, depth, subtasks in each spelling, and what is wrong."""

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pyarrow", reason="the extra [lerobot] is not installed")
pytest.importorskip("av", reason="the extra [lerobot] is not installed")

import pyarrow as pa
import pyarrow.parquet as pq
from log_samples import HEIGHT, WIDTH, run, write

from forestall.domain.load import shipped
from forestall.errors import FileFormatError, InputError
from forestall.logs.lerobot_data import LeRobotData
from forestall.logs.lerobot_out import LeRobotWriter
from forestall.logs.lerobot_video import depth_m
from forestall.types.observation import Observation
from forestall.types.recorded import RecordedRun, Unread

DOMAIN = shipped("household")
FPS = 10
LENGTHS = (25, 35)
RGB, DEPTH = "observation.images.front", "observation.images.front_depth"
LAYOUT = f"""
[[lerobot.cameras]]
rgb = "{RGB}"
depth = "{DEPTH}"
intrinsics = [20.0, 20.0, 7.5, 5.5]
camera_to_world = [[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.4], [0, 0, 0, 1]]
"""
STEPS = ((0, "pick_up(Potato)"), (12, "put_on(Potato, Plate)"))


def grey(number: int) -> int:
    """How bright the picture of a row is: neighbours can be told apart after a lossy codec."""
    return 8 * (number % 30) + 8


def _video(path: Path, depth: bool) -> None:
    """One video with the pictures of both episodes, one after the other."""
    import av

    path.parent.mkdir(parents=True)
    codec, kind = ("ffv1", "gray12le") if depth else ("mpeg4", "yuv420p")
    with av.open(str(path), "w", format="matroska" if depth else "mp4") as container:
        stream = container.add_stream(codec, rate=FPS)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, kind
        for number in range(sum(LENGTHS)):
            if depth:
                pixels = np.full((HEIGHT, WIDTH), 1000 + number, np.uint16)
                pixels[0, 0] = 0
                frame = av.VideoFrame.from_ndarray(pixels, format="gray12le")
            else:
                pixels = np.full((HEIGHT, WIDTH, 3), grey(number), np.uint8)
                frame = av.VideoFrame.from_ndarray(pixels, format="rgb24")
            frame.pts, frame.time_base = number, Fraction(1, FPS)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def data_set(
    folder: Path,
    columns: dict[str, Any] | None = None,
    info: dict[str, Any] | None = None,
    subtasks: tuple[str, ...] = (),
    success: bool | None = None,
) -> Path:
    """Two episodes as that package writes them, in one file and one video for each camera.

    `columns` are functions of (episode, row of the episode).
    """
    for key in (RGB, DEPTH):
        _video(folder / "videos" / key / "chunk-000" / "file-000.mp4", key == DEPTH)
    features: dict[str, Any] = {
        RGB: {"dtype": "video", "shape": [HEIGHT, WIDTH, 3], "info": {"video.fps": FPS}},
        DEPTH: {
            "dtype": "video",
            "shape": [HEIGHT, WIDTH, 1],
            "info": {
                "is_depth_map": True,
                "video.depth_min": 0.0,
                "video.depth_max": 4.095,
                "video.shift": 0.5,
                "video.use_log": False,
            },
        },
    }
    rows: list[dict[str, Any]] = []
    for episode, length in enumerate(LENGTHS):
        for n in range(length):
            row: dict[str, Any] = {"episode_index": episode, "frame_index": n, "timestamp": n / FPS}
            row |= {"task_index": 0, "index": len(rows)}
            row |= {name: value(episode, n) for name, value in (columns or {}).items()}
            if success is not None:
                row["next.success"] = success and n == length - 1
                features["next.success"] = {"dtype": "bool", "shape": [1]}
            rows.append(row)
    file = folder / "data/chunk-000/file-000.parquet"
    file.parent.mkdir(parents=True)
    pq.write_table(pa.Table.from_pylist(rows), file, row_group_size=7)
    episodes, start = [], 0
    for index, length in enumerate(LENGTHS):
        about: dict[str, Any] = {"episode_index": index, "tasks": ["warm it"], "length": length}
        about |= {"data/chunk_index": 0, "data/file_index": 0}
        for key in (RGB, DEPTH):
            about |= {f"videos/{key}/chunk_index": 0, f"videos/{key}/file_index": 0}
            about[f"videos/{key}/from_timestamp"] = start / FPS
            about[f"videos/{key}/to_timestamp"] = (start + length) / FPS
        episodes.append({**about, "stats/action/min": [0.0]})
        start += length
    file = folder / "meta/episodes/chunk-000/file-000.parquet"
    file.parent.mkdir(parents=True)
    pq.write_table(pa.Table.from_pylist(episodes), file)
    tasks = {"task_index": [0, 1], "task": ["pick_up(Potato)", "put_on(Potato, Plate)"]}
    pq.write_table(pa.table(tasks), folder / "meta/tasks.parquet")
    if subtasks:
        named = {"subtask_index": list(range(len(subtasks))), "__index_level_0__": list(subtasks)}
        pq.write_table(pa.table(named), folder / "meta/subtasks.parquet")
    said = {
        "codebase_version": "v3.0",
        "fps": FPS,
        "features": features,
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "video_path": "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4",
        **(info or {}),
    }
    (folder / "meta/info.json").write_text(json.dumps(said))
    return folder


def language(episode: int, row: int) -> list[dict[str, Any]]:
    """What every row says of the subtasks of its episode."""
    return [
        {"role": "assistant", "content": text, "style": "subtask", "timestamp": at / FPS}
        for at, text in STEPS
    ] + [{"role": "assistant", "content": "x", "style": "memory", "timestamp": 0.3}]


def index(episode: int, row: int) -> int:
    return int(row >= STEPS[1][0])


def opened(folder: Path, layout: str = LAYOUT, steps: str = "") -> LeRobotData:
    files = {}
    for name, text, ending in (("layout", layout, "toml"), ("steps", steps, "csv")):
        if text:
            files[name] = folder.parent / f"{folder.name}.{ending}"
            files[name].write_text(text)
    return LeRobotData(folder, **files)


def tried(folder: Path, layout: str = LAYOUT, steps: str = "") -> list[RecordedRun | Unread]:
    return list(opened(folder, layout, steps).runs(DOMAIN))


def seen(found: RecordedRun | Unread) -> list[Observation]:
    assert isinstance(found, RecordedRun), found
    made = [look.observation for look in found.looks()]
    assert all(o is not None for o in made)
    return [o for o in made if o is not None]


SPELT: list[tuple[dict[str, Any], tuple[str, ...]]] = [
    ({"language_persistent": language}, ()),
    ({"subtask_index": index}, tuple(text for _, text in STEPS)),
    ({"task_index": index}, ()),
]


@pytest.mark.parametrize(("columns", "subtasks"), SPELT)
def test_videos_and_depth_are_read_just_before_each_subtask(
    columns: dict[str, Any], subtasks: tuple[str, ...], tmp_path: Path
) -> None:
    found = tried(data_set(tmp_path / "set", columns, subtasks=subtasks))
    for episode, (start, end) in enumerate(((0, 24), (25, 59))):
        one = found[episode]
        assert isinstance(one, RecordedRun), one
        assert one.name == f"set-{episode}"
        assert one.plan.texts() == [text for _, text in STEPS]
        assert [look.before for look in one.looks()] == [(), (0,), (1,)]
        for row, observation in zip((start, start + 11, end), seen(one), strict=True):
            (frame,) = observation.frames
            assert np.abs(frame.rgb.astype(int) - grey(row)).max() <= 4
            assert np.allclose(frame.depth_m[1:], (1000 + row) / 1000, atol=1e-6)
            assert frame.depth_m[0, 0] == 0
            assert observation.time_s == (row - start) / FPS
            assert observation.robot_position_world_m == (0.0, 0.0, 0.0)
    assert "no masks" in found[0].left_out[0] if isinstance(found[0], RecordedRun) else False


def test_some_episodes_and_their_boundaries_from_a_csv_file(tmp_path: Path) -> None:
    folder = data_set(tmp_path / "set")
    assert all("nowhere when a subtask begins" in str(found) for found in tried(folder))
    steps = "time_s,subtask,episode\n0.45,pick_up(Potato),1\n"
    layout = LAYOUT.replace("[[", "[lerobot]\nepisodes = [1]\n[[", 1)
    (found,) = tried(folder, layout, steps)
    assert [round(o.time_s, 2) for o in seen(found)] == [0.4, 3.4]


def test_whether_it_went_well_stands_in_the_last_row(tmp_path: Path) -> None:
    columns = {"language_persistent": language}
    (good, _) = tried(data_set(tmp_path / "good", columns, success=True))
    (bad, _) = tried(data_set(tmp_path / "bad", columns, success=False))
    assert isinstance(good, RecordedRun)
    assert isinstance(bad, RecordedRun)
    assert (good.fails, bad.fails) == (None, 1)


def test_depth_of_a_logarithmic_video() -> None:
    about = {"video.depth_min": 0.01, "video.depth_max": 10.0, "video.shift": 3.5}
    codes = np.array([[0, 1, 2048, 4095]], np.uint16)
    metres = depth_m(codes, {**about, "video.use_log": True}, "here")
    low, high = np.log(3.51), np.log(13.5)
    wanted = np.exp(low + np.array([1, 2048, 4095]) / 4095 * (high - low)) - 3.5
    assert np.allclose(metres[0, 1:], wanted, atol=1e-5)
    assert metres[0, 0] == 0
    for wrong in ({"video.depth_min": 5, "video.depth_max": 1}, {"video.shift": "a"}):
        with pytest.raises(FileFormatError, match="here: the limits of depth"):
            depth_m(codes, {**about, **wrong}, "here")


# --- what is missing or wrong ---------------------------------------------------------------------


def test_a_camera_without_a_place_is_asked_for(tmp_path: Path) -> None:
    folder = data_set(tmp_path / "set", {"language_persistent": language})
    (found, _) = tried(folder, "")
    assert isinstance(found, RecordedRun)
    with pytest.raises(FileFormatError, match=r"intrinsics .* of a camera is not said"):
        list(found.looks())
    with pytest.raises(InputError, match="unknown column"):
        opened(folder, LAYOUT.replace("front_depth", "front_deep"))


INFO: list[tuple[dict[str, Any], str]] = [
    ({"codebase_version": "v2.1"}, "version v2.1: v3.0 is read; LeRobot converts older ones"),
    ({"fps": 0}, "fps"),
    ({"features": []}, "features"),
    ({"features": {}}, "no column has pictures"),
]


@pytest.mark.parametrize(("info", "said"), INFO)
def test_an_info_json_that_says_something_else_is_refused(
    info: dict[str, Any], said: str, tmp_path: Path
) -> None:
    folder = data_set(tmp_path / "set", info=info)
    with pytest.raises(FileFormatError, match=said):
        opened(folder, "")


@pytest.mark.parametrize(
    "path",
    [
        "../{chunk_index}",
        "/etc/passwd",
        "{chunk_index.__class__}",
        "{chunk_index:999999999d}",
        "{x}",
    ],
)
def test_a_data_path_that_leads_elsewhere_is_refused(path: str, tmp_path: Path) -> None:
    folder = data_set(tmp_path / "set", info={"data_path": path})
    for found in tried(folder):
        assert isinstance(found, Unread)
        assert "is no file inside" in found.why or "data_path is" in found.why


def test_missing_and_damaged_files_are_named(tmp_path: Path) -> None:
    columns = {"language_persistent": language}
    folder = data_set(tmp_path / "set", columns)
    data = folder / "data/chunk-000/file-000.parquet"
    video = folder / "videos" / RGB / "chunk-000/file-000.mp4"
    whole, film = data.read_bytes(), video.read_bytes()
    for bad in (b"", b"PAR1", whole[: len(whole) // 2], whole[:-9]):
        data.write_bytes(bad)
        assert all(isinstance(f, Unread) and str(data) in f.why for f in tried(folder))
    data.unlink()
    assert all("is missing: the data set names it" in str(f) for f in tried(folder))
    data.write_bytes(whole)
    for bad in (b"", b"no video", film[: len(film) // 3]):
        video.write_bytes(bad)
        (found, _) = tried(folder)
        assert isinstance(found, RecordedRun)
        with pytest.raises(FileFormatError) as error:
            list(found.looks())
        assert str(video) in str(error.value)
    with pytest.raises(FileFormatError, match="is no LeRobot data set"):
        opened(tmp_path, "")


def test_a_video_without_a_frame_at_the_time_is_told(tmp_path: Path) -> None:
    folder = data_set(tmp_path / "set", {"language_persistent": language})
    file = folder / "meta/episodes/chunk-000/file-000.parquet"
    rows = pq.read_table(file).to_pylist()
    rows[0][f"videos/{RGB}/from_timestamp"] = 100.0
    pq.write_table(pa.Table.from_pylist(rows), file)
    (found, _) = tried(folder)
    assert isinstance(found, RecordedRun)
    with pytest.raises(FileFormatError, match="has no frame at 100"):
        list(found.looks())


CELLS: list[tuple[str, Any, str]] = [
    ("observation.images.head", {"bytes": b"no picture", "path": None}, "cannot be read"),
    ("observation.images.head", {"bytes": None, "path": "../x.png"}, "no file inside"),
    ("observation.detections", "[{]", "damaged"),
    ("observation.detections", '[{"category": "Plate"}]', "ids"),
    ("observation.hands", '[{"holding": 3}]', "hands.0.holding"),
    ("observation.intrinsics", [1.0, 1.0, 1.0, float("nan")], "has to be 4 numbers"),
    ("observation.camera_to_world", [0.0] * 16, "no rotation matrix"),
]


@pytest.mark.parametrize(("column", "value", "said"), CELLS)
def test_cells_that_are_not_what_they_should_be_are_told_with_their_row(
    column: str, value: Any, said: str, tmp_path: Path
) -> None:
    write(LeRobotWriter(tmp_path / "set"), run())
    file = tmp_path / "set/data/chunk-000/file-000.parquet"
    table = pq.read_table(file)
    rows = table.to_pylist()
    rows[4][column] = value
    pq.write_table(pa.Table.from_pylist(rows, schema=table.schema), file)
    (found,) = LeRobotData(tmp_path / "set").runs(DOMAIN)
    assert isinstance(found, RecordedRun)
    with pytest.raises(FileFormatError) as error:
        list(found.looks())
    assert said in str(error.value)
    assert "row 4 of the episode" in str(error.value)


def test_a_row_group_that_would_not_fit_into_memory_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(LeRobotWriter(tmp_path / "set"), run())
    (found,) = LeRobotData(tmp_path / "set").runs(DOMAIN)
    assert isinstance(found, RecordedRun)
    monkeypatch.setattr("forestall.logs.lerobot_meta.MOST_READ_BYTES", 1500)
    with pytest.raises(FileFormatError, match=r"row group 0 claims \d+ bytes in the columns"):
        list(found.looks())


def test_our_own_set_is_laid_out_as_the_format_says(tmp_path: Path) -> None:
    write(LeRobotWriter(tmp_path / "set"), run())
    info = json.loads((tmp_path / "set/meta/info.json").read_text())
    table = pq.read_table(tmp_path / "set/data/chunk-000/file-000.parquet")
    assert set(info["features"]) == set(table.column_names)
    rows = table.to_pylist()
    assert [r["index"] for r in rows] == list(range(info["total_frames"]))
    assert np.allclose([r["timestamp"] for r in rows], np.arange(len(rows)) / info["fps"])
    (episode,) = pq.read_table(
        tmp_path / "set/meta/episodes/chunk-000/file-000.parquet"
    ).to_pylist()
    assert (episode["length"], episode["dataset_to_index"]) == (len(rows), len(rows))
    times = {r["timestamp"] for r in rows}
    for said in rows[0]["language_persistent"]:
        assert said["style"] == "subtask"
        assert said["timestamp"] in times
    pandas = json.loads(pq.read_schema(tmp_path / "set/meta/tasks.parquet").metadata[b"pandas"])
    assert pandas["index_columns"] == ["task"]
