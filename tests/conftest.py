"""Shared by all tests: no test touches the user's cache; those of a world are marked."""

from collections.abc import Iterator
from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A cache folder of the test's own."""
    folder = tmp_path / "cache"
    monkeypatch.setenv("FORESTALL_CACHE", str(folder))
    yield folder


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What lies under `worlds` needs the simulator."""
    for item in items:
        if "worlds" in item.path.relative_to(Path(__file__).parent).parts:
            item.add_marker("simulator")
