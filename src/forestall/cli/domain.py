"""`forestall domain`: list, show, check and export what a robot's world is described by."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import App, Parameter

from forestall.cli.flags import Flag, Json
from forestall.cli.listing import say

if TYPE_CHECKING:
    from forestall.assembly.weighing import Weights
    from forestall.domain.model import Domain


domain = App(name="domain", help="List, show, check, distort and export domains.")


@domain.command(name="list")
def list_(*, as_json: Json = False) -> int:
    """List the domains that come with the project.

    Args:
        as_json: print them as JSON.
    """
    from forestall.cli.listing import print_table
    from forestall.domain.load import shipped, shipped_names

    rows = [{"name": n, **_counts(shipped(n))} for n in shipped_names()]
    if as_json:
        print(json.dumps(rows, indent=2))
        return 0
    header = ("domain", *(k.replace("_", " ") for k in rows[0] if k != "name")) if rows else ()
    print_table(header, [tuple(str(v) for v in row.values()) for row in rows])
    return 0


@domain.command
def show(name: str, /) -> int:
    """Say what is in a domain: its categories, what can be said of things, and its skills.

    Args:
        name: of a domain that comes with the project, or a TOML or PDDL file.
    """
    from forestall.domain.load import load_domain
    from forestall.domain.sheet import skill_sheet

    found = load_domain(name)
    say(f"{found.name}: {_sentence(found)}\n")
    say("categories:")
    for category in found.categories.values():
        tags = f": {', '.join(sorted(category.tags))}" if category.tags else ""
        say(f"  {category.name}{tags}")
    say("\npredicates:")
    for predicate in found.predicates.values():
        values = f" = {' | '.join(predicate.values)}" if predicate.values else ""
        several = ", ".join(map(str, predicate.parameters))
        say(f"  {predicate.kind.value:<10}{predicate.name}({several}){values}")
    say(f"\nskills:\n\n{skill_sheet(found)}".rstrip("\n"))
    return 0


@domain.command
def learn(*sources: Path, out: Path | None = None, name: str = "learnt", least: float = 0.0) -> int:
    """Draft a domain file from demonstrations alone, to be corrected by hand.

    It begins with what each need weighs: how likely it is one, and no habit of who demonstrated.

    Args:
        sources: memory files, folders of runs, demonstrations that somebody wrote (JSON).
        out: the file to write; printed by default.
        name: of the domain.
        least: leave out needs that weigh less, 0 to 1; what never varied weighs less than 0.8.
    """
    from forestall.assembly.sources import demonstrations_from
    from forestall.assembly.weighing import likely, weights
    from forestall.domain.toml_out import domain_toml
    from forestall.errors import InputError
    from forestall.learning.learn import learn as learnt_from

    if not sources:
        raise InputError("no source was named: give a memory file, or a folder of demonstrations")
    if not 0 <= least <= 1:
        raise InputError(f"--least {least}: a weight is between 0 and 1")
    shown = demonstrations_from(sources)
    learnt = learnt_from(shown, name=name)
    weighed = weights(learnt.domain, shown)
    found = likely(learnt.domain, weighed, least)
    said = "".join(f"# - {limit}\n" for limit in learnt.limits)
    text = (
        f"# Learnt from {learnt.demonstrations} demonstrations; read and correct it. "
        f"What is not known:\n{said}{_weighed(learnt.domain, weighed, least)}\n{domain_toml(found)}"
    )
    if out is None:
        print(text, end="")
        return 0
    out.write_text(text, encoding="utf-8")
    print(f"{out}: {_sentence(found)}")
    return 0


def _weighed(learnt: Domain, weighed: Weights, least: float) -> str:
    """A comment: the needs of each skill with their weights, those that were left out last."""
    lines = ["# What a need weighs is how likely it is one, and no habit of who demonstrated:\n"]
    for skill in learnt.skills.values():
        told = {str(fact): weight for fact, weight in weighed[skill.name].items()}
        of = {fact: told.get(fact, 0.0) for fact in (str(n.formula) for n in skill.needs)}
        for formula, weight in sorted(of.items(), key=lambda x: (-x[1], x[0])):
            left = "  (left out)" if weight < least else ""
            lines.append(f"# {skill.name:<20} {weight:.2f}  {formula}{left}\n")
    return "".join(lines)


@domain.command
def distort(
    name: str,
    /,
    *,
    kind: Literal["exact", "coarse", "wrong"] = "wrong",
    seed: int = 0,
    share: float = 0.1,
    out: Path | None = None,
) -> int:
    """Make a domain that says less than another one, or something wrong, to judge with.

    Args:
        name: of a domain that comes with the project, or a TOML or PDDL file.
        kind: exact: as it is; coarse: what plain operators can say; wrong: some of its skills and
            processes say one thing wrong each.
        seed: of what is wrong.
        share: which part of the skills and processes is wrong; at least one is.
        out: the file to write; printed by default.
    """
    from forestall.domain.distort import distorted
    from forestall.domain.load import load_domain
    from forestall.domain.toml_out import domain_toml

    found = distorted(load_domain(name), kind, seed, share)
    changes = "".join(f"# - {c}\n" for c in found.changes)
    what = f"seed {seed}" if kind == "wrong" else f"{len(found.changes)} changes"
    text = f"# {name}, {kind} ({what}):\n{changes}\n{domain_toml(found.domain)}"
    if out is None:
        print(text, end="")
        return 0
    out.write_text(text, encoding="utf-8")
    print("\n".join((f"{out}: {_sentence(found.domain)}", *(f"  {c}" for c in found.changes))))
    return 0


@domain.command
def check(file: str, /) -> int:
    """Check a domain file: one line, "ok: ..." or what is wrong and where.

    Args:
        file: a TOML or PDDL file, or the name of a domain that comes with the project.
    """
    from forestall.domain.load import load_domain

    found = load_domain(file)
    say(f"ok: {found.name}: {_sentence(found)}")
    return 0


@domain.command
def export(
    name: str,
    /,
    *,
    to: Annotated[Literal["toml", "pddl", "words", "schema"], Parameter(name="--format")],
    without_processes: Flag = False,
    without_makers: Flag = False,
) -> int:
    """Print a domain in another form.

    Args:
        name: of a domain that comes with the project, or a TOML or PDDL file.
        to: toml: a domain file; pddl: a PDDL domain; words: the skill sheet; schema: the JSON
            schema of domain files.
        without_processes: leave what happens by itself out of the PDDL, which cannot say it.
        without_makers: leave skills that make things or take them away out of the PDDL.
    """
    from forestall.domain.load import load_domain

    found = load_domain(name)
    if to == "toml":
        from forestall.domain.toml_out import domain_toml

        text = domain_toml(found)
    elif to == "pddl":
        from forestall.domain.pddl_out import domain_pddl

        text = domain_pddl(
            found, without_processes=without_processes, without_makers=without_makers
        ).text
    elif to == "words":
        from forestall.domain.sheet import skill_sheet

        text = skill_sheet(found)
    else:
        from forestall.domain.json_schema import domain_schema

        text = json.dumps(domain_schema(), indent=2) + "\n"
    say(text.rstrip("\n"))
    return 0


def _counts(found: Domain) -> dict[str, int]:
    return {
        "categories": len(found.categories),
        "predicates": len(found.predicates),
        "skills": len(found.skills),
        "processes": len(found.processes),
        "safety_rules": len(found.safety),
    }


def _sentence(found: Domain) -> str:
    return ", ".join(f"{n} {k.replace('_', ' ')}" for k, n in _counts(found).items())
