"""`forestall preconditions`: what is mined from a memory, and what a person says of it."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import App, Parameter

from forestall.cli.flags import Json, Names

if TYPE_CHECKING:
    from forestall.assembly.configuration import Given
    from forestall.assembly.mined import Remembered, Row, Shown


preconditions = App(
    name="preconditions", help="What is mined from demonstrations, and corrections by hand."
)


@preconditions.command(name="list")
def list_(
    memory: Path,
    /,
    *,
    task: str | None = None,
    skill: str | None = None,
    domain: str | None = None,
    expectations: Path | None = None,
    as_json: Json = False,
) -> int:
    """List what always held before each skill, and what a person or a model says must hold.

    Args:
        memory: a demonstration file.
        task: only what is mined for this task.
        skill: only what is mined before this skill.
        domain: what the memory is read in, by name or file; by default one that comes with the
            project and has its skills, else one that is learnt from it.
        expectations: a file of what a language model expects (--expectations.file of a run);
            MEMORY.expected.toml by default, where it is there.
        as_json: print JSON.
    """
    from forestall.assembly.expecting import beside, read_expected
    from forestall.assembly.mined import expected_rows, remembered, rows
    from forestall.cli.listing import print_table

    known = remembered(memory, given_domain(domain))
    file = expectations or beside(memory)
    said = read_expected(file, known.domain) if expectations or file.exists() else ()
    expected = expected_rows(known, said, task, skill)
    strange = expected and (
        (skill and skill not in known.skills) or (task and task not in known.tasks)
    )
    found = [*([] if strange else rows(known, task, skill)), *expected]
    tell_stale(known)
    if as_json:
        print(json.dumps({"domain": known.domain.name, "rows": _plain(found)}, indent=2))
        return 0
    print_table(
        ("skill", "fact", "demonstrations", "uses", "weight", "", "only for"),
        [
            (
                r.skill,
                str(r.fact),
                f"{r.support} of {r.demonstrations}",
                f"{r.held} of {r.uses}",
                f"{r.weight:.2f}",
                "" if r.origin == "mined" else f"{r.origin}{r.note and ': ' + r.note}",
                "; ".join((*r.kinds, *(f"task {t}" for t in r.tasks))),
            )
            for r in found
        ],
    )
    return 0


@preconditions.command
def show(
    memory: Path,
    subtask: str,
    /,
    *,
    task: str | None = None,
    domain: str | None = None,
    as_json: Json = False,
) -> int:
    """Show what is mined before one subtask, and in which demonstrations it held.

    Args:
        memory: a demonstration file.
        subtask: e.g. "insert(peg-1, hole-1)"; categories will do. Of a whole skill see `list`.
        task: at hand; that of the first demonstration with such a subtask by default.
        domain: see `list`.
        as_json: print JSON.
    """
    from forestall.assembly.mined import remembered, shown
    from forestall.assembly.plans import fitting
    from forestall.cli.listing import say
    from forestall.errors import InputError
    from forestall.types.plan import Subtask

    subtask = subtask.strip()
    known = remembered(memory, given_domain(domain))
    if subtask in known.skills:
        shown_as = next(
            s.subtask for d in known.demonstrations for s in d.steps if s.subtask.skill == subtask
        )
        raise InputError(
            f"{subtask} is a skill: give a subtask, as {shown_as}, or see all that is mined before "
            f"it with 'forestall preconditions list {memory} --skill {subtask}'"
        )
    wanted = fitting(Subtask.parse(subtask), known.domain)
    found = shown(known, wanted, task)
    tell_stale(known)
    if as_json:
        print(json.dumps([_shown_json(s) for s in found], indent=2))
        return 0
    for s in found:
        origin = "" if s.origin == "mined" else f" [{s.origin}{s.note and ': ' + s.note}]"
        say(f"{s.fact}{origin}")
        for what, several in (("held", s.held), ("not observed", s.unseen), ("not", s.broken)):
            if several:
                count = len({text.rpartition(", step")[0] for text in several})
                many = "demonstration" if count == 1 else "demonstrations"
                say(f"  {what} in {count} {many}: {'; '.join(several)}")
    if not found:
        say(f"nothing always held before {wanted}")
    return 0


@preconditions.command
def export(
    memory: Path,
    /,
    *,
    out: Path,
    to: Annotated[Literal["toml", "domain"], Parameter(name="--format")] = "toml",
    task: str | None = None,
    skill: str | None = None,
    domain: str | None = None,
) -> int:
    """Write what is mined, corrected, to a file.

    Args:
        memory: a demonstration file.
        out: the file to write.
        to: toml: a table for each fact; domain: a domain file whose skills need it.
        task: see `list`.
        skill: see `list`.
        domain: see `list`.
    """
    from forestall.assembly.mined import as_needs, remembered, rows
    from forestall.domain.toml_out import domain_toml
    from forestall.files import replace_file

    known = remembered(memory, given_domain(domain))
    found = rows(known, task, skill)
    tell_stale(known)
    if to == "toml":
        replace_file(out, _toml(found, known).encode("utf-8"))
        print(f"{out}: {len(found)} preconditions of {len({r.skill for r in found})} skills")
        return 0
    own, left = as_needs(known, found)
    said = "".join(f"# - {r.skill}: {r.fact}: {_why_left(r)}\n" for r in left)
    head = f"# {known.domain.name} with what was mined from {memory.name}."
    if left:
        head += f" Not among the needs:\n{said}"
    replace_file(out, f"{head}\n{domain_toml(own)}".encode())
    print(f"{out}: {len(found) - len(left)} facts are needs, {len(left)} are not (see its head)")
    return 0


@preconditions.command
def edit(
    memory: Path,
    /,
    *,
    drop: Names = None,
    add: Names = None,
    undo: Names = None,
    task: str = "",
    note: str = "",
    domain: str | None = None,
) -> int:
    """Correct by hand what is mined: a layer of its own, MEMORY.preconditions.toml.

    Recording and mining never change it, and it may be edited as a file. A correction is written
    "skill: fact(?parameter)", or "skill(Thing): fact(Thing)" for one kind of things only.

    Args:
        memory: a demonstration file.
        drop: what is not needed, though it always held: "insert: thread(?lid)=loose".
        add: what is needed, though it is not mined.
        undo: corrections to take back.
        task: of the corrections; all by default.
        note: why, for people.
        domain: see `list`.
    """
    from forestall.assembly.corrections import edited, said
    from forestall.assembly.mined import remembered
    from forestall.cli.listing import say
    from forestall.errors import InputError, UnknownNameError

    if not (drop or add or undo):
        raise InputError("nothing to correct: give --drop, --add or --undo 'skill: fact'")
    known = remembered(memory, given_domain(domain))
    if task and task not in known.tasks:
        raise UnknownNameError(f"task of {memory}", task, known.tasks)

    def read(texts: Iterable[str] | None, *, adds: bool) -> list[Any]:
        own = known.domain
        return [said(t, adds=adds, domain=own, task=task, note=note) for t in texts or ()]

    new = [*read(drop, adds=False), *read(add, adds=True)]
    written = edited(memory, new, read(undo, adds=False), known.domain)
    say(f"{written.source}: {len(written.each)} corrections")
    tell_stale(remembered(memory, given_domain(domain)))
    return 0


def given_domain(domain: str | None) -> Given:
    """What was said of the domain."""
    from forestall.assembly.configuration import Given

    return Given.named({"domain": domain})


def tell_stale(known: Remembered) -> None:
    """Say on standard error which corrections change nothing any more."""
    from forestall.assembly.mined import stale_in
    from forestall.reading.printing import printable

    for correction, why in stale_in(known):
        place = f"{correction.place}: " if correction.place else ""
        text = f"forestall: {known.corrections.source}: {place}{correction}: {why}"
        print(printable(text), file=sys.stderr)


def _plain(found: Iterable[Row]) -> list[dict[str, Any]]:
    return [{**asdict(r), "fact": str(r.fact)} for r in found]


def _shown_json(s: Shown) -> dict[str, Any]:
    p = s.precondition
    return {
        "fact": str(s.fact),
        "lifted": str(p.literal),
        "support": p.support,
        "demonstrations": p.total,
        "weight": p.weight,
        "origin": s.origin,
        "note": s.note,
        "held": list(s.held),
        "unseen": list(s.unseen),
        "broken": list(s.broken),
    }


def _toml(found: Sequence[Row], known: Remembered) -> str:
    count = len(known.demonstrations)
    head = f"# What is mined from {known.path.name}, corrected: {count} demonstrations"
    text = [f"{head}, domain {known.domain.name}.\n"]
    for r in found:
        values: dict[str, Any] = {
            "skill": r.skill,
            "fact": str(r.fact),
            "support": r.support,
            "demonstrations": r.demonstrations,
            "held": r.held,
            "uses": r.uses,
            "weight": round(r.weight, 4),
            "origin": r.origin,
            **({"kinds": r.kinds} if r.kinds else {}),
            **({"tasks": r.tasks} if r.tasks else {}),
            **({"note": r.note} if r.note else {}),
        }
        lines = (f"{k} = {json.dumps(v, ensure_ascii=False)}\n" for k, v in values.items())
        text.append(f"[[precondition]]\n{''.join(lines)}")
    return "\n".join(text)


def _why_left(row: Row) -> str:
    if row.origin == "left out by hand":
        return row.origin
    if row.kinds or row.tasks:
        return f"only for {'; '.join((*row.kinds, *(f'task {t}' for t in row.tasks)))}"
    return "it is about what is no argument"
