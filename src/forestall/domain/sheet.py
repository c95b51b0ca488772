"""The skill sheet: every skill of a domain in words, for people and for language models.

Called by the command line and by prompts; calls `model` and `formula`. It is written from the
schemas alone, so that it cannot say anything else than what the planner and the validator go by.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from forestall.domain.formula import (
    TRUE,
    And,
    Every,
    Fewer,
    Formula,
    Not,
    Or,
    Parameter,
    Some,
)
from forestall.domain.model import FACING, LOCATED, SAME, SAME_CATEGORY, Domain
from forestall.domain.phrases import with_articles
from forestall.domain.schema import Copy, Effect, Make, PredicateKind, Skill
from forestall.types.facts import Literal

_BUILT_IN = {
    LOCATED: ("the place of {0} is known", "the place of {0} is not known"),
    FACING: ("the robot is at {0}", "the robot is not at {0}"),
    SAME: ("{0} is {1}", "{0} is not {1}"),
    SAME_CATEGORY: ("{0} and {1} are of the same kind", "{0} and {1} are of different kinds"),
}
_OPPOSITES = ((" is ", " is not "), (" are ", " are not "), (" has ", " has not "),
              (" can ", " cannot "), (" stands ", " does not stand "),
              (" holds ", " does not hold "))  # fmt: skip

_PLACES = ("above", "at", "behind", "below", "in", "in front of", "inside", "left of", "near", "on",
           "on top of", "right of", "under", "within")  # fmt: skip


def skill_sheet(domain: Domain) -> str:
    """Every skill that the robot has, what happens by itself, and what must never be."""
    able = domain.robot.skills or tuple(domain.skills)
    parts = [skill_words(domain, domain.skills[s]) for s in able]
    if domain.processes:
        lines = ["by itself, after every skill:"]
        for process in domain.processes:
            things = ", ".join(_several(domain, (p,)) for p in process.parameters)
            lines.append(f"  {process.name.replace('_', ' ')}: for every {things}, where "
                         f"{words_of(domain, process.condition)}:")  # fmt: skip
            lines += [f"    - {effect_words(domain, e)}" for e in process.effects]
        parts.append("\n".join(lines) + "\n")
    if domain.safety:
        lines = ["never:"]
        for rule in domain.safety:
            things = _several(domain, rule.variables)
            of = f" for any {things}" if things else ""
            moment = f" {rule.moment}" if rule.after else f" before {rule.moment}"
            when = {"": "", "leaving": " when the robot leaves"}.get(rule.when, moment)
            lines.append(f"  - {words_of(domain, rule.never)}{of}{when}")
        parts.append("\n".join(lines) + "\n")
    return "\n".join(parts)


def skill_words(domain: Domain, skill: Skill) -> str:
    """One skill: its form, its parameters, its needs in the order of judging, its effects."""
    lines = [f"{skill.name}({', '.join(skill.roles)}): {skill.words}"]
    for p in skill.parameters:
        if p.kind is not None:
            lines.append(f"  {_name(p.name)} is {_kind(domain, p.kind)}")
    for choice in skill.choices:
        among = "; else ".join(words_of(domain, f) for f in choice.among)
        such = "" if choice.such_that == TRUE else f"; {words_of(domain, choice.such_that)}"
        always = choice.only_if == TRUE
        when = "" if always else f" where {words_of(domain, choice.only_if)}"
        lines.append(f"  deals with {_name(choice.variable.name)}{when}, found by: {among}{such}")
    if skill.done_when is not None:
        lines.append(f"  does nothing and succeeds where {words_of(domain, skill.done_when)}")
    needs = [words_of(domain, n.formula) for n in skill.needs]
    lines += _listed("needs", needs)
    lines += _listed("better where", [words_of(domain, f) for f in skill.prefers])
    does = [_made(m) for m in skill.makes]
    does += [effect_words(domain, e) for e in skill.effects]
    if skill.at is not None:
        does.append(f"the robot is at {_name(skill.at)}")
    lines += _listed("then", does)
    return "\n".join(lines) + "\n"


def effect_words(domain: Domain, effect: Effect) -> str:
    """What an effect brings about, with the things and the condition for which it does."""
    facts = [_fact(domain, f) for f in effect.facts]
    facts += [_copied(c) for c in effect.copies]
    facts += [f"{_name(g)} is no more" for g in effect.gone]
    text = " and ".join(facts)
    if effect.condition != TRUE:
        text = f"{text}, if before {words_of(domain, effect.condition)}"
    if effect.variables:
        text = f"for every {_several(domain, effect.variables)}: {text}"
    return text


def words_of(domain: Domain, formula: Formula, positive: bool = True) -> str:
    """A formula as part of a sentence; of its opposite where `positive` is false."""
    if isinstance(formula, Literal):
        return _fact(domain, formula, positive)
    if isinstance(formula, Not):
        return words_of(domain, formula.part, not positive)
    if isinstance(formula, And | Or):
        word = " and " if isinstance(formula, And) == positive else " or "
        if not formula.parts:
            return "always" if isinstance(formula, And) == positive else "never"
        several = _flat(formula, type(formula))
        parts = [words_of(domain, p, positive) for p in several]
        compound = [(isinstance(p, And | Or) and len(p.parts) > 1) or isinstance(p, Some | Every)
                    for p in map(_plain, several)]  # fmt: skip
        return word.join(f"({t})" if c else t for t, c in zip(parts, compound, strict=True))
    if isinstance(formula, Fewer):
        bound = formula.bound
        of = f"the {bound} of {_name(formula.of)}" if isinstance(bound, str) else str(bound)
        least = "fewer than" if positive else "at least"
        thing = _several(domain, (formula.variable,))
        return f"{least} {of} things {thing} are such that {words_of(domain, formula.part)}"
    things = _several(domain, formula.variables)
    if isinstance(formula, Some) and not positive:
        return f"there is no {things} such that {words_of(domain, formula.part)}"
    if isinstance(formula, Some) == positive:
        return f"there is some {things} such that {words_of(domain, formula.part, positive)}"
    return f"for every {things}: {words_of(domain, formula.part, positive)}"


def _flat(formula: Formula, kind: type[And] | type[Or]) -> list[Formula]:
    if isinstance(formula, kind):
        return [f for p in formula.parts for f in _flat(p, kind)]
    return [formula]


def _plain(formula: Formula) -> Formula:
    while isinstance(formula, Not):
        formula = formula.part
    return formula


def _fact(domain: Domain, literal: Literal, positive: bool = True) -> str:
    args = [_name(a) for a in literal.args]
    positive = positive != (literal.value == "false")
    known = domain.predicates.get(literal.predicate)
    if known is None:
        if literal.predicate in _BUILT_IN:
            return _BUILT_IN[literal.predicate][not positive].format(*args)
        verb = "is" if positive else "is not"
        return f"{args[0]} {verb} {_kind(domain, literal.predicate)}"
    if known.kind is PredicateKind.ATTRIBUTE:
        verb = "is" if positive else "is not"
        attribute = known.name.replace("_", " ")
        return f"the {attribute} state of {args[0]} {verb} {literal.value.replace('_', ' ')}"
    if known.words:
        text = known.words.format(*args)
        return text if positive else known.opposite.format(*args) or _denied(text)
    name = literal.predicate.replace("_", " ")
    if not args:
        text = f"it is {name}"
    elif len(args) == 1 or name in _PLACES:
        text = f"{args[0]} is {name.removeprefix('is ')} {', '.join(args[1:])}".strip()
    else:
        text = f"{args[0]} {name} {', '.join(args[1:])}"
    return text if positive else _denied(text)


def _denied(text: str) -> str:
    if text.startswith("nothing "):
        return text.replace("nothing", "something", 1)
    for verb, opposite in _OPPOSITES:
        if verb in text:
            return text.replace(verb, opposite, 1)
    return f"it is not so that {text}"


def _copied(copy: Copy) -> str:
    attribute = copy.attribute.replace("_", " ")
    return f"the {attribute} state of {_name(copy.target)} becomes that of {_name(copy.source)}"


def _made(make: Make) -> str:
    by = make.by.replace("_", " ")
    if isinstance(make.count, int):
        count = str(make.count)
    else:
        count = f"as many as the number {make.count} of {_name(make.source)}"
    source = _name(make.source)
    return f"each {_name(make.variable)}, of which there are {count}, comes to be: {source} {by} it"


def _several(domain: Domain, variables: Iterable[Parameter]) -> str:
    return ", ".join(
        _name(v.name) if v.kind is None else f"{_name(v.name)} that is {_kind(domain, v.kind)}"
        for v in variables
    )


def _kind(domain: Domain, kind: str) -> str:
    if kind in domain.categories:
        return with_articles(f"a {domain.categories[kind].spoken}")
    if kind.startswith("has_") and kind.removeprefix("has_") in domain.attributes:
        return f"something with the state {kind.removeprefix('has_').replace('_', ' ')}"
    return f"marked {kind.replace('_', ' ')}"


def _name(name: str) -> str:
    return re.sub(r"^\?", "", name)


def _listed(title: str, entries: list[str]) -> list[str]:
    return [f"  {title}:", *(f"    - {e}" for e in entries)] if entries else []
