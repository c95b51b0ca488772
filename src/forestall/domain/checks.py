"""What must be right in a domain before anybody uses it.

Called by `load` and `pddl_in` on a whole domain; raises on the first thing that is wrong, with the
nearest names.
"""

from __future__ import annotations

from collections.abc import Container, Iterable
from dataclasses import fields

from forestall.domain.formula import Formula, Parameter, counted_of, free, literals, variables
from forestall.domain.located import keyed
from forestall.domain.model import BUILT_IN, FACING, LOCATED, SAME, SAME_CATEGORY, Domain
from forestall.domain.schema import Effect, Predicate, PredicateKind, Roles, SafetyRule, Skill
from forestall.errors import InputError, UnknownNameError
from forestall.types.facts import Literal

_ARITY = {LOCATED: 1, FACING: 1, SAME: 2, SAME_CATEGORY: 2}


def check_domain(domain: Domain) -> None:
    """See that every name means something and every variable is bound.

    Raises:
        InputError: the first thing that is wrong.
    """
    for predicate in domain.predicates.values():
        _predicate(domain, predicate)
    _stratified(domain)
    for skill in domain.skills.values():
        _within(_keys(f"[skills.{skill.name}]"), _skill, domain, skill)
    for process in domain.processes:
        label, known = f"process {process.name}", {p.name for p in process.parameters}
        keys = _keys(f"[processes.{process.name}]")
        _within(keys, _kinds, domain, label, process.parameters)
        _within(keys, _check, domain, label, process.condition, known)
        for effect in process.effects:
            _within(keys, _effect, domain, label, effect, known)
    for rule in domain.safety:
        keys = _keys(f"[safety.{rule.name}]")
        label, known = f"safety rule {rule.name}", {p.name for p in rule.variables}
        _within(keys, _check, domain, label, rule.never, known)
        if rule.when not in ("", "leaving", *domain.skills):
            known_whens = ("leaving", *domain.skills)
            raise keyed(UnknownNameError(f"when of {label}", rule.when, known_whens), *keys)
        _within(keys, _moment, domain, label, rule)
    usual = Roles()
    told = (f.name for f in fields(Roles))
    check_roles(domain, [n for n in told if getattr(domain.roles, n) != getattr(usual, n)])
    for thing, category in domain.constants:
        if category not in domain.categories:
            raise keyed(
                UnknownNameError(f"category of constant {thing}", category, domain.categories),
                "[constants]",
            )
    for name in domain.robot.skills:
        if name not in domain.skills:
            raise keyed(UnknownNameError("skill of the robot", name, domain.skills), "[robot]")
    from forestall.domain.settling import check_settling

    check_settling(domain)


def _predicate(domain: Domain, predicate: Predicate) -> None:
    keys = _keys(f"[predicates.{predicate.name}]")
    if predicate.definition is not None:
        label = f"definition of {predicate.name}"
        known = {p.name for p in predicate.parameters}
        _within(keys, _check, domain, label, predicate.definition, known)
    _kinds(domain, f"predicate {predicate.name}", predicate.parameters)
    offers = predicate.offered_by
    if offers and not domain.known_kind(offers):
        what = f"tag in offered_by of {predicate.name}"
        raise keyed(UnknownNameError(what, offers, domain.tags), *keys)
    if predicate.paired not in ("", "same number", "same number or first"):
        options = ("same number", "same number or first")
        raise UnknownNameError(f"paired of {predicate.name}", predicate.paired, options)


def _moment(domain: Domain, label: str, rule: SafetyRule) -> None:
    """See that what a rule says of a step fits the skill."""
    if rule.args is None and not rule.after:
        return
    if rule.when not in domain.skills:
        raise InputError(f"when of {label}: {rule.moment!r}: only a skill has arguments, or after")
    roles = domain.skills[rule.when].roles
    if rule.args is not None and len(rule.args) != len(roles):
        raise InputError(f"when of {label}: {rule.moment}: {rule.when} takes {', '.join(roles)}")
    variables = [p.name for p in rule.variables]
    things = [thing for thing, _ in domain.constants]
    for arg in rule.args or ():
        known = variables if arg.startswith("?") else things
        if arg not in known:
            what = "variable" if arg.startswith("?") else "constant"
            raise UnknownNameError(f"{what} in when of {label}", arg, known)


def check_literal(domain: Domain, label: str, literal: Literal) -> None:
    """See that a literal speaks of something that the domain knows.

    Raises:
        InputError: an unknown predicate or value, or another number of arguments.
    """
    predicate = domain.predicates.get(literal.predicate)
    if predicate is None and literal.predicate in _ARITY:
        arity = _ARITY[literal.predicate]
    elif predicate is None and domain.known_kind(literal.predicate):
        arity = 1
    elif predicate is None:
        known = (*domain.predicates, *BUILT_IN, *domain.tags)
        raise UnknownNameError(f"predicate in {label}", literal.predicate, known)
    else:
        arity = len(predicate.parameters)
    if len(literal.args) != arity:
        raise InputError(f"{label}: {literal}: {literal.predicate} takes {arity} argument(s)")
    if predicate is not None and predicate.kind is PredicateKind.ATTRIBUTE:
        if literal.value not in predicate.values:
            raise UnknownNameError(
                f"value of {literal.predicate} in {label}", literal.value, predicate.values
            )
    elif literal.value not in ("true", "false"):
        raise InputError(f"{label}: {literal}: {literal.predicate} is true or false")


def _skill(domain: Domain, skill: Skill) -> None:
    label = f"skill {skill.name}"
    names = [p.name for p in skill.parameters]
    if len(set(names)) < len(names):
        raise InputError(f"{label}: a parameter stands twice in {', '.join(names)}")
    _kinds(domain, label, skill.parameters)
    known = set(names)
    for make in skill.makes:
        if make.source not in known:
            raise _unbound(label, make.source, known)
        predicate = domain.predicates.get(make.by)
        if predicate is None or predicate.kind is not PredicateKind.STATIC:
            options = [p.name for p in domain.predicates.values() if p.kind is PredicateKind.STATIC]
            raise UnknownNameError(f"static predicate in makes of {label}", make.by, options)
    made = {m.variable for m in skill.makes}
    chosen = {c.variable.name for c in skill.choices}
    for choice in skill.choices:
        for formula in (*choice.among, choice.such_that, choice.only_if):
            _check(domain, f"choice of {label}", formula, known | made | chosen)
    _needs(domain, label, skill, known | chosen)
    if skill.undoes is not None:
        _check(domain, f"undoes of {label}", skill.undoes, known)
    for formula in (*skill.prefers, *([skill.done_when] if skill.done_when else [])):
        _check(domain, label, formula, known | chosen)
    for effect in skill.effects:
        _effect(domain, label, effect, known | chosen | made)
    for variable in (skill.at, skill.hand):
        if variable is not None and variable not in known | made | chosen:
            raise _unbound(label, variable, known)


def _needs(domain: Domain, label: str, skill: Skill, known: set[str]) -> None:
    for need in skill.needs:
        told = (need.formula, *([] if need.find is None else [need.find]))
        for formula in told:
            _check(domain, f"need of {label}", formula, known)
        found = {v.name for formula in told for v in variables(formula)}
        for fact in need.lacking:
            _check(domain, f"lacks of {label}", fact, known | found)


def _effect(domain: Domain, label: str, effect: Effect, known: set[str]) -> None:
    known = known | {v.name for v in effect.variables}
    _kinds(domain, label, effect.variables)
    _check(domain, f"effect of {label}", effect.condition, known)
    for fact in effect.facts:
        _check(domain, f"effect of {label}", fact, known)
        predicate = domain.predicates.get(fact.predicate)
        fixed = (PredicateKind.DERIVED, PredicateKind.STATIC)
        if predicate is None or predicate.kind in fixed:
            kind = "built in" if predicate is None else predicate.kind.value
            raise InputError(
                f"effect of {label}: {fact}: {fact.predicate} is {kind} and cannot be changed"
                + (": change what it is defined by" if kind == "derived" else "")
            )
    for copy in effect.copies:
        if copy.attribute not in domain.attributes:
            raise UnknownNameError(f"attribute in {label}", str(copy.attribute), domain.attributes)
        for name in (copy.target, copy.source):
            if name not in known:
                raise _unbound(label, name, known)
    for name in effect.gone:
        if name not in known:
            raise _unbound(label, name, known)


def _check(domain: Domain, label: str, formula: Formula, known: set[str]) -> None:
    for literal, _ in literals(formula):
        check_literal(domain, label, literal)
        _things(domain, label, literal.args)
    _things(domain, label, counted_of(formula))
    _kinds(domain, label, tuple(variables(formula)))
    loose = free(formula) - known
    if loose:
        raise _unbound(label, sorted(loose)[0], known)


def _things(domain: Domain, label: str, names: Iterable[str]) -> None:
    """See that what is no variable is a hand, a constant, or a category or a thing of one."""
    known = (*domain.robot.hands, *(thing for thing, _ in domain.constants))
    for name in names:
        if not name.startswith("?") and name not in known and domain.find(name) is None:
            raise UnknownNameError(f"hand, constant or category in {label}", name,
                                   (*known, *domain.categories))  # fmt: skip


def _unbound(label: str, name: str, known: Iterable[str]) -> UnknownNameError:
    return UnknownNameError(f"variable in {label}: nothing binds it:", name, known)


def _kinds(domain: Domain, label: str, parameters: Iterable[Parameter]) -> None:
    for p in parameters:
        if p.kind is not None and not domain.known_kind(p.kind):
            raise UnknownNameError(
                f"kind of {p.name} in {label}", p.kind, (*domain.tags, *domain.categories)
            )


def _stratified(domain: Domain) -> None:
    """No derived predicate may depend on its own opposite."""
    uses: dict[str, set[tuple[str, bool]]] = {}
    for p in domain.derived.values():
        assert p.definition is not None
        uses[p.name] = {
            (x.predicate, positive)
            for x, positive in literals(p.definition)
            if x.predicate in domain.derived
        }
    for name in uses:
        path = _way_back(uses, name, name, negative=False, seen=set())
        if path is not None:
            raise keyed(
                InputError(
                    f"definition of {name} is cyclic: it depends on its own opposite "
                    f"({' -> '.join((name, *path))})"
                ),
                f"[predicates.{name}]",
            )


def _way_back(
    uses: dict[str, set[tuple[str, bool]]],
    start: str,
    at: str,
    negative: bool,
    seen: set[tuple[str, bool]],
) -> tuple[str, ...] | None:
    for other, positive in sorted(uses.get(at, ())):
        odd = negative != (not positive)
        if other == start and odd:
            return (other,)
        if (other, odd) not in seen:
            seen.add((other, odd))
            rest = _way_back(uses, start, other, odd, seen)
            if rest is not None:
                return (other, *rest)
    return None


_ROLE_KINDS = {
    "holding": PredicateKind.RELATION, "blocking": PredicateKind.RELATION,
    "shut": PredicateKind.DERIVED, "accessible": PredicateKind.DERIVED,
    "vacant": PredicateKind.DERIVED, "unblocked": PredicateKind.DERIVED,
    "hand_empty": PredicateKind.DERIVED, "accepts": PredicateKind.STATIC,
}  # fmt: skip


def check_roles(domain: Domain, given: Container[str]) -> None:
    """See that the roles that somebody gave name predicates and tags of the domain.

    Raises:
        UnknownNameError: the first that does not, with those that would do.
    """
    for f in fields(Roles):
        if f.name not in given:
            continue
        named = getattr(domain.roles, f.name)
        if f.name in _ROLE_KINDS:
            fitting: dict[str, Predicate] = {
                p.name: p for p in domain.predicates.values() if p.kind is _ROLE_KINDS[f.name]
            }
            if named is not None and named not in fitting:
                raise keyed(
                    UnknownNameError(f"predicate in roles.{f.name}", named, fitting), "[roles]"
                )
        else:
            for tag in named if isinstance(named, tuple) else (named,):
                if tag not in domain.tags and not (tag == named and domain.known_kind(tag)):
                    raise keyed(
                        UnknownNameError(f"tag in roles.{f.name}", tag, domain.tags), "[roles]"
                    )


def _keys(*keys: str) -> tuple[str, ...]:
    return keys


def _within(keys: tuple[str, ...], call: object, *args: object) -> None:
    try:
        call(*args)  # type: ignore[operator]
    except InputError as error:
        raise keyed(error, *keys) from None
