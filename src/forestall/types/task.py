"""A task: words, goal condition, nominal plan, scene needs."""

from __future__ import annotations

from dataclasses import dataclass

from forestall.types.facts import Literal
from forestall.types.plan import Plan
from forestall.types.scene import SceneNeeds


@dataclass(frozen=True, slots=True)
class Goal:
    """The success condition C_goal (paper, Sec. 3 "Problem Formulation").

    Args:
        text: in words.
        variables: (variable, category) pairs, e.g. ("?mug", "Mug"); the goal asks for one binding
            of all variables that makes every literal true.
        literals: must all hold in the end under that binding; arguments are variables or instance
            names, or a category name for "some instance of it".
        never: must not have become true at any time (irreversible outcomes), e.g. spoiled(?egg).
        weak: the weaker end-state check of REFLECT, kept beside ours.
    """

    text: str
    variables: tuple[tuple[str, str], ...] = ()
    literals: tuple[Literal, ...] = ()
    never: tuple[Literal, ...] = ()
    weak: tuple[Literal, ...] = ()


@dataclass(frozen=True, slots=True)
class Task:
    """One task as read from its data file."""

    name: str
    title: str
    goal: Goal
    plan: Plan
    scene: SceneNeeds
    domain: str = ""  # the name of its domain
