"""`forestall demos label` and `forestall domain learn`: what a person writes, and a draft."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from forestall import Monitor, Outcome
from forestall.assembly.sources import LABEL, demonstrations_from
from forestall.cli.main import call
from forestall.memory.store import open_store
from stranger import INSERT, TWELVE, scene


def test_one_label_is_enough_for_an_alarm(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    memory = tmp_path / "memory.db"
    facts = ["surface(hole-1)=clean", "held_by(peg-1, gripper)"]
    said = ["demos", "label", str(memory), "--subtask", INSERT, "--fact", *facts]
    assert call(said) == 0
    assert call(said) == 0
    assert "0 demonstrations added" in capsys.readouterr().out
    with open_store(memory) as store:
        (kept,) = store.required()
    assert dict(kept.perception) == {"source": LABEL}
    monitor = Monitor.from_demonstrations(memory)
    assert monitor.check(scene("hand"), INSERT).outcome is Outcome.PROCEED
    alarm = monitor.check(scene("hand", hole="dirty"), INSERT)
    assert alarm.outcome is Outcome.HOLD
    assert "hole-1 is dirty; it was clean in the only demonstration there is" in str(alarm)


def test_a_label_may_be_a_scene_with_more_said_beside_it(tmp_path: Path) -> None:
    (tmp_path / "scene.json").write_text(json.dumps(scene("hand", hole=None)), encoding="utf-8")
    memory = tmp_path / "memory.db"
    said = ["demos", "label", str(memory), str(tmp_path / "scene.json"), "--subtask", INSERT]
    assert call([*said, "--fact", "surface(hole-1)=clean"]) == 0
    with open_store(memory) as store:
        (kept,) = store.required()
    hole = kept.steps[0].whole.get("hole-1")
    assert hole is not None and hole.state("surface") == "clean"


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ([], "a label says nothing"),
        (["--fact", "not near(a-1, b-1)"], "cannot be drawn"),
        (["--fact", "near(a-1"], "cannot read 'near(a-1' as a fact"),
    ],
)
def test_a_label_that_says_nothing_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], more: list[str], said: str
) -> None:
    memory = tmp_path / "memory.db"
    assert call(["demos", "label", str(memory), "--subtask", INSERT, *more]) == 2
    assert said in capsys.readouterr().err
    assert not memory.exists()


def test_a_draft_of_a_domain(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    memory, draft = tmp_path / "memory.db", tmp_path / "pegs.toml"
    with open_store(memory, create=True) as store:
        for d in demonstrations_from(TWELVE):
            store.add(d)
    assert call(["domain", "learn", str(memory), "--out", str(draft), "--name", "pegs"]) == 0
    assert call(["domain", "check", str(draft)]) == 0
    assert "ok: pegs: 6 categories" in capsys.readouterr().out
    monitor = Monitor.from_demonstrations(memory, domain=draft)
    assert monitor.limits == ()
    decision = monitor.check(scene(), INSERT)
    assert decision.plan is not None and decision.plan.texts() == ["grasp(peg-1)", INSERT]
    assert call(["domain", "learn"]) == 2
