"""Which things of a scene a planning problem is about.

Called by `planner` before grounding. Goes backwards over the schemas: what can bring a wanted fact
about, what that needs, and for every open parameter the most promising thing of each category.
Where the narrowed problem has no plan the planner takes `everything`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from forestall.domain.evaluate import TRUE, by_number, evaluate, solutions
from forestall.domain.formula import (
    And,
    Every,
    Fewer,
    Formula,
    Not,
    Or,
    Some,
    free,
    normal,
)
from forestall.domain.model import Copy, Domain, Effect, PredicateKind, Process, Skill
from forestall.planning.goals import Conjunction, Made, makeable
from forestall.planning.ground import plain_parts, simple_needs
from forestall.planning.grounder import Grounder, Universe
from forestall.planning.nodes import Node
from forestall.planning.schemas import schemas_of
from forestall.planning.state import State
from forestall.types.facts import Literal

DEPTH = 9
GROUPS = 4
"""How many categories of things are tried for one open parameter."""

Names = dict[str, str]


@dataclass(frozen=True, slots=True)
class _Way:
    """A fact or a copy in an effect of a skill or a process."""

    schema: Skill | Process
    effect: Effect
    what: Literal | Copy
    simple: Formula


def everything(state: State) -> Universe:
    """All things, without a limit to where they are put."""
    things = tuple(sorted(state.kinds, key=by_number))
    made = makeable(state)
    kinds = {state.domain.canonical(n.rpartition("-")[0]) for ns in made.values() for n in ns}
    makers = {r[0] for s in state.domain.skills.values() for m in s.makes
              for r in state.domain.statics.get(m.by, ())}  # fmt: skip
    lasting = any(
        m.source not in {v for e in s.effects for v in e.gone}
        for s in state.domain.skills.values()
        for m in s.makes
    )
    return Universe(things, made, bounded=lasting or bool(kinds & makers))


def narrowed(
    state: State, goals: Sequence[Conjunction], also: Iterable[str] = (), supports: int = 2
) -> Universe:
    """The things that matter for any of the goals.

    Args:
        state: the first state.
        goals: ground alternatives.
        also: further things to keep.
        supports: how many supports to keep for putting things away.
    """
    closure = _Closure(state)
    closure.keep(h for _, h in state.in_hands())
    closure.keep(x for x in also if x in state.kinds)
    parts = tuple(dict.fromkeys(p for goal in goals for p in goal))
    for _ in range(2):
        closure.visited.clear()
        for part in parts:
            closure.want(part)
    chosen = _supports(state, closure.kept, closure.cleared)[:supports]
    closure.keep(chosen)
    things = tuple(sorted((x for x in closure.kept if x not in state.lost), key=by_number))
    return Universe(things, closure.made, frozenset(closure.purposeful), tuple(chosen))


def _supports(state: State, kept: set[str], avoid: set[str]) -> list[str]:
    """Supports in order of preference: room first, not where something is to be cleared."""
    domain = state.domain
    roots = {state.root(x) for x in avoid}
    order = domain.roles.rest
    found = []
    for name, category in state.kinds.items():
        kinds = domain.kinds(category)
        ranks = [i for i, tag in enumerate(order) if tag in kinds]
        if ranks and not kinds & set(domain.roles.avoid):
            key = (name in state.crowded, name in roots, ranks[0], name not in kept)
            found.append((key, by_number(name), name))
    return [name for _, _, name in sorted(found)]


class _Possible(Grounder):
    """All things, with every relation that some skill could bring about (a `schemas.World`)."""

    def __init__(self, state: State, made: Made) -> None:
        things = tuple(sorted((x for x in state.kinds if x not in state.lost), key=by_number))
        super().__init__(state, Universe(things, made), schemas_of(state.domain))
        self.ways = _ways(state.domain)
        self.source_of = {
            n: (source, skill, variable)
            for (source, skill, variable), names in made.items()
            for n in names
        }
        self._can: dict[tuple[str, ...], bool] = {}
        self._options: dict[tuple[object, ...], tuple[str, ...]] = {}

    def fact(self, predicate: str, args: tuple[str, ...]) -> Node:
        """A relation that holds or could be brought about."""
        atom = (predicate, *args)
        found = self._can.get(atom)
        if found is None:
            self._can[atom] = False
            found = atom in self.state.facts or any(
                True for way in self.ways.get(predicate, ()) for _ in self.bindings(way, atom)
            )
            self._can[atom] = found
        return self.number_of(atom) if found else False

    def related(self, predicate: str, position: int, args: tuple[str, ...]) -> Sequence[str]:
        """What stands at a position or could be brought there."""
        key = (predicate, position, *args[:position], *args[position + 1 :])
        found = self._options.get(key)
        if found is None:
            self._options[key] = ()
            names = dict.fromkeys(self.state.related(predicate, position, args))
            atom = (predicate, *(a if i != position else "?" for i, a in enumerate(args)))
            for way in self.ways.get(predicate, ()):
                assert isinstance(way.what, Literal)
                open_name = way.what.args[position]
                for bound in self.bindings(way, atom):
                    name = bound.get(open_name)
                    if name is not None:
                        names[name] = None
            found = self._options[key] = tuple(names)
        return found

    def bindings(self, way: _Way, atom: tuple[str, ...]) -> Iterator[Names]:
        """Bindings of a schema's parameters by which a way leads to a fact."""
        names: Names = {}
        args = way.what.args if isinstance(way.what, Literal) else (way.what.target,)
        for variable, name in zip(args, atom[1:], strict=False):
            if name.startswith("?"):
                continue
            if not variable.startswith("?"):
                if variable != name:
                    return
            elif names.setdefault(variable, name) != name:
                return
        yield from self.completed(way, names)

    def completed(self, way: _Way, names: Names) -> Iterator[Names]:
        """Bindings of what is still open."""
        schema = way.schema
        if isinstance(schema, Skill):
            for make in schema.makes:
                piece = names.get(make.variable)
                if piece is not None:
                    source = self.source_of.get(piece)
                    if source is None or source[1:] != (schema.name, make.variable):
                        return
                    if names.setdefault(make.source, source[0]) != source[0]:
                        return
            names = dict(names)
            for make in schema.makes:
                mine = self.universe.made.get((names.get(make.source, ""), schema.name, make.variable))
                if mine and make.variable not in names:
                    names[make.variable] = mine[0]
        for parameter in schema.parameters:
            name = names.get(parameter.name)
            if name is not None and name not in self.categories:
                return
            if name is not None and parameter.kind and not self.is_a(name, parameter.kind):
                return
        left = tuple(p for p in schema.parameters if p.name not in names)
        join = self.schemas.join(left, way.simple, frozenset(names) & self.schemas.free(way.simple))
        for bound, _ in join(self, names):
            yield from self._chosen(way, bound)

    def _chosen(self, way: _Way, names: Names) -> Iterator[Names]:
        schema, several = way.schema, [names]
        for choice in schema.choices if isinstance(schema, Skill) else ():
            variable = choice.variable.name
            if variable in names:
                continue
            more = []
            for known in several:
                found = []
                for formula in (*choice.among, choice.such_that):
                    plain = plain_parts(self.domain, formula)
                    if plain.parts and self.schemas.free(plain) - {variable} <= known.keys():
                        join = self.schemas.join((choice.variable,), plain, frozenset(known))
                        found = [{**known, variable: b[variable]} for b, _ in join(self, known)]
                        if found:
                            break
                more += found or [known]
            several = more
        for known in several:
            own = {v.name for v in way.effect.variables}
            needed = self.schemas.free(way.effect.condition) - own
            if needed <= known.keys():
                condition = way.effect.condition
                if own:
                    open_now = tuple(v for v in way.effect.variables if v.name not in known)
                    bound = frozenset(self.schemas.free(condition)) & frozenset(known)
                    join = self.schemas.join(open_now, condition, bound)
                    if any(True for _ in join(self, known)):
                        yield known
                elif self.schemas.formula(condition)(self, known) is not False:
                    yield known


class _Closure:
    """Collects what is needed, until nothing more is."""

    def __init__(self, state: State) -> None:
        self.state, self.domain = state, state.domain
        self.all_made = makeable(state)
        self.world = _Possible(state, self.all_made)
        self.schemas = self.world.schemas
        self.kept: set[str] = set()
        self.made: dict[tuple[str, str, str], tuple[str, ...]] = {}
        self.purposeful: set[str] = set()
        self.cleared: set[str] = set()
        self.visited: set[tuple[object, ...]] = set()
        self._eases: dict[str, tuple[object, ...]] = {}

    def keep(self, names: Iterable[str]) -> None:
        """Keep things, with what has them, what blocks them, and what fills a limited place."""
        state, roles = self.state, self.domain.roles
        for name in names:
            if name in self.kept or name not in state.kinds:
                continue
            self.kept.add(name)
            self.keep(p.parent for p in state.chain(name))
            if roles.blocking is not None:
                self.keep(state.related(roles.blocking, 0, ("?", name)))
            category = state.kind(name)
            if category.numbers or roles.movable in category.tags:
                self.keep(state.contents(name))

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
        if skill.at == variable and any(skill.hand or c.only_if for c in skill.choices):
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
        if denied and evaluate(part, self.state, {}) == TRUE:
            return
        known = self.domain.predicates.get(literal.predicate)
        if known is not None and known.kind is PredicateKind.HISTORY:
            if denied:
                return
        for arg in literal.args:
            self.use(arg)
        if literal.predicate in (self.domain.roles.unblocked, self.domain.roles.vacant):
            self.cleared.update(a for a in literal.args if literal.predicate == self.domain.roles.unblocked)
        self.need(part, {}, 0, always=True)

    # --- needs -----------------------------------------------------------------------------------

    def need(self, formula: Formula, names: Names, depth: int, always: bool = False) -> None:
        """Keep what can make a formula true."""
        if depth > DEPTH or not self.schemas.free(formula) <= names.keys():
            return
        if not always and evaluate(formula, self.state, names) == TRUE:
            self._rely(normal(formula), names)
            return
        self._need(self.schemas.normal(formula), names, depth)

    def _rely(self, formula: Formula, names: Names) -> None:
        """Keep by what a formula is true: without its witnesses a narrowed problem denies it."""
        if isinstance(formula, Literal):
            known = self.domain.predicates.get(formula.predicate)
            args = formula.bind(names).args
            key = ("rely", formula.predicate, *args)
            if key in self.visited:  # definitions may lead back to themselves
                return
            self.visited.add(key)
            if known is not None and known.definition is not None and formula.value == "true":
                inner = {p.name: a for p, a in zip(known.parameters, args, strict=True)}
                self._rely(normal(known.definition), inner)
        elif isinstance(formula, And | Or):
            for part in formula.parts:
                if evaluate(part, self.state, names) == TRUE:
                    self._rely(part, names)
        elif isinstance(formula, Some):
            new = {v.name for v in formula.variables}
            for bound, truth in solutions(formula.variables, formula.part, self.state, names):
                if truth == TRUE:
                    self.keep(bound[v] for v in sorted(new))
                    self._rely(formula.part, bound)
                    return

    def _need(self, formula: Formula, names: Names, depth: int) -> None:
        if isinstance(formula, Literal):
            self._achieve(formula.bind(names), depth)
        elif isinstance(formula, And):
            for part in formula.parts:
                self.need(part, names, depth)
        elif isinstance(formula, Or):
            for part in formula.parts:
                if self.world.schemas.formula(part)(self.world, names) is not False:
                    self.need(part, names, depth)
        elif isinstance(formula, Some):
            join = self.world.schemas.join(formula.variables, formula.part, self.schemas.free(formula))
            found = [b for b, _ in join(self.world, names)]
            for bound in self._best(found, {v.name for v in formula.variables}):
                self.need(formula.part, bound, depth + 1)
        elif isinstance(formula, Every):
            against = self.schemas.normal(formula.part, False)
            for bound, truth in solutions(formula.variables, against, self.state, names):
                if truth == TRUE:
                    self.need(formula.part, bound, depth + 1)
        elif isinstance(formula, Fewer):
            denied = self.schemas.normal(formula.part, False)
            for bound, truth in solutions((formula.variable,), formula.part, self.state, names):
                if truth == TRUE:
                    self._need(denied, bound, depth + 1)
        elif isinstance(formula.part, Literal):
            literal = formula.part.bind(names)
            for value in self.domain.values(literal.predicate):
                if value != literal.value:
                    self._achieve(Literal(literal.predicate, literal.args, value), depth)

    def _best(self, found: Sequence[Names], new: set[str], most: int = GROUPS) -> list[Names]:
        """The most promising bindings, one for each combination of categories."""
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
        rest = self._eases.get(name)
        if rest is None:
            rest = self._eases[name] = self._judged(name)
        return (rest[0], name not in self.kept, *rest[1:])

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
        if key in self.visited or depth > DEPTH:
            return
        self.visited.add(key)
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
        atom = (literal.predicate, *literal.args)
        for way in self.world.ways.get(literal.predicate, ()):
            if isinstance(way.what, Literal) and known.kind is PredicateKind.ATTRIBUTE:
                if way.what.value != literal.value:
                    continue
            self._follow(way, atom, literal, depth)

    def _follow(self, way: _Way, atom: tuple[str, ...], literal: Literal, depth: int) -> None:
        bound = set(way.what.args) if isinstance(way.what, Literal) else {way.what.target}
        new = {p.name for p in way.schema.parameters if p.name not in bound}
        conditions = [way.effect.condition] if not way.effect.variables else []
        if isinstance(way.schema, Process):
            conditions.append(way.schema.condition)
        else:
            conditions += [n.formula for n in way.schema.needs]
            new |= {c.variable.name for c in way.schema.choices}
        found = list(self.world.bindings(way, atom))
        if isinstance(way.what, Copy):
            copy = way.what
            if _denied(conditions, copy, literal.value):
                return
            having = [b for b in found if self.state.value(b[copy.source], copy.attribute) == literal.value]
            movable = self.domain.is_a(self.world.categories[atom[1]], self.domain.roles.movable)
            found = having if having or movable else found
        hand = way.schema.hand if isinstance(way.schema, Skill) else None
        most = GROUPS if isinstance(way.schema, Process) or hand in new else 1
        for binding in self._best(found, new, most):
            for variable in new & binding.keys():
                if variable == hand or isinstance(way.schema, Process):
                    self.use(binding[variable])
            for condition in conditions:
                self.need(condition, binding, depth + 1)
            if isinstance(way.what, Copy):
                wanted = Literal(way.what.attribute, (binding[way.what.source],), literal.value)
                self.need(wanted, {}, depth + 1)

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


def _denied(conditions: Sequence[Formula], copy: Copy, value: str) -> bool:
    """Whether a skill that copies a value asks that the source does not have it."""
    banned = Literal(copy.attribute, (copy.source,), value)
    return any(isinstance(f, Not) and f.part == banned for f in conditions)


def _ways(domain: Domain) -> dict[str, list[_Way]]:
    """Predicate (with "not " for what ends it) → effects that are about it."""
    found = domain.__dict__.get("_ways")
    if found is not None:
        return found  # type: ignore[no-any-return]
    ways: dict[str, list[_Way]] = {}
    able = domain.robot.skills or tuple(domain.skills)
    seen: set[tuple[object, ...]] = set()
    schemas: list[Skill | Process] = [domain.skills[s] for s in able]
    for schema in [*schemas, *domain.processes]:
        simple: Formula
        if isinstance(schema, Skill):
            simple = simple_needs(domain, schema)
        else:
            simple = schema.condition
        if isinstance(schema, Skill) and schema.family:
            like = (schema.family, schema.parameters, schema.needs, schema.effects)
            if like in seen:
                continue
            seen.add(like)
        for effect in schema.effects:
            for fact in effect.facts:
                name = f"not {fact.predicate}" if fact.value == "false" else fact.predicate
                ways.setdefault(name, []).append(_Way(schema, effect, fact, simple))
            for copy in effect.copies:
                ways.setdefault(copy.attribute, []).append(_Way(schema, effect, copy, simple))
    domain.__dict__["_ways"] = ways
    return ways

