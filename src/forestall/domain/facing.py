"""What the robot faces, where it matters to what comes next: for whoever checks a rest of a plan.

A scene graph says nothing of it. What a plan has just driven to is faced, and what a skill says
that the robot stands at when it is done.
"""

from __future__ import annotations

from collections.abc import Sequence

from forestall.domain.formula import asks
from forestall.domain.model import FACING, Domain
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask


def minds_facing(step: Subtask, domain: Domain) -> bool:
    """Whether it matters to a step what the robot faces; of a skill that is not known it does not.

    So it is where the skill deals with what it does not name: an egg is cracked into what stands
    there.
    """
    skill = domain.skills.get(step.skill)
    return skill is not None and any(
        asks((*choice.among, choice.such_that), FACING) for choice in skill.deciding
    )


def way_here(
    steps: Sequence[Subtask], index: int, graph: SceneGraph, domain: Domain
) -> tuple[Subtask, ...]:
    """The drive after which the rest of a plan is as the robot finds it, none where there is none.

    The one before it, if that is the last step; else one to where the last step was done, if the
    robot goes nowhere before it matters what it faces.

    Args:
        steps: of the plan.
        index: of the step that comes next.
        graph: what is seen.
        domain: skills.
    """
    last = steps[index - 1] if index > 0 else None
    if last is None or domain.drives(last):
        return () if last is None else (last,)
    driving, skill = domain.driving(), domain.skills.get(last.skill)
    if driving is None or skill is None or not _matters(steps[index:], domain):
        return ()
    names = [p.name for p in skill.parameters]
    place = last.args[names.index(skill.at)] if skill.at in names else ""
    if graph.get(place) is None or place in graph.in_hands(domain.robot.hands):
        return ()
    return (Subtask(driving.name, (place,)),)


def _matters(steps: Sequence[Subtask], domain: Domain) -> bool:
    for step in steps:
        if domain.drives(step) or minds_facing(step, domain):
            return not domain.drives(step)
    return False
