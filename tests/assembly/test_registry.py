"""What can be chosen by name, ours and other people's."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest

from forestall import kinds
from forestall.assembly import registry
from forestall.assembly.configuration import Given, choices, run_config
from forestall.assembly.options import declared
from forestall.assembly.parts import Assembly
from forestall.assembly.registry import default, find, known
from forestall.assembly.tables import TABLES, Table
from forestall.domain.load import shipped
from forestall.errors import InputError, UnknownNameError
from forestall.kinds import DETECTOR, SEGMENTER
from forestall.types.kind import Kind

OWN = '''
class Calm:
    """A detector that judges nothing; borrows nothing."""

    name = "calm"

    def __init__(self, threshold: float = 0.5):
        self.threshold = threshold

    def judge(self, observed, observation, references):
        return None


def borrowing(parts, *, patience: int = 3):
    made = Calm()
    made.words, made.patience = len(parts.domain.categories), patience
    return made


class Deaf:
    """Has no judge()."""

    name = "deaf"


def broken(parts):
    raise RuntimeError("no such camera")
'''


@pytest.fixture
def plugin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A package of somebody else's with detectors, some of which do not work."""
    (tmp_path / "their_detectors.py").write_text(OWN)
    (tmp_path / "their_ruins.py").write_text("import a_library_that_is_not_there\n")
    info = tmp_path / "their_package-1.2.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: their-package\nVersion: 1.2\n")
    (info / "entry_points.txt").write_text(
        "[forestall.detector]\n"
        "calm = their_detectors:Calm\n"
        "borrowing = their_detectors:borrowing\n"
        "deaf = their_detectors:Deaf\n"
        "broken = their_detectors:broken\n"
        "ruined = their_ruins:Detector\n"
        "gone = their_detectors:Gone\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    yield
    for name in ("their_detectors", "their_ruins"):
        sys.modules.pop(name, None)


def made(**named: Any) -> object:
    return Assembly(run_config("heat-potato", **named).choices, shipped("household")).part(DETECTOR)


def test_every_kind_has_a_table_and_every_shipped_part_declares_its_options() -> None:
    assert {k.name for k in vars(kinds).values() if isinstance(k, Kind)} == set(TABLES)
    for kind, table in TABLES.items():
        assert table.default in table.targets
        for name in table.targets:
            options = declared(find(kind, name).factory).options
            assert all(option.name == key for key, option in options.items())


def test_a_default_stands_in_one_place() -> None:
    config = run_config("heat-potato")
    assert config.choice(DETECTOR).name == default(DETECTOR)
    assert all(c.given == () for c in choices(Given()))


def test_an_unknown_name_answers_with_the_nearest() -> None:
    with pytest.raises(UnknownNameError, match="did you mean scene-graph"):
        find("detector", "scene-grph")
    with pytest.raises(UnknownNameError, match="did you mean detector"):
        known("detectors")


def test_parts_of_others_are_found_built_and_watch_along(plugin: None) -> None:
    assert {"calm", "borrowing", "scene-graph"} <= set(known("detector"))
    assert vars(made(detector="calm", threshold=0.25))["threshold"] == 0.25
    borrowing = vars(made(detector={"name": "borrowing", "patience": "7"}))
    assert (borrowing["patience"], borrowing["words"]) == (7, len(shipped("household").categories))
    where_it_stands = made(detector="their_detectors:Calm")
    assert type(where_it_stands).__name__ == "Calm"


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("ruined", "cannot be loaded.*a_library_that_is_not_there"),
        ("gone", "cannot be loaded.*Gone"),
        ("broken", "cannot be built: RuntimeError: no such camera"),
        ("deaf", r"cannot be used: it has no judge"),
    ],
)
def test_what_does_not_work_is_named_with_its_package(plugin: None, name: str, why: str) -> None:
    with pytest.raises(InputError, match=f"'{name}' of the package their-package 1.2 {why}"):
        made(detector=name)


def test_options_of_others_are_checked_like_ours(plugin: None) -> None:
    with pytest.raises(UnknownNameError, match=r"patence.*did you mean patience"):
        made(detector={"name": "borrowing", "patence": 7})
    with pytest.raises(InputError, match=r"patience of the detector 'borrowing'.*'many'"):
        made(detector={"name": "borrowing", "patience": "many"})


def test_one_ours_that_cannot_be_imported_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    table = Table(SEGMENTER, "torn", {"torn": "forestall.absent:Segmenter"})
    monkeypatch.setitem(TABLES, "segmenter", table)
    with pytest.raises(InputError, match=r"segmenter 'torn' cannot be loaded \(forestall.absent"):
        find("segmenter", "torn")


def test_entry_points_do_not_replace_ours(monkeypatch: pytest.MonkeyPatch) -> None:
    entry = EntryPoint("scene-graph", "nowhere:Thing", "forestall.detector")
    monkeypatch.setattr(registry, "_entries", lambda kind: (entry,))
    assert find("detector", "scene-graph").package is None
