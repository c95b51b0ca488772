"""Compiles formulas into functions that ground them over one set of things.

Once for each domain and formula; called by `ground`. Quantifiers become joins: the next variable
is taken from the relation, the static predicate or the tag that leaves the fewest things.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

from forestall.domain.formula import (
    And,
    Every,
    Fewer,
    Formula,
    Not,
    Or,
    Parameter,
    Some,
    free,
    normal,
)
from forestall.domain.model import FACING, LOCATED, SAME, SAME_CATEGORY, Domain
from forestall.domain.schema import PredicateKind
from forestall.planning.nodes import Node, all_of, any_of, at_least, negate
from forestall.planning.world import Names, World
from forestall.types.facts import Literal

Ground = Callable[[World, Names], Node]
Join = Callable[[World, Names], Iterator[tuple[dict[str, str], Node]]]
Source = Callable[[World, Names], Sequence[str]]
Trace = Callable[[World, tuple[str, ...]], Sequence[str]]


class Schemas:
    """The compiled formulas of one domain."""

    def __init__(self, domain: Domain) -> None:
        self.domain = domain
        self._formulas: dict[int, tuple[Formula, Ground]] = {}
        self._free: dict[int, tuple[Formula, frozenset[str]]] = {}
        self._traces: dict[tuple[str, int], Trace | None] = {}
        self._normal: dict[tuple[int, bool], tuple[Formula, Formula]] = {}
        self._joins: dict[object, tuple[Formula, Join]] = {}

    def normal(self, formula: Formula, positive: bool = True) -> Formula:
        """The negation normal form, made once."""
        key = (id(formula), positive)
        found = self._normal.get(key)
        if found is None or found[0] is not formula:
            found = self._normal[key] = (formula, normal(formula, positive))
        return found[1]

    def formula(self, formula: Formula) -> Ground:
        """The function that grounds a formula whose free variables are bound."""
        found = self._formulas.get(id(formula))
        if found is None or found[0] is not formula:
            found = (formula, self._compile(normal(formula), free(formula)))
            self._formulas[id(formula)] = found
        return found[1]

    def free(self, formula: Formula) -> frozenset[str]:
        """The free variables of a formula."""
        found = self._free.get(id(formula))
        if found is None or found[0] is not formula:
            found = self._free[id(formula)] = (formula, free(formula))
        return found[1]

    def join(
        self, variables: tuple[Parameter, ...], formula: Formula, bound: frozenset[str]
    ) -> Join:
        """The function that gives every binding of variables, with the node that it needs."""
        key = (variables, id(formula), bound)
        found = self._joins.get(key)
        if found is None or found[0] is not formula:
            found = (formula, self._join(variables, normal(formula), bound))
            self._joins[key] = found
        return found[1]

    # --- formulas --------------------------------------------------------------------------------

    def _compile(self, formula: Formula, bound: frozenset[str]) -> Ground:
        if isinstance(formula, Literal):
            return self._literal(formula)
        if isinstance(formula, Not):
            inner = self._compile(formula.part, bound)
            return lambda w, names: negate(inner(w, names))
        if isinstance(formula, And | Or):
            parts = sorted(formula.parts, key=self._cost)
            several = [self._compile(p, bound) for p in parts]
            join = all_of if isinstance(formula, And) else any_of
            return lambda w, names: join(part(w, names) for part in several)
        if isinstance(formula, Some):
            solved = self._join(formula.variables, formula.part, bound)
            return lambda w, names: any_of(n for _, n in solved(w, names))
        if isinstance(formula, Every):
            denied = self._join(formula.variables, normal(formula.part, False), bound)
            return lambda w, names: all_of(negate(n) for _, n in denied(w, names))
        return self._fewer(formula, bound)

    def _fewer(self, formula: Fewer, bound: frozenset[str]) -> Ground:
        solved = self._join((formula.variable,), formula.part, bound)
        limit, of = formula.bound, formula.of

        def ground(w: World, names: Names) -> Node:
            count = limit if isinstance(limit, int) else w.number(names.get(of, of), limit)
            if count is None:
                return True
            found = [n for _, n in solved(w, names)]
            return at_least(len(found) - count + 1, [negate(n) for n in found])

        return ground

    def _literal(self, literal: Literal) -> Ground:
        predicate, args, value = literal.predicate, literal.args, literal.value
        known = self.domain.predicates.get(predicate)
        if known is not None and known.kind is PredicateKind.ATTRIBUTE:
            thing = args[0]
            return lambda w, names: w.value(names.get(thing, thing), predicate, value)
        ground = self._positive(predicate, args)
        if value == "false":
            return lambda w, names: negate(ground(w, names))
        return ground

    def _positive(self, predicate: str, args: tuple[str, ...]) -> Ground:
        known = self.domain.predicates.get(predicate)
        first = args[0] if args else ""
        last = args[-1] if args else ""
        if known is None:
            if predicate == SAME:
                return lambda w, names: names.get(first, first) == names.get(last, last)
            if predicate == SAME_CATEGORY:
                return lambda w, n: w.same_category(n.get(first, first), n.get(last, last))
            if predicate == LOCATED:
                return lambda w, names: w.located(names.get(first, first))
            if predicate == FACING:
                return lambda w, names: w.faced(names.get(first, first))
            return lambda w, names: w.is_a(names.get(first, first), predicate)
        if known.kind is PredicateKind.STATIC:
            return lambda w, names: w.static(predicate, tuple([names.get(a, a) for a in args]))
        if known.kind is PredicateKind.DERIVED:
            return lambda w, names: w.derived(predicate, tuple([names.get(a, a) for a in args]))
        return lambda w, names: w.fact(predicate, tuple([names.get(a, a) for a in args]))

    def _cost(self, formula: Formula) -> int:
        if isinstance(formula, Not):
            return self._cost(formula.part)
        if not isinstance(formula, Literal):
            return 3 if isinstance(formula, And | Or) else 4
        known = self.domain.predicates.get(formula.predicate)
        if known is None or known.kind is PredicateKind.STATIC:
            return 0
        return 2 if known.kind is PredicateKind.DERIVED else 1

    # --- joins -----------------------------------------------------------------------------------

    def _join(
        self, variables: tuple[Parameter, ...], formula: Formula, bound: frozenset[str]
    ) -> Join:
        waiting = [(p, free(p)) for p in sorted(_conjuncts(formula), key=self._cost)]
        first = [p for p, names in waiting if not names - bound_here(bound, variables)]
        waiting = [(p, names) for p, names in waiting if names - bound_here(bound, variables)]
        now = bound - {v.name for v in variables}
        before = [self._compile(p, now) for p in first]
        steps: list[tuple[str, Source, str | None, list[Ground]]] = []
        left = list(variables)
        while left:
            ranked = []
            for variable in left:
                unbound = {v.name for v in left}
                options = [
                    s
                    for p, _ in waiting
                    if (s := self._source(p, variable.name, unbound)) is not None
                ]
                if variable.kind is not None:
                    options.append((4, _kind(variable.kind)))
                rank, source = min(options, key=lambda o: o[0], default=(9, _everything))
                ranked.append((rank, left.index(variable), variable, source))
            _, _, variable, source = min(ranked, key=lambda r: r[:2])
            left.remove(variable)
            now = now | {variable.name}
            unbound = {v.name for v in left}
            ready = [p for p, names in waiting if not names & unbound]
            waiting = [(p, names) for p, names in waiting if names & unbound]
            checks = [self._compile(p, now) for p in ready]
            steps.append((variable.name, source, variable.kind, checks))
        return _joined(before, steps)

    def _source(self, part: Formula, variable: str, unbound: set[str]) -> tuple[int, Source] | None:
        """Where the things come from for which a part can be true."""
        if isinstance(part, Or):
            several = [self._source(p, variable, unbound) for p in part.parts]
            known = [s for s in several if s is not None]
            if not known or len(known) < len(several):
                return None
            sources = [s for _, s in known]
            return max(r for r, _ in known), _union(sources)
        if isinstance(part, And):
            found = [self._source(p, variable, unbound) for p in part.parts]
            return min((f for f in found if f is not None), key=lambda f: f[0], default=None)
        if not isinstance(part, Literal) or variable not in part.args or part.value == "false":
            return None
        predicate, args = part.predicate, part.args
        known_predicate = self.domain.predicates.get(predicate)
        others = (set(args) & unbound) - {variable}
        position = args.index(variable)
        if known_predicate is None:
            return self._built_in(part, variable, others)
        kind = known_predicate.kind
        if kind is PredicateKind.ATTRIBUTE:
            return 5, _kind(f"has_{predicate}")
        if others or args.count(variable) > 1:
            return None
        if kind is PredicateKind.DERIVED:
            traced = self._traced(predicate, position)
            if traced is None:
                return None
            return 3, lambda w, n: traced(w, tuple([n.get(a, a) for a in args]))
        if kind is PredicateKind.RELATION:
            return 1, lambda w, n: w.related(
                predicate, position, tuple([n.get(a, a) for a in args])
            )
        if kind is PredicateKind.STATIC:
            return 2, lambda w, n: w.static_related(
                predicate, position, tuple([n.get(a, a) for a in args])
            )
        return None

    def _traced(self, predicate: str, position: int) -> Trace | None:
        """What may stand at a position of a derived fact, the rest being given.

        Its definition must say so: each of its alternatives by a relation, or, where it leads back
        to itself, by a relation to something that stands there.
        """
        key = (predicate, position)
        if key not in self._traces:
            self._traces[key] = None
            self._traces[key] = self._trace(predicate, position)
        return self._traces[key]

    def _trace(self, predicate: str, position: int) -> Trace | None:
        known = self.domain.predicates[predicate]
        assert known.definition is not None
        roles = [p.name for p in known.parameters]
        variable = roles[position]
        direct: list[Source] = []
        links: list[tuple[str, Source]] = []
        for part in _disjuncts(normal(known.definition)):
            inner = part.part if isinstance(part, Some) else part
            conjuncts = _conjuncts(inner)
            back = next(
                (c for c in conjuncts if isinstance(c, Literal) and c.predicate == predicate), None
            )
            own = {v.name for v in part.variables} if isinstance(part, Some) else set()
            if back is None:
                found = self._best_source(conjuncts, variable, {variable} | own)
                if found is None:
                    return None
                direct.append(found)
                continue
            via = back.args[position]
            rest = [a for i, a in enumerate(back.args) if i != position]
            if via not in own or rest != [r for i, r in enumerate(roles) if i != position]:
                return None
            found = self._best_source(conjuncts, variable, {variable} | (own - {via}))
            if found is None:
                return None
            links.append((via, found))
        return _follow(roles, position, direct, links)

    def _best_source(
        self, conjuncts: Sequence[Formula], variable: str, unbound: set[str]
    ) -> Source | None:
        found = [s for c in conjuncts if (s := self._source(c, variable, unbound)) is not None]
        best = min(found, key=lambda s: s[0], default=None)
        return None if best is None or best[0] > 3 else best[1]

    @staticmethod
    def _built_in(part: Literal, variable: str, others: set[str]) -> tuple[int, Source] | None:
        predicate = part.predicate
        if predicate == SAME and not others and set(part.args) != {variable}:
            other = part.args[1] if part.args[0] == variable else part.args[0]
            return 0, lambda w, names: (names.get(other, other),)
        if predicate in (SAME, SAME_CATEGORY, LOCATED, FACING):
            return None
        return 4, _kind(predicate)


def schemas_of(domain: Domain) -> Schemas:
    """The compiled formulas of a domain, made once and kept with it."""
    found = domain.__dict__.get("_schemas")
    if found is None:
        found = domain.__dict__["_schemas"] = Schemas(domain)
    return found


def bound_here(bound: frozenset[str], variables: Iterable[Parameter]) -> frozenset[str]:
    """What is bound before any of the variables is."""
    return bound - {v.name for v in variables}


def _disjuncts(formula: Formula) -> tuple[Formula, ...]:
    if isinstance(formula, Or):
        return tuple(c for p in formula.parts for c in _disjuncts(p))
    return (formula,)


def _follow(
    roles: list[str], position: int, direct: list[Source], links: list[tuple[str, Source]]
) -> Trace:
    """Things that a relation leads to, and on from those that were found."""

    def trace(w: World, args: tuple[str, ...]) -> Sequence[str]:
        names = {r: a for i, (r, a) in enumerate(zip(roles, args, strict=True)) if i != position}
        found = dict.fromkeys(x for source in direct for x in source(w, names))
        waiting = list(found)
        while waiting:
            thing = waiting.pop()
            for via, source in links:
                for name in source(w, {**names, via: thing}):
                    if name not in found:
                        found[name] = None
                        waiting.append(name)
        return tuple(found)

    return trace


def _conjuncts(formula: Formula) -> tuple[Formula, ...]:
    if isinstance(formula, And):
        return tuple(c for p in formula.parts for c in _conjuncts(p))
    return (formula,)


def _kind(kind: str) -> Source:
    return lambda w, names: w.of_kind(kind)


def _everything(world: World, names: Names) -> Sequence[str]:
    return world.things()


def _union(sources: list[Source]) -> Source:
    return lambda w, names: tuple(dict.fromkeys(x for s in sources for x in s(w, names)))


def _joined(
    before: list[Ground], steps: list[tuple[str, Source, str | None, list[Ground]]]
) -> Join:
    last = len(steps)

    def walk(
        w: World, names: dict[str, str], at: int, nodes: list[Node]
    ) -> Iterator[tuple[dict[str, str], Node]]:
        if at == last:
            node = all_of(nodes)
            if node is not False:
                for variable, _, _, _ in steps:
                    node = w.existing(names[variable], node)
                yield names, node
            return
        variable, source, kind, checks = steps[at]
        for thing in source(w, names):
            if kind is not None and not w.is_a(thing, kind):
                continue
            own = {**names, variable: thing}
            found = list(nodes)
            for check in checks:
                node = check(w, own)
                if node is False:
                    break
                if node is not True:
                    found.append(node)
            else:
                yield from walk(w, own, at + 1, found)

    def run(w: World, names: Names) -> Iterator[tuple[dict[str, str], Node]]:
        nodes = []
        for check in before:
            node = check(w, names)
            if node is False:
                return
            if node is not True:
                nodes.append(node)
        yield from walk(w, dict(names), 0, nodes)

    return run
