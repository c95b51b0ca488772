"""Logs of robots that know nothing of this project: topics, transforms, boundaries, and faults."""

import dataclasses
import resource
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mcap", reason="the extra [mcap] is not installed")
pytest.importorskip("mcap_ros2", reason="the extra [mcap] is not installed")

from log_samples import run, write
from robot_log import HEIGHT, WIDTH, rgb_at, write_robot_log

from forestall.cli.main import call
from forestall.domain.load import shipped
from forestall.errors import FileFormatError, InputError
from forestall.logs.mcap_data import McapLogs
from forestall.logs.mcap_out import McapWriter
from forestall.logs.transforms import Transforms
from forestall.types.observation import Observation
from forestall.types.recorded import Look, RecordedRun, Unread

DOMAIN = shipped("household")


def read(path: Path, layout: str = "", steps: str = "", **more: Any) -> RecordedRun:
    found = tried(path, layout, steps)
    assert isinstance(found, RecordedRun), found
    return found


def why_not(path: Path, layout: str = "", steps: str = "") -> str:
    found = tried(path, layout, steps)
    assert isinstance(found, Unread), found
    return found.why


def tried(path: Path, layout: str = "", steps: str = "") -> RecordedRun | Unread:
    files: dict[str, Path] = {}
    for name, text, ending in (("layout", layout, "toml"), ("steps", steps, "csv")):
        if text:
            files[name] = path.with_suffix(f".{ending}")
            files[name].write_text(text)
    (found,) = McapLogs(path, **files).runs(DOMAIN)
    return found


def looks(found: RecordedRun) -> list[tuple[Look, Observation]]:
    made = []
    for look in found.looks():
        assert look.observation is not None
        made.append((look, look.observation))
    return made


def test_a_robots_log_is_looked_at_before_each_subtask_and_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    write_robot_log(path)
    found = read(path)
    assert found.plan.texts() == ["pick_up(Potato)", "put_on(Potato, Plate)"]
    seen = looks(found)
    assert [look.before for look, _ in seen] == [(), (0,), (1,)]
    assert [look.done for look, _ in seen] == [None, 0, 1]
    assert [round(o.time_s, 3) for _, o in seen] == [1.0, 2.0, 2.9]
    for number, (_, observation) in zip((10, 20, 29), seen, strict=True):
        (frame,) = observation.frames
        assert np.array_equal(frame.rgb, rgb_at(number))
        assert frame.depth_m[5, 5] == np.float32(1000 + number) * np.float32(0.001)
        assert frame.depth_m[0, 0] == 0
        assert [(d.category, d.instance, d.score) for d in frame.detections or ()] == [
            ("Potato", "Potato-1", 0.9),
            ("Plate", None, 0.9),
        ]
        assert observation.robot_position_world_m == (1.0, 2.0, 0.0)
        assert not observation.hands
        angle = min(number / 10, 2.0) / 3.0 * np.pi / 2  # the last transform is of second 2
        ahead = (np.cos(angle), np.sin(angle), 0.0)
        assert np.allclose(frame.camera_to_world[:3, 2], ahead, atol=1e-6)
        assert np.allclose(frame.camera_to_world[:3, 1], (0, 0, -1), atol=1e-6)


def test_the_hand_is_a_frame_and_what_it_holds_a_topic(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    write_robot_log(path)
    layout = '[mcap]\nhand = "hand"\nholding = "/holding"\n'
    seen = looks(read(path, layout))
    assert [o.gripper.holding for _, o in seen] == [None, "Potato-1", "Potato-1"]
    assert {o.gripper.position_world_m for _, o in seen} == {(1.5, 2.0, 0.9)}


def test_looks_in_between_where_they_are_wanted(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    write_robot_log(path)
    seen = looks(read(path, "every_s = 0.5"))
    assert [round(o.time_s, 1) for _, o in seen] == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 2.9]
    assert [n for look, _ in seen for n in look.before] == [0, 1]


def test_words_of_the_log_are_given_a_meaning(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    write_robot_log(path, ((0.5, "idle"), (1.0, "grab the potato")))
    assert "topic /subtask: cannot read 'idle' as a subtask" in why_not(path)
    layout = '[subtasks]\nidle = ""\n"grab the potato" = "pick_up(Potato)"\n'
    assert read(path, layout).plan.texts() == ["pick_up(Potato)"]


def test_boundaries_from_a_csv_file(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    write_robot_log(path, ())
    assert "it says nowhere when a subtask begins" in why_not(path)
    steps = "time_s,subtask,outcome\n0.5,pick_up(Potato),succeeded\n1.75,put_on(Potato\\, Plate),\n"
    steps = steps.replace("put_on(Potato\\, Plate)", '"put_on(Potato, Plate)"')
    seen = looks(read(path, steps=steps))
    assert [round(o.time_s, 1) for _, o in seen] == [0.5, 1.7, 2.9]
    steps = steps.replace("0.5,", "1700000000.5,").replace("1.75,", "1700000001.75,")
    assert [round(o.time_s, 1) for _, o in looks(read(path, steps=steps))] == [0.5, 1.7, 2.9]
    failed = steps.replace(",\n", ',"failed: it slipped"\n')
    found = read(path, steps=failed)
    assert (found.fails, found.kind, found.why) == (1, "failed", "it slipped")


BAD_STEPS = [
    ("when,what\n1,pick_up(Potato)\n", "the first line names the columns: time_s, subtask"),
    ("time_s,subtask\n1\n", "line 2 has not as many columns"),
    ("time_s,subtask\none,pick_up(Potato)\n", "line 2: time_s and episode are numbers"),
    ("time_s,subtask\nnan,pick_up(Potato)\n", "line 2: time_s nan is no time"),
    ("time_s,subtask\n2,pick_up(Potato)\n1,pick_up(Potato)\n", "line 3: time_s runs backwards"),
]


@pytest.mark.parametrize(("steps", "said"), BAD_STEPS)
def test_a_csv_file_that_says_something_else_is_refused(
    steps: str, said: str, tmp_path: Path
) -> None:
    path = tmp_path / "a.mcap"
    write_robot_log(path, ())
    with pytest.raises(FileFormatError, match=said):
        tried(path, steps=steps)


def test_words_of_a_csv_file_are_told_with_their_line(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    write_robot_log(path, ())
    why = why_not(path, steps="time_s,subtask,outcome\n1,pick_up(Potato),perhaps\n")
    assert "line 2: an outcome is succeeded, refused, failed, not 'perhaps'" in why
    why = why_not(path, steps="time_s,subtask\n1,pick up\n")
    assert "line 2: cannot read 'pick up' as a subtask" in why


# --- what is missing or wrong in a log ------------------------------------------------------------


def changed(topic: str, **fields: Any) -> Any:
    """A change to the messages of every topic with that ending."""

    def change(name: str, message: dict[str, Any]) -> dict[str, Any] | None:
        if not name.endswith(topic):
            return message
        return {**message, **fields} if fields else None

    return change


WRONG = [
    (changed("camera_info"), "there is no camera_info /head/color/camera_info"),
    (changed("camera_info", d=[0.1, 0.0]), "pictures are distorted: rectify them first"),
    (changed("camera_info", width=WIDTH + 1), "camera_info is of 17 x 12 pixels"),
    (changed("camera_info", k=[0.0] * 9), "focal lengths 0 and 0"),
    (changed("compressed", data=b"no picture"), "a packed picture"),
    (changed("compressed"), "no topic looks like the colour of a camera"),
    (changed("depth_to_color/image_raw", encoding="rgb8"), "a picture in 'rgb8'"),
    (changed("depth_to_color/image_raw", height=4 * 10**9), "pixels; at most"),
    (changed("depth_to_color/image_raw", width=WIDTH - 1), "has pictures of (15, 12)"),
    (changed("depth_to_color/image_raw", data=b""), "has 0 in all"),
    (changed("masks/image_raw", height=6, data=bytes(6 * WIDTH)), "beside a picture of (12, 16)"),
    (changed("/tf_static"), "frame 'camera_optical' is not under 'map'"),
    (changed("/tf"), "frame 'camera_optical' is not under 'odom' but ends at 'head'"),
]


@pytest.mark.parametrize(("change", "said"), WRONG)
def test_what_is_wrong_is_said_with_file_and_topic(change: Any, said: str, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    write_robot_log(path, change=change)
    found = tried(path)
    if isinstance(found, RecordedRun):
        with pytest.raises(FileFormatError) as error:
            list(found.looks())
        why = str(error.value)
    else:
        why = found.why
    assert said in why
    assert str(path) in why


def test_without_depth_or_masks_a_log_is_read_and_says_so(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    write_robot_log(path, change=changed("depth_to_color/image_raw"))
    found = read(path)
    assert "no depth that is aligned to it" in found.left_out[0]
    assert all(frame.colour_only for _, o in looks(found) for frame in o.frames)

    def bare(name: str, message: dict[str, Any]) -> dict[str, Any] | None:
        return None if "masks" in name or "detections" in name else message

    write_robot_log(path, change=bare)
    found = read(path)
    assert "name a segmenter" in found.left_out[0]
    assert looks(found)[0][1].frames[0].detections is None


def test_a_layout_names_topics_and_numbers(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    write_robot_log(path, root="/robot/eye")
    layout = (
        '[[mcap.cameras]]\nrgb = "/robot/eye/color/image_raw/compressed"\n'
        'masks = ["/robot/eye/masks/image_raw"]\nframe = "camera_optical"\n'
        '[mcap.cameras.labels]\n1 = "Potato-1"\n'
    )
    (_, seen), *_ = looks(read(path, layout))
    assert [d.instance for d in seen.frames[0].detections or ()] == ["Potato-1"]
    assert seen.frames[0].colour_only
    missing = layout.replace("eye/masks", "eye/mask")
    assert "there is no topic /robot/eye/mask/image_raw" in why_not(path, missing)
    with pytest.raises(FileFormatError, match=r"layout|rgbb"):
        tried(path, layout.replace("rgb =", "rgbb ="))


def test_messages_that_are_no_ros_2_ones_are_refused_by_topic(tmp_path: Path) -> None:
    from mcap.writer import Writer

    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("std_msgs/msg/String", "jsonschema", b"{}")
        channel = writer.register_channel("/subtask", "json", schema)
        writer.add_message(channel, 0, b"{}", 0)
        writer.finish()
    why = why_not(path)
    assert "topic /subtask has messages in 'json' with a definition in 'jsonschema'" in why


# --- damaged files --------------------------------------------------------------------------------


def whole(tmp_path: Path, **how: Any) -> bytes:
    path = tmp_path / "whole.mcap"
    write_robot_log(path, seconds=1.2, steps=((0.5, "pick_up(Potato)"),), **how)
    return path.read_bytes()


def test_a_file_that_is_cut_off_anywhere_says_so(tmp_path: Path) -> None:
    data = whole(tmp_path)
    path = tmp_path / "cut.mcap"
    for length in (0, 5, 8, 20, len(data) // 3, len(data) // 2, len(data) - 9, len(data) - 1):
        path.write_bytes(data[:length])
        why = why_not(path)
        assert "is cut off at byte" in why or "is no MCAP file" in why, length
        assert str(path) in why


def test_a_flipped_bit_is_a_clear_error_or_changes_nothing(tmp_path: Path) -> None:
    data = whole(tmp_path)
    path = tmp_path / "flipped.mcap"
    random = np.random.default_rng(0)
    for at in random.integers(0, len(data), 60).tolist():
        broken = bytearray(data)
        broken[at] ^= 1 << int(random.integers(8))
        path.write_bytes(bytes(broken))
        found = tried(path)
        if isinstance(found, Unread):
            assert str(path) in found.why
            continue
        try:
            list(found.looks())
        except FileFormatError as error:
            assert str(path) in str(error)


def test_without_chunks_and_packed_in_any_way_all_is_the_same(tmp_path: Path) -> None:
    from mcap.writer import CompressionType

    wanted = [o.time_s for _, o in looks(read_bytes(whole(tmp_path), tmp_path))]
    for how in (CompressionType.NONE, CompressionType.LZ4):
        data = whole(tmp_path, compression=how)
        assert [o.time_s for _, o in looks(read_bytes(data, tmp_path))] == wanted


def read_bytes(data: bytes, folder: Path) -> RecordedRun:
    path = folder / "again.mcap"
    path.write_bytes(data)
    return read(path)


def _chunk(compression: str, data: bytes, claimed: int) -> bytes:
    body = struct.pack("<QQQI", 0, 0, claimed, 0)
    body += struct.pack("<I", len(compression)) + compression.encode()
    body += struct.pack("<Q", len(data)) + data
    return struct.pack("<BQ", 6, len(body)) + body


def bombs() -> list[tuple[bytes, str]]:
    import lz4.frame
    import zstandard

    zeros = bytes(2**26)
    twice = zstandard.compress(zeros + zeros + zeros)
    return [
        (struct.pack("<BQ", 6, 2**62), "is cut off at byte"),
        (struct.pack("<BQ", 5, 2**40), "is cut off at byte"),
        (_chunk("zstd", twice, 2**40), "claims 1099511627776 bytes"),
        (_chunk("zstd", twice, 2**10), "unpacks to 201326592 bytes and says 1024"),
        (_chunk("lz4", lz4.frame.compress(zeros), 2**10), "1025 bytes instead of 1024"),
        (_chunk("", b"", 2**10), "0 bytes instead of 1024"),
        (_chunk("rar", b"", 0), "packed with 'rar'"),
    ]


def test_what_claims_to_be_huge_is_refused_before_it_is_unpacked(tmp_path: Path) -> None:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    made = bombs()
    peak = max(before, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    data = whole(tmp_path)
    for number, (bomb, said) in enumerate(made):
        path = tmp_path / f"{number}.mcap"
        path.write_bytes(data[:8] + bomb)
        assert said in why_not(path)
    grown_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - peak
    assert grown_kib < 300_000


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="the peak is read from /proc")
def test_a_log_of_gigabytes_is_read_in_little_memory(tmp_path: Path) -> None:
    """It has more looks than would fit."""
    path = tmp_path / "large.mcap"
    script = """
import sys
from pathlib import Path
import numpy as np
from forestall.logs.mcap_data import McapLogs
from forestall.domain.load import shipped
(run,) = McapLogs(Path(sys.argv[1])).runs(shipped("household"))
count = sum(1 for _ in run.looks())
status = Path("/proc/self/status").read_text()  # getrusage would have the memory of the parent, too
print(count, status.split("VmHWM:")[1].split()[0])
"""
    from log_samples import HEAD, observation

    small = observation(1, 0.0)
    big = dataclasses.replace(
        small.frames[0],
        rgb=np.zeros((960, 1280, 3), np.uint8),
        depth_m=np.ones((960, 1280), np.float32),
        intrinsics=dataclasses.replace(small.frames[0].intrinsics, width=1280, height=960),
        instance_ids=np.zeros((960, 1280), np.int32),
    )
    writer = McapWriter(path)
    writer.begin(HEAD)
    for number in range(80):
        writer.look(Observation((big,), small.gripper, float(number)))
        if number == 0:
            for executed in run().done[1]:
                writer.executed(executed)
    writer.finish(True, "")
    done = subprocess.run(
        [sys.executable, "-c", script, str(path)], capture_output=True, text=True, check=True
    )
    count, peak_kib = map(int, done.stdout.split())
    assert count == 80
    assert peak_kib < 600_000  # 80 looks of 13 MiB each are 1 GiB


# --- transforms -----------------------------------------------------------------------------------


def test_transforms_are_interpolated_and_end_where_they_end() -> None:
    tree = Transforms()
    tree.add("map", "a", 20, (2.0, 0, 0), (0, 0, np.sin(np.pi / 4), np.cos(np.pi / 4)))
    tree.add("map", "a", 10, (1.0, 0, 0), (0, 0, 0, 1))
    tree.add("a", "b", 0, (1.0, 0, 0), (0, 0, 0, 1))
    assert np.allclose(tree.pose("b", "map", 10)[:3, 3], (2, 0, 0))
    half = np.sqrt(0.5)
    assert np.allclose(tree.pose("b", "map", 15)[:3, 3], (1.5 + half, half, 0))
    assert np.allclose(tree.pose("b", "map", 99)[:3, 3], (2, 1, 0))
    assert np.allclose(tree.pose("b", "map", 0)[:3, 3], (2, 0, 0))


@pytest.mark.parametrize(
    ("samples", "said"),
    [
        ([("map", "a", (0, 0, 0), (0, 0, 0, 0))], "is not one"),
        ([("map", "a", (np.nan, 0, 0), (0, 0, 0, 1))], "is not one"),
        ([("m", "a", (0, 0, 0), (0, 0, 0, 1)), ("n", "a", (0, 0, 0), (0, 0, 0, 1))], "and in 'n'"),
    ],
)
def test_transforms_that_cannot_be_are_refused(samples: list[Any], said: str) -> None:
    tree = Transforms()
    with pytest.raises(InputError, match=said):
        for parent, child, at, turned in samples:
            tree.add(parent, child, 0, at, turned)


def test_frames_in_a_circle_end() -> None:
    tree = Transforms()
    tree.add("a", "b", 0, (0, 0, 0), (0, 0, 0, 1))
    tree.add("b", "a", 0, (0, 0, 0), (0, 0, 0, 1))
    with pytest.raises(InputError, match="not under 'map'"):
        tree.pose("a", "map", 0)


# --- the command ----------------------------------------------------------------------------------


def test_a_dry_run_shows_what_would_be_read_and_writes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "log.mcap"
    write(McapWriter(path), run())
    assert call(["import", "mcap", str(path), "--dry-run", "--states", "given"]) == 0
    said = capsys.readouterr().out
    assert "one: a good run, a demonstration; task heat-potato; 5 looks" in said
    assert f"pictures of {WIDTH} x {HEIGHT} with depth and masks" in said
    assert "put_on(Potato-1, Plate-1)" in said
    assert [p.name for p in tmp_path.iterdir() if p.name != "cache"] == ["log.mcap"]
    assert call(["import", "mcap", str(path)]) == 2
    assert "--dry-run" in capsys.readouterr().err
    folder = tmp_path / "none"
    folder.mkdir()
    assert call(["import", "robofail", str(folder), "--layout", "a.toml", "--dry-run"]) == 2
    assert "has no such option" in capsys.readouterr().err
