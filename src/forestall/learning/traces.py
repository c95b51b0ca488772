"""Demonstrated steps with what was known before and after.

Called by `vocabulary` and `learn`; calls nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from forestall.types.demonstration import Demonstration
from forestall.types.facts import GRIPPER, category_of
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask


@dataclass(frozen=True, slots=True)
class Trace:
    """One demonstrated step.

    Args:
        demonstration: which run it is of.
        subtask: as it was done, its arguments instances where they were known.
        before: everything that was known before it.
        after: everything that was known after it, None where nobody looked.
    """

    demonstration: str
    subtask: Subtask
    before: SceneGraph
    after: SceneGraph | None

    def categories(self) -> tuple[str, ...]:
        """The categories of the arguments: their nodes', or their names'."""
        nodes = [self.before.get(a) for a in self.subtask.args]
        return tuple(
            category_of(a) if n is None else n.category
            for a, n in zip(self.subtask.args, nodes, strict=True)
        )


def traces(demonstrations: Sequence[Demonstration]) -> list[Trace]:
    """Every step of every demonstration."""
    return [
        Trace(d.id or f"#{number}", step.subtask, step.whole, d.after(position))
        for number, d in enumerate(demonstrations)
        for position, step in enumerate(d.steps)
    ]


def graphs_of(found: Iterable[Trace]) -> list[SceneGraph]:
    """Every graph, once."""
    return list({id(g): g for t in found for g in (t.before, t.after) if g is not None}.values())


def hands_of(graphs: Iterable[SceneGraph]) -> tuple[str, ...]:
    """Nodes that are hands by their name: "gripper", "left_gripper", "gripper-2"."""
    return tuple(
        sorted(
            {
                n.id
                for g in graphs
                for n in g.nodes
                if any(x.casefold().endswith(GRIPPER) for x in (category_of(n.id), n.category))
            }
        )
    )
