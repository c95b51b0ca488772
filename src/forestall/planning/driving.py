"""Driving, put into a plan afterwards, and steps moved to where that saves some.

Called by `planner`; calls `execute`. Driving is not searched for: the skill that drives is inserted
where the next step is at another place. What the plan makes gets the names that `apply` gives.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from forestall.deadline import Deadline
from forestall.planning.execute import Refusal, apply
from forestall.planning.problem import Operator, Problem
from forestall.planning.state import State
from forestall.types.facts import by_number, category_of
from forestall.types.plan import Subtask

HURRY_S = 0.1
"""With less time than this a plan is not improved any more."""


def gathered(
    problem: Problem, state: State, steps: list[Operator], deadline: Deadline
) -> list[Operator]:
    """Do things where the robot is anyway, if that saves driving and there is time.

    A step moves up behind the last step at its place, where the plan still works.
    """
    for i, step in enumerate(steps):
        if deadline.left() < HURRY_S:
            break
        if step.over is not None or not step.subtask.args:
            continue
        place = place_of(state, step.subtask.args[-1])
        near = [j for j in range(i - 1) if _at(state, steps[j]) == place]
        if place is None or not near or _at(state, steps[i - 1]) == place:
            continue
        moved = [*steps[: near[-1] + 1], step, *steps[near[-1] + 1 : i], *steps[i + 1 :]]
        if _drives(state, moved) < _drives(state, steps) and problem.works(moved):
            steps = moved
    return steps


def _drives(state: State, steps: Sequence[Operator]) -> int:
    places = [_at(state, s) for s in steps]
    return sum(a != b for a, b in pairwise(places))


def _at(state: State, step: Operator) -> str | None:
    args = step.subtask.args
    return place_of(state, args[-1]) if args else None


def place_of(state: State, name: str) -> str | None:
    """Where the robot stands to handle a thing; None for what does not exist yet."""
    if name not in state.kinds:
        return None
    return state.follow(("place", name), lambda: _served(state, name) or state.root(name))


def _served(state: State, name: str) -> str | None:
    """The place that a thing works on, where it stands at another one."""
    if any(True for _ in state.chain(name)):
        return None
    domain = state.domain
    for predicate in domain.predicates.values():
        if predicate.paired.startswith("same number"):
            kind = state.kinds[name]
            for first, second in sorted(domain.statics.get(predicate.name, ())):
                if first == kind and second != kind:
                    partners = [
                        x for x in state.instances(second) if _holds(state, predicate.name, name, x)
                    ]
                    if partners:
                        return partners[0]
    return None


def _holds(state: State, predicate: str, *args: str) -> bool:
    return state.says(predicate, *args)


def with_driving(
    state: State,
    operators: Sequence[Operator],
    loose: frozenset[str] = frozenset(),
    deadline: Deadline | None = None,
) -> tuple[tuple[Subtask, ...], State | None, str]:
    """Insert driving, executing along; the final state is None if a step does not run.

    A support in `loose` is named by its category: any other of its kind with room would do.

    Raises:
        TimeUp: the deadline is over.
    """
    plan: list[Subtask] = []
    where: str | None = None
    names: dict[str, str] = {}
    driving = state.domain.driving()
    for operator in operators:
        subtask = Subtask(
            operator.subtask.skill, tuple(names.get(a, a) for a in operator.subtask.args)
        )
        over = names.get(operator.over, operator.over) if operator.over else None
        subject = over or (subtask.args[-1] if subtask.args else None)
        steps_here = [subtask]
        if subject is not None:
            place = place_of(state, subject)
            held = {h for _, h in state.in_hands()}
            if driving is not None and (place != where or over) and subject not in held:
                landmark = over or landmark_of(state, subject)
                steps_here.insert(0, Subtask(driving.name, (landmark,)))
            where = place
            first = place == subject and place in loose
            if first and place and state.instances(state.kinds[place])[0] == place:
                steps_here = [_renamed(s, place, state.kinds[place]) for s in steps_here]
        for step in steps_here:
            if deadline is not None:
                deadline.check()
            after = apply(state, step)
            if isinstance(after, Refusal):
                return tuple(plan), None, f"{step} does not run: {after.reason}"
            if step is steps_here[-1]:
                _name_anew(state, after, operator, names)
            state = after
            plan.append(step)
    return tuple(plan), state, ""


def _name_anew(before: State, after: State, operator: Operator, names: dict[str, str]) -> None:
    """Learn the names of what a step has made."""
    fresh = sorted((x for x in after.kinds if x not in before.kinds), key=by_number)
    planned = [x for x in operator.makes if x not in names]
    for name in sorted(planned, key=by_number):
        same = [x for x in fresh if category_of(x) == category_of(name)]
        if same:
            names[name] = same[0]
            fresh.remove(same[0])


def _renamed(subtask: Subtask, old: str, new: str) -> Subtask:
    return Subtask(subtask.skill, tuple(new if a == old else a for a in subtask.args))


def landmark_of(state: State, name: str) -> str:
    """What to drive to for a thing: the container that it is inside, else itself."""
    domain = state.domain
    inside = next((r for r in domain.containing), None)
    for place in state.chain(name):
        fixture = place.parent == state.root(name) or domain.encloses(state.kinds[place.parent])
        if fixture and place.relation == inside:
            return place.parent
    return name
