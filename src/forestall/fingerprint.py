"""A digest of the project's own sources: what was computed by other code is not mixed in."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Sequence
from pathlib import Path

_ROOT = Path(__file__).parent

PRESENTATION = ("cli", "report", "training", "experiments", "study")
"""Packages that show results or train models, and change no run."""

JUDGING = ("calibration", "comparison", "detection", "diagnosis", "learning", "replanning")
"""Packages that judge scenes and mend plans: in a run that nobody watches they have no say."""

ROW_MAKING = (
    "experiments/conduct.py", "experiments/runs.py", "experiments/speed.py",
    "experiments/worker.py", "records/derived.py",
)  # fmt: skip
"""What makes the rows of an experiment from its runs all the same."""

RUNNING = ("cases", "rows")
"""Modules of the statistics that say what is run and kept; the others count it."""


def weights_of(names: Iterable[str]) -> list[tuple[str, str]]:
    """Which weights of others are meant by parts that read some: FORESTALL_CLIP for "clip"."""
    told = {name: f"FORESTALL_{name.upper().replace('-', '_')}" for name in sorted(set(names))}
    found = ((name, os.environ.get(variable)) for name, variable in told.items())
    return [(name, folder) for name, folder in found if folder]


def sources_digest(
    extra: Sequence[object] = (), but: Sequence[str] = (), without: Sequence[str] = ()
) -> str:
    """Sixteen hexadecimal digits of the sources, the shipped data, and what is given besides.

    Args:
        extra: further things that what is keyed depends on; their `repr` counts.
        but: files of the packages that show results, which matter all the same.
        without: further packages that change nothing.
    """
    digest = hashlib.blake2b(repr(tuple(extra)).encode(), digest_size=8)
    for path in sorted(
        p for p in _ROOT.rglob("*") if p.suffix in (".py", ".toml", ".onnx", ".json")
    ):
        place = path.relative_to(_ROOT)
        counting = place.parts[0] == "statistics" and place.stem not in RUNNING
        shows = place.parts[0] in (*PRESENTATION, *without) and place.as_posix() not in but
        if not shows and not counting:
            digest.update(place.as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()
