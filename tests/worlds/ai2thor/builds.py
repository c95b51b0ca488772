"""Starts the stand-in for the Unity side behind the real Controller, for these tests."""

from __future__ import annotations

import stat
import sys
from pathlib import Path

from forestall.worlds.ai2thor.link import Build, Server

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
