"""The symbolic state: what planning believes about the things of one scene graph.

Built from a scene graph by `observed`; read by `execute`, the validator, the planner and the
replanner. It answers every formula of the domain with yes or no.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from itertools import product
from typing import TypeVar

from forestall.domain.evaluate import literal_truth
from forestall.domain.formula import Formula, Parameter
from forestall.domain.model import FACING, LOCATED, Domain
from forestall.domain.schema import Category, PredicateKind
from forestall.domain.view import TRUE
from forestall.planning.asked import Asked
from forestall.planning.places import Place
from forestall.types.facts import Literal, by_number, category_of, is_instance

Fact = tuple[str, ...]
T = TypeVar("T")


class State:
    """What holds at one moment (implements `domain.view.View`, with two values only).

    `execute.apply` copies it and never changes the one it was given.

    Args:
        domain: what its names mean.
        kinds: thing → category; whatever is not here does not exist.
        values: (thing, attribute) → value.
        facts: relations and histories that hold, (predicate, *arguments).
        at: the last thing that was driven to or handled.
        lost: things whose place is not known.
        hidden: containers whose inside was not observed and is assumed empty.
        crowded: supports with little free area, as far as the boxes of the graph tell.
        assumed: facts that were not observed and are taken from the domain.
        where: things whose place was seen → x, y in metres at the start; shared by all copies.
    """

    __slots__ = (
        "_asked", "_done", "_index", "_kind_index", "assumed", "at", "changed", "crowded", "domain",
        "facts", "hidden", "kinds", "lost", "values", "where",
    )  # fmt: skip

    def __init__(
        self,
        domain: Domain,
        kinds: dict[str, str],
        values: dict[tuple[str, str], str] | None = None,
        facts: Iterable[Fact] = (),
        at: str | None = None,
        lost: frozenset[str] = frozenset(),
        hidden: frozenset[str] = frozenset(),
        crowded: frozenset[str] = frozenset(),
        assumed: frozenset[Literal] = frozenset(),
    ) -> None:
        self.domain, self.kinds = domain, kinds
        self.values = {} if values is None else values
        self.facts: set[Fact] = set()
        self._index: dict[tuple[str, int, str], frozenset[Fact]] = {}
        self.changed: set[str] = set(domain.predicates)
        self._asked: Asked | None = None
        self._done: dict[object, object] = {}
        self._kind_index: dict[str, tuple[str, ...]] = {}
        for fact in facts:
            self.add(fact)
        self.at, self.lost, self.hidden = at, lost, hidden
        self.crowded, self.assumed = crowded, assumed
        self.where: Mapping[str, tuple[float, float]] = {}

    def copy(self) -> State:
        """An independent copy."""
        other = State.__new__(State)
        other.domain, other.kinds, other.values = self.domain, dict(self.kinds), dict(self.values)
        other.facts = set(self.facts)
        other._index = dict(self._index)
        other.changed, other._asked, other._done = set(self.changed), None, {}
        other._kind_index = self._kind_index
        other.at, other.lost, other.hidden = self.at, self.lost, self.hidden
        other.crowded, other.assumed, other.where = self.crowded, self.assumed, self.where
        return other

    # --- changes ---------------------------------------------------------------------------------

    def add(self, fact: Fact) -> None:
        """Let a fact hold; others of its group end for the same first argument."""
        if fact in self.facts:
            return
        group = self.domain.predicates[fact[0]].group
        if group is not None:
            for name, other in self.domain.relations.items():
                if other.group == group:
                    for old in tuple(self._index.get((name, 0, fact[1]), ())):
                        self.remove(old)
        self.facts.add(fact)
        self._done.clear()
        self.changed.add(fact[0])
        for position, arg in enumerate(fact[1:]):
            key = (fact[0], position, arg)
            self._index[key] = self._index.get(key, frozenset()) | {fact}

    def remove(self, fact: Fact) -> None:
        """Let a fact end."""
        if fact not in self.facts:
            return
        self.facts.discard(fact)
        self._done.clear()
        self.changed.add(fact[0])
        for position, arg in enumerate(fact[1:]):
            key = (fact[0], position, arg)
            left = self._index[key] - {fact}
            if left:
                self._index[key] = left
            else:
                del self._index[key]

    def set_value(self, name: str, attribute: str, value: str) -> None:
        """Change an attribute of a thing that has it; what was assumed about it is settled."""
        old = self.values.get((name, attribute))
        if old is None:
            return
        if old != value:
            self.values[name, attribute] = value
            self._done.clear()
            self.changed.add(attribute)
        if self.assumed:
            self.assumed -= {Literal(attribute, (name,), old)}

    def create(self, name: str, category: str) -> None:
        """A new thing with the defaults of its category."""
        self.kinds[name] = category
        self._done.clear()
        self._kind_index = {}
        for attribute, value in self.domain.default_states(category).items():
            self.values[name, attribute] = value
        self.changed.update(self.domain.predicates)

    def take_away(self, name: str) -> None:
        """A thing is no more; histories of it stay."""
        del self.kinds[name]
        self._done.clear()
        self._kind_index = {}
        for key in [k for k in self.values if k[0] == name]:
            del self.values[key]
        histories = self.domain.histories
        for fact in [f for f in self.facts if name in f[1:] and f[0] not in histories]:
            self.remove(fact)

    # --- what evaluate asks ----------------------------------------------------------------------

    def things(self) -> Iterable[str]:
        """Everything that exists."""
        return self.kinds

    def category(self, name: str) -> str:
        """The category name of a thing, that of its name for what does not exist."""
        return self.kinds.get(name) or self.domain.canonical(category_of(name))

    def of_kind(self, kind: str) -> tuple[str, ...]:
        """Things that count as a tag, a category or an attribute holder."""
        found = self._kind_index.get(kind)
        if found is None:
            kinds = self.domain.kinds
            found = tuple(n for n, c in self.kinds.items() if kind in kinds(c))
            self._kind_index[kind] = found
        return found

    def fact(self, predicate: str, args: tuple[str, ...]) -> int:
        """Whether a relation, a history or a built-in fact holds."""
        if predicate == LOCATED:
            return TRUE if args[0] not in self.lost and args[0] in self.kinds else 0
        if predicate == FACING:
            return TRUE if self.at == args[0] else 0
        return TRUE if (predicate, *args) in self.facts else 0

    def value(self, name: str, attribute: str) -> str | None:
        """The value of an attribute, None where the thing does not have it."""
        return self.values.get((name, attribute))

    def unsure(self, name: str, attribute: str) -> bool:
        """Nothing is unsure here."""
        return False

    def related(self, predicate: str, position: int, args: tuple[str, ...]) -> list[str]:
        """What stands at a position of a relation, the rest being given."""
        if len(args) == 1:
            return [f[1] for f in self.facts if f[0] == predicate]
        given = next((i for i, a in enumerate(args) if i != position and a[0] != "?"), None)
        if given is None:  # p(?x, ?x)
            return sorted({f[1] for f in self.facts if f[0] == predicate and len({*f[1:]}) == 1})
        found = self._index.get((predicate, given, args[given]))
        if not found:
            return []
        if len(args) == 2:
            several = [f[position + 1] for f in found]
            return several if len(several) == 1 else sorted(several)
        return sorted(
            {
                f[position + 1]
                for f in found
                if all(i == position or a.startswith("?") or f[i + 1] == a
                       for i, a in enumerate(args))
            }
        )  # fmt: skip

    def with_value(self, attribute: str, value: str) -> Iterable[str]:
        """Things whose attribute has a value."""
        values = self.values
        return [n for n in self.of_kind(f"has_{attribute}") if values[n, attribute] == value]

    def matching(self, pattern: Literal) -> list[Literal]:
        """Literals like a pattern, variables standing for anything, of facts that hold."""
        given = next((i for i, a in enumerate(pattern.args) if not a.startswith("?")), None)
        key = (pattern.predicate, given or 0, pattern.args[given] if given is not None else "")
        found = self.facts if given is None else self._index.get(key, ())
        return [
            Literal(f[0], f[1:], pattern.value)
            for f in found
            if f[0] == pattern.predicate
            and all(a.startswith("?") or a == b for a, b in zip(pattern.args, f[1:], strict=True))
        ]

    # --- questions -------------------------------------------------------------------------------

    def kind(self, name: str) -> Category:
        """The category of an existing thing."""
        return self.domain.categories[self.kinds[name]]

    def true(self, formula: Formula, names: dict[str, str] | None = None) -> bool:
        """Whether a formula holds under a binding of its variables."""
        asked = self.asked
        return asked.schemas.formula(formula)(asked, names or {}) is True

    def bindings(
        self, variables: tuple[Parameter, ...], formula: Formula, names: dict[str, str]
    ) -> Iterator[dict[str, str]]:
        """Every binding of variables under which a formula holds."""
        asked = self.asked
        join = asked.schemas.join(variables, formula, frozenset(names))
        return (b for b, node in join(asked, names) if node is True)

    def follow(self, step: Hashable, act: Callable[[], T]) -> T:
        """What an action on this state gives, worked out once.

        A change of the state forgets it.
        """
        key = (step, self.at)
        if key not in self._done:
            self._done[key] = act()
        return self._done[key]  # type: ignore[return-value]

    def know(self, step: Hashable, found: object) -> None:
        """Remember what `follow` would work out."""
        self._done[step, self.at] = found

    @property
    def asked(self) -> Asked:
        """The state as what compiled formulas ask."""
        if self._asked is None:
            self._asked = Asked(self)
        return self._asked

    def says(self, predicate: str | None, *args: str) -> bool:
        """Whether a fact holds, derived ones too; False for a role that the domain lacks."""
        if predicate is None:
            return False
        asked = self.asked
        known = self.domain.predicates.get(predicate)
        if known is not None and known.kind is PredicateKind.DERIVED:
            return asked.derived(predicate, args) is True
        return literal_truth(Literal(predicate, args), self, {}) == TRUE

    @property
    def held(self) -> str | None:
        """What the first hand that holds something holds."""
        return next((h for _, h in self.in_hands()), None)

    def in_hands(self) -> Iterator[tuple[str, str]]:
        """(hand, thing) for every hand that holds something."""
        holding = self.domain.roles.holding
        for hand in self.domain.robot.hands if holding else ():
            for fact in sorted(self._index.get((holding or "", 1, hand), ())):
                yield hand, fact[1]

    def instances(self, category: str) -> tuple[str, ...]:
        """Existing things of a category, lowest number first."""
        if category not in self.domain.categories:
            return ()
        found = [n for n in self.of_kind(category) if self.kinds[n] == category]
        return tuple(sorted(found, key=by_number))

    def contents(self, name: str) -> tuple[str, ...]:
        """What is directly in, on or at a thing."""
        found = {f[1] for r in self.domain.containing for f in self._index.get((r, 1, name), ())}
        return tuple(sorted(found, key=by_number))

    def place(self, name: str) -> Place | None:
        """Where a thing is."""
        for relation in self.domain.containing:
            for fact in self._index.get((relation, 0, name), ()):
                return Place(relation, fact[2])
        return None

    def chain(self, name: str) -> Iterator[Place]:
        """Where a thing is, where that is, and so on upwards."""
        seen = {name}
        place = self.place(name)
        while place is not None and place.parent not in seen:
            yield place
            seen.add(place.parent)
            place = self.place(place.parent)

    def root(self, name: str) -> str:
        """The outermost thing that has `name`, itself included."""
        return next((p.parent for p in reversed(list(self.chain(name)))), name)

    def matches(self, name: str) -> tuple[str, ...]:
        """Existing things that an instance or category name can mean."""
        if name in self.kinds:
            return (name,)
        canonical = self.domain.canonical(name)
        return (canonical,) if canonical in self.kinds else self.instances(canonical)

    def holds(self, literal: Literal) -> bool:
        """Whether a literal holds; a category name means "some instance of it".

        With the value "false" no instance may make it true. What no skill is about never holds.
        """
        if not decided(self.domain, literal):
            return False
        hands = self.domain.robot.hands
        choices = [
            (a,) if a in hands else (self.matches(a) or ((a,) if is_instance(a) else ()))
            for a in literal.args
        ]
        positive = Literal(literal.predicate, literal.args, "true")
        wanted = positive if literal.value == "false" else literal
        found = any(
            literal_truth(Literal(wanted.predicate, c, wanted.value), self, {}) == TRUE
            for c in product(*choices)
        )
        return not found if literal.value == "false" else found


def decided(domain: Domain, literal: Literal) -> bool:
    """Whether a state decides a literal; relations that no skill is about are geometry."""
    known = domain.predicates.get(literal.predicate)
    if known is None:
        return literal.predicate == LOCATED or domain.known_kind(literal.predicate)
    return known.kind is not PredicateKind.RELATION or literal.predicate in domain.moved
