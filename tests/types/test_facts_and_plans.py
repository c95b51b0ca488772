"""Literals, subtasks and plans read what they write and refuse the rest."""

import numpy as np
import pytest

from forestall.errors import InputError, PerceptionError
from forestall.types.facts import Literal, category_of
from forestall.types.observation import Detection, Frame, Intrinsics
from forestall.types.plan import Plan, Subtask, same_step


@pytest.mark.parametrize(
    "text", ["dirty(Plate-1)=clean", "inside(A, B)", "not inside(A-1, B-2)", "hand_empty()"]
)
def test_literal_text_round_trip(text: str) -> None:
    assert str(Literal.parse(text)) == text


@pytest.mark.parametrize("text", ["", "dirty", "dirty(A", "not dirty(A)=clean", "in(A,,B)"])
def test_bad_literals_say_what_to_write(text: str) -> None:
    with pytest.raises(InputError, match="as a fact"):
        Literal.parse(text)


def test_binding_replaces_variables_only() -> None:
    lifted = Literal.parse("inside(?object, Microwave-1)")
    assert str(lifted.bind({"?object": "Bowl-1"})) == "inside(Bowl-1, Microwave-1)"


def test_both_ways_to_write_a_subtask() -> None:
    assert Subtask.parse("(put_in, Plate, Microwave)") == Subtask.parse("put_in(Plate, Microwave)")
    assert str(Subtask.parse("(screw, Nut, Bolt)")) == "screw(Nut, Bolt)"


@pytest.mark.parametrize("text", ["pick up the mug", "", "pick_up", "pick_up(Mug", "Pick(Mug)"])
def test_bad_subtasks(text: str) -> None:
    with pytest.raises(InputError, match="as a subtask"):
        Subtask.parse(text)


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("pick_up(Mug-1)", "pick_up(Mug)", True),
        ("pick_up(Mug-1)", "pick_up(Mug-2)", False),
        ("pick_up(Mug)", "pick_up(Cup)", False),
        ("put_in(Mug, Sink-1)", "put_on(Mug, Sink-1)", False),
        ("screw(Nut)", "screw(Nut, Bolt)", False),
    ],
)
def test_the_same_step_up_to_naming_an_instance(one: str, other: str, same: bool) -> None:
    assert same_step(Subtask.parse(one), Subtask.parse(other)) is same
    assert same_step(Subtask.parse(other), Subtask.parse(one)) is same


def test_plan_texts_round_trip() -> None:
    texts = ["pick_up(Mug)", "put_on(Mug, CounterTop)"]
    assert Plan.parse(texts).texts() == texts


@pytest.mark.parametrize(
    ("name", "category"), [("StoveBurner-4", "StoveBurner"), ("Mug", "Mug"), ("-4", "-4")]
)
def test_category_of(name: str, category: str) -> None:
    assert category_of(name) == category


def frame(**change: object) -> Frame:
    parts: dict[str, object] = {
        "rgb": np.zeros((4, 6, 3), np.uint8),
        "depth_m": np.ones((4, 6), np.float32),
        "intrinsics": Intrinsics.from_vertical_fov(6, 4, 60.0),
        "camera_to_world": np.eye(4),
    }
    return Frame(**(parts | change))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"depth_m": np.full((4, 6), np.nan, np.float32)}, "24 NaN"),
        ({"depth_m": np.ones((4, 5), np.float32)}, "depth_m must be"),
        ({"depth_m": np.ones((4, 6))}, "float32"),
        ({"depth_m": -np.ones((4, 6), np.float32)}, "negative"),
        ({"rgb": np.zeros((4, 6), np.uint8)}, "rgb must be"),
        ({"camera_to_world": np.eye(3)}, "4, 4"),
        ({"camera_to_world": 2 * np.eye(4)}, "rotation"),
        ({"instance_ids": np.zeros((2, 2), np.int32)}, "instance_ids"),
        ({"detections": (Detection("Mug", np.zeros((2, 2), bool)),)}, "mask of Mug"),
    ],
)
def test_frames_refuse_what_cannot_be_used(change: dict[str, object], says: str) -> None:
    frame()
    with pytest.raises(PerceptionError, match=says):
        frame(**change)


@pytest.mark.parametrize("text", ["a(" + " " * 100_000, "a(b)" + " " * 100_000 + "x", "(" * 10_000])
def test_a_text_of_blanks_is_refused_at_once(text: str) -> None:
    with pytest.raises(InputError):
        Subtask.parse(text)
    with pytest.raises(InputError):
        Literal.parse(text)


def test_an_instance_number_is_one_that_can_be_counted_with() -> None:
    assert category_of("Mug-²") == "Mug-²"
    assert category_of("Mug-12") == "Mug"
