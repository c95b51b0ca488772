"""`forestall preconditions`: what is mined, corrections by hand over it, and who reads them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from forestall import Monitor, Outcome
from forestall.assembly.sources import demonstrations_from
from forestall.cli.main import call
from forestall.learning.learn import learn
from forestall.memory.store import open_store
from stranger import GRASP, INSERT, TWELVE, UNSCREW, scene

CLEAN = "insert: surface(?hole)=clean"
DIRTY = scene("hand", hole="dirty")


@pytest.fixture
def memory(tmp_path: Path) -> Path:
    path = tmp_path / "pegs.db"
    with open_store(path, create=True) as store:
        for d in demonstrations_from(TWELVE):
            store.add(d)
    return path


def rows(capsys: pytest.CaptureFixture[str], memory: Path, *more: str) -> dict[str, dict[str, Any]]:
    assert call(["preconditions", "list", str(memory), "--json", *more]) == 0
    return {f"{r['skill']}: {r['fact']}": r for r in json.loads(capsys.readouterr().out)["rows"]}


def edit(memory: Path, *more: str) -> int:
    return call(["preconditions", "edit", str(memory), *more])


def corrections(memory: Path) -> Path:
    return memory.with_name("pegs.db.preconditions.toml")


def test_demonstrations_and_uses_are_counted_apart(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    memory = tmp_path / "pegs.db"
    twice = [(GRASP, scene()), (INSERT, scene("hand")), (UNSCREW, scene(lid="tight")),
             (GRASP, scene()), (INSERT, scene("hand")), scene("hole")]  # fmt: skip
    with open_store(memory, create=True) as store:
        for d in demonstrations_from([*TWELVE[:3], twice]):
            store.add(d)
    found = rows(capsys, memory)[CLEAN]
    counted = [found[k] for k in ("support", "demonstrations", "held", "uses")]
    assert counted == [4, 4, 5, 5]
    assert call(["preconditions", "list", str(memory), "--skill", "insert"]) == 0
    out = capsys.readouterr().out
    assert "4 of 4" in out and "5 of 5" in out and "grasp" not in out
    draft = tmp_path / "draft.toml"
    assert call(["domain", "learn", str(memory), "--out", str(draft)]) == 0
    assert "unlike in all 4 demonstrations (5 uses)" in draft.read_text()


def test_one_subtask_with_the_demonstrations_that_say_so(
    memory: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(["preconditions", "show", str(memory), INSERT, "--json"]) == 0
    found = {s["fact"]: s for s in json.loads(capsys.readouterr().out)}
    clean = found["surface(hole-1)=clean"]
    assert (clean["support"], clean["demonstrations"], clean["unseen"]) == (12, 12, [])
    with open_store(memory) as store:
        assert clean["held"] == [f"{d.id}, step 3" for d in store.all()]
    assert call(["preconditions", "show", str(memory), "insert(peg, hole, driver)"]) == 0
    assert "surface(hole)=clean\n  held in 12 demonstrations:" in capsys.readouterr().out


def test_a_list_a_draft_and_the_detector_weigh_alike(
    memory: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    listed = {fact: row["weight"] for fact, row in rows(capsys, memory).items()}
    assert listed["insert: held_by(?peg, gripper)"] > 0.9 > listed[CLEAN], (
        "the hole was never dirty"
    )
    verdict = Monitor.from_demonstrations(memory).check(DIRTY, INSERT).verdict
    assert verdict is not None and verdict.score is not None
    assert 1 - verdict.score == pytest.approx(listed[CLEAN], abs=1e-3)
    assert call(["domain", "learn", str(memory)]) == 0
    assert f"{listed[CLEAN]:.2f}  {CLEAN.removeprefix('insert: ')}\n" in capsys.readouterr().out


def test_corrections_are_a_layer_that_the_monitor_reads(
    memory: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert Monitor.from_demonstrations(memory).check(DIRTY, INSERT).outcome is Outcome.HOLD
    assert edit(memory, "--drop", CLEAN, "--note", "the drill cleans it") == 0
    assert Monitor.from_demonstrations(memory).check(DIRTY, INSERT).outcome is Outcome.PROCEED
    capsys.readouterr()
    dropped = rows(capsys, memory)[CLEAN]
    assert (dropped["origin"], dropped["note"]) == ("left out by hand", "the drill cleans it")
    assert edit(memory, "--add", CLEAN, "--note", "chips jam it") == 0
    text = corrections(memory).read_text(encoding="utf-8")
    assert "[[add]]" in text and "[[drop]]" not in text
    monitor = Monitor.from_demonstrations(memory, detector={"threshold": 0.01,
                                                            "name": "preconditions"})  # fmt: skip
    decision = monitor.check(DIRTY, INSERT)
    assert decision.outcome is Outcome.HOLD
    assert decision.diagnosis is not None and decision.verdict is not None
    assert decision.diagnosis.cause == (
        "hole-1 is dirty; a person says that it must be clean before insert"
    )
    assert "surface(hole-1)=clean (a correction by hand)" in decision.verdict.note
    assert edit(memory, "--undo", CLEAN) == 0
    assert "[[" not in corrections(memory).read_text(encoding="utf-8")


def test_what_is_added_may_contradict_what_is_mined(memory: Path) -> None:
    tight = scene(lid="tight")
    assert Monitor.from_demonstrations(memory).check(tight, UNSCREW).outcome is Outcome.PROCEED
    assert edit(memory, "--add", "unscrew(lid, hole): thread(lid)=loose") == 0
    decision = Monitor.from_demonstrations(memory).check(tight, UNSCREW)
    assert decision.outcome is Outcome.HOLD and "must be loose" in str(decision)
    assert "lies_in_nothing" not in corrections(memory).read_text(encoding="utf-8")


def test_recording_and_mining_leave_them_alone(memory: Path, tmp_path: Path) -> None:
    assert edit(memory, "--drop", CLEAN) == 0
    before = corrections(memory).read_bytes()
    steps = [{"subtask": GRASP, "scene": scene()}]
    (tmp_path / "more.json").write_text(json.dumps({"task": "t", "steps": steps}))
    assert call(["demos", "add", str(memory), str(tmp_path / "more.json")]) == 0
    assert call(["preconditions", "list", str(memory)]) == 0
    assert corrections(memory).read_bytes() == before


def test_check_reads_them_and_the_page_says_so(
    memory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "dirty.json").write_text(json.dumps(DIRTY))
    asked = ["check", str(tmp_path / "dirty.json"), "--subtask", INSERT, "--memory", str(memory),
             "--detector.name", "preconditions"]  # fmt: skip
    assert call(asked) == 1
    assert edit(memory, "--drop", CLEAN) == 0
    assert call(asked) == 0
    other = tmp_path / "other.toml"
    other.write_text('[[add]]\nbefore = "insert"\nfact = "surface(?hole)=clean"\n')
    named = ["--detector.corrections", str(other), "--reasoner.corrections", str(other)]
    capsys.readouterr()
    assert call([*asked, *named]) == 1
    assert "a person says" in capsys.readouterr().out


def test_a_stale_correction_is_told(memory: Path, capsys: pytest.CaptureFixture[str]) -> None:
    nowhere = "insert(lid, hole, driver): vacant(hole)"
    assert edit(memory, "--drop", "grasp: surface(?peg)=clean", "--add", nowhere) == 0
    told = capsys.readouterr().err
    assert "drop[0]: grasp: surface(?peg)=clean: this is not mined any more" in told
    assert "add[0]: insert(lid, hole, driver): vacant(?hole): no demonstration has such" in told
    assert call(["preconditions", "list", str(memory)]) == 0
    assert "not mined any more" in capsys.readouterr().err


EXPECTED = """
[[expected]]
before = "{step}"
task = "box the peg"
facts = ["surface(?hole)=clean"]
why = "chips fall through"
source = "model"
model = "small"
"""


def test_what_a_language_model_expects_is_listed_as_evidence_of_its_own(
    memory: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mined = rows(capsys, memory)
    beside = memory.with_name("pegs.db.expected.toml")
    beside.write_text(EXPECTED.format(step="insert(lid, hole, driver)"))
    assert call(["preconditions", "list", str(memory), "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["rows"]
    (own,) = (r for r in listed if r["origin"] == "expected by a language model")
    assert [r for r in listed if r is not own] == list(mined.values())
    assert (own["support"], own["demonstrations"], own["uses"]) == (0, 0, 0)
    assert own["weight"] < 2 / 3 and own["kinds"] == ["insert(lid, hole, driver)"]
    assert own["note"] == "small: chips fall through"
    assert call(["preconditions", "list", str(memory), "--task", "box the peg"]) == 0
    out = capsys.readouterr().out
    assert "expected by a language model: small: chips" in out and out.count("insert") == 2
    beside.write_text(EXPECTED.format(step="insert(peg, hole, driver)"))
    assert call(["preconditions", "list", str(memory), "--expectations", str(beside)]) == 0
    assert "no say, since a demonstration shows it" in capsys.readouterr().out
    beside.write_text(EXPECTED.format(step="insrt(peg, hole, driver)"))
    assert call(["preconditions", "list", str(memory)]) == 2
    assert "did you mean insert" in capsys.readouterr().err
    assert call(["preconditions", "list", str(memory), "--expectations", "none.toml"]) == 2


def test_export_as_a_list_and_as_a_domain(
    memory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert edit(memory, "--drop", CLEAN, "--add", "unscrew: surface(?hole)=clean") == 0
    out, own = tmp_path / "out.toml", tmp_path / "own.toml"
    assert call(["preconditions", "export", str(memory), "--out", str(out)]) == 0
    assert 'fact = "surface(?hole)=clean"\nsupport = 12\ndemonstrations = 12' in out.read_text()
    asked = ["preconditions", "export", str(memory), "--out", str(own), "--format", "domain"]
    assert call(asked) == 0
    assert call(["domain", "check", str(own)]) == 0
    capsys.readouterr()
    monitor = Monitor.from_demonstrations(memory, domain=own)
    needs = {s: [str(n.formula) for n in k.needs] for s, k in monitor.domain.skills.items()}
    assert "surface(?hole)=clean" not in needs["insert"]
    assert "surface(?hole)=clean" in needs["unscrew"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (
            ["list", "absent.db"],
            "absent.db does not exist: make one with 'forestall demos add'",
        ),
        (["list", "pegs.db", "--skill", "inser"], "did you mean insert"),
        (["list", "pegs.db", "--task", "t"], "unknown task of pegs.db"),
        (["show", "pegs.db", "insert(peg, lid, driver)"], "unknown subtask of pegs.db"),
        (["show", "pegs.db", "inser(peg)"], "did you mean insert"),
        (
            ["show", "pegs.db", "insert"],
            "with 'forestall preconditions list pegs.db --skill insert'",
        ),
        (["edit", "pegs.db"], "nothing to correct: give --drop, --add or --undo"),
        (["edit", "pegs.db", "--drop", "surface(hole)"], "write 'skill: fact(?parameter)'"),
        (["edit", "pegs.db", "--drop", "inser: vacant(?hole)"], "did you mean insert"),
        (["edit", "pegs.db", "--drop", "insert: vacnt(?hole)"], "did you mean vacant"),
        (["edit", "pegs.db", "--drop", "insert: vacant(?hol)"], "did you mean ?hole"),
        (["edit", "pegs.db", "--drop", "insert: surface(?hole)=claen"], "did you mean clean"),
        (["edit", "pegs.db", "--drop", "insert: vacant(hoel)"], "did you mean hole"),
        (["edit", "pegs.db", "--undo", "insert: vacant(?hole)"], "unknown correction in"),
    ],
)
def test_what_is_not_valid_is_told_in_a_sentence(
    memory: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: Sequence[str],
    says: str,
) -> None:
    monkeypatch.chdir(memory.parent)
    code = call(["preconditions", *arguments])
    out, err = capsys.readouterr()
    assert code == (3 if "absent.db" in arguments else 2)
    assert not out and says in err and len(err.splitlines()) == 1
    assert not corrections(memory).exists()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('[[drops]]\nbefore = "insert"', "unknown table of corrections 'drops': did you mean drop"),
        ('[[drop]]\nbefore = "insert"', "drop[0] lacks 'fact'"),
        ('[[drop]]\nfor = "x"', "drop[0]: unknown key 'for'"),
        (
            '[[add]]\nbefore = "inser"\nfact = "vacant(?hole)"',
            "add[0].before: unknown skill",
        ),
        ('[[add]]\nbefore = "insert"\nfact = "vacant(?h)"', "add[0].fact: unknown parameter"),
        (
            '[[add]]\nbefore = "insert"\nfact = "vacnt(?hole)"',
            "add[0].fact: unknown predicate",
        ),
        ("drop = 3", "drop: a list is expected, got 3"),
        ("[[drop", "not valid TOML"),
    ],
)
def test_a_file_that_is_not_valid_is_told_with_its_place(
    memory: Path, capsys: pytest.CaptureFixture[str], text: str, says: str
) -> None:
    corrections(memory).write_text(text)
    assert call(["preconditions", "list", str(memory)]) == 2
    err = capsys.readouterr().err
    assert f"{corrections(memory)}: {says}" in err and len(err.splitlines()) == 1


def test_corrections_count_wherever_their_memory_is_in_the_source(memory: Path) -> None:
    assert edit(memory, "--add", "insert: thread(?hole)=tight", "--note", "it slips") == 0
    fine = scene("hand")
    elsewhere = memory.with_name("more.db")
    with open_store(elsewhere, create=True) as store:
        for d in demonstrations_from(TWELVE[:3]):
            store.add(replace(d, id=f"other {d.id}"))
    for source in (memory, [memory], memory.parent, (m for m in (elsewhere, memory))):
        decision = Monitor.from_demonstrations(source).check(fine, INSERT)
        assert decision.outcome is Outcome.HOLD and "it slips" in decision.why
    own = learn(demonstrations_from(memory)).domain
    for mixture in ([memory], [TWELVE[0], memory]):
        decision = Monitor.from_demonstrations(mixture, own).check(fine, INSERT)
        assert decision.outcome is not Outcome.PROCEED
    assert Monitor.from_demonstrations(elsewhere).check(fine, INSERT).outcome is Outcome.PROCEED


def test_what_one_memory_adds_no_other_leaves_out(memory: Path) -> None:
    other = memory.with_name("another.db")
    with open_store(other, create=True) as store:
        for d in demonstrations_from(TWELVE[:3]):
            store.add(d)
    assert edit(memory, "--add", CLEAN) == 0
    assert edit(other, "--drop", CLEAN) == 0
    for source in ([memory, other], [other, memory]):
        verdict = Monitor.from_demonstrations(source).check(DIRTY, INSERT).verdict
        assert verdict is not None and "a correction by hand" in verdict.note


def test_a_correction_for_a_task_that_nothing_demonstrates_is_told(memory: Path) -> None:
    text = '[[add]]\nbefore = "insert"\nfact = "thread(?hole)=tight"\ntask = "close the lid"\n'
    corrections(memory).write_text(text, encoding="utf-8")
    with pytest.warns(
        UserWarning, match=r"thread\(\?hole\)=tight' counts in no task that is demon"
    ):
        Monitor.from_demonstrations(memory)
