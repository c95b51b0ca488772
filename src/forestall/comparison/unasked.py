"""What was not asked of a scene, because it is asked of another task than the one at hand.

Called by the detector and the reasoner of mined preconditions, so that what they say of a scene is
true; calls preconditions and relevance. It decides nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from forestall.comparison.lifting import evaluate
from forestall.comparison.needs import Needs
from forestall.comparison.preconditions import MiningConfig, needed
from forestall.comparison.relevance import counts
from forestall.types.facts import Literal, Truth
from forestall.types.graph import SceneGraph
from forestall.types.plan import Subtask
from forestall.types.runtime import When
from forestall.types.verdict import Precondition, Violation

_TOLD = 3
"""How many facts a sentence names."""


@dataclass(frozen=True, slots=True)
class Unasked:
    """A precondition that would be asked if the task were another one.

    Args:
        precondition: as it is mined for the first of the tasks.
        tasks: for which it would be asked; "" is one that has no name.
    """

    precondition: Precondition
    tasks: tuple[str, ...]


def unasked(
    memory: Needs, subtask: Subtask, task: str, config: MiningConfig | None = None
) -> tuple[Unasked, ...]:
    """What some task that was shown asks of a subtask and the task at hand does not.

    Args:
        memory: the counts.
        subtask: the subtask at hand.
        task: the task at hand, "" where it has no name.
        config: how much evidence a precondition needs.

    Returns:
        Nothing where the memory shows such a subtask in this very task. Of a task that has a name
        only what every task that was shown asks.
    """
    about = (memory.domain.family(subtask), tuple(memory.kinds(subtask).values()))
    shown = sorted({key[2] for key in memory.here if key[:2] == about})
    if task in shown:
        return ()
    asked = {p.literal for p in needed(memory, subtask, task, None, config)}
    found: dict[Literal, list[tuple[str, Precondition]]] = {}
    for other in shown:
        for p in needed(memory, subtask, other, None, config):
            if p.literal not in asked:
                found.setdefault(p.literal, []).append((other, p))
    return tuple(
        Unasked(several[0][1], tuple(t for t, _ in several))
        for several in found.values()
        if not task or len(several) == len(shown)
    )


def not_judged(
    known: Sequence[Unasked], graph: SceneGraph, subtask: Subtask, task: str, memory: Needs
) -> str:
    """What of it does not hold in a scene, and why that says nothing; "" where all of it holds."""
    domain, said = memory.domain, []
    for u in known:
        if evaluate(u.precondition.literal, graph, subtask, domain) is not Truth.FALSE:
            continue
        literal = u.precondition.literal.bind(domain.bound(subtask))
        violation = Violation(u.precondition, literal, Truth.FALSE)
        if counts(violation, subtask, graph, When.BEFORE, domain):
            of = " and ".join(t or "a task without a name" for t in u.tasks)
            said.append(f"{literal}, as in {of}")
    if not said:
        return ""
    facts = "; ".join(said[:_TOLD])
    more = f"; and {len(said) - _TOLD} more" if len(said) > _TOLD else ""
    if task:
        why = f"no demonstration shows such a step in the task {task}"
    else:
        why = "no task is named (--task)"
    return f"not judged, because it depends on the task and {why}: {facts}{more}"
