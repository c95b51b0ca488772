"""Kills at random moments: nothing finished is lost or doubled, and the same command goes on.

FORESTALL_KILLS=100 kills a hundred times, a handful by default.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from victims import VICTIMS, Victim

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="finds processes in /proc"),
]
KILLS = int(os.environ.get("FORESTALL_KILLS", "4"))
EACH = [(name, together) for name in VICTIMS for together in (1, 2)]
CASES = EACH if len(EACH) <= KILLS else [EACH[k] for k in (0, 3, 5, 6)]
"""Each command, alone or two on the same files; both where there are kills enough."""
UNDISTURBED: dict[str, tuple[frozenset[str], float]] = {}
"""Command → what it makes, and how long it takes."""

FRESH = 4
"""A folder is killed over so many times at most before the command may finish in it."""


@pytest.mark.parametrize(
    ("name", "together"), [pytest.param(*c, marks=pytest.mark.xdist_group(c[0])) for c in CASES]
)
def test_nothing_finished_is_lost_or_doubled(
    name: str,
    together: int,
    tmp_path: Path,
    tmp_path_factory: pytest.TempPathFactory,
    record_property: Callable[[str, object], None],
) -> None:
    victim = VICTIMS[name]
    rng = np.random.default_rng((CASES.index((name, together)), 10))
    if name not in UNDISTURBED:
        UNDISTURBED[name] = _undisturbed(victim, tmp_path_factory.mktemp(name))
    whole, seconds = UNDISTURBED[name]
    kills, places = 0, count()
    while kills < -(-KILLS // len(CASES)):
        folder = tmp_path / str(next(places))
        folder.mkdir()
        done: frozenset[str] = frozenset()
        for _ in range(FRESH):
            killed = _killed(victim, folder, together, list(rng.uniform(0, seconds, together)))
            kills += killed
            now = victim.finished(folder)
            assert done <= now, f"lost: {sorted(done - now)}"
            done = now
            if not killed or now == whole:  # of two one may have come to the end
                break
        code, said = victim.start(folder).end()
        assert code == 0, said
        assert victim.finished(folder) == whole, said
        assert list(_partial(folder)) == []
    record_property("kills", kills)


def _undisturbed(victim: Victim, folder: Path) -> tuple[frozenset[str], float]:
    started = time.monotonic()
    code, said = victim.start(folder).end()
    assert code == 0, said
    return victim.finished(folder), time.monotonic() - started


def _killed(victim: Victim, folder: Path, together: int, after_s: list[float]) -> int:
    """Start commands on the same files and kill them one after the other; how many were running."""
    started = [victim.start(folder) for _ in range(together)]
    begun, kills = time.monotonic(), 0
    for one, seconds in zip(started, sorted(after_s), strict=True):
        killed = one.kill(max(0.0, begun + seconds - time.monotonic()))
        kills += killed
        if not killed:
            code, said = one.end()
            refused = code == 2 and "is being written by" in said
            assert code == 0 or (refused and together > 1 and not victim.shared), said
        assert one.left_over() == [], "a worker lives on"
    return kills


def _partial(folder: Path) -> Iterator[Path]:
    for path in folder.rglob("*"):
        if path.name.endswith((".part", ".tmp", "-wal")):
            yield path
