"""Diagnosis without a language model: which fact that held in every demonstration fails now.

Called by the strategies. Preconditions are mined from the retrieved demonstrations by the callables
given to the constructor, or, before a subtask, from the counts of the whole memory; then what later
steps need and no step puts right is a cause, too. Nothing is asked of a simulator. After a subtask
the references show what held after it, and the same mining gives its postconditions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Protocol

from forestall.comparison.corrections import Corrections
from forestall.comparison.expectations import NoExpectations, shown
from forestall.comparison.lacking import Knowledge, lacking, step_of
from forestall.comparison.needs import Needs
from forestall.comparison.preconditions import needed
from forestall.comparison.relevance import counts
from forestall.comparison.unasked import not_judged, unasked
from forestall.domain.model import LOCATED, Domain
from forestall.domain.spoken import placing, told
from forestall.domain.truth import is_shut, truth
from forestall.records.sentences import in_demonstrations
from forestall.seams.judging import Expectations
from forestall.types.facts import Literal, Truth, category_of, is_instance
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.types.runtime import BoundaryContext, When
from forestall.types.verdict import (
    Diagnosis,
    Precondition,
    Reference,
    Verdict,
    Violation,
)

_TOLD = 3
"""How many differences a sentence names."""


class Miner(Protocol):
    """Mines what held before a subtask in its references, lifted to ?object and ?target."""

    def __call__(
        self,
        references: Sequence[Reference],
        domain: Domain,
        *,
        subtask: Subtask | None = None,
        task: str | None = None,
    ) -> Sequence[Precondition]:
        """Preconditions, the best supported first."""


Remembered = Callable[[Needs, Subtask, str | None, int | None], Sequence[Precondition]]
"""Counts of a memory, subtask, task, step → what is mined of them."""

Violations = Callable[[Sequence[Precondition], SceneGraph, Subtask, Domain], Sequence[Violation]]


class SymbolicReasoner:
    """Implements `Reasoner`.

    Args:
        mine: references → what held before the subtask in all of them, lifted.
        violations: preconditions → those that do not hold on a graph, ground.
        domain: the categories.
        corrections: what a person says of what held before subtasks.
        knowledge: what is known of the whole memory and of the plan; None: only the references of
            a boundary are.
        remembered: mines from that memory.
        expectations: what should hold before subtasks that no demonstration in it shows.
    """

    name = "preconditions"

    def __init__(
        self,
        mine: Miner,
        violations: Violations,
        domain: Domain,
        corrections: Corrections | None = None,
        *,
        knowledge: Knowledge | None = None,
        remembered: Remembered = needed,
        expectations: Expectations | None = None,
    ) -> None:
        self._expectations = expectations or NoExpectations()
        self.mine = mine
        self.violations = violations
        self.domain = domain
        self.corrections = corrections
        self._knowledge, self._remembered = knowledge, remembered

    def diagnose(self, context: BoundaryContext, verdict: Verdict) -> Diagnosis:
        """Name the violated facts about the subtask's arguments; unobserved ones do not count."""
        return replace(
            self._diagnosis(context, verdict), exchanges=self._expectations.asked(context)
        )

    def _diagnosis(self, context: BoundaryContext, verdict: Verdict) -> Diagnosis:
        subtask, graph, when = context.subtask, context.graph, context.when
        knows = self._knowledge is not None and when is When.BEFORE
        if not context.references and not knows:
            return self._nothing(f"there is no demonstration to compare {subtask} with")
        preconditions, found = self._known(context) if knows else self._shown(context)
        broken = [v for v in found if v.truth is Truth.FALSE]
        if not broken:
            matters = f"matter {when.value} {subtask.skill}"
            return self._nothing(
                f"nothing is violated that the demonstrations show to {matters}"
                f"{self._not_judged(context) if knows else ''}{_difference(verdict)}"
            )
        domain = self.domain
        broken.sort(key=lambda v: _order(v, domain))
        failed = {v.literal for v in broken}
        shown_to = [p for p in preconditions if not p.expected_by]
        ground = (p.literal.bind(domain.bound(subtask)) for p in shown_to)
        stay = {x for x in ground if x not in failed and truth(graph, x, domain) is Truth.TRUE}
        planned = context.plan.subtasks[context.index]
        later = context.remaining()
        causes = [
            explain(v, graph, later[v.ahead] if v.ahead else planned, domain, when) for v in broken
        ]
        culprits = dict.fromkeys(
            y for v in broken for x in _culprits(v.literal, graph, domain) for y in _ids(graph, x)
        )
        return Diagnosis(
            cause=causes[0],
            must_change=tuple(dict.fromkeys(v.literal for v in broken)),
            must_stay=tuple(sorted(stay)),
            culprits=tuple(culprits),
            producer=self.name,
            support=_support(broken[0].precondition),
        )

    def _shown(
        self, context: BoundaryContext
    ) -> tuple[Sequence[Precondition], Sequence[Violation]]:
        """What the references show, and what of it is not so."""
        subtask, graph = context.subtask, context.graph
        mined = self.mine(context.references, self.domain, subtask=subtask, task=context.task.name)
        if context.when is When.BEFORE:
            mined = self._corrected(mined, subtask, context.task.name)
        return mined, [
            v
            for v in self.violations(mined, graph, subtask, self.domain)
            if counts(v, subtask, graph, context.when, self.domain)
        ]

    def _known(
        self, context: BoundaryContext
    ) -> tuple[Sequence[Precondition], Sequence[Violation]]:
        """What the whole memory shows, and what of it is not so, for later steps, too."""
        assert self._knowledge is not None
        memory, task = self._knowledge.counts(), context.task.name

        def mined(subtask: Subtask, step: int | None) -> Sequence[Precondition]:
            found = self._remembered(memory, subtask, task, step)
            known = self._expectations.over(found, subtask, context, partial(shown, memory))
            return self._corrected(known, subtask, task)

        step = step_of(context.references, task, context.done)
        whole = replace(context, scoped=context.graph)
        found = lacking(whole, mined, self._knowledge, self.domain)
        return mined(context.subtask, step), found

    def _not_judged(self, context: BoundaryContext) -> str:
        """What does not hold and is asked of other tasks only, as the end of a sentence."""
        assert self._knowledge is not None
        memory, subtask, task = self._knowledge.counts(), context.subtask, context.task.name
        others = unasked(memory, subtask, task)
        said = not_judged(others, context.graph, subtask, task, memory)
        return f"; {said}" if said else ""

    def _corrected(
        self, mined: Sequence[Precondition], subtask: Subtask, task: str
    ) -> Sequence[Precondition]:
        if self.corrections is None:
            return mined
        return self.corrections.over(mined, subtask, task, self.domain)

    def _nothing(self, cause: str) -> Diagnosis:
        return Diagnosis(cause=cause, must_change=(), producer=self.name)


def _support(precondition: Precondition) -> tuple[int, int] | None:
    """In how many demonstrations it held, None where a language model says so."""
    p = precondition
    return None if p.expected_by else (p.support, p.total)


def _order(violation: Violation, domain: Domain) -> tuple[object, ...]:
    """Which violation names the cause: what cannot be undone, then what weighs most, then basic.

    Weights that differ by chance are one weight.
    """
    v = violation
    return v.undoable, -round(v.precondition.weight, 1), _rank(v.literal, domain), v.literal


def _difference(verdict: Verdict) -> str:
    """What differs from the nearest demonstration, where no cause is known."""
    texts = [d.text for d in verdict.discrepancies]
    if not texts:
        return ""
    more = f"; and {len(texts) - _TOLD} more" if len(texts) > _TOLD else ""
    return f"; what differs from the nearest one: {'; '.join(texts[:_TOLD])}{more}"


def _ids(graph: SceneGraph, name: str) -> tuple[str, ...]:
    """Node ids of a name; an instance that has gone out of the graph keeps its name."""
    return graph.matches(name) or ((name,) if is_instance(name) else ())


def explain(
    violation: Violation,
    graph: SceneGraph,
    subtask: Subtask,
    domain: Domain,
    moment: When = When.BEFORE,
) -> str:
    """One sentence: what is the case, and what it was in the demonstrations."""
    literal, p, roles = violation.literal, violation.precondition, domain.roles
    if p.by_hand:
        return _said(literal, graph, subtask, domain, "a person says")
    if p.expected_by:
        who = f"no demonstration shows it, but the language model {p.expected_by} says"
        return _said(literal, graph, subtask, domain, who)
    when = in_demonstrations(p.support, p.total)
    name = literal.args[0] if literal.args else ""
    predicate, yes = literal.predicate, literal.value == "true"
    if predicate == roles.vacant and yes:
        there = _listed(graph, name, domain)
        return f"{there} {name}, which is empty {when} {moment.value} {subtask}"
    if literal.is_state:
        node = graph.get(name)
        now = node.state(predicate) if node is not None else None
        seen = "in an unknown state" if now is None else domain.say(predicate, now)
        return f"{name} is {seen}; it was {domain.say(predicate, literal.value)} {when}"
    if predicate in (roles.holding, roles.hand_empty):
        return _about_hand(literal, graph, when, domain)
    if predicate == roles.unblocked and yes:
        front = ", ".join(_blockers(graph, name, domain)) or "something"
        return f"{front} stands in front of {name}; nothing did {when}"
    if predicate == LOCATED:
        return f"the place of {name} is not known; it was known {when}"
    if predicate == roles.accessible and yes:
        closed = _closed(graph, name, domain)
        return f"{name} is inside {closed}, which is closed; it was open {when}"
    return f"{told(literal, domain, holds=False)}, unlike {when}"


def _said(literal: Literal, graph: SceneGraph, subtask: Subtask, domain: Domain, says: str) -> str:
    """What a person or a language model says must hold, and does not."""
    name, said = literal.args[0] if literal.args else "", f"{says} that it must be"
    if literal.is_state:
        node = graph.get(name)
        now = None if node is None else node.state(literal.predicate)
        seen = "in an unknown state" if now is None else domain.say(literal.predicate, now)
        must = domain.say(literal.predicate, literal.value)
        return f"{name} is {seen}; {said} {must} before {subtask.skill}"
    return f"{told(literal, domain, holds=False)}; {said} otherwise before {subtask.skill}"


def _rank(literal: Literal, domain: Domain) -> int:
    """Which of two equally heavy facts names the cause: the more basic one."""
    r = domain.roles
    order = (LOCATED, r.holding, r.hand_empty, r.unblocked, r.vacant, r.accessible)
    return order.index(literal.predicate) if literal.predicate in order else len(order)


def _about_hand(literal: Literal, graph: SceneGraph, when: str, domain: Domain) -> str:
    about, hands = literal.predicate == domain.roles.hand_empty, domain.robot.hands
    held = graph.in_hands(hands if about else literal.args[1:])
    hand = f"the {hands[0] if len(hands) == 1 else 'hand' if about else literal.args[-1]}"
    now = f"holds {' and '.join(held)}" if held else "is empty"
    if about:
        was = "was empty" if literal.value == "true" else "held something"
    else:
        was = f"{'held' if literal.value == 'true' else 'did not hold'} {literal.args[0]}"
    return f"{hand} {now}; it {was} {when}"


def _listed(graph: SceneGraph, name: str, domain: Domain) -> str:
    """The contents of a thing as the beginning of a sentence: "Bowl-1 is inside"."""
    contents = graph.contents(name, domain.containing)
    relation = next(
        (r.predicate for r in graph.relations if r.object == name and r.subject in contents),
        "in",
    )
    subjects = " and ".join(contents) or "something"
    return f"{subjects} {'are' if len(contents) > 1 else 'is'} {placing(relation, domain)}"


def _blockers(graph: SceneGraph, name: str, domain: Domain) -> tuple[str, ...]:
    blocking = domain.roles.blocking
    return tuple(r.subject for r in graph.relations if r.predicate == blocking and r.object == name)


def _closed(graph: SceneGraph, name: str, domain: Domain) -> str:
    """What shuts a thing in, the nearest first; two things may be taken to hold each other."""
    pending, known = [name], {name}
    while pending:
        for parent in graph.parents(pending.pop(), domain.containing):
            node = graph.get(parent)
            if node is not None and is_shut(domain, node.category, dict(node.states)) is Truth.TRUE:
                return parent
            if parent not in known:
                known.add(parent)
                pending.append(parent)
    return ""


def _culprits(literal: Literal, graph: SceneGraph, domain: Domain) -> tuple[str, ...]:
    """The offending things first, then what the fact is about."""
    roles = domain.roles
    names = tuple(a for a in literal.args if a not in domain.robot.hands)
    first = names[0] if names else ""
    if literal.predicate == roles.vacant:
        return (*graph.contents(first, domain.containing), first)
    if literal.predicate == roles.unblocked:
        return (*_blockers(graph, first, domain), first)
    if literal.predicate == roles.accessible:
        return tuple(x for x in (_closed(graph, first, domain), first) if x)
    if literal.predicate == roles.hand_empty:
        return graph.in_hands(domain.robot.hands) or names
    if literal.predicate == roles.holding:
        held = graph.in_hands(literal.args[1:])
        return (*names, *(h for h in held if category_of(h) != category_of(first)))
    return names
