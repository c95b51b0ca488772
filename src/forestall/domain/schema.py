"""The schemas of a domain as frozen data: predicates, categories, skills, processes, safety, robot.

Held by `model.Domain`, made by the loaders, read by whoever plans, judges or explains. What a skill
needs and does are formulas; there is no code of any domain here.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

from forestall.domain.formula import TRUE, Formula, Parameter, Some
from forestall.errors import InputError
from forestall.types.facts import Literal


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
        says: the same with {parameter} for the things: "put {object} on {target}".
        family: skills that do the same thing to different kinds of things.
        undoes: the fact that it is there to end; that it holds before is no need.
        done_when: where this holds the skill succeeds at once and changes nothing.
        duration_s: how long it takes, the way there apart; of one that only drives, its turns.
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
    says: str = ""
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
        variables: for all of which it is judged.
        when: "leaving": when the robot leaves; else the skill before which it is judged; "" always.
        sentence: what is said.
        args: of the skill: variables of the rule, which stand for what a step names there, or
            things, of which alone it is judged; None: every such step, whatever it names.
        after: judged after the skill instead of before it.
    """

    name: str
    never: Formula
    variables: tuple[Parameter, ...] = ()
    when: str = ""
    sentence: str = ""
    args: tuple[str, ...] | None = None
    after: bool = False

    @property
    def moment(self) -> str:
        """When it is judged, as a file says it: "after toggle_on(?stove)"."""
        args = "" if self.args is None else f"({', '.join(self.args)})"
        return f"{'after ' if self.after else ''}{self.when}{args}"

    def at(self, skill: str, args: Sequence[str]) -> dict[str, str] | None:
        """What a step gives its variables, None where it is not judged at this step."""
        named = tuple(zip(self.args or (), args, strict=False))
        names = {a: thing for a, thing in named if a.startswith("?")}
        if skill != self.when or any(names.get(a, a) != thing for a, thing in named):
            return None
        return names


@dataclass(frozen=True, slots=True)
class Robot:
    """What the robot can do.

    Args:
        hands: by node id: none, one, two.
        skills: where it has not all of them.
        speed_m_per_s: how fast it drives, for what a plan takes.
    """

    hands: tuple[str, ...] = ("gripper",)
    skills: tuple[str, ...] = ()
    speed_m_per_s: float = 0.5


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
