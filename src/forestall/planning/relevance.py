"""Which goals, and which things of a scene, a planning problem is about.

Called by `planner` before `translate`. A goal with variables and category names becomes a list of
ground alternatives; everything that cannot help any of them is left out of the problem: kept are
the things of the goal, what is held, containers and blockers of what is kept, devices and tools
that bring about a wanted state, and one or two free supports.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice, product

from forestall.planning.domain import products
from forestall.planning.effects import may_cook
from forestall.planning.state import State, by_number
from forestall.types.facts import GRIPPER, Literal, category_of, is_instance
from forestall.types.task import Goal

SUPPORTS = ("CounterTop", "DiningTable")
"""Where things are put out of the way, in this order; any other plain support comes after."""

MAX_ALTERNATIVES = 48

Conjunction = tuple[Literal, ...]


@dataclass(frozen=True, slots=True)
class Universe:
    """What a problem is about.

    Args:
        things: kept existing things.
        made: source → things that slicing or cracking it makes (those that matter).
        purposeful: movable things that may be put anywhere they fit; others are only put away.
        supports: where things are put away.
    """

    things: tuple[str, ...]
    made: dict[str, tuple[str, ...]]
    purposeful: frozenset[str]
    supports: tuple[str, ...]


def alternatives(state: State, goal: Goal) -> tuple[Conjunction, ...]:
    """Ground conjunctions of which any one meets the goal (`never` included as negations).

    Things that slicing or cracking could make count as instances of their category.
    """
    literals = list(goal.literals) + [negated(x) for x in goal.never]
    variables = list(goal.variables)
    ground: list[Literal] = []
    for literal in (y for x in literals for y in _for_all(state, x)):
        args = []
        for position, arg in enumerate(literal.args):
            if arg == GRIPPER or arg.startswith("?") or is_instance(arg):
                args.append(state.vocabulary.canonical(arg))
            else:
                variable = f"?{len(ground)}.{position}"
                variables.append((variable, state.vocabulary.canonical(arg)))
                args.append(variable)
        ground.append(Literal(literal.predicate, tuple(args), literal.value))
    return tuple(islice(_bound(state, variables, ground), MAX_ALTERNATIVES))


def _for_all(state: State, literal: Literal) -> Iterator[Literal]:
    """A negative literal about a category is one about each of its instances."""
    if literal.value != "false" and not literal.predicate.startswith("not "):
        yield literal
        return
    choices = [
        (a,) if a == GRIPPER or a.startswith("?") or is_instance(a) else possible(state, canonical)
        for a in literal.args
        for canonical in (state.vocabulary.canonical(a),)
    ]
    for args in product(*choices):
        yield Literal(literal.predicate, args, literal.value)


def negated(literal: Literal) -> Literal:
    """The opposite literal; for an attribute its value is kept and "not" is in the predicate."""
    if literal.value in ("true", "false"):
        value = "false" if literal.value == "true" else "true"
        return Literal(literal.predicate, literal.args, value)
    return Literal(f"not {literal.predicate}", literal.args, literal.value)


def _ban_kept(state: State, literal: Literal) -> bool:
    """Whether a literal forbids something that is not so now."""
    if literal.predicate.startswith("not "):
        banned = Literal(literal.predicate.removeprefix("not "), literal.args, literal.value)
        return not state.holds(banned)
    return literal.value == "false" and state.holds(literal)


def possible(state: State, category: str) -> tuple[str, ...]:
    """Instances of a category that exist and are located, and those that could be made."""
    existing = tuple(x for x in state.instances(category) if x not in state.lost)
    source = _source_of(state, category)
    if source is None:
        return existing
    return existing + products(state, category, count_made(state, source))


def count_made(state: State, source: str) -> int:
    """How many things slicing or cracking a source makes."""
    return state.category(source).slices if state.category(source).slices_into else 1


def _bound(
    state: State, variables: Sequence[tuple[str, str]], literals: Sequence[Literal]
) -> Iterator[Conjunction]:
    choices = []
    for variable, category in variables:
        about = [x for x in literals if variable in x.args]
        options = possible(state, category)
        made = {x for x in options if x not in state.kinds}
        if made:
            first = min(made, key=by_number)
            same = [v for v, c in variables if c == category]
            options = tuple(x for x in options if x not in made or len(same) > 1 or x == first)
        choices.append(
            sorted(
                options,
                key=lambda x, v=variable, a=about: (  # type: ignore[misc]
                    -sum(state.holds(y.bind({v: x})) for y in a),
                    by_number(x),
                ),
            )
        )
    named = [v for v, _ in variables if "." not in v]
    for values in product(*choices):
        binding = dict(zip([v for v, _ in variables], values, strict=True))
        if len({binding[v] for v in named}) == len(named):
            yield tuple(dict.fromkeys(x.bind(binding) for x in literals))


def _source_of(state: State, category: str) -> str | None:
    """The thing from which the first thing of a category would be made."""
    sources = [
        x
        for x in sorted(state.kinds, key=by_number)
        if category in (state.category(x).slices_into, state.category(x).cracks_into)
        and x not in state.lost
        and x not in state.spoiled
    ]
    best = [x for x in sources if x == state.held or state.closed_around(x) is None]
    return next(iter(best or sources), None)


@dataclass
class _Closure:
    """Collects what is needed, until nothing more is."""

    state: State
    kept: set[str] = field(default_factory=set)
    made: dict[str, set[str]] = field(default_factory=dict)
    purposeful: set[str] = field(default_factory=set)
    vessels: set[str] = field(default_factory=set)

    def keep(self, names: Iterable[str | None]) -> None:
        for name in names:
            if name is None or name in self.kept:
                continue
            if name not in self.state.kinds:
                self._make(name)
                continue
            self.kept.add(name)
            state, category = self.state, self.state.category(name)
            self.keep(p.parent for p in state.chain(name))
            self.keep(state.blockers(name))
            shape = category.receptacle
            if shape is not None and (not category.fixture or shape.capacity is not None):
                self.keep(state.contents(name))
            if category.device is not None:
                self.keep(state.targets(name))
                if category.device.needs_held:
                    self.use(self._first(category.device.needs_held))

    def use(self, names: Iterable[str]) -> None:
        names = tuple(names)
        self.keep(names)
        self.purposeful.update(names)

    def want(self, literal: Literal) -> None:
        """Keep what can bring a literal about; a ban that is kept now asks for nothing."""
        state = self.state
        if literal.predicate == "spoiled" or _ban_kept(state, literal):
            return
        for arg in literal.args:
            if arg != GRIPPER and not arg.startswith("?"):
                self.use((arg,))
        name = literal.args[0] if literal.args else ""
        predicate, value = literal.predicate, literal.value
        if predicate == "vacant":
            self.keep(state.contents(name))
        elif predicate == "dirty" and value == "clean":
            self._devices(name, lambda d: d.cleans)
        elif predicate == "filled":
            self.keep(x for x in sorted(state.kinds, key=by_number) if state.category(x).drains)
            if value != "empty":
                self._liquid(name, value)
        elif predicate == "temperature" and value == "hot":
            self._devices(name, lambda d: d.heats)
        elif predicate == "temperature" and value == "cold":
            self._devices(name, lambda d: d.cools)
        elif predicate == "cooked" and value == "cooked":
            self._devices(name, lambda d: may_cook(d, category_of(name)))

    def _make(self, name: str) -> None:
        source = _source_of(self.state, category_of(name))
        if source is None:
            return
        self.made.setdefault(source, set()).add(name)
        self.purposeful.add(name)
        if self.state.category(source).slices_into is not None:
            self.keep((source,))
            self.use(self._first("Knife"))
        else:
            self.use((source,))

    def _first(self, category: str, count: int = 1) -> tuple[str, ...]:
        """The most promising instances of a category: held, accessible, unblocked ones first."""
        state = self.state
        found = [x for x in state.instances(category) if x not in state.lost]
        found.sort(
            key=lambda x: (
                x != state.held,
                state.closed_around(x) is not None,
                bool(state.blockers(x)),
                state.value(x, "dirty") == "dirty",
                by_number(x),
            )
        )
        return tuple(found[:count])

    def _devices(self, name: str, works: object) -> None:
        """Keep devices of a kind that take a thing, or one of the vessels that it can be in."""
        state, vocabulary = self.state, self.state.vocabulary
        carriers = [name] + [
            v for v in sorted(self.purposeful | self.kept) if self._carries(v, name)
        ]
        fitting: dict[str, list[str]] = {}
        for device in sorted(state.kinds, key=by_number):
            kind = state.category(device).device
            if kind is None or not works(kind):  # type: ignore[operator]
                continue
            for target in state.targets(device):
                if any(vocabulary.accepts(target, c) for c in carriers):
                    fitting.setdefault(state.kinds[device], []).append(device)
        for devices in fitting.values():
            known = [d for d in devices if d in self.kept]
            free = [d for d in devices if any(state.has_room(t) for t in state.targets(d))]
            self.keep(known or (free or devices)[:1])
        if not fitting:
            self._vessel_for(name)

    def _carries(self, vessel: str, thing: str) -> bool:
        state = self.state
        if vessel not in state.kinds or state.category(vessel).fixture:
            return False
        return state.vocabulary.accepts(vessel, thing)

    def _vessel_for(self, name: str) -> None:
        state = self.state
        for category in sorted(set(state.kinds.values())):
            found = self._first(category)
            if found and found[0] not in self.vessels and self._carries(found[0], name):
                self.vessels.add(found[0])
                self.use(found)

    def _liquid(self, name: str, liquid: str) -> None:
        state = self.state
        self._devices(name, lambda d: d.fills == liquid)
        sources = [x for x in state.kinds if state.value(x, "filled") == liquid and x != name]
        carriers = [
            x
            for c in sorted(set(state.kinds.values()))
            for x in self._first(c)
            if x != name and state.value(x, "filled") is not None and state.category(x).pickupable
        ]
        pickable = name in state.kinds and state.category(name).pickupable
        extra = sources if pickable else sources + carriers
        self.use(sorted((x for x in extra if x not in state.lost), key=by_number)[:3])
        if not pickable:
            for carrier in extra[:3]:
                self._devices(carrier, lambda d: d.fills == liquid)


def universe(
    state: State, goals: Sequence[Conjunction], also: Iterable[str] = (), supports: int = 2
) -> Universe:
    """Choose the things that matter for any of the goals.

    Args:
        state: the first state.
        goals: ground alternatives.
        also: further things to keep.
        supports: how many supports to keep for putting things away.
    """
    closure = _Closure(state)
    closure.keep((state.held,))
    closure.keep(x for x in also if x in state.kinds)
    for literal in dict.fromkeys(x for goal in goals for x in goal):
        closure.want(literal)
    for literal in dict.fromkeys(x for goal in goals for x in goal):
        closure.want(literal)
    blocked = {x.args[0] for goal in goals for x in goal if x.predicate == "unblocked"}
    chosen = _supports(state, closure.kept, {state.root(x) for x in blocked})[:supports]
    closure.keep(chosen)
    things = tuple(sorted((x for x in closure.kept if x not in state.lost), key=by_number))
    made = {s: tuple(sorted(m, key=by_number)) for s, m in sorted(closure.made.items())}
    return Universe(things, made, frozenset(closure.purposeful), tuple(chosen))


def _supports(state: State, kept: set[str], avoid: set[str]) -> list[str]:
    """Supports in order of preference: room first, not where something is to be unblocked."""
    found = []
    for name, category in state.kinds.items():
        shape = state.vocabulary.categories[category].receptacle
        fixture = state.vocabulary.categories[category].fixture
        plain = fixture and shape is not None and shape.relation == "on_top_of"
        if plain and shape is not None and shape.capacity is None and category != "Floor":
            found.append(name)
    order = {c: i for i, c in enumerate(SUPPORTS)}
    return sorted(
        found,
        key=lambda x: (
            x in state.crowded,
            x in avoid,
            order.get(state.kinds[x], len(order)),
            x not in kept,
            by_number(x),
        ),
    )
