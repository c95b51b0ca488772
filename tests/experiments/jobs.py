"""Jobs for workers of their own processes, importable by name."""

from __future__ import annotations

import os
from pathlib import Path


def doubled(job: int) -> tuple[int, int]:
    """The double, and who computed it."""
    return 2 * job, os.getpid()


def fatal(job: tuple[str, int]) -> int:
    """Ends its process at the first so many calls, which files in a folder count."""
    folder, deaths = job
    calls = len(list(Path(folder).iterdir()))
    if calls < deaths:
        (Path(folder) / str(calls)).touch()
        os._exit(1)
    return calls


def broken(job: int) -> int:
    """Raises."""
    raise ValueError(f"job {job}")
