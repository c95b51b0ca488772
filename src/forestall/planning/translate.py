"""Translates a symbolic state and goal alternatives into a ground STRIPS problem.

Called by `planner`; calls `automatic` for what devices do by themselves, which is compiled into
conditional effects. Atoms:

- ("at", x, relation, p): x is in or on p; ("loose", x): x is located, but on nothing known;
- ("held", x), ("hand_empty",); ("is", x, attribute, value);
- ("reach", x): x is not inside something closed; ("clear", y, x): y is not in front of x;
- ("free", r, k): r takes k further things; ("intact", x): nothing irreversible happened to x;
- ("not", *atom): the complement of an atom, made only where something asks for it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from forestall.planning.automatic import Automatic
from forestall.planning.grounding import Change, Layout
from forestall.planning.problem import Atom, Effect, Operator, Problem
from forestall.planning.relevance import Conjunction, Universe
from forestall.planning.state import State
from forestall.types.facts import Literal
from forestall.types.plan import Subtask
from forestall.vocabulary import ATTRIBUTES


class UnsupportedError(Exception):
    """A goal literal that these problems cannot express."""


@dataclass(slots=True)
class Draft:
    """An operator before its atoms are numbered."""

    subtask: Subtask
    condition: Sequence[Atom]
    add: Sequence[Atom]
    delete: Sequence[Atom]
    changes: list[Change] = field(default_factory=list)
    over: str | None = None


def translate(state: State, goals: Sequence[Conjunction], universe: Universe) -> Problem:
    """Ground a problem.

    Raises:
        UnsupportedError: no goal alternative can be expressed.
    """
    layout = Layout(state, universe, goals)
    drafts = list(_operators(layout))
    wanted: list[list[Atom]] = []
    refused: UnsupportedError | None = None
    for goal in goals:
        try:
            atoms = [
                a
                for literal in goal
                if not layout.safe(literal)
                for a in _goal_atoms(layout, literal)
            ]
        except UnsupportedError as error:
            refused = error
            continue
        wanted.append(atoms)
    if refused is not None and not wanted:
        raise refused
    return _number(layout, drafts, wanted)


# --- operators ------------------------------------------------------------------------------------


def _operators(layout: Layout) -> Iterator[Draft]:
    effects = Automatic(layout)
    for x in layout.movable:
        for place in layout.places[x]:
            if layout.pickable(x):
                yield _pick_up(layout, x, place)
        for receptacle in layout.targets[x]:
            yield from _put(layout, effects, x, receptacle)
    for x in layout.universe.things:
        yield from _switch(layout, effects, x)
        if layout.state.category(x).slices_into and x in layout.universe.made:
            yield from _slice(layout, x)
        if layout.state.category(x).cracks_into and x in layout.universe.made:
            yield from _crack(layout, effects, x)
        if layout.pickable(x) and layout.has(x, "filled"):
            yield from _pour(layout, effects, x)


def _pick_up(layout: Layout, x: str, place: Atom) -> Draft:
    blockers = [("clear", y, x) for y in layout.state.blockers(x)]
    behind = [("clear", x, z) for z in layout.behind(x)]
    draft = Draft(
        Subtask("pick_up", (x,)),
        [place, ("reach", x), ("hand_empty",), *blockers, *layout.quiet(layout.parent(place))],
        [("held", x), *behind],
        [place, ("hand_empty",)],
    )
    parent = layout.parent(place)
    if parent is not None and layout.counted(place):
        for k in range(layout.capacity[parent]):
            draft.changes.append(
                Change(
                    (("free", parent, str(k)),),
                    (("free", parent, str(k + 1)),),
                    (("free", parent, str(k)),),
                )
            )
    return draft


def _put(layout: Layout, effects: Automatic, x: str, receptacle: str) -> Iterator[Draft]:
    place = layout.place(x, receptacle)
    skill = "put_in" if place[2] == "inside" else "put_on"
    condition: list[Atom] = [("held", x), *layout.reachable(receptacle)]
    condition += layout.quiet(receptacle)
    if layout.state.vocabulary.encloses(receptacle):
        condition.append(("is", receptacle, "open", "open"))
    device = layout.state.category(receptacle).device
    if device and device.shut_while_on and layout.has(receptacle, "toggled"):
        condition.append(("is", receptacle, "toggled", "off"))
    changes = effects.arrival(x, receptacle)
    for room, taken, left in layout.room(receptacle):
        yield Draft(
            Subtask(skill, (x, receptacle)),
            [*condition, *room],
            [place, ("hand_empty",), *left],
            [("held", x), *taken],
            list(changes),
        )


def _switch(layout: Layout, effects: Automatic, x: str) -> Iterator[Draft]:
    state = layout.state
    device = state.category(x).device
    reach = layout.reachable(x)
    if layout.has(x, "open"):
        condition = [*reach, ("is", x, "open", "closed")]
        if device and device.needs_closed and layout.has(x, "toggled"):
            condition.append(("is", x, "toggled", "off"))
        opened, closed = layout.becomes(x, "open", "open"), layout.becomes(x, "open", "closed")
        opening, closing = [], []
        if state.vocabulary.encloses(x):
            for y, path in layout.nested(x):
                opening.append(Change(path, (("reach", y),), ()))
                closing.append(Change(path, (), (("reach", y),)))
        if device and device.always:
            closing += effects.working(x, ())
        yield Draft(Subtask("open_obj", (x,)), condition, *opened, opening)
        yield Draft(
            Subtask("close_obj", (x,)), [*reach, ("is", x, "open", "open")], *closed, closing
        )
    if layout.has(x, "toggled"):
        condition = [*reach, ("is", x, "toggled", "off")]
        if device and device.needs_closed and layout.has(x, "open"):
            condition.append(("is", x, "open", "closed"))
        tools: Iterable[list[Atom]] = ([],)
        if device and device.needs_held:
            tools = [[("held", t)] for t in layout.movable if layout.kind(t) == device.needs_held]
        changes = effects.working(x, ()) if device and not device.always else []
        on, off = layout.becomes(x, "toggled", "on"), layout.becomes(x, "toggled", "off")
        for tool in tools:
            yield Draft(Subtask("toggle_on", (x,)), [*condition, *tool], *on, list(changes))
        yield Draft(Subtask("toggle_off", (x,)), [*reach, ("is", x, "toggled", "on")], *off)


def _slice(layout: Layout, x: str) -> Iterator[Draft]:
    """Slicing is planned on plain supports only; elsewhere the pieces would need counting."""
    for place in layout.places[x]:
        parent = layout.parent(place)
        if parent is not None and not layout.plain(parent):
            continue
        made = layout.universe.made[x]
        changes = [c for y in made for c in layout.inherits(x, y)]
        for knife in (k for k in layout.movable if layout.kind(k) == "Knife"):
            yield Draft(
                Subtask("slice_obj", (x,)),
                [("held", knife), place, ("reach", x)],
                [
                    *(("loose", y) if parent is None else ("at", y, *place[2:]) for y in made),
                    *(("clear", x, z) for z in layout.behind(x)),
                ],
                [place],
                list(changes),
            )


def _crack(layout: Layout, effects: Automatic, x: str) -> Iterator[Draft]:
    (y,) = layout.universe.made[x][:1]
    for vessel in layout.targets[y]:
        for room, taken, left in layout.room(vessel):
            yield Draft(
                Subtask("crack_obj", (x,)),
                [("held", x), *layout.reachable(vessel), *room],
                [layout.place(y, vessel), ("hand_empty",), *left],
                [("held", x), *taken],
                [*layout.inherits(x, y), *effects.arrival(y, vessel)],
                over=vessel,
            )


def _pour(layout: Layout, effects: Automatic, x: str) -> Iterator[Draft]:
    for target in layout.universe.things:
        drains = layout.state.category(target).drains
        if target == x or not (drains or layout.has(target, "filled")):
            continue
        if not drains and target not in layout.universe.purposeful:
            continue
        for liquid in ATTRIBUTES["filled"][1:]:
            add, delete = layout.becomes(x, "filled", "empty")
            condition: list[Atom] = [("held", x), ("is", x, "filled", liquid)]
            changes: list[Change] = []
            if not drains:
                condition += [*layout.reachable(target), ("is", target, "filled", "empty")]
                more, less = layout.becomes(target, "filled", liquid)
                add, delete = add + more, delete + less
                changes = effects.soaked(target, ()) + layout.tempers(x, target)
            yield Draft(Subtask("pour", (x, target)), condition, add, delete, changes)


# --- goals ----------------------------------------------------------------------------------------


def _goal_atoms(layout: Layout, literal: Literal) -> list[Atom]:
    predicate, args, yes = literal.predicate, literal.args, literal.value != "false"
    attributes = layout.state.vocabulary.attributes
    if predicate in attributes:
        return [("is", args[0], predicate, literal.value)]
    if predicate.removeprefix("not ") in attributes:
        return [("not", "is", args[0], predicate.removeprefix("not "), literal.value)]
    if predicate == "vacant" and yes:
        return [
            ("not", *place)
            for x in layout.movable
            for place in layout.places[x]
            if layout.parent(place) == args[0]
        ]
    if predicate == "unblocked" and yes:
        return [("clear", y, args[0]) for y in layout.state.blockers(args[0])]
    atom: Atom
    if predicate == "hand_empty":
        atom = ("hand_empty",)
    elif predicate == "held_by":
        atom = ("held", args[0])
    elif predicate in ("inside", "on_top_of"):
        atom = ("at", args[0], predicate, args[1])
    elif predicate == "accessible":
        atom = ("reach", args[0])
    elif predicate == "blocking":
        atom, yes = ("clear", args[0], args[1]), not yes
    elif predicate == "spoiled":
        atom, yes = ("intact", args[0]), not yes
    elif predicate == "located":
        atom = ("located", args[0])
    else:
        raise UnsupportedError(f"{literal} cannot be planned for")
    return [atom] if yes else [("not", *atom)]


# --- numbering ------------------------------------------------------------------------------------


def _number(layout: Layout, drafts: list[Draft], goals: list[list[Atom]]) -> Problem:
    """Drop what can never run, add complements, and give every atom a bit."""
    initial = layout.initial()
    drafts = _reachable(drafts, initial)
    asked = {a for goal in goals for a in goal}
    asked |= {a for d in drafts for a in d.condition}
    asked |= {a for d in drafts for c in d.changes for a in c.condition}
    complements = {a[1:] for a in asked if a[0] == "not"}
    atoms = sorted(asked)
    bits = {a: 1 << i for i, a in enumerate(atoms)}

    def mask(group: Iterable[Atom]) -> int:
        value = 0
        for atom in group:
            value |= bits.get(atom, 0)
        return value

    def effect(change: Change) -> Effect:
        add = [*change.add, *(("not", *a) for a in change.delete if a not in change.add)]
        delete = [*change.delete, *(("not", *a) for a in change.add)]
        return Effect(mask(change.condition), mask(add), mask(delete) & ~mask(add))

    operators = []
    for d in drafts:
        first, *others = (effect(c) for c in _all_changes(d))
        effects = (first, *(e for e in others if e.add or e.delete))
        if any(e.add or e.delete for e in effects):
            operators.append(Operator(d.subtask, mask(d.condition), effects, d.over))
    start = mask(initial) | mask(("not", *a) for a in complements if a not in initial)
    return Problem(tuple(atoms), start, tuple(mask(g) for g in goals), tuple(operators))


def _all_changes(draft: Draft) -> list[Change]:
    return [Change((), tuple(draft.add), tuple(draft.delete)), *draft.changes]


def _reachable(drafts: list[Draft], initial: set[Atom]) -> list[Draft]:
    """Operators and changes that the relaxed problem can reach."""
    possible = set(initial)
    waiting, done = list(drafts), []
    progress = True

    def open_now(condition: Iterable[Atom]) -> bool:
        return all(a in possible or a[0] == "not" for a in condition)

    while progress:
        before = len(possible)
        ready = [d for d in waiting if open_now(d.condition)]
        waiting = [d for d in waiting if not open_now(d.condition)]
        done += ready
        for draft in done:
            possible.update(draft.add)
            for change in draft.changes:
                if open_now(change.condition):
                    possible.update(change.add)
        progress = len(possible) > before or bool(ready)
    for draft in done:
        draft.changes = [c for c in draft.changes if open_now(c.condition)]
    order = {id(d): i for i, d in enumerate(drafts)}
    return sorted(done, key=lambda d: order[id(d)])
