"""How often the intervals of the report hold: `PYTHONPATH=tests python -m study.coverage 200 CSV`.

From the root; the table is written to CSV. A study is made of watched runs; its raters are drawn,
answer into the files that the server writes, and are counted by the report, as often as is said;
what `report.json` then says is held against what the raters were drawn from.
"""

from __future__ import annotations

import csv
import json
import shutil
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from forestall.study.assigning import Design
from forestall.study.making import make_study
from forestall.study.measuring import ALL
from forestall.study.model import ANSWERS_NAME, Study
from forestall.study.reporting import write_report
from forestall.study.simulated import Taste, simulate, write_simulated

from .test_making import SCENARIO, SEED, asked, kept, watched

ODDS = (0.3, 0.9, 1.6)
ITEMS = 40
SHARES = ("wins", "losses", "both", "decided", "preference")


@dataclass(frozen=True, slots=True)
class Held:
    """What became of the intervals of one number.

    Args:
        of: a rival, all of them, or "" of the whole study.
        what: the number.
        held: how many held the truth. `times`: of so many. `wide`: their mean width.
    """

    of: str
    what: str
    held: int
    times: int
    wide: float


def taste_of(against: Sequence[str]) -> Taste:
    """Raters who like ours better than the three rivals, each by another margin."""
    return Taste(dict(zip(against, ODDS, strict=True)))


def truth_of(taste: Taste) -> dict[tuple[str, str], float]:
    """What the report should find: a rival and a number → the truth."""
    found: dict[tuple[str, str], float] = {}
    for rival in taste.odds:
        wins, preference = taste.wins(rival), taste.preference(rival)
        shares = (wins, 1 - taste.both - wins, taste.both, wins / (1 - taste.both), preference)
        found |= {(rival, what): v for what, v in zip(SHARES, shares, strict=True)}
        odds = preference / (1 - preference)
        found |= {(rival, "odds"): odds, (rival, "strength"): -float(np.log(odds))}
    for what in SHARES:
        found[ALL, what] = float(np.mean([found[rival, what] for rival in taste.odds]))
    return found | {("", "alpha"): taste.alpha()}


def said_by(report: Any) -> dict[tuple[str, str], Any]:
    """The same numbers of a report's raters, with their intervals."""
    found: dict[tuple[str, str], Any] = {}
    for name, row in report["against"].items():
        found |= {(name, what): row[what] for what in SHARES}
        if name != ALL:
            found[name, "odds"] = row["odds"]
            found[name, "strength"] = report["strengths"][name]
    return found | {("", "alpha"): report["alpha"]}


def intervals(study: Study, folder: Path, taste: Taste, seed: int) -> dict[tuple[str, str], Any]:
    """One study: drawn raters, their files, the report as it is written."""
    shutil.rmtree(folder / ANSWERS_NAME, ignore_errors=True)
    write_simulated(folder, simulate(study, taste, seed))
    written = write_report(folder).files[1]
    return said_by(json.loads(written.read_text("utf-8"))["simulated"])


def coverage(study: Study, folder: Path, taste: Taste, times: int) -> Iterator[Held]:
    """Of every interval of the report, over many studies.

    Args:
        study: in `folder`, which nobody else answers.
        taste: of the raters.
        times: how many studies; each has a seed of its own.
    """
    truth = truth_of(taste)
    reports = [intervals(study, folder, taste, seed) for seed in range(times)]
    for key, value in truth.items():
        lows, highs = ([r[key][end] for r in reports] for end in ("low", "high"))
        held = [low <= value <= high for low, high in zip(lows, highs, strict=True)]
        yield Held(*key, sum(held), times, float(np.mean(np.subtract(highs, lows))))


def made_of_runs(folder: Path) -> tuple[Study, Path]:
    """A study of watched runs in as many rooms as it has items, for 15 raters."""
    for k in range(ITEMS):
        for name, scenario in (("failing", SCENARIO), ("twin", None)):
            record = replace(watched(scenario), seed=SEED + k)
            kept(folder / "runs" / f"{name}-{k}", record)
    place = folder / "study"
    study = make_study(place, [folder / "runs"], asked(items=ITEMS, design=Design(15)))
    return study, place


def main(times: int = 200, out: Path | None = None) -> None:
    """Print a line for every number, and write all as a table."""
    with TemporaryDirectory() as folder:
        study, place = made_of_runs(Path(folder))
        print(f"{len(study.items)} items, {len(study.raters)} raters, {times} studies")
        rows = [("against", "number", "interval holds the truth", "width")]
        for found in coverage(study, place, taste_of(study.against), times):
            held = f"{100 * found.held / times:.1f} % ({found.held}/{times})"
            rows.append((found.of or "whole study", found.what, held, f"{found.wide:.3f}"))
            print("  ".join(rows[-1]))
    if out is not None:
        with out.open("w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows(rows)


if __name__ == "__main__":
    given = sys.argv[1:3]
    main(int(given[0]) if given else 200, Path(given[1]) if given[1:] else None)
