"""A few hundred damaged inputs; `python -m tests.fuzz` makes as many as one likes."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from forestall.types.decision import Outcome
from stranger import scene as stranger_scene

from . import live, logs, scene
from .make_corpus import CORPUS
from .readers import READERS, Reader
from .run import GOOD, HANG, READ, TRACEBACK, Case, run_all, run_case

FEW = 20
SEED = 20260101

OF_FILES = {
    "graph": ("graph/plain.json", "graph/featured.json"),
    "demonstration": ("demonstration/short.json",),
    "memory": ("memory/memory.db",),
    "observation": ("observation/ids", "observation/masks"),
    "record": ("record/finished", "record/killed"),
    "results": ("results/all",),
    "task": ("task/task.toml",),
    "scenario": ("scenario/scenario.toml",),
    "domain": ("domain/domain.toml",),
    "config": ("config/config.toml",),
    "pddl": ("pddl/coffee.pddl", "pddl/ferry.pddl"),
}


@pytest.mark.parametrize("name", OF_FILES)
def test_the_corpus_is_read_before_it_is_damaged(name: str, tmp_path: Path) -> None:
    import shutil

    for place in OF_FILES[name]:
        source = CORPUS / place
        shutil.copytree(source if source.is_dir() else source.parent, tmp_path, dirs_exist_ok=True)
        target = tmp_path if source.is_dir() else tmp_path / source.name
        assert READERS[name].read(target) is None


@pytest.mark.parametrize("name", logs.readers())
def test_the_logs_are_read_before_they_are_damaged(name: str, tmp_path: Path) -> None:
    place = logs.put(logs.written(logs.KINDS[name]), tmp_path / "log")
    assert READERS[name].read(place) is None


def test_what_is_not_damaged_may_proceed() -> None:
    decision = scene.monitor().before(scene.with_masks(scene.observation()))
    assert decision.outcome is Outcome.PROCEED
    assert live.check(stranger_scene()) is None


@pytest.mark.parametrize("name", sorted(READERS))
def test_whatever_is_read_is_read_or_refused_in_one_sentence(name: str) -> None:
    wrong = [r for k in range(FEW) if (r := run_case(Case(name, SEED, k))).outcome not in GOOD]
    assert wrong == []


def test_an_input_is_the_same_every_time(tmp_path: Path) -> None:
    for name in ("graph", "pddl", "observation"):
        for copy in ("one", "two"):
            run_case(Case(name, 3, 5), tmp_path / copy / name)
    files = [p.relative_to(tmp_path / "one") for p in (tmp_path / "one").rglob("*")]
    assert files
    for file in (f for f in files if (tmp_path / "one" / f).is_file()):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()


def test_what_raises_and_what_hangs_is_counted_as_such(monkeypatch: pytest.MonkeyPatch) -> None:
    def read(number: int) -> str | None:
        if number % 3 == 1:
            raise ZeroDivisionError
        while number % 3 == 2:
            pass
        return None

    monkeypatch.setitem(READERS, "graph", Reader(lambda _, rng: rng.randrange(99), read))
    seeds = {Random(f"1/graph/{k}").randrange(99) % 3: k for k in range(20)}
    cases = [Case("graph", 1, seeds[what]) for what in (0, 1, 2)]
    found = {r.case: r.outcome for r in run_all(cases, 2, limit_s=1.0)}
    assert [found[case] for case in cases] == [READ, TRACEBACK, HANG]
