"""A corrected plan as a person tells it: what it adds before the old one is taken up again.

Called by `sentences.py`. Driving is left out, and so is taking a thing that is then put somewhere.
"""

from __future__ import annotations

import difflib
from collections.abc import Sequence

from forestall.domain.model import Domain
from forestall.domain.spoken import Spoken, listed
from forestall.types.facts import category_of
from forestall.types.plan import Plan, Subtask
from forestall.types.runtime import BoundaryContext

_MOST = 5
"""How many steps a sentence tells."""


def will_do(
    context: BoundaryContext, plan: Plan, sought: Sequence[str], domain: Domain, spoken: Spoken
) -> str:
    """What the robot does instead: "I put the nut on the tray, open the box and go on".

    Args:
        context: the plan that was followed.
        plan: what is followed instead.
        sought: things that are looked for in a place which it goes to or opens.
        domain: schemas.
        spoken: words.
    """
    if not plan.subtasks:
        return "nothing is left to do"
    added, left_out = changed_steps(context.remaining(), plan, domain)
    groups = _merged(_folded(added, context, domain))
    told = [_told(g, b, domain, spoken) for g, b in _with_last(groups)]
    if sought:
        there = listed([spoken.the(n) for n in sought], "or")
        told = told or [spoken.step(s) for s in plan.subtasks[:1] if domain.drives(s)]
        return f"I {listed([*told, f'look for {there} there'])}"
    if not told:
        not_done = [f"not {spoken.step(s)}" for s in left_out[:_MOST]]
        return f"I will {listed(not_done)}, and go on" if not_done else "I go on from here"
    if {_kind(s) for s in added} <= {_kind(s) for s in left_out}:
        told[0] = f"first {told[0]}"
    if len(told) > _MOST:
        more = len(told) - _MOST + 1
        told = [*told[: _MOST - 1], f"do {more} more steps"]
    return f"I {', '.join(told)}, and go on" if len(told) > 1 else f"I {told[0]} and go on"


def changed_steps(
    before: Sequence[Subtask], plan: Plan, domain: Domain
) -> tuple[list[Subtask], list[Subtask]]:
    """What a corrected plan has and the old one did not, and the other way round; no drives."""
    old, new = _without_drives(before, domain), _without_drives(plan.subtasks, domain)
    left, right = [_kind(s) for s in old], [_kind(s) for s in new]
    same = 0
    while same < min(len(left), len(right)) and left[-1 - same] == right[-1 - same]:
        same += 1
    left, right = left[: len(left) - same], right[: len(right) - same]
    matcher = difflib.SequenceMatcher(None, left, right, autojunk=False)
    added: list[Subtask] = []
    left_out: list[Subtask] = []
    for tag, a, b, c, d in matcher.get_opcodes():
        if tag != "equal":
            left_out += old[a:b]
            added += new[c:d]
    return added, left_out


def _folded(steps: Sequence[Subtask], context: BoundaryContext, domain: Domain) -> list[Subtask]:
    """Without taking what the next step puts somewhere, or what was in the hand before."""
    found: list[Subtask] = []
    held = context.graph.in_hands(domain.robot.hands)
    for k, step in enumerate(steps):
        taken = _taken(step, domain)
        following = steps[k + 1] if k + 1 < len(steps) else None
        if taken is not None and following is not None and _in_hand(following, domain) == taken:
            continue
        last = following is None and found
        if taken is not None and last and any(_same(taken, h) for h in held):
            continue
        found.append(step)
    return found


def _merged(steps: Sequence[Subtask]) -> list[tuple[Subtask, ...]]:
    """Steps in a row that do the same with one thing after the other are told as one."""
    found: list[tuple[Subtask, ...]] = []
    for step in steps:
        last = found[-1][-1] if found else None
        alike = last is not None and last.skill == step.skill and last.args[1:] == step.args[1:]
        if alike and step.args:
            found[-1] = (*found[-1], step)
        else:
            found.append((step,))
    return found


def _with_last(
    groups: Sequence[tuple[Subtask, ...]],
) -> list[tuple[tuple[Subtask, ...], Subtask | None]]:
    """Each group with the step before it, if that was a single one."""
    before = [None, *(g[0] if len(g) == 1 else None for g in groups)]
    return list(zip(groups, before[: len(groups)], strict=True))


def _told(
    group: tuple[Subtask, ...], before: Subtask | None, domain: Domain, spoken: Spoken
) -> str:
    step = group[0]
    if len(group) > 1:
        return spoken.step(step, {step.args[0]: spoken.all_of([s.args[0] for s in group])})
    shared = [a for a in step.args if before is not None and before.args == (a,)]
    again = before is not None and len(step.args) == 1 and _undone(before, step, domain)
    return spoken.step(step, dict.fromkeys(shared, "it")) + (" again" if again else "")


def _undone(before: Subtask, step: Subtask, domain: Domain) -> bool:
    """Whether a step gives another value to what the step before it has set."""
    first, second = _sets(before, domain), _sets(step, domain)
    return any(first[key] != second[key] for key in first.keys() & second.keys())


def _sets(step: Subtask, domain: Domain) -> dict[tuple[str, ...], str]:
    skill = domain.skills.get(step.skill)
    if skill is None or len(skill.roles) != len(step.args):
        return {}
    facts = (f.bind(domain.bound(step)) for e in skill.effects for f in e.facts)
    return {(f.predicate, *(a for a in f.args if a in step.args)): f.value for f in facts}


def _taken(step: Subtask, domain: Domain) -> str | None:
    """What a step takes into the hand."""
    skill, holding = domain.skills.get(step.skill), domain.roles.holding
    if skill is None or holding is None or len(skill.roles) != len(step.args):
        return None
    names = domain.bound(step)
    return next(
        (
            names.get(f.args[0])
            for e in skill.effects
            for f in e.facts
            if f.predicate == holding and f.value == "true"
        ),
        None,
    )


def _in_hand(step: Subtask, domain: Domain) -> str | None:
    """What has to be in the hand when a step begins."""
    skill = domain.skills.get(step.skill)
    if skill is None or skill.hand is None or len(skill.roles) != len(step.args):
        return None
    return domain.bound(step).get(skill.hand)


def _same(name: str, held: str | None) -> bool:
    return held is not None and name in (held, category_of(held))


def _without_drives(steps: Sequence[Subtask], domain: Domain) -> list[Subtask]:
    return [s for s in steps if not domain.drives(s)]


def _kind(step: Subtask) -> tuple[str, ...]:
    return (step.skill, *map(category_of, step.args))
