"""Starts the stand-in for the Unity side behind the real Controller, for these tests."""

from __future__ import annotations

import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pytest

from forestall.domain.load import shipped
from forestall.types.scene import SceneNeeds
from forestall.worlds.ai2thor.link import Build, Server
from forestall.worlds.ai2thor.world import ThorWorld

needs_package = pytest.mark.skipif(
    find_spec("ai2thor") is None, reason="the package ai2thor is not installed"
)
leaves_files_open = pytest.mark.filterwarnings("ignore")
"""The package leaves files and sockets open."""

STANDIN = Path(__file__).with_name("standin") / "unity.py"
WIDTH, HEIGHT = 240, 180
SCENE = "FloorPlan1"
DRY_SCENE = "FloorPlan2"
"""The same kitchen, in which running water reaches nothing."""


def executable(folder: Path, *said: str) -> Path:
    """A program that is called as a build of AI2-THOR is."""
    path = folder / "unity.sh"
    flags = " ".join(said)
    path.write_text(f'#!/bin/sh\nexec "{sys.executable}" "{STANDIN}" {flags} "$@"\n')
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def build(folder: Path, *said: str, server: Server = Server.FIFO, answer_s: float = 30.0) -> Build:
    """A build of the stand-in with small pictures."""
    program = executable(folder, *said)
    return Build(program, ":0", server, WIDTH, HEIGHT, start_s=60.0, answer_s=answer_s)


@contextmanager
def at_home(folder: Path) -> Iterator[None]:
    """A home of the test's own: the package keeps its log there."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOME", str(folder))
        patch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
        yield


@contextmanager
def opened(folder: Path, server: Server = Server.FIFO) -> Iterator[ThorWorld]:
    """The kitchen as it is, over one of the two servers."""
    with at_home(folder):
        world = ThorWorld(build(folder, server=server), SceneNeeds(), shipped("ai2thor"), SCENE)
        yield world
        world.close()
