"""`forestall bench`: measurements, as a table and as JSON."""

from __future__ import annotations

import json
from typing import Annotated

from cyclopts import App, Parameter

Json = Annotated[bool, Parameter(name="--json", negative="")]

bench = App(name="bench", help="Measure.")


@bench.command
def speed(
    *,
    repeat: int = 10,
    seed: int = 0,
    as_json: Json = False,
    quiet: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Milliseconds per picture, graph, comparison and plan; seconds per episode.

    Args:
        repeat: how often each is timed (the episode: once with each strategy).
        seed: of the scene.
        as_json: print JSON instead of the table.
        quiet: no progress on standard error.
    """
    from forestall.cli.progress import bar
    from forestall.errors import InputError
    from forestall.speed import measure

    if repeat < 1:
        raise InputError(f"--repeat {repeat}: at least 1 is needed")
    with bar("measuring", quiet=quiet or as_json) as feed:
        report = measure(repeat, seed, feed)
    if as_json:
        print(json.dumps(report, indent=2))
        return 0
    from forestall.cli.listing import print_table

    print_table(
        ("what", "median", "least", "most", "unit", "aim", "median / aim"),
        [
            (
                r["what"],
                f"{r['median']:.2f}",
                f"{r['least']:.2f}",
                f"{r['most']:.2f}",
                r["unit"],
                "" if r["aim"] is None else f"{r['aim']:g}",
                "" if r["aim"] is None else f"{r['median'] / r['aim']:.2f}",
            )
            for r in report["rows"]
        ],
    )
    machine = report["machine"]
    print(f"{machine['processor']}, {machine['cores']} cores, {machine['platform']}")
    return 0
