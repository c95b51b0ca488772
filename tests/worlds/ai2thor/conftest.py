"""Builds of the stand-in for AI2-THOR's Unity side, one for each server and module."""

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest
from builds import SCENE, build

from forestall.domain.load import shipped
from forestall.types.scene import SceneNeeds
from forestall.worlds.ai2thor.link import Server
from forestall.worlds.ai2thor.world import ThorWorld

HAS_PACKAGE = find_spec("ai2thor") is not None


@pytest.fixture(scope="session", autouse=True)
def home(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A home of their own: the package keeps its log there."""
    folder = tmp_path_factory.mktemp("home")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOME", str(folder))
        patch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
        yield folder


@pytest.fixture(scope="module", params=list(Server), ids=lambda s: s.value)
def any_world(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[ThorWorld]:
    """A world over each of the two servers."""
    yield from _world(tmp_path_factory.mktemp("build"), request.param)


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ThorWorld]:
    """A world over FIFO."""
    yield from _world(tmp_path_factory.mktemp("build"), Server.FIFO)


def _world(folder: Path, server: Server) -> Iterator[ThorWorld]:
    if not HAS_PACKAGE:
        pytest.skip("the package ai2thor is not installed")
    found = ThorWorld(build(folder, server=server), SceneNeeds(), shipped("ai2thor"), SCENE)
    yield found
    found.close()
