"""What the rest of a plan makes of a scene: which faults it puts right itself, and which never.

Called by the detector and the reasoner of mined preconditions (through the callable that they are
given); calls `validate`, which executes the plan in the domain's model.
"""

from __future__ import annotations

from forestall.domain.facing import way_here
from forestall.domain.model import Domain
from forestall.planning.execute import resolve
from forestall.planning.state import State
from forestall.planning.validate import Trace, observed, run
from forestall.types.facts import Literal
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan, Subtask


class Foresight:
    """Implements `comparison.lacking.Foreseen`: the plan as far as it runs from what is seen.

    Args:
        graph: what is seen.
        plan: at hand.
        index: of the step that comes next. The way to where the robot stands comes before it.
        domain: skills.
    """

    def __init__(self, graph: SceneGraph, plan: Plan, index: int, domain: Domain) -> None:
        self._domain = domain
        way = way_here(plan.subtasks, index, graph, domain)
        left, before = (*way, *plan.subtasks[index:]), len(way)
        trace = run(observed(graph, domain), left)
        self._states = trace.states[before:]
        steps = list(trace.meant[before:])
        if trace.step is not None and trace.step >= before:
            stopped = left[trace.step]
            args = resolve(trace.final, stopped)
            if isinstance(args, tuple):
                steps.append(Subtask(stopped.skill, args))
        self.steps: tuple[Subtask, ...] = tuple(steps)
        self._ran = trace.refusal is None
        self._without: dict[tuple[int, Literal], Trace | None] = {}

    def holds(self, step: int, literal: Literal) -> bool:
        """Whether a ground fact holds before a step."""
        return self._states[step].holds(literal)

    def mends(self, step: int, literal: Literal) -> bool:
        """Whether it makes no difference in the end that a state does not hold before a step.

        So it is where the plan from there on runs either way and leaves the same behind: what is
        dirty is washed, and nothing was done with it that stays.
        """
        other = self._as_if(step, literal)
        if other is None or not self._ran or other.refusal is not None:
            return False
        one, two = self._states[-1], other.final
        return one.values == two.values and one.facts == two.facts

    def undoable(self, step: int, literal: Literal) -> bool:
        """Whether nothing happens because of it that cannot be undone."""
        other = self._as_if(step, literal)
        if other is None:
            return True
        return not _histories(self._states[-1]) - _histories(other.final)

    def _as_if(self, step: int, literal: Literal) -> Trace | None:
        """The plan from a step on, had a state been as it should; None for what is no state."""
        key = (step, literal)
        if key not in self._without:
            self._without[key] = self._tried(step, literal)
        return self._without[key]

    def _tried(self, step: int, literal: Literal) -> Trace | None:
        if step >= len(self._states) or literal.predicate not in self._domain.attributes:
            return None
        state = self._states[step].copy()
        name = literal.args[0]
        if state.value(name, literal.predicate) is None:
            return None
        state.set_value(name, literal.predicate, literal.value)
        return run(state, self.steps[step:])


def _histories(state: State) -> set[tuple[str, ...]]:
    return {f for f in state.facts if f[0] in state.domain.histories}


def foresee(graph: SceneGraph, plan: Plan, index: int, domain: Domain) -> Foresight:
    """What the rest of a plan makes of a scene."""
    return Foresight(graph, plan, index, domain)
