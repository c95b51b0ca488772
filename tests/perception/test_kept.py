"""What demonstrations saw, kept by content and seen once more."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from forestall.assembly.configuration import Given
from forestall.assembly.kept import KeptObservations, seen_anew
from forestall.assembly.sources import written
from forestall.cli.main import call
from forestall.domain.load import shipped
from forestall.errors import InputError, MemoryFileError
from forestall.memory.store import open_store
from forestall.types.demonstration import Demonstration

from .rooms import detected, room

DOMAIN = shipped("household")
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
