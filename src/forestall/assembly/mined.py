"""What is mined from a memory, with the corrections over it, as tables for people.

Called by `forestall preconditions` and by runs that tell of stale corrections; calls the mining.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from forestall.assembly.configuration import Given, domain_of
from forestall.assembly.corrections import beside, need_by_hand, read_corrections
from forestall.assembly.eyes import eyes_for
from forestall.assembly.own_domain import domain_of_demonstrations, fits
from forestall.assembly.sources import scoped
from forestall.comparison.corrections import Correction, Corrections, stale
from forestall.comparison.expectations import WEIGHT, Expected
from forestall.comparison.lifting import evaluate
from forestall.comparison.needs import needs_of
from forestall.comparison.preconditions import needed
from forestall.domain.formula import show
from forestall.domain.model import Domain
from forestall.domain.schema import Skill
from forestall.errors import UnknownNameError
from forestall.kinds import DOMAIN
from forestall.memory.store import open_store
from forestall.types.demonstration import Demonstration
from forestall.types.facts import Literal, Truth, category_of
from forestall.types.plan import Subtask
from forestall.types.verdict import Precondition, Reference

MINED, ADDED, DROPPED = "mined", "added by hand", "left out by hand"
EXPECTED = "expected by a language model"


@dataclass(frozen=True, slots=True)
class Remembered:
    """A memory as it is mined.

    Args:
        path: of its file.
        demonstrations: cut to what concerns each subtask.
        domain: that they are read in.
        corrections: that stand beside it.
    """

    path: Path
    demonstrations: tuple[Demonstration, ...]
    domain: Domain
    corrections: Corrections

    @property
    def tasks(self) -> tuple[str, ...]:
        """The tasks that were shown."""
        return tuple(sorted({d.task for d in self.demonstrations}))

    @property
    def skills(self) -> tuple[str, ...]:
        """The skills that were shown."""
        return tuple(sorted({s.subtask.skill for d in self.demonstrations for s in d.steps}))


@dataclass(frozen=True, slots=True)
class Group:
    """What is mined for one subtask, its arguments categories, of one task.

    Args:
        subtask: its arguments' categories.
        task: the task at hand.
        uses: every demonstrated use of the skill on these kinds, those of the task first.
        mined: before the corrections.
        valid: after them.
    """

    subtask: Subtask
    task: str
    uses: tuple[Reference, ...]
    mined: tuple[Precondition, ...]
    valid: tuple[Precondition, ...]


@dataclass(frozen=True, slots=True)
class Row:
    """One lifted fact of a skill, over every group for which it is mined.

    Args:
        skill: before which.
        fact: over its parameters.
        support: demonstrations in which it held before a use.
        demonstrations: that are counted.
        held: uses before which it held.
        uses: that are counted.
        weight: the largest that it has for a group.
        origin: mined, added or left out by hand, or expected by a language model: then no
            demonstration is counted.
        kinds: the subtasks for which it is mined; () where for all of the skill that were shown.
        tasks: likewise.
        note: of the correction.
    """

    skill: str
    fact: Literal
    support: int
    demonstrations: int
    held: int
    uses: int
    weight: float
    origin: str = MINED
    kinds: tuple[str, ...] = ()
    tasks: tuple[str, ...] = ()
    note: str = ""


@dataclass(frozen=True, slots=True)
class Shown:
    """One fact before a ground subtask, and which demonstrations say so.

    Args:
        fact: over the subtask's arguments.
        precondition: as it is mined or said.
        origin: mined, added or left out by hand.
        held: ids of the demonstrations in which it held, with the number of the step, from 1.
        unseen: of those in which it was not observed.
        broken: of those in which it did not hold.
        note: of the correction.
    """

    fact: Literal
    precondition: Precondition
    origin: str
    held: tuple[str, ...]
    unseen: tuple[str, ...]
    broken: tuple[str, ...]
    note: str = ""


def remembered(memory: Path, given: Given | None = None) -> Remembered:
    """Open a memory with the corrections beside it.

    Args:
        memory: its file.
        given: what was said of the domain; by default a shipped one that fits, else a learnt one.

    Raises:
        MemoryFileError: see `memory.store`.
        InputError: the corrections or the domain are not valid, or do not fit the memory.
    """
    with open_store(memory) as store:
        found = store.required()
    given = given or Given()
    if DOMAIN.name in given.kinds():
        own, learnt = domain_of(given.chosen(DOMAIN.name)), False
        strange = next((d for d in found if not fits(d, own)), None)
        if strange is not None:
            for step in strange.steps:
                own.check(step.subtask)
    else:
        said = domain_of_demonstrations(found, str(memory))
        own, learnt = said.domain, said.learnt
    cut = tuple(found) if learnt else tuple(scoped(found, eyes_for(given, own).scope))
    path = beside(memory)
    corrections = read_corrections(path, own) if path.exists() else Corrections(str(path), ())
    return Remembered(memory, cut, own, corrections)


def groups(known: Remembered, task: str | None = None, skill: str | None = None) -> list[Group]:
    """What is mined, for every kind of subtask of every task.

    Raises:
        UnknownNameError: the memory has no such task or skill.
    """
    if task is not None and task not in known.tasks:
        raise UnknownNameError(f"task of {known.path}", task, known.tasks)
    if skill is not None and skill not in known.skills:
        raise UnknownNameError(f"skill of {known.path}", skill, known.skills)
    found: dict[Subtask, list[Reference]] = {}
    for use in _uses(known.demonstrations):
        found.setdefault(_kind(use.subtask, known.domain), []).append(use)
    return [
        _group(known, subtask, own, uses)
        for subtask, uses in sorted(found.items())
        if skill in (None, subtask.skill)
        for own in sorted({u.task for u in uses})
        if task in (None, own)
    ]


def rows(known: Remembered, task: str | None = None, skill: str | None = None) -> list[Row]:
    """Every fact that is mined or said, lifted, skill by skill.

    Raises:
        UnknownNameError: the memory has no such task or skill.
    """
    found = groups(known, task, skill)
    kinds: dict[str, set[Subtask]] = {}
    by_fact: dict[tuple[str, Literal, str], list[tuple[Group, Precondition]]] = {}
    for group in found:
        kinds.setdefault(group.subtask.skill, set()).add(group.subtask)
        for p, origin in _with_origin(group):
            key = (group.subtask.skill, p.literal, origin)
            by_fact.setdefault(key, []).append((group, p))
    return sorted(
        (_row(key, cases, kinds[key[0]], known) for key, cases in by_fact.items()),
        key=lambda r: (r.skill, r.origin == DROPPED, -r.weight, -r.held, r.fact),
    )


def expected_rows(
    known: Remembered,
    said: Iterable[Expected],
    task: str | None = None,
    skill: str | None = None,
) -> list[Row]:
    """What a language model expects, a row for each fact; it is no part of what is mined.

    Where a demonstration shows such a subtask the model has no say, and the note says so.
    """
    demonstrated = {_kind(u.subtask, known.domain) for u in _uses(known.demonstrations)}
    found = []
    for e in said:
        if skill not in (None, e.skill) or task not in (None, e.task):
            continue
        subtask = Subtask(e.skill, e.args)
        silent = "no say, since a demonstration shows it; " if subtask in demonstrated else ""
        note = f"{silent}{e.model}" + (f": {e.why}" if e.why else "")
        only = (str(subtask),), (e.task,)
        found += [Row(e.skill, f, 0, 0, 0, 0, WEIGHT, EXPECTED, *only, note) for f in e.facts]
    return found


def shown(known: Remembered, subtask: Subtask, task: str | None = None) -> list[Shown]:
    """What is mined or said before one subtask, ground.

    Args:
        known: the memory.
        subtask: its arguments categories or instances.
        task: at hand; that of the first demonstration with such a subtask by default.

    Raises:
        InputError: no such skill or task in the memory.
    """
    if subtask.skill not in known.skills:
        raise UnknownNameError(f"skill of {known.path}", subtask.skill, known.skills)
    if task is not None and task not in known.tasks:
        raise UnknownNameError(f"task of {known.path}", task, known.tasks)
    wanted, domain = _kind(known.domain.check(subtask), known.domain), known.domain
    same = [u for u in _uses(known.demonstrations) if u.subtask.skill == subtask.skill]
    uses = [u for u in same if _kind(u.subtask, domain) == wanted]
    if not uses:
        shown_kinds = {str(_kind(u.subtask, domain)) for u in same}
        raise UnknownNameError(f"subtask of {known.path}", str(wanted), shown_kinds)
    group = _group(known, wanted, task or uses[0].task, uses)
    return [_shown(p, origin, group, subtask, known) for p, origin in _with_origin(group)]


def stale_in(known: Remembered) -> tuple[tuple[Correction, str], ...]:
    """Corrections that change nothing any more, and why."""
    mined = [(g.subtask, g.task, g.mined) for g in groups(known)]
    return stale(known.corrections.each, mined, known.domain)


def as_needs(known: Remembered, found: Iterable[Row]) -> tuple[Domain, list[Row]]:
    """The domain with what is mined among the needs of its skills, and what could not become one.

    A need speaks of the skill's parameters alone, and holds for all kinds of things that were
    shown; what a skill needs already is not said twice.
    """
    skills, left = dict(known.domain.skills), []
    for row in found:
        own = skills[row.skill]
        plain = all(a.startswith("?") or a in known.domain.robot.hands for a in row.fact.args)
        if row.origin == DROPPED or not plain or row.kinds or row.tasks:
            left.append(row)
        elif show(row.fact) not in {show(n.formula) for n in own.needs}:
            skills[row.skill] = _needing(own, row)
    return replace(known.domain, skills=skills), left


def _needing(skill: Skill, row: Row) -> Skill:
    held = f"it held in {row.support} of {row.demonstrations} demonstrations"
    said = {"said": held} if row.origin == MINED else {}
    return replace(skill, needs=(*skill.needs, need_by_hand(row.fact, row.note, skill, **said)))


def _uses(demonstrations: Sequence[Demonstration]) -> Iterator[Reference]:
    for d in demonstrations:
        for s in d.steps:
            yield Reference(d.id, d.task, s.index, s.subtask, 1.0, s.graph)


def _kind(subtask: Subtask, domain: Domain) -> Subtask:
    return Subtask(subtask.skill, tuple(category_of(domain.canonical(a)) for a in subtask.args))


def _group(known: Remembered, subtask: Subtask, task: str, uses: Sequence[Reference]) -> Group:
    ordered = sorted(uses, key=lambda u: u.task != task)
    step = next((u.index for u in ordered if u.task == task), None)
    counts = needs_of(known.demonstrations, known.domain)
    mined = needed(counts, ordered[0].subtask, task, step)
    valid = known.corrections.over(mined, subtask, task, known.domain)
    return Group(subtask, task, tuple(ordered), mined, valid)


def _with_origin(group: Group) -> list[tuple[Precondition, str]]:
    kept = {p.literal for p in group.valid}
    gone = [p for p in group.mined if p.literal not in kept]
    own = [(p, ADDED if p.by_hand else MINED) for p in group.valid]
    return own + [(p, DROPPED) for p in gone]


def _row(
    key: tuple[str, Literal, str],
    cases: list[tuple[Group, Precondition]],
    every: set[Subtask],
    known: Remembered,
) -> Row:
    skill, fact, origin = key
    asked = {(u.demonstration, u.index): u for g, _ in cases for u in g.uses}
    truths = {k: evaluate(fact, u.graph, u.subtask, known.domain) for k, u in asked.items()}
    held = [k for k, truth in truths.items() if truth is Truth.TRUE]
    kinds = sorted({g.subtask for g, _ in cases})
    tasks = sorted({g.task for g, _ in cases})
    used_in = sorted({u.task for g, _ in cases for u in g.uses})
    return Row(
        skill,
        fact,
        len({d for d, _ in held}),
        len({d for d, _ in asked}),
        len(held),
        len(asked),
        max(p.weight for _, p in cases),
        origin,
        () if len(kinds) == len(every) else tuple(map(str, kinds)),
        () if tasks == used_in else tuple(tasks),
        _note(fact, cases[0][0], known),
    )


def _shown(
    p: Precondition, origin: str, group: Group, subtask: Subtask, known: Remembered
) -> Shown:
    found: dict[Truth, list[str]] = {t: [] for t in Truth}
    for use in group.uses:
        truth = evaluate(p.literal, use.graph, use.subtask, known.domain)
        found[truth].append(f"{use.demonstration}, step {use.index + 1}")
    return Shown(
        p.literal.bind(known.domain.bound(subtask)),
        p,
        origin,
        tuple(found[Truth.TRUE]),
        tuple(found[Truth.UNOBSERVED]),
        tuple(found[Truth.FALSE]),
        _note(p.literal, group, known),
    )


def _note(fact: Literal, group: Group, known: Remembered) -> str:
    own = (c for c in known.corrections.each if c.concerns(group.subtask, group.task, known.domain))
    return next((c.note for c in own if c.fact == fact), "")
