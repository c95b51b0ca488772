"""The real thing: pictures of the embedded kitchen, perception, memory, the command line.

One memory is recorded once and shared by the workers of a test run. FORESTALL_SCENARIOS=all plays
all examples, of six tasks; four of them by default.
"""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from forestall.cli.main import call
from forestall.memory.store import open_store
from forestall.perception.folder import write_observation
from forestall.records.codec import record_to_json
from forestall.records.derived import reasoning_s
from forestall.records.record import read_record
from forestall.tasks.faults import apply_scene_faults
from forestall.tasks.files import load_scenario, load_task, scenario_names
from forestall.types.episode import EpisodeEnd
from forestall.worlds.kitchen.environment import KitchenEnvironment

pytestmark = pytest.mark.slow

FEW = ("knife-blocked", "microwave-left-closed", "microwave-occupied", "plate-dirty")
"""Of four kinds: something is in front, a step is missing, something is in the way, a state."""
SCENARIOS = FEW if os.environ.get("FORESTALL_SCENARIOS") != "all" else scenario_names("examples")


def memory_of(task: str, factory: pytest.TempPathFactory) -> Path:
    """Two demonstrations of a task, recorded once by the command; workers share them."""
    shared = factory.getbasetemp()
    if os.environ.get("PYTEST_XDIST_WORKER"):
        shared = shared.parent
    path, lock = shared / f"{task}.db", shared / f"{task}.lock"
    try:
        lock.touch(exist_ok=False)
    except FileExistsError:
        deadline = time.monotonic() + 900
        while not path.exists() and time.monotonic() < deadline:
            time.sleep(0.5)
        return path
    partial = shared / f"recording-{task}.db"
    arguments = ["demos", "record", str(partial), "--task", task, "--kitchens", "2"]
    assert call([*arguments, "--jobs", "1", "--quiet"]) == 0
    partial.rename(path)
    return path


@pytest.fixture
def memory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Demonstrations of heat-potato."""
    return memory_of("heat-potato", tmp_path_factory)


def run_json(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, dict[str, Any]]:
    """Run the command and read its record."""
    capsys.readouterr()
    code = call(["run", *arguments, "--json", "--quiet"])
    return code, json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(
    "scenario",
    [pytest.param(s, marks=pytest.mark.xdist_group(load_scenario(s).task)) for s in SCENARIOS],
)
def test_a_scenario_from_pixels(
    scenario: str,
    tmp_path: Path,
    tmp_path_factory: pytest.TempPathFactory,
    capsys: pytest.CaptureFixture[str],
) -> None:
    task = load_scenario(scenario).task
    memory = memory_of(task, tmp_path_factory)
    options = ["--scenario", scenario, "--seed", "15", "--memory", str(memory)]
    code, data = run_json(capsys, task, *options, "--out", str(tmp_path / "proactive"))
    assert (code, data["success"]) == (0, True), data["failures"]
    assert any(a["must_change"] for a in data["alarms"])


@pytest.mark.xdist_group("heat-potato")
def test_the_main_job(memory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["run", "heat-potato", "--scenario", "microwave-occupied", "--seed", "11"]
    options = ["--memory", str(memory), "--out", str(tmp_path / "run"), "--json", "--quiet"]
    assert call([*arguments, *options]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["success"] is True
    assert data["perception"]["state_estimator"] == "learned states (forestall two-tower 1)"
    assert data["replans"] >= 1
    alarm = next(a for a in data["alarms"] if a["must_change"])
    assert "Bowl-1" in alarm["cause"]
    assert alarm["subtask"] == "put_in(Plate-1, Microwave-1)"
    assert alarm["score"] < alarm["threshold"]
    executed = [e["subtask"] for e in data["executed"]]
    assert executed.index("pick_up(Bowl-1)") < executed.index("put_in(Plate-1, Microwave-1)")
    assert all(e["status"] == "succeeded" for e in data["executed"])
    assert {"observe", "perceive", "compare", "replan"} <= set(data["compute_s"])
    page = Path(data["page"]).read_text(encoding="utf-8")
    assert "Bowl-1" in page and "<svg" in page and "data:image/" in page
    whole = read_record(tmp_path / "run")
    assert whole.success is True and record_to_json(whole, page=data["page"]) == data
    killed = read_record(tmp_path / "run" / "boundaries.jsonl")
    assert killed.boundaries == whole.boundaries
    assert killed.compute_s == whole.boundaries[-1].compute_s
    assert reasoning_s(killed.compute_s) > 0.9 * data["reasoning_s"]
    assert call(["page", str(tmp_path / "run"), "--out", str(tmp_path / "again.html")]) == 0
    again = (tmp_path / "again.html").read_text(encoding="utf-8")
    assert again.count("data:image/") == page.count("data:image/")
    assert call(["demos", "add", str(tmp_path / "no.db"), str(tmp_path / "run")]) == 2


def test_without_replanning_the_same_scene_fails(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["run", "heat-potato", "--scenario", "microwave-occupied", "--seed", "11"]
    options = ["--strategy", "none", "--out", str(tmp_path), "--json", "--quiet"]
    assert call([*arguments, *options]) == 1
    data = json.loads(capsys.readouterr().out)
    assert data["success"] is False and data["failures"] and data["replans"] == 0


@pytest.mark.xdist_group("heat-potato")
def test_an_undisturbed_run_is_left_alone(
    memory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["run", "heat-potato", "--seed", "12", "--memory", str(memory)]
    assert call([*arguments, "--out", str(tmp_path), "--json", "--quiet"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["success"] is True
    assert data["executed"][-1]["subtask"] == "toggle_on(Microwave-1)"
    own = tmp_path / "own.db"
    assert call(["demos", "add", str(own), str(tmp_path)]) == 0
    with open_store(own) as store:
        (demonstration,) = store.required()
    assert [str(s.subtask) for s in demonstration.steps] == [
        b["subtask"] for b in data["boundaries"]
    ]


@pytest.mark.xdist_group("heat-potato")
def test_a_killed_run_leaves_memory_and_record_readable(memory: Path, tmp_path: Path) -> None:
    before = open_store(memory).digest()
    command = [sys.executable, "-m", "forestall", "run", "heat-potato", "--seed", "13"]
    options = ["--memory", str(memory), "--out", str(tmp_path / "run"), "--quiet"]
    process = subprocess.Popen([*command, *options], stdout=subprocess.DEVNULL)
    lines = tmp_path / "run" / "boundaries.jsonl"
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline:
        if lines.exists() and lines.read_text().count("\n") >= 3:
            break
        time.sleep(0.2)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert open_store(memory).digest() == before
    record = read_record(lines)
    assert record.end is EpisodeEnd.UNFINISHED
    assert len(record.boundaries) >= 1
    assert call(["page", str(tmp_path / "run")]) == 0
    page = (tmp_path / "run" / "index.html").read_text(encoding="utf-8")
    assert "unfinished" in page and "data:image/" in page


@pytest.mark.xdist_group("heat-potato")
def test_a_stored_observation_is_judged(
    memory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    loaded = load_task("heat-potato")
    for name, faults in (("fine", ()), ("full", load_scenario("microwave-occupied").faults)):
        needs = apply_scene_faults(loaded.task.scene, faults, loaded.domain)
        kitchen = KitchenEnvironment(needs, loaded.domain)
        kitchen.reset(14)
        for subtask in loaded.task.plan.subtasks[:8]:
            kitchen.execute(subtask)
        node = kitchen.oracle.truth().get("Microwave-1")
        assert node is not None and node.centroid_m is not None
        observation = kitchen.observe([node.centroid_m])
        states = {n.id: kitchen.oracle.states(n.id) for n in kitchen.oracle.truth().nodes}
        write_observation(tmp_path / name, observation, states)
    options = ["--subtask", "put_in(Plate, Microwave)", "--task", "heat-potato"]
    codes = {}
    for name in ("fine", "full"):
        arguments = ["check", str(tmp_path / name), *options, "--memory", str(memory), "--json"]
        codes[name] = call(arguments)
        data = json.loads(capsys.readouterr().out)
    assert codes == {"fine": 0, "full": 1}
    assert data["outcome"] == "replan" and "Bowl-1" in data["scenes"][0]["cause"]
    assert "put_in(Plate-1, Microwave-1)" in data["scenes"][0]["replan"]["plan"]
    assert call(["check", str(tmp_path / "absent"), *options, "--memory", str(memory)]) == 2
    assert "absent" in capsys.readouterr().err
    assert call(["check", str(tmp_path / "fine"), "--subtask", "put_in(Plate, Microwave)"]) == 2
    assert "--memory" in capsys.readouterr().err
