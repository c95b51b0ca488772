"""`forestall tasks`, `forestall tasks check` and `forestall scenarios`."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from forestall.cli.flags import Json

Schema = Annotated[bool, Parameter(name="--schema", negative="")]


tasks = App(name="tasks", help="List the shipped tasks; check a file of your own.")


@tasks.default
def list_tasks(*, as_json: Json = False, schema: Schema = False) -> int:
    """List the shipped tasks.

    Args:
        as_json: print them as JSON, complete.
        schema: print the JSON schema of task files instead.
    """
    from forestall.tasks.files import load_task, long_task_names, schemas, task_names

    if schema:
        print(json.dumps(schemas()["task"], indent=2))
        return 0
    names = (*task_names(None), *long_task_names(None))
    loaded = [load_task(name).task for name in names]
    if as_json:
        rows = [
            {
                "name": t.name,
                "title": t.title,
                "goal": t.goal.text,
                "literals": [str(x) for x in t.goal.literals],
                "never": [str(x) for x in t.goal.never],
                "plan": t.plan.texts(),
                "room": t.scene.room,
            }
            for t in loaded
        ]
        print(json.dumps(rows, indent=2))
        return 0
    print_table(
        ("task", "goal", "steps"), [(t.name, t.goal.text, str(len(t.plan))) for t in loaded]
    )
    return 0


@tasks.command
def check(
    file: Path,
    /,
    *,
    task: str | None = None,
    domain: str | None = None,
    as_json: Json = False,
) -> int:
    """Say everything that is wrong with a task or scenario file, with what would be valid.

    Exit code 0: nothing is; 1: something is; 2: there is no such file.

    Args:
        file: a task file, a scenario file, or one with several scenarios (docs/task-format.md).
        task: of a scenario: a name or a file; the one that it names by default.
        domain: what a task is read in, by name or file; the one that it names by default.
        as_json: print JSON.
    """
    from forestall.domain.load import load_domain
    from forestall.tasks.checking import check_file

    checked = check_file(file, task, None if domain is None else load_domain(domain))
    if as_json:
        print(json.dumps({"kind": checked.kind, "faults": checked.faults}, indent=2))
        return 1 if checked.faults else 0
    for fault in checked.faults:
        say(f"{file}: {fault}")
    count = len(checked.faults)
    say(f"{count} {'fault' if count == 1 else 'faults'}" if count else f"ok: a {checked.kind}")
    return 1 if count else 0


def scenarios(
    *,
    task: str | None = None,
    of: Annotated[str, Parameter(name="--set")] = "examples",
    as_json: Json = False,
    schema: Schema = False,
) -> int:
    """List the shipped scenarios.

    Args:
        task: only those of one task.
        of: which set, or all: examples (by default), robofail, irreversible, harmless, everyday,
            composed, midrun, double, planner, planner-harmless, eyes, hidden, long.
        as_json: print them as JSON, complete.
        schema: print the JSON schema of scenario files instead.
    """
    from forestall.tasks.files import load_scenario, load_task, scenario_names, schemas

    if schema:
        print(json.dumps(schemas()["scenario"], indent=2))
        return 0
    if task is not None:
        load_task(task)
    names = scenario_names(None if of == "all" else of, None)
    loaded = [s for s in map(load_scenario, names) if task in (None, s.task)]
    if as_json:
        rows = [
            {
                "name": s.name,
                "task": s.task,
                "kind": s.kind,
                "title": s.title,
                "cause": s.cause,
                "set": s.set,
                "source": s.source,
                "known": s.known,
                "effect": s.effect,
                "compared": s.compared,
                "faults": [f.model_dump(mode="json", exclude_defaults=False) for f in s.faults],
            }
            for s in loaded
        ]
        print(json.dumps(rows, indent=2))
        return 0
    print_table(
        ("scenario", "task", "kind", "what goes wrong"),
        [(s.name, s.task, s.kind, s.cause) for s in loaded],
    )
    return 0


def say(text: object) -> None:
    """Print what may hold names from files: nothing in it steers the terminal."""
    from forestall.reading.printing import printable

    print(printable(str(text)))


def warn(text: object) -> None:
    """Like `say`, on standard error."""
    from forestall.reading.printing import printable

    print(printable(str(text)), file=sys.stderr)


def print_table(header: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    """Print a plain table with rich."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from forestall.reading.printing import printable

    table = Table(box=None, pad_edge=False)
    for number, name in enumerate(header):
        short = all(len(row[number]) <= 16 for row in rows)
        table.add_column(name, no_wrap=short, style="bold" if number == 0 else None)
    for row in rows:
        table.add_row(*(Text(printable(cell)) for cell in row))
    console = Console()
    if not console.is_terminal:
        console.width = 240
    console.print(table)
