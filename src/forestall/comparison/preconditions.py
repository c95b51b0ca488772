"""Preconditions mined from demonstrations: what held before a skill, and what of it does not now.

Called by the detector and the reasoner; calls needs, which counts, and tally, which weighs. Needs
transfer: a fact about the skill's arguments is mined from every task, and from every kind of thing
that plays the same part, as far as nothing narrower speaks against it. The rest of the scene is
mined from the same step of the same task alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from forestall.comparison.implied import said_once
from forestall.comparison.lifting import Kind, evaluate, kind_of, lift
from forestall.comparison.needs import (
    Kinds,
    Moment,
    Needs,
    Slot,
    literal_of,
    variables_of,
)
from forestall.comparison.parts import applies, same_part, spoken_of
from forestall.comparison.tally import EXCEPTION, VARIED, Tally, weight
from forestall.domain.model import Domain
from forestall.errors import InputError
from forestall.types.facts import Truth
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.types.verdict import Precondition, Reference, Specificity, Support, Violation

__all__ = ["MiningConfig", "lift", "mine", "needed", "violations"]

_EVEN = 0.5


@dataclass(frozen=True, slots=True)
class MiningConfig:
    """How much evidence a precondition needs.

    Args:
        minimum_support: demonstrations in which the literal must have held; all of them, where
            there are fewer. One is enough to raise an alarm, whose cause says that it is one.
        contextual_support: the same for a literal about what is not an argument of the subtask.
        foreign_weight: least weight of what was never seen for these kinds of things, or, if it
            decides over a task's outcome only, never in this task; what the skill's schema speaks
            of needs no more than that the demonstrations of others do not speak against it.
        exception: how probable it is that a need was not seen to be met before a skill that went
            well. 0 where nobody can have seen wrong: one exception then tells a habit.
    """

    minimum_support: int = 2
    contextual_support: int = 3
    foreign_weight: float = VARIED
    exception: float = EXCEPTION

    def __post_init__(self) -> None:
        if self.minimum_support < 1 or self.contextual_support < 1:
            raise InputError("a precondition needs the support of at least one demonstration")
        if not 0 <= self.foreign_weight <= 1:
            raise InputError(f"foreign_weight {self.foreign_weight} is not between 0 and 1")
        if not 0 <= self.exception < 1:
            raise InputError(f"exception {self.exception}: give a probability, 0 or more, below 1")


def mine(
    references: Sequence[Reference],
    domain: Domain,
    config: MiningConfig | None = None,
    *,
    subtask: Subtask | None = None,
    task: str | None = None,
) -> tuple[Precondition, ...]:
    """Preconditions of a subtask from retrieved references alone; see `needed`.

    Args:
        references: as retrieved, best first.
        domain: categories and how they hold things.
        config: how much evidence is needed.
        subtask: the subtask at hand; that of the best reference by default.
        task: name of the task at hand; that of the best reference by default.

    Returns:
        Preconditions, the heaviest first; `support` and `total` count demonstrations, also where
        several steps of one were retrieved.
    """
    if not references:
        return ()
    subtask = subtask or references[0].subtask
    task = task if task is not None else references[0].task
    family = domain.family(subtask)
    runs: dict[str, list[Moment]] = {}
    for r in references:
        if domain.family(r.subtask) == family:
            moment = Moment(r.task, r.index, r.subtask, r.graph, r.graph, r.after)
            runs.setdefault(r.demonstration, []).append(moment)
    counts = Needs(domain)
    for moments in runs.values():
        counts.add(moments)
    step = next((m.index for r in runs.values() for m in r if m.task == task), None)
    return needed(counts, subtask, task, step, config)


def needed(
    counts: Needs,
    subtask: Subtask,
    task: str | None,
    step: int | None,
    config: MiningConfig | None = None,
) -> tuple[Precondition, ...]:
    """Preconditions of a subtask from the counts of a memory.

    A fact about arguments that decides whether the skill can run is asked of all tasks. It is kept
    at the widest level that adds to its weight: the same kinds of things, or all that play the same
    part. One that is of the matter (a thing was clean) is asked of the task at hand; it goes beyond
    only where the skill's schema speaks of it, or where it held in several tasks and varied
    elsewhere: that a thing was clean before one task says nothing about moving it out of the way.

    Args:
        counts: of the memory.
        subtask: the subtask at hand.
        task: name of the task at hand, None where it is not known.
        step: index of the demonstrated step that what is about no argument is asked of.
        config: how much evidence is needed.

    Returns:
        Preconditions, the heaviest first.
    """
    config = config or MiningConfig()
    found = said_once(list(_of_arguments(counts, subtask, task, config)), counts, subtask)
    if task is not None and step is not None:
        found += _of_the_rest(counts, subtask, task, step, config)
    return tuple(sorted(found, key=lambda p: (-round(p.weight, 6), p.literal)))


def violations(
    preconditions: Sequence[Precondition], graph: SceneGraph, subtask: Subtask, domain: Domain
) -> tuple[Violation, ...]:
    """Preconditions that are false or unobserved in a graph, false ones first.

    Preconditions of other skills are passed over. The literal of a violation has the subtask's
    arguments in the place of the variables.
    """
    found = []
    for p in preconditions:
        if domain.family(Subtask(p.skill, ())) != domain.family(subtask):
            continue
        truth = evaluate(p.literal, graph, subtask, domain)
        if truth is not Truth.TRUE:
            found.append(Violation(p, p.literal.bind(domain.bound(subtask)), truth))
    return tuple(
        sorted(
            found,
            key=lambda v: (v.truth is not Truth.FALSE, -v.precondition.weight, v.literal),
        )
    )


def _of_arguments(
    counts: Needs, subtask: Subtask, task: str | None, config: MiningConfig
) -> Iterator[Precondition]:
    domain = counts.domain
    family, kinds = domain.family(subtask), counts.kinds(subtask)
    for slot in counts.before.get(family, {}):
        own = tuple(kinds[v] for v in variables_of(slot) if v in kinds)
        if len(own) == len(variables_of(slot)):
            asked = _Asked(counts, subtask, task, slot, own, config)
            for value in sorted(counts.forms[family][slot]):
                if (kept := asked.kept(value)) is not None:
                    yield kept


class _Asked:
    """One fact about the arguments of one subtask, with what was counted at each level."""

    def __init__(
        self,
        counts: Needs,
        subtask: Subtask,
        task: str | None,
        slot: Slot,
        own: Kinds,
        config: MiningConfig,
    ) -> None:
        self._domain, self._config = counts.domain, config
        self._subtask, self._slot, self._own = subtask, slot, own
        family = self._domain.family(subtask)
        by_kinds = counts.before[family][slot]
        uses = counts.uses[family, variables_of(slot)]
        parts = [k for k in by_kinds if same_part(counts, subtask, slot, own, k)]
        self._shown = partial(counts.in_demonstrations, family, slot, parts)
        mine = by_kinds.get(own, {})
        self._tasks = len(mine)
        self._tallies = {
            Specificity.TASK: mine.get(task, Tally()) if task is not None else Tally(),
            Specificity.CATEGORY: _total(mine.values()),
            Specificity.PART: _total(t for k in parts for t in by_kinds[k].values()),
        }
        self._uses = {
            Specificity.TASK: uses.get(own, {}).get(task or "", 0),
            Specificity.CATEGORY: sum(uses.get(own, {}).values()),
            Specificity.PART: sum(n for k in parts for n in uses.get(k, {}).values()),
        }
        near = counts.elsewhere(family, slot, own)
        self._elsewhere = {
            Specificity.TASK: near,
            Specificity.CATEGORY: near,
            Specificity.PART: _total(counts.elsewhere(family, slot, k) for k in parts),
        }

    def kept(self, value: str) -> Precondition | None:
        """The fact as a precondition at the level where it weighs most, None where it is none."""
        literal = literal_of(self._slot, value)
        skill = self._domain.skills[self._subtask.skill]
        kind = kind_of(literal, self._domain, skill)
        said = spoken_of(literal, skill)
        levels = self._levels(kind, value, said)
        if not levels:
            return None
        weights = {level: self._weight(level, value) for level in levels}
        if weights[levels[0]] <= _EVEN:
            return None  # the narrowest speaks against it
        best = max(levels, key=lambda x: (round(weights[x], 6), -levels.index(x)))
        held = self._tallies[best].always(value)
        if held < max(1, min(self._config.minimum_support, self._uses[best])):
            return None
        if self._foreign(kind) and not self._carries(best, weights[best], value, said):
            return None
        return Precondition(
            self._subtask.skill,
            literal,
            *self._support(best, value),
            weights[best],
            best,
            tuple(Support(x, *self._seen(x, value)) for x in self._tallies),
            self._elsewhere[best].ever(value),
        )

    def _support(self, level: Specificity, value: str) -> tuple[int, int]:
        """Demonstrations in which it held, and those that used the skill, each counted once."""
        if level is Specificity.PART:
            held, _, used = self._shown(value)
            return held, used
        return self._tallies[level].always(value), self._uses[level]

    def _seen(self, level: Specificity, value: str) -> tuple[int, int]:
        """Demonstrations in which it held, and those in which it was observed."""
        if level is Specificity.PART:
            return self._shown(value)[:2]
        return self._tallies[level].always(value), self._tallies[level].seen

    def _levels(self, kind: Kind, value: str, said: bool) -> list[Specificity]:
        """Levels that have a say and were observed, the narrowest first."""
        wide = [Specificity.CATEGORY, Specificity.PART]
        if kind is Kind.MATERIAL:
            varied = self._elsewhere[Specificity.CATEGORY].ever(value)[1] > 0
            several = self._tasks > 1 and varied
            wide = [Specificity.TASK, *(wide if said or several else ())]
        return [x for x in wide if self._tallies[x].seen]

    def _foreign(self, kind: Kind) -> bool:
        """Whether nothing of the kind was seen of what is at hand itself."""
        near = Specificity.TASK if kind is Kind.MATERIAL else Specificity.CATEGORY
        return not self._tallies[near].seen

    def _carries(self, level: Specificity, weighs: float, value: str, said: bool) -> bool:
        """Whether what was seen of others is enough to be asked of this."""
        varied = self._elsewhere[level].ever(value)[1] > 0
        enough = said or (varied and weighs >= self._config.foreign_weight)
        return enough and applies(self._slot, self._own, self._domain)

    def _weight(self, level: Specificity, value: str) -> float:
        tally = self._tallies[level]
        other = self._elsewhere[level].ever(value)
        return weight(tally.always(value), tally.seen, other, self._config.exception)


def _of_the_rest(
    counts: Needs, subtask: Subtask, task: str, step: int, config: MiningConfig
) -> Iterator[Precondition]:
    """What is about no argument, from one step of one task."""
    kinds = tuple(counts.kinds(subtask).values())
    here = counts.here.get((counts.domain.family(subtask), kinds, task, step))
    if here is None:
        return
    for slot, tally in here.slots.items():
        blind = sum(here.blind.get(v, 0) for v in variables_of(slot))
        seen = tally.seen if not slot[1] else here.runs - blind
        true = tally.always("true")
        if true >= config.contextual_support and true >= seen:
            yield Precondition(
                subtask.skill,
                literal_of(slot, "true"),
                true,
                here.runs,
                weight(true, true),
                Specificity.TASK,
                (Support(Specificity.TASK, true, true),),
            )


def _total(tallies: Iterable[Tally]) -> Tally:
    found = Tally()
    for t in tallies:
        found = found.plus(t)
    return found
