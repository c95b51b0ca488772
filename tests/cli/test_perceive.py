"""`forestall perceive`: from a folder of RGB-D to masks, a graph, an overlay, and a verdict."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from forestall.assembly.stored import read_graph
from forestall.cli.main import call
from forestall.perception.folder import read_observation, write_observation
from perception.synthetic import Solid, at, looking, observed
from vision import tiny

POSE = looking((0.0, -0.7, 1.65), (0.0, 0.3, 0.9))
OTHER = looking((0.5, -0.7, 1.65), (0.0, 0.3, 0.9))
COUNTER = Solid("CounterTop-1", (-1.0, 0.0, 0.86), (1.0, 0.6, 0.9))
PLATE = at("Plate-1", 0.1, 0.3, 0.9, (0.22, 0.22, 0.02), True)
MUG = at("Mug-1", -0.4, 0.3, 0.9, (0.08, 0.08, 0.1), True)
STATES = {"Plate-1": {"dirty": "clean"}}
SHADES = (
    "--segmenter", "finder", "--finder", "vision.shades:Shades",
    "--finder.words", "counter,mug,plate",
)  # fmt: skip
PICK_UP = ("--subtask", "pick_up(Plate)", "--strategy.name", "plan-check")


def unmasked(folder: Path, *poses: np.ndarray, time_s: float = 0.0) -> Path:
    """A folder of colour and depth alone."""
    write_observation(folder, observed([COUNTER, PLATE, MUG], *(poses or (POSE,)), time_s=time_s))
    document = json.loads((folder / "observation.json").read_text())
    for frame in document["frames"]:
        (folder / frame.pop("masks")).unlink()
        frame["detections"] = []
    (folder / "observation.json").write_text(json.dumps(document))
    return folder


def test_a_folder_of_pictures_becomes_masks_graph_overlay_and_verdict(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    photo, seen = unmasked(tmp_path / "photo"), tmp_path / "seen"
    assert call(["perceive", str(photo), str(seen), *SHADES]) == 0
    told = capsys.readouterr().out
    assert "segmenter: shades, outlined by depth" in told and "Plate-1" in told
    assert sorted(p.name for p in seen.iterdir()) == [
        "depth.npy", "graph.json", "masks.npz", "observation.json", "overlay.png",
        "perception.json", "rgb.png",
    ]  # fmt: skip
    graph = read_graph(seen / "graph.json")
    assert {n.id for n in graph.nodes} >= {"CounterTop-1", "Plate-1", "Mug-1"}
    observation, _ = read_observation(seen)
    found = {d.instance: d for d in observation.frames[0].detections or ()}
    assert set(found) == {"CounterTop-1", "Plate-1", "Mug-1"}
    assert not found["Mug-1"].outlined and found["Mug-1"].score == 0.8
    original = observed([COUNTER, PLATE, MUG], POSE).frames[0]
    assert original.instance_ids is not None
    mug = original.instance_ids == original.instance_names.index("Mug-1")
    both, either = found["Mug-1"].mask & mug, found["Mug-1"].mask | mug
    assert both.sum() > 0.6 * either.sum()
    with Image.open(seen / "overlay.png") as overlay:
        assert overlay.width > original.rgb.shape[1] and overlay.height >= original.rgb.shape[0]
    assert json.loads((seen / "perception.json").read_text())["perception"]["segmenter"] == (
        "shades, outlined by depth"
    )
    assert call(["check", str(seen), *PICK_UP, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["outcome"] == "proceed"
    at_once = ["--segmenter.name", "finder", "--finder.name", *SHADES[3:]]
    assert call(["check", str(photo), *PICK_UP, *at_once]) == 0


def test_own_masks_are_used_where_there_are_some(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_observation(tmp_path / "o", observed([COUNTER, PLATE, MUG], POSE), STATES)
    assert call(["perceive", str(tmp_path / "o"), str(tmp_path / "out"), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["perception"] == {"segmenter": "given masks", "state_estimator": "given states"}
    assert said["scenes"][0]["masks"] == 3
    observation, states = read_observation(tmp_path / "out")
    before, _ = read_observation(tmp_path / "o")
    assert states == STATES
    for mine, theirs in zip(
        observation.frames[0].detections or (), before.frames[0].detections or (), strict=True
    ):
        assert mine.instance == theirs.instance and np.array_equal(mine.mask, theirs.mask)


def test_looks_of_one_run_keep_their_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    unmasked(tmp_path / "run" / "step 3", POSE)
    unmasked(tmp_path / "run" / "step 12", OTHER, POSE, time_s=4.0)
    out = tmp_path / "out"
    assert call(["perceive", str(tmp_path / "run"), str(out), *SHADES]) == 0
    assert sorted(p.name for p in out.iterdir()) == ["01", "02"]
    names = []
    for place in ("01", "02"):
        observation, _ = read_observation(out / place)
        names += [{d.instance for d in f.detections or ()} for f in observation.frames]
    assert names == [{"CounterTop-1", "Plate-1", "Mug-1"}] * 3
    assert read_observation(out / "02")[0].time_s == 4.0
    capsys.readouterr()
    assert call(["check", str(out), *PICK_UP]) == 0


@pytest.mark.parametrize(
    ("more", "code", "why"),
    [
        ((), 2, "has no masks: say what finds things in its pictures, for example --segmenter"),
        ((*SHADES, "--segmenter.categories", "Potato"), 2, "asked for (potato) in 1 picture"),
        ((*SHADES, "--segmenter.categories", "Mugg"), 2, "did you mean Mug"),
        (("--segmenter", "finder", "--finder.model", "gone/model/x"), 3, "neither a folder nor"),
        (("--segmenter", "finder", "--finder", "onnx"), 2, "needs the option model"),
        (("--segmenter", "finders"), 2, "did you mean finder"),
    ],
)
def test_what_fails_leaves_nothing_behind(
    more: tuple[str, ...],
    code: int,
    why: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    if "gone/model/x" in more:
        tiny.libraries()
    photo = unmasked(tmp_path / "photo")
    assert call(["perceive", str(photo), str(tmp_path / "out"), *more]) == code
    assert why in capsys.readouterr().err
    assert [p.name for p in tmp_path.iterdir()] == ["photo"]


def test_the_second_look_that_fails_leaves_nothing_behind(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    unmasked(tmp_path / "run" / "1")
    bad = unmasked(tmp_path / "run" / "2")
    (bad / "rgb.png").write_bytes(b"no picture")
    assert call(["perceive", str(tmp_path / "run"), str(tmp_path / "out"), *SHADES]) == 2
    assert "rgb.png" in capsys.readouterr().err
    assert [p.name for p in tmp_path.iterdir()] == ["run"]


def test_nothing_is_written_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    photo = unmasked(tmp_path / "photo")
    (tmp_path / "out").mkdir()
    assert call(["perceive", str(photo), str(tmp_path / "out"), *SHADES]) == 2
    assert "is there already: name a new folder" in capsys.readouterr().err
    assert call(["perceive", str(tmp_path / "gone"), str(tmp_path / "new"), *SHADES]) == 2
    assert "is not a folder" in capsys.readouterr().err
    (tmp_path / "graph.json").write_text("{}")
    assert call(["perceive", str(tmp_path / "graph.json"), str(tmp_path / "new"), *SHADES]) == 2
    assert "is a scene graph: give a folder with pictures" in capsys.readouterr().err


@pytest.mark.parametrize("finder", ["grounding-dino", "owlv2"])
def test_real_classes_run_from_folder_to_overlay(
    finder: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    make = {"grounding-dino": tiny.grounding_dino, "owlv2": tiny.owlv2}[finder]
    photo = unmasked(tmp_path / "photo")
    model, outlines = make(tmp_path / "tiny"), tiny.sam2(tmp_path / "tiny-sam")
    flags = ["--segmenter", "finder", "--finder", finder, "--finder.model", str(model)]
    flags += ["--outliner", "sam", "--outliner.model", str(outlines), "--outliner.device", "cpu"]
    flags += ["--finder.least_score", "0", "--segmenter.categories", "CounterTop"]
    assert call(["perceive", str(photo), str(tmp_path / "out"), *flags, "--json"]) == 0
    out, err = capsys.readouterr()
    said = json.loads(out)
    assert said["perception"]["segmenter"] == f"{finder}:tiny, outlined by sam2:tiny-sam", err
    assert said["scenes"][0]["masks"] > 0
    assert (tmp_path / "out" / "overlay.png").is_file()


def test_states_and_features_come_from_the_encoder_that_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tiny.siglip(tmp_path / "tiny-siglip")
    photo = unmasked(tmp_path / "photo")
    flags = [*SHADES, "--image-encoder", "siglip", "--image-encoder.model", str(model)]
    flags += ["--feature", "image", "--json"]
    for states, name in (("given", "given states"), ("siglip", "learned states (siglip:tiny-sig")):
        out = tmp_path / states
        assert call(["perceive", str(photo), str(out), *flags, "--states", states]) == 0
        used = json.loads(capsys.readouterr().out)["perception"]
        assert used["features"] == "siglip:tiny-siglip"
        assert used["state_estimator"].startswith(name)
    graph = read_graph(tmp_path / "given" / "graph.json")
    assert all(n.feature for n in graph.nodes if n.box_m is not None)
