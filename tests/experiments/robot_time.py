"""Robot time of repaired runs, then and now, on the same scenarios in the same rooms.

    python tests/experiments/robot_time.py d5b0f98

Takes the rows of `results/test` at a commit and those of `results/kind` and `results/default` as
they are here. Counted are runs that succeeded with a corrected plan both times; beside them stand
runs without a monitor, which must take as long as then if the household is the same.
"""

from __future__ import annotations

import json
import lzma
import subprocess
import sys
from pathlib import Path
from statistics import median
from typing import Any

ROOT = Path(__file__).parents[2]
ROWS = "episodes.jsonl.xz"
SAME = ("profile", "task", "scenario", "seed", "strategy", "model", "without")

Rows = list[dict[str, Any]]


def read(packed: bytes) -> Rows:
    """The rows of a packed file."""
    return [json.loads(line) for line in lzma.decompress(packed).splitlines()]


def then(commit: str) -> Rows:
    """As they were kept at a commit."""
    shown = ["git", "-C", str(ROOT), "show", f"{commit}:results/test/{ROWS}"]
    return read(subprocess.run(shown, capture_output=True, check=True).stdout)


def main(commit: str) -> None:
    """A line for each strategy."""
    folders = (ROOT / "results" / name for name in ("kind", "default"))
    now = {_key(row): row for folder in folders for row in read((folder / ROWS).read_bytes())}
    before = then(commit)
    for strategy in ("none", "proactive", "plan-check"):
        pairs = [
            (row["simulated_s"], now[_key(row)]["simulated_s"])
            for row in before
            if row["strategy"] == strategy and _key(row) in now
            if all(_counts(r, strategy) for r in (row, now[_key(row)]))
        ]
        old_s, new_s = (sum(side) for side in zip(*pairs, strict=True))
        middle = median(new / old for old, new in pairs)
        told = f"{len(pairs)} runs, {old_s:.0f} s then, {new_s:.0f} s now: {new_s / old_s:.2f}"
        sys.stdout.write(f"{strategy}: {told} (median of the ratios {middle:.2f})\n")


def _key(row: dict[str, Any]) -> tuple[str, ...]:
    return tuple(json.dumps(row.get(name), sort_keys=True) for name in SAME)


def _counts(row: dict[str, Any], strategy: str) -> bool:
    return bool(row["success"]) and (strategy == "none" or bool(row["replans"]))


if __name__ == "__main__":
    main(sys.argv[1])
