"""`forestall bench third-party`: the judges on a household that somebody else wrote."""

from __future__ import annotations

import json
import lzma
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cyclopts import App

from forestall.cli.flags import Flag, Json

if TYPE_CHECKING:
    from forestall.experiments.third_party_needs import NeedsRow
    from forestall.experiments.third_party_rows import Judged, Row
    from forestall.statistics.cells import Table
    from forestall.statistics.intervals import Metric


def register(bench: App) -> None:
    """Add the command to `forestall bench`."""
    bench.command(third_party)


def third_party(
    household: str = "virtualhome",
    *,
    packages: Path | None = None,
    development: Flag = False,
    out: Path | None = None,
    as_json: Json = False,
    quiet: Flag = False,
) -> int:
    """False alarms on good runs, detection of failing ones, mined needs against true ones.

    Every program is judged with demonstrations that it is not among, without a domain and with the
    household's own. See docs/third-party.md.

    Args:
        household: whose programs: virtualhome.
        packages: folder in which its packages were installed; where Python finds them by default.
        development: judge the tasks on which things may be set, and not those that are reported.
        out: a new folder for the results: tables (CSV), and in results.json.xz what was said of
            every run.
        as_json: print JSON instead of the tables.
        quiet: no progress on standard error.
    """
    from forestall.assembly.registry import foreign
    from forestall.cli.listing import print_table
    from forestall.cli.progress import bar
    from forestall.errors import InputError
    from forestall.experiments.third_party import judge
    from forestall.experiments.third_party_needs import compare, table
    from forestall.experiments.third_party_rows import rows
    from forestall.files import replace_file

    if out is not None and out.exists():
        raise InputError(f"{out} is there already: name a new folder")
    chosen = foreign(household)(packages=packages, development=development)
    with bar("judging", quiet=quiet or as_json) as feed:
        judged = judge(chosen, feed)
    runs = {r.name: r for g in chosen.good for r in (g, *chosen.demonstrations(g))}
    needs, found = table(compare(chosen, list(runs.values()))), rows(judged)
    first = [j for j in judged if j.knowledge == judged[0].knowledge]
    good = sum(not j.change for j in first)
    data = {
        "household": household,
        "good": good,
        "failing": len(first) - good,
        "rows": [r.to_json() for r in found],
        "needs": [r.to_json() for r in needs],
    }
    shown = (_judges(found), _changes(judged), _needs(needs))
    if out is not None:
        whole = json.dumps({**data, "runs": [told(j) for j in judged]}).encode()
        out.mkdir(parents=True)
        for made in shown:
            replace_file(out / f"{made.name}.csv", made.csv().encode())
        replace_file(out / "results.json.xz", lzma.compress(whole))
    if as_json:
        print(json.dumps(data, indent=2))
        return 0
    print(f"{household}: {good} good programs, {len(first) - good} failing runs")
    for made in shown:
        print(made.title)
        print_table(made.header, list(made.rows))
    return 0


def _judges(found: Sequence[Row]) -> Table:
    from forestall.statistics.cells import Table

    return Table(
        "judges",
        "what judges say of them",
        ("domain", "memory", "judge", "good runs alarmed", "detected in time", "at the step"),
        tuple(
            (
                r.knowledge.domain,
                r.knowledge.memory,
                r.judge,
                *map(share, (r.false_alarms, r.detected, r.at)),
            )
            for r in found
        ),
    )


def _changes(judged: Sequence[Judged]) -> Table:
    from forestall.experiments.third_party_rows import JUDGES, changes
    from forestall.statistics.cells import Table

    return Table(
        "changes",
        "detected in time, by what was changed",
        ("domain", "memory", "change", "runs", *JUDGES),
        tuple(
            (known.domain, known.memory, change, str(n), *map(str, by))
            for known in dict.fromkeys(j.knowledge for j in judged)
            for change, n, by in changes(judged, known)
        ),
    )


def _needs(needs: Sequence[NeedsRow]) -> Table:
    from forestall.experiments.third_party_needs import ENOUGH
    from forestall.statistics.cells import Table

    return Table(
        "needs",
        f"mined from {ENOUGH} demonstrations, against the true ones",
        ("true by", "what", "precision", "recall", "skills"),
        tuple(
            (r.domain, r.what, share(r.precision), share(r.recall), str(r.skills)) for r in needs
        ),
    )


def told(judged: Judged) -> dict[str, object]:
    """Everything that was said of a run."""
    said = [
        {name: [one.score, one.alarm, one.note] for name, one in boundary.items()}
        for boundary in judged.said
    ]
    return {
        "run": judged.run,
        "program": judged.program,
        "change": judged.change,
        "domain": judged.knowledge.domain,
        "memory": judged.knowledge.memory,
        "said": said,
    }


def share(metric: Metric) -> str:
    """A share with its interval."""
    if metric.value is None:
        return "-"
    band = "" if metric.low is None else f" ({100 * metric.low:.0f}-{100 * (metric.high or 0):.0f})"
    return f"{100 * metric.value:.0f} %{band} of {metric.n}"
