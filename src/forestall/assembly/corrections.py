"""Corrections by hand of mined preconditions: the file beside a memory, read, checked and written.

Called by the factories of detector and reasoner, by runs and checks for their record, and by the
command line. Recording and mining never write here.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from forestall.assembly.configuration import Choice
from forestall.comparison.corrections import Correction, Corrections
from forestall.domain.checks import check_literal
from forestall.domain.model import Domain
from forestall.domain.schema import Need, Skill
from forestall.errors import FileFormatError, InputError, UnknownNameError
from forestall.files import replace_file
from forestall.kinds import DETECTOR, REASONER, STORE
from forestall.reading.documents import read_toml
from forestall.reading.fields import Field
from forestall.seams.running import Parts
from forestall.types.facts import Literal, category_of
from forestall.types.plan import Subtask

ENDING = ".preconditions.toml"
OPTION = "corrections"
MEMORIES = "memories"
"""What a monitor lends: the memory files that its demonstrations come from."""

TABLES = ("drop", "add")
KEYS = ("before", "fact", "task", "note")

_HEAD = """\
# Corrections by hand of what is mined from {memory}: they stand over it, and nothing but
# 'forestall preconditions edit' and you write here.
"""


def beside(memory: str | Path) -> Path:
    """Where the corrections of a memory are."""
    return Path(f"{memory}{ENDING}")


def corrections_of(parts: Parts, said: str | None) -> Corrections | None:
    """The corrections of a run: those of a file that was named, else those beside its memories.

    Raises:
        FileFormatError: see `read_corrections`.
    """
    if said is not None:
        return read_corrections(Path(said), parts.domain)
    memory = parts.options(STORE).get("path")
    try:
        others: tuple[Path, ...] = parts.lent(MEMORIES)
    except InputError:  # a run has one memory, which its store names
        others = ()
    return beside_all((*others, *(() if memory is None else (memory,))), parts.domain)


def beside_all(memories: Iterable[str | Path], domain: Domain) -> Corrections | None:
    """The corrections beside memories together; None where there are none.

    What is left out comes before what is added, so that a need which anybody adds stands.

    Raises:
        FileFormatError: see `read_corrections`.
    """
    files = dict.fromkeys(beside(m) for m in memories)
    found = [read_corrections(file, domain) for file in files if file.is_file()]
    if not found:
        return None
    each = sorted((c for one in found for c in one.each), key=lambda c: c.adds)
    return Corrections(", ".join(one.source for one in found), tuple(each))


def of_no_task(corrections: Corrections | None, tasks: Iterable[str]) -> list[str]:
    """A sentence for each correction for a task that no demonstration is of."""
    if corrections is None:
        return []
    known = sorted({t for t in tasks if t})
    return [
        f"{corrections.source}: '{c}' counts in no task that is demonstrated: "
        f"{UnknownNameError('task', c.task, known)}"
        for c in corrections.each
        if c.task and c.task not in known
    ]


def remembering(choices: Sequence[Choice], memory: str | None) -> tuple[Choice, ...]:
    """Choices whose store names the memory that is used, where nobody named one."""
    return tuple(
        replace(c, given=tuple(sorted((*c.given, ("path", memory)))))
        if c.kind == STORE.name and memory is not None and c.options.get("path") is None
        else c
        for c in choices
    )


def described(choices: Iterable[Choice], memory: str | None) -> list[dict[str, Any]]:
    """Which corrections detector and reasoner of a run read, for its record."""
    named = [c.options.get(OPTION) for c in choices if c.kind in (DETECTOR.name, REASONER.name)]
    default = None if memory is None or not beside(memory).is_file() else str(beside(memory))
    found = dict.fromkeys(str(path) for path in (*named, default) if path is not None)
    digests = {p: hashlib.blake2b(Path(p).read_bytes(), digest_size=8).hexdigest() for p in found}
    return [{"file": path, "digest": digest} for path, digest in digests.items()]


def read_corrections(path: Path, domain: Domain) -> Corrections:
    """A file of corrections.

    Raises:
        FileFormatError: it cannot be read, or says what means nothing in the domain; with the
            table and the key, and the nearest name.
    """
    data = read_toml(path, "file of corrections")
    found: list[Correction] = []
    try:
        for key in data:
            if key not in TABLES:
                raise UnknownNameError("table of corrections", key, TABLES)
        for name in TABLES:
            for entry in Field(data.get(name, []), name).items():
                found.append(_read(entry, name == "add", domain))
    except InputError as error:
        raise FileFormatError(f"{path}: {error}") from error
    return Corrections(str(path), tuple(found))


def said(text: str, *, adds: bool, domain: Domain, task: str = "", note: str = "") -> Correction:
    """A correction as somebody says it: "put_in: vacant(?place)", "put_in(Plate, Oven): ...".

    Args:
        text: before which skill, or before which subtask, and the fact; over the skill's
            parameters, or over the subtask's arguments.
        adds: whether the fact is needed; else it is left out.
        domain: whose skills and facts they are.
        task: in which.
        note: why.

    Raises:
        InputError: it cannot be read, or means nothing in the domain.
    """
    before, colon, fact = text.partition(":")
    if not colon:
        raise InputError(
            f"{text!r}: write 'skill: fact(?parameter)' or 'skill(Thing): fact(Thing)'"
        )
    return _correction(before.strip(), fact.strip(), adds, domain, task, note)


def written(corrections: Iterable[Correction], memory: str | Path) -> str:
    """The text of a file of corrections."""
    text = [_HEAD.format(memory=Path(memory).name)]
    for c in corrections:
        before = str(Subtask(c.skill, c.args)) if c.args else c.skill
        pairs = {"before": before, "fact": str(c.fact), "task": c.task, "note": c.note}
        lines = [f"{k} = {json.dumps(v, ensure_ascii=False)}" for k, v in pairs.items() if v]
        text.append("\n".join((f"[[{'add' if c.adds else 'drop'}]]", *lines, "")))
    return "\n".join(text)


def edited(
    memory: str | Path, new: Sequence[Correction], gone: Sequence[Correction], domain: Domain
) -> Corrections:
    """Write corrections beside a memory: the old ones with others added and taken back.

    What a new one says of the same fact replaces what an old one says.

    Raises:
        InputError: one that is to be taken back is not there.
    """
    path = beside(memory)
    old = read_corrections(path, domain).each if path.exists() else ()
    for correction in gone:
        if not any(_same(c, correction) for c in old):
            known = [str(c) for c in old]
            raise UnknownNameError(f"correction in {path}", str(correction), known)
    kept = [c for c in old if not any(_same(c, other) for other in (*new, *gone))]
    each = (*kept, *new)
    replace_file(path, written(each, memory).encode("utf-8"))
    return read_corrections(path, domain)


def needing(domain: Domain, corrections: Corrections) -> Domain:
    """A domain whose skills need what was added and do not need what was left out.

    Corrections for one kind of things or one task alone are no needs of a skill.
    """
    skills = dict(domain.skills)
    for c in corrections.each:
        plain = all(a.startswith("?") or a in domain.robot.hands for a in c.fact.args)
        if c.args or c.task or not plain:
            continue
        own = skills[c.skill]
        kept = tuple(n for n in own.needs if n.formula != c.fact)
        added = (need_by_hand(c.fact, c.note, own),) if c.adds else ()
        skills[c.skill] = replace(own, needs=(*kept, *added))
    return replace(domain, skills=skills)


def need_by_hand(fact: Literal, note: str, skill: Skill, said: str = "a person says so") -> Need:
    """A fact as a need of a skill, with who says so."""
    text = str(fact)
    for parameter in skill.parameters:
        text = re.sub(rf"{re.escape(parameter.name)}(?!\w)", f"{{{parameter.name[1:]}}}", text)
    why = f"{said}: {note}" if note else said
    return Need(fact, f"{text} does not hold ({why.replace('{', '').replace('}', '')})", (fact,))


def _same(one: Correction, other: Correction) -> bool:
    """Whether two speak of the same fact."""
    return (one.skill, one.fact, one.args, one.task) == (
        other.skill, other.fact, other.args, other.task,
    )  # fmt: skip


def _read(entry: Field, adds: bool, domain: Domain) -> Correction:
    if isinstance(entry.value, Mapping):
        for key in entry.value:
            if key not in KEYS:
                raise InputError(f"{entry.place}: {UnknownNameError('key', str(key), KEYS)}")
    before, fact = entry["before"].text(), entry["fact"].text()
    task = entry.optional("task", Field.text) or ""
    note = entry.optional("note", Field.text) or ""
    correction = _correction(before, fact, adds, domain, task, note, entry.place)
    return correction


def _correction(
    before: str, fact: str, adds: bool, domain: Domain, task: str, note: str, place: str = ""
) -> Correction:
    def at(key: str) -> str:
        return f"{place}.{key}: " if place else ""

    try:
        subtask = Subtask.parse(before) if "(" in before else None
        skill = domain.skill(before if subtask is None else subtask.skill)
        if subtask is not None:
            domain.check(subtask)
            for name in subtask.args:
                domain[name]
    except InputError as error:
        raise InputError(f"{at('before')}{error}") from error
    try:
        literal = Literal.parse(fact)
        if subtask is not None:
            literal = _lifted(literal, subtask, domain)
        check_literal(domain, f"{skill.name}", literal)
        parameters = [p.name for p in skill.parameters]
        for name in literal.args:
            if name.startswith("?") and name not in parameters:
                raise UnknownNameError(f"parameter of {skill.name}", name, parameters)
            if not name.startswith("?") and name not in domain.robot.hands:
                domain[name]
    except InputError as error:
        raise InputError(f"{at('fact')}{error}") from error
    kinds = () if subtask is None else subtask.args
    args = tuple(category_of(domain.canonical(a)) for a in kinds)
    return Correction(adds, skill.name, literal, args, task, note, place)


def _lifted(fact: Literal, subtask: Subtask, domain: Domain) -> Literal:
    """A fact over a subtask's arguments as one over its skill's parameters."""
    names: dict[str, str] = {}
    for parameter, name in domain.bound(subtask).items():
        if name in fact.args and name in names:
            raise InputError(
                f"{fact}: {name} is {names[name]} and {parameter} of {subtask}: name the parameter"
            )
        names[name] = parameter
    return fact.bind(names)
