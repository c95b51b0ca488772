"""The cases that a domain makes, and which of them episodes bring about.

The cases are read off a `Domain`: every need of every skill (each conjunct fails alone, each
alternative meets it alone, a refused subtask later succeeds), every choice, every effect and every
process effect (it happens, and each of its conditions alone keeps it from happening). Used by
`test_domain_covers`, `covering_search` and `mutate_domain`; watches the executor at work.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any
from unittest.mock import patch

from covering_play import Episode, Run, Step

from forestall.domain.evaluate import evaluate, literal_truth, solutions
from forestall.domain.formula import And, Formula, Or, literals, normal, show
from forestall.domain.model import SAME, Domain
from forestall.domain.schema import Choice, Effect, Need, PredicateKind, Skill
from forestall.domain.view import TRUE as HOLDS
from forestall.planning import execute, settle
from forestall.planning.state import State
from forestall.types.facts import Literal
from forestall.types.plan import Subtask


def play(episode: Episode, domain: Domain, coverage: Coverage | None = None) -> Iterator[Step]:
    """Every step of an episode; what it covers is noted."""
    run = Run(episode, domain)
    if coverage is not None:
        coverage.begin()
    for text in episode.steps:
        if coverage is None:
            yield run.do(Subtask.parse(text))
        else:
            with coverage.watching():
                step = run.do(Subtask.parse(text))
            yield step


# --- what there is to cover -----------------------------------------------------------------------


def conjuncts(formula: Formula) -> tuple[Formula, ...]:
    """Parts that must all hold."""
    return _flat(normal(formula), And)


def alternatives(formula: Formula) -> tuple[Formula, ...]:
    """Parts of which one must hold."""
    return _flat(formula, Or)


def _flat(formula: Formula, kind: type[And] | type[Or]) -> tuple[Formula, ...]:
    if isinstance(formula, kind):
        return tuple(c for p in formula.parts for c in _flat(p, kind))
    return (formula,)


def cases(domain: Domain) -> set[str]:
    """Every case that the needs, choices, effects and processes of a domain make."""
    found: set[str] = set()
    for skill in domain.skills.values():
        if skill.done_when is not None:
            found.add(f"{skill.name}: done already")
            found |= _not_because(f"{skill.name}: done already", skill.done_when)
        for i, need in enumerate(skill.needs, 1):
            label = f"{skill.name}: need {i}"
            found |= {f"{label} alone [{show(c)}]" for c in conjuncts(need.formula)}
            found |= _by(label, need.formula)
            if not fixed(domain, need.formula):
                found.add(f"{label} failed, then met")
        for choice in skill.choices:
            label = f"{skill.name}: choice {choice.variable.name}"
            found |= {f"{label} by {k}" for k in range(1, len(choice.among) + 1)}
            found |= _not_because(f"{label} such that", choice.such_that)
            found |= _not_because(f"{label} only if", choice.only_if)
        found |= _effect_cases(f"{skill.name}:", skill.effects)
        found.add(f"{skill.name}: succeeds")
    for process in domain.processes:
        found.add(f"process {process.name}: runs")
        found |= _not_because(f"process {process.name}:", process.condition)
        found |= _by(f"process {process.name}:", process.condition)
        found |= _effect_cases(f"process {process.name}:", process.effects)
    return found


def _effect_cases(label: str, effects: Iterable[Effect]) -> set[str]:
    found: set[str] = set()
    for i, effect in enumerate(effects, 1):
        found.add(f"{label} effect {i} happens")
        found |= _not_because(f"{label} effect {i}", effect.condition)
        found |= _by(f"{label} effect {i}", effect.condition)
    return found


def _not_because(label: str, formula: Formula) -> set[str]:
    return {f"{label} not because of [{show(c)}]" for c in conjuncts(formula)}


def _by(label: str, formula: Formula) -> set[str]:
    several = [alternatives(c) for c in conjuncts(formula)]
    return {f"{label} only by [{show(a)}]" for parts in several if len(parts) > 1 for a in parts}


def fixed(domain: Domain, formula: Formula) -> bool:
    """Whether nothing that is done changes the truth of a formula."""
    for literal, _ in literals(formula):
        known = domain.predicates.get(literal.predicate)
        if known is None and literal.predicate != SAME and not domain.known_kind(literal.predicate):
            return False
        if known is not None and known.kind is not PredicateKind.STATIC:
            return False
    return True


# --- what is covered ------------------------------------------------------------------------------


class Coverage:
    """Notes the cases that come up while the executor works."""

    def __init__(self, domain: Domain) -> None:
        self.open = cases(domain)
        self.seen: set[str] = set()
        self._failed: dict[str, set[str]] = {}
        self._skill: Skill | None = None
        self._called = ""
        self._changed = False
        self._order: list[int] = []
        self._processes = {id(p.effects): p for p in domain.processes}

    def begin(self) -> None:
        """A new episode."""
        self._failed = {}

    def watching(self) -> Any:
        """A context in which the executor is watched."""
        return patch.multiple(
            execute,
            _run=self._run,
            _refused=self._refuse,
            _choose=self._choose,
            _spread=self._spread,
            change=self._change,
            settle=self._settle,
        )

    def _note(self, case: str) -> None:
        if case in self.open:
            self.open.discard(case)
            self.seen.add(case)

    def _run(self, state: State, skill: Skill, args: tuple[str, ...]) -> None:
        self._skill, self._called, self._changed = skill, f"{skill.name}{args}", False
        _RUN(state, skill, args)
        for case in self._failed.pop(self._called, ()):
            self._note(f"{case} failed, then met")
        self._note(f"{skill.name}: succeeds" if self._changed else f"{skill.name}: done already")

    def _refuse(self, state: State, need: Need, names: Mapping[str, str]) -> Any:
        assert self._skill is not None
        self._not_done(self._skill, state, names)
        number = next(i for i, n in enumerate(self._skill.needs, 1) if n is need)
        others = [n.formula for n in self._skill.needs if n is not need]
        if all(evaluate(f, state, names) == HOLDS for f in others):
            parts = conjuncts(need.formula)
            failing = [c for c in parts if evaluate(c, state, names) != HOLDS]
            if len(failing) == 1:
                self._note(f"{self._skill.name}: need {number} alone [{show(failing[0])}]")
            label = f"{self._skill.name}: need {number}"
            self._failed.setdefault(self._called, set()).add(label)
        return _REFUSED(state, need, names)

    def _choose(
        self, state: State, choice: Choice, names: dict[str, str], made: Mapping[str, Any]
    ) -> None:
        assert self._skill is not None
        label = f"{self._skill.name}: choice {choice.variable.name}"
        known = {**names, **{v: pieces[0] for v, pieces in made.items()}}
        _CHOOSE(state, choice, names, made)
        self._missing(f"{label} only if", (), choice.only_if, state, known)
        if not state.true(choice.only_if, known):
            return
        for k, formula in enumerate(choice.among, 1):
            several = list(solutions((choice.variable,), formula, state, known))
            fitting = []
            for binding, _ in several:
                self._missing(f"{label} such that", (), choice.such_that, state, binding)
                if state.true(choice.such_that, binding):
                    fitting.append(binding)
            if fitting:
                self._note(f"{label} by {k}")
                return

    def _spread(self, effects: Iterable[Effect], made: Mapping[str, Any]) -> list[Effect]:
        self._order, found = [], []
        for i, effect in enumerate(effects, 1):
            for bound in _SPREAD([effect], made):
                self._order.append(i)
                found.append(bound)
        return found

    def _change(self, state: State, effects: list[Effect], names: Mapping[str, str]) -> None:
        skill = self._skill
        assert skill is not None
        self._changed = True
        self._not_done(skill, state, names)
        for i, need in enumerate(skill.needs, 1):
            self._only_by(f"{skill.name}: need {i}", (), need.formula, need.formula, state, names)
        for i, effect in zip(self._order, effects, strict=True):
            self._effect(f"{skill.name}: effect {i}", skill.effects[i - 1], effect, state, names)
        _CHANGE(state, effects, dict(names))

    def _settle(self, state: State) -> None:
        with patch.object(settle, "change", self._process_change):
            for p in state.domain.processes:
                label = f"process {p.name}:"
                self._missing(label, p.parameters, p.condition, state, {})
                self._only_by(label, p.parameters, p.condition, p.condition, state, {})
            _SETTLE(state)

    def _not_done(self, skill: Skill, state: State, names: Mapping[str, str]) -> None:
        if skill.done_when is not None:
            self._missing(f"{skill.name}: done already", (), skill.done_when, state, names)

    def _process_change(
        self, state: State, effects: tuple[Effect, ...], names: Mapping[str, str]
    ) -> None:
        process = self._processes[id(effects)]
        self._note(f"process {process.name}: runs")
        for i, effect in enumerate(effects, 1):
            self._effect(f"process {process.name}: effect {i}", effect, effect, state, names)
        _CHANGE(state, effects, dict(names))

    def _effect(
        self, label: str, original: Effect, effect: Effect, state: State, names: Mapping[str, str]
    ) -> None:
        if visible(effect, state, names):
            self._note(f"{label} happens")
            self._only_by(
                label, effect.variables, original.condition, effect.condition, state, names
            )
        self._missing(label, effect.variables, original.condition, state, names, effect.condition)

    def _missing(
        self,
        label: str,
        variables: tuple[Any, ...],
        formula: Formula,
        state: State,
        names: Mapping[str, str],
        bound: Formula | None = None,
    ) -> None:
        """Note each part that alone keeps a formula from holding."""
        parts = conjuncts(formula if bound is None else bound)
        for j, part in enumerate(conjuncts(formula)):
            case = f"{label} not because of [{show(part)}]"
            if case not in self.open:
                continue
            rest = And((*parts[:j], *parts[j + 1 :], normal(parts[j], False)))
            if any(t == HOLDS for _, t in solutions(variables, rest, state, names)):
                self._note(case)

    def _only_by(
        self,
        label: str,
        variables: tuple[Any, ...],
        formula: Formula,
        bound: Formula,
        state: State,
        names: Mapping[str, str],
    ) -> None:
        """Note each alternative that alone lets a formula hold."""
        parts = conjuncts(bound)
        for j, part in enumerate(conjuncts(formula)):
            several = alternatives(part)
            for k, one in enumerate(several):
                case = f"{label} only by [{show(one)}]"
                if len(several) < 2 or case not in self.open:
                    continue
                own = alternatives(parts[j])
                others = tuple(normal(a, False) for i, a in enumerate(own) if i != k)
                only = And((*parts[:j], own[k], *others, *parts[j + 1 :]))
                if any(t == HOLDS for _, t in solutions(variables, only, state, names)):
                    self._note(case)


def visible(effect: Effect, state: State, names: Mapping[str, str]) -> bool:
    """Whether an effect changes something."""
    for binding, t in solutions(effect.variables, effect.condition, state, names):
        if t == HOLDS and (
            effect.gone
            or any(_new(f.bind(binding), state) for f in effect.facts)
            or any(
                state.value(binding[c.target], c.attribute)
                not in (None, state.value(binding[c.source], c.attribute))
                for c in effect.copies
            )
        ):
            return True
    return False


def _new(fact: Literal, state: State) -> bool:
    if any(a.startswith("?") for a in fact.args):
        return False
    if fact.predicate in state.domain.attributes:
        return state.value(fact.args[0], fact.predicate) not in (None, fact.value)
    return literal_truth(fact, state, {}) != HOLDS


_RUN, _REFUSED, _CHOOSE = execute._run, execute._refused, execute._choose
_SPREAD, _CHANGE, _SETTLE = execute._spread, settle.change, settle.settle
