from __future__ import annotations

import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from forestall.types.observation import Frame, Intrinsics, Rgb

from . import tiny


@pytest.fixture(autouse=True)
def no_network(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is downloaded, and nothing outside of a test says which model is meant."""

    def refuse(*_: Any) -> None:
        raise AssertionError("a connection was opened")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    for name in ("GROUNDING_DINO", "OWLV2", "SAM", "SIGLIP", "CLIP"):
        monkeypatch.delenv(f"FORESTALL_{name}", raising=False)


@pytest.fixture(scope="session")
def checkpoint(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The folder of a tiny model, by the name of its maker in `tiny`; made once."""
    made: dict[str, Path] = {}

    def of(name: str) -> Path:
        if name not in made:
            make: Callable[[Path], Path] = getattr(tiny, name)
            made[name] = make(tmp_path_factory.mktemp("models") / f"tiny-{name}")
        return made[name]

    return of


@pytest.fixture(scope="session")
def rgb() -> Rgb:
    return np.random.default_rng(0).integers(0, 255, (48, 80, 3), dtype=np.uint8)


@pytest.fixture(scope="session")
def frame(rgb: Rgb) -> Frame:
    high, wide = rgb.shape[:2]
    camera = Intrinsics.from_vertical_fov(wide, high, 60.0)
    return Frame(rgb, np.ones((high, wide), np.float32), camera, np.eye(4))
