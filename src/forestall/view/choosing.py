"""Which runs of the index are shown: filters, one page of what is left. Called by `serving.py`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from forestall.view.rows import Outcome, RunRow

UNDISTURBED = "undisturbed"
"""How a run without a scenario is chosen and called."""

ALARMS = ("with", "without")
EACH = 100
"""So many runs stand on one page."""


@dataclass(frozen=True, slots=True)
class Shown:
    """A run with how it stands now."""

    row: RunRow
    outcome: Outcome

    def value(self, name: str) -> str:
        """What a filter looks at."""
        row = self.row
        return {
            "task": row.task,
            "scenario": UNDISTURBED if row.scenario is None else row.scenario,
            "strategy": row.strategy,
            "outcome": self.outcome.value,
            "alarm": ALARMS[0] if row.alarms else ALARMS[1],
        }[name]


FILTERS = ("task", "scenario", "strategy", "outcome", "alarm")


@dataclass(frozen=True, slots=True)
class Filter:
    """One choice on the page.

    Args:
        name: of it.
        values: that runs have, each with how many; those that are not read are left out.
        chosen: "" where anything will do.
    """

    name: str
    values: Sequence[tuple[str, int]]
    chosen: str


@dataclass(frozen=True, slots=True)
class Choice:
    """What the index shows.

    Args:
        filters: in their order.
        runs: of this page.
        count: how many there are on all pages.
        page: number of this one, from 1.
        pages: how many there are.
    """

    filters: tuple[Filter, ...]
    runs: Sequence[Shown]
    count: int
    page: int
    pages: int


def choose(runs: Sequence[Shown], asked: Mapping[str, str]) -> Choice:
    """The runs that were asked for.

    Args:
        runs: all of them, in the order in which they are shown.
        asked: filter → value, and the number of the page; what is no filter is not looked at, and
            a page that is not there is the nearest that is.
    """
    filters = tuple(_filter(name, runs, asked.get(name, "")) for name in FILTERS)
    left = [r for r in runs if all(f.chosen in ("", r.value(f.name)) for f in filters)]
    pages = max(1, -(-len(left) // EACH))
    said = asked.get("page", "")
    wanted = int(said) if said.isascii() and said.isdigit() and len(said) < 7 else 1
    page = min(max(1, wanted), pages)
    return Choice(filters, left[EACH * (page - 1) : EACH * page], len(left), page, pages)


def _filter(name: str, runs: Sequence[Shown], chosen: str) -> Filter:
    counts: dict[str, int] = {}
    for run in runs:
        value = run.value(name)
        if value:
            counts[value] = counts.get(value, 0) + 1
    if chosen and chosen not in counts:  # of a link to runs that have gone
        counts[chosen] = 0
    return Filter(name, sorted(counts.items()), chosen)
