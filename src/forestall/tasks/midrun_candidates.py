"""What may go wrong, or right, in the middle of a run, at a drawn step of any task.

Called by `drawing`, which plays each and keeps what it says; calls `composing`.
"""

from __future__ import annotations

from collections.abc import Iterator

from forestall.tasks.composing import Candidate, Composed, counted, named
from forestall.tasks.execution_faults import lets_go, takes_up
from forestall.tasks.faults import Drop, FailedAction, Fault, Meanwhile
from forestall.tasks.scene_faults import AddObject
from forestall.types.plan import Plan, Subtask


class MidrunComposer(Composed):
    """Draws what comes about while the robot works."""

    def midrun(self, plan: Plan) -> list[Candidate]:
        """Differences that come about right after a drawn step."""
        found = [*self._meanwhile_states(), *self._meanwhile_moves(), *self._meanwhile_others()]
        drawn = [c for change in found for c in self._at_steps(plan, *change)]
        return [*drawn, *self._slips(plan), *self._helps(plan)]

    def _meanwhile_states(self) -> Iterator[tuple[str, str, tuple[Fault, ...], Meanwhile]]:
        for name, attribute, value in self.changes():
            if attribute in self.domain.lasting:
                continue
            told = f"somebody leaves {self.the(name)} {self.domain.say(attribute, value)}"
            change = Meanwhile(object=name, attribute=attribute, value=value)
            yield f"state-{attribute}", told, (), change

    def _meanwhile_moves(self) -> Iterator[tuple[str, str, tuple[Fault, ...], Meanwhile]]:
        domain = self.domain
        for need in self.task.scene.objects:
            if not domain.is_a(need.category, domain.roles.movable):
                continue
            for place in self.room:
                avoided = any(domain.is_a(place, tag) for tag in domain.roles.avoid)
                numbered = domain.is_a(place, domain.roles.numbered)
                if avoided or numbered or not domain.accepts(place, need.category):
                    continue
                kind = "put-away" if domain.encloses(place) else "moved"
                told = f"somebody puts {self.the(need.id)} {self.to(place)}"
                yield kind, told, (), Meanwhile(object=need.id, place=f"{place}-1")

    def _meanwhile_others(self) -> Iterator[tuple[str, str, tuple[Fault, ...], Meanwhile]]:
        """Another thing comes to where the plan will put something, or into the hand."""
        hands = self.domain.robot.hands if self.domain.roles.holding else ()
        for place in (*self.targets(), *hands[:1]):
            for other in self.drawn(None if place in hands else place)[:2]:
                there = AddObject(category=other)
                put = Meanwhile(object=f"{other}-1", place=place)
                if place in hands:
                    told = f"somebody puts {self.a(other)} into the robot's hand"
                    yield "in-the-hand", told, (there,), put
                    continue
                limited = self.domain.is_a(place, self.domain.roles.vacatable)
                told = f"somebody puts {self.a(other)} {self.to(place)}"
                yield "occupied" if limited else "others-there", told, (there,), put

    def _helps(self, plan: Plan) -> Iterator[Candidate]:
        """Somebody does the work of a later step: changes its state, or puts its thing there.

        A state is changed only after what the plan does to the same thing before (nobody starts a
        machine whose door the plan has still to shut).
        """
        for later, step in enumerate(plan):
            skill = self.domain.skill(step.skill)
            made = [
                f for e in skill.effects for f in e.facts if f.predicate in self.domain.attributes
            ]
            thing = self.meant(step.args[0])
            change, first = None, 0
            if skill.undoes is not None and len(step.args) == 1 and made:
                change = Meanwhile(object=thing, attribute=made[0].predicate, value=made[0].value)
                told = f"somebody does {step}, which the plan does later"
                handled = [k for k in range(later) if self._works(plan.subtasks[k], step.args[0])]
                first = max(handled, default=0)
            elif (
                skill.hand is not None and len(step.args) == 2 and self.domain.offers(step.args[1])
            ):
                change = Meanwhile(object=thing, place=self.meant(step.args[1]))
                told = f"somebody puts {self.the(thing)} {self.to(step.args[1])}, as the plan would"
            if change is not None and first < later - 1 and self.domain.find(thing) is not None:
                before = int(self.rng.integers(first, later - 1))
                yield from self._at_steps(plan, "helped", told, (), change, before)

    def _works(self, step: Subtask, name: str) -> bool:
        """Whether a step changes the state of a thing and nothing else."""
        return step.args == (name,) and self.domain.skill(step.skill).undoes is not None

    def _at_steps(
        self,
        plan: Plan,
        kind: str,
        told: str,
        more: tuple[Fault, ...],
        change: Meanwhile,
        at: int | None = None,
    ) -> Iterator[Candidate]:
        at = int(self.rng.integers(len(plan) - 1)) if at is None else at
        step, number = counted(plan, at)
        then = change.model_copy(update={"step": str(step), "occurrence": number})
        yield Candidate(
            self.task.name,
            kind,
            f"Meanwhile {told}",
            f"While the robot works, after {named(step, number)}, {told}.",
            (*more, then),
            since=at + 1,
            watch=() if self._misses(change) else ("thing", change.object),
        )

    def _misses(self, change: Meanwhile) -> bool:
        """Whether a thing of the task is no longer where it was, which shows there."""
        return change.place is not None and change.object in {o.id for o in self.task.scene.objects}

    def _carries(self, plan: Plan, at: int) -> bool:
        """Whether the robot has something in its hand before a step."""
        for step in reversed(plan.subtasks[:at]):
            if takes_up(self.domain, step) or lets_go(self.domain, step):
                return takes_up(self.domain, step)
        return False

    def _slips(self, plan: Plan) -> Iterator[Candidate]:
        """A step that comes to nothing, and a thing that is lost from the hand."""
        for at in self.rng.permutation(len(plan))[:6]:
            step, number = counted(plan, int(at))
            skill = self.domain.skill(step.skill)
            if not skill.drives:
                yield Candidate(
                    self.task.name,
                    "failed-action",
                    f"{named(step, number)} comes to nothing",
                    f"{named(step, number)} does nothing and reports success.",
                    (FailedAction(step=str(step), occurrence=number),),
                    since=int(at) + 1,
                )
            if skill.drives and self._carries(plan, int(at)):
                yield Candidate(
                    self.task.name,
                    "dropped",
                    f"Lost during {named(step, number)}",
                    f"What the robot holds slips from its hand during {named(step, number)}.",
                    (Drop(step=str(step), occurrence=number),),
                    since=int(at) + 1,
                )
