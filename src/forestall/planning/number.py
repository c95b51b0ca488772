"""Turns what was grounded, a first state and goals into a problem over bits.

Called by `planner`; calls `ground`. Facts on which no goal depends are left out. Disjunctions and
counts become auxiliary facts with rules; derived facts are put into strata.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from forestall.deadline import Deadline
from forestall.domain.circle import DEEP
from forestall.domain.formula import And, Formula, literals
from forestall.domain.schema import PredicateKind
from forestall.errors import InputError
from forestall.planning.drafts import Change, Draft, Event, Grounding
from forestall.planning.nodes import Junction, Node, facts_of
from forestall.planning.problem import Atom, Effect, Happening, Operator, Problem, Rule, Stratum
from forestall.planning.state import State, decided

Goal = tuple[Formula, ...]


class UnsupportedError(Exception):
    """A goal literal that these problems cannot express."""


def number(
    grounding: Grounding,
    state: State,
    goals: Sequence[Goal],
    careful: bool = True,
    barred: Callable[[Draft], bool] | None = None,
    deadline: Deadline | None = None,
) -> Problem:
    """The problem of reaching any one of the goals.

    Args:
        grounding: what can happen.
        state: the first state.
        goals: conjunctions of ground formulas.
        careful: whether skills also ask for what they prefer, where it holds at first.
        barred: skills that are left out.
        deadline: when to stop.

    Raises:
        UnsupportedError: no goal can be expressed.
        TimeUp: the deadline is over.
    """
    nodes: list[Node] = []
    refused: UnsupportedError | None = None
    for goal in goals:
        try:
            nodes.append(_goal_node(grounding, state, goal))
        except UnsupportedError as error:
            refused = error
    if refused is not None and not nodes:
        raise refused
    return _Numbering(grounding, state, careful, barred, deadline or Deadline()).problem(nodes)


def _goal_node(grounding: Grounding, state: State, goal: Goal) -> Node:
    for part in goal:
        for literal, _ in literals(part):
            if not decided(state.domain, literal):
                raise UnsupportedError(f"{literal} cannot be planned for")
    try:
        return grounding.grounder.schemas.formula(And(goal))(grounding.grounder, {})
    except InputError as error:
        raise UnsupportedError(str(error)) from error


class _Numbering:
    def __init__(
        self,
        grounding: Grounding,
        state: State,
        careful: bool,
        barred: Callable[[Draft], bool] | None,
        deadline: Deadline,
    ) -> None:
        self.able = [d for d in grounding.drafts if barred is None or not barred(d)]
        self.grounding, self.state, self.careful = grounding, state, careful
        self.deadline = deadline
        self.grounder = grounding.grounder
        self.definitions = self.grounder.definitions
        self._base_of: dict[int, frozenset[int]] = {}
        self.bits: dict[int, int] = {}
        self.derived: dict[object, int] = {}
        self.names: list[Atom] = []
        self.rules: list[tuple[int, list[int] | None, list[int], int]] = []
        self._asked: set[int] = set()

    def problem(self, goals: list[Node]) -> Problem:
        drafts, processes, relevant = self._relevant(goals)
        base = sorted(relevant, key=lambda n: self.grounder.atoms[n])
        self.base = base
        self.bit = {n: i for i, n in enumerate(base)}
        self.size = len(base)
        self.names = [self.grounder.atoms[n] for n in base]
        self.names += [("not", *a) for a in self.names]
        self.bodies: list[tuple[int, Sequence[int], int]] = []
        self.heads: dict[object, int] = {}
        self.complements: dict[int, int] = {}
        self.negated = 0
        self.depth = 0
        self.later: list[tuple[int, Node]] = []
        targets = [m for n in goals if (m := self._mask(n)) is not None]
        prepared = [p for d in drafts if (p := self._operator(d)) is not None]
        happenings = []
        triggers = 0
        for events in processes:
            several = []
            for event in events:
                self.deadline.check()
                mask = self._mask(event.condition)
                effects = self._effects(event.changes)
                if mask is None or not effects:
                    continue
                several.append(Happening(mask, effects))
                for node in (event.condition, *(c.condition for c in event.changes)):
                    triggers |= self._base_mask(node)
            if several:
                happenings.append(tuple(several))
        while self.later:
            self._defining(*self.later.pop())
        initial = self._initial()
        strata, depends = self._strata()
        problem = Problem(
            tuple(self.names),
            initial,
            tuple(targets),
            (),
            tuple(happenings),
            strata,
            self.negated,
            triggers,
            depends,
            self.size,
            self.grounding.grounder.universe.bounded,
        )
        full = problem.close(initial)
        problem.operators = tuple(self._careful(o, p, full) for o, p in prepared)
        return problem

    # --- what matters ----------------------------------------------------------------------------

    def _relevant(self, goals: list[Node]) -> tuple[list[Draft], list[list[Event]], set[int]]:
        """Facts on which a goal depends, and what changes them."""
        touching: dict[int, list[tuple[Node, tuple[Node, ...]]]] = {}
        for draft in self.able:
            self.deadline.check()
            for change in draft.changes:
                needs = (draft.condition, *(draft.prefers if self.careful else ()))
                for fact in (*change.add, *change.delete):
                    touching.setdefault(fact, []).append((change.condition, needs))
        for events in self.grounding.processes:
            for event in events:
                for change in event.changes:
                    for fact in (*change.add, *change.delete):
                        touching.setdefault(fact, []).append((change.condition, (event.condition,)))
        relevant: set[int] = set()
        waiting: list[int] = [f for n in goals for f in self._bases(n)]
        done: set[int] = set()
        while waiting:
            fact = waiting.pop()
            if fact in relevant:
                continue
            self.deadline.check()
            relevant.add(fact)
            for condition, needs in touching.get(fact, ()):
                for node in (condition, *needs):
                    if id(node) not in done:
                        done.add(id(node))
                        waiting += self._bases(node)
        drafts = [
            d
            for d in self.able
            if any(f in relevant for c in d.changes for f in (*c.add, *c.delete))
        ]
        happening = [
            [
                e
                for e in several
                if any(f in relevant for c in e.changes for f in (*c.add, *c.delete))
            ]
            for several in self.grounding.processes
        ]
        return drafts, happening, relevant

    def _bases(self, node: Node) -> frozenset[int]:
        """Base facts on which a node depends."""
        if not isinstance(node, Junction):
            fact = abs(int(node))
            known = self._base_of.get(fact)
            if known is None:
                known = self._base_of[fact] = self._bases_of((fact,)) if fact > 1 else frozenset()
            return known
        return self._bases_of(abs(f) for f in facts_of(node))

    def _bases_of(self, facts: Iterable[int]) -> frozenset[int]:
        found: set[int] = set()
        seen: set[int] = set()
        waiting = list(facts)
        while waiting:
            fact = waiting.pop()
            if fact in seen:
                continue
            seen.add(fact)
            definition = self.definitions.get(fact)
            if definition is None:
                found.add(fact)
            else:
                waiting += [abs(f) for f in facts_of(definition)]
        return frozenset(found)

    def _base_mask(self, node: Node) -> int:
        mask = 0
        for fact in self._bases(node):
            mask |= 1 << self.bit[fact] if fact in self.bit else 0
        return mask

    # --- masks -----------------------------------------------------------------------------------

    def _mask(self, node: Node) -> int | None:
        """The bits that a condition asks for; None: it can never hold."""
        if node is False:
            return None
        if node is True:
            return 0
        if isinstance(node, Junction) and node.kind == "and":
            mask = 0
            for part in node.parts:
                mask |= 1 << self._literal(part)
            return mask
        return 1 << self._literal(node)

    def _literal(self, node: Node) -> int:
        """The bit of a fact, its opposite, or of an auxiliary fact."""
        if isinstance(node, Junction):
            return self._auxiliary(node)
        fact = abs(int(node))
        if fact in self.definitions:
            head = self._derived(fact)
            return head if node > 0 else self._complement(head)
        bit = self.bit[fact]
        if node > 0:
            return bit
        other = self._other_value(fact)
        if other is not None:
            return other
        self.negated |= 1 << bit
        return bit + self.size

    def _other_value(self, fact: int) -> int | None:
        """Of two values of a thing that always exists, "not the one" is the other."""
        predicate, *args = self.grounder.atoms[fact]
        known = self.grounder.domain.predicates.get(predicate)
        if known is None or known.kind is not PredicateKind.ATTRIBUTE or len(known.values) != 2:
            return None
        if args[0] in self.grounder.maybe:
            return None
        value = known.values[args[1] == known.values[0]]
        return self.bit.get(self.grounder.number_of((predicate, args[0], value)))

    def _new(self, name: Atom) -> int:
        self.names.append(name)
        return len(self.names) - 1

    def _complement(self, head: int) -> int:
        found = self.complements.get(head)
        if found is None:
            found = self.complements[head] = self._new(("not", *self.names[head]))
        return found

    def _derived(self, fact: int) -> int:
        found = self.heads.get(fact)
        if found is None:
            found = self.heads[fact] = self._new(self.grounder.atoms[fact])
            self._defining(found, self.definitions[fact])
        return found

    def _auxiliary(self, node: Junction) -> int:
        found = self.heads.get(node)
        if found is None:
            found = self.heads[node] = self._new(("aux", str(len(self.heads))))
            self._defining(found, node)
        return found

    def _defining(self, head: int, node: Node) -> None:
        """Define a fact now, or later where it lies deep within the definitions of others."""
        if self.depth == DEEP:
            self.later.append((head, node))
            return
        self.depth += 1
        self._define(head, node)
        self.depth -= 1

    def _define(self, head: int, node: Node) -> None:
        if node is False:
            return
        if node is True:
            self.bodies.append((head, (), 0))
        elif isinstance(node, Junction) and node.kind == "or":
            for part in node.parts:
                self._define(head, part)
        elif isinstance(node, Junction) and node.kind == "least":
            self.bodies.append((head, [self._literal(p) for p in node.parts], node.least))
        elif isinstance(node, Junction):
            self.bodies.append((head, [self._literal(p) for p in node.parts], 0))
        else:
            self.bodies.append((head, [self._literal(node)], 0))

    # --- operators -------------------------------------------------------------------------------

    def _operator(self, draft: Draft) -> tuple[Operator, list[int]] | None:
        self.deadline.check()
        mask = self._mask(draft.condition)
        if mask is None:
            return None
        effects = self._effects(draft.changes)
        if not effects:
            return None
        prefers = []
        if self.careful:
            prefers = [m for n in draft.prefers if (m := self._mask(n)) is not None]
        return Operator(draft.subtask, mask, effects, draft.over, draft.makes), prefers

    def _effects(self, changes: list[Change]) -> tuple[Effect, ...]:
        found = []
        for change in changes:
            add = delete = 0
            for fact in change.add:
                if fact in self.bit:
                    add |= 1 << self.bit[fact]
            for fact in change.delete:
                if fact in self.bit:
                    delete |= 1 << self.bit[fact]
            if not (add or delete):
                continue
            mask = self._mask(change.condition)
            if mask is not None:
                found.append(Effect(mask, add, delete & ~add))
        return tuple(found)

    @staticmethod
    def _careful(operator: Operator, prefers: list[int], full: int) -> Operator:
        condition = operator.condition
        for mask in prefers:
            if mask & full == mask:
                condition |= mask
        return replace(operator, condition=condition)

    def _initial(self) -> int:
        state, mask = self.state, 0
        attributes = self.grounder.domain.attributes
        for i, fact in enumerate(self.base):
            predicate, *args = self.grounder.atoms[fact]
            if predicate in attributes:
                holds = state.values.get((args[0], predicate)) == args[1]
            elif predicate in self.grounder.domain.predicates:
                holds = (predicate, *args) in state.facts
            else:
                holds = args[0] in state.kinds
            mask |= holds << i
        return mask

    # --- derived facts ---------------------------------------------------------------------------

    def _strata(self) -> tuple[tuple[Stratum, ...], int]:
        level = dict.fromkeys(self.heads.values(), 0)
        of_complement = {c: h for h, c in self.complements.items()}
        for _ in range(len(level) + 1):
            changed = False
            for head, body, _ in self.bodies:
                for bit in body:
                    least = level.get(bit, 0)
                    if bit in of_complement:
                        least = level[of_complement[bit]] + 1
                    if least > level[head]:
                        level[head], changed = least, True
            if not changed:
                break
        strata = []
        for number_ in sorted(set(level.values())):
            rules = [
                Rule(1 << h, sum(1 << b for b in set(body)), least)
                for h, body, least in reversed(self.bodies)
                if level[h] == number_
            ]
            pairs = [(1 << h, 1 << c) for h, c in self.complements.items() if level[h] == number_]
            strata.append(Stratum(tuple(rules), tuple(pairs)))
        depends = 0
        for _, body, _ in self.bodies:
            for bit in body:
                if bit < 2 * self.size:
                    depends |= 1 << (bit % self.size)
        return tuple(strata), depends
