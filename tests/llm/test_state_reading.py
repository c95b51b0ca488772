"""States by a vision-language model: what it is shown and asked, and what becomes of its answer."""

from __future__ import annotations

import base64
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from forestall.assembly.stored import read_graph
from forestall.cli.main import call
from forestall.diagnosis.state_reading import ModelStateEstimator, StateReadingConfig
from forestall.domain.load import shipped
from forestall.errors import InputError, ObservationError
from forestall.llm.client import ClientConfig, OpenAIModel
from forestall.perception.folder import write_observation
from forestall.types.observation import Detection, Frame, Intrinsics
from llm.scenes import Scripted
from llm.server import Reply, failed, said, serving
from perception.synthetic import Solid, at, looking, observed

DOMAIN = shipped("household")
FRIDGE, MUG = "Fridge", "Mug"
SCENE = observed(
    [
        Solid("CounterTop-1", (-1.0, 0.0, 0.86), (1.0, 0.6, 0.9)),
        at("Plate-1", 0.1, 0.3, 0.9, (0.22, 0.22, 0.02), True),
        at("Mug-1", -0.4, 0.3, 0.9, (0.08, 0.08, 0.1), True),
    ],
    looking((0.0, -0.7, 1.65), (0.0, 0.3, 0.9)),
)
SHUT = {"open": "closed"}
CLEAN = {"filled": "empty", "dirty": "clean", "broken": "intact"}


@pytest.fixture(autouse=True)
def no_key(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    monkeypatch.setenv("NO_PROXY", "*")


def frame_of(*things: tuple[str, int], edge: int = 40) -> tuple[Frame, list[Detection]]:
    """A picture of squares of one grey each, side by side: categories and their greys."""
    rgb = np.full((80, 100 * len(things), 3), 90, dtype=np.uint8)
    found = []
    for k, (category, grey) in enumerate(things):
        mask = np.zeros(rgb.shape[:2], dtype=bool)
        mask[20 : 20 + edge, 100 * k + 30 : 100 * k + 30 + edge] = True
        rgb[mask] = grey
        found.append(Detection(category, mask, f"{category}-{k + 1}"))
    camera = Intrinsics(rgb.shape[1], 80, 100.0, 100.0, rgb.shape[1] / 2, 40.0)
    depth = np.full(rgb.shape[:2], 1.0, dtype=np.float32)
    return Frame(rgb, depth, camera, np.eye(4), detections=tuple(found)), found


def answer(*states: dict[str, str]) -> dict[str, dict[str, str]]:
    return {f"picture_{n}": s for n, s in enumerate(states, 1)}


def test_what_the_model_says_is_what_is_seen() -> None:
    frame, found = frame_of((FRIDGE, 200), ("Rucola", 10), (MUG, 220))
    model = Scripted([answer(SHUT, {**CLEAN, "filled": "cannot tell"})])
    states = ModelStateEstimator(model, DOMAIN).estimate(frame, found)
    assert states == [SHUT, {}, {**CLEAN, "filled": None}]
    (request,) = model.asked
    asked = json.loads(request.schema)["properties"]
    assert list(asked) == ["picture_1", "picture_2"]
    assert asked["picture_1"]["properties"]["open"]["enum"] == ["closed", "open", "cannot tell"]
    assert "temperature" not in asked["picture_2"]["properties"], "no camera shows it"
    text = request.messages[1][1]
    assert text.startswith('Picture 1: "fridge". open: closed ("a closed fridge"), open')
    assert 'Picture 2: "mug".' in text


def test_a_picture_shows_the_thing_and_darkens_what_is_around_it() -> None:
    frame, found = frame_of((MUG, 220))
    model = Scripted([answer(CLEAN)])
    ModelStateEstimator(model, DOMAIN, StateReadingConfig(pixels=96)).estimate(frame, found)
    with Image.open(io.BytesIO(model.asked[0].images[0])) as image:
        shown = np.asarray(image.convert("L"), dtype=float)
    assert shown.shape == (96, 96)
    assert shown[48, 48] == pytest.approx(220, abs=4) and shown[2, 2] == pytest.approx(40, abs=4)


def test_nothing_is_asked_twice_and_nothing_of_what_is_too_small() -> None:
    frame, found = frame_of((MUG, 220), (MUG, 220), (MUG, 120))
    model = Scripted([answer(CLEAN, {**CLEAN, "dirty": "dirty"})])
    estimator = ModelStateEstimator(model, DOMAIN)
    first = estimator.estimate(frame, found)
    assert [s["dirty"] for s in first] == ["clean", "clean", "dirty"], "two are alike to the pixel"
    assert estimator.estimate(frame, found) == first and len(model.asked) == 1
    small, specks = frame_of((MUG, 220), edge=10)
    assert estimator.estimate(small, specks) == [dict.fromkeys(CLEAN)] and len(model.asked) == 1


def test_many_things_are_asked_about_a_few_at_a_time() -> None:
    frame, found = frame_of(*((MUG, 100 + 20 * k) for k in range(5)))
    model = Scripted([answer(CLEAN, CLEAN), answer(CLEAN, CLEAN), answer(CLEAN)])
    states = ModelStateEstimator(model, DOMAIN, StateReadingConfig(things=2)).estimate(frame, found)
    assert states == [CLEAN] * 5 and [len(r.images) for r in model.asked] == [2, 2, 1]


def test_nothing_else_is_seen_of_what_is_broken() -> None:
    frame, found = frame_of((MUG, 220))
    model = Scripted([answer({**CLEAN, "broken": "broken"})])
    (states,) = ModelStateEstimator(model, DOMAIN).estimate(frame, found)
    assert states == {**dict.fromkeys(CLEAN), "broken": "broken"}


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        (answer({"open": "ajar"}), "picture_1.open is 'ajar'.*'closed', 'open', 'cannot tell'"),
        ({}, "picture_1"),
        ("it is shut", "cannot be read"),
    ],
)
def test_an_answer_that_is_none_is_asked_for_again_and_then_an_error(wrong: Any, told: str) -> None:
    frame, found = frame_of((FRIDGE, 200))
    model = Scripted([wrong, answer(SHUT)])
    assert ModelStateEstimator(model, DOMAIN).estimate(frame, found) == [SHUT]
    assert len(model.asked) == 2 and "not accepted" in model.asked[1].messages[-1][1]
    with pytest.raises(ObservationError, match=f"scripted tells no states.*{told}"):
        ModelStateEstimator(Scripted([wrong]), DOMAIN).estimate(frame, found)


def test_an_endpoint_that_fails_is_an_error_and_no_state() -> None:
    frame, found = frame_of((FRIDGE, 200))
    with serving(lambda body: failed(500)) as server:
        model = OpenAIModel(ClientConfig(model="m", retries=0, base_url=server.url))
        with pytest.raises(ObservationError, match=r"m tells no states of what is seen: .*500"):
            ModelStateEstimator(model, DOMAIN).estimate(frame, found)


def reads(body: dict[str, Any]) -> Reply:
    """Everything is as it is by default, but for mugs, which are dirty."""
    schema = body["response_format"]["json_schema"]["schema"]["properties"]
    pictures = [p for p in body["messages"][-1]["content"] if p["type"] == "image_url"]
    assert len(pictures) == len(schema)
    for picture in pictures:
        start, _, data = picture["image_url"]["url"].partition(",")
        assert start == "data:image/jpeg;base64"
        Image.open(io.BytesIO(base64.b64decode(data))).verify()
    return said(
        {
            name: {a: "dirty" if a == "dirty" else v["enum"][0] for a, v in p["properties"].items()}
            for name, p in schema.items()
        }
    )


def test_a_stored_picture_is_read_by_an_endpoint_and_again_from_the_file(tmp_path: Path) -> None:
    write_observation(tmp_path / "seen", SCENE)
    by_model = ["perceive", str(tmp_path / "seen"), str(tmp_path / "out"), "--states", "model"]
    file = str(tmp_path / "answers.jsonl")
    with serving(reads) as server:
        named = ["--states.base_url", server.url, "--states.model", "eyes"]
        assert call([*by_model, *named, "--states.record", file]) == 0
        assert len(server.asked) == 1
    graph = read_graph(tmp_path / "out" / "graph.json")
    mug = graph.get("Mug-1")
    assert mug is not None and (mug.state("dirty"), mug.state("filled")) == ("dirty", "empty")
    by_model[2] = str(tmp_path / "again")
    assert call([*by_model, "--states.file", file]) == 0
    assert read_graph(tmp_path / "again" / "graph.json") == graph
    said_of = json.loads((tmp_path / "again" / "perception.json").read_text(encoding="utf-8"))
    assert said_of["perception"]["state_estimator"] == "states by a language model (eyes)"


def test_it_needs_to_be_told_which_model(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    write_observation(tmp_path / "seen", SCENE)
    arguments = ["perceive", str(tmp_path / "seen"), str(tmp_path / "out"), "--states", "model"]
    assert call(arguments) == 2
    assert "OPENAI_API_KEY is not set" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("change", "told"),
    [({"things": 0}, "things is 0"), ({"margin": 0.5}, "margin is 0.5"), ({"pixels": 3}, "pixels")],
)
def test_numbers_out_of_range_are_named(change: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        StateReadingConfig(**change)
