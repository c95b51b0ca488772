"""What demonstrations saw, kept by content and seen once more."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from forestall.assembly.configuration import Given
from forestall.assembly.kept import KeptObservations, seen_anew
from forestall.assembly.other_eyes import other_eyes
from forestall.assembly.sources import written
from forestall.cli.main import call
from forestall.domain.load import shipped
from forestall.errors import InputError, MemoryFileError
from forestall.memory.store import open_store
from forestall.perception.folder import write_observation
from forestall.perception.given import GivenStateEstimator
from forestall.perception.given_graph import GraphPassthrough
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import InstanceSegmenter
from forestall.types.demonstration import Demonstration, DemonstrationStep
from forestall.types.plan import Subtask

from .rooms import detected, room
from .synthetic import Solid, at, looking, observed

DOMAIN = shipped("household")
POSE = looking((0.0, -0.7, 1.65), (0.0, 0.3, 0.9))
COUNTER = Solid("CounterTop-1", (-1.0, 0.0, 0.86), (1.0, 0.6, 0.9))
MUG = at("Mug-1", -0.4, 0.3, 0.9, (0.08, 0.08, 0.1), True)
WANTED = "put_in(Plate-1, Microwave-1)"


def demonstration(kept: KeptObservations | None) -> Demonstration:
    """One whose graphs somebody wrote, beside what was seen."""
    made = written([(WANTED, {"objects": ["Plate-1", "Microwave-1"]})])
    hash_ = None if kept is None else kept.keep(detected(room()))
    return replace(made, steps=tuple(replace(s, observation=hash_) for s in made.steps))


def test_the_same_is_kept_once_and_comes_back(tmp_path: Path) -> None:
    kept = KeptObservations(tmp_path / "m.db")
    name = kept.keep(detected(room()))
    assert kept.keep(detected(room())) == name
    assert len([p for p in kept.folder.rglob("observation.json")]) == 1
    back = kept.get(name, DOMAIN)
    assert (back.frames[0].depth_m == room().frames[0].depth_m).all()
    assert (back.frames[0].rgb == room().frames[0].rgb).all()


def test_a_memory_is_seen_anew(tmp_path: Path) -> None:
    memory, out = tmp_path / "m.db", tmp_path / "anew.db"
    with open_store(memory, create=True) as store:
        store.add(demonstration(KeptObservations(memory)))
        (before,) = store.required()
    assert call(["demos", "perceive", str(memory), str(out), "--states", "given"]) == 0
    with open_store(out) as store:
        (after,) = store.required()
    assert after.steps[0].observation == before.steps[0].observation
    assert {"Bowl-1", "Mug-1", "Fridge-1"} <= {n.id for n in after.steps[0].whole.nodes}
    assert after.steps[0].graph.subtask == before.steps[0].subtask
    assert {"Plate-1", "Microwave-1"} <= {n.id for n in after.steps[0].graph.nodes}
    assert dict(after.perception)["segmenter"]


def test_what_was_not_kept_or_has_changed_is_named(tmp_path: Path) -> None:
    memory = tmp_path / "m.db"
    with pytest.raises(InputError, match="was not kept: record it with --keep-observations"):
        seen_anew(memory, [demonstration(None)], Given.named({"states": "given"}))
    kept = KeptObservations(memory)
    shown = demonstration(kept)
    (file,) = kept.folder.rglob("observation.json")
    file.write_text(file.read_text(encoding="utf-8") + " ", encoding="utf-8")
    with pytest.raises(MemoryFileError, match="its content has changed"):
        seen_anew(memory, [shown], Given.named({"states": "given"}))
    with pytest.raises(MemoryFileError, match="is not in"):
        kept.get("../x", DOMAIN)
    with pytest.raises(MemoryFileError, match="is not in"):
        kept.get("0" * 32, DOMAIN)


def test_other_eyes_name_things_themselves_and_subtasks_follow(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    memory, out = tmp_path / "m.db", tmp_path / "anew.db"
    kept = KeptObservations(memory)
    far = at("Plate-7", 0.5, 0.3, 0.9, (0.22, 0.22, 0.02), True)
    scene = observed([COUNTER, far, MUG], POSE)
    perceiver = GraphPerceiver(InstanceSegmenter(), GivenStateEstimator({}), DOMAIN)
    whole, step = perceiver.perceive(scene), Subtask.parse("pick_up(Plate-7)")
    seen = DemonstrationStep(
        0, step, perceiver.scope(whole, step), whole, observation=kept.keep(scene)
    )
    used = tuple(sorted(perceiver.describe().items()))
    with open_store(memory, create=True) as store:
        store.add(Demonstration("clear-up", "own", 0, (seen,), used))
        shown = store.required()
    words = ("--segmenter", "finder", "--finder", "vision.shades:Shades", "--states", "given")
    flags = [*words, "--finder.words", "counter,mug,plate"]
    assert call(["demos", "perceive", str(memory), str(out), *flags]) == 0
    with open_store(out) as store:
        (after,) = store.required()
    assert str(after.steps[0].subtask) == "pick_up(Plate-1)"
    assert "Plate-1" in {n.id for n in after.steps[0].graph.nodes}
    assert dict(after.perception)["segmenter"] == "shades, outlined by depth"
    write_observation(tmp_path / "scene", scene)
    asked = ["--subtask", "pick_up(Plate)", "--memory", str(out), "--json"]
    call(["check", str(tmp_path / "scene"), *asked])
    printed, told = capsys.readouterr()
    other = json.loads(printed[printed.index("{") :])["other_eyes"]
    assert "masks: shades, outlined by depth there, given masks here" in other and other in told
    said = other_eyes([after], perceiver.describe())
    assert "masks: shades, outlined by depth there, simulator instance ids here" in said
    assert other_eyes(shown, perceiver.describe()) == ""
    assert other_eyes([demonstration(None)], perceiver.describe()) == ""
    assert other_eyes(shown, GraphPassthrough(DOMAIN).describe()) == ""


def test_what_other_eyes_do_not_see_is_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    memory = tmp_path / "m.db"
    kept = KeptObservations(memory)
    plate = at("Plate-1", 0.1, 0.3, 0.9, (0.22, 0.22, 0.02), True)
    scene = observed([COUNTER, plate, MUG], POSE)
    perceiver = GraphPerceiver(InstanceSegmenter(), GivenStateEstimator({}), DOMAIN)
    whole, step = perceiver.perceive(scene), Subtask.parse("pick_up(Plate-1)")
    seen = DemonstrationStep(
        0, step, perceiver.scope(whole, step), whole, observation=kept.keep(scene)
    )
    with open_store(memory, create=True) as store:
        store.add(Demonstration("clear-up", "own", 0, (seen,)))
    for words, why in (("counter,mug", "Plate-1 is not seen"), ("sofa", "found none of")):
        flags = ["--segmenter", "finder", "--finder", "vision.shades:Shades", "--states", "given"]
        flags += ["--finder.words", words, "--segmenter.categories", "CounterTop, Mug"]
        assert call(["demos", "perceive", str(memory), str(tmp_path / f"{words}.db"), *flags]) == 0
        out, err = capsys.readouterr()
        assert out.startswith("0 demonstrations added")
        assert re.search(f"left out: demonstration [^:]+: .*{why}", err)
