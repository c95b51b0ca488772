"""What a wanted fact needs, and what that needs: the things that can play a part.

Called by `relevance`. Goes backwards over the schemas: what can bring a fact about, what that asks
for, and for every open parameter the most promising thing of each category.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from forestall.domain.formula import (
    And,
    Every,
    Fewer,
    Formula,
    Not,
    Or,
    Some,
    asks,
)
from forestall.domain.schema import Copy, PredicateKind, Process, Skill
from forestall.planning.needs import conjuncts
from forestall.planning.possible import Names, Possible, Way
from forestall.planning.state import State
from forestall.types.facts import Literal, by_number

DEPTH = 9
NEAR = 3
"""What was looked at less than so many steps before that is looked at again from nearer."""
MANY = 12
"""Of more bindings than this only those are looked at for which most holds already."""
GROUPS = 4
"""How many categories of things are tried for one open parameter."""


class Closure:
    """Collects what is needed, until nothing more is.

    Args:
        state: the first state.
        world: what is possible in it.
        shunned: things that are taken last where others will do.
    """

    def __init__(self, state: State, world: Possible, shunned: frozenset[str]) -> None:
        self.shunned = shunned
        self.state, self.domain = state, state.domain
        self.world, self.schemas = world, world.schemas
        self.kept: set[str] = set()
        self.made: dict[tuple[str, str, str], tuple[str, ...]] = {}
        self.purposeful: set[str] = set()
        self.cleared: set[str] = set()
        self.visited: dict[tuple[object, ...], int] = {}

    def keep(self, names: Iterable[str]) -> None:
        """Keep things, with what has them, what blocks them, and what fills a limited place."""
        state, roles = self.state, self.domain.roles
        waiting = list(names)
        while waiting:
            name = waiting.pop()
            if name in self.kept or name not in state.kinds:
                continue
            self.kept.add(name)
            waiting += [p.parent for p in state.chain(name)]
            if roles.blocking is not None:
                waiting += state.related(roles.blocking, 0, ("?", name))
            category = state.kind(name)
            if category.numbers or roles.movable in category.tags:
                waiting += state.contents(name)

    def use(self, name: str) -> None:
        """Keep a thing that may be put anywhere it fits."""
        if name in self.state.kinds:
            self.keep((name,))
            self.purposeful.add(name)
        elif name in self.world.source_of:
            self._make(name)

    def _make(self, name: str) -> None:
        source, skill_name, variable = self.world.source_of[name]
        key = (source, skill_name, variable)
        self.purposeful.add(name)
        known = self.made.get(key, ())
        if name in known:
            return
        self.made[key] = tuple(sorted({*known, name}, key=by_number))
        self.keep((source,))
        skill = self.domain.skills[skill_name]
        if skill.at == variable and any(skill.hand or c.only_if for c in skill.deciding):
            self.purposeful.add(source)
        make = next(m for m in skill.makes if m.variable == variable)
        for need in skill.needs:
            self.need(need.formula, {make.source: source, variable: name}, 1)

    # --- goals -----------------------------------------------------------------------------------

    def want(self, part: Formula) -> None:
        """Keep what can bring a part of a goal about; a denial that holds asks for nothing."""
        literal = part.part if isinstance(part, Not) else part
        assert isinstance(literal, Literal)
        denied = isinstance(part, Not) or literal.value == "false"
        if denied and self.state.true(part):
            return
        known = self.domain.predicates.get(literal.predicate)
        if known is not None and known.kind is PredicateKind.HISTORY and denied:
            return
        for arg in literal.args:
            self.use(arg)
        if literal.predicate == self.domain.roles.unblocked:
            self.cleared.update(literal.args)
        self.need(part, {}, 0, always=True)

    # --- needs -----------------------------------------------------------------------------------

    def need(self, formula: Formula, names: Names, depth: int, always: bool = False) -> None:
        """Keep what can make a formula true."""
        self.world.in_time()
        if depth > DEPTH or not self.schemas.free(formula) <= names.keys():
            return
        if always or not self.state.true(formula, names):
            self._need(self.schemas.normal(formula), names, depth)
        else:
            self._rely(self.schemas.normal(formula), names)

    def _rely(self, formula: Formula, names: Names) -> None:
        """Keep by what a formula is true: without its witnesses a narrowed problem denies it."""
        waiting = [(formula, names)]
        while waiting:
            one, known = waiting.pop()
            waiting += reversed(list(self._reasons(one, known)))

    def _reasons(self, formula: Formula, names: Names) -> Iterator[tuple[Formula, Names]]:
        """By what, one step further, a formula is true."""
        if isinstance(formula, Literal):
            known = self.domain.predicates.get(formula.predicate)
            args = formula.bind(names).args
            key = ("rely", formula.predicate, *args)
            if key in self.visited:  # definitions may lead back to themselves
                return
            self.visited[key] = 0
            if known is not None and known.definition is not None and formula.value == "true":
                inner = {p.name: a for p, a in zip(known.parameters, args, strict=True)}
                yield self.schemas.normal(known.definition), inner
        elif isinstance(formula, And | Or):
            yield from ((p, names) for p in formula.parts if self.state.true(p, names))
        elif isinstance(formula, Some):
            bound = next(self.state.bindings(formula.variables, formula.part, names), None)
            if bound is not None:
                self.keep(bound[v] for v in sorted(v.name for v in formula.variables))
                yield formula.part, bound

    def _need(self, formula: Formula, names: Names, depth: int) -> None:
        if isinstance(formula, Literal):
            self._achieve(formula.bind(names), depth)
        elif isinstance(formula, And):
            for part in formula.parts:
                self.need(part, names, depth)
        elif isinstance(formula, Or):
            for part in formula.parts:
                if self.schemas.formula(part)(self.world, names) is not False:
                    self.need(part, names, depth)
        elif isinstance(formula, Not):
            self._differ(formula.part, names, depth)
        else:
            self._quantified(formula, names, depth)

    def _quantified(self, formula: Some | Every | Fewer, names: Names, depth: int) -> None:
        if isinstance(formula, Some):
            join = self.schemas.join(formula.variables, formula.part, self.schemas.free(formula))
            found = [b for b, _ in join(self.world, names)]
            for bound in self._best(found, {v.name for v in formula.variables}):
                self.need(formula.part, bound, depth + 1)
            return
        denied = self.schemas.normal(formula.part, False)
        if isinstance(formula, Every):
            variables, against, wanted = formula.variables, denied, formula.part
        else:
            variables, against, wanted = (formula.variable,), formula.part, denied
        for bound in list(self.state.bindings(variables, against, names)):
            self.need(wanted, bound, depth + 1)

    def _differ(self, part: Formula, names: Names, depth: int) -> None:
        if isinstance(part, Literal):
            literal = part.bind(names)
            for value in self.domain.values(literal.predicate):
                if value != literal.value:
                    self._achieve(Literal(literal.predicate, literal.args, value), depth)

    def _best(self, found: Sequence[Names], new: set[str], most: int = GROUPS) -> list[Names]:
        """The most promising bindings, one for each combination of categories."""
        if len(found) == 1:
            self.keep(found[0][v] for v in new if v in found[0])
            return list(found)
        groups: dict[tuple[str, ...], list[Names]] = {}
        categories = self.world.categories
        for bound in found:
            key = tuple(categories.get(bound[v], "") for v in sorted(new) if v in bound)
            groups.setdefault(key, []).append(bound)
        best = [min(g, key=lambda b: [self._ease(b[v]) for v in sorted(new) if v in b])
                for g in groups.values()]  # fmt: skip
        best.sort(key=lambda b: [self._ease(b[v]) for v in sorted(new) if v in b])
        for bound in best[:most]:
            self.keep(bound[v] for v in new if v in bound)
        return best[:most]

    def _ease(self, name: str) -> tuple[object, ...]:
        rest = self.state.follow(("ease", name), lambda: self._judged(name))
        return (name in self.shunned, rest[0], name not in self.kept, *rest[1:])

    def _judged(self, name: str) -> tuple[object, ...]:
        state, roles = self.state, self.domain.roles
        if name not in state.kinds:
            return (True, True, True, True, by_number(name))
        held = any(h == name for _, h in state.in_hands())
        category = state.kind(name)
        shut_in = roles.accessible is not None and not state.says(roles.accessible, name)
        blocked = roles.unblocked is not None and not state.says(roles.unblocked, name)
        full = bool(category.numbers) and bool(state.contents(name))
        avoided = bool(category.tags & set(roles.avoid))
        fixed = roles.fixture in category.tags
        return (avoided, not held, not fixed, shut_in or blocked or full, by_number(name))

    def _achieve(self, literal: Literal, depth: int) -> None:
        key = (literal.predicate, *literal.args, literal.value)
        if depth > DEPTH or self.visited.get(key, DEPTH + 1) <= max(depth, DEPTH - NEAR):
            return  # anew only where it was cut off soon and would go further now
        self.visited[key] = depth
        known = self.domain.predicates.get(literal.predicate)
        if known is None or known.kind is PredicateKind.STATIC:
            return
        if known.kind is PredicateKind.DERIVED:
            assert known.definition is not None
            names = {p.name: a for p, a in zip(known.parameters, literal.args, strict=True)}
            definition = self.schemas.normal(known.definition, literal.value != "false")
            self.need(definition, names, depth)
            return
        if literal.value == "false":
            self._end(literal, depth)
            return
        if known.contains:
            self.use(literal.args[0])
        atom = (literal.predicate, *literal.args)
        for way in self.world.ways.get(literal.predicate, ()):
            if isinstance(way.what, Copy) or way.what.value == literal.value:
                self._follow(way, atom, literal, depth)

    def _follow(self, way: Way, atom: tuple[str, ...], literal: Literal, depth: int) -> None:
        bound = set(way.what.args) if isinstance(way.what, Literal) else {way.what.target}
        new = {p.name for p in way.schema.parameters if p.name not in bound}
        conditions = [way.effect.condition] if not way.effect.variables else []
        if isinstance(way.schema, Process):
            conditions.append(way.schema.condition)
        else:
            conditions += [n.formula for n in way.schema.needs]
            new |= {c.variable.name for c in way.schema.deciding}
        found = list(self.world.known_bindings(way, atom))
        if isinstance(way.what, Copy):
            copy = way.what
            if _denied(conditions, copy, literal.value):
                return
            having = [
                b
                for b in found
                if self.state.value(b[copy.source], copy.attribute) == literal.value
            ]
            kind = self.world.categories.get(atom[1], atom[1])
            movable = self.domain.is_a(kind, self.domain.roles.movable)
            found = having if having or movable else found
        hand = way.schema.hand if isinstance(way.schema, Skill) else None
        most = GROUPS if isinstance(way.schema, Process) or hand in new else 1
        if len(found) > MANY:
            found = self._nearest(way, found)
        for binding in self._best(found, new, most):
            for variable in new & binding.keys():
                if variable == hand or isinstance(way.schema, Process):
                    self.use(binding[variable])
            for condition in conditions:
                self.need(condition, binding, depth + 1)
            if isinstance(way.what, Copy):
                wanted = Literal(way.what.attribute, (binding[way.what.source],), literal.value)
                self.need(wanted, {}, depth + 1)

    def _nearest(self, way: Way, found: Sequence[Names]) -> list[Names]:
        """Of many bindings those for which most of what a skill asks for holds now."""
        parts = conjuncts(self.schemas.normal(way.simple))
        lacking = [sum(not self.state.true(p, b) for p in parts) for b in found]
        least = min(lacking)
        return [b for b, count in zip(found, lacking, strict=True) if count == least]

    def _end(self, literal: Literal, depth: int) -> None:
        """A relation is to end: what is there is taken away, or the skill that says so is used."""
        roles = self.domain.roles
        self.keep(literal.args)
        predicates = self.domain.predicates
        group = predicates[literal.predicate].group
        holding = roles.holding
        if holding is not None and literal.args:
            name = literal.args[0]
            related = group is not None and predicates[holding].group == group
            if (related and literal.predicate != holding) or literal.predicate == roles.blocking:
                if self.domain.is_a(self.world.categories.get(name, ""), roles.movable):
                    for hand in self.domain.robot.hands[:1]:
                        self._achieve(Literal(holding, (name, hand)), depth + 1)
                return
        for way in self.world.ways.get(f"not {literal.predicate}", ()):
            self._follow(way, (literal.predicate, *literal.args), literal, depth)
        for name, other in predicates.items() if group is not None else ():
            if other.group == group and name != literal.predicate:  # what begins ends the other
                atom = (name, literal.args[0], *("?" for _ in other.parameters[1:]))
                for way in self.world.ways.get(name, ()):
                    if asks((way.simple,), literal.predicate):
                        self._follow(way, atom, literal, depth)


def _denied(conditions: Sequence[Formula], copy: Copy, value: str) -> bool:
    """Whether a skill that copies a value asks that the source does not have it."""
    banned = Literal(copy.attribute, (copy.source,), value)
    return any(isinstance(f, Not) and f.part == banned for f in conditions)
