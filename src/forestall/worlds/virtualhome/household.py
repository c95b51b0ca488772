"""VirtualHome's programs as good and failing runs (implements `seams.Foreign`).

Called by `bench third-party` through the registry; calls the importer and `changes`. Good are
programs that the executor carries out, of the reported tasks up to four each; demonstrations are up
to eleven others of the task. Failing are those in which one change makes the executor refuse a
step, of each program the first such change of each sort. All other tasks are for whoever sets
something: nothing of what is reported was tuned on.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from pathlib import Path

from forestall.domain.model import Domain
from forestall.types.foreign import ForeignRun
from forestall.worlds.virtualhome.changes import changes
from forestall.worlds.virtualhome.importer import carried_out
from forestall.worlds.virtualhome.packages import Packages, Program, read_start
from forestall.worlds.virtualhome.pddl import Kinds, as_published, corrected
from forestall.worlds.virtualhome.seen import HANDS

REPORTED = (
    "Wash dishes with dishwasher", "Put groceries in Fridge", "Wash clothes", "Turn on light",
    "Pick up phone", "Make coffee", "Set up table", "Cook some food", "Drink",
)  # fmt: skip
EACH = 4
"""Good programs of a task."""

OTHERS = 11
"""Demonstrations of a task at most."""


class Household:
    """Implements `seams.Foreign`.

    Args:
        packages: folder in which the two packages were installed; where Python finds them by
            default.
        development: take the other tasks, on which things may be set, and not the reported ones.
        each: good programs of a task.
    """

    name = "virtualhome"
    hands: tuple[str, ...] = tuple(HANDS)
    geometry: tuple[str, ...] = ("obj_next_to",)
    exact = True

    def __init__(
        self, packages: Path | None = None, development: bool = False, each: int = EACH
    ) -> None:
        self._packages = Packages.found(packages)
        self._development, self._each = development, each
        self._runs: dict[str, ForeignRun] = {}
        self._kinds = Kinds()

    @cached_property
    def _programs(self) -> dict[str, list[Program]]:
        found: dict[str, list[Program]] = {}
        for program in self._packages.programs():
            found.setdefault(program.task, []).append(program)
        return found

    @property
    def tasks(self) -> tuple[str, ...]:
        """Those that are judged here."""
        if self._development:
            return tuple(sorted(t for t in self._programs if t not in REPORTED))
        return tuple(t for t in REPORTED if t in self._programs)

    @cached_property
    def good(self) -> tuple[ForeignRun, ...]:
        """Programs that the executor carries out."""
        found = []
        for task in self.tasks:
            able = (r for r in map(self._run, self._programs[task]) if r.fails is None)
            found += [r for r, _ in zip(able, range(self._each), strict=False)]
        return tuple(found)

    def failing(self) -> Iterator[ForeignRun]:
        """Good programs with one change each, where a step is then refused."""
        by_name = {p.name: p for several in self._programs.values() for p in several}
        for good in self.good:
            program, found = by_name[good.program], set[str]()
            for c in changes(program, read_start(program.graphs)):
                if c.sort in found:
                    continue
                run = carried_out(
                    self._packages,
                    c.program,
                    c.start,
                    about=c.about,
                    name=f"{program.name}: {c.sort}, {c.where}",
                    change=c.sort,
                )
                if run.fails is not None:
                    found.add(c.sort)
                    yield run

    def demonstrations(self, run: ForeignRun) -> tuple[ForeignRun, ...]:
        """Other programs of the run's task that the executor carries out."""
        found: list[ForeignRun] = []
        for program in self._programs[run.task]:
            if len(found) == OTHERS:
                break
            if program.name != run.program:
                other = self._run(program)
                found += [other] if other.fails is None else []
        return tuple(found)

    def domains(self) -> dict[str, Domain]:
        """The domain as its PDDL has it, and with what the executor does otherwise."""
        pddl, kinds = self._packages.pddl, self._all_kinds
        return {"its PDDL": as_published(pddl, kinds), "PDDL, corrected": corrected(pddl, kinds)}

    @cached_property
    def _all_kinds(self) -> Kinds:
        """Of every start that is judged or compared with."""
        for run in self.good:
            self.demonstrations(run)
        return self._kinds

    def _run(self, program: Program) -> ForeignRun:
        if program.name not in self._runs:
            start = read_start(program.graphs)
            self._kinds.see(start)
            self._runs[program.name] = carried_out(self._packages, program, start)
        return self._runs[program.name]
