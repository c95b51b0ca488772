"""The frozen domain: categories, predicates, skills, processes, safety, and the robot.

Read by `load` (TOML) and `pddl_in`; asked by perception, mining, planning, the monitor and the
executors. It holds no code of any domain: what a skill needs and does are formulas.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property

from forestall.domain.formula import TRUE, Formula, Parameter, Some, literals
from forestall.domain.phrases import THING, with_articles
from forestall.errors import InputError, UnknownNameError
from forestall.types.facts import Literal, category_of
from forestall.types.plan import Plan, Subtask

Names = Mapping[str, str]


class PredicateKind(Enum):
    """How a predicate comes to be known."""

    RELATION = "relation"  # between things, seen by a camera or not
    ATTRIBUTE = "attribute"  # of one thing, one of several values
    DERIVED = "derived"  # a formula over others
    HISTORY = "history"  # has happened; no view of the present shows it
    STATIC = "static"  # between categories, never changes


@dataclass(frozen=True, slots=True)
class Predicate:
    """What can be said about things.

    Args:
        name: as in facts.
        kind: how it comes to be known.
        parameters: its roles; an attribute has one.
        values: of an attribute, the default of a new object first.
        camera: whether a picture can show it.
        contains: whether it says where a thing is: the first argument in, on or at the second.
        group: relations of one group exclude each other for one first argument.
        symmetric: whether a relation holds from both ends.
        mirrors: the relation that says the same from the other end, which is said instead.
        scored: whether the comparison counts it, and a graph for one subtask keeps it.
        geometry: how perception finds it: "containment", "support", "" for neither.
        offered_by: tag of the things that take others in this relation.
        material: whether an attribute is of the matter and decides over a task's outcome only, and
            not over whether skills can run.
        mechanical: whether an attribute makes no difference to driving to its thing.
        in_hand: whether an attribute may change while its thing is held.
        fine: whether an attribute looks too small to be told on a distant thing.
        obscures: the value beside which the other attributes of a thing cannot be told.
        lasting: whether what is made of a thing takes the attribute over.
        paired: which things of two categories a static predicate holds between: "" all,
            "same number", or "same number or first" (the first where no number is the same).
        mined: whether preconditions are mined over it.
        definition: of a derived predicate.
        words: how a sentence says that it holds, with {0}, {1} for its arguments.
        opposite: how a sentence says that it does not.
        says: value → how a sentence says it of a thing, where the value alone would not do.
        phrases: value → texts that fit a picture of it.
        by_category: category → value → texts that replace the general ones.
        bins: lower bounds of the values, where they stand for ranges of a number.
        unit: of that number.
    """

    name: str
    kind: PredicateKind
    parameters: tuple[Parameter, ...] = ()
    values: tuple[str, ...] = ()
    camera: bool = True
    contains: bool = False
    group: str | None = None
    symmetric: bool = False
    mirrors: str = ""
    scored: bool = True
    geometry: str = ""
    offered_by: str = ""
    material: bool = True
    mechanical: bool = False
    in_hand: bool = False
    fine: bool = False
    obscures: str = ""
    lasting: bool = False
    paired: str = ""
    mined: bool = True
    definition: Formula | None = None
    words: str = ""
    opposite: str = ""
    says: Mapping[str, str] = field(default_factory=dict, hash=False)
    phrases: Mapping[str, tuple[str, ...]] = field(default_factory=dict, hash=False)
    by_category: Mapping[str, Mapping[str, tuple[str, ...]]] = field(
        default_factory=dict, hash=False
    )
    bins: tuple[float, ...] = ()
    unit: str = ""

    def binned(self, number: float) -> str:
        """The value whose range a number is in.

        Raises:
            InputError: the attribute has no bins, or the number lies below the first.
        """
        if not self.bins:
            raise InputError(
                f"attribute {self.name} has no bins: give one of {', '.join(self.values)}"
            )
        found = [v for v, low in zip(self.values, self.bins, strict=True) if number >= low]
        if not found:
            raise InputError(f"{self.name} {number} {self.unit} is below {self.bins[0]}".rstrip())
        return found[-1]


@dataclass(frozen=True, slots=True)
class Category:
    """One category of things.

    Args:
        name: as in instance names: "StoveBurner".
        tags: what it is good for: "pickupable", "fixture", ...
        attributes: that its things have.
        defaults: attribute → value of a new one, where it is not the attribute's first.
        numbers: name → number, for `fewer than ...` and for how many things a skill makes.
        aliases: further names of the same category.
        words: how a person calls it.
        synonyms: other everyday names.
        size_m: usual width, depth and height, for what shows only in part; () where they vary.
        extra: tables for worlds, which no other part reads.
    """

    name: str
    tags: frozenset[str] = frozenset()
    attributes: tuple[str, ...] = ()
    defaults: tuple[tuple[str, str], ...] = ()
    numbers: tuple[tuple[str, int], ...] = ()
    aliases: tuple[str, ...] = ()
    words: str = ""
    synonyms: tuple[str, ...] = ()
    size_m: tuple[float, ...] = ()
    extra: Mapping[str, object] = field(default_factory=dict, hash=False)

    @property
    def spoken(self) -> str:
        """How a person calls it; a category without words goes by its name: "SoupLadle" too."""
        return self.words or re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", self.name).lower()


@dataclass(frozen=True, slots=True)
class Need:
    """One condition of a skill and what is said where it fails.

    Args:
        formula: over the skill's parameters.
        sentence: with {object} for an argument and {?y} for what makes the condition fail.
        lacking: the facts that would help, over the same variables.
        find: names what stands in the way, where the formula itself does not.
    """

    formula: Formula
    sentence: str
    lacking: tuple[Literal, ...] = ()
    find: Some | None = None


@dataclass(frozen=True, slots=True)
class Copy:
    """An attribute of one thing takes the value that it has of another."""

    attribute: str
    target: str
    source: str


@dataclass(frozen=True, slots=True)
class Effect:
    """What happens where a condition held before.

    Args:
        variables: it happens for all of these.
        condition: judged on the state before.
        facts: become so; a relation with the value "false" ends.
        copies: values taken over.
        gone: variables of things that are no more.
    """

    variables: tuple[Parameter, ...] = ()
    condition: Formula = TRUE
    facts: tuple[Literal, ...] = ()
    copies: tuple[Copy, ...] = ()
    gone: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Make:
    """New things: as many as `count` says, of the category that `by` relates the source to."""

    variable: str
    source: str
    by: str
    count: int | str = 1


@dataclass(frozen=True, slots=True)
class Choice:
    """A thing that a skill deals with and does not name.

    The first of `among` that some thing satisfies, together with `such_that`, decides; of several
    things the lowest number. Where there is none the skill is refused with the sentence; without
    a sentence it goes on without that thing, and what it would do to it does not happen.

    Args:
        variable: stands for the thing.
        among: in order; where they speak of what the robot faces, a plan can drive there first.
        such_that: holds of the thing whichever of them decides.
        only_if: nothing is chosen where this does not hold.
        sentence: of the refusal.
        decides: whether a need, an effect or another choice depends on it (found by the loader).
    """

    variable: Parameter
    among: tuple[Formula, ...]
    such_that: Formula = TRUE
    only_if: Formula = TRUE
    sentence: str = ""
    decides: bool = True


@dataclass(frozen=True, slots=True)
class Skill:
    """One skill as a schema.

    Args:
        name: the verb.
        parameters: with kinds.
        choices: things that it deals with and does not name.
        needs: in the order in which they are judged.
        prefers: needs that a plan meets where it can.
        effects: on the state before.
        makes: new things.
        at: the parameter at which the robot stands afterwards.
        drives: whether it only drives.
        hand: the parameter that is in the hand when it begins.
        words: how a person says it.
        family: skills that do the same thing to different kinds of things.
        undoes: the fact that it is there to end; that it holds before is no need.
        done_when: where this holds the skill succeeds at once and changes nothing.
        duration_s: how long it takes, driving apart.
    """

    name: str
    parameters: tuple[Parameter, ...]
    choices: tuple[Choice, ...] = ()
    needs: tuple[Need, ...] = ()
    prefers: tuple[Formula, ...] = ()
    effects: tuple[Effect, ...] = ()
    makes: tuple[Make, ...] = ()
    at: str | None = None
    drives: bool = False
    hand: str | None = None
    words: str = ""
    family: str = ""
    undoes: Literal | None = None
    done_when: Formula | None = None
    duration_s: float = 0.0

    @property
    def deciding(self) -> tuple[Choice, ...]:
        """Choices on which needs or effects depend; the others only say where the robot ends up."""
        return tuple(c for c in self.choices if c.decides)

    @property
    def roles(self) -> tuple[str, ...]:
        """Parameter names without the question mark."""
        return tuple(p.name.removeprefix("?") for p in self.parameters)


@dataclass(frozen=True, slots=True)
class Process:
    """What happens by itself after every skill, until nothing more does."""

    name: str
    parameters: tuple[Parameter, ...]
    condition: Formula
    effects: tuple[Effect, ...]


@dataclass(frozen=True, slots=True)
class SafetyRule:
    """What must never be true.

    Args:
        name: of the rule.
        never: the formula.
        when: "leaving": when the robot leaves; else the skill before which it is judged; "" always.
        sentence: what is said.
    """

    name: str
    never: Formula
    variables: tuple[Parameter, ...] = ()
    when: str = ""
    sentence: str = ""


@dataclass(frozen=True, slots=True)
class Robot:
    """Hands by node id (none, one, two), and its skills where it has not all of them."""

    hands: tuple[str, ...] = ("gripper",)
    skills: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Roles:
    """Predicates and tags by the part that they play for the engine; None: the domain has none.

    Args:
        holding: relation of a thing to the hand that has it.
        blocking: relation of a thing to what it stands in front of.
        shut: derived: contents can neither be seen nor reached now.
        accessible: derived: the hand can come to it.
        vacant: derived: nothing is in or on it.
        unblocked: derived: nothing stands in front of it.
        hand_empty: derived: the hand is free.
        accepts: static: a place takes a thing.
        fixture: tag of what nobody moves.
        movable: tag of what a hand can take.
        support: tag of places of which any will do.
        ground: tag of the ground itself.
        rest: tags of supports, in order, on which things are put out of the way.
        avoid: tags of places where nothing is put unless somebody asks for it.
        encloses: tag of what can be shut around its contents.
        crowded: tag of what holds many things by nature.
        vacatable: tag of what it can matter for that nothing is in or on it.
        numbered: tag of things that only their numbers tell apart.
    """

    holding: str | None = None
    blocking: str | None = None
    shut: str | None = None
    accessible: str | None = None
    vacant: str | None = None
    unblocked: str | None = None
    hand_empty: str | None = None
    accepts: str | None = None
    fixture: str = "fixture"
    movable: str = "movable"
    support: str = "support"
    ground: str = "ground"
    encloses: str = "encloses"
    crowded: str = "crowded"
    vacatable: str = "vacatable"
    numbered: str = "numbered"
    rest: tuple[str, ...] = ()
    avoid: tuple[str, ...] = ()


LOCATED = "located"
"""Built in: the place of a thing is known."""

FACING = "facing"
"""Built in: what the robot drove to or handled last."""

SAME = "same"
SAME_CATEGORY = "same_category"
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
    roles: Roles = Roles()
    robot: Robot = Robot()
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
        return kind in self.kinds(category_of(self.canonical(name)))

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
    def moved(self) -> frozenset[str]:
        """Relations and histories that skills, processes or definitions are about.

        The other relations are geometry, which no plan changes on purpose.
        """
        formulas: list[Formula] = [p.definition for p in self.derived.values() if p.definition]
        changed = [e for s in self.skills.values() for e in s.effects]
        changed += [e for p in self.processes for e in p.effects]
        formulas += [e.condition for e in changed] + [f for e in changed for f in e.facts]
        formulas += [n.formula for s in self.skills.values() for n in s.needs]
        formulas += [p.condition for p in self.processes]
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
        uses = {
            p.name: {x.predicate for x, _ in literals(p.definition) if x.predicate in self.derived}
            for p in self.derived.values()
            if p.definition is not None
        }
        reached: dict[str, set[str]] = {}
        for name, used in uses.items():
            found, left = set[str](), list(used)
            while left:
                other = left.pop()
                if other not in found:
                    found.add(other)
                    left += uses[other]
            reached[name] = found
        circles: dict[frozenset[str], frozenset[str]] = {}
        found_in: dict[str, frozenset[str]] = {}
        for name, found in reached.items():
            if name in found:
                members = frozenset(o for o in found if name in reached[o])
                found_in[name] = circles.setdefault(members, members)
        return found_in

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

    def driving(self) -> Skill | None:
        """The skill that only drives, if the robot has one."""
        return next((s for s in self.skills.values() if s.drives), None)

    def tagged(self, tag: str) -> tuple[str, ...]:
        """Categories with a tag, sorted."""
        return tuple(sorted(c.name for c in self.categories.values() if tag in c.tags))


def nearest_names(names: Iterable[str]) -> str:
    """Names for an error text."""
    return ", ".join(sorted(names))
