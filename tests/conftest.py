"""Shared by all tests: no test touches the user's cache; those of a world are marked; a browser."""

import shutil
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import pytest

from forestall.errors import InputError
from forestall.extras import EXTRAS, how, installed, missed

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A cache folder of the test's own."""
    folder = tmp_path / "cache"
    monkeypatch.setenv("FORESTALL_CACHE", str(folder))
    yield folder


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    """Debian's Chromium, driven by Playwright; skipped where one of them is missing."""
    if CHROMIUM is None:
        pytest.skip("there is no chromium on this machine")
    driver = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with driver.sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=CHROMIUM, args=["--no-sandbox"], timeout=240_000
        )
        yield browser
        browser.close()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Tests of one file run in one process, with fixtures made once; a group of its own apart."""
    from xdist.scheduler import LoadGroupScheduling  # type: ignore[import-untyped]

    class ByFile(LoadGroupScheduling):  # type: ignore[misc]
        def _split_scope(self, nodeid: str) -> str:
            group = super()._split_scope(nodeid)
            return nodeid.split("::", maxsplit=1)[0] if group == nodeid else group

    return ByFile(config, log)


ABSENT = tuple(extra for extra in EXTRAS if not installed(extra))
"""Extras that are not installed: what needs one of them is skipped, and says so."""


def _absent(error: BaseException | None) -> str | None:
    """The sentence of an error that only says that an extra is not installed."""
    while error is not None:
        said = missed(error) or (str(error) if isinstance(error, InputError) else "")
        if any(how(extra) in said for extra in ABSENT):
            return said
        error = error.__cause__ or error.__context__
    return None


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """A file of tests that cannot be imported without an extra is skipped where that is absent."""
    report = yield
    if ABSENT and report.failed and isinstance(collector, pytest.Module):
        found = next((e for e in ABSENT for m in EXTRAS[e].modules
                      if f"No module named '{m}" in str(report.longrepr)), None)  # fmt: skip
        if found is not None:
            report.outcome = "skipped"
            report.longrepr = (str(collector.path), 0, f"Skipped: needs {how(found)}")
    return report


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """A test that stops for want of an extra is skipped where that is absent."""
    report = yield
    if ABSENT and report.failed and call.excinfo is not None:
        said = _absent(call.excinfo.value)
        if said is not None:
            report.outcome = "skipped"
            report.longrepr = (str(item.path), 0, f"Skipped: {said}")
    return report


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What lies under `worlds` needs the simulator."""
    for item in items:
        if "worlds" in item.path.relative_to(Path(__file__).parent).parts:
            item.add_marker("simulator")
