"""`forestall cases`: what the experiments start from; counted, judged, drawn anew."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from forestall.cli.flags import Flag, Json, Names

Sets = Annotated[list[str] | None, Parameter(name="--set", consume_multiple=True, negative="")]

cases = App(name="cases", help="What the experiments start from.")


@cases.command(name="list")
def list_(*, of: Sets = None, kinds: Flag = False, as_json: Json = False) -> int:
    """Count the sets of cases: tasks, scenarios, kinds, rooms.

    Args:
        of: only these sets; all by default.
        kinds: a line for each kind of a set.
        as_json: print JSON instead of the table.
    """
    from forestall.cli.listing import print_table

    rows = _counts(_sets(of), kinds)
    if as_json:
        print(json.dumps(rows, indent=2))
        return 0
    print_table(
        ("set", "kind", "fails unwatched", "tasks", "starts", "compared", "first test seed"),
        [
            (
                *(str(r["set"]), str(r["kind"] or ""), "yes" if r["fails"] else "no"),
                *(str(r["tasks"]), str(r["starts"])),
                *("" if r["compared"] is None else str(r["compared"]), str(r["test"])),
            )
            for r in rows
        ],
    )
    return 0


@cases.command
def judge(
    *,
    of: Sets = None,
    split: str = "development",
    rounds: int | None = None,
    task: Names = None,
    world: str = "",
    jobs: int = 1,
    as_json: Json = False,
    quiet: Flag = False,
) -> int:
    """Play starts without a monitor and say whether they fail or succeed as their set says.

    Ends with 1 where one does not.

    Args:
        of: which sets; all further ones by default (see `forestall cases list`).
        split: "development" or "test".
        rounds: rooms for each start; as many as they were chosen in by default.
        task: only these tasks.
        world: "symbolic" for a first look without geometry; the domain's own by default.
        jobs: how many processes.
        as_json: print JSON instead of the table.
        quiet: no progress on standard error.
    """
    from forestall.cli.listing import print_table
    from forestall.cli.progress import bar
    from forestall.errors import InputError
    from forestall.experiments import starts
    from forestall.statistics.cases import FURTHER_SETS, ROUNDS
    from forestall.statistics.cases import cases as cases_of

    if jobs < 1:
        raise InputError(f"--jobs {jobs}: at least 1 is needed")
    wanted = [
        case
        for name in of or FURTHER_SETS
        for case in cases_of(name, split, ROUNDS if rounds is None else rounds)
        if task is None or case.task in task
    ]
    if not wanted:
        raise InputError("no start is of these sets and tasks")
    done = 0
    judged = []
    with bar("playing", quiet=quiet or as_json) as feed:

        def told(case: object) -> None:
            nonlocal done
            done += 1
            feed(done, len(wanted), getattr(case, "task", ""))

        judged = list(starts.judge(wanted, jobs, world, told))
    wrong = [j for j in judged if not j.as_said]
    counted: Counter[tuple[str, str]] = Counter()
    for one in judged:
        how = "could not be played" if one.played.problem else "as said" if one.as_said else "not"
        counted[one.case.set, how] += 1
    sets = list(dict.fromkeys(j.case.set for j in judged))
    if as_json:
        lines = [
            {
                **{"set": j.case.set, "task": j.case.task, "scenario": j.case.scenario},
                **{"seed": j.case.seed, "success": j.played.success, "as_said": j.as_said},
                "why": j.played.problem or list(j.played.failures),
            }
            for j in judged
        ]
        print(json.dumps(lines, indent=2))
        return 1 if wrong else 0
    columns = ("as said", "not", "could not be played")
    print_table(
        ("set", "played", *columns),
        [
            (of, str(sum(counted[of, c] for c in columns)), *(str(counted[of, c]) for c in columns))
            for of in sets
        ],
    )
    for one in wrong:
        why = one.played.problem or "; ".join(one.played.failures[:2]) or "it succeeds"
        print(f"{one.case.scenario or one.case.task}, seed {one.case.seed}: {why}")
    return 1 if wrong else 0


@cases.command
def draw(
    folder: Path, /, *, task: Names = None, seed: int = 0, jobs: int = 1, quiet: Flag = False
) -> int:
    """Draw the further sets anew and write their files: FOLDER/SET/TASK.toml.

    The same seed draws the same, with the same code. Takes a minute or more for each task.

    Args:
        folder: where they go; nothing in it is removed.
        task: only these tasks; all by default, the long ones too.
        seed: of everything that is drawn.
        jobs: how many processes.
        quiet: no progress on standard error.
    """
    from forestall.cli.progress import bar
    from forestall.errors import InputError
    from forestall.experiments import starts
    from forestall.tasks.files import load_task, long_task_names, task_names
    from forestall.tasks.writing import set_file

    if jobs < 1:
        raise InputError(f"--jobs {jobs}: at least 1 is needed")
    tasks = task or [*task_names(), *long_task_names()]
    for name in tasks:
        load_task(name)
    written = 0
    with bar("drawing", quiet=quiet) as feed:
        feed(0, len(tasks), tasks[0])
        for number, (name, drawn) in enumerate(starts.draw(tasks, seed, jobs), 1):
            for of, scenarios in drawn.scenarios.items():
                if not scenarios:
                    continue
                path = folder / of / f"{name}.toml"
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(set_file(name, scenarios), encoding="utf-8")
                written += len(scenarios)
            feed(number, len(tasks), name)
    print(f"{written} scenarios written to {folder}")
    return 0


def _sets(of: list[str] | None) -> list[str]:
    from forestall.errors import UnknownNameError
    from forestall.statistics.cases import CASE_SETS, FURTHER_SETS

    known = [*CASE_SETS, *FURTHER_SETS]
    for name in of or ():
        if name not in known:
            raise UnknownNameError("set of cases", name, known)
    return of or known


def _counts(sets: list[str], by_kind: bool) -> list[dict[str, object]]:
    from forestall.statistics.cases import FURTHER_SETS, FURTHER_SPLITS, SPLITS
    from forestall.statistics.cases import cases as cases_of
    from forestall.tasks.files import load_scenario

    rows: list[dict[str, object]] = []
    for of in sets:
        found = cases_of(of, "development")
        told = [None if c.scenario is None else load_scenario(c.scenario) for c in found]
        kinds: list[str | None] = []
        if by_kind:
            kinds += sorted({s.kind for s in told if s is not None})
        for kind in kinds or [None]:
            some = [
                (c, s)
                for c, s in zip(found, told, strict=True)
                if kind is None or (s is not None and s.kind == kind)
            ]
            known = [s.compared for _, s in some if s is not None and s.compared is not None]
            rows.append(
                {
                    **{"set": of, "kind": kind, "fails": any(c.failing for c, _ in some)},
                    "tasks": len({c.task for c, _ in some}),
                    "starts": len(some),
                    "compared": sum(known) if known else None,
                    "test": (FURTHER_SPLITS if of in FURTHER_SETS else SPLITS)["test"],
                }
            )
    return rows
