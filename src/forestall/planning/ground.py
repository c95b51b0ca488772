"""Grounds the skills and processes of a domain over one set of things.

Called by `planner`; calls `schemas`, `grounder`. First what can come about is found by the positive
parts of needs alone; then every skill that can run becomes a draft, which `number` turns into bits.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from forestall.deadline import Deadline
from forestall.domain.formula import Not, free
from forestall.domain.model import Domain
from forestall.domain.schema import Effect, PredicateKind, Skill
from forestall.planning.choices import Choices
from forestall.planning.drafts import Change, Draft, Event, Grounding
from forestall.planning.execute import mentions
from forestall.planning.grounder import EXISTS, Grounder, Universe
from forestall.planning.needs import adds_relation, asks_relation, simple_needs
from forestall.planning.nodes import Junction, Node, all_of, negate
from forestall.planning.schemas import schemas_of
from forestall.planning.state import State
from forestall.types.facts import Literal, by_number
from forestall.types.plan import Subtask

Names = dict[str, str]


class _SkillPlan:
    """What is precomputed of a skill: which needs tell at once whether it can ever run."""

    def __init__(self, domain: Domain, skill: Skill) -> None:
        self.skill = skill
        families = [s.family or s.name for s in domain.skills.values()]
        self.rank = families.index(skill.family or skill.name)
        self.simple = simple_needs(domain, skill)
        self.relational = [e for e in skill.effects if adds_relation(domain, e)]
        self.stable = not any(asks_relation(domain, e.condition) for e in self.relational) and not (
            skill.deciding or skill.makes
        )
        self.denied_done = None if skill.done_when is None else Not(skill.done_when)


def ground(
    state: State,
    universe: Universe,
    skills: frozenset[str] | None = None,
    deadline: Deadline | None = None,
) -> Grounding:
    """Ground everything that can happen, by some skills or by all that the robot has.

    Raises:
        TimeUp: the deadline is over before it is done.
    """
    grounding = _Grounding(state, universe, skills, deadline).run()
    grounding.grounder.deadline = None  # what is asked of it later belongs to others
    return grounding


class _Grounding:
    def __init__(
        self,
        state: State,
        universe: Universe,
        skills: frozenset[str] | None,
        deadline: Deadline | None,
    ) -> None:
        self.domain = state.domain
        self.schemas = schemas_of(state.domain)
        self.grounder = Grounder(state, universe, self.schemas, deadline)
        self.universe, self.state = universe, state
        self.choices = Choices(self.grounder)
        plans = self.domain.__dict__.get("_skill_plans")
        if plans is None:
            able = self.domain.robot.skills or tuple(self.domain.skills)
            plans = [
                _SkillPlan(self.domain, self.domain.skills[s])
                for s in able
                if not self.domain.skills[s].drives
            ]
            self.domain.__dict__["_skill_plans"] = plans
        chosen = (p for p in plans if skills is None or p.skill.name in skills)
        self.plans: list[_SkillPlan] = list(chosen)
        self._seen: set[tuple[str, ...]] = set()

    def run(self) -> Grounding:
        g = self.grounder
        histories = self.domain.histories
        known = g.categories
        for fact in sorted(self.state.facts):
            if fact[0] not in histories and all(a in known for a in fact[1:]):
                g.allow(fact)
        self._explore()
        bindings = [(p, b) for p in self.plans for b in self._bindings(p)]
        bindings.sort(key=self._order)
        for plan, names in bindings:
            for effect in plan.skill.effects:
                g.maybe.update(names[v] for v in effect.gone if v in names)
                kinds = {p.name: p.kind for p in effect.variables}
                for v in effect.gone:
                    if v not in names and v in kinds:
                        g.maybe.update(g.of_kind(kinds[v] or "") if kinds[v] else g.names)
        g.forget()
        drafts = [d for p, b in bindings for d in self._drafts(p, b)]
        return Grounding(g, drafts, [self._events(i) for i in range(len(self.domain.processes))])

    # --- what can come about ---------------------------------------------------------------------

    def _explore(self) -> None:
        """Relations that can come about, when nothing is ever in the way."""
        news = True
        while news:
            news = False
            for plan in self.plans:
                if not plan.relational:
                    continue
                for names in self._bindings(plan):
                    key = (plan.skill.name, *names.values())
                    if plan.stable and key in self._seen:
                        continue
                    self._seen.add(key)
                    made = self._made(plan.skill, names)
                    first = {v: pieces[0] for v, pieces in made.items()}
                    for bound in self.choices.bindings(plan.skill, names, first):
                        news |= self._bring(plan.relational, bound, made)
            for process in self.domain.processes:
                relational = [e for e in process.effects if adds_relation(self.domain, e)]
                if relational:
                    join = self.schemas.join(process.parameters, process.condition, frozenset())
                    for found, _ in join(self.grounder, {}):
                        news |= self._bring(relational, found, {})
            self.grounder.forget()

    def _bring(
        self, effects: Iterable[Effect], names: Names, made: Mapping[str, tuple[str, ...]]
    ) -> bool:
        news = False
        for effect, bound, _ in self._effects(effects, names, made):
            for fact in effect.facts:
                if fact.value == "true" and fact.predicate in self.domain.relations:
                    atom = _atom(fact, bound)
                    if atom is not None and self._may(atom):
                        news |= self.grounder.allow(atom)
        return news

    def _may(self, atom: tuple[str, ...]) -> bool:
        if not all(a in self.grounder.categories for a in atom[1:]):
            return False
        if self.domain.predicates[atom[0]].contains:
            stays = atom[1] in self.universe.things and not self.domain.is_a(
                self.grounder.categories[atom[1]], self.domain.roles.movable
            )  # no hand puts it anywhere: where a skill leaves it is no choice of the plan
            return stays or self.universe.allows(self.domain, atom[1], atom[2])
        return True

    def _bindings(self, plan: _SkillPlan) -> Iterator[Names]:
        skill = plan.skill
        join = self.schemas.join(skill.parameters, plan.simple, frozenset())
        order = [p.name for p in skill.parameters]
        for found, _ in join(self.grounder, {}):
            self.grounder.in_time()
            names = {v: found[v] for v in order}
            if skill.makes and not self._makes_known(skill, names):
                continue
            if skill.family and self._other_fits_better(skill, names):
                continue
            yield names

    def _makes_known(self, skill: Skill, names: Names) -> bool:
        made = self.universe.made
        return any((names[m.source], skill.name, m.variable) in made for m in skill.makes)

    def _other_fits_better(self, skill: Skill, names: Names) -> bool:
        """Whether a skill of the same family is the one that is made for these things."""
        if self._suited(skill, names):
            return False
        return any(
            other.family == skill.family
            and other is not skill
            and len(other.parameters) == len(skill.parameters)
            and self._suited(other, _as(other, names))
            for other in self.domain.skills.values()
        )

    def _suited(self, skill: Skill, names: Names) -> bool:
        return all(
            self.schemas.formula(f)(self.grounder, names) is not False for f in skill.prefers
        )

    def _made(self, skill: Skill, names: Names) -> dict[str, tuple[str, ...]]:
        found = {}
        for make in skill.makes:
            pieces = self.universe.made.get((names[make.source], skill.name, make.variable))
            if pieces:
                found[make.variable] = pieces
        return found

    def _order(self, binding: tuple[_SkillPlan, Names]) -> tuple[object, ...]:
        """Of equal steps the search takes the first: what is put away goes to a support first."""
        plan, names = binding
        several = [by_number(x) for x in names.values()]
        supports = self.universe.supports
        away = [supports.index(x) for x in list(names.values())[-1:] if x in supports]
        return plan.rank, several[:-1], *(away or [len(supports)]), several

    # --- drafts ----------------------------------------------------------------------------------

    def _drafts(self, plan: _SkillPlan, names: Names) -> Iterator[Draft]:
        self.grounder.in_time()
        g, skill = self.grounder, plan.skill
        made = self._made(skill, names)
        first = {v: pieces[0] for v, pieces in made.items()}
        variants: list[tuple[Names, list[Node], str | None]] = [(names, [], None)]
        for choice in skill.deciding:
            variants = [
                ({**b, **chosen}, [*nodes, node], over or faced)
                for b, nodes, over in variants
                for chosen, node, faced in self.choices.chosen(choice, {**b, **first})
            ]
        subtask = Subtask(skill.name, tuple(names.values()))
        for bound, nodes, over in variants:
            known = {**first, **bound}
            g.driven = None
            condition = self._condition(plan, known, nodes, made)
            if condition is False:
                continue
            faced = over or g.driven
            changes = list(self._changes(skill.effects, bound, made))
            if made:
                changes += self._births(skill, bound, made)
            if any(c.condition is True and -1 in c.add for c in changes):
                continue
            prefers = [
                part
                for f in skill.prefers
                for part in _parts(self.schemas.formula(f)(g, known))
                if part is not False
            ]
            pieces = tuple(p for several in made.values() for p in several)
            yield Draft(subtask, condition, changes, prefers, faced, pieces)

    def _condition(
        self, plan: _SkillPlan, names: Names, nodes: list[Node], made: Mapping[str, tuple[str, ...]]
    ) -> Node:
        g, skill = self.grounder, plan.skill
        found = [*nodes, *(g.exists(names[p.name]) for p in skill.parameters if p.name in names)]
        for need in skill.needs:
            node = self.schemas.formula(need.formula)(g, names)
            if node is False:
                return False
            found.append(node)
        if plan.denied_done is not None:
            found.append(self.schemas.formula(plan.denied_done)(g, names))
        gone = {v for e in skill.effects for v in e.gone}
        for make in skill.makes:
            if make.source not in gone:
                found += [negate(g.exists(p)) for p in made.get(make.variable, ())]
        return all_of(found)

    def _effects(
        self, effects: Iterable[Effect], names: Names, made: Mapping[str, tuple[str, ...]]
    ) -> Iterator[tuple[Effect, Names, Node]]:
        """Effects with every binding of their variables and their condition."""
        g = self.grounder
        for effect in effects:
            used = next((v for v in made if mentions(effect, v)), None)
            several = [names] if used is None else [{**names, used: p} for p in made[used]]
            own = {v.name for v in effect.variables}
            for known in several:
                if _unbound(effect, own | known.keys()):
                    continue
                if not effect.variables:
                    node = self.schemas.formula(effect.condition)(g, known)
                    if node is not False:
                        yield effect, known, node
                    continue
                join = self.schemas.join(
                    effect.variables, effect.condition, self.schemas.free(effect.condition)
                )
                for bound, node in join(g, known):
                    yield effect, bound, node

    def _changes(
        self, effects: Iterable[Effect], names: Names, made: Mapping[str, tuple[str, ...]]
    ) -> Iterator[Change]:
        plain = Change(True, [], [])
        for effect, bound, node in self._effects(effects, names, made):
            change = plain if node is True else Change(node, [], [])
            for fact in effect.facts:
                self._note(change, fact, bound)
            for name in (bound[v] for v in effect.gone if v in bound):
                self._take_away(change, name)
            if change is not plain and (change.add or change.delete):
                yield change
            for copy in effect.copies:
                yield from self._copies(
                    node, bound[copy.source], bound[copy.target], copy.attribute
                )
        if plain.add or plain.delete:
            yield plain

    def _note(self, change: Change, fact: Literal, names: Names) -> None:
        g, atom = self.grounder, _atom(fact, names)
        if atom is None:
            return
        known = self.domain.predicates[fact.predicate]
        if known.kind is PredicateKind.ATTRIBUTE:
            self._set(change, atom[1], fact.predicate, fact.value)
        elif known.kind is PredicateKind.HISTORY:
            (change.delete if fact.value == "false" else change.add).append(g.number_of(atom))
        elif fact.value == "false":
            if atom in g.possible:
                change.delete.append(g.number_of(atom))
        elif atom in g.possible and self._may(atom):
            change.add.append(g.number_of(atom))
            change.delete += g.rivals(atom)
        else:
            change.add.append(-1)

    def _set(self, change: Change, name: str, attribute: str, value: str) -> None:
        if self.grounder.value(name, attribute, value) is False:
            return
        for other in self.domain.values(attribute):
            number = self.grounder.number_of((attribute, name, other))
            (change.add if other == value else change.delete).append(number)

    def _take_away(self, change: Change, name: str) -> None:
        g = self.grounder
        change.delete += [g.number_of(a) for a in g.about(name)]
        change.delete.append(g.number_of((EXISTS, name)))
        category = self.domain.categories[g.categories[name]]
        for attribute in category.attributes:
            change.delete += [
                g.number_of((attribute, name, v)) for v in self.domain.values(attribute)
            ]

    def _copies(self, node: Node, source: str, target: str, attribute: str) -> Iterator[Change]:
        g, values = self.grounder, self.domain.values(attribute)
        if g.value(target, attribute, values[0]) is False:
            return
        has = g.value(source, attribute, values[0]) is not False
        for value in values if has else values[:1]:
            known = g.value(source, attribute, value) if has else True
            change = Change(all_of((node, known)), [], [])
            self._set(change, target, attribute, value)
            if change.condition is not False:
                yield change

    def _births(
        self, skill: Skill, names: Names, made: Mapping[str, tuple[str, ...]]
    ) -> Iterator[Change]:
        g, lasting = self.grounder, self.domain.lasting
        sources = {m.variable: names[m.source] for m in skill.makes}
        for variable, pieces in made.items():
            for piece in pieces:
                change = Change(True, [g.number_of((EXISTS, piece))], [])
                category = g.categories[piece]
                for attribute, value in self.domain.default_states(category).items():
                    has = g.value(sources[variable], attribute, value) is not False
                    if attribute in lasting and has:
                        yield from self._copies(True, sources[variable], piece, attribute)
                    else:
                        self._set(change, piece, attribute, value)
                yield change

    def _events(self, index: int) -> list[Event]:
        process = self.domain.processes[index]
        join = self.schemas.join(process.parameters, process.condition, frozenset())
        found = []
        for names, node in join(self.grounder, {}):
            self.grounder.in_time()
            changes = list(self._changes(process.effects, names, {}))
            if changes:
                found.append(Event(node, changes))
        return found


def _as(skill: Skill, names: Names) -> Names:
    """Arguments of another skill of the same family as those of this one."""
    return {p.name: a for p, a in zip(skill.parameters, names.values(), strict=True)}


def _atom(fact: Literal, names: Names) -> tuple[str, ...] | None:
    args = tuple([names.get(a, a) for a in fact.args])
    return None if any(a.startswith("?") for a in args) else (fact.predicate, *args)


def _unbound(effect: Effect, known: set[str]) -> bool:
    """Whether an effect speaks of a thing that was not chosen."""
    used = set(free(effect.condition)) | set(effect.gone)
    used |= {a for f in effect.facts for a in f.args if a.startswith("?")}
    used |= {a for c in effect.copies for a in (c.source, c.target) if a.startswith("?")}
    return not used <= known


def _parts(node: Node) -> tuple[Node, ...]:
    if isinstance(node, Junction) and node.kind == "and":
        return node.parts
    return () if node is True else (node,)
