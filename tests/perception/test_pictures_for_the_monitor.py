"""The public monitor on pictures: demonstrations, questions, folders, words of detectors."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from forestall import InputError, Monitor, Outcome
from forestall.cli.main import call
from forestall.perception.folder import write_observation
from forestall.types.observation import Observation

from .rooms import ROOM, detected
from .synthetic import looking, observed

WANTED = "put_in(Plate, Microwave)"
OPEN = {"Microwave": {"open": "open", "toggled": "off"}}


def seen(bowl: bool) -> Observation:
    """The room, with or without the bowl in the microwave, and with states that are told."""
    solids = [s for s in ROOM if bowl or s.id != "Bowl-1"]
    eye = looking((0.1, -0.9, 1.5), (0.0, 0.3, 0.85))
    look = observed(solids, eye, holding="Plate-1", hand=(0.25, -0.3, 1.1), time_s=2.0)
    frame = look.frames[0]
    noise = np.random.default_rng(bowl).integers(0, 20, frame.rgb.shape)
    rgb = np.clip(frame.rgb.astype(np.int64) + noise, 0, 255).astype(np.uint8)
    look = detected(replace(look, frames=(replace(frame, rgb=rgb),)))
    told = tuple(
        replace(d, states=tuple(OPEN.get(d.category, {}).items()))
        for d in look.frames[0].detections or ()
    )
    return replace(look, frames=(replace(look.frames[0], detections=told),))


def monitor(source: Any) -> Monitor:
    return Monitor.from_demonstrations(source, domain="household")


FITS, FULL = seen(False), seen(True)


def test_pictures_show_what_to_expect_and_are_judged() -> None:
    asked = monitor([(WANTED, FITS)])
    fine = asked.check(FITS, WANTED)
    assert fine.outcome is Outcome.PROCEED, fine
    alarm = asked.check(FULL, WANTED)
    assert not alarm.may_start
    assert "Bowl-1 is inside Microwave-1" in str(alarm)
    words = asked.check(FITS, "put_in(dinner plate, microwave oven)")
    assert words.subtask == fine.subtask


def test_demonstrations_may_be_folders_of_observations(tmp_path: Path) -> None:
    write_observation(tmp_path / "one", FITS, OPEN_BY_INSTANCE)
    steps = [{"subtask": WANTED, "scene": "one"}]
    (tmp_path / "shown.json").write_text(json.dumps({"steps": steps}), encoding="utf-8")
    asked = monitor(tmp_path / "shown.json")
    assert asked.check(FITS, WANTED).outcome is Outcome.PROCEED
    assert not asked.check(FULL, WANTED).may_start


OPEN_BY_INSTANCE = {"Microwave-1": OPEN["Microwave"]}


def test_they_are_added_to_a_memory_from_the_command_line(tmp_path: Path) -> None:
    write_observation(tmp_path / "one", FITS, OPEN_BY_INSTANCE)
    steps = [{"subtask": WANTED, "scene": "one"}]
    (tmp_path / "shown.json").write_text(json.dumps({"steps": steps}), encoding="utf-8")
    memory, shown = str(tmp_path / "m.db"), str(tmp_path / "shown.json")
    assert call(["demos", "add", memory, shown]) == 2
    assert call(["demos", "add", memory, shown, "--domain", "household"]) == 0
    asked = monitor(memory)
    assert asked.check(FITS, WANTED).outcome is Outcome.PROCEED
    assert not asked.check(FULL, WANTED).may_start


def test_a_picture_without_depth_is_not_judged_to_fit() -> None:
    frame = FITS.frames[0]
    plain = {
        "rgb": frame.rgb,
        "detections": [
            {"category": d.category, "instance": d.instance, "mask": d.mask}
            for d in frame.detections or ()
        ],
    }
    decision = monitor([(WANTED, FITS)]).check(plain, WANTED)
    assert decision.outcome is not Outcome.PROCEED
    assert not decision.may_start


def test_a_picture_needs_a_domain() -> None:
    with pytest.raises(InputError, match="step 1: a picture needs a domain"):
        Monitor.from_demonstrations([(WANTED, FITS)])
    graphs = Monitor.from_demonstrations([("push(cup-1)", {"objects": ["cup-1"]})])
    with pytest.raises(InputError, match="no perceiver"):
        graphs.check(FITS, "push(cup-1)")
