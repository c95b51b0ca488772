"""What is said about parts: flags over files over defaults, checked, and kept for the record."""

from __future__ import annotations

import json
import pickle
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

from forestall.assembly.configuration import Given, read_file, run_config
from forestall.assembly.make import make_strategy, prepare, provenance, run_episode
from forestall.assembly.parts import Assembly
from forestall.cli.flags import RunFlags, spelt
from forestall.domain.load import shipped
from forestall.errors import FileFormatError, InputError, UnknownNameError
from forestall.kinds import (
    DETECTOR,
    DOMAIN,
    PERCEIVER,
    REASONER,
    REPLANNER,
    STORE,
    TEXT_ENCODER,
    WORLD,
)

FILE = """
seed = 7
scenario = "microwave-occupied"

[detector]
name = "scene-graph"
threshold = 0.85
located_share = 0.4

[text-encoder]
dimensions = 64
"""


def written(folder: Path, text: str = FILE) -> Path:
    path = folder / "run.toml"
    path.write_text(text)
    return path


def test_flags_come_over_the_file_and_the_file_over_defaults(tmp_path: Path) -> None:
    flags = RunFlags(threshold=0.8, config=written(tmp_path))
    given, of_run = flags.read()
    assert of_run == {"seed": 7, "scenario": "microwave-occupied"}
    detector = run_config("heat-potato", given=given, **of_run).choice(DETECTOR)
    assert dict(detector.given) == {"threshold": 0.8, "located_share": 0.4}
    assert dict(detector.defaulted)["floor"] == 0.8
    other = run_config("heat-potato", given=RunFlags(detector="image").given().over(given))
    assert other.choice(DETECTOR).given == ()


LAB = """
name = "lab"
tags = ["movable", "fixture", "support"]

[roles]
holding = "held_by"

[predicates.held_by]
kind = "relation"
parameters = ["thing", "hand"]
group = "place"

[predicates.rests_on]
kind = "relation"
parameters = ["thing", "place"]
contains = true
group = "place"
offered_by = "support"

[categories.Bench]
tags = ["fixture", "support"]

[categories.Scale]
tags = ["fixture", "support"]

[categories.Vial]
tags = ["movable"]

[skills.lift]
parameters = ["thing - movable"]
needs = ["not some ?x: held_by(?x, gripper)"]
effects = ["held_by(?thing, gripper)"]

[skills.weigh]
parameters = ["vial - Vial", "scale - Scale"]
needs = ["held_by(?vial, gripper)"]
effects = ["rests_on(?vial, ?scale)"]
"""

WEIGH = """
name = "weigh-vial"
title = "Weigh the vial"
domain = "lab.toml"
plan = ["lift(Vial)", "weigh(Vial, Scale)"]

[goal]
text = "."
all = ["rests_on(Vial, Scale)"]

[scene]
objects = [{ category = "Vial", places = ["Bench"] }]
"""


def own_task(folder: Path, table: str = "") -> str:
    (folder / "lab.toml").write_text(LAB + table)
    (folder / "weigh.toml").write_text(WEIGH)
    return str(folder / "weigh.toml")


def test_a_domain_that_nothing_simulates_runs_in_a_symbolic_world(tmp_path: Path) -> None:
    task = own_task(tmp_path)
    config = run_config(task, strategy="none")
    assert (config.choice(WORLD).name, config.choice(PERCEIVER).name) == ("symbolic", "given-graph")
    assert run_episode(prepare(config), None).success


def test_what_is_said_of_world_and_perceiver_stays(tmp_path: Path) -> None:
    task = own_task(tmp_path)
    assert run_config(task, world="symbolic").choice(PERCEIVER).name == "given-graph"
    assert run_config(task, perceiver="graph").choice(WORLD).name == "symbolic"
    assert run_config(task, perceiver="graph").choice(PERCEIVER).name == "graph"
    config = run_config(task, world="kitchen", strategy="none")
    assert config.choice(WORLD).name == "kitchen"
    with pytest.raises(InputError, match="kitchen does not simulate the domain lab"):
        run_episode(prepare(config), None)
    own_task(tmp_path, '\n[run]\nworld = "kitchen"\n')
    assert run_config(task).choice(WORLD).name == "kitchen"
    assert run_config("heat-potato").choice(WORLD).name == "kitchen"
    assert run_config("heat-potato").choice(PERCEIVER).name == "graph"


def test_options_are_spelt_with_the_kind_before_them() -> None:
    arguments = ["run", "x", "--detector.threshold", "0.7", "--text-encoder.dimensions=64", "-q"]
    assert list(spelt(arguments)) == [
        "run", "x", "--set", "detector.threshold=0.7", "--set", "text-encoder.dimensions=64", "-q",
    ]  # fmt: skip
    flags = RunFlags(settings=["detector.threshold=0.7", "text-encoder.dimensions=64"])
    config = run_config("heat-potato", given=flags.given())
    assert config.choice(DETECTOR).options["threshold"] == 0.7
    assert config.choice(TEXT_ENCODER).options["dimensions"] == 64
    with pytest.raises(InputError, match=r"detector.threshold=0.85"):
        RunFlags(settings=["threshold"]).given()


def test_short_names_mean_the_part_or_its_option() -> None:
    config = run_config(
        "heat-potato", encoder="two-tower", feature="text", renderer="rays", memory="m.db"
    )
    assert config.choice(TEXT_ENCODER).name == "two-tower"
    assert config.choice(PERCEIVER).options["feature"] == "text"
    assert config.choice(WORLD).options["renderer"] == "rays"
    assert config.choice(STORE).options["path"] == "m.db"


@pytest.mark.parametrize(
    ("named", "says"),
    [
        ({"detector": {"thresold": 0.3}}, "'scene-graph' 'thresold': did you mean threshold"),
        ({"detector.threshold": "high"}, "threshold of the detector 'scene-graph' cannot be"),
        ({"threshold": 2}, "threshold 2.0 is not between 0 and 1"),
        ({"detector.empty": "two"}, "empty of the detector.*known: one, skip"),
        ({"dtector": "image"}, "did you mean detector"),
        ({"renderer": "embre"}, "did you mean embree"),
        ({"without": "structur"}, "did you mean structure"),
        ({"without": "structure", "detector": "image"}, "only the detector 'scene-graph'"),
        ({"detector.feature": "image"}, "option of the detector 'scene-graph' 'feature'"),
        ({"text_encoder": {"dimensions": 1.5}}, "dimensions of the text-encoder"),
    ],
)  # fmt: skip
def test_what_is_not_valid_is_said_with_what_would_be(named: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        prepare(run_config("heat-potato", **named))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "[detectors]\nthreshold = 1",
            "run.toml: unknown table 'detectors': did you mean det",
        ),
        ("seed = 'one'", "run.toml: seed cannot be 'one'"),
        ("[detector", "run.toml: not valid TOML"),
    ],
)
def test_a_file_that_says_something_else_is_refused(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(FileFormatError, match=says):
        read_file(written(tmp_path, text))
    with pytest.raises(FileFormatError, match=r"absent\.toml"):
        read_file(tmp_path / "absent.toml")


def test_given_and_defaulted_options_stand_in_the_provenance() -> None:
    config = run_config("heat-potato", threshold=0.8, states="oracle")
    told = json.loads(json.dumps(dict(provenance(config))["config"]))
    assert told["parts"]["detector"]["given"] == {"threshold": 0.8}
    assert told["parts"]["detector"]["defaulted"]["state_weight"] == 0.15
    assert told["parts"]["states"]["name"] == "oracle"
    assert pickle.loads(pickle.dumps(config)) == config
    assert hash(config) == hash(run_config("heat-potato", threshold="0.8", states="oracle"))


def test_ablations_are_choices_of_parts() -> None:
    reasoning = run_config("heat-potato", without="reasoning")
    assert reasoning.choice(REASONER).name == "none"
    assert reasoning.choice(REPLANNER).name == "anew"
    parts = Assembly(run_config("heat-potato", without="structure").choices, shipped("household"))
    assert parts.part(DETECTOR).name == "scene-graph without structure"
    unchecked = run_config("heat-potato", without="validation").choice(REPLANNER)
    assert dict(unchecked.given) == {"validator": "accept-all"}


def test_a_strategy_that_compares_wants_a_memory() -> None:
    with pytest.raises(InputError, match="'proactive' compares with demonstrations"):
        make_strategy(run_config("heat-potato"), shipped("household"), [])
    assert make_strategy(run_config("heat-potato", strategy="none"), shipped("household"), None)


def test_what_was_said_of_one_part_is_said_once() -> None:
    one = Given.named({"detector.threshold": 0.5, "states": "clip"})
    assert one == Given.named({"states": "clip", "threshold": 0.5})
    assert one.over(Given.named({"threshold": 0.9})) == one


def test_a_run_is_of_its_tasks_domain_and_says_so(tmp_path: Path) -> None:
    assert run_config("fasten-plate").choice(DOMAIN).name == "bench"
    assert run_config("fasten-plate", domain="bench").choice(DOMAIN).name == "bench"
    with pytest.raises(InputError, match="fasten-plate does not fit the domain 'household': unkn"):
        run_config("fasten-plate", domain="household")
    with pytest.raises(UnknownNameError, match="domain 'benhc': did you mean bench"):
        run_config("fasten-plate", domain="benhc")
    with pytest.raises(FileFormatError, match=r"domain file absent\.toml"):
        run_config("fasten-plate", domain="absent.toml")
    shipped_file = files("forestall.domains") / "bench" / "domain.toml"
    (tmp_path / "own.toml").write_text(shipped_file.read_text().replace('"bench"', '"own"', 1))
    task = (files("forestall.domains") / "bench" / "tasks" / "fasten-plate.toml").read_text()
    (tmp_path / "task.toml").write_text(task.replace('"bench"', '"own.toml"', 1))
    for said in (None, "own"):
        assert run_config(str(tmp_path / "task.toml"), domain=said).choice(DOMAIN).name == "own"
