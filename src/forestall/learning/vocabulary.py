"""What demonstrations speak about: categories, attributes, relations, and what of it is a place.

Called by `learn`; calls `traces`. Nothing here knows what a word means: a relation says where a
thing is if a thing has it to one other thing at most, never both ways round, and skills change it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from forestall.domain.formula import Not, Or, Parameter, Some
from forestall.domain.schema import Category, Predicate, PredicateKind
from forestall.domain.spoken import by_name, denied
from forestall.learning.absences import Inside, Lack, lacking, placed
from forestall.learning.traces import Trace, graphs_of, hands_of
from forestall.types.facts import Literal
from forestall.types.graph import Relation, SceneGraph
from forestall.types.plan import Subtask

FIXED = "fixed"
HELD = "graspable"
TAKES = "takes_"
TAKER = "takes_things"
OTHER = "other"
PLACE = "place"
_MISTAKEN = 0.05
"""Share of moves of things that may be seen wrong."""


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """The words of some demonstrations.

    Args:
        hands: node ids of hands.
        holding: the relation of a thing to the hand that has it, None where none was ever seen.
        containing: relations that say where a thing is.
        relations: all of them, sorted.
        values: attribute → its values, the most frequent first.
        attributes: category → its attributes.
        lacks: derived facts, that nothing is related to a thing.
        insides: derived facts, that a thing is in nothing that is shut, or the like.
        vacant: which of them says that nothing is in or on it, None where nothing has a place.
        hand_empty: the derived fact that a hand is free, None where nothing was ever held.
        in_hand: the derived fact that one of several hands has a thing, None where there are none.
        exclusive: whether nothing was ever in two places at once, a hand being one.
        takers: relation → categories that took things in it.
        moved: categories of what was ever seen in a hand, or to change its place.
    """

    hands: tuple[str, ...]
    holding: str | None
    containing: tuple[str, ...]
    relations: tuple[str, ...]
    values: dict[str, tuple[str, ...]]
    attributes: dict[str, tuple[str, ...]]
    lacks: tuple[Lack, ...]
    insides: tuple[Inside, ...]
    vacant: str | None
    hand_empty: str | None
    in_hand: str | None
    exclusive: bool
    takers: dict[str, frozenset[str]]
    moved: frozenset[str]

    def lifted(
        self, graph: SceneGraph, subtask: Subtask, variables: Sequence[str]
    ) -> frozenset[Literal]:
        """What is true of a subtask's arguments in a graph, over the skill's variables.

        States of the arguments, relations between two of them or of one to a hand, of each what
        nothing is related to, and whether a hand is free. The world of a graph is closed as far as
        its nodes go: a relation that it does not have does not hold.
        """
        nodes = {
            a: (v, n)
            for a, v in zip(subtask.args, variables, strict=True)
            if (n := graph.get(a)) is not None
        }
        ends = {**{h: h for h in self.hands}, **{a: v for a, (v, _) in nodes.items()}}
        found: set[Literal] = set()
        for variable, node in nodes.values():
            found |= {Literal(a, (variable,), v) for a, v in node.states if v is not None}
            found |= {Literal(x.name, (variable,)) for x in self.lacks if x.holds(graph, node)}
            found |= {Literal(x.name, (variable,)) for x in self.insides if x.holds(graph, node)}
        for r in graph.relations:
            if r.subject in nodes and r.object in ends:
                found.add(Literal(r.predicate, (ends[r.subject], ends[r.object])))
            if self.in_hand and r.subject in nodes and r.object in self.hands:
                found.add(Literal(self.in_hand, (ends[r.subject],)))
        full = {r.object for r in graph.relations if r.predicate == self.holding}
        if self.hand_empty is not None and not full.issuperset(self.hands):
            found.add(Literal(self.hand_empty, ()))
        return frozenset(found)

    def predicates(self) -> dict[str, Predicate]:
        """Relations, attributes and derived facts as schemas."""
        group = PLACE if self.exclusive else None
        found: dict[str, Predicate] = {}
        for name in self.relations:
            contains = name in self.containing
            placing = contains or name == self.holding
            found[name] = Predicate(
                name,
                PredicateKind.RELATION,
                (Parameter("?thing"), Parameter("?other")),
                contains=contains,
                group=group if placing else None,
                offered_by=TAKES + name if contains else "",
                words=by_name(name, 2),
                opposite=denied(by_name(name, 2)),
            )
        for name, values in self.values.items():
            parameters = (Parameter("?thing"),)
            several = values if len(values) > 1 else (*values, OTHER)
            found[name] = Predicate(
                name, PredicateKind.ATTRIBUTE, parameters, several, material=False
            )
        for lack in self.lacks:
            found[lack.name] = lacking(lack, lack.name == self.vacant)
        for inside in self.insides:
            found[inside.name] = placed(inside)
        if self.hand_empty is not None and self.holding is not None:
            held = Parameter("?thing")
            free = [Not(Some((held,), Literal(self.holding, (held.name, h)))) for h in self.hands]
            found[self.hand_empty] = Predicate(
                self.hand_empty,
                PredicateKind.DERIVED,
                definition=free[0] if len(free) == 1 else Or(tuple(free)),
                words="a hand is free",
                opposite="no hand is free",
            )
        if self.in_hand is not None and self.holding is not None:
            thing = Parameter("?thing")
            ways = [Literal(self.holding, (thing.name, h)) for h in self.hands]
            found[self.in_hand] = Predicate(
                self.in_hand,
                PredicateKind.DERIVED,
                (thing,),
                definition=Or(tuple(ways)),
                words="{0} is in a hand",
                opposite="{0} is in no hand",
            )
        return found

    def categories(self, names: Iterable[str]) -> dict[str, Category]:
        """Every category with what its things were seen to be."""
        return {
            name: Category(
                name,
                frozenset(
                    (
                        *((HELD,) if name in self.moved else ()),
                        *((FIXED,) if name in self.taking - self.moved else ()),
                        *(TAKES + r for r, who in self.takers.items() if name in who),
                        *((TAKER,) if name in self.taking else ()),
                    )
                ),
                self.attributes.get(name, ()),
            )
            for name in sorted(names)
        }

    def tags(self) -> tuple[str, ...]:
        """Every tag."""
        return (FIXED, HELD, TAKER, *(TAKES + r for r in self.containing))

    @property
    def taking(self) -> frozenset[str]:
        """Categories in or on which something was ever seen."""
        return frozenset(c for who in self.takers.values() for c in who)


def vocabulary(found: Sequence[Trace], hands: Sequence[str] | None = None) -> Vocabulary:
    """The words of some demonstrated steps.

    Args:
        found: the steps.
        hands: node ids of hands; those that are called grippers by default.
    """
    graphs = graphs_of(found)
    known = hands_of(graphs) if hands is None else tuple(hands)
    used = Counter(r.predicate for g in graphs for r in g.relations)
    held = Counter(r.predicate for g in graphs for r in g.relations if r.object in known)
    holding = held.most_common(1)[0][0] if held else None
    changed = _changed(found)
    others = sorted(p for p in used if p != holding)
    containing = tuple(
        p for p in others if p in changed and _functional(graphs, p) and _one_way(graphs, p)
    )
    taken = {p: _ends(graphs, p, 1) for p in containing}
    places = (*containing, *((holding,) if holding else ()))
    moving = {changed[p] for p in places if p in changed}
    if holding is not None:
        moving.add(_ends(graphs, holding, 0))
    takers = frozenset(c for who in taken.values() for c in who)
    names = set(used)
    lacks = _lacks(others, containing, takers, names)
    return Vocabulary(
        hands=known,
        holding=holding,
        containing=containing,
        relations=tuple(sorted(used)),
        values=_values(graphs),
        attributes=_attributes(graphs),
        lacks=lacks,
        insides=_insides(found, containing, names),
        vacant=lacks[0].name if containing else None,
        hand_empty=_free("hand_empty", names) if holding and known else None,
        in_hand=_free("in_hand", names) if holding and len(known) > 1 else None,
        exclusive=bool(places) and _exclusive(graphs, places),
        takers=taken,
        moved=frozenset(x for names in moving for x in names),
    )


def _lacks(
    others: Sequence[str], containing: tuple[str, ...], takers: frozenset[str], taken: set[str]
) -> tuple[Lack, ...]:
    """Whether nothing is in or on a thing; and of each other relation, whether nothing has it."""
    found = [Lack(_free("vacant", taken), containing, 1, takers)] if containing else []
    for name in others:
        if name not in containing:
            found.append(Lack(_free(f"nothing_{name}", taken), (name,), 1))
        found.append(Lack(_free(f"{name}_nothing", taken), (name,), 0))
    return tuple(found)


def _insides(
    found: Sequence[Trace], containing: tuple[str, ...], taken: set[str]
) -> tuple[Inside, ...]:
    """Of places, the states that shut things in: skills end them, and move nothing before that."""
    ended: set[tuple[str, str, str]] = set()
    moved: Counter[tuple[str, str, str]] = Counter()
    for t in found:
        if t.after is None:
            continue
        before, after = set(t.before.relations), set(t.after.relations)
        for r in before | after:
            place, later = t.before.get(r.object), t.after.get(r.object)
            if r.predicate not in containing or place is None or later is None:
                continue
            for attribute, value in place.states:
                if value is not None and (r in before) is not (r in after):
                    moved[r.predicate, attribute, value] += 1
                elif value is not None and later.state(attribute) not in (value, None):
                    ended.add((r.predicate, attribute, value))
    every: Counter[tuple[str, str]] = Counter()
    for (relation, attribute, _), times in moved.items():
        every[relation, attribute] += times
    return tuple(
        Inside(_free(f"{relation}_nothing_{value}", taken), relation, attribute, value)
        for relation, attribute, value in sorted(ended)
        if moved[relation, attribute, value] <= _MISTAKEN * every[relation, attribute]
    )


def _free(name: str, taken: set[str]) -> str:
    while name in taken:
        name += "_"
    taken.add(name)
    return name


def _changed(found: Iterable[Trace]) -> dict[str, frozenset[str]]:
    """Relation → the categories of the things that began or ceased to have it."""
    changed: dict[str, set[str]] = {}
    for t in found:
        if t.after is None:
            continue
        for r in set(t.before.relations) ^ set(t.after.relations):
            node = t.before.get(r.subject) or t.after.get(r.subject)
            if node is not None:
                changed.setdefault(r.predicate, set()).add(node.category)
    return {p: frozenset(c) for p, c in changed.items()}


def _of(graph: SceneGraph, predicate: str) -> list[Relation]:
    return [r for r in graph.relations if r.predicate == predicate]


def _functional(graphs: Iterable[SceneGraph], predicate: str) -> bool:
    """Whether every thing has the relation to one other at most."""
    return all(
        max(Counter(r.subject for r in _of(g, predicate)).values(), default=0) <= 1 for g in graphs
    )


def _one_way(graphs: Iterable[SceneGraph], predicate: str) -> bool:
    return not any(
        Relation(r.object, predicate, r.subject) in g.relations
        for g in graphs
        for r in _of(g, predicate)
    )


def _exclusive(graphs: Iterable[SceneGraph], places: Sequence[str]) -> bool:
    """Whether no thing ever had two places."""
    return all(
        max(Counter(r.subject for r in g.relations if r.predicate in places).values(), default=0)
        <= 1
        for g in graphs
    )


def _ends(graphs: Iterable[SceneGraph], predicate: str, position: int) -> frozenset[str]:
    found = set()
    for g in graphs:
        for r in _of(g, predicate):
            node = g.get((r.subject, r.object)[position])
            if node is not None:
                found.add(node.category)
    return frozenset(found)


def _values(graphs: Iterable[SceneGraph]) -> dict[str, tuple[str, ...]]:
    """Attribute → values, the most frequent first, ties by name."""
    counted: dict[str, Counter[str]] = {}
    for g in graphs:
        for n in g.nodes:
            for attribute, value in n.states:
                if value is not None:
                    counted.setdefault(attribute, Counter())[value] += 1
    return {
        a: tuple(v for v, _ in sorted(c.items(), key=lambda x: (-x[1], x[0])))
        for a, c in sorted(counted.items())
    }


def _attributes(graphs: Iterable[SceneGraph]) -> dict[str, tuple[str, ...]]:
    found: dict[str, set[str]] = {}
    for g in graphs:
        for n in g.nodes:
            known = {a for a, v in n.states if v is not None}
            found.setdefault(n.category, set()).update(known)
    return {c: tuple(sorted(a)) for c, a in found.items()}
