"""Demonstrations like people's: other valid ways to do a task, drawn from a seed.

Called by the recording of demonstrations and by `drawing`; calls the validator on symbolic start
scenes. A variant differs from the nominal plan in the order of steps, in the places and tools that
it uses, in detours that undo themselves, and in slips that are mended at once. Every change is kept
only where the validator accepts the whole plan wherever the scene's things may stand.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from zlib import crc32

import numpy as np

from forestall.domain.model import Domain
from forestall.domain.schema import Skill
from forestall.errors import InputError
from forestall.planning.validate import GraphValidator, observed, run
from forestall.tasks.execution_faults import takes_up
from forestall.tasks.faults import FailedAction, Fault
from forestall.tasks.files import LoadedTask, load_task, long_task_names, task_names
from forestall.testing.symbolic_scene import start_scene
from forestall.types.facts import Literal, category_of, is_instance
from forestall.types.graph import SceneGraph
from forestall.types.plan import Plan, Subtask
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.types.task import Task

MOST = 32
"""How many demonstrations of a task are asked for at most."""

STARTS = 3
"""Symbolic start scenes in which a variant must reach the goal."""

TRIES = 40

CHANCES = {"order": 0.6, "place": 0.5, "substitute": 0.35, "detour": 0.35, "slip": 0.2}
"""How often a variant has each sort of difference (our choice: most demonstrations have one)."""

Steps = tuple[Subtask, ...]


@dataclass(frozen=True, slots=True)
class Variation:
    """One way to do a task.

    Args:
        plan: what is done, slips and their mending included.
        scene: what it needs; the task's own, and what another tool adds.
        slips: execution faults of a recording: what goes wrong once and is done again.
        varied: what differs from the nominal plan, in words; () for the nominal plan.
    """

    plan: Plan
    scene: SceneNeeds
    slips: tuple[Fault, ...] = ()
    varied: tuple[str, ...] = ()


def variations(
    task: Task, domain: Domain, count: int, seed: int = 0, fixtures: Collection[str] = ()
) -> tuple[Variation, ...]:
    """The nominal plan and other ways to do a task, different ones as far as they are found.

    Args:
        task: see `vary`, as `domain` and `fixtures`.
        domain: of the task.
        count: how many; equal ones among them only where a task has hardly another way.
        seed: of the first.
        fixtures: what the room has.

    Raises:
        InputError: not 1 to `MOST`.
    """
    if not 1 <= count <= MOST:
        raise InputError(f"{count} variants of a plan: 1 to {MOST} are possible")
    found = {task.plan.subtasks: Variation(task.plan, task.scene)}
    drawn: list[Variation] = []
    while len(found) < count and len(drawn) < 4 * count:
        drawn.append(vary(task, domain, seed + len(drawn), fixtures=fixtures))
        found.setdefault(drawn[-1].plan.subtasks, drawn[-1])
    return (*found.values(), *drawn)[:count]


def vary(
    task: Task,
    domain: Domain,
    seed: int,
    only: Sequence[str] = (),
    fixtures: Collection[str] = (),
) -> Variation:
    """A seeded variant of a task's nominal plan that still reaches the goal strictly.

    Args:
        task: whose plan is varied.
        domain: of the task.
        seed: the same seed gives the same variant.
        only: sorts of difference (keys of `CHANCES`), each tried; drawn by chance if empty.
        fixtures: categories that the room is known to have beside those that the task names.
    """
    rng = np.random.default_rng([seed, crc32(task.name.encode())])
    sorts = only or [sort for sort, chance in CHANCES.items() if rng.random() < chance]
    varying = _Varying(task, domain, rng, fixtures)
    for sort in CHANCES:
        if sort in sorts:
            varying.change(sort)
    return varying.result()


class _Varying:
    """A plan on its way to a variant."""

    def __init__(
        self, task: Task, domain: Domain, rng: np.random.Generator, fixtures: Collection[str]
    ) -> None:
        self.task, self.domain, self.rng = task, domain, rng
        self.there = fixtures_of(task, domain) | set(fixtures)
        self.steps: Steps = task.plan.subtasks
        self.scene = task.scene
        self.slips: tuple[Fault, ...] = ()
        self.varied: list[str] = []
        self._validator = GraphValidator(domain)
        self._starts: dict[SceneNeeds, list[SceneGraph]] = {}

    def change(self, sort: str) -> None:
        """Make one sort of difference, if one is found that works."""
        ways: dict[str, Callable[[], Iterator[tuple[Steps, SceneNeeds, str]]]] = {
            "order": self._orders,
            "place": self._places,
            "substitute": self._tools,
            "detour": self._detours,
        }
        if sort == "slip":
            self._slip()
            return
        for steps, scene, words in ways[sort]():
            if steps != self.steps and self.works(steps, scene):
                self.steps, self.scene = steps, scene
                self.varied.append(f"{sort}: {words}")
                return

    def works(self, steps: Steps, scene: SceneNeeds) -> bool:
        """Whether a plan reaches the goal from every start."""
        plan = Plan(steps, self.task.plan.goal)
        try:
            starts = self._starts_of(scene)
        except InputError:
            return False
        return all(self._validator.check(plan, s, self.task.goal).ok for s in starts)

    def result(self) -> Variation:
        """What has come of it."""
        plan = Plan(self.steps, self.task.plan.goal)
        return Variation(plan, self.scene, self.slips, tuple(self.varied))

    def _starts_of(self, scene: SceneNeeds) -> list[SceneGraph]:
        if scene not in self._starts:
            bare = replace(scene, clutter=(0, 0))
            self._starts[scene] = [start_scene(self.domain, bare, k) for k in range(STARTS)]
        return self._starts[scene]

    # --- the order of steps ----------------------------------------------------------------------

    def _orders(self) -> Iterator[tuple[Steps, SceneNeeds, str]]:
        """Errands (from empty hand to empty hand) or single steps, moved."""
        for _ in range(TRIES):
            parts = self._errands() if self.rng.random() < 0.5 else self._acts(self.steps)
            if len(parts) < 2:
                continue
            source, target = (int(i) for i in self.rng.integers(len(parts), size=2))
            moved = parts[source]
            rest = [p for k, p in enumerate(parts) if k != source]
            rest.insert(target, moved)
            way = "earlier" if target < source else "later"
            words = f"{moved[-1]} {way}" if len(moved) < 4 else f"{moved[0]} to {moved[-1]} {way}"
            yield tuple(s for p in rest for s in p), self.scene, words

    def _errands(self) -> list[Steps]:
        trace = run(observed(self._starts_of(self.scene)[0], self.domain), self.steps)
        parts: list[Steps] = []
        begun = 0
        for k in range(len(trace.states) - 1):
            drives = self.domain.drives(self.steps[k])
            if trace.states[k + 1].held is None and not drives:
                parts.append(self.steps[begun : k + 1])
                begun = k + 1
        return [*parts, self.steps[begun:]] if begun < len(self.steps) else parts

    def _acts(self, steps: Steps) -> list[Steps]:
        """Every step with the drives before it."""
        parts: list[Steps] = []
        drives: Steps = ()
        for step in steps:
            if self.domain.drives(step):
                drives = (*drives, step)
            else:
                parts.append((*drives, step))
                drives = ()
        return [*parts, drives] if drives else parts

    # --- other places and tools ------------------------------------------------------------------

    def _places(self) -> Iterator[tuple[Steps, SceneNeeds, str]]:
        """Another of things that only numbers tell apart, or another place to put a thing down."""
        domain = self.domain
        options: list[tuple[Steps, str]] = []
        for name in sorted({a for s in self.steps for a in s.args}):
            if is_instance(name) and domain.is_a(name, domain.roles.numbered):
                for number in range(1, 5):
                    other = f"{category_of(name)}-{number}"
                    options.append((_renamed(self.steps, name, other), f"{other}, not {name}"))
        avoided = {c for tag in domain.roles.avoid for c in domain.tagged(tag)}
        supports = [c for tag in domain.roles.rest for c in domain.tagged(tag)]
        supports = [c for c in supports if c in self.there and c not in avoided]
        for k, step in enumerate(self.steps):
            if domain.skill(step.skill).hand is None or len(step.args) < 2:
                continue
            for other in dict.fromkeys(supports):
                if domain.accepts(other, step.args[0]):
                    steps = _put_elsewhere(self.steps, k, other)
                    options.append((steps, f"{step.args[0]} put down on {other}"))
        for k in self.rng.permutation(len(options)):
            steps, words = options[int(k)]
            yield steps, self.scene, words

    def _tools(self) -> Iterator[tuple[Steps, SceneNeeds, str]]:
        """Another category in the role of a thing of the task, where the goal allows it."""
        domain, scene = self.domain, self.scene
        taken = {o.category for o in scene.objects}
        others = [c for c in domain.tagged(domain.roles.movable) if c not in taken]
        options = [(o, c) for o in scene.objects for c in others]
        for k in self.rng.permutation(len(options)):
            need, other = options[int(k)]
            places = tuple(p for p in need.places if domain.accepts(p, other))
            if need.places and not places:
                continue
            tool = ObjectNeed(f"{other}-1", other, places)
            steps = _renamed(_renamed(self.steps, need.category, other), need.id, tool.id)
            with_it = replace(scene, objects=(*scene.objects, tool))
            yield steps, with_it, f"{other} instead of {need.category}"

    # --- detours and slips -----------------------------------------------------------------------

    def _detours(self) -> Iterator[tuple[Steps, SceneNeeds, str]]:
        """Something is begun and undone, or somewhere is gone to and nothing done."""
        domain = self.domain
        used = {category_of(a) for s in self.steps for a in s.args}
        nodes = [n for n in self._starts_of(self.scene)[0].nodes if n.category in self.there]
        drive = domain.driving()
        options: list[tuple[Steps, str]] = []
        for node in nodes:
            way = () if drive is None else (Subtask(drive.name, (node.id,)),)
            if way:
                options.append((way, f"goes to {node.id} for nothing"))
            for there, back in _pairs(domain) if node.category not in used else ():
                ended = there.undoes
                if ended is None or node.state(ended.predicate) == ended.value:
                    steps = (*way, Subtask(there.name, (node.id,)), Subtask(back.name, (node.id,)))
                    options.append((steps, f"{steps[-2]} and back"))
        before = [k for k, s in enumerate(self.steps) if domain.drives(s)] or [0]
        for k in self.rng.permutation(len(options)):
            steps, words = options[int(k)]
            at = before[int(self.rng.integers(len(before)))]
            yield (*self.steps[:at], *steps, *self.steps[at:]), self.scene, words

    def _slip(self) -> None:
        """A grasp that came to nothing and is done again."""
        takes = [k for k, s in enumerate(self.steps) if takes_up(self.domain, s)]
        if not takes:
            return
        at = takes[int(self.rng.integers(len(takes)))]
        step = self.steps[at]
        earlier = sum(s == step for s in self.steps[:at])
        self.slips = (FailedAction(step=str(step), occurrence=earlier + 1),)
        self.steps = (*self.steps[: at + 1], step, *self.steps[at + 1 :])
        self.varied.append(f"slip: {step} failed and was done again")


def fixtures_of(task: Task, domain: Domain) -> set[str]:
    """Categories of fixtures that a task's plan, goal and scene name."""
    named = {a for s in task.plan for a in s.args} | {
        p for o in task.scene.objects for p in o.places
    }
    named |= {a for x in task.goal.literals for a in x.args if not a.startswith("?")}
    categories = {category_of(domain.canonical(n)) for n in named}
    return {c for c in categories if domain.is_a(c, domain.roles.fixture)}


def room_fixtures(loaded: LoadedTask) -> set[str]:
    """Categories of fixtures that shipped tasks of the same domain name in the same room."""
    found: set[str] = set()
    for name in (*task_names(loaded.domain.name), *long_task_names(loaded.domain.name)):
        other = load_task(name)
        if other.task.scene.room == loaded.task.scene.room:
            found |= fixtures_of(other.task, other.domain)
    return found


def _pairs(domain: Domain) -> list[tuple[Skill, Skill]]:
    """Skills of one thing with the skill that undoes what they do."""
    found = []
    for there in domain.skills.values():
        made = {_shape(f) for e in there.effects for f in e.facts}
        found += [
            (there, back)
            for back in domain.skills.values()
            if back.undoes is not None
            and _shape(back.undoes) in made
            and len(there.parameters) == len(back.parameters) == 1
        ]
    return found


def _shape(fact: Literal) -> tuple[str, str]:
    return fact.predicate, fact.value


def _renamed(steps: Steps, old: str, new: str) -> Steps:
    """Steps with one thing in the place of another."""
    return tuple(Subtask(s.skill, tuple(new if a == old else a for a in s.args)) for s in steps)


def _put_elsewhere(steps: Steps, at: int, place: str) -> Steps:
    """Steps of which one puts its thing elsewhere, after having driven there."""
    step = steps[at]
    made = list(steps)
    made[at] = Subtask(step.skill, (*step.args[:-1], place))
    if at and len(steps[at - 1].args) == 1 and steps[at - 1].args == step.args[-1:]:
        made[at - 1] = Subtask(steps[at - 1].skill, (place,))
    return tuple(made)
