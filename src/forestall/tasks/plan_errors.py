"""Plans as a planner writes them that errs as language models do: seeded, plausible, not judged.

Called by `drawing`, which plays each; calls the domain. The kinds are those of the Embodied Agent
Interface (Li et al., NeurIPS 2024 Datasets and Benchmarks, arXiv 2410.07166), and so are the rates:
the table "Trajectory evaluation results for action sequencing" on its project page gives, for 18
models in two simulators, the share of plans with each error; `RATES` are its means, in per cent. A
plan that runs and misses the goal (execution rate minus goal rate, 8.0 on average) names a wrong
object or place here; half and half is our choice, as are the thirds of missing steps that are whole
errands. Errors of parsing and of the number of arguments (3.7 together) are not drawn: such a plan
is refused when it is read; nor are invented skills, for the same reason. RoboFail's failures of
planning have the same order: 18 missing steps, 17 wrong plans, 10 wrong orders.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np

from forestall.tasks.composing import Candidate, begun, counted, named
from forestall.tasks.execution_faults import lets_go
from forestall.tasks.faults import (
    DropStep,
    Fault,
    InsertStep,
    MoveStep,
    ReplaceArgument,
    ReplacePlan,
    apply_plan_faults,
)
from forestall.tasks.files import LoadedTask
from forestall.tasks.scene_faults import AddObject
from forestall.types.facts import category_of
from forestall.types.plan import Plan, Subtask

RATES: Mapping[str, float] = {
    "missing-step": 20.0,
    "missing-errand": 10.0,
    "wrong-object": 4.0,
    "wrong-place": 4.0,
    "invented-object": 6.4,
    "wrong-order": 4.1,
    "additional-step": 4.1,
    "affordance": 2.8,
}
"""Per cent of plans with each error, see above."""

Error = tuple[tuple[Fault, ...], str]


class ErringPlanner:
    """Draws erroneous plans for one task.

    Args:
        loaded: the task.
        rng: draws kinds, steps and names.
        fixtures: categories that the room is known to have.
    """

    def __init__(
        self, loaded: LoadedTask, rng: np.random.Generator, fixtures: Iterable[str] = ()
    ) -> None:
        self.room = set(fixtures)
        self.task, self.domain, self.rng = loaded.task, loaded.domain, rng
        self.plan = loaded.task.plan
        made = {m for c in self.domain.categories for m in self.domain.becomes(c)}
        own = {o.category for o in self.task.scene.objects} | made
        movable = self.domain.roles.movable
        self.others = [c for c in self.domain.tagged(movable) if c not in own]
        self.acts = [k for k, s in enumerate(self.plan) if not self._drives(s)]

    def draw(self) -> Candidate | None:
        """One plan with one error; None where the drawn kind has none here."""
        kinds = list(RATES)
        weights = np.array([RATES[k] for k in kinds])
        kind = kinds[int(self.rng.choice(len(kinds), p=weights / weights.sum()))]
        ways: Mapping[str, Callable[[], Error | None]] = {
            "missing-step": self._missing_step,
            "missing-errand": self._missing_errand,
            "wrong-object": lambda: self._other_object(there=True),
            "wrong-place": self._other_place,
            "invented-object": lambda: self._other_object(there=False),
            "wrong-order": self._other_order,
            "additional-step": self._additional_step,
            "affordance": self._affordance,
        }
        error = ways[kind]()
        if error is None:
            return None
        faults, words = error
        erring = apply_plan_faults(self.plan, faults, self.domain)
        if erring == self.plan or not len(erring):
            return None
        title = begun(words)
        since = divergence(self.plan, erring)
        return Candidate(self.task.name, kind, title, f"{title}.", faults, since)

    def _missing_step(self) -> Error:
        at = self._one(self.acts)
        step, number = counted(self.plan, at)
        fault = DropStep(step=str(step), occurrence=number)
        return (fault,), f"the plan leaves out {named(step, number)}"

    def _missing_errand(self) -> Error | None:
        """What prepares something is left out altogether: two to four steps in a row."""
        length = int(self.rng.integers(2, 5))
        if len(self.acts) <= length:
            return None
        first = self._one(self.acts[: -length + 1])
        gone = list(range(first, min(first + length, len(self.plan))))
        kept = [s for k, s in enumerate(self.plan) if k not in gone]
        ends = [named(*counted(self.plan, k)) for k in (gone[0], gone[-1])]
        return (_whole(kept),), f"the plan leaves out {' to '.join(ends)}"

    def _other_order(self) -> Error | None:
        """A step comes one to three acts too early or too late."""
        if len(self.acts) < 2:
            return None
        place = int(self.rng.integers(len(self.acts)))
        shift = int(self.rng.integers(1, 4)) * int(self.rng.choice([-1, 1]))
        other = place + shift
        if not 0 <= other < len(self.acts):
            return None
        step, number = counted(self.plan, self.acts[place])
        anchor = self.plan.subtasks[self.acts[other]]
        if anchor == step or self.plan.subtasks.count(anchor) > 1:
            return None
        way = {"after" if shift > 0 else "before": str(anchor)}
        fault = MoveStep(step=str(step), occurrence=number, **way)
        when = "only after" if shift > 0 else "before"
        words = f"the plan does {named(step, number)} {when} {anchor}"
        return (fault,), words

    def _additional_step(self) -> Error:
        """A step is done again later, or undone where that is not asked for."""
        at = self._one(self.acts)
        step = self.plan.subtasks[at]
        undoing = [
            s.name
            for s in self.domain.skills.values()
            if s.undoes is not None
            and any(
                f.predicate == s.undoes.predicate and f.value == s.undoes.value
                for e in self.domain.skill(step.skill).effects
                for f in e.facts
            )
        ]
        more = Subtask(undoing[0], step.args[:1]) if undoing and self.rng.random() < 0.5 else step
        later = self._one([k for k in range(len(self.plan)) if k >= at])
        anchor, number = counted(self.plan, later)
        fault = InsertStep(step=str(more), after=str(anchor), occurrence=number)
        how = "once more" if more in self.plan.subtasks[: later + 1] else "too"
        return (fault,), f"the plan does {more} {how}, after {named(anchor, number)}"

    def _other_object(self, there: bool) -> Error | None:
        """Another thing in the place of one of the task's, all through or in one step.

        Args:
            there: whether it is in the scene; else it is invented.
        """
        used = {a for s in self.plan for a in s.args}
        own = [o for o in self.task.scene.objects if {o.id, o.category} & used]
        if not own or not self.others:
            return None
        need = own[int(self.rng.integers(len(own)))]
        alike = sorted(self.others, key=lambda c: -self._alike(c, need.category))[:4]
        other = alike[int(self.rng.integers(len(alike)))]
        names = {need.id, need.category}
        if there:
            plan = _whole([_renamed(s, names, other) for s in self.plan])
            told = f"the plan uses {other} in place of {need.category}"
            return (AddObject(category=other), plan), told
        of = need.category if self.rng.random() < 0.5 else other
        numbered = f"{of}-{int(self.rng.integers(3, 9))}"  # clutter has no third of anything
        plan = _whole([_renamed(s, names, numbered) for s in self.plan])
        return (plan,), f"the plan speaks of {numbered}, which is not there"

    def _other_place(self) -> Error | None:
        """A thing is put at another place of the room."""
        domain = self.domain
        puts = [k for k in self.acts if lets_go(domain, self.plan.subtasks[k])]
        puts = [k for k in puts if len(self.plan.subtasks[k].args) > 1]
        if not puts:
            return None
        at = self._one(puts)
        step, number = counted(self.plan, at)
        spoken = {category_of(a) for s in self.plan for a in s.args}
        places = sorted((spoken | self.room) - {category_of(step.args[-1])})
        places = [p for p in places if domain.accepts(p, step.args[0])]
        if not places:
            return None
        other = places[int(self.rng.integers(len(places)))]
        role = domain.skill(step.skill).roles[-1]
        fault = ReplaceArgument(step=str(step), occurrence=number, argument=role, by=other)
        instead = Subtask(step.skill, (*step.args[:-1], other))
        return (fault,), f"the plan has {instead} for {named(step, number)}"

    def _affordance(self) -> Error | None:
        """A step is done to something that it cannot be done to."""
        names = sorted({a for s in self.plan for a in s.args})
        at = self._one(self.acts)
        step, number = counted(self.plan, at)
        others = [n for n in names if n not in step.args]
        if not others:
            return None
        other = others[int(self.rng.integers(len(others)))]
        role = self.domain.skill(step.skill).roles[-1]
        fault = ReplaceArgument(step=str(step), occurrence=number, argument=role, by=other)
        instead = Subtask(step.skill, (*step.args[:-1], other))
        return (fault,), f"the plan has {instead} for {named(step, number)}"

    def _alike(self, one: str, other: str) -> int:
        """How many tags and attributes two categories share."""
        return len(self.domain.kinds(one) & self.domain.kinds(other))

    def _drives(self, step: Subtask) -> bool:
        return self.domain.drives(step)

    def _one(self, options: list[int]) -> int:
        return options[int(self.rng.integers(len(options)))]


def divergence(plan: Plan, other: Plan) -> int:
    """The first step of a plan that is not the one that another plan has there."""
    for k, step in enumerate(other):
        if k >= len(plan) or step != plan.subtasks[k]:
            return k
    return len(other)


def _renamed(step: Subtask, names: set[str], by: str) -> Subtask:
    return Subtask(step.skill, tuple(by if a in names else a for a in step.args))


def _whole(steps: list[Subtask]) -> ReplacePlan:
    return ReplacePlan(plan=tuple(str(s) for s in steps))
