"""`python -m tests.fuzz --count 10000 --seed 1`: damaged inputs over every reader, counted.

From the root of the repository. Input k of a reader with a seed is always the same; one of them
alone is run again with `--only memory:137`, and `--keep FOLDER` leaves its file there.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))


def main() -> int:
    """Run, print the table, and what went wrong; 1 where anything did."""
    from .readers import READERS
    from .run import GOOD, OUTCOMES, Case, Result, run_all, run_case

    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--count", type=int, default=1000, help="inputs in all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--limit-s", type=float, default=20.0, help="seconds for one input")
    parser.add_argument("--readers", nargs="+", choices=list(READERS), default=list(READERS))
    parser.add_argument("--only", help="one input, as READER:NUMBER")
    parser.add_argument("--keep", type=Path, help="with --only: leave the input in this folder")
    given = parser.parse_args()
    if given.only:
        reader, _, number = given.only.partition(":")
        result = run_case(Case(reader, given.seed, int(number)), given.keep)
        print(f"{result.outcome}: {result.text}")
        return int(result.outcome not in GOOD)
    names = given.readers
    cases = [Case(names[k % len(names)], given.seed, k // len(names)) for k in range(given.count)]
    counts: Counter[tuple[str, str]] = Counter()
    bad: dict[str, list[Result]] = {}
    started = time.monotonic()
    for done, result in enumerate(run_all(cases, given.jobs, given.limit_s), 1):
        counts[result.case.reader, result.outcome] += 1
        if result.outcome not in GOOD:
            bad.setdefault(f"{result.outcome}: {result.text}", []).append(result)
        if done % 500 == 0:
            print(f"{done} of {len(cases)}", file=sys.stderr, flush=True)
    print(f"seed {given.seed}, {len(cases)} inputs, {time.monotonic() - started:.0f} s")
    print(f"{'reader':14}" + "".join(f"{o:>15}" for o in OUTCOMES))
    for name in names:
        print(f"{name:14}" + "".join(f"{counts[name, o]:15}" for o in OUTCOMES))
    total = Counter({o: sum(counts[n, o] for n in names) for o in OUTCOMES})
    print(f"{'all':14}" + "".join(f"{total[o]:15}" for o in OUTCOMES))
    for text, results in sorted(bad.items(), key=lambda b: -len(b[1])):
        first = min(results, key=lambda r: r.case.number).case
        print(f"{len(results):5} x {first.reader}:{first.number} {text}")
    return int(bool(bad))


if __name__ == "__main__":
    sys.exit(main())
