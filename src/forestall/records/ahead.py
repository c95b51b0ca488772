"""The steps that are left of a plan, and which of them needs what.

Called by `sentences.py`; calls the domain. What a step needs and brings about is read from its
schema alone.
"""

from __future__ import annotations

from collections.abc import Sequence

from forestall.domain.formula import TRUE as ALWAYS
from forestall.domain.formula import bind, free
from forestall.domain.model import LOCATED, Domain
from forestall.domain.truth import formula_truth, truth
from forestall.types.facts import Literal, Truth, category_of
from forestall.types.plan import Subtask
from forestall.types.runtime import BoundaryContext, When


def ahead(context: BoundaryContext, domain: Domain) -> list[Subtask]:
    """What is left of the plan without drives, its first step grounded."""
    left = context.remaining()
    if context.when is When.BEFORE and left:
        left = (context.subtask, *left[1:])
    return [s for s in left if not domain.drives(s)]


def needing(
    context: BoundaryContext, fact: Literal, steps: Sequence[Subtask], domain: Domain
) -> Subtask | None:
    """The first step that lacks a fact; None where a step before it brings the fact about."""
    for step in steps:
        skill = domain.skills.get(step.skill)
        if skill is None or len(skill.roles) != len(step.args):
            continue
        names = domain.bound(step)
        meant = {v: instance_of(a, context) for v, a in names.items()}
        for need in skill.needs:
            if any(_matches(x.bind(names), fact) for x in need.lacking):
                formula = bind(need.formula, meant)
                if free(formula) or formula_truth(context.graph, formula, domain) is not Truth.TRUE:
                    return step
        sure = [e for e in skill.effects if not e.variables and e.condition == ALWAYS]
        if any(_matches(f.bind(names), fact) for e in sure for f in e.facts):
            return None
    return None


def _matches(lifted: Literal, fact: Literal) -> bool:
    """Whether a fact of a step is one about these things, named or by category."""
    same = (lifted.predicate, lifted.value) == (fact.predicate, fact.value)
    if not same or not fact.args:
        return same
    first, meant = lifted.args[:1], fact.args[0]
    return bool(first) and first[0] in (meant, category_of(meant))


def instance_of(name: str, context: BoundaryContext) -> str:
    """The one thing that a name means, the name itself where there are several or none."""
    found = context.graph.matches(name)
    return found[0] if len(found) == 1 else name


def alike(one: Subtask, other: Subtask) -> bool:
    """Whether two subtasks do the same with things of the same kinds."""
    mine, theirs = map(category_of, one.args), map(category_of, other.args)
    return one.skill == other.skill and list(mine) == list(theirs)


def known_truth(context: BoundaryContext, fact: Literal, domain: Domain) -> Truth:
    """The truth of a fact now; of one that the domain does not know nothing was observed."""
    if fact.predicate not in domain.predicates and fact.predicate != LOCATED:
        return Truth.UNOBSERVED
    return truth(context.graph, fact, domain)
