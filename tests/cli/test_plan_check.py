"""`forestall plan check`: plans by anybody, on scenes of every kind."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import pytest

from forestall.assembly.configuration import run_config
from forestall.assembly.make import prepare, run_episode
from forestall.cli.main import call
from forestall.perception.folder import write_observation
from forestall.records.record import RunRecorder
from perception.synthetic import Solid, at, looking, observed

SCENE: dict[str, Any] = {
    "objects": {
        "Plate-1": {"dirty": "clean"},
        "Bowl-1": {},
        "Microwave-1": {"open": "open", "toggled": "off"},
        "CounterTop-1": {},
    },
    "relations": ["Bowl-1 inside Microwave-1", "Plate-1 on_top_of CounterTop-1"],
}
EMPTY = SCENE | {"relations": ["Plate-1 on_top_of CounterTop-1", "Bowl-1 on_top_of CounterTop-1"]}
STEPS = ["navigate_to_obj(Plate)", "pick_up(Plate)", "navigate_to_obj(Microwave)",
         "put_in(Plate, Microwave)"]  # fmt: skip
GOAL = ["--goal", "inside(Plate, Microwave)"]


def scene(folder: Path, data: object = EMPTY, name: str = "scene.json") -> str:
    path = folder / name
    path.write_text(json.dumps(data), encoding="utf-8")
    return str(path)


def asked(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, dict[str, Any]]:
    code = call(["plan", "check", *arguments, "--json"])
    out, err = capsys.readouterr()
    assert out, err
    return code, json.loads(out)


def test_a_plan_that_runs_and_one_that_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan = "; ".join(STEPS)
    code, told = asked(capsys, plan, scene(tmp_path), *GOAL)
    assert (code, told["outcome"], told["unmet"]) == (0, "runs", [])
    assert [s["status"] for s in told["steps"]] == ["ok"] * 4
    assert told["steps"][3]["meant"] == "put_in(Plate-1, Microwave-1)"
    code, told = asked(capsys, f"{plan}; close_obj(Microwave)", scene(tmp_path, SCENE), *GOAL)
    assert (code, told["outcome"]) == (1, "does not run")
    assert [s["status"] for s in told["steps"]] == ["ok"] * 3 + ["refused", "not reached"]
    assert told["refusal"] == {
        "step": 4,
        "reason": "Microwave-1 has no room: it already has Bowl-1",
        "lacking": ["vacant(Microwave-1)"],
    }
    assert call(["plan", "check", plan, scene(tmp_path, SCENE), *GOAL]) == 1
    assert "does not run: step 4 is refused: Microwave-1 has no room" in capsys.readouterr().out


def test_a_goal_that_stays_unmet_and_one_that_is_spoilt(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    goal = "inside(Plate, Microwave); open(Microwave)=closed"
    code, told = asked(capsys, "; ".join(STEPS), scene(tmp_path), "--goal", goal)
    assert (code, told["unmet"]) == (1, ["open(Microwave)=closed"])
    forbidden = "inside(Plate, Microwave); never open(Microwave)=open"
    code, told = asked(capsys, "; ".join(STEPS), scene(tmp_path), "--goal", forbidden)
    assert code == 1 and told["never"] == ["open(Microwave)=open"]
    assert told["spoils"][0]["sentence"].endswith("before the first step, which the goal forbids")
    fridge = EMPTY | {"objects": {**EMPTY["objects"], "Fridge-1": {"open": "closed"}}}
    opening = ["navigate_to_obj(Fridge); open_obj(Fridge)", scene(tmp_path, fridge)]
    code, told = asked(capsys, *opening, "--goal", "open(Fridge)=open")
    assert code == 1
    assert told["spoils"] == [
        {"step": None, "rule": "cold_let_out", "sentence": "Fridge-1 is left open", "excused": None}
    ]
    code, told = asked(capsys, *opening)
    assert code == 0 and told["spoils"][0]["excused"] == "no goal says that the plan is over here"


@pytest.mark.parametrize(
    "text",
    [
        "\n".join(STEPS),
        "# by hand\n" + "\n".join(f"{n}. {s}  # so" for n, s in enumerate(STEPS, 1)),
        json.dumps(STEPS),
        json.dumps({"plan": STEPS}),
        "; ".join(STEPS),
    ],
)
def test_a_plan_in_a_file_or_on_standard_input(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    text: str,
) -> None:
    (tmp_path / "plan.txt").write_text(text, encoding="utf-8")
    code, told = asked(capsys, str(tmp_path / "plan.txt"), scene(tmp_path), *GOAL)
    assert code == 0 and [s["subtask"] for s in told["steps"]] == STEPS
    monkeypatch.setattr("sys.stdin", io.StringIO(text))
    assert asked(capsys, "-", scene(tmp_path), *GOAL)[0] == 0


def test_what_nobody_saw_and_what_hangs_on_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    unseen = {**EMPTY, "objects": {**EMPTY["objects"], "Microwave-1": {"toggled": "off"}}}
    code, told = asked(capsys, "; ".join(STEPS), scene(tmp_path, unseen), *GOAL)
    assert (code, told["outcome"]) == (4, "not judged")
    assert told["unobserved"] == ["open(Microwave-1)=closed"]
    assert "temperature(Plate-1)=room" in told["assumed"]
    code, told = asked(capsys, "pick_up(Mug)", scene(tmp_path))
    assert code == 4 and told["unobserved"] == ["located(Mug)"]
    assert call(["plan", "check", "pick_up(Mug)", scene(tmp_path)]) == 4
    assert "it hangs on what nobody saw: located(Mug)" in capsys.readouterr().out


def test_the_last_boundary_of_a_run_and_a_task_of_another_domain(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = run_config("fasten-plate", "hole-full-of-chips", seed=3, strategy="none",
                        world="symbolic")  # fmt: skip
    folder = tmp_path / "run"
    record = run_episode(prepare(config), None, [RunRecorder(folder)])
    last = record.boundaries[-1]
    code, told = asked(capsys, str(last.subtask), str(folder))
    assert (code, told["domain"]) == (1, "bench")
    assert told["goal"] == [str(x) for x in record.task.goal.literals] and told["unmet"]
    assert told["steps"][0]["status"] == "ok"
    (first,) = [b for b in record.boundaries if b.index == 0]
    path = scene(tmp_path, first.graph.to_json())
    whole = "; ".join(record.initial_plan.texts())
    code, told = asked(capsys, whole, path, "--task", "fasten-plate")
    assert code == 1 and "full of chips" in told["refusal"]["reason"]
    lines = str(folder / "boundaries.jsonl")
    assert asked(capsys, str(last.subtask), lines, "--domain", "bench")[1]["domain"] == "bench"


def test_pictures_are_seen_in_a_domain(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    counter = Solid("CounterTop-1", (-1.0, 0.0, 0.86), (1.0, 0.6, 0.9))
    plate = at("Plate-1", 0.1, 0.3, 0.9, (0.22, 0.22, 0.02), True)
    view = observed([counter, plate], looking((0.0, -0.7, 1.65), (0.0, 0.3, 0.9)))
    write_observation(tmp_path / "seen", view, {"Plate-1": {"dirty": "clean"}})
    plan = "navigate_to_obj(Plate); pick_up(Plate)"
    assert call(["plan", "check", plan, str(tmp_path / "seen")]) == 2
    assert "give --domain or --task" in capsys.readouterr().err
    code, told = asked(capsys, plan, str(tmp_path / "seen"), "--domain", "household")
    assert (code, told["outcome"]) == (0, "runs")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["pickup(Plate)", "scene.json"], "PLAN: step 1: unknown skill 'pickup': did you mean"),
        (["pick_up(Plaet)", "scene.json"], "step 1: unknown object category 'Plaet': did you mean"),
        (["pick_up(Gizmoo-2)", "scene.json"], "unknown argument of pick_up(Gizmoo-2) 'Gizmoo-2'"),
        (["pick_up(Plate, Bowl)", "scene.json"], "step 1: pick_up takes 1 argument(s)"),
        (["absent.txt", "scene.json"], "cannot read plan absent.txt"),
        (["empty.txt", "scene.json"], "empty.txt: the plan has no step"),
        (["numbers.json", "scene.json"], "numbers.json: step 1: cannot read 3 as a subtask"),
        (["cut.json", "scene.json"], "cut.json: damaged or truncated"),
        (["pick_up(Plate)", "absent"], "absent: there is no such file or folder"),
        (["pick_up(Plate)", "empty.txt"], "empty.txt is not a folder"),
        (["pick_up(Plate)", "nothing"], "nothing holds neither observation.json"),
        (["pick_up(Plate)", "scene.json", "--goal", "insid(Plate, Bowl)"], "did you mean inside"),
        (["pick_up(Plate)", "scene.json", "--goal", "dirty(Plate)=claen"], "did you mean clean"),
        (["pick_up(Plate)", "scene.json", "--goal", "dirty(Plat)=clean"], "did you mean Plate"),
        (["pick_up(Plate)", "scene.json", "--goal", "never dirty(Plate)=dirty"], "a fact is need"),
        (["pick_up(Plate)", "scene.json", "--goal", "a(B)", "--task", "t"], "--task or --goal"),
        (["pick_up(Plate)", "scene.json", "--task", "heat-potatoe"], "did you mean heat-potato"),
        (["pick_up(Plate)", "bad.json"], "bad.json: unknown relation 'insid': did you mean inside"),
    ],
)
def test_what_is_not_valid_is_told_in_a_sentence(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    says: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    scene(tmp_path)
    scene(tmp_path, EMPTY | {"relations": ["Bowl-1 insid Microwave-1"]}, "bad.json")
    (tmp_path / "nothing").mkdir()
    (tmp_path / "empty.txt").write_text("# nothing\n")
    (tmp_path / "numbers.json").write_text("[3]")
    (tmp_path / "cut.json").write_text('["pick_up(Plate)"')
    assert call(["plan", "check", *arguments]) == 2
    out, err = capsys.readouterr()
    assert not out and says in err and len(err.splitlines()) == 1
