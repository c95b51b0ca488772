"""The plan to look into one place: shut what was opened for nothing, open it, go on with the plan.

Called by the replanner, which plans and checks the pieces; calls nothing that plans.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from forestall.domain.formula import literals
from forestall.domain.model import Domain
from forestall.planning.state import State
from forestall.types.facts import Literal as Fact
from forestall.types.facts import category_of
from forestall.types.plan import Subtask


def as_usual(state: State, things: Iterable[str] | None = None) -> list[Fact]:
    """What is to be as usual again about things that no safety rule lets stay as they are.

    Args:
        state: with what must never be so and is.
        things: only these; None: whatever it is.
    """
    wanted, domain = None if things is None else set(things), state.domain
    found: dict[Fact, None] = {}
    for rule in domain.safety:
        for names in state.bindings(rule.variables, rule.never, {}):
            for literal, _ in literals(rule.never):
                ground = literal.bind(names)
                one = ground.args[0] if ground.args else ""
                if ground.predicate in domain.attributes and (wanted is None or one in wanted):
                    usual = domain.default_states(state.kinds[one])
                    found[Fact(ground.predicate, ground.args, usual[ground.predicate])] = None
    return list(found)


def with_shutting(
    rest: Sequence[Subtask],
    opening: Sequence[Subtask],
    shutting: Sequence[Subtask],
    thing: str,
    domain: Domain,
) -> tuple[Subtask, ...]:
    """What is left of a plan, with a place shut again once the thing is out of it.

    The robot stands there then; where the plan does not take the thing, it is shut at the end.
    Where the plan shuts it anyway before it opens it again, or opens it again before it has the
    thing, nothing is put in: it is open for what the plan does with it then.
    """
    acting = _acting(shutting, domain)
    own = {thing, category_of(domain.canonical(thing))}
    taking = next((k for k, s in enumerate(rest) if own & set(_taken(s, domain))), len(rest))
    both = (*acting[-1:], *opening[-1:])
    theirs = [k for k, s in enumerate(rest) if any(_same(s, one) for one in both)]
    if not acting or (theirs and (theirs[0] < taking or _same(rest[theirs[0]], acting[-1]))):
        return tuple(rest)
    if taking < len(rest):
        return (*rest[: taking + 1], *acting, *rest[taking + 1 :])
    return (*rest, *shutting)


def without(
    rest: Sequence[Subtask], shutting: Sequence[Subtask], domain: Domain
) -> tuple[Subtask, ...]:
    """What is left of a plan when places are shut before that it would shut later."""
    left = list(rest)
    for done in _acting(shutting, domain):
        about = [k for k, s in enumerate(left) if _acting((s,), domain) and _about(s, done)]
        if not about or not _same(left[about[0]], done):
            continue
        k = about[0]
        del left[k]
        led = k > 0 and not _acting(left[k - 1 : k], domain)
        if led and not _acting(left[k : k + 1], domain):
            del left[k - 1]
    return tuple(left)


def _taken(step: Subtask, domain: Domain) -> tuple[str, ...]:
    """What a step takes into a hand."""
    names = domain.bound(step)
    return tuple(
        names.get(fact.args[0], fact.args[0])
        for effect in domain.skill(step.skill).effects
        for fact in effect.facts
        if fact.predicate == domain.roles.holding and fact.value != "false"
    )


def _acting(steps: Sequence[Subtask], domain: Domain) -> tuple[Subtask, ...]:
    return tuple(s for s in steps if not domain.drives(s))


def _same(step: Subtask, other: Subtask) -> bool:
    """Whether a step of a plan does what another does, by the name of a thing or of its kind."""
    return step.skill == other.skill and _about(step, other)


def _about(step: Subtask, other: Subtask) -> bool:
    """Whether a step of a plan is about the things of another."""
    return len(step.args) == len(other.args) and all(
        a in (b, category_of(b)) for a, b in zip(step.args, other.args, strict=True)
    )
