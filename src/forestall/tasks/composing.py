"""What takes part in a task, and how it is said: what differences of a start are composed of.

Called by `scene_candidates` and `midrun_candidates`; calls the domain. Everything follows from the
task's plan and scene and from the domain's tags, roles and static facts.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from forestall.domain.formula import literals
from forestall.tasks.faults import Fault
from forestall.tasks.files import LoadedTask
from forestall.tasks.scene_faults import SetState
from forestall.types.facts import category_of, is_instance
from forestall.types.plan import Plan, Subtask

FILLERS = 3
"""How many categories are drawn for "another thing" in one role."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A start that may or may not fail.

    Args:
        task: its task.
        kind: what sort of difference it is.
        title: in a few words.
        cause: what is different, in a sentence.
        faults: the difference.
        since: before which step of the plan (from 0) it is there to be known.
        watch: what must be in view for that: ("thing", name), or ("inside", container) for what is
            missing there; () where it shows by itself.
        also: `since` and `watch` of what else is different; what shows first counts.
    """

    task: str
    kind: str
    title: str
    cause: str
    faults: tuple[Fault, ...]
    since: int = 0
    watch: tuple[str, ...] = ()
    also: tuple[tuple[int, tuple[str, ...]], ...] = ()


class Composed:
    """What takes part in one task.

    Args:
        loaded: the task.
        rng: draws other things, places and moments.
        fixtures: categories that the room is known to have.
    """

    def __init__(
        self, loaded: LoadedTask, rng: np.random.Generator, fixtures: Iterable[str] = ()
    ) -> None:
        self.task, self.domain, self.rng = loaded.task, loaded.domain, rng
        domain = self.domain
        made = {m for c in domain.categories for m in domain.becomes(c)}
        own = {o.category for o in self.task.scene.objects} | made
        self.others = [c for c in domain.tagged(domain.roles.movable) if c not in own]
        named = {a for s in self.task.plan for a in s.args}
        self.fixtures = sorted(
            {n if is_instance(n) else f"{domain[n].name}-1" for n in named if self._is_fixture(n)}
        )
        self.room = sorted({category_of(f) for f in self.fixtures} | set(fixtures))

    # --- what there is ---------------------------------------------------------------------------

    def _is_fixture(self, name: str) -> bool:
        return self.domain.is_a(name, self.domain.roles.fixture)

    def meant(self, name: str) -> str:
        """The instance that a name of the plan means at the start."""
        own = [o.id for o in self.task.scene.objects if name in (o.id, o.category)]
        return own[0] if own else name if is_instance(name) else f"{self.domain[name].name}-1"

    def targets(self) -> list[str]:
        """Where the plan puts things: things of the task by their own names."""
        found = []
        for step in self.task.plan:
            if self.domain.skill(step.skill).hand is None or len(step.args) < 2:
                continue
            found.append(self.meant(step.args[-1]))
        return [n for n in dict.fromkeys(found) if self.domain.offers(n) is not None]

    def changes(self) -> list[tuple[str, str, str]]:
        """(Thing, attribute, value) other than at the start, of the task's things and fixtures."""
        found = [
            (o.id, a, v)
            for o in self.task.scene.objects
            for a, v in self.other_states(o.category, dict(o.states))
        ]
        set_by = {(f, a): v for f, a, v in self.task.scene.fixtures}
        for name in self.fixtures:
            started = {a: v for (f, a), v in set_by.items() if f == name}
            found += [(name, a, v) for a, v in self.other_states(category_of(name), started)]
        return found

    def other_states(self, category: str, started: dict[str, str]) -> list[tuple[str, str]]:
        """Values other than at the start that can be seen; not those of what it is made into."""
        domain = self.domain
        start = domain.default_states(category) | started
        made = [domain.default_states(m) for m in domain.becomes(category)]
        return [
            (a, v)
            for a in domain[category].attributes
            for v in domain.values(a)
            if v != start[a]
            and domain.attributes[a].camera
            and not any(m.get(a) == v for m in made)
        ]

    def opened(self, name: str) -> SetState | None:
        """What opens a container, as its skill that undoes being shut says."""
        domain, shut = self.domain, self.domain.roles.shut
        definition = None if shut is None else domain.predicates[shut].definition
        for state, _ in () if definition is None else literals(definition):
            if state.predicate not in domain[name].attributes:
                continue
            for skill in domain.skills.values():
                ended, made = skill.undoes, [f for e in skill.effects for f in e.facts]
                if ended is not None and (ended.predicate, ended.value) == (
                    state.predicate,
                    state.value,
                ):
                    return SetState(object=name, attribute=ended.predicate, value=made[0].value)
        return None

    def drawn(self, place: str | None) -> list[str]:
        """Other categories that a place takes."""
        fits = [c for c in self.others if place is None or self.domain.accepts(place, c)]
        return [fits[int(k)] for k in self.rng.permutation(len(fits))[:FILLERS]]

    # --- words -----------------------------------------------------------------------------------

    def words(self, name: str) -> str:
        """How a person calls a thing."""
        return self.domain[name].spoken

    def the(self, name: str) -> str:
        """The thing in a sentence; by its name where only numbers tell it apart."""
        if self.domain.is_a(name, self.domain.roles.numbered):
            return name
        return f"the {self.words(name)}"

    def one(self, name: str) -> str:
        """How a person counts a thing: loaves of bread, heads of lettuce."""
        words = self.words(name)
        counted = [s for s in self.domain[name].synonyms if s.endswith(f" of {words}")]
        return counted[0] if counted else words

    def a(self, name: str) -> str:
        """A thing of a category in a sentence."""
        words = self.one(name)
        return f"{'an' if words[0].lower() in 'aeiou' else 'a'} {words}"

    def at(self, place: str) -> str:
        """In or on a place."""
        relation = self.domain.offers(place) or "at"
        return f"{relation.split('_')[0]} {self.the(place)}"

    def to(self, place: str) -> str:
        """Into or onto a place."""
        return self.at(place).replace("inside", "into", 1).replace("on ", "onto ", 1)


def begun(text: str) -> str:
    """A text with a capital letter in front."""
    return text[:1].upper() + text[1:]


def counted(plan: Plan, at: int) -> tuple[Subtask, int]:
    """A step, and which of its equals it is."""
    step = plan.subtasks[at]
    return step, sum(s == step for s in plan.subtasks[: at + 1])


def named(step: Subtask, number: int) -> str:
    """A step in a text, with which of its equals it is where it is not the first."""
    return str(step) if number == 1 else f"{step} #{number}"
