"""What can be true of a set of things, and the facts that ground formulas are made of.

Called by `ground` and by the functions that `schemas` compiles (it implements their `World`).
Facts are numbered from 2; what no skill and no process can bring about is false for good.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from forestall.deadline import Deadline
from forestall.domain.circle import DEEP, DeeperError
from forestall.domain.evaluate import static_holds
from forestall.domain.formula import TRUE, literals
from forestall.domain.model import SAME, SAME_CATEGORY, Domain
from forestall.domain.schema import Predicate, PredicateKind
from forestall.planning.nodes import Junction, Node, all_of, assuming
from forestall.planning.problem import Atom
from forestall.planning.schemas import Schemas
from forestall.planning.state import State
from forestall.types.facts import category_of

EXISTS = "exists"
_FIRST = 2
_ASKED = 32
"""After how many questions for things, each of some ten microseconds, the deadline is asked."""


@dataclass(frozen=True)
class Universe:
    """What a problem is about.

    Args:
        things: existing things, in order.
        made: (source, skill, variable) → names of what the skill makes of the source.
        purposeful: what may be put anywhere it fits; other things are only put away. None: all.
        supports: where things are put away.
        bounded: whether something could be made more often than is modelled.
    """

    things: tuple[str, ...]
    made: Mapping[tuple[str, str, str], tuple[str, ...]] = field(default_factory=dict)
    purposeful: frozenset[str] | None = None
    supports: tuple[str, ...] = ()
    bounded: bool = False

    def allows(self, domain: Domain, thing: str, place: str) -> bool:
        """Whether a plan may put a thing to a place."""
        if self.purposeful is None:
            return True
        if place not in self.purposeful and any(domain.is_a(place, t) for t in domain.roles.avoid):
            return False
        if not domain.roles.rest:
            return True
        return thing in self.purposeful or place in self.supports


def rigid_of(domain: Domain) -> frozenset[str]:
    """Relations that nothing changes, and what is derived of such alone: true of the scene."""
    found = domain.__dict__.get("_rigid")
    if found is None:
        effects = [e for s in domain.skills.values() for e in s.effects]
        effects += [e for p in domain.processes for e in p.effects]
        changed = {f.predicate for e in effects for f in e.facts}
        groups = {domain.predicates[c].group for c in changed} - {None}
        gone = any(e.gone for e in effects) or any(s.makes for s in domain.skills.values())
        rigid = {
            r.name
            for r in domain.relations.values()
            if r.name not in changed and r.group not in groups
        }
        static = set(domain.statics) | {SAME, SAME_CATEGORY, *domain.tags, *domain.categories}
        news = True
        while news:
            news = False
            for known in domain.derived.values():
                asks = {x.predicate for x, _ in literals(known.definition or TRUE)}
                if known.name not in rigid and asks <= rigid | static | {known.name}:
                    rigid.add(known.name)
                    news = True
        kept = rigid if not gone else {r for r in rigid if _untouched(domain, r)}
        found = domain.__dict__["_rigid"] = frozenset(kept)
    return found


def _untouched(domain: Domain, name: str) -> bool:
    """Whether nothing that is made or goes can stand in a relation: its roles say of what kind."""
    passing: set[str] = set()
    for skill in domain.skills.values():
        kinds = {p.name: p.kind for p in skill.parameters}
        for variable in (
            *(v for e in skill.effects for v in e.gone),
            *(m.source for m in skill.makes),
        ):
            passing |= (
                set(domain.categories)
                if kinds.get(variable) is None
                else {c for c in domain.categories if kinds[variable] in domain.kinds(c)}
            )
        for make in skill.makes:
            passing |= {row[1] for row in domain.statics.get(make.by, ())}
    roles = domain.predicates[name].parameters
    return all(
        p.kind is not None and not any(p.kind in domain.kinds(c) for c in passing) for p in roles
    )


class Grounder:
    """Implements `schemas.World` over a universe and what is possible in it.

    Every question for things asks the deadline now and then, while there is one.
    """

    def __init__(
        self,
        state: State,
        universe: Universe,
        schemas: Schemas,
        deadline: Deadline | None = None,
    ) -> None:
        self.state, self.universe, self.schemas = state, universe, schemas
        self.deadline, self._asked = deadline, 0
        self.domain = state.domain
        made = [n for names in universe.made.values() for n in names]
        self.names: tuple[str, ...] = tuple(dict.fromkeys((*universe.things, *made)))
        self.categories = {n: state.kinds.get(n) or category_of(n) for n in self.names}
        for hand in self.domain.robot.hands:
            self.categories[hand] = hand
        self.maybe: set[str] = set(made)
        self.rigid = rigid_of(self.domain)
        self.facing: str | None = None
        self.driven: str | None = None
        self.atoms: list[Atom] = [("",)] * _FIRST
        self.ids: dict[Atom, int] = {}
        self.definitions: dict[int, Node] = {}
        self.opposites: dict[int, int] = {}
        self._kinds: dict[str, tuple[str, ...]] = {}
        self._static: dict[tuple[str, ...], bool] = {}
        self._static_related: dict[tuple[object, ...], tuple[str, ...]] = {}
        self._possible: dict[tuple[str, int, str], dict[str, None]] = {}
        self.possible: set[Atom] = set()
        self._derived: dict[Atom, Node] = {}
        self._depth = 0
        self._about: dict[str, dict[Atom, None]] = {}

    def in_time(self) -> None:
        """See now and then that the deadline is not over.

        Raises:
            TimeUp: it is.
        """
        self._asked += 1
        if not self._asked % _ASKED and self.deadline is not None:
            self.deadline.check()

    # --- what is possible ------------------------------------------------------------------------

    def allow(self, atom: Atom) -> bool:
        """Let a relation be possible; whether that is news."""
        if atom in self.possible:
            return False
        self.possible.add(atom)
        for arg in atom[1:]:
            self._about.setdefault(arg, {})[atom] = None
        if len(atom) == 3:
            self._possible.setdefault((atom[0], 0, atom[2]), {})[atom[1]] = None
            self._possible.setdefault((atom[0], 1, atom[1]), {})[atom[2]] = None
        return True

    def about(self, name: str) -> Iterable[Atom]:
        """Possible relations of a thing."""
        return self._about.get(name, ())

    def rivals(self, atom: Atom) -> list[int]:
        """Possible relations that exclude one, by their group."""
        group = self.domain.predicates[atom[0]].group
        if group is None:
            return []
        predicates = self.domain.predicates
        return [
            self.number_of(a)
            for a in self.about(atom[1])
            if a[1] == atom[1] and a != atom and predicates[a[0]].group == group
        ]

    def number_of(self, atom: Atom) -> int:
        """The number of a fact."""
        found = self.ids.get(atom)
        if found is None:
            found = self.ids[atom] = len(self.atoms)
            self.atoms.append(atom)
        return found

    def forget(self) -> None:
        """Derived facts are to be grounded anew, since more has become possible."""
        self._derived.clear()
        self.definitions.clear()

    # --- World -----------------------------------------------------------------------------------

    def things(self) -> Sequence[str]:
        """Every thing."""
        self.in_time()
        return self.names

    def of_kind(self, kind: str) -> Sequence[str]:
        """Things that count as a kind."""
        self.in_time()
        found = self._kinds.get(kind)
        if found is None:
            kinds, categories = self.domain.kinds, self.categories
            found = tuple(n for n in self.names if kind in kinds(categories[n]))
            self._kinds[kind] = found
        return found

    def is_a(self, name: str, kind: str) -> bool:
        """Whether a thing counts as a kind."""
        category = self.categories.get(name)
        return kind in self.domain.kinds(category or category_of(self.domain.canonical(name)))

    def same_category(self, one: str, other: str) -> bool:
        """Whether two things are of one category."""
        return self.categories.get(one) == self.categories.get(other)

    def located(self, name: str) -> bool:
        """Whether the place of a thing is known, which no skill changes."""
        return name in self.categories and name not in self.state.lost

    def faced(self, name: str) -> Node:
        """Whether the robot faces a thing: it can drive there."""
        if self.facing is None:
            self.driven = name
            return True
        return self.facing == name

    def static(self, predicate: str, args: tuple[str, ...]) -> bool:
        """Whether a static predicate holds."""
        key = (predicate, *args)
        found = self._static.get(key)
        if found is None:
            known = all(a in self.categories for a in args)
            found = known and static_holds(self.state, predicate, args)
            self._static[key] = found
        return found

    def static_related(self, predicate: str, position: int, args: tuple[str, ...]) -> Sequence[str]:
        """What fits at a position of a static predicate."""
        self.in_time()
        key = (predicate, position, *args[:position], *args[position + 1 :])
        found = self._static_related.get(key)
        if found is None:
            given = {i: self.categories.get(a) for i, a in enumerate(args) if i != position}
            fitting = {
                row[position]
                for row in self.domain.statics.get(predicate, ())
                if all(row[i] == c for i, c in given.items())
            }
            found = tuple(
                n
                for c in sorted(fitting)
                for n in self.of_kind(c)
                if self.categories[n] == c
                and self.static(predicate, (*args[:position], n, *args[position + 1 :]))
            )
            self._static_related[key] = found
        return found

    def value(self, name: str, attribute: str, value: str) -> Node:
        """The fact that an attribute has a value."""
        category = self.domain.categories.get(self.categories.get(name, ""))
        if category is None or attribute not in category.attributes:
            return False
        return self.number_of((attribute, name, value))

    def fact(self, predicate: str, args: tuple[str, ...]) -> Node:
        """A relation or history."""
        atom = (predicate, *args)
        if predicate in self.rigid:
            return atom in self.state.facts
        if atom in self.possible:
            return self.number_of(atom)
        history = self.domain.predicates[predicate].kind is PredicateKind.HISTORY
        if history and all(a in self.categories for a in args):
            return self.number_of(atom)
        return False

    def related(self, predicate: str, position: int, args: tuple[str, ...]) -> Sequence[str]:
        """What may stand at a position of a relation."""
        self.in_time()
        if len(args) == 2:
            return tuple(self._possible.get((predicate, position, args[1 - position]), ()))
        return tuple(
            dict.fromkeys(
                a[position + 1]
                for a in sorted(self.possible)
                if a[0] == predicate
                and all(i == position or a[i + 1] == g for i, g in enumerate(args))
            )
        )

    def derived(self, predicate: str, args: tuple[str, ...]) -> Node:
        """A derived fact: its own definition, or a fact of its own where that leads back to it."""
        atom = (predicate, *args)
        found = self._derived.get(atom)
        if found is not None:
            return found
        if predicate in self.rigid:
            return self.state.says(predicate, *args)
        known = self.domain.predicates[predicate]
        if self._depth == DEEP:
            raise DeeperError(known, args)
        if self._depth:
            try:
                return self._defined(known, args)
            except DeeperError:
                del self._derived[atom]
                raise
        waiting = [(known, args)]  # what lies too deep first, as in `evaluate.Circle`
        while True:
            try:
                node = self._defined(*waiting[-1])
            except DeeperError as deeper:
                waiting.append((deeper.known, deeper.those))
                continue
            waiting.pop()
            if not waiting:
                return node

    def _defined(self, known: Predicate, args: tuple[str, ...]) -> Node:
        assert known.definition is not None
        atom = (known.name, *args)
        number = self._derived[atom] = self.number_of(atom)
        self.definitions.pop(number, None)
        names = {p.name: a for p, a in zip(known.parameters, args, strict=True)}
        self._depth += 1
        try:
            node = self.schemas.formula(known.definition)(self, names)
        finally:
            self._depth -= 1
        if isinstance(node, Junction):
            self.definitions[number] = node
            return number
        if node == number:
            node = False
        self._derived[atom] = node
        self.definitions[number] = node
        return node

    def existing(self, name: str, node: Node) -> Node:
        """A node about a thing, which holds only while that exists."""
        if name not in self.maybe or node is False:
            return node
        base = self.definitions
        absent = assuming(
            node, lambda f: False if f not in base and name in self.atoms[f][1:] else None
        )
        return node if absent is False else all_of((node, self.exists(name)))

    def exists(self, name: str) -> Node:
        """The fact that a thing exists."""
        return self.number_of((EXISTS, name)) if name in self.maybe else True

    def number(self, name: str, what: str) -> int | None:
        """A number of a thing."""
        return self.domain.number(self.categories.get(name, name), what)

    def chosen(self, name: str, ask: Callable[[], Node]) -> Node:
        """A node judged while the robot faces a thing."""
        before, self.facing = self.facing, name
        try:
            return ask()
        finally:
            self.facing = before
