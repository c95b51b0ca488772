"""The world's edge: names of the simulator stop here, and what is meant is found by its place.

Wraps the environment of a run whose household shares no names (`OpenWorld.shares_names`). Outwards
pictures show kinds of things without an identity, and the hand says what it was told to take.
Inwards a name that perception gave means the thing of its category where perception believes it to
be. Faults and disturbances lie inside: they speak of true things. Built by `assembly`, which also
hands it to the trace of the truth; nothing of it comes back to the run.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from forestall.domain.model import Domain
from forestall.seams.acting import Environment
from forestall.seams.around import Around
from forestall.tasks.eyes import SharedEyes
from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.facts import category_of, is_instance
from forestall.types.graph import SceneGraph
from forestall.types.observation import Frame, GripperState, Observation, Vec3
from forestall.types.plan import Subtask

NEAR_M = 0.15
"""How far from where it is believed to be a thing may be found."""

NOBODY = 0
"""Number of the instance that is not there."""

_NAME = re.compile(r"\b[A-Z][A-Za-z]*-\d+\b")

Where = Mapping[str, Vec3 | None]


class NotThereError(Exception):
    """Nothing of a name's category is where the name points; its text is the reason."""


def named(plan: Iterable[Subtask]) -> tuple[str, ...]:
    """Every instance that a plan names: what whoever gave it must have pointed at."""
    return tuple(sorted({a for s in plan for a in s.args if is_instance(a)}))


def bare(frame: Frame) -> Frame:
    """A frame whose masks tell kinds of things; their order is that of this picture alone."""
    ids = frame.instance_ids
    if ids is None:
        return frame
    flat, count = ids.ravel(), len(frame.instance_names)
    first = np.full(count + 1, flat.size)
    first[flat[::-1]] = np.arange(flat.size)[::-1]  # of equal indices the last one counts
    there = np.flatnonzero(first[:count] < flat.size)
    order = there[np.argsort(first[there])]
    numbers = np.full(count + 1, -1, dtype=np.int32)
    numbers[order] = np.arange(len(order), dtype=np.int32)
    names = tuple(category_of(frame.instance_names[int(i)]) for i in order)
    return replace(frame, instance_ids=numbers[ids], instance_names=names)


class WorldsEdge(Around):
    """Implements `Environment` and `Unnamed`.

    Args:
        environment: with the faults of the run; speaks of true things.
        truth: the true graph, in which places are looked up.
        domain: of the run.
        told: instances that the plan names: the robot is shown where they are at the start.
    """

    def __init__(
        self,
        environment: Environment,
        truth: Callable[[], SceneGraph],
        domain: Domain,
        told: Sequence[str] = (),
    ) -> None:
        super().__init__(environment)
        self._look = truth
        self._domain = domain
        self._names = tuple(dict.fromkeys(domain.canonical(n) for n in told))
        self._forget()

    def _forget(self) -> None:
        self._told: dict[str, Vec3] | None = None
        self._called: dict[str, str] = {}  # true thing → what the newest commands called it
        self._hand: str | None = None
        self.newest: Subtask | None = None  # the newest command, in true names
        self._shown: dict[str, str] = {}  # true thing → its name in graphs that are given

    def reset(self, seed: int) -> None:
        """Reset the world; all names are forgotten."""
        self._forget()
        self._inner.reset(seed)

    def scan(self, thorough: bool = False) -> Observation:
        """As the wrapped environment, without names."""
        return self._seen(self._inner.scan(thorough))

    def observe(self, focus: Sequence[Vec3] = ()) -> Observation:
        """As the wrapped environment, without names."""
        return self._seen(self._inner.observe(focus))

    def approach(self, name: str) -> float:
        """Drive to a thing of a category, or to what was pointed at."""
        return self.approach_at(name, {})

    def execute(self, subtask: Subtask) -> SkillOutcome:
        """Run a skill on categories, or on what was pointed at."""
        return self.execute_at(subtask, {})

    def approach_at(self, name: str, where: Where) -> float:
        """See `Unnamed`."""
        try:
            return self._inner.approach(self._meant(name, where, self._true()))
        except NotThereError:
            return self._drive_near(name, where)

    def execute_at(self, subtask: Subtask, where: Where) -> SkillOutcome:
        """See `Unnamed`."""
        true = self._true()
        try:
            args = tuple(self._meant(a, where, true) for a in subtask.args)
        except NotThereError as error:
            drives = self._domain.drives(subtask)
            seconds = self._drive_near(subtask.args[-1], where) if drives else 0.0
            self.newest = self._truly(subtask, where, true)
            return SkillOutcome(SkillStatus.REFUSED, seconds, str(error))
        if self._hand is None:
            self._called = {}
        pairs = zip(args, subtask.args, strict=True)
        self._called |= {t: self._domain.canonical(n) for t, n in pairs if is_instance(t)}
        self.newest = Subtask(subtask.skill, args)
        outcome = self._inner.execute(self.newest)
        return replace(outcome, reason=_NAME.sub(self._spoken, outcome.reason))

    def truly(self, subtask: Subtask, graph: SceneGraph) -> Subtask:
        """What a subtask in perception's names would be done with now, for scoring alone.

        A name that points at nothing of its category becomes that of an instance that is not there.
        """
        return self._truly(subtask, graph.places(), self._true())

    def _truly(self, subtask: Subtask, where: Where, true: SceneGraph) -> Subtask:
        args = []
        for name in subtask.args:
            try:
                args.append(self._meant(name, where, true))
            except NotThereError:
                args.append(f"{category_of(self._domain.canonical(name))}-{NOBODY}")
        return Subtask(subtask.skill, tuple(args))

    # --- inwards --------------------------------------------------------------------------------

    def _true(self) -> SceneGraph:
        """What there is, as the robot behind the edge takes it."""
        graph = self._look()
        return self._inner.mistaken(graph) if isinstance(self._inner, SharedEyes) else graph

    def _meant(self, name: str, where: Where, true: SceneGraph) -> str:
        """The true thing behind a name, or a category.

        Raises:
            NotThereError: nothing of the category is where the name points, or it points nowhere.
        """
        known = self._domain.canonical(name)
        if not is_instance(known):
            return known
        if self._hand is not None and self._called.get(self._hand) == known:
            return self._hand
        category = category_of(known)
        place = self._place(name, where)
        if place is None:
            if name not in where:
                raise NotThereError(f"nothing here was ever called {name}")
            return category
        if self._domain.is_a(category, self._domain.roles.ground):
            return next((n.id for n in true.of_category(category)), category)
        found = true.nearest(category, place, NEAR_M)
        if found is None:
            raise NotThereError(f"nothing like {name} is there")
        return found

    def _place(self, name: str, where: Where) -> Vec3 | None:
        """Where a name points: where it is believed to be, else where somebody pointed."""
        if where.get(name) is not None:
            return where[name]
        return None if name in where else self._pointed().get(self._domain.canonical(name))

    def _drive_near(self, name: str, where: Where) -> float:
        """Drive to the furniture that is nearest to where a thing was believed to be."""
        place, roles = self._place(name, where), self._domain.roles
        if place is None:
            return 0.0
        fixed = [
            n
            for n in self._true().nodes
            if n.box_m is not None
            and self._domain.is_a(n.category, roles.fixture)
            and not self._domain.is_a(n.category, roles.ground)
        ]
        away = {n.id: n.box_m.away_m(place) for n in fixed if n.box_m is not None}
        return self._inner.approach(min(away, key=lambda n: (away[n], n))) if away else 0.0

    # --- outwards -------------------------------------------------------------------------------

    def _pointed(self) -> dict[str, Vec3]:
        """Where what the plan names is when the run begins."""
        if self._told is None:
            nodes = {n: self._look().get(n) for n in self._names}
            self._told = {
                n: node.box_m.centre
                for n, node in nodes.items()
                if node is not None and node.box_m is not None
            }
        return self._told

    def _seen(self, observation: Observation) -> Observation:
        told, gripper, graph = tuple(self._pointed().items()), observation.gripper, None
        self._hand = gripper.holding
        if observation.graph is not None:
            graph = self._renamed(observation.graph)
        return replace(
            observation,
            frames=tuple(map(bare, observation.frames)),
            gripper=self._felt(gripper),
            others=tuple(map(self._felt, observation.others)),
            graph=graph,
            told=told,
        )

    def _felt(self, hand: GripperState) -> GripperState:
        """A hand that knows what it was told to take, and else of which kind it is."""
        return replace(hand, holding=self._call(hand.holding), released=self._call(hand.released))

    def _call(self, true: str | None) -> str | None:
        if true is None:
            return None
        name = self._called.get(true, category_of(true))
        return name if is_instance(name) else self._shown.get(true, name)

    def _spoken(self, match: re.Match[str]) -> str:
        """A true name in what the robot says: what it was called, or its kind."""
        true = match[0]
        called = self._called.get(true, "")
        return called if is_instance(called) else category_of(true)

    def _renamed(self, graph: SceneGraph) -> SceneGraph:
        """A graph of a world that tracks what it shows, in names that are not its own."""
        fresh = [n for n in graph.nodes if n.id not in self._shown and is_instance(n.id)]
        for node in sorted(fresh, key=lambda n: (n.centroid_m or (), n.id)):
            used = {*self._shown.values(), *self._pointed()}
            number = 1
            while f"{node.category}-{number}" in used:
                number += 1
            given = node.id if node.id in self._pointed() else f"{node.category}-{number}"
            self._shown[node.id] = given
        return renamed(graph, self._shown)


def renamed(graph: SceneGraph, names: Mapping[str, str]) -> SceneGraph:
    """A graph in which things bear other names."""
    return replace(
        graph,
        nodes=tuple(replace(n, id=names.get(n.id, n.id)) for n in graph.nodes),
        relations=tuple(
            replace(
                r, subject=names.get(r.subject, r.subject), object=names.get(r.object, r.object)
            )
            for r in graph.relations
        ),
        hidden=tuple(names.get(h, h) for h in graph.hidden),
    )
