"""Goals as ground conjunctions, and the names of things that skills could make.

Called by `planner` and `replanning`; calls `state`. A goal with variables and category names
becomes a list of ground alternatives of which any one meets it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from forestall.deadline import Deadline
from forestall.domain.formula import Formula, Not, literals
from forestall.planning.state import State
from forestall.types.facts import Literal, by_number, category_of, is_instance
from forestall.types.task import Goal

MAX_ALTERNATIVES = 48
MANY_ALTERNATIVES = 400

Conjunction = tuple[Formula, ...]
Made = Mapping[tuple[str, str, str], tuple[str, ...]]


@dataclass(frozen=True, slots=True)
class Alternatives:
    """Ground conjunctions of which any one meets a goal; `complete`: there are no others."""

    conjunctions: tuple[Conjunction, ...]
    complete: bool = True

    @property
    def names(self) -> frozenset[str]:
        """Every name in them."""
        found = (x for c in self.conjunctions for part in c for x, _ in literals(part))
        return frozenset(a for x in found for a in x.args)


def makeable(state: State) -> Made:
    """(source, skill, variable) → names of what the skill would make of the source.

    Every source gets names of its own, the most promising one the names that `apply` would give.
    Worked out once for each state.
    """
    return state.follow("makeable", lambda: _makeable(state))


def _makeable(state: State) -> Made:
    domain = state.domain
    made: dict[tuple[str, str, str], tuple[str, ...]] = {}
    number: dict[str, int] = {}
    for skill in domain.skills.values():
        for make in skill.makes:
            rows = sorted(domain.statics.get(make.by, ()))
            kinds = {}
            for row in reversed(rows):
                kinds[row[0]] = row[1]
            sources = [x for x in state.kinds if state.kinds[x] in kinds]
            if len(sources) > 1:
                sources.sort(key=lambda x: _promise(state, x))
            for source in sources:
                kind = kinds[state.kinds[source]]
                count = make.count
                if isinstance(count, str):
                    count = domain.number(source, count) or 1
                names: list[str] = []
                while len(names) < count:
                    number[kind] = number.get(kind, 0) + 1
                    if f"{kind}-{number[kind]}" not in state.kinds:
                        names.append(f"{kind}-{number[kind]}")
                made[source, skill.name, make.variable] = tuple(names)
    return made


def _promise(state: State, name: str) -> tuple[bool, bool, bool, tuple[str, int]]:
    harmed = any(f[0] in state.domain.histories and name in f[1:] for f in state.facts)
    held = any(name == h for _, h in state.in_hands())
    accessible = state.domain.roles.accessible
    shut_in = accessible is not None and not state.says(accessible, name)
    return name in state.lost or harmed, not held and shut_in, not held, by_number(name)


def alternatives(
    state: State, goal: Goal, whole: bool = False, deadline: Deadline | None = None
) -> Alternatives:
    """Ground conjunctions of which any one meets the goal (`never` included as negations).

    Args:
        state: says what exists.
        goal: with variables and category names.
        whole: count what any source could make, and not only the most promising one.
        deadline: when to stop.

    Raises:
        TimeUp: it is over.
    """
    options = _Options(state, whole, deadline or Deadline())
    parts: list[Formula] = [_plain(x) for x in goal.literals] + [_negated(x) for x in goal.never]
    variables = list(goal.variables)
    ground: list[Formula] = []
    for part in (y for x in parts for y in options.for_all(x)):
        literal = _literal(part)
        names = {}
        for position, arg in enumerate(literal.args):
            denied = negated(part) is not None and is_instance(arg)  # of each, see `for_all`
            if denied or options.definite(arg):
                names[position] = state.domain.canonical(arg)
            else:
                variable = f"?{len(ground)}.{position}" if not is_instance(arg) else f"?={arg}"
                if (variable, arg) not in variables:
                    variables.append((variable, arg))
                names[position] = variable
        args = tuple(names[i] for i in range(len(literal.args)))
        changed = Literal(literal.predicate, args, literal.value)
        ground.append(Not(changed) if isinstance(part, Not) else changed)
    limit = MANY_ALTERNATIVES if whole else MAX_ALTERNATIVES
    found: list[Conjunction] = []
    for conjunction in options.bound(variables, ground):
        if len(found) == limit:
            return Alternatives(tuple(found), False)
        found.append(conjunction)
    return Alternatives(tuple(found))


def different(
    choices: Sequence[Sequence[str]], distinct: Sequence[bool]
) -> Iterator[tuple[str, ...]]:
    """One of each of the choices in the order of `product`, those that are `distinct` different.

    Only what leaves something for all the others is followed: the first come at once, and that
    there are none is seen at once, however many choices there are.
    """
    several = list(zip(choices, distinct, strict=True))

    def fitting(at: int, taken: frozenset[str]) -> Iterator[tuple[str, frozenset[str]]]:
        names, alone = several[at]
        rest = [c for c, d in several[at + 1 :] if d]
        for name in names:
            if not alone:
                yield name, taken
            elif name not in taken and assigned(rest, now := taken | {name}):
                yield name, now

    if not all(choices) or not assigned([c for c, d in several if d]):
        return
    if not several:
        yield ()
        return
    chosen: list[str] = []
    waiting = [fitting(0, frozenset())]
    while waiting:
        found = next(waiting[-1], None)
        del chosen[len(waiting) - 1 :]
        if found is None:
            waiting.pop()
            continue
        chosen.append(found[0])
        if len(chosen) == len(several):
            yield tuple(chosen)
        else:
            waiting.append(fitting(len(chosen), found[1]))


def assigned(choices: Sequence[Sequence[str]], taken: frozenset[str] = frozenset()) -> bool:
    """Whether all choices can be given different things, none of those that are taken."""
    used = set(taken)
    for several in sorted(choices, key=len):
        name = next((x for x in several if x not in used), None)
        if name is None:
            return _matched([[x for x in c if x not in taken] for c in choices])
        used.add(name)
    return True


def _matched(choices: Sequence[Sequence[str]]) -> bool:
    if len({x for several in choices for x in several}) < len(choices):
        return False
    import networkx as nx

    graph = nx.Graph()
    graph.add_nodes_from(range(len(choices)))
    graph.add_edges_from((i, x) for i, several in enumerate(choices) for x in several)
    found = nx.bipartite.hopcroft_karp_matching(graph, range(len(choices)))
    return len(found) == 2 * len(choices)


def negated(part: Formula) -> Literal | None:
    """The literal that a part of a conjunction denies, if it does."""
    if isinstance(part, Not):
        return _literal(part)
    assert isinstance(part, Literal)
    return Literal(part.predicate, part.args) if part.value == "false" else None


def shown(part: Formula) -> str:
    """A part of a conjunction for a sentence."""
    return f"not {_literal(part)}" if isinstance(part, Not) else str(part)


def _plain(literal: Literal) -> Formula:
    return literal


def _negated(literal: Literal) -> Formula:
    if literal.value in ("true", "false"):
        value = "false" if literal.value == "true" else "true"
        return Literal(literal.predicate, literal.args, value)
    return Not(literal)


def _literal(part: Formula) -> Literal:
    found = part.part if isinstance(part, Not) else part
    assert isinstance(found, Literal)
    return found


class _Options:
    """Which things a name in a goal can mean."""

    def __init__(self, state: State, whole: bool, deadline: Deadline) -> None:
        self.state, self.whole, self.deadline = state, whole, deadline
        self.made = makeable(state)
        self.first: dict[str, tuple[str, ...]] = {}
        self.every: set[str] = set()
        for names in self.made.values():
            kind = category_of(names[0]) if names else ""
            known = self.first.get(kind)
            self.first[kind] = names if known is None else (known + names if whole else known)

    def definite(self, arg: str) -> bool:
        """Whether an argument means one thing."""
        if arg in self.state.domain.robot.hands or arg.startswith("?") or arg in self.state.kinds:
            return True
        return is_instance(arg) and (arg in self.every or not self.first.get(category_of(arg)))

    def possible(self, name: str) -> tuple[str, ...]:
        """Things that exist and are located, and those that could be made."""
        state = self.state
        category = state.domain.canonical(name)
        if is_instance(category):
            made = self.first.get(category_of(category), ())
            own = (category,) if category in made else ()
            return own + tuple(x for x in made if x not in own and (self.whole or not own))
        existing = tuple(x for x in state.instances(category) if x not in state.lost)
        return existing + self.first.get(category, ())

    def for_all(self, part: Formula) -> Iterator[Formula]:
        """A denial about a category is one about each of its instances."""
        literal = _literal(part)
        if not isinstance(part, Not) and literal.value != "false":
            yield part
            return
        hands = self.state.domain.robot.hands
        choices = [
            (a,) if a in hands or a.startswith("?") or is_instance(a) else self.possible(a)
            for a in literal.args
        ]
        for args in product(*choices):
            self.deadline.check()
            self.every.update(a for a in args if a not in literal.args)
            changed = Literal(literal.predicate, args, literal.value)
            yield Not(changed) if isinstance(part, Not) else changed

    def bound(
        self, variables: Sequence[tuple[str, str]], parts: Sequence[Formula]
    ) -> Iterator[Conjunction]:
        """Every binding of variables, the one that holds already first."""
        state = self.state
        choices = []
        for variable, category in variables:
            about = [_literal(p) for p in parts if variable in _literal(p).args]
            options = self.possible(category)
            made = [x for x in options if x not in state.kinds]
            if made and not is_instance(category):
                same = [v for v, c in variables if category_of(c) == category]
                spare = set(self._spare(made, len(same)))
                options = tuple(x for x in options if x not in spare)

            def fit(x: str, v: str = variable, a: Sequence[Literal] = about) -> tuple[int, object]:
                self.deadline.check()
                return -sum(state.holds(y.bind({v: x})) for y in a), by_number(x)

            choices.append(options if is_instance(category) else sorted(options, key=fit))
        distinct = [v for v, _ in variables if "." not in v]
        names = [v for v, _ in variables]
        for values in different(choices, [v in distinct for v in names]):
            self.deadline.check()
            binding = dict(zip(names, values, strict=True))
            yield tuple(dict.fromkeys(_bound(p, binding) for p in parts))

    def _spare(self, made: Sequence[str], wanted: int) -> Iterator[str]:
        """Pieces of one source are alike: so many of each are enough."""
        for names in self.made.values():
            yield from [n for n in names if n in made][wanted:]


def _bound(part: Formula, binding: Mapping[str, str]) -> Formula:
    literal = _literal(part).bind(binding)
    return Not(literal) if isinstance(part, Not) else literal
