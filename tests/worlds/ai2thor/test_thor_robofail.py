"""RoboFail's layout: labels in each spelling, plans and lists of actions, events as pickles."""

import json
import pickle
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builds import needs_package
from robofail_set import BOIL_WATER, SIZE, at_start, event_of, named_as_the_package

from forestall.domain.load import shipped
from forestall.errors import FileFormatError
from forestall.types.recorded import RecordedRun, Unread
from forestall.worlds.ai2thor.frames import frame_from_event
from forestall.worlds.ai2thor.robofail import layout
from forestall.worlds.ai2thor.robofail.dataset import RoboFail
from forestall.worlds.ai2thor.robofail.events import read_event
from forestall.worlds.ai2thor.robofail.labels import failed_at
from forestall.worlds.ai2thor.robofail.layout import episode_folders, read_episode
from forestall.worlds.ai2thor.robofail.looks import spans_of, step_at

ACTED = {
    7: "Pick up pot",
    14: "Put pot inside sink",
    17: "Toggle on faucet",
    20: "Toggle off faucet",
    23: "Pick up pot",
    30: "Put pot on fourth stove burner",
    33: "Toggle on fourth stove burner",
}
DROVE = {(1, 4): "Move to pot", (8, 11): "Move to sink", (24, 27): "Move to fourth stove burner"}


def episode(
    root: Path,
    name: str = "boilWater-1",
    plan: Any = BOIL_WATER,
    acted: Any = ACTED,
    drove: Any = DROVE,
    frames: int = 35,
    **more: Any,
) -> Path:
    """A folder as the data set has it, with events that nobody reads."""
    folder = root / name.rpartition("-")[0] / name
    (folder / "events").mkdir(parents=True)
    for k in range(1, frames + 1):
        (folder / "events" / f"step_{k}.pickle").touch()
    for file, said in (("interact", acted), ("nav", drove)):
        (folder / f"{file}_actions.pickle").write_bytes(pickle.dumps(said, 5))
    about = {
        "scene": "FloorPlan1",
        "actions": list(plan),
        "gt_failure_step": "00:15",
        "gt_failure_reason": "It failed.",
        **more,
    }
    (folder / "task.json").write_text(json.dumps(about))
    return folder


# --- when it failed -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("step", "seconds"),
    [
        ("01:15", (75, 75)),
        ("1:15", (75, 75)),
        ("0", (0, 0)),
        (75, (75, 75)),
        ("75", (75, 75)),
        (["00:25", "00:26", "00:28"], (25, 28)),
        ([["00:31", "00:41"]], (31, 41)),
        (["01:42", "02:23"], (102, 143)),
        ([31, "00:41"], (31, 41)),
        ("00:31-00:41", (31, 41)),
        ("00:31, 00:41", (31, 41)),
        ("00:31 to 00:41", (31, 41)),
    ],
)
def test_each_spelling_of_the_failure_is_read(step: Any, seconds: tuple[int, int]) -> None:
    assert failed_at(step, "Dropped Pot") == seconds


@pytest.mark.parametrize("step", ["00:00", 0, "", None, []])
def test_a_run_to_which_no_failure_was_added_went_well(step: Any) -> None:
    assert failed_at(step, "No failure added") is None


@pytest.mark.parametrize("step", ["soon", "00:75", "1:2:3", True, -1, {"a": 1}, [[["00:01"]]], 1e9])
def test_what_is_no_time_is_told(step: Any) -> None:
    with pytest.raises(FileFormatError, match=r"gt_failure_step: .* is no time"):
        failed_at(step, "Dropped Pot")


@pytest.mark.parametrize("step", ["", None, []])
def test_a_failure_without_a_time_is_told(step: Any) -> None:
    with pytest.raises(FileFormatError, match="names no time"):
        failed_at(step, "Dropped Pot")


@pytest.mark.parametrize("reason", [None, "", 3])
def test_a_run_of_which_nobody_says_how_it_went_is_told(reason: Any) -> None:
    with pytest.raises(FileFormatError, match="gt_failure_reason"):
        failed_at("00:12", reason)


# --- which frames are which step's ---------------------------------------------------------------


def test_drives_and_acts_have_their_frames(tmp_path: Path) -> None:
    spans, notes = spans_of(read_episode(episode(tmp_path)))
    assert [(s.first, s.last) for s in spans] == [
        (1, 4), (5, 7), (8, 11), (12, 14), (15, 17), (18, 20), (21, 23), (24, 27), (28, 30),
        (31, 33),
    ]  # fmt: skip
    assert notes == ()


@pytest.mark.parametrize(("second", "step"), [(0, 0), (7, 1), (8, 2), (15, 4), (33, 9), (99, 9)])
def test_a_second_falls_into_the_step_that_has_it(tmp_path: Path, second: int, step: int) -> None:
    spans, _ = spans_of(read_episode(episode(tmp_path)))
    assert step_at(spans, second) == step


def test_pouring_is_in_no_list_and_holds_its_place(tmp_path: Path) -> None:
    plan = (*BOIL_WATER[:7], "(pour, Pot, Sink)", "(put_on, Pot, CounterTop)")
    acted = {k: v for k, v in ACTED.items() if k <= 30}
    spans, notes = spans_of(read_episode(episode(tmp_path, plan=plan, acted=acted)))
    assert [s.listed for s in spans[6:]] == [True, False, True]
    assert spans[7].shown_by == {"FillObjectWithLiquid", "EmptyLiquidFromObject"}
    assert notes == ()


def test_what_the_list_has_beside_the_plan_is_told(tmp_path: Path) -> None:
    acted = {**ACTED, 22: "Close fridge"}
    del acted[17]
    spans, notes = spans_of(read_episode(episode(tmp_path, acted=acted)))
    assert len(spans) == len(BOIL_WATER)
    assert [s.listed for s in spans].count(False) == 1
    assert notes == (
        "step 5, toggle_on(Faucet), is not in its list of actions",
        "close_obj at frame 22 is no step of its plan",
    )


def test_a_drive_that_the_robot_added_is_no_step(tmp_path: Path) -> None:
    drove = {**DROVE, (5, 6): "Move to pot"}
    spans, _ = spans_of(read_episode(episode(tmp_path, drove=drove)))
    assert [(s.first, s.last) for s in spans if s.drives] == [(1, 4), (8, 11), (24, 27)]


# --- what is there -------------------------------------------------------------------------------


def test_an_episode_says_what_it_was(tmp_path: Path) -> None:
    names = {"StoveBurner_7a3c": "StoveBurner-4"}
    found = read_episode(episode(tmp_path, unity_name_map=names, chosen_failure="wrong perception"))
    assert (found.name, found.task, found.scene) == ("boilWater-1", "boil-water", "FloorPlan1")
    assert found.plan.texts()[3] == "put_in(Pot, Sink)"
    assert (found.frames, found.named, found.failure) == (35, names, (15, 15))
    assert (found.kind, found.reason) == ("wrong_perception", "It failed.")


def test_episodes_are_found_in_their_order_from_any_folder(tmp_path: Path) -> None:
    for name in ("boilWater-10", "boilWater-2", "makeCoffee-1"):
        episode(tmp_path / "sim_data", name)
    found = [f.name for f in episode_folders(tmp_path)]
    assert found == ["boilWater-2", "boilWater-10", "makeCoffee-1"]
    one = tmp_path / "sim_data" / "boilWater"
    assert [f.name for f in episode_folders(one)] == found[:2]
    assert [f.name for f in episode_folders(one / "boilWater-2")] == found[:1]


@pytest.mark.parametrize("name", ["", "nowhere"])
def test_a_folder_without_an_episode_is_told(tmp_path: Path, name: str) -> None:
    with pytest.raises(FileFormatError, match=r"task\.json is expected|unpack the data set"):
        RoboFail(tmp_path / name)


def test_a_folder_full_of_other_files_is_not_searched_to_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(layout, "MOST_ENTRIES", 20)
    for k in range(21):
        (tmp_path / f"{k}.txt").touch()
    with pytest.raises(FileFormatError, match="more than 20 files"):
        RoboFail(tmp_path)


def _without(folder: Path, name: str) -> None:
    (folder / name).unlink()


def _write(folder: Path, name: str, content: bytes) -> None:
    (folder / name).write_bytes(content)


def _task(folder: Path, **said: Any) -> None:
    path = folder / "task.json"
    about = {**json.loads(path.read_text()), **said}
    path.write_text(json.dumps({k: v for k, v in about.items() if v is not ...}))


BROKEN: Mapping[str, tuple[Any, str]] = {
    "no plan": (lambda f: _task(f, actions=...), "lacks 'actions'"),
    "an empty plan": (lambda f: _task(f, actions=[]), "no step"),
    "no subtask": (lambda f: _task(f, actions=["go on"]), "cannot read 'go on' as a subtask"),
    "another skill": (lambda f: _task(f, actions=["(fly, Pot)"]), "fly"),
    "no scene": (lambda f: _task(f, scene=...), "lacks 'scene'"),
    "no label": (lambda f: _task(f, gt_failure_reason=...), "gt_failure_reason"),
    "an odd label": (lambda f: _task(f, gt_failure_step="later"), "'later' is no time"),
    "no JSON": (lambda f: _write(f, "task.json", b"{"), "task.json"),
    "an event missing": (lambda f: _without(f, "events/step_9.pickle"), "step_9.pickle is missing"),
    "no list": (lambda f: _without(f, "interact_actions.pickle"), "interact_actions.pickle"),
    "a cut list": (lambda f: _write(f, "nav_actions.pickle", b"\x80\x04}"), "nav_actions.pickle"),
    "an odd frame": (
        lambda f: _write(f, "interact_actions.pickle", pickle.dumps({99: "Pick up pot"})),
        "99 is no frame from 1 to 35",
    ),
    "an odd action": (
        lambda f: _write(f, "interact_actions.pickle", pickle.dumps({9: "Sing"})),
        "'Sing' is no action",
    ),
    "a list that runs": (
        lambda f: _write(f, "nav_actions.pickle", b"cos\nsystem\n(Vtouch ran\ntR."),
        "names 'os.system'",
    ),
}


@pytest.mark.parametrize("how", BROKEN)
def test_what_is_wrong_with_an_episode_is_told_and_the_next_one_is_read(
    tmp_path: Path, how: str
) -> None:
    breaks, why = BROKEN[how]
    breaks(episode(tmp_path, "boilWater-1"))
    episode(tmp_path, "boilWater-2")
    first, second = RoboFail(tmp_path).runs(shipped("ai2thor"))
    assert isinstance(first, Unread)
    assert first.name == "boilWater-1"
    assert why in first.why
    assert isinstance(second, RecordedRun)


def test_two_episodes_of_one_name_are_told_apart_from_one(tmp_path: Path) -> None:
    episode(tmp_path / "a")
    episode(tmp_path / "b")
    first, second = RoboFail(tmp_path).runs(shipped("ai2thor"))
    assert isinstance(first, RecordedRun) and isinstance(second, Unread)
    assert "has the name of" in second.why


def test_an_episode_of_too_many_events_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(layout, "MOST_FRAMES", 30)
    with pytest.raises(FileFormatError, match="more than 30 events"):
        read_episode(episode(tmp_path))


# --- events --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def kitchen() -> Any:
    return at_start()


@pytest.fixture(scope="module")
def stored(kitchen: Any) -> bytes:
    with named_as_the_package():
        return pickle.dumps(event_of(kitchen), protocol=pickle.HIGHEST_PROTOCOL)


def kept(tmp_path: Path, data: bytes) -> Path:
    path = tmp_path / "step_1.pickle"
    path.write_bytes(data)
    return path


def test_an_event_has_its_picture_depth_masks_and_camera(
    tmp_path: Path, kitchen: Any, stored: bytes
) -> None:
    event = read_event(kept(tmp_path, stored))
    assert event.metadata == kitchen.metadata(1)["agents"][0]
    frame = frame_from_event(event, lambda object_id: object_id.partition("|")[0])
    assert np.array_equal(frame.rgb, kitchen.rgb)
    assert np.array_equal(frame.depth_m, np.where(kitchen.depth < 19.98, kitchen.depth, 0))
    counter = event.instance_masks[next(n for n in event.instance_masks if "CounterTop" in n)]
    assert counter.any() and counter.shape == (SIZE, SIZE)
    assert {n for n in event.instance_masks} == {
        c["name"]
        for c in kitchen.colors
        if "|" in c["name"] and (kitchen.ids[..., :3] == c["color"]).all(axis=-1).any()
    }


@needs_package
def test_an_event_of_the_package_itself_is_read_the_same(
    tmp_path: Path, kitchen: Any, stored: bytes
) -> None:
    from ai2thor.server import DepthFormat, Event

    real = Event(kitchen.metadata(1)["agents"][0])
    real.add_image(np.ascontiguousarray(kitchen.rgb[::-1]).tobytes())
    real.add_image_depth(
        np.ascontiguousarray(kitchen.depth[::-1]).tobytes(),
        depth_format=DepthFormat.Meters,
        camera_near_plane=0.1,
        camera_far_plane=20.0,
    )
    real.add_image_ids(np.ascontiguousarray(kitchen.ids[::-1]).tobytes())
    of_ours = read_event(kept(tmp_path, stored))
    of_theirs = read_event(kept(tmp_path, pickle.dumps(real, protocol=pickle.HIGHEST_PROTOCOL)))
    assert of_theirs.metadata == of_ours.metadata
    assert np.array_equal(of_theirs.frame, of_ours.frame)
    assert np.array_equal(of_theirs.depth_frame, of_ours.depth_frame)
    assert set(of_theirs.instance_masks) == set(of_ours.instance_masks) == set(real.instance_masks)
    for name, mask in of_theirs.instance_masks.items():
        assert np.array_equal(mask, real.instance_masks[name])


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.9, 0.9999])
def test_a_cut_event_is_told(tmp_path: Path, stored: bytes, share: float) -> None:
    with pytest.raises(FileFormatError, match=r"step_1\.pickle"):
        read_event(kept(tmp_path, stored[: int(share * len(stored))]))


@pytest.mark.parametrize(
    ("attribute", "value", "why"),
    [
        ("depth_frame", None, "depth_frame should be"),
        ("frame", np.zeros((4, 4, 3), np.uint8), "frame should be"),
        ("instance_masks", None, "no instance masks"),
        ("metadata", {"objects": []}, "its metadata has no agent"),
    ],
)
def test_an_event_without_what_is_needed_is_told(
    tmp_path: Path, kitchen: Any, attribute: str, value: Any, why: str
) -> None:
    event = event_of(kitchen)
    setattr(event, attribute, value)
    with named_as_the_package():
        data = pickle.dumps(event, protocol=pickle.HIGHEST_PROTOCOL)
    with pytest.raises(FileFormatError, match=why):
        read_event(kept(tmp_path, data))


def test_what_is_no_event_is_told(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="it is dict, no event"):
        read_event(kept(tmp_path, pickle.dumps({})))
