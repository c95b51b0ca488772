"""From alarm to success through the whole of it: Controller, perception, plan check, repair."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from builds import SCENE, at_home, executable, leaves_files_open, needs_package

from forestall.assembly.configuration import run_config
from forestall.assembly.make import prepare, run_episode
from forestall.cli.main import call
from forestall.errors import InputError
from forestall.types.decision import Outcome
from forestall.types.episode import EpisodeEnd, EpisodeRecord

pytestmark = [pytest.mark.slow, needs_package, leaves_files_open]


@pytest.fixture(autouse=True)
def home(tmp_path: Path) -> Iterator[None]:
    with at_home(tmp_path):
        yield


def _run(folder: Path, task: str, scenario: str | None, server: str, *said: str) -> EpisodeRecord:
    world = {
        "name": "ai2thor", "executable": str(executable(folder, *said)), "display": ":0",
        "scene": SCENE, "server": server, "width": 320, "height": 240,
    }  # fmt: skip
    config = run_config(
        task,
        scenario,
        seed=10_001,
        world=world,
        domain="ai2thor",
        states="oracle",
        strategy="plan-check",
    )
    return run_episode(prepare(config), None)


def test_from_alarm_to_success(tmp_path: Path) -> None:
    record = _run(tmp_path, "heat-potato", "microwave-occupied", "wsgi")
    alarms = [b for b in record.boundaries if b.outcome is Outcome.REPLAN]
    assert len(alarms) == 1
    assert "There is a bowl inside the microwave" in alarms[0].sentence
    assert record.end is EpisodeEnd.PLAN_FINISHED and record.success, record.failures
    assert any(str(e.subtask).startswith("put_on(Bowl-1") for e in record.executed)


def test_what_falls_on_the_way_is_fetched(tmp_path: Path) -> None:
    record = _run(tmp_path, "make-coffee", "mug-dropped", "fifo")
    alarms = [b for b in record.boundaries if b.outcome is Outcome.REPLAN]
    assert "I am not holding the mug" in alarms[0].sentence
    assert record.success, record.failures


def test_a_build_that_dies_holds_the_robot(tmp_path: Path) -> None:
    record = _run(tmp_path, "heat-potato", None, "fifo", "--dies-at", "OpenObject")
    assert record.end in (EpisodeEnd.ERROR, EpisodeEnd.HELD)
    assert record.trouble is not None
    assert "the build of AI2-THOR ended in OpenObject" in record.trouble.text
    assert any("hold" in n for n in record.notes)


def test_the_part_says_its_options_and_whether_the_package_is_there(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert call(["parts", "world"]) == 0
    said = capsys.readouterr().out
    assert all(word in said for word in ("scene", "executable", "server", "fov"))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"scene": "Kitchen 1"}, "scene 'Kitchen 1' is none of AI2-THOR"),
        ({"width": 8}, "64 pixels"),
        ({"server": "smtp"}, "fifo"),
    ],
)
def test_a_part_that_cannot_be_is_refused(options: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        prepare(run_config("heat-potato", world={"name": "ai2thor", **options}, states="oracle"))
