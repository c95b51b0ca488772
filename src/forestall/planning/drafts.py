"""Ground skills and processes before their facts become bits.

Made by `ground`, read by `number`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from forestall.planning.grounder import Grounder
from forestall.planning.nodes import Node
from forestall.types.plan import Subtask


@dataclass(slots=True)
class Change:
    """A conditional effect by numbers of facts."""

    condition: Node
    add: list[int]
    delete: list[int]


@dataclass(slots=True)
class Draft:
    """A ground skill before its facts become bits."""

    subtask: Subtask
    condition: Node
    changes: list[Change]
    prefers: list[Node] = field(default_factory=list)
    over: str | None = None
    makes: tuple[str, ...] = ()


@dataclass(slots=True)
class Event:
    """A ground process before its facts become bits."""

    condition: Node
    changes: list[Change]


@dataclass(slots=True)
class Grounding:
    """Everything that can happen in a universe."""

    grounder: Grounder
    drafts: list[Draft]
    processes: list[list[Event]]
