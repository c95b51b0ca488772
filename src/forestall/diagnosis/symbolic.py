"""Diagnosis without a language model: which fact that held in every demonstration fails now.

Called by the strategies. Preconditions are mined from the retrieved demonstrations by the callables
given to the constructor; nothing is asked of a simulator. After a subtask the references show what
held after it, and the same mining gives its postconditions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from forestall.grounding import is_open_support
from forestall.types.facts import GRIPPER, Literal, Truth, category_of, is_instance
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.types.runtime import BoundaryContext, When
from forestall.types.verdict import Diagnosis, Precondition, Reference, Verdict, Violation
from forestall.vocabulary import Vocabulary

_UNDONE = {
    "open_obj": Literal("open", ("?target",), "closed"),
    "close_obj": Literal("open", ("?target",), "open"),
    "toggle_on": Literal("toggled", ("?target",), "off"),
    "toggle_off": Literal("toggled", ("?target",), "on"),
}
"""Skill → the state that it ends."""


class Miner(Protocol):
    """Mines what held before a subtask in its references, lifted to ?object and ?target."""

    def __call__(
        self,
        references: Sequence[Reference],
        vocabulary: Vocabulary,
        *,
        subtask: Subtask | None = None,
        task: str | None = None,
    ) -> Sequence[Precondition]:
        """Preconditions, the best supported first."""


Violations = Callable[[Sequence[Precondition], SceneGraph, Subtask], Sequence[Violation]]


class SymbolicReasoner:
    """Implements `Reasoner`.

    Args:
        mine: references → what held before the subtask in all of them, lifted.
        violations: preconditions → those that do not hold on a graph, ground.
        vocabulary: the categories.
    """

    name = "preconditions"

    def __init__(self, mine: Miner, violations: Violations, vocabulary: Vocabulary) -> None:
        self.mine = mine
        self.violations = violations
        self.vocabulary = vocabulary

    def diagnose(self, context: BoundaryContext, verdict: Verdict) -> Diagnosis:
        """Name the violated facts about the subtask's arguments; unobserved ones do not count."""
        subtask, graph, when = context.subtask, context.graph, context.when
        if not context.references:
            return self._nothing(f"there is no demonstration to compare {subtask} with")
        preconditions = self.mine(
            context.references, self.vocabulary, subtask=subtask, task=context.task.name
        )
        broken = [
            v
            for v in self.violations(preconditions, graph, subtask)
            if v.truth is Truth.FALSE and _counts(v, subtask, graph, when, self.vocabulary)
        ]
        if not broken:
            count = len(context.references)
            return self._nothing(
                f"nothing that held {when.value} {subtask.skill} in the {count} retrieved "
                f"demonstration{'s' if count != 1 else ''} is violated"
            )
        broken.sort(key=lambda v: (-v.precondition.weight, _rank(v.literal), v.literal))
        failed = {v.literal for v in broken}
        ground = (p.literal.bind(subtask.roles()) for p in preconditions)
        stay = {x for x in ground if x not in failed and graph.truth(x) is Truth.TRUE}
        planned = context.plan.subtasks[context.index]
        causes = [explain(v, graph, planned, when) for v in broken]
        culprits = dict.fromkeys(
            y for v in broken for x in _culprits(v.literal, graph) for y in _ids(graph, x)
        )
        return Diagnosis(
            cause=causes[0],
            must_change=tuple(dict.fromkeys(v.literal for v in broken)),
            must_stay=tuple(sorted(stay)),
            culprits=tuple(culprits),
            producer=self.name,
        )

    def _nothing(self, cause: str) -> Diagnosis:
        return Diagnosis(cause=cause, must_change=(), producer=self.name)


def _counts(
    violation: Violation, subtask: Subtask, graph: SceneGraph, when: When, vocabulary: Vocabulary
) -> bool:
    """Whether a violated fact matters before a subtask, or after it."""
    lifted = violation.precondition.literal
    if when is When.BEFORE:
        return _concerns(violation, vocabulary) and not _is_the_effect(lifted, subtask)
    if lifted in _PUT:
        return not _on_another(violation.literal, graph, vocabulary)
    return _concerns(violation, vocabulary)


_PUT = (
    Literal("inside", ("?object", "?target")),
    Literal("on_top_of", ("?object", "?target")),
)
"""What putting something somewhere brings about."""


def _on_another(literal: Literal, graph: SceneGraph, vocabulary: Vocabulary) -> bool:
    """Whether a thing stands on another instance of a support of which any will do."""
    thing, target = literal.args
    return is_open_support(vocabulary, category_of(target)) and any(
        category_of(parent) == category_of(target) for parent in graph.parents(thing)
    )


def _is_the_effect(literal: Literal, subtask: Subtask) -> bool:
    """Whether a fact is violated only because what the subtask is to bring about holds already.

    That a door was closed before it was opened is no need of opening it.
    """
    return literal == _UNDONE.get(subtask.skill)


def _ids(graph: SceneGraph, name: str) -> tuple[str, ...]:
    """Node ids of a name; an instance that has gone out of the graph keeps its name."""
    return graph.matches(name) or ((name,) if is_instance(name) else ())


def explain(
    violation: Violation, graph: SceneGraph, subtask: Subtask, moment: When = When.BEFORE
) -> str:
    """One sentence: what is the case, and what it was in the demonstrations."""
    literal, p = violation.literal, violation.precondition
    many = f"all {p.total}" if p.support == p.total else f"{p.support} of {p.total}"
    when = f"in {many} demonstration{'s' if p.total != 1 else ''}"
    name = literal.args[0] if literal.args else ""
    predicate = literal.predicate
    if predicate == "vacant" and literal.value == "true":
        return f"{_listed(graph, name)} {name}, which is empty {when} {moment.value} {subtask}"
    if literal.is_state:
        node = graph.get(name)
        now = node.state(predicate) if node is not None else None
        return (
            f"{name} is {_value(predicate, now)}; it was {_value(predicate, literal.value)} {when}"
        )
    if predicate in ("held_by", "hand_empty"):
        return _about_hand(literal, graph, when)
    if predicate == "unblocked" and literal.value == "true":
        front = ", ".join(_blockers(graph, name)) or "something"
        return f"{front} stands in front of {name}; nothing did {when}"
    if predicate == "located":
        return f"the place of {name} is not known; it was known {when}"
    if predicate == "accessible" and literal.value == "true":
        return f"{name} is inside {_closed(graph, name)}, which is closed; it was open {when}"
    relation = f"{predicate.replace('_', ' ')} {literal.args[-1]}" if literal.args else predicate
    if literal.value == "false":
        return f"{name} is {relation}; it was not {when}"
    return f"{name} is not {relation}; it was {when}"


def _concerns(violation: Violation, vocabulary: Vocabulary) -> bool:
    """Whether a violated fact speaks of an argument, and not merely of where it happens to stand.

    Which counter a thing stood on is a habit of the demonstrations and not a need.
    """
    lifted = violation.precondition.literal
    if lifted.predicate in ("inside", "on_top_of") and lifted.value == "true":
        if not lifted.args[0].startswith("?"):
            return lifted.args[1].startswith("?")
        place = vocabulary.find(violation.literal.args[1])
        return place is None or not place.fixture
    if lifted.predicate in ("hand_empty", "held_by"):
        return True
    return any(a.startswith("?") for a in lifted.args)


def _rank(literal: Literal) -> int:
    """Which of two equally heavy facts names the cause: the more basic one."""
    order = ("located", "held_by", "hand_empty", "unblocked", "vacant", "accessible")
    return order.index(literal.predicate) if literal.predicate in order else len(order)


def _about_hand(literal: Literal, graph: SceneGraph, when: str) -> str:
    held = graph.holding
    if literal.predicate == "hand_empty":
        if literal.value == "true":
            return f"the gripper holds {held}; it was empty {when}"
        return f"the gripper is empty; it held something {when}"
    now = "is empty" if held is None else f"holds {held}"
    if literal.value == "false":
        return f"the gripper {now}; it did not hold {literal.args[0]} {when}"
    return f"the gripper {now}; it held {literal.args[0]} {when}"


def _value(attribute: str, value: str | None) -> str:
    if value is None:
        return "in an unknown state"
    if attribute == "filled" and value != "empty":
        return f"filled with {value}"
    return f"at {value} temperature" if value == "room" else value


def _listed(graph: SceneGraph, name: str) -> str:
    """The contents of a thing as the beginning of a sentence: "Bowl-1 is inside"."""
    contents = graph.contents(name)
    relation = next(
        (r.predicate for r in graph.relations if r.object == name and r.subject in contents),
        "inside",
    )
    words = {"inside": "inside", "on_top_of": "on top of"}.get(relation, relation)
    subjects = " and ".join(contents) or "something"
    return f"{subjects} {'are' if len(contents) > 1 else 'is'} {words}"


def _blockers(graph: SceneGraph, name: str) -> tuple[str, ...]:
    return tuple(
        r.subject for r in graph.relations if r.predicate == "blocking" and r.object == name
    )


def _closed(graph: SceneGraph, name: str) -> str:
    for parent in graph.parents(name):
        node = graph.get(parent)
        if node is not None and node.state("open") == "closed":
            return parent
        above = _closed(graph, parent)
        if above:
            return above
    return ""


def _culprits(literal: Literal, graph: SceneGraph) -> tuple[str, ...]:
    """The offending things first, then what the fact is about."""
    names = tuple(a for a in literal.args if a != GRIPPER)
    first = names[0] if names else ""
    if literal.predicate == "vacant":
        return (*graph.contents(first), first)
    if literal.predicate == "unblocked":
        return (*_blockers(graph, first), first)
    if literal.predicate == "accessible":
        return tuple(x for x in (_closed(graph, first), first) if x)
    if literal.predicate == "hand_empty" and graph.holding is not None:
        return (graph.holding,)
    if literal.predicate == "held_by" and graph.holding is not None:
        same = category_of(graph.holding) == category_of(first)
        return names if same else (*names, graph.holding)
    return names
