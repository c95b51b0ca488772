"""From a configuration to a run, its memory and its judgement of stored observations."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from assembly.plain_parts import FlatWorlds
from forestall.assembly.configuration import Given, RunConfig, run_config
from forestall.assembly.demonstrations import load_memory, memory_path, ready_made
from forestall.assembly.make import (
    make_environment,
    make_world,
    needs_memory,
    prepare,
    run_episode,
)
from forestall.assembly.recording import RecordingJob, jobs_for, record_one
from forestall.cli.main import call
from forestall.config import DEMONSTRATION_SEEDS
from forestall.domain.load import shipped
from forestall.errors import InputError, MemoryFileError
from forestall.kinds import WORLD
from forestall.tasks.edge import WorldsEdge
from forestall.types.demonstration import Demonstration

PLAIN = Given.named(
    {
        "world": "assembly.plain_parts:FlatWorlds",
        "perceiver": "assembly.plain_parts:TruthPerceiver",
    }
)


def plain(task: str, scenario: str | None = None, **named: Any) -> RunConfig:
    return run_config(task, scenario, given=PLAIN, **named)


@pytest.mark.parametrize(
    ("named", "says"),
    [
        ({"states": "given"}, "states of a run 'given'.*learned"),
        ({"seed": -1}, "seed -1"),
        ({"seed": DEMONSTRATION_SEEDS}, "are demonstrations"),
        ({"seed": 2_000_000, "strategy": "none"}, "are pictures"),
        ({"scenario": "mug-dropped"}, "is for the task make-coffee"),
    ],
)
def test_what_does_not_fit_is_said_before_anything_is_built(
    named: dict[str, object], says: str
) -> None:
    with pytest.raises(InputError, match=says):
        prepare(run_config("heat-potato", **named))  # type: ignore[arg-type]


def test_a_run_in_somebody_elses_world_with_somebody_elses_eyes() -> None:
    config = plain("heat-potato", strategy="none", seed=3)
    assert not needs_memory(config)
    prepared = prepare(config)
    world = make_world(config, shipped("household"))
    assert isinstance(world, FlatWorlds)
    record = run_episode(prepared, None, world=world)
    assert record.success
    assert world.opened == [True]  # one that is handed over may remember
    told = dict(record.provenance)
    assert told["config"]["parts"]["world"]["defaulted"] == {"gravity": 9.81}
    assert told["perception"]["state_estimator"] == "truth"


def test_a_failing_run_is_repaired_with_the_ready_made_memory() -> None:
    config = plain("heat-potato", "microwave-occupied", seed=3)
    path = ready_made(config, workers=1)
    assert ready_made(config) == path
    demonstrations, used = load_memory(config)
    assert (len(demonstrations), used) == (4, str(path))
    record = run_episode(prepare(config), demonstrations, memory=used)
    assert record.success
    assert dict(record.provenance)["memory"] == str(path)
    unmonitored = plain("heat-potato", "microwave-occupied", seed=3, strategy="none")
    assert run_episode(prepare(unmonitored), None).success is False


def test_a_ready_made_memory_is_of_the_parts_that_it_is_recorded_with(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    import forestall.assembly.recording as module

    made = record_one(RecordingJob("toast-bread", DEMONSTRATION_SEEDS, PLAIN))
    recorded: list[RecordingJob] = []

    def record(job: RecordingJob) -> Demonstration:
        recorded.append(job)
        return made

    def ready(**named: Any) -> Path:
        return ready_made(plain("toast-bread", **named), workers=1)

    monkeypatch.setattr(module, "record_one", record)
    one = ready()
    assert ready(detector="image", strategy="online") == one
    assert len(recorded) == 4
    assert ready(image_encoder="clip") != one
    assert ready(**{"world.gravity": 1.6}) != one
    assert recorded[-1].config(1).choice(WORLD).options == {"gravity": 1.6}


def test_a_memory_that_is_given_is_the_one_that_is_used(tmp_path: Path) -> None:
    config = plain("toast-bread", memory=tmp_path / "absent.db")
    assert memory_path(config) == str(tmp_path / "absent.db")
    with pytest.raises(MemoryFileError, match=r"absent\.db"):
        load_memory(config)


def test_every_job_has_seeds_of_its_own() -> None:
    jobs = jobs_for(["toast-bread", "heat-potato"], 3)
    seeds = [set(range(j.first_seed, j.first_seed + j.tries)) for j in jobs[:3]]
    assert not seeds[0] & seeds[1] and not seeds[1] & seeds[2]


def test_the_command_runs_in_any_world(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    parts = ["--world", "assembly.plain_parts:FlatWorlds", "--world.gravity", "1.6"]
    parts += ["--perceiver.name=assembly.plain_parts:TruthPerceiver", "--strategy", "none"]
    out = ["--out", str(tmp_path), "--json", "--quiet"]
    assert call(["run", "heat-potato", *parts, *out]) == 0
    config = json.loads(capsys.readouterr().out)["provenance"]["config"]
    assert config["parts"]["world"]["given"] == {"gravity": 1.6}
    assert call(["run", "heat-potato", "--world", "kitchn"]) == 2
    assert "known: ai2thor, frankakitchen, kitchen" in capsys.readouterr().err
    assert call(["run", "heat-potato", *parts[:2], "--renderer", "rays"]) == 2
    assert "'renderer': known: gravity" in capsys.readouterr().err


def test_parts_are_listed_with_their_options(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["parts"]) == 0
    assert "detector: scene-graph (default)" in capsys.readouterr().out
    assert call(["parts", "detector"]) == 0
    assert "--detector.threshold 0.9" in capsys.readouterr().out
    assert call(["parts", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["world"]["kitchen"]["renderer"] == "auto"
    assert call(["parts", "detectors"]) == 2
    assert "did you mean detector" in capsys.readouterr().err


def test_a_segmenter_without_names_of_the_worlds_speaks_to_it_through_an_edge() -> None:
    shades = {"name": "vision.shades:Shades", "words": "mug"}
    config = run_config(
        "heat-potato", segmenter="finder", finder=shades, world="symbolic", states="oracle"
    )
    prepared = prepare(config)
    loaded = prepared.loaded
    with make_world(prepared.config, loaded.domain).open(loaded.task.scene, loaded.domain) as world:
        assert isinstance(make_environment(prepared, world), WorldsEdge)
