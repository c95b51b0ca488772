"""The frozen domain: categories, predicates, skills, processes, safety, and the robot.

Read by `load` (TOML) and `pddl_in`; asked by perception, mining, planning, the monitor and the
executors. It holds no code of any domain: what a skill needs and does are formulas.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from forestall.domain.formula import Formula, Or, literals
from forestall.domain.phrases import THING, with_articles
from forestall.domain.recursion import circles
from forestall.domain.schema import (
    Category,
    Predicate,
    PredicateKind,
    Process,
    Robot,
    Roles,
    SafetyRule,
    Skill,
)
from forestall.errors import InputError, UnknownNameError
from forestall.types.facts import Literal, category_of
from forestall.types.plan import Plan, Subtask

LOCATED = "located"
"""Built in: the place of a thing is known."""

FACING = "facing"
"""Built in: what the robot drove to or handled last."""

SAME = "same"
SAME_CATEGORY = "same_category"
_WIDER = 32
"""How many sets of unknown categories a domain keeps itself with."""

BUILT_IN = (LOCATED, FACING, SAME, SAME_CATEGORY)


@dataclass(frozen=True)
class Domain:
    """Everything that differs between a kitchen, a bench and a warehouse.

    Args:
        name: of the domain.
        categories: by name.
        predicates: by name.
        skills: by name.
        statics: static predicate → the categories between which it holds.
        tags: every tag that a category may have.
        processes: what happens by itself, in the order of the file.
        safety: what must never be true.
        roles: predicates and tags by the part that they play for the engine.
        robot: its hands, and its skills where it has not all of them.
        constants: (thing, category) of the things that every scene has.
        spelling: (name, how the file that it was read from spells it), where they differ.
    """

    name: str
    categories: Mapping[str, Category] = field(hash=False)
    predicates: Mapping[str, Predicate] = field(hash=False)
    skills: Mapping[str, Skill] = field(hash=False)
    statics: Mapping[str, frozenset[tuple[str, ...]]] = field(hash=False)
    tags: tuple[str, ...] = ()
    processes: tuple[Process, ...] = ()
    safety: tuple[SafetyRule, ...] = ()
    roles: Roles = field(default_factory=Roles)
    robot: Robot = field(default_factory=Robot)
    constants: tuple[tuple[str, str], ...] = ()
    spelling: tuple[tuple[str, str], ...] = ()
    run: tuple[tuple[str, str], ...] = ()
    """(Kind of part, name): what a run in this domain has when nothing is said."""

    def __hash__(self) -> int:
        return hash(self.name)

    # --- names -----------------------------------------------------------------------------------

    def __getitem__(self, name: str) -> Category:
        """The category of a category or instance name, aliases included.

        Raises:
            UnknownNameError: no such category.
        """
        found = self.find(name)
        if found is None:
            raise UnknownNameError("object category", category_of(name), self.categories)
        return found

    def find(self, name: str) -> Category | None:
        """Like indexing, but None where there is no such category."""
        return self.categories.get(category_of(self.canonical(name)))

    def canonical(self, name: str) -> str:
        """Replace an alias, with the number of an instance kept."""
        head = category_of(name)
        if head in self.categories:
            return name
        category = self._aliases.get(head)
        return name if category is None else category + name[len(head) :]

    @cached_property
    def _aliases(self) -> dict[str, str]:
        return {a: c.name for c in self.categories.values() for a in c.aliases}

    def knowing(self, categories: Iterable[str]) -> Domain:
        """The same domain, in which some further categories are things and nothing more.

        What nobody has described is still there, takes up its place, and is not handled.
        """
        unknown = frozenset(c for c in categories if self.find(c) is None)
        if not unknown:
            return self
        wider: dict[frozenset[str], Domain] = self.__dict__.setdefault("_wider", {})
        found = wider.get(unknown)
        if found is None:
            if len(wider) >= _WIDER:
                wider.clear()
            more = {c: Category(c) for c in sorted(unknown)}
            found = wider[unknown] = replace(self, categories={**self.categories, **more})
        return found

    def kinds(self, category: str) -> frozenset[str]:
        """Everything that a category counts as: its name, its tags, "has_<attribute>"."""
        return self._kinds.get(category, frozenset((category,)))

    @cached_property
    def _kinds(self) -> dict[str, frozenset[str]]:
        return {
            c.name: frozenset((c.name, *c.tags, *(f"has_{a}" for a in c.attributes)))
            for c in self.categories.values()
        }

    def is_a(self, name: str, kind: str | None) -> bool:
        """Whether a category or instance name counts as a tag, category or attribute holder."""
        if kind is None:
            return True
        return kind in (self._kinds.get(name) or self.kinds(category_of(self.canonical(name))))

    def known_kind(self, kind: str) -> bool:
        """Whether a kind means anything in this domain."""
        return (
            kind in self.categories
            or kind in self.tags
            or kind.removeprefix("has_") in self.attributes
        )

    # --- predicates ------------------------------------------------------------------------------

    @cached_property
    def attributes(self) -> dict[str, Predicate]:
        """Attribute predicates by name."""
        return self._of(PredicateKind.ATTRIBUTE)

    @cached_property
    def relations(self) -> dict[str, Predicate]:
        """Relations by name."""
        return self._of(PredicateKind.RELATION)

    @cached_property
    def derived(self) -> dict[str, Predicate]:
        """Derived predicates by name."""
        return self._of(PredicateKind.DERIVED)

    @cached_property
    def histories(self) -> dict[str, Predicate]:
        """History predicates by name."""
        return self._of(PredicateKind.HISTORY)

    def _of(self, kind: PredicateKind) -> dict[str, Predicate]:
        return {p.name: p for p in self.predicates.values() if p.kind is kind}

    @cached_property
    def containing(self) -> tuple[str, ...]:
        """Relations that say where a thing is, in the order of the file."""
        return tuple(p.name for p in self.relations.values() if p.contains)

    @cached_property
    def in_any_hand(self) -> str | None:
        """The derived fact that one of several hands has a thing, None where none says it."""
        for known in self.derived.values():
            if len(known.parameters) == 1 and isinstance(known.definition, Or):
                thing, holding = known.parameters[0].name, str(self.roles.holding)
                ways = {Literal(holding, (thing, hand)) for hand in self.robot.hands}
                if len(ways) > 1 and ways == set(known.definition.parts):
                    return known.name
        return None

    @cached_property
    def moved(self) -> frozenset[str]:
        """Relations and histories that skills, processes, definitions or safety rules are about.

        The other relations are geometry, which no plan changes on purpose.
        """
        formulas: list[Formula] = [p.definition for p in self.derived.values() if p.definition]
        changed = [e for s in self.skills.values() for e in s.effects]
        changed += [e for p in self.processes for e in p.effects]
        formulas += [e.condition for e in changed] + [f for e in changed for f in e.facts]
        formulas += [n.formula for s in self.skills.values() for n in s.needs]
        formulas += [p.condition for p in self.processes]
        formulas += [rule.never for rule in self.safety]
        used = {x.predicate for f in formulas for x, _ in literals(f)}
        return frozenset(used & (self.relations.keys() | self.histories.keys()))

    def say(self, attribute: str, value: str) -> str:
        """How a sentence says that a thing has a value: "filled with water"."""
        known = self.attributes.get(attribute)
        return value if known is None else known.says.get(value, value)

    def values(self, attribute: str) -> tuple[str, ...]:
        """Every value of an attribute, the default first.

        Raises:
            UnknownNameError: no such attribute.
        """
        found = self.attributes.get(attribute)
        if found is None:
            raise UnknownNameError("attribute", attribute, self.attributes)
        return found.values

    def default_states(self, name: str) -> dict[str, str]:
        """Attribute → value of a new object."""
        category = self[name]
        states = {a: self.attributes[a].values[0] for a in category.attributes}
        return states | dict(category.defaults)

    @cached_property
    def lasting(self) -> tuple[str, ...]:
        """Attributes that things take over from what they are made of."""
        return tuple(a.name for a in self.attributes.values() if a.lasting)

    def number(self, name: str, what: str) -> int | None:
        """A number of a category or instance, None where it has none."""
        category = self.find(name)
        return None if category is None else dict(category.numbers).get(what)

    def static(self, predicate: str, *names: str) -> bool:
        """Whether a static predicate holds between the categories of some names."""
        wanted = tuple(category_of(self.canonical(n)) for n in names)
        return wanted in self.statics.get(predicate, frozenset())

    def offers(self, name: str) -> str | None:
        """The relation in which a thing (name or category) takes others; None: it takes none."""
        kinds = self.kinds(category_of(self.canonical(name)))
        for relation in self.containing:
            if self.predicates[relation].offered_by in kinds:
                return relation
        return None

    def accepts(self, place: str, thing: str) -> bool:
        """Whether a place (name or category) takes a thing."""
        role = self.roles.accepts
        if role is None:
            return self.offers(place) is not None
        return self.static(role, place, thing)

    def is_open_support(self, name: str) -> bool:
        """Whether any instance of a category will do as a place."""
        return self.is_a(name, self.roles.support)

    def paired(self, name: str) -> frozenset[str]:
        """Categories whose thing of the same number belongs to a thing: the tap of a basin."""
        own = category_of(self.canonical(name))
        return frozenset(
            first
            for p in self.predicates.values()
            if p.kind is PredicateKind.STATIC and p.paired
            for first, second in self.statics.get(p.name, ())
            if second == own
        )

    def becomes(self, name: str) -> frozenset[str]:
        """Categories of what a skill can make of a thing."""
        own = category_of(self.canonical(name))
        return frozenset(
            second
            for skill in self.skills.values()
            for make in skill.makes
            for first, second in self.statics.get(make.by, ())
            if first == own
        )

    @cached_property
    def scored(self) -> tuple[str, ...]:
        """Relations that say what a thing is doing, not merely where it is, sorted."""
        return tuple(sorted(p.name for p in self.relations.values() if p.scored))

    def text(self, step: Subtask) -> str:
        """What is compared of a subtask: its family's words and its arguments."""
        family = self.family(step)
        if family == step.skill:
            return self.words(step)
        return " ".join((family.replace("_", " "), *step.args))

    def family(self, step: Subtask) -> str:
        """The family of a subtask's skill."""
        skill = self.skills.get(step.skill)
        return step.skill if skill is None else skill.family

    def encloses(self, name: str) -> bool:
        """Whether contents cannot be seen or reached while it is shut."""
        return self.is_a(name, self.roles.encloses)

    def phrases(self, category: str, attribute: str, value: str) -> tuple[str, ...]:
        """Texts that fit a picture of a thing (name or category) whose attribute has a value.

        The plainest comes first. None for an attribute that no camera can see; for a value that
        has no phrases of its own, "a <value> <thing>".

        Raises:
            UnknownNameError: no such category, attribute or value.
        """
        thing = self[category]
        if value not in self.values(attribute):
            raise UnknownNameError(f"value of {attribute}", value, self.values(attribute))
        kind = self.attributes[attribute]
        if not kind.camera:
            return ()
        texts = kind.by_category.get(thing.name, {}).get(value) or kind.phrases.get(value)
        texts = texts or (f"a {value.replace('_', ' ')} {THING}",)
        return tuple(with_articles(t.replace(THING, thing.spoken)) for t in texts)

    @cached_property
    def recursive(self) -> dict[str, frozenset[str]]:
        """Derived predicate → those that it is defined with in a circle, itself included.

        The predicates of one circle share one set.
        """
        return circles({p.name: p.definition for p in self.derived.values() if p.definition})

    # --- skills ----------------------------------------------------------------------------------

    def skill(self, name: str) -> Skill:
        """A skill by name.

        Raises:
            UnknownNameError: the domain, or its robot, has no such skill.
        """
        found = self.skills.get(name)
        if found is None or (self.robot.skills and name not in self.robot.skills):
            able = self.robot.skills or tuple(self.skills)
            what = "skill" if found is None else f"skill of the robot of {self.name}"
            raise UnknownNameError(what, name, able)
        return found

    def check(self, step: Subtask) -> Subtask:
        """See that a subtask is one of this domain.

        Raises:
            UnknownNameError: no such skill.
            InputError: its arguments do not fit.
        """
        roles = self.skill(step.skill).roles
        if len(step.args) != len(roles):
            raise InputError(
                f"{step.skill} takes {len(roles)} argument(s) ({', '.join(roles)}), "
                f"got {len(step.args)}: {', '.join(step.args)}"
            )
        return step

    def check_plan(self, plan: Plan) -> Plan:
        """See that every step of a plan is one of this domain.

        Raises:
            InputError: the first step that is not, by its number.
        """
        for number, step in enumerate(plan, 1):
            try:
                self.check(step)
            except InputError as error:
                raise InputError(f"step {number}, {step}: {error}") from error
        return plan

    def bound(self, step: Subtask) -> dict[str, str]:
        """Variable → argument, e.g. {"?peg": "Peg-1", "?hole": "Hole-2"}."""
        skill = self.skill(step.skill)
        return {p.name: a for p, a in zip(skill.parameters, step.args, strict=True)}

    def words(self, step: Subtask) -> str:
        """The subtask as a phrase: "insert Peg Hole"."""
        skill = self.skills.get(step.skill)
        verb = skill.words if skill is not None and skill.words else step.skill.replace("_", " ")
        return " ".join((verb, *step.args))

    def drives(self, step: Subtask) -> bool:
        """Whether a step only drives; of a skill that is not known nobody knows that."""
        skill = self.skills.get(step.skill)
        return skill is not None and skill.drives

    def driving(self) -> Skill | None:
        """The skill that only drives, if the robot has one."""
        return next((s for s in self.skills.values() if s.drives), None)

    def tagged(self, tag: str) -> tuple[str, ...]:
        """Categories with a tag, sorted."""
        return tuple(sorted(c.name for c in self.categories.values() if tag in c.tags))
