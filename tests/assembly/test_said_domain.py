"""A run in another domain than its task's own: the one that was said, by name or file."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import pytest

from assembly.plain_parts import FlatWorlds
from experiments.episodes import computed_row
from forestall.assembly.configuration import Given, RunConfig, run_config
from forestall.assembly.demonstrations import load_memory, ready_made
from forestall.assembly.make import prepare, run_episode
from forestall.assembly.recording import RecordingJob, record_one
from forestall.cli.main import call
from forestall.config import DEMONSTRATION_SEEDS
from forestall.errors import InputError
from forestall.experiments.conduct import Experiment, conduct
from forestall.experiments.episodes import KIND, Episodes
from forestall.experiments.settings import Settings
from forestall.kinds import DOMAIN
from forestall.types.episode import EpisodeRecord

pytestmark = pytest.mark.slow

NEED = (
    '  { fact = "dirt(?hole)=clean", else = "{hole} is full of chips", '
    'lacks = ["dirt(?hole)=clean"] },\n'
)
"""What the copies of the bench leave out of the skill insert: a robot that blows the hole free."""


@pytest.fixture
def blowing(tmp_path: Path) -> str:
    text = (files("forestall.domains") / "bench" / "domain.toml").read_text()
    assert text.count(NEED) == 1
    path = tmp_path / "blowing.toml"
    path.write_text(text.replace(NEED, ""))
    return str(path)


def ran(config: RunConfig) -> EpisodeRecord:
    return run_episode(prepare(config), None)


def chips(**named: object) -> RunConfig:
    return run_config("fasten-plate", "hole-full-of-chips", seed=3, strategy="none", **named)  # type: ignore[arg-type]


def test_a_run_is_of_the_domain_that_was_said_and_says_so(blowing: str) -> None:
    own, other = ran(chips()), ran(chips(domain=blowing))
    assert own.success is False and other.success, other.failures
    config = dict(other.provenance)["config"]
    assert (config["domain"], config["parts"]["domain"]["name"]) == (blowing, blowing)
    assert dict(own.provenance)["config"]["domain"] is None
    assert dict(own.provenance)["inputs"] != dict(other.provenance)["inputs"]


def test_its_demonstrations_are_recorded_in_it_and_keyed_by_its_content(blowing: str) -> None:
    config = run_config("fasten-plate", domain=blowing, detector="objects")
    path = ready_made(config, workers=2)
    assert ready_made(config) == path != ready_made(run_config("fasten-plate"), workers=1)
    demonstrations, used = load_memory(config)
    assert (len(demonstrations), used) == (4, str(path))
    file = Path(blowing)
    file.write_text(file.read_text().replace("duration_s = 8.0", "duration_s = 9.0", 1))
    assert ready_made(config, workers=1) != path
    job = RecordingJob("fasten-plate", DEMONSTRATION_SEEDS, Given.named({"domain": blowing}))
    assert job.config(DEMONSTRATION_SEEDS).domain == blowing
    assert record_one(job).task == "fasten-plate"


def test_the_key_is_the_same_in_every_process(tmp_path: Path) -> None:
    code = (
        "import forestall.assembly.demonstrations as d, sys;"
        "from forestall.assembly.configuration import run_config;"
        "d.record_into = lambda *a: sys.exit(0);"
        "d.ready_made(run_config('fasten-plate'), announce=print)"
    )
    told = {
        subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "PYTHONHASHSEED": seed, "FORESTALL_CACHE": str(tmp_path)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    }
    assert len(told) == 1 and "fasten-plate-" in told.pop()


def test_an_experiment_of_another_domain_or_content_is_another_one(
    blowing: str, tmp_path: Path
) -> None:
    def play(**named: object) -> int:
        said = Settings(Given.named(named), pages="none")
        experiment = Experiment(
            Episodes(("fasten-plate",), (), ("none",), (1,)), settings=said, kind=KIND,
            engine="inline",
        )  # fmt: skip
        return len(conduct(experiment, tmp_path / "out", lambda *a: None, computed_row))

    assert play(domain=blowing) == 1 == play(domain=blowing)
    with pytest.raises(InputError, match="domain"):
        play()
    file = Path(blowing)
    file.write_text(file.read_text().replace("duration_s = 8.0", "duration_s = 9.0", 1))
    with pytest.raises(InputError, match="domain"):
        play(domain=blowing)


def test_a_task_that_does_not_fit_is_told_with_the_nearest_name(tmp_path: Path) -> None:
    text = (files("forestall.domains") / "bench" / "domain.toml").read_text()
    path = tmp_path / "other.toml"
    path.write_text(text.replace("tighten", "tightly"))
    says = "fasten-plate does not fit the domain 'bench': step 9, tighten.*did you mean tightly"
    with pytest.raises(InputError, match=says):
        run_config("fasten-plate", domain=str(path))


def test_the_command_takes_a_domain_and_somebodys_world(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (files("forestall.domains") / "household" / "domain.toml").read_text()
    path = tmp_path / "mine.toml"
    path.write_text(text.replace('name = "household"', 'name = "mine"', 1))
    parts = ["--world", "assembly.plain_parts:FlatWorlds", "--domain", str(path)]
    parts += ["--perceiver.name=assembly.plain_parts:TruthPerceiver", "--strategy", "none"]
    out = ["--out", str(tmp_path / "out"), "--json", "--quiet"]
    assert call(["run", "heat-potato", *parts, *out]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["domain"], told["provenance"]["config"]["domain"]) == ("mine", str(path))
    assert call(["run", "heat-potato", *parts[:2], "--domain", "bench", *out]) == 2
    assert "heat-potato does not fit the domain 'bench'" in capsys.readouterr().err
    assert FlatWorlds.__name__ in str(told["provenance"]["config"]["parts"]["world"])


def test_a_domain_without_a_task_is_kept_for_the_memory(blowing: str) -> None:
    config = run_config("", domain=blowing)
    assert (config.domain, config.choice(DOMAIN).name) == (blowing, blowing)
    assert replace(config, domain=None) != config
