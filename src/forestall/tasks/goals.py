"""Scores a finished run on the truth: the strict check over state and history, and REFLECT's own.

The success condition C_goal of the paper (Sec. 3, "Problem Formulation") asks for one binding of
the goal's variables under which every literal holds in the end and nothing that must never happen
has happened. What must never happen is looked up in what is spoiled, in the final state and in
every event, so that washing the pan afterwards does not help. Calls: benchmark → here → oracle.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from forestall.domain.model import Domain
from forestall.domain.truth import truth
from forestall.errors import InputError
from forestall.seams.acting import OracleView
from forestall.types.episode import Event
from forestall.types.facts import GRIPPER, Literal, Truth, category_of
from forestall.types.graph import SceneGraph
from forestall.types.task import Goal

FACTS = ("state", "relation")
"""Kinds of events whose text is a fact; an event of another kind with several objects made them."""


@dataclass(frozen=True, slots=True)
class _History:
    """The final state with all that led to it."""

    graph: SceneGraph
    domain: Domain
    past: frozenset[Literal]  # history facts
    events: tuple[Event, ...]
    facts: tuple[Literal, ...]  # every fact that an event says became true

    @classmethod
    def of(cls, oracle: OracleView, domain: Domain) -> _History:
        events = oracle.events()
        return cls(oracle.truth(), domain, oracle.history(), events, tuple(_facts(events)))

    def holds(self, literal: Literal) -> bool:
        """Whether a literal is true in the end."""
        if literal.predicate in self.domain.histories:
            positive = Literal(literal.predicate, literal.args)
            return any(_covers(positive, f) for f in self.past) == (literal.value == "true")
        return truth(self.graph, literal, self.domain) is Truth.TRUE

    def happened(self, literal: Literal) -> bool:
        """Whether a literal is true in the end or became true at any time."""
        return self.holds(literal) or any(_covers(literal, f) for f in self.facts)

    def first(self, literal: Literal) -> tuple[float, str]:
        """When something first happened, and in which words; at 0 s if it was so at the start."""
        for event in self.events:
            fact = _fact(event)
            if literal.predicate in self.domain.histories:
                same = event.kind == literal.predicate
                told = same and _means(literal.args[0], event.objects[0])
            elif fact is not None:
                told = _covers(literal, fact)
            else:  # what was made is what it is from then on
                made = () if event.kind in self.domain.histories else event.objects[1:]
                told = any(_means(literal.args[0], o) and self._is(literal, o) for o in made)
            if told:
                return event.time_s, event.text
        return 0.0, f"{literal} from the start"

    def _is(self, literal: Literal, instance: str) -> bool:
        ground = Literal(literal.predicate, (instance, *literal.args[1:]), literal.value)
        return truth(self.graph, ground, self.domain) is Truth.TRUE

    def why(self, literal: Literal) -> str:
        """How a literal that does not hold looks instead."""
        if literal.predicate in self.domain.histories:
            return ""
        node = self.graph.get(literal.args[0]) if len(literal.args) == 1 else None
        value = None if node is None else node.state(literal.predicate)
        return "" if value is None else f": it is {value}"

    def cause(self, literal: Literal) -> str:
        """The words of the event behind something that must not have happened."""
        if literal.predicate not in self.domain.histories:
            return ""
        texts = (
            e.text
            for e in self.events
            if e.kind == literal.predicate and any(_means(literal.args[0], o) for o in e.objects)
        )
        text = next(texts, "")
        return f": {text}" if text else ""


class TruthGoalChecker:
    """Implements `GoalChecker` on an environment's oracle.

    Args:
        domain: what the goal's facts mean.
    """

    def __init__(self, domain: Domain) -> None:
        self._domain = domain

    def check(self, goal: Goal, oracle: OracleView) -> tuple[bool, bool | None, tuple[str, ...]]:
        """Strict success, weak success (None where the goal has no weaker check), failures.

        Failures are those of the binding that comes nearest to the goal.
        """
        history = _History.of(oracle, self._domain)
        failures = _best(goal.variables, goal.literals, goal.never, history)
        weak = None if not goal.weak else not _best(goal.variables, goal.weak, (), history)
        return not failures, weak, failures


def irreversible(goal: Goal, oracle: OracleView, domain: Domain) -> tuple[tuple[float, str], ...]:
    """What must never happen for a goal and has happened; () if nothing has.

    A variable of the goal means any instance of its category here: what was spoiled is lost, also
    where another thing served in the end.

    Returns:
        For each such literal the simulated seconds of its first event and that event in words, in
        the order of time; 0 seconds for what was so from the start.
    """
    history = _History.of(oracle, domain)
    kinds = dict(goal.variables)
    literals = dict.fromkeys(literal.bind(kinds) for literal in goal.never)
    found = {history.first(literal) for literal in literals if history.happened(literal)}
    return tuple(sorted(found))


def _facts(events: Sequence[Event]) -> Iterator[Literal]:
    yield from (fact for event in events if (fact := _fact(event)) is not None)


def _fact(event: Event) -> Literal | None:
    """The literal that an event says became true, if it says one."""
    if event.kind not in FACTS:
        return None
    try:
        return Literal.parse(event.text)
    except InputError:
        return None


def _covers(literal: Literal, fact: Literal) -> bool:
    """Whether a fact about instances is one that a literal of a goal speaks of."""
    return (
        fact.predicate == literal.predicate
        and fact.value == literal.value
        and len(fact.args) == len(literal.args)
        and all(_means(a, b) for a, b in zip(literal.args, fact.args, strict=True))
    )


def _means(name: str, instance: str) -> bool:
    """Whether a name in a goal, instance or category, can mean an instance."""
    return name in (instance, category_of(instance))


def _best(
    variables: Sequence[tuple[str, str]],
    literals: Sequence[Literal],
    never: Sequence[Literal],
    history: _History,
) -> tuple[str, ...]:
    """What fails under the best binding; empty where one binding fits.

    The best has the fewest failures and, among those, the fewest literals that do not hold: what
    was reached and spoiled tells more than what was never tried.
    """
    used = {a for literal in (*literals, *never) for a in literal.args}
    chosen = [(v, c) for v, c in variables if v in used]
    missing = tuple(f"there is no {c}" for _, c in chosen if not history.graph.of_category(c))
    nearest = _Nearest(chosen, literals, never, history)
    binding = nearest.find()
    if binding is None:
        return ("no binding of the goal's variables is possible",)
    unmet = tuple(
        f"{ground} does not hold in the end{history.why(ground)}"
        for ground in (literal.bind(binding) for literal in literals)
        if not history.holds(ground)
    )
    wrong = tuple(
        f"{ground} must never be{history.cause(ground)}"
        for ground in (literal.bind(binding) for literal in never)
        if history.happened(ground)
    )
    return (*missing, *unmet, *wrong)


class _Nearest:
    """Looks for the best binding variable by variable.

    What a literal comes to is counted as soon as its variables are bound; a branch is left on which
    at least as much fails as under the best binding so far, with what must fail of the literals
    about one later variable. Variables are bound to different instances; a category that is not
    there stands for itself.
    """

    def __init__(
        self,
        variables: Sequence[tuple[str, str]],
        literals: Sequence[Literal],
        never: Sequence[Literal],
        history: _History,
    ) -> None:
        self._choices = [
            (v, [n.id for n in history.graph.of_category(c) if n.id != GRIPPER] or [c])
            for v, c in variables
        ]
        order = {v: k for k, (v, _) in enumerate(variables, 1)}
        self._literals = _by_last(literals, order)
        self._never = _by_last(never, order)
        self._history = history
        self._known: dict[tuple[bool, Literal], bool] = {}
        self._ahead = [(0, 0)]
        for at in range(len(self._choices), 0, -1):
            least = self._least(at)
            self._ahead.insert(0, (self._ahead[0][0] + least[0], self._ahead[0][1] + least[1]))
        self._best: tuple[int, int] | None = None
        self._binding: dict[str, str] | None = None

    def find(self) -> Mapping[str, str] | None:
        """The first of the best bindings; None where there are too few instances."""
        self._descend({}, 0, 0)
        return self._binding

    def _least(self, at: int) -> tuple[int, int]:
        """How many of the literals about one variable alone fail at least, in all and unmet."""
        variable, names = self._choices[at - 1]
        alone = [
            [x for x in several.get(at, ()) if {a for a in x.args if a[0] == "?"} == {variable}]
            for several in (self._literals, self._never)
        ]
        counts = [
            tuple(
                sum(self._fails(x.bind({variable: n}), never) for x in literals)
                for literals, never in zip(alone, (False, True), strict=True)
            )
            for n in names
        ]
        return min(map(sum, counts)), min(unmet for unmet, _ in counts)

    def _descend(self, binding: dict[str, str], unmet: int, wrong: int) -> None:
        at = len(binding)
        unmet += sum(self._fails(x.bind(binding), False) for x in self._literals.get(at, ()))
        wrong += sum(self._fails(x.bind(binding), True) for x in self._never.get(at, ()))
        failing, still = self._ahead[at]
        if self._best is not None and (unmet + wrong + failing, unmet + still) >= self._best:
            return
        if at == len(self._choices):
            self._best, self._binding = (unmet + wrong, unmet), binding
            return
        variable, names = self._choices[at]
        for name in names:
            if name not in binding.values():
                self._descend(binding | {variable: name}, unmet, wrong)

    def _fails(self, ground: Literal, never: bool) -> bool:
        key = (never, ground)
        if key not in self._known:
            history = self._history
            self._known[key] = history.happened(ground) if never else not history.holds(ground)
        return self._known[key]


def _by_last(
    literals: Sequence[Literal], order: Mapping[str, int]
) -> Mapping[int, Sequence[Literal]]:
    """Literals by how many variables are bound once all of theirs are."""
    found: dict[int, list[Literal]] = {}
    for literal in literals:
        found.setdefault(max((order.get(a, 0) for a in literal.args), default=0), []).append(
            literal
        )
    return found


__all__ = ["TruthGoalChecker", "irreversible"]
