"""What held before skills, counted over arguments and not names, in every task, run by run.

Called by `preconditions`, which mines from it; calls lifting and tally. Adding a run asks about
that run alone, so that it costs the same in a memory of any size. Counted are, by demonstrations:

- before each skill, for each fact about its arguments, by the kinds of the arguments that it is
  about and by task, which values it had;
- for the same kinds of things at all other times, which values it had then;
- after each skill which values it had, and whether it had another before;
- what is about no argument only before the same step of the same task.

Where several kinds of things are taken together, one demonstration may have used a skill on more
than one of them. Weights count it once for each kind; what is told counts it once
(`Needs.in_demonstrations`).
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from forestall.comparison.lifting import Kind, candidates, evaluate, kind_of
from forestall.comparison.tally import Tally
from forestall.domain.model import Domain
from forestall.types.demonstration import Demonstration
from forestall.types.facts import Literal, Truth, category_of
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask

Slot = tuple[str, tuple[str, ...]]
"""A fact whose value is left open: predicate and arguments, the skill's variables among them."""

Kinds = tuple[str, ...]
"""The categories of the variables of a slot, in the order of its arguments."""


@dataclass(frozen=True, slots=True)
class Moment:
    """What one demonstrated step tells.

    Args:
        task: of the demonstration.
        index: of the step.
        subtask: what was done.
        scoped: what was seen before it that concerns it.
        whole: everything that was known before it.
        after: everything that was known after it, None where nobody looked.
    """

    task: str
    index: int
    subtask: Subtask
    scoped: SceneGraph
    whole: SceneGraph
    after: SceneGraph | None = None


@dataclass(slots=True)
class Here:
    """What is about no argument, before one step of one task: how often it was so."""

    runs: int = 0
    slots: dict[Slot, Tally] = field(default_factory=dict)
    blind: dict[str, int] = field(default_factory=dict)


_ByKinds = dict[Kinds, dict[str, Tally]]
_Values = dict[tuple[str, Slot, Kinds, str], set[str]]


class Needs:
    """The counts of a memory.

    Args:
        domain: what facts there are about arguments. Steps of skills that it lacks are passed over.
    """

    def __init__(self, domain: Domain) -> None:
        self.domain = domain
        self.runs = 0
        self.before: dict[str, dict[Slot, _ByKinds]] = {}
        self.forms: dict[str, dict[Slot, set[str]]] = {}
        self.uses: dict[tuple[str, tuple[str, ...]], dict[Kinds, dict[str, int]]] = {}
        # runs as the bits of a number, so that sets of them are cheap to keep and to join
        self.had: dict[tuple[str, Slot], dict[Kinds, dict[str, int]]] = {}
        self.users: dict[tuple[str, tuple[str, ...]], dict[Kinds, int]] = {}
        self.here: dict[tuple[str, Kinds, str, int], Here] = {}
        self.all_times: dict[tuple[Slot, Kinds], Tally] = {}
        self.less_own: dict[tuple[str, Slot, Kinds], Tally] = {}
        self.after: dict[str, dict[Slot, Tally]] = {}
        self.changes: dict[str, dict[Slot, set[str]]] = {}
        self.played: dict[tuple[str, str], set[str]] = {}
        self.implied: dict[tuple[object, ...], bool] = {}

    @classmethod
    def of(cls, demonstrations: Iterable[Demonstration], domain: Domain) -> Needs:
        """The counts of some demonstrations."""
        found = cls(domain)
        for d in demonstrations:
            found.learn(d)
        return found

    def learn(self, demonstration: Demonstration) -> None:
        """Count one more demonstration."""
        self.add(
            [
                Moment(
                    demonstration.task,
                    s.index,
                    s.subtask,
                    s.graph,
                    s.whole,
                    demonstration.after(position),
                )
                for position, s in enumerate(demonstration.steps)
            ],
            together=True,
        )

    def add(self, moments: Sequence[Moment], *, together: bool = False) -> None:
        """Count the steps of one run.

        Args:
            moments: its steps.
            together: whether they are the whole run, so that each is another time to the others.
        """
        moments = [m for m in moments if self._known(m.subtask)]
        own = 1 << self.runs
        self.runs += 1
        values: _Values = {}
        used: set[tuple[str, tuple[str, ...], Kinds, str]] = set()
        asked = [self._before(m, values, used) for m in moments]
        for (family, slot, kinds, task), found in values.items():
            by_kinds = self.before.setdefault(family, {}).setdefault(slot, {})
            by_kinds.setdefault(kinds, {}).setdefault(task, Tally()).add(found)
            had = self.had.setdefault((family, slot), {}).setdefault(kinds, {})
            for value in found:
                had[value] = had.get(value, 0) | own
        for family, variables, kinds, task in used:
            by_task = self.uses.setdefault((family, variables), {}).setdefault(kinds, {})
            by_task[task] = by_task.get(task, 0) + 1
            users = self.users.setdefault((family, variables), {})
            users[kinds] = users.get(kinds, 0) | own
        self._effects(moments, asked)
        if together:
            self._other_times(moments, asked)

    def kinds(self, subtask: Subtask, graph: SceneGraph | None = None) -> dict[str, str]:
        """Variable → category of its argument."""
        found = {}
        for variable, name in self.domain.bound(subtask).items():
            node = None if graph is None else graph.get(name)
            category = category_of(name) if node is None else node.category
            found[variable] = self.domain.canonical(category)
        return found

    def elsewhere(self, family: str, slot: Slot, kinds: Kinds) -> Tally:
        """Values of a fact about such things, the times before this skill left out."""
        total = self.all_times.get((shape(slot), kinds), Tally())
        own = self.less_own.get((family, slot, kinds))
        return total if own is None else total.plus(own)

    def in_demonstrations(
        self, family: str, slot: Slot, kinds: Collection[Kinds], value: str
    ) -> tuple[int, int, int]:
        """How many demonstrations show a fact before a skill, each counted once.

        Args:
            family: of the skill.
            slot: the fact.
            kinds: of things, taken together.
            value: of the fact.

        Returns:
            Those in which it had this value alone, those in which it was observed, those in which
            the skill was used on such things.
        """
        had = self.had.get((family, slot), {})
        users = self.users.get((family, variables_of(slot)), {})
        so = otherwise = used = 0
        for k in kinds:
            used |= users.get(k, 0)
            for v, runs in had.get(k, {}).items():
                if v == value:
                    so |= runs
                else:
                    otherwise |= runs
        return (so & ~otherwise).bit_count(), (so | otherwise).bit_count(), used.bit_count()

    def brings_about(self, subtask: Subtask) -> frozenset[Literal]:
        """What was so after every demonstrated use of a skill, and not before at least one."""
        family = self.domain.family(subtask)
        names = self.domain.bound(subtask)
        found = set()
        for slot, values in self.changes.get(family, {}).items():
            tally = self.after[family][slot]
            for value in values:
                if tally.always(value) == tally.seen:
                    found.add(literal_of(slot, value).bind(names))
        return frozenset(found)

    def _known(self, subtask: Subtask) -> bool:
        skill = self.domain.skills.get(subtask.skill)
        return skill is not None and len(skill.parameters) == len(subtask.args)

    def _before(
        self,
        moment: Moment,
        values: _Values,
        used: set[tuple[str, tuple[str, ...], Kinds, str]],
    ) -> list[Slot]:
        """What is so before one step; the slots about its arguments."""
        domain, subtask, graph = self.domain, moment.subtask, moment.scoped
        family = domain.family(subtask)
        kinds = self.kinds(subtask, graph)
        skill = domain.skills[subtask.skill]
        here = self.here.setdefault(
            (family, tuple(kinds.values()), moment.task, moment.index), Here()
        )
        here.runs += 1
        for variable, name in domain.bound(subtask).items():
            self.played.setdefault((family, variable), set()).add(kinds[variable])
            if name in graph.hidden:
                here.blind[variable] = here.blind.get(variable, 0) + 1
        slots: dict[Slot, None] = {}
        for literal in sorted(candidates(graph, subtask, domain)):
            slot = slot_of(literal)
            value = value_of(slot, literal.value, graph, subtask, domain)
            found = set() if value is None else {value}
            if kind_of(literal, domain, skill) is Kind.CONTEXT:
                here.slots.setdefault(slot, Tally()).add(found)
                continue
            slots[slot] = None
            self.forms.setdefault(family, {}).setdefault(slot, set()).add(literal.value)
            key = (family, slot, kinds_of(slot, kinds), moment.task)
            values.setdefault(key, set()).update(found)
        for slot in slots:
            variables = variables_of(slot)
            used.add((family, variables, kinds_of(slot, kinds), moment.task))
        for variable in kinds:
            used.add((family, (variable,), (kinds[variable],), moment.task))
        return list(slots)

    def _effects(self, moments: Sequence[Moment], asked: Sequence[list[Slot]]) -> None:
        """What each skill left behind."""
        after: dict[tuple[str, Slot], set[str]] = {}
        for m, slots in zip(moments, asked, strict=True):
            if m.after is None:
                continue
            family = self.domain.family(m.subtask)
            for slot in slots:
                was = value_of(slot, None, m.whole, m.subtask, self.domain)
                now = value_of(slot, None, m.after, m.subtask, self.domain)
                if now is None:
                    continue
                after.setdefault((family, slot), set()).add(now)
                if was is not None and was != now:
                    self.changes.setdefault(family, {}).setdefault(slot, set()).add(now)
        for (family, slot), found in after.items():
            self.after.setdefault(family, {}).setdefault(slot, Tally()).add(found)

    def _other_times(self, moments: Sequence[Moment], asked: Sequence[list[Slot]]) -> None:
        """The same facts about the same things whenever they are not what is done next."""
        domain = self.domain
        times: dict[tuple[Slot, Kinds], dict[Slot, list[str | None]]] = {}
        roles: dict[tuple[str, Slot, Kinds], dict[Slot, set[int]]] = {}
        for now, (m, slots) in enumerate(zip(moments, asked, strict=True)):
            names, kinds = domain.bound(m.subtask), self.kinds(m.subtask, m.whole)
            for slot in slots:
                own = kinds_of(slot, kinds)
                ground = (slot[0], tuple(names.get(a, a) for a in slot[1]))
                facts = times.setdefault((shape(slot), own), {})
                if ground not in facts:
                    facts[ground] = [
                        value_of(slot, None, o.whole, m.subtask, domain) for o in moments
                    ]
                family = domain.family(m.subtask)
                roles.setdefault((family, slot, own), {}).setdefault(ground, set()).add(now)
        overall: dict[tuple[Slot, Kinds], set[str]] = {}
        for key, facts in times.items():
            overall[key] = {v for values in facts.values() for v in values if v is not None}
            self.all_times.setdefault(key, Tally()).add(overall[key])
        for (family, slot, own), busy in roles.items():
            outside = {
                v
                for ground, values in times[shape(slot), own].items()
                for at, v in enumerate(values)
                if v is not None and at not in busy.get(ground, ())
            }
            key = (shape(slot), own)
            if outside != overall[key]:
                less = self.less_own.setdefault((family, slot, own), Tally())
                less.add(overall[key], -1)
                less.add(outside)


_KEPT = 8
_recent: OrderedDict[tuple[object, ...], tuple[Needs, tuple[Demonstration, ...]]] = OrderedDict()


def needs_of(demonstrations: Sequence[Demonstration], domain: Domain) -> Needs:
    """The counts of a memory, those of the last few kept: run after run asks the same ones."""
    key = (id(domain), *map(id, demonstrations))
    found = _recent.get(key)
    if found is None:
        found = _recent[key] = (Needs.of(demonstrations, domain), tuple(demonstrations))
        while len(_recent) > _KEPT:
            _recent.popitem(last=False)
    _recent.move_to_end(key)
    return found[0]


def slot_of(literal: Literal) -> Slot:
    """A literal without its value."""
    return (literal.predicate, literal.args)


def literal_of(slot: Slot, value: str) -> Literal:
    """A slot with a value."""
    return Literal(slot[0], slot[1], value)


def variables_of(slot: Slot) -> tuple[str, ...]:
    """The variables of a slot."""
    return tuple(a for a in slot[1] if a.startswith("?"))


def kinds_of(slot: Slot, kinds: Mapping[str, str]) -> Kinds:
    """The categories of a slot's variables."""
    return tuple(kinds[v] for v in variables_of(slot))


def shape(slot: Slot) -> Slot:
    """A slot whatever the variables are called: the same fact as the argument of another skill."""
    names = {v: f"?{i}" for i, v in enumerate(dict.fromkeys(variables_of(slot)))}
    return (slot[0], tuple(names.get(a, a) for a in slot[1]))


def value_of(
    slot: Slot, known: str | None, graph: SceneGraph, subtask: Subtask, domain: Domain
) -> str | None:
    """The value of a slot in a graph; None where it was not observed.

    `known` is a value that it has if it is a state: states are read off the graph and not asked.
    """
    if slot[0] in domain.attributes:
        if known is not None:
            return known
        node = graph.get(domain.bound(subtask).get(slot[1][0], slot[1][0]))
        return None if node is None else node.state(slot[0])
    found = evaluate(literal_of(slot, "true"), graph, subtask, domain)
    return None if found is Truth.UNOBSERVED else found.value
