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


def test_what_is_equal_is_added_once_in_one_command_as_over_several(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    steps = [{"subtask": INSERT, "scene": scene("hand")}]
    files = [tmp_path / "a.json", tmp_path / "b.json"]
    files[0].write_text(json.dumps({"task": "t", "steps": steps}), encoding="utf-8")
    files[1].write_text(json.dumps({"task": "other", "steps": steps}), encoding="utf-8")
    memory, several = tmp_path / "one.db", tmp_path / "several.db"

    def add(to: Path, *sources: Path) -> str:
        assert call(["demos", "add", str(to), *map(str, sources)]) == 0
        return capsys.readouterr().out

    assert add(memory, files[0], files[0]) == (
        f"1 demonstrations added to {memory}, 1 were there already\n"
    )
    assert add(several, files[0]) == f"1 demonstrations added to {several}\n"
    assert add(several, files[0]).startswith("0 demonstrations added")
    assert add(memory, tmp_path) == f"1 demonstrations added to {memory}, 3 were there already\n"
    with open_store(memory) as store, open_store(several) as other:
        first, second = store.required()
        assert {first.task, second.task} == {"t", "other"}
        assert list(other.required()) == [d for d in (first, second) if d.task == "t"]


def test_what_a_folder_holds_besides_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, memory = tmp_path / "shown", tmp_path / "memory.db"
    told = json.dumps({"steps": [{"subtask": INSERT, "scene": scene("hand")}]})
    for name in ("a.json", "b.jsn", "more/c.json", ".hidden", "seen/observation.json"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(told, encoding="utf-8")
    assert call(["demos", "add", str(memory), str(folder)]) == 0
    out, err = capsys.readouterr()
    assert out == f"1 demonstrations added to {memory}\n"
    unknown, nested = err.splitlines()
    assert unknown == f"left out: {folder / 'b.jsn'}: files may be .json, .db, .sqlite, .sqlite3"
    assert nested == f"left out: {folder / 'more'}: no folder of a run"
    assert call(["demos", "add", str(memory), str(folder / "a.json")]) == 0
    assert capsys.readouterr().err == ""


def test_repeats_in_a_memory_are_copied_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with open_store(tmp_path / "twelve.db", create=True) as store:
        for demonstration in demonstrations_from(TWELVE):
            store.add(demonstration)
        assert len(store) == 12
    memory = tmp_path / "memory.db"
    assert call(["demos", "add", str(memory), str(tmp_path / "twelve.db")]) == 0
    assert "3 demonstrations added" in (out := capsys.readouterr().out)
    assert "9 were there already" in out


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


@pytest.mark.parametrize(
    ("said", "told"),
    [
        (["--subtask", "inser(peg-1, hole-1, driver-1)"], "unknown skill 'inser': did you mean in"),
        (["--subtask", "insert(pge-1, hole-1, driver-1)"], "unknown thing 'pge-1': did you mean"),
        (["--subtask", "insert(peg-1, hole-1)"], "insert has 3 argument(s), not 2"),
        (["--fact", "surfce(hole-1)=clean"], "unknown attribute 'surfce': did you mean surface"),
        (["--fact", "surface(hole-1)=claen"], "unknown value of surface 'claen': did you mean cle"),
        (["--fact", "surface(hoel-1)=clean"], "unknown thing 'hoel-1': did you mean hole"),
        (["--fact", "hold_by(peg-1, gripper)"], "unknown relation 'hold_by': did you mean held_by"),
        (["--fact", "held_by(peg-1)=gripper"], "is a relation: write held_by(peg-1, gripper)"),
        (["--fact", "surface(hole-1)"], "says no value: write surface(hole-1)=clean"),
        (["--fact", "clean(hole-1)"], "did you mean surface(hole-1)=clean?"),
        (["--fact", "shiny(hole-1)"], "neither a state nor a relation: write attribute(thing)="),
        (["--fact", "surface(hole-1, peg-1)=clean"], "gives a state to 2 things"),
    ],
)
def test_a_slip_of_the_pen_in_a_label_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], said: list[str], told: str
) -> None:
    memory = tmp_path / "memory.db"
    with open_store(memory, create=True) as store:
        for d in demonstrations_from(TWELVE[:2]):
            store.add(d)
    subtask = [] if "--subtask" in said else ["--subtask", INSERT]
    fact = [] if "--fact" in said else ["--fact", "surface(hole-1)=clean"]
    assert call(["demos", "label", str(memory), *subtask, *fact, *said]) == 2
    err = capsys.readouterr().err
    assert told in err and len(err.splitlines()) == 1
    with open_store(memory) as store:
        assert len(store) == 2


def test_new_words_in_a_label_are_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    memory = tmp_path / "memory.db"
    said = ["demos", "label", str(memory), "--subtask", INSERT, "--fact", "surface(hole-1)=clean"]
    assert call(said) == 0
    again = ["demos", "label", str(memory), "--subtask", INSERT]
    assert call([*again, "--fact", "colour(bolt-7)=red"]) == 0
    assert call([*again, "--fact", "surfaces(hole-1)=clean"]) == 2
    assert "say --new where it is another word" in capsys.readouterr().err
    assert call([*again, "--fact", "surfaces(hole-1)=clean", "--new"]) == 0
    own = ["demos", "label", str(tmp_path / "own.db"), "--domain", "bench", "--subtask"]
    assert call([*own, "pick(Nut-1)", "--fact", "torqe(Nut-1)=tight"]) == 2
    assert "did you mean torque" in capsys.readouterr().err


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
