"""What may be different about a scene before a run: composed over any task and domain.

Called by `drawing`, which plays each and keeps what it says; calls `composing`. Which of it does
harm nobody says beforehand.
"""

from __future__ import annotations

from collections.abc import Iterator

from forestall.tasks.composing import Candidate, Composed, begun
from forestall.tasks.scene_faults import AddObject, MoveObject, RemoveObject, SetState
from forestall.types.facts import category_of


class SceneComposer(Composed):
    """Draws what is different about a scene."""

    def scene(self) -> list[Candidate]:
        """Every sort of difference of the scene that the robot finds."""
        found = [*self._occupied(), *self._states(), *self._away(), *self._blocked()]
        return [*found, *self._twins(), *self._beside()]

    def _occupied(self) -> Iterator[Candidate]:
        """Another thing where the plan puts things, or in or on a thing of the task."""
        targets = [*self.targets(), *(o.id for o in self.task.scene.objects)]
        for place in dict.fromkeys(targets):
            if self.domain.offers(place) is None:
                continue
            limited = self.domain.is_a(place, self.domain.roles.vacatable)
            for other in self.drawn(place):
                yield Candidate(
                    self.task.name,
                    "occupied" if limited else "others-there",
                    begun(f"{self.a(other)} {self.at(place)}"),
                    begun(f"{self.a(other)} is {self.at(place)} from the start."),
                    (AddObject(category=other, places=(place,)),),
                    watch=("thing", f"{other}-1"),
                )

    def _states(self) -> Iterator[Candidate]:
        """Another start state of a thing of the task, or of a fixture that the plan names."""
        for name, attribute, value in self.changes():
            yield Candidate(
                self.task.name,
                f"state-{attribute}",
                begun(f"{self.the(name)} {self.domain.say(attribute, value)}"),
                begun(f"{self.the(name)} is {self.domain.say(attribute, value)} from the start."),
                (SetState(object=name, attribute=attribute, value=value),),
                watch=("thing", name),
            )

    def _away(self) -> Iterator[Candidate]:
        """A thing of the task is nowhere, shut away, in something open, or elsewhere."""
        domain = self.domain
        for need in self.task.scene.objects:
            usual = [p for p in need.places if domain.encloses(p)]
            watch = ("inside", f"{domain[usual[0]].name}-1") if usual else ()
            if domain.is_a(need.category, domain.roles.movable):
                yield Candidate(
                    self.task.name,
                    "missing",
                    f"No {self.words(need.id)}",
                    f"There is no {self.words(need.id)} anywhere.",
                    (RemoveObject(object=need.id),),
                    watch=watch,
                )
            for place in self.room:
                avoided = any(domain.is_a(place, tag) for tag in domain.roles.avoid)
                if avoided or place in need.places or not domain.accepts(place, need.category):
                    continue
                move = MoveObject(object=need.id, places=(place,))
                where = f"{self.the(need.id)} {self.at(place)}"
                if not domain.encloses(place):
                    if domain.is_a(place, domain.roles.numbered):
                        continue
                    yield Candidate(
                        self.task.name,
                        "elsewhere",
                        begun(where),
                        begun(f"{self.the(need.id)} is {self.at(place)}, not where it usually is."),
                        (move,),
                        watch=("thing", need.id),
                    )
                    continue
                told = f"{self.the(need.id)} is {self.at(place)}, which is"
                yield Candidate(
                    self.task.name,
                    "put-away",
                    begun(f"{where}, shut"),
                    begun(f"{told} shut."),
                    (move,),
                    watch=watch,
                )
                opened = self.opened(f"{place}-1")
                if opened is not None:
                    yield Candidate(
                        self.task.name,
                        "put-away-open",
                        begun(f"{where}, open"),
                        begun(f"{told} open."),
                        (MoveObject(object=need.id, places=(f"{place}-1",)), opened),
                        watch=("thing", need.id),
                    )

    def _blocked(self) -> Iterator[Candidate]:
        """Another thing in front of a thing of the task."""
        if self.domain.roles.blocking is None:
            return
        for need in self.task.scene.objects:
            if not self.domain.is_a(need.category, self.domain.roles.movable):
                continue
            for other in self.drawn(need.places[0] if need.places else None):
                front = f"{self.a(other)} in front of {self.the(need.id)}"
                yield Candidate(
                    self.task.name,
                    "in-front",
                    begun(front),
                    begun(f"{self.a(other)} is in front of {self.the(need.id)}."),
                    (AddObject(category=other, in_front_of=need.id),),
                    watch=("thing", f"{other}-1"),
                )

    def _twins(self) -> Iterator[Candidate]:
        """A second thing of the task's kind, like the first or in another state."""
        domain = self.domain
        for need in self.task.scene.objects:
            places = need.places if not any(map(domain.encloses, need.places)) else ()
            for attribute, value in [
                ("", ""),
                *self.other_states(need.category, dict(need.states)),
            ]:
                states = {attribute: value} if attribute else {}
                like = f", {domain.say(attribute, value)}" if attribute else ""
                first = "the first is as usual" if attribute else "the robot may take either"
                yield Candidate(
                    self.task.name,
                    "second-other" if attribute else "second",
                    f"A second {self.one(need.id)}{like}",
                    f"There is a second {self.one(need.id)}{like}; {first}.",
                    (AddObject(category=need.category, places=places, states=states),),
                    watch=("thing", f"{need.category}-2"),
                )

    def _beside(self) -> Iterator[Candidate]:
        """Something that the task does not need, in another state or on a neighbour."""
        domain = self.domain
        for other in self.drawn(None):
            for attribute, value in self.other_states(other, {})[:1]:
                says = f"{self.a(other)}, {domain.say(attribute, value)}"
                yield Candidate(
                    self.task.name,
                    "beside",
                    begun(f"{says}, elsewhere"),
                    begun(f"{says}, is somewhere in the room; the task does not need it."),
                    (AddObject(category=other, states={attribute: value}),),
                    watch=("thing", f"{other}-1"),
                )
        for name in self.fixtures:
            if not domain.is_a(name, domain.roles.numbered) or domain.offers(name) is None:
                continue
            for number in (1, 2, 3, 4):
                near = f"{category_of(name)}-{number}"
                if near == name:
                    continue
                for other in self.drawn(near)[:1]:
                    yield Candidate(
                        self.task.name,
                        "neighbour",
                        begun(f"{self.a(other)} {self.at(near)}"),
                        begun(f"{self.a(other)} is {self.at(near)}, beside {name}."),
                        (AddObject(category=other, places=(near,)),),
                        watch=("thing", f"{other}-1"),
                    )
