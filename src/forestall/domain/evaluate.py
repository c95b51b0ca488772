"""The one evaluator of formulas, over anything that knows facts: a scene graph or a planning state.

Called by `truth`, the planner's state and the checks; calls the `View` that it is given, and
`circle` for facts that are defined by each other.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from typing import TypeVar

from forestall.domain.circle import Circle
from forestall.domain.formula import (
    And,
    Every,
    Fewer,
    Formula,
    Not,
    Or,
    Parameter,
    Some,
    free,
    normal,
)
from forestall.domain.model import FACING, LOCATED, SAME, SAME_CATEGORY
from forestall.domain.schema import Predicate, PredicateKind
from forestall.domain.view import FALSE, TRUE, UNKNOWN, UNOBSERVED, Binding, View
from forestall.types.facts import Literal, by_number, number_of


def evaluate(formula: Formula, view: View, names: Binding) -> int:
    """The truth of a formula under a binding of its free variables."""
    if isinstance(formula, Literal):
        return literal_truth(formula, view, names)
    if isinstance(formula, And):
        worst = TRUE
        for part in formula.parts:
            worst = min(worst, evaluate(part, view, names))
            if worst == FALSE:
                break
        return worst
    if isinstance(formula, Or):
        best = FALSE
        for part in formula.parts:
            best = max(best, evaluate(part, view, names))
            if best == TRUE:
                break
        return best
    if isinstance(formula, Not):
        return TRUE - evaluate(formula.part, view, names)
    if isinstance(formula, Some):
        best = FALSE
        for _, truth in solutions(formula.variables, formula.part, view, names):
            best = max(best, truth)
            if best == TRUE:
                break
        return best
    if isinstance(formula, Every):
        return TRUE - evaluate(_denied(formula), view, names)
    return _fewer(formula, view, names)


def literal_truth(literal: Literal, view: View, names: Binding) -> int:
    """The truth of one literal."""
    args = tuple(names.get(a, a) for a in literal.args)
    predicate, value = literal.predicate, literal.value
    known = view.domain.predicates.get(predicate)
    if known is not None and known.kind is PredicateKind.ATTRIBUTE:
        now = None if args[0] == UNKNOWN else view.value(args[0], predicate)
        if now is None:
            unsure = args[0] == UNKNOWN or view.unsure(args[0], predicate)
            return UNOBSERVED if unsure else FALSE
        return TRUE if now == value else FALSE
    truth = _truth_of(predicate, args, view)
    return TRUE - truth if value == "false" else truth


def _truth_of(predicate: str, args: tuple[str, ...], view: View) -> int:
    domain = view.domain
    known = domain.predicates.get(predicate)
    if known is None:
        if predicate in (LOCATED, FACING):
            return UNOBSERVED if UNKNOWN in args else view.fact(predicate, args)
        if predicate == SAME:
            return TRUE if args[0] == args[1] else FALSE
        if predicate == SAME_CATEGORY:
            return TRUE if view.category(args[0]) == view.category(args[1]) else FALSE
        if args[0] == UNKNOWN:
            return UNOBSERVED
        return TRUE if predicate in domain.kinds(view.category(args[0])) else FALSE
    if known.kind is PredicateKind.DERIVED:
        members = domain.recursive.get(predicate)
        if members is not None:
            return _recursive_truth(known, args, view, members)
        return _defined_truth(known, args, view)
    if UNKNOWN in args:
        return UNOBSERVED
    if known.kind is PredicateKind.STATIC:
        return TRUE if static_holds(view, predicate, args) else FALSE
    return view.fact(predicate, args)


def _defined_truth(known: Predicate, args: tuple[str, ...], view: View) -> int:
    assert known.definition is not None
    binding = {p.name: a for p, a in zip(known.parameters, args, strict=True)}
    return evaluate(_normal(known.definition), view, binding)


_open = threading.local()


def _recursive_truth(
    known: Predicate, args: tuple[str, ...], view: View, members: frozenset[str]
) -> int:
    outer: tuple[View, frozenset[str], Circle] | None = getattr(_open, "circle", None)
    if outer is not None and outer[0] is view and outer[1] is members:
        return outer[2].ask(known, args)
    circle = Circle(lambda inner, those: _defined_truth(inner, those, view))
    _open.circle = view, members, circle
    try:
        return circle.settle(known, args)
    finally:
        _open.circle = outer


def static_holds(view: View, predicate: str, args: tuple[str, ...]) -> bool:
    """Whether a static predicate holds between things (or a thing and a category)."""
    domain = view.domain
    kinds = tuple(view.category(a) for a in args)
    if kinds not in domain.statics.get(predicate, ()):
        return False
    paired = domain.predicates[predicate].paired
    if not paired or len(args) != 2:
        return True
    if number_of(args[0]) == number_of(args[1]):
        return True
    if paired == "same number":
        return False
    partners = sorted(view.of_kind(kinds[1]), key=by_number)
    same = any(number_of(p) == number_of(args[0]) for p in partners)
    return not same and partners[:1] == [args[1]]


def solutions(
    variables: tuple[Parameter, ...], formula: Formula, view: View, names: Binding
) -> Iterator[tuple[dict[str, str], int]]:
    """Bindings of variables under which a formula is not false, each with its truth."""
    open_names = {v.name for v in variables}
    yield from _solve(variables, _conjuncts(_normal(formula)), view, dict(names), open_names, TRUE)


def _solve(
    left: tuple[Parameter, ...],
    parts: tuple[Formula, ...],
    view: View,
    names: dict[str, str],
    unbound: set[str],
    truth: int,
) -> Iterator[tuple[dict[str, str], int]]:
    waiting = []
    for part in parts:
        if _free(part) & unbound:
            waiting.append(part)
            continue
        truth = min(truth, evaluate(part, view, names))
        if truth == FALSE:
            return
    if not left:
        yield dict(names), truth
        return
    variable, found = _next(left, waiting, view, names, unbound)
    rest = tuple(v for v in left if v is not variable)
    unbound = unbound - {variable.name}
    for name in found:
        own = truth
        if variable.kind is not None:
            if name == UNKNOWN:
                own = min(own, UNOBSERVED)
            elif variable.kind not in view.domain.kinds(view.category(name)):
                continue
        names[variable.name] = name
        yield from _solve(rest, tuple(waiting), view, names, unbound, own)
    names.pop(variable.name, None)


def _next(
    left: tuple[Parameter, ...],
    parts: list[Formula],
    view: View,
    names: Binding,
    unbound: set[str],
) -> tuple[Parameter, list[str]]:
    """The variable with the fewest candidates."""
    best: tuple[Parameter, list[str]] | None = None
    for variable in left:
        options = []
        for part in parts:
            found = _candidates(part, variable.name, view, names, unbound)
            if found is not None:
                options.append(found)
        if variable.kind is not None and not any(UNKNOWN in o for o in options):
            options.append(list(view.of_kind(variable.kind)))
        shortest = min(options, key=len, default=None)
        if shortest is None:
            shortest = list(view.things())
        if best is None or len(shortest) < len(best[1]):
            best = variable, shortest
    assert best is not None
    return best


def _candidates(
    part: Formula, variable: str, view: View, names: Binding, unbound: set[str]
) -> list[str] | None:
    """Things for which a part can be true, where it narrows them down."""
    if isinstance(part, Or):
        several = [_candidates(p, variable, view, names, unbound) for p in part.parts]
        if any(s is None for s in several):
            return None
        return list(dict.fromkeys(x for s in several if s is not None for x in s))
    if isinstance(part, And):
        options = [_candidates(p, variable, view, names, unbound) for p in part.parts]
        return min((o for o in options if o is not None), key=len, default=None)
    if not isinstance(part, Literal) or variable not in part.args or part.value == "false":
        return None
    known = view.domain.predicates.get(part.predicate)
    if known is None:
        return _built_in_candidates(part, variable, view, names, unbound)
    if known.kind is PredicateKind.ATTRIBUTE:
        return list(view.with_value(part.predicate, part.value))
    if known.kind is not PredicateKind.RELATION or (_free(part) & unbound) != {variable}:
        return None
    position = part.args.index(variable)
    args = tuple(names.get(a, a) for a in part.args)
    return list(view.related(part.predicate, position, args))


def _built_in_candidates(
    part: Literal, variable: str, view: View, names: Binding, unbound: set[str]
) -> list[str] | None:
    if part.predicate == SAME:
        other = part.args[1] if part.args[0] == variable else part.args[0]
        return None if other in unbound or other == variable else [names.get(other, other)]
    if part.predicate == FACING:
        return [x for x in view.things() if view.fact(FACING, (x,)) == TRUE]
    if part.predicate in (LOCATED, SAME_CATEGORY):
        return None
    return list(view.of_kind(part.predicate))


def _fewer(formula: Fewer, view: View, names: Binding) -> int:
    bound = formula.bound
    if isinstance(bound, str):
        of = view.category(names.get(formula.of, formula.of))
        found = view.domain.number(of, bound)
        if found is None:
            return TRUE
        bound = found
    sure = unsure = 0
    for _, truth in solutions((formula.variable,), formula.part, view, names):
        sure += truth == TRUE
        unsure += truth == UNOBSERVED
    if sure >= bound:
        return FALSE
    return UNOBSERVED if unsure else TRUE


T = TypeVar("T")

_KEEP = 20_000


def _remembered(make: Callable[[Formula], T]) -> Callable[[Formula], T]:
    """Remember by identity: formulas live in domains, and hashing a deep one costs more."""
    seen: dict[int, tuple[Formula, T]] = {}

    def ask(formula: Formula) -> T:
        found = seen.get(id(formula))
        if found is not None and found[0] is formula:
            return found[1]
        if len(seen) > _KEEP:
            seen.clear()
        seen[id(formula)] = (formula, make(formula))
        return seen[id(formula)][1]

    return ask


def _deny(formula: Formula) -> Formula:
    assert isinstance(formula, Every)
    return Some(formula.variables, normal(formula.part, False))


def _split(formula: Formula) -> tuple[Formula, ...]:
    if isinstance(formula, And):
        return tuple(c for p in formula.parts for c in _split(p))
    return (formula,)


_normal = _remembered(normal)
_denied = _remembered(_deny)
_conjuncts = _remembered(_split)
_free = _remembered(free)
