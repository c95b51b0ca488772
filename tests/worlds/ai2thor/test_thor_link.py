"""A build that dies, hangs or never starts: said clearly and in time; nothing goes on behind it."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from builds import SCENE, WIDTH, at_home, build, leaves_files_open, needs_package

from forestall.domain.load import shipped
from forestall.errors import ForestallError, InputError
from forestall.types.episode import SkillStatus
from forestall.types.plan import Subtask
from forestall.types.scene import SceneNeeds
from forestall.worlds.ai2thor.link import Build, Link, Server
from forestall.worlds.ai2thor.world import ThorWorld

pytestmark = [needs_package, leaves_files_open]

BOTH = pytest.mark.parametrize("server", list(Server), ids=lambda s: s.value)


@pytest.fixture(autouse=True)
def home(tmp_path: Path) -> Iterator[None]:
    with at_home(tmp_path):
        yield


@BOTH
def test_a_build_that_dies_in_mid_run_is_an_error_and_stays_one(
    tmp_path: Path, server: Server
) -> None:
    link = Link(build(tmp_path, "--dies-at", "Done:2", server=server), SCENE)
    assert link.step("Done").metadata["lastActionSuccess"]
    assert link.event.frame.shape[1] == WIDTH
    began = time.monotonic()
    with pytest.raises(ForestallError, match=r"ended in Done \(exit code 1\)"):
        link.step("Done")
    assert time.monotonic() - began < 15.0  # and not the Controller's own limit of 30 s
    with pytest.raises(ForestallError, match="ended in Done"):
        link.step("Done")
    link.stop()


@BOTH
def test_a_build_that_does_not_answer_is_late(tmp_path: Path, server: Server) -> None:
    link = Link(build(tmp_path, "--hangs-at", "Done", server=server, answer_s=20.0), SCENE)
    link._build = Build(answer_s=1.0)
    with pytest.raises(ForestallError, match="did not answer Done within 1 s"):
        link.step("Done")
    assert link._exit_code() is not None  # it has been ended


@BOTH
@pytest.mark.parametrize("action", ["GetScenesInBuild", "Initialize"])
def test_a_build_that_dies_while_it_starts_is_no_endless_wait(
    tmp_path: Path, server: Server, action: str
) -> None:
    with pytest.raises(ForestallError, match=r"ended in start \(exit code 1\)"):
        Link(build(tmp_path, "--dies-at", action, server=server), SCENE)


def test_a_program_that_is_no_build_is_said_to_be_none(tmp_path: Path) -> None:
    quits = tmp_path / "quits.sh"
    quits.write_text("#!/bin/sh\nexit 3\n")
    with pytest.raises(InputError, match="no program that can be run"):
        Link(Build(quits, ":0"), SCENE)
    quits.chmod(0o755)
    with pytest.raises(ForestallError, match=r"ended in start \(exit code 3\)"):
        Link(Build(quits, ":0", start_s=30.0), SCENE)


def test_a_scene_that_is_not_in_the_build_is_named(tmp_path: Path) -> None:
    with pytest.raises(ForestallError, match=r"FloorPlan99_physics.*not contained"):
        Link(build(tmp_path), "FloorPlan99")


def test_an_action_that_the_build_does_not_know_is_a_failed_one(tmp_path: Path) -> None:
    link = Link(build(tmp_path), SCENE)
    event = link.step("Levitate")
    assert not event.metadata["lastActionSuccess"]
    assert "Levitate" in event.metadata["errorMessage"]
    link.stop()
    with pytest.raises(ForestallError, match="has been stopped"):
        link.step("Done")


def test_a_world_whose_build_dies_can_be_held_and_begun_anew(tmp_path: Path) -> None:
    program = build(tmp_path, "--dies-at", "OpenObject")
    world = ThorWorld(program, SceneNeeds(), shipped("ai2thor"), SCENE)
    world.reset(0)
    with pytest.raises(ForestallError, match="ended in OpenObject"):
        world.execute(Subtask.parse("open_obj(Fridge)"))
    world.hold()
    outcome = world.execute(Subtask.parse("pick_up(Mug)"))
    assert outcome.status is SkillStatus.REFUSED and outcome.reason == "the robot was told to hold"
    assert world.time_s >= 0.0
    world.reset(0)
    assert world.execute(Subtask.parse("pick_up(Mug)")).status is SkillStatus.SUCCEEDED
    world.close()


@BOTH
def test_once_stopped_no_thread_goes_on(tmp_path: Path, server: Server) -> None:
    before = set(threading.enumerate())
    link = Link(build(tmp_path, "--dies-at", "Done:2", server=server), SCENE)
    assert set(threading.enumerate()) > before or server is not Server.WSGI
    link.step("Done")
    with pytest.raises(ForestallError, match="ended in Done"):
        link.step("Done")
    link.stop()
    ends = time.monotonic() + 20.0
    while (left := set(threading.enumerate()) - before) and time.monotonic() < ends:
        time.sleep(0.05)
    assert not left
