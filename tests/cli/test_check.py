"""`forestall check`: scenes of the user's own, alone and in a sequence, judged by a monitor."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from forestall.assembly.checking import Question, judge_stored
from forestall.assembly.configuration import Given, run_config
from forestall.assembly.make import prepare, run_episode
from forestall.assembly.recording import RecordingJob, record_one
from forestall.assembly.sources import demonstrations_from
from forestall.cli.main import call
from forestall.config import DEMONSTRATION_SEEDS
from forestall.domain.load import shipped
from forestall.memory.store import open_store
from forestall.perception.folder import write_observation
from forestall.perception.given import GivenStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import InstanceSegmenter
from forestall.types.decision import Outcome
from forestall.types.demonstration import Demonstration, DemonstrationStep
from forestall.types.observation import Observation
from forestall.types.plan import Subtask
from perception.synthetic import Solid, at, looking, observed
from stranger import INSERT, TWELVE
from stranger import scene as pegs

POSE = looking((0.0, -0.7, 1.65), (0.0, 0.3, 0.9))
COUNTER = Solid("CounterTop-1", (-1.0, 0.0, 0.86), (1.0, 0.6, 0.9))
PLATE = at("Plate-1", 0.1, 0.3, 0.9, (0.22, 0.22, 0.02), True)
POTATO = at("Potato-1", 0.1, 0.3, 0.92, (0.1, 0.07, 0.065))
MUG = at("Mug-1", -0.4, 0.3, 0.9, (0.08, 0.08, 0.1), True)
STEPS = ("pick_up(Plate-1)", "put_on(Plate-1, CounterTop-1)")
STEP, LATER = "pick_up(Plate)", "put_on(Plate, CounterTop)"
STATES = {"Plate-1": {"dirty": "clean"}, "Mug-1": {"dirty": "clean"}}


HELD = at("Plate-1", 0.5, 0.1, 1.1, (0.22, 0.22, 0.02), True)


def seen(*things: Solid, time_s: float = 0.0) -> Observation:
    holding = "Plate-1" if HELD in things else None
    return observed([COUNTER, *things], POSE, holding=holding, hand=(0.5, 0.1, 1.15), time_s=time_s)


def written(folder: Path, *things: Solid, time_s: float = 0.0, **states: dict[str, str]) -> Path:
    said = {**STATES, **{name.replace("_", "-"): value for name, value in states.items()}}
    write_observation(folder, seen(*things, time_s=time_s), said)
    return folder


@pytest.fixture(scope="module")
def memory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two demonstrations: a clean plate and a mug on the counter, taken and put back."""
    path = tmp_path_factory.mktemp("memory") / "own.db"
    domain = shipped("household")
    with open_store(path, create=True) as store:
        for number in range(2):
            perceiver = GraphPerceiver(InstanceSegmenter(), GivenStateEstimator(STATES), domain)
            mug = MUG.moved((0.05 * number, 0.0, 0.0))
            kept = []
            for index, plate in enumerate((PLATE, HELD)):
                step = Subtask.parse(STEPS[index])
                whole = perceiver.perceive(seen(plate, mug))
                kept.append(DemonstrationStep(index, step, perceiver.scope(whole, step), whole))
            store.add(Demonstration("clear-up", f"own-{number}", number, tuple(kept)))
    return path


def checked(
    capsys: pytest.CaptureFixture[str], scenes: Sequence[Path], *more: str
) -> tuple[int, dict[str, Any]]:
    code = call(["check", *map(str, scenes), *more, "--json"])
    out, err = capsys.readouterr()
    assert out, err
    return code, json.loads(out)


def test_one_folder_of_pictures(
    memory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["--subtask", STEP, "--memory", str(memory)]
    scenes = {
        "fine": written(tmp_path / "fine", PLATE, MUG),
        "full": written(tmp_path / "full", PLATE, MUG, POTATO),
        "dirty": written(tmp_path / "dirty", PLATE, MUG, Plate_1={"dirty": "dirty"}),
        "gone": written(tmp_path / "gone", MUG),
        "empty": written(tmp_path / "empty"),
    }
    told = {name: checked(capsys, [path], *asked) for name, path in scenes.items()}
    assert {name: (code, data["outcome"]) for name, (code, data) in told.items()} == {
        "fine": (0, "proceed"),
        "full": (1, "replan"),
        "dirty": (1, "hold"),
        "gone": (4, "look"),
        "empty": (4, "look"),
    }
    (full,) = told["full"][1]["scenes"]
    assert full["cause"].startswith("Potato-1 is on top of Plate-1")
    assert full["replan"]["plan"][-1] == "pick_up(Plate-1)"
    assert "pick_up(Potato-1)" in full["replan"]["plan"]
    assert told["dirty"][1]["scenes"][0]["hold"] == "alarm without an answer"


def test_what_was_not_seen_never_proceeds_whatever_the_score_is(
    memory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    gone = written(tmp_path / "gone", MUG)
    asked = ["--subtask", STEP, "--memory", str(memory)]
    score = ["--detector", "scene-graph", "--threshold", "0.1"]
    code, told = checked(capsys, [gone], *asked, *score)
    assert (code, told["outcome"]) == (4, "look")
    assert told["scenes"][0]["verdict"]["decision"] == "proceed"
    assert told["scenes"][0]["why"] == "not located: Plate"
    code, told = checked(capsys, [gone], "--subtask", "open_obj(Fridge)", "--memory", str(memory))
    assert code == 4 and told["scenes"][0]["verdict"]["score"] is None


def test_a_state_that_nobody_read_is_not_taken_for_good(
    memory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_observation(tmp_path / "unread", seen(PLATE, MUG), {"Mug-1": {"dirty": "clean"}})
    asked = ["--subtask", STEP, "--memory", str(memory)]
    code, told = checked(capsys, [tmp_path / "unread"], *asked)
    assert (code, told["outcome"]) == (4, "not judged")
    assert "dirty(Plate-1)" in told["scenes"][0]["why"]


def test_a_sequence_is_judged_before_the_subtasks_of_a_plan(
    memory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    written(tmp_path / "run" / "step-02", HELD, MUG, time_s=14.0)
    written(tmp_path / "run" / "step-3", PLATE, MUG, POTATO, time_s=15.0)
    written(tmp_path / "run" / "step-1", PLATE, MUG, time_s=4.0)
    (tmp_path / "run" / "notes.txt").write_text("not a scene")
    plan = tmp_path / "plan.txt"
    plan.write_text(f"# clearing up\n{STEP}; {LATER}  # and again\n\n{STEP}\n")
    page = tmp_path / "out" / "page.html"
    asked = ["--plan", str(plan), "--memory", str(memory)]
    code, told = checked(capsys, [tmp_path / "run"], *asked, "--page", str(page))
    assert code == 1 and told["outcome"] == "replan"
    assert [(Path(s["scene"]).name, s["subtask"], s["outcome"]) for s in told["scenes"]] == [
        ("step-1", "pick_up(Plate-1)", "proceed"),
        ("step-02", "put_on(Plate-1, CounterTop-1)", "proceed"),
        ("step-3", "pick_up(Plate-1)", "replan"),
    ]
    text = page.read_text(encoding="utf-8")
    assert told["page"] == str(page) and "data:image/" in text
    assert "alarm, replanned" in text and "put_on" in text and "stored observations" in text
    assert "a corrected plan is proposed; 3 stored scenes judged, and nothing was" in text
    assert "took the place" not in text and "breaks off" not in text
    scenes = [str(tmp_path / "run" / name) for name in ("step-3", "step-02")]
    assert call(["check", *scenes, *asked]) == 1
    out = capsys.readouterr().out
    assert "step-3: replan: before pick_up(Plate-1)" in out
    assert "corrected plan, checked on what is seen:\n    1. navigate_to_obj(Potato-1)" in out
    assert "2 scenes: " in out


def test_before_the_same_subtask_numbers_may_have_gaps(
    memory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    written(tmp_path / "run" / "07", PLATE, MUG, time_s=4.0)
    written(tmp_path / "run" / "020", PLATE, MUG, time_s=14.0)
    (tmp_path / "run" / "7.png").write_text("a picture of scene 7")
    (tmp_path / "run" / "take.mp4").write_text("no scene, and no number of one")
    asked = ["--subtask", STEP, "--memory", str(memory)]
    code, told = checked(capsys, [tmp_path / "run"], *asked)
    assert (code, [Path(s["scene"]).name for s in told["scenes"]]) == (0, ["07", "020"])


def test_every_scene_may_be_judged_before_the_same_subtask(memory: Path, tmp_path: Path) -> None:
    full = [written(tmp_path / f"full-{k}", PLATE, MUG, POTATO) for k in range(4)]
    scenes = [written(tmp_path / "a", PLATE, MUG), *full, written(tmp_path / "b", PLATE, MUG)]
    with open_store(memory) as store:
        found = judge_stored(scenes, Question(STEP, f"{STEP}; {LATER}"), store.required())
    outcomes = [j.decision.outcome for j in found.each]
    assert outcomes == [Outcome.PROCEED, *[Outcome.REPLAN] * 4, Outcome.PROCEED]
    last = [j.decision.plan.texts()[-1] for j in found.each if j.decision.plan is not None]
    assert last == ["put_on(Plate-1, CounterTop)"] * 4
    assert [b.observation for b in found.record.boundaries] == [None] * 6
    assert found.record.executed == ()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "nothing to judge"),
        (["fine"], "say before what: --subtask STEP, --plan"),
        (["fine", "--subtask", "pickup(Plate)"], "unknown skill 'pickup': did you mean pick_up"),
        (["fine", "--subtask", "pick_up(Plaet)"], "did you mean Plate"),
        (["fine", "--subtask", STEP, "--plan", "pick_up(Mug)"], "unknown step of the plan"),
        (["fine", "fine", "--plan", STEP], "2 scenes for the 1 subtasks of the plan"),
        (["fine", "--plan", "pick_up(Plate); pickup(Mug)"], "--plan: step 2: unknown skill"),
        (["fine", "--plan", "absent.txt"], "cannot read plan absent.txt"),
        (["fine", "--plan", "empty.txt"], "empty.txt: the plan has no step"),
        (["absent", "--subtask", STEP], "absent is not a folder"),
        (["absent.json", "--subtask", STEP], "cannot read scene graph absent.json"),
        (["nothing", "--subtask", STEP], "nothing holds no observation.json, and no observation"),
        (["twice", "--subtask", STEP], "graph-1.json has the same number as 01"),
        (["half", "--subtask", STEP], "half/02 has a number and is no scene: a folder with obs"),
        (["half", "--plan", f"{STEP}; {LATER}"], "half/02 has a number and is no scene"),
        (["loud", "--subtask", STEP], "loud/2.JSON has a number and is no scene"),
        (["gap", "--plan", f"{STEP}; {LATER}"], "gap has no scene with the number 2: those"),
        (["late", "--plan", f"{STEP}; {LATER}"], "late has no scene with the number 1: those"),
        (["unnumbered", "--subtask", STEP], "a number in its name must say when it comes"),
        (["graph.json", "--subtask", STEP], "graph.json: unknown relation 'insid': did you mean"),
        (["within.json", "--subtask", STEP], "Mug-1, Plate-1: a thing cannot be in or on itself"),
        (["fine", "--subtask", STEP, "--domain", "bench"], "unknown skill 'pick_up'"),
        (["fine", "--subtask", STEP, "--states", "oracle"], "states of a stored observation"),
    ],
)
def test_what_is_not_valid_is_told_in_a_sentence(
    memory: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    says: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("fine", "twice/01", "unnumbered/first", "half/01", "half/03", "loud/1"):
        written(tmp_path / name, PLATE, MUG)
    (tmp_path / "half" / "02").mkdir()
    for name in ("loud/2.JSON", "gap/1.json", "gap/3.json", "late/2.json"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(json.dumps(GRAPH))
    (tmp_path / "nothing").mkdir()
    graph = GRAPH | {"relations": [["Mug-1", "insid", "Plate-1"]]}
    for name in ("graph.json", "twice/graph-1.json"):
        (tmp_path / name).write_text(json.dumps(graph))
    ring = [["Mug-1", "inside", "Plate-1"], ["Plate-1", "on_top_of", "Mug-1"]]
    (tmp_path / "within.json").write_text(json.dumps(GRAPH | {"relations": ring}))
    (tmp_path / "empty.txt").write_text("# nothing\n")
    assert call(["check", *arguments, "--memory", str(memory)]) == 2
    out, err = capsys.readouterr()
    assert not out and says in err and len(err.splitlines()) == 1


GRAPH: dict[str, object] = {"objects": {"Mug-1": {"dirty": "clean"}, "Plate-1": {}}}


# --- scene graphs -------------------------------------------------------------------------------

SYMBOLIC = Given.named({"world": "symbolic", "perceiver": "given-graph"})


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Graphs before every subtask of a run into a hole full of chips, and a memory beside them."""
    folder = tmp_path_factory.mktemp("bench")
    with open_store(folder / "bench.db", create=True) as store:
        for k in range(3):
            job = RecordingJob("fasten-plate", DEMONSTRATION_SEEDS + 10 * k, SYMBOLIC)
            store.add(record_one(job))
    config = run_config("fasten-plate", "hole-full-of-chips", seed=3, strategy="none")
    record = run_episode(prepare(config), None)
    (folder / "graphs").mkdir()
    for b in record.boundaries[:3]:
        path = folder / "graphs" / f"{b.index + 1:02d}-{b.subtask.skill}.json"
        path.write_text(json.dumps(b.graph.to_json()))
    return folder


PLAN = "move_to(Bolt); pick(Bolt); insert(Bolt, BoltHole)"


@pytest.mark.parametrize(
    "asked", [["--plan", PLAN, "--domain", "bench"], ["--task", "fasten-plate"]]
)
def test_graphs_of_another_domain_are_judged_along_a_plan(
    bench: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], asked: list[str]
) -> None:
    page = tmp_path / "page.html"
    more = ["--memory", str(bench / "bench.db"), "--page", str(page)]
    code, told = checked(capsys, [bench / "graphs"], *asked, *more)
    assert (code, told["domain"]) == (1, "bench")
    assert all("dirty" in s["cause"] for s in told["scenes"]), "what is needed later is seen early"
    more += ["--detector", "scene-graph"]
    code, told = checked(capsys, [bench / "graphs"], *asked, *more)
    *fine, last = told["scenes"]
    assert [s["outcome"] for s in fine] == ["proceed", "proceed"]
    assert last["outcome"] == "replan" and "dirty" in last["cause"]
    steps = last["replan"]["plan"]
    assert any(s.startswith("insert(Bolt") for s in steps) and len(steps) > 1
    assert any(s.startswith("screw") for s in steps) == ("--task" in asked)
    assert "insert" in page.read_text(encoding="utf-8")


def test_one_graph_of_a_step_in_the_middle(bench: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (graph,) = (bench / "graphs").glob("03-*.json")
    asked = ["--task", "fasten-plate", "--memory", str(bench / "bench.db")]
    code, told = checked(capsys, [graph], "--subtask", "insert(Bolt, BoltHole)", *asked)
    assert code == 1 and told["plan"][0] == "insert(Bolt, BoltHole)"
    code, told = checked(capsys, [graph], "--subtask", "screw(Nut, Bolt)", *asked)
    assert code in (1, 4)
    code, told = checked(capsys, [graph], "--subtask", "insert(Bolt, BoltHole)", *asked,
                         "--strategy.name", "none")  # fmt: skip
    assert (code, told["outcome"]) == (4, "not judged")
    assert "the strategy none does not judge here" in told["scenes"][0]["why"]


def test_the_plan_alone_may_be_checked_without_any_demonstration(
    bench: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (graph,) = (bench / "graphs").glob("03-*.json")
    asked = ["--plan", PLAN, "--subtask", "insert(Bolt, BoltHole)", "--domain", "bench"]
    code, told = checked(capsys, [graph], *asked, "--strategy.name", "plan-check")
    assert code == 1 and told["memory"] is None
    assert "full of chips" in told["scenes"][0]["cause"]
    assert call(["check", str(graph), *asked]) == 2
    assert "give --memory FILE" in capsys.readouterr().err


def test_without_a_domain_it_is_that_of_the_memory(
    bench: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (graph,) = (bench / "graphs").glob("03-*.json")
    asked = ["--subtask", "insert(Bolt, BoltHole)", "--memory", str(bench / "bench.db")]
    code, told = checked(capsys, [graph], *asked)
    assert (code, told["domain"], told["limits"]) == (1, "bench", [])
    memory = tmp_path / "pegs.db"
    with open_store(memory, create=True) as store:
        for d in demonstrations_from(TWELVE):
            store.add(d)
    scenes = {"fine": pegs("hand"), "dirty": pegs("hand", hole="dirty"), "free": pegs()}
    for name, data in scenes.items():
        (tmp_path / f"{name}.json").write_text(json.dumps(data))
    asked = ["--subtask", INSERT, "--memory", str(memory), "--detector.name", "preconditions"]
    found = {n: checked(capsys, [tmp_path / f"{n}.json"], *asked) for n in scenes}
    assert [code for code, _ in found.values()] == [0, 1, 1]
    assert found["fine"][1]["domain"] == "learnt" and found["fine"][1]["limits"]
    assert found["free"][1]["scenes"][0]["replan"]["plan"] == ["grasp(peg-1)", INSERT]
    for meant in ("peg-1", "hole-1"):
        slip = INSERT.replace(meant, {"peg-1": "pge-1", "hole-1": "hole-9"}[meant])
        code, told = checked(capsys, [tmp_path / "fine.json"], *asked[2:], "--subtask", slip)
        assert code == 4 and f"did you mean {meant} by" in told["scenes"][0]["why"]


def test_a_missing_memory_of_a_task_says_how_to_record_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.json").write_text(json.dumps(pegs()))
    asked = ["check", "scene.json", "--subtask", INSERT, "--memory", "absent.db"]
    assert call(asked) == 3
    err = capsys.readouterr().err
    assert "make one with 'forestall demos add'" in err and "record" not in err
    assert call([*asked, "--task", "fasten-plate"]) == 3
    assert "'forestall demos record absent.db --task fasten-plate'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("objects", "says"),
    [
        ({"Mug-1": "held_by gripper"}, 'write ["Mug-1", "held_by", "gripper"] among the relations'),
        ({"Mug-1": "on top of Plate-1"}, 'write ["Mug-1", "on_top_of", "Plate-1"] among the'),
        ({"Mug-1": "dirty=clean"}, "stands in the place of its category and is a state"),
        ({"Mug-1": {"held_by": "gripper"}}, 'write ["Mug-1", "held_by", "gripper"] among the'),
        ({"Mug-1": "clean"}, 'which is a state: write "Mug-1": {"dirty": "clean"}'),
        ({"Mug-1": "inside"}, "of the category 'inside', which is a relation: write"),
    ],
)
def test_a_state_or_a_relation_does_not_become_a_category(
    memory: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    objects: dict[str, object],
    says: str,
) -> None:
    path = tmp_path / "scene.json"
    path.write_text(json.dumps({"objects": {"Plate-1": {}, **objects}}))
    assert call(["check", str(path), "--subtask", STEP, "--memory", str(memory)]) == 2
    assert says in capsys.readouterr().err


# --- what was understood ------------------------------------------------------------------------


def test_what_was_understood_is_drawn_also_of_what_is_refused(
    memory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fine, broken = written(tmp_path / "01", PLATE, MUG), written(tmp_path / "02", PLATE, MUG)
    document = json.loads((broken / "observation.json").read_text())
    for row in document["frames"][0]["camera_to_world"][:3]:
        row[1], row[2] = -row[1], -row[2]
    (broken / "observation.json").write_text(json.dumps(document))
    picture = tmp_path / "seen.png"
    asked = ["--subtask", STEP, "--memory", str(memory), "--explain", str(picture)]
    assert call(["check", str(fine), *asked]) == 0
    assert picture.stat().st_size > 1000
    picture.unlink()
    assert call(["check", str(tmp_path), *asked]) == 2
    assert "camera_axes" in capsys.readouterr().err
    assert {p.name for p in tmp_path.glob("*.png")} == {"seen-1.png", "seen-2.png"}


def test_arguments_and_things_are_in_the_users_words(memory: Path, tmp_path: Path) -> None:
    folder = written(tmp_path / "fine", PLATE, MUG)
    document = json.loads((folder / "observation.json").read_text())
    for detection in document["frames"][0]["detections"]:
        if detection["category"] == "Plate":
            detection.update(category="dinner plate", instance="029_plate")
    (folder / "observation.json").write_text(json.dumps(document))
    asked = ["check", str(folder), "--memory", str(memory)]
    assert call([*asked, "--subtask", "pick_up(dinner plate)"]) == 0
    assert call([*asked, "--subtask", "pick_up(potted meat can)"]) == 4


def test_what_only_a_task_asks_is_judged_by_the_only_one_there_is_and_else_named(
    memory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dirty = written(tmp_path / "dirty", PLATE, MUG, Plate_1={"dirty": "dirty"})
    asked = ["--subtask", STEP, "--memory", str(memory)]
    code, told = checked(capsys, [dirty], *asked)
    assert (code, told["outcome"], told["task"]) == (1, "hold", "clear-up")
    assert call(["check", str(dirty), *asked]) == 1
    assert "judged as the task clear-up, the only one of" in capsys.readouterr().err
    two = tmp_path / "two.db"
    with open_store(memory) as store, open_store(two, create=True) as other:
        for d in store.all():
            other.add(d)
            other.add(replace(d, task="lay-table", id=f"{d.id}-again"))
    asked = ["--subtask", STEP, "--memory", str(two)]
    code, told = checked(capsys, [dirty], *asked)
    assert (code, told["outcome"], told["task"]) == (0, "proceed", None)
    unjudged = (
        "not judged, because it depends on the task and no task is named (--task): "
        "dirty(Plate-1)=clean, as in clear-up and lay-table"
    )
    assert told["scenes"][0]["why"] == unjudged
    code, told = checked(capsys, [dirty], *asked, "--detector", "scene-graph")
    assert code == 1 and told["scenes"][0]["cause"].startswith(
        "nothing is violated that the demonstrations show to matter before pick_up; " + unjudged
    )
    fine = written(tmp_path / "fine", PLATE, MUG)
    code, told = checked(capsys, [fine], *asked)
    assert (code, told["scenes"][0]["why"]) == (0, "")


def test_the_scenes_of_a_demonstration_fit_it_whatever_stands_on_what(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Later needs are held against the whole scene: what they are mined from must show the same."""
    memory = tmp_path / "pegs.db"
    free, held, seated = (
        pegs(peg, more=["bench-1"], relations=["hole-1 stands_on bench-1"])
        for peg in ("tray", "hand", "hole")
    )
    run = [("grasp(peg-1)", free), (INSERT, held), seated]
    with open_store(memory, create=True) as store:
        for d in demonstrations_from([run] * 4):
            store.add(d)
    for number, scene in enumerate((free, held), 1):
        (tmp_path / f"{number}.json").write_text(json.dumps(scene))
    scenes = [tmp_path / "1.json", tmp_path / "2.json"]
    plan = ["--plan", f"grasp(peg-1); {INSERT}", "--memory", str(memory)]
    code, told = checked(capsys, scenes, *plan)
    assert (code, [s["outcome"] for s in told["scenes"]]) == (0, ["proceed", "proceed"])
    assert call(["check", str(scenes[0]), *plan, "--explain", str(tmp_path / "x.png")]) == 2
    assert "a scene graph has no picture" in capsys.readouterr().err
