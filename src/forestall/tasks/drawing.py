"""Draws the further sets of scenarios from a seed, and keeps what playing each of them says.

Called by the command line (`forestall cases draw`), which writes the files that come with the
project; calls the composers, the erring planner, `variation` and `judging`. A start is drawn
without knowing whether it fails. It is played without a monitor in the rooms that it will have in
the development split and in one more; only where all of them agree does it get a place in a set.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from zlib import crc32

import numpy as np

from forestall.seams.acting import WorldPart
from forestall.tasks.composing import Candidate, counted, named
from forestall.tasks.faults import ReplacePlan, apply_plan_faults
from forestall.tasks.files import END, LoadedTask, Scenario
from forestall.tasks.judging import Label, Played, fixtures_in, label, play
from forestall.tasks.midrun_candidates import MidrunComposer
from forestall.tasks.plan_errors import ErringPlanner
from forestall.tasks.scene_candidates import SceneComposer
from forestall.tasks.scene_faults import AddObject
from forestall.tasks.variation import CHANCES, Variation, vary
from forestall.types.plan import Plan

SIZES = {
    "everyday": 22,
    "composed": 13,
    "midrun": 8,
    "double": 5,
    "planner": 12,
    "planner-harmless": 0,
    "long": 12,
}
"""How many starts each task gets in each set; harmless plan errors as many as were met."""

UNSEEN_SHARE = 0.4
"""At most this share of the everyday starts of a task is outside of what is compared."""

ONE_MORE_ROOM = 30_000
"""First seed of rooms in which starts are only chosen; no split has them."""

SLIPS = ("failed-action", "dropped")
KIND_ONES = ("helped", "moved")
UNKIND_ONES = ("put-away", "in-the-hand")
"""What nobody does to a robot at work, even where the goal is reached all the same."""

IN_THE_WAY = {"others-there": "occupied"}
"""What a kind is called where its start fails: other things there take the room."""

Rooms = Callable[[int], Sequence[int]]
"""Seeds of the rooms that the k-th start of a task in a set has."""


@dataclass
class Drawn:
    """What came of drawing: scenarios by set, and how often each kind got each label."""

    scenarios: dict[str, list[Scenario]] = field(default_factory=dict)
    labels: Counter[tuple[str, str, str]] = field(default_factory=Counter)


class Drawer:
    """Fills the sets of one task.

    Args:
        loaded: the task.
        world: makes the rooms in which starts are played.
        rooms: see `Rooms`.
        seed: of everything that is drawn.
    """

    def __init__(self, loaded: LoadedTask, world: WorldPart, rooms: Rooms, seed: int = 0) -> None:
        self.loaded, self.world, self.rooms = loaded, world, rooms
        self.drawn = Drawn()
        self._rng = np.random.default_rng([seed, crc32(loaded.task.name.encode())])
        self._fixtures = fixtures_in(world, loaded, ONE_MORE_ROOM)
        self._plain: dict[int, Played] = {}
        self._failing: list[Candidate] = []

    def sets(self, long: bool = False) -> Drawn:
        """Every set of the task; those of a long task go into one."""
        scene = SceneComposer(self.loaded, self._rng, self._fixtures).scene()
        midrun = self._midrun()
        if long:
            third = SIZES["long"] // 3
            for pool in (scene, midrun):
                done = len(self.drawn.scenarios.get("long", []))
                self.fill("long", pool, Label.FAILS, done + third)
            self.plans("long", len(self.drawn.scenarios["long"]) + third)
            return self.drawn
        self.fill("composed", scene, Label.FAILS, SIZES["composed"])
        self.fill("midrun", midrun, Label.FAILS, SIZES["midrun"])
        self.fill("double", self._pairs(), Label.FAILS, SIZES["double"])
        self.plans("planner", SIZES["planner"])
        again = [c for _ in range(3) for c in self._midrun() if c.kind in KIND_ONES]
        kind_ones = [c for c in midrun if c.kind not in (*SLIPS, *UNKIND_ONES)]
        pool = [*scene, *kind_ones, *again, *self._ways()]
        pool = [c for c in pool if c.kind not in self._accidents()]
        self.fill("everyday", pool, Label.SUCCEEDS, SIZES["everyday"])
        return self.drawn

    def fill(self, of: str, candidates: Iterable[Candidate], wanted: Label, count: int) -> None:
        """Give a set candidates that fail, or succeed, in all their rooms, of all kinds alike."""
        placed = self.drawn.scenarios.setdefault(of, [])
        waiting = _by_kind(candidates, self._rng)
        taken = Counter(s.kind for s in placed)
        while waiting and len(placed) < count:
            kind = min(waiting, key=lambda k: taken[k])
            candidate = waiting[kind].pop()
            if not waiting[kind]:
                del waiting[kind]
            found, scenario = self.judge(candidate, of, len(placed), wanted)
            self.drawn.labels[of, candidate.kind, found] += 1
            if found is not wanted or any(s.cause == scenario.cause for s in placed):
                continue
            unseen = sum(s.compared is False for s in placed)
            if of == "everyday" and not scenario.compared and unseen >= UNSEEN_SHARE * count:
                continue
            placed.append(scenario)
            taken[kind] += 1
            if wanted is Label.FAILS:
                self._failing.append(replace(candidate, kind=scenario.kind))

    def plans(self, of: str, count: int, tries: int = 80) -> None:
        """Erroneous plans as they come, so that their kinds keep their rates."""
        planner = ErringPlanner(self.loaded, self._rng, self._fixtures)
        placed = self.drawn.scenarios.setdefault(of, [])
        mild = self.drawn.scenarios.setdefault("planner-harmless", [])
        met: set[str] = set()
        for _ in range(tries):
            if len(placed) >= count:
                return
            candidate = planner.draw()
            if candidate is None or repr(candidate.faults) in met:
                continue
            met.add(repr(candidate.faults))
            found, scenario = self.judge(candidate, of, len(placed))
            self.drawn.labels[of, candidate.kind, found] += 1
            if found is Label.FAILS:
                placed.append(scenario)
            elif found is Label.SUCCEEDS and of == "planner":
                found, scenario = self.judge(candidate, "planner-harmless", len(mild))
                if found is Label.SUCCEEDS:
                    mild.append(scenario)

    def judge(
        self, candidate: Candidate, of: str, number: int, wanted: Label | None = None
    ) -> tuple[Label, Scenario]:
        """Play a candidate in the rooms of a place in a set; what it is then.

        Where it is not what is wanted, one room is enough to say so.
        """
        name = f"{of}-{candidate.task}-{number + 1}"
        scenario = Scenario(
            *(name, candidate.task, candidate.title, candidate.kind, candidate.cause),
            candidate.faults,
            of,
        )
        plain = self._undisturbed(self.rooms(number)[0])
        usual = plain.left
        plays: list[Played] = []
        so_far = Label.SUCCEEDS
        for seed in (*self.rooms(number), ONE_MORE_ROOM + number % 10):
            looking = not plays
            plays.append(
                play(
                    self.world,
                    self.loaded,
                    scenario,
                    seed,
                    looking,
                    candidate.watch,
                    candidate.since,
                    candidate.also,
                )
            )
            so_far = label(plays, usual)
            if so_far not in (Label.SUCCEEDS, Label.FAILS) or wanted not in (None, so_far):
                return so_far, scenario
        known = effect = None
        kind = candidate.kind
        if so_far is Label.FAILS:
            known, effect = moments(self._plan_of(candidate), plays)
            kind = IN_THE_WAY.get(kind, kind)
        compared = plays[0].seen != plain.seen
        told = Scenario(
            *(name, candidate.task, candidate.title, kind, candidate.cause),
            candidate.faults,
            of,
            known=known,
            effect=effect,
            compared=compared,
        )
        return so_far, told

    def _undisturbed(self, seed: int) -> Played:
        if seed not in self._plain:
            self._plain[seed] = play(self.world, self.loaded, None, seed, looking=True)
        return self._plain[seed]

    def _accidents(self) -> set[str]:
        """Kinds of states that nothing in the domain brings about: nobody means them to be."""
        domain = self.loaded.domain
        effects = [e for s in domain.skills.values() for e in s.effects]
        effects += [e for p in domain.processes for e in p.effects]
        changed = {f.predicate for e in effects for f in e.facts}
        return {f"state-{a}" for a in domain.attributes if a not in changed}

    def _plan_of(self, candidate: Candidate) -> Plan:
        return apply_plan_faults(self.loaded.task.plan, candidate.faults, self.loaded.domain)

    def _midrun(self) -> list[Candidate]:
        composer = MidrunComposer(self.loaded, self._rng, self._fixtures)
        return composer.midrun(self.loaded.task.plan)

    def _pairs(self) -> Iterator[Candidate]:
        """Two that fail each by itself, of different kinds."""
        pool = [c for c in self._failing if c.kind != "missing"]
        pairs = [(a, b) for k, a in enumerate(pool) for b in pool[k + 1 :] if a.kind != b.kind]
        for k in self._rng.permutation(len(pairs)):
            one, other = sorted(pairs[int(k)], key=lambda c: c.since)
            yield Candidate(
                one.task,
                f"{one.kind}+{other.kind}",
                f"{one.title}; {other.title}",
                f"{one.cause} {other.cause}",
                (*one.faults, *other.faults),
                one.since,
                one.watch,
                ((other.since, other.watch),),
            )

    def _ways(self) -> list[Candidate]:
        """Other valid ways to do the task, as plans of the robot's own."""
        found: list[Candidate] = []
        task = self.loaded.task
        for sort in CHANCES:
            for k in range(4) if sort != "slip" else ():
                seed = int(self._rng.integers(2**31)) + k
                way = vary(task, self.loaded.domain, seed, [sort], self._fixtures)
                if way.plan != task.plan:
                    found.append(_as_candidate(task.name, sort, way, self.loaded))
        return found


def moments(plan: Plan, plays: Sequence[Played]) -> tuple[str, str]:
    """`known` and `effect` of a failing start, as scenario files write them."""
    known = min(p.visible for p in plays)
    harms = [p.harmed for p in plays if p.harmed is not None]
    refusals = [at for p in plays for at, _ in p.refused if at >= known]
    return _text(plan, known), _text(plan, min([*harms, *refusals, len(plan)]))


def _by_kind(
    candidates: Iterable[Candidate], rng: np.random.Generator
) -> dict[str, list[Candidate]]:
    """Candidates in a random order by kind, the kinds in a random order, too."""
    pool = list(candidates)
    found: dict[str, list[Candidate]] = {}
    for k in rng.permutation(len(pool)):
        found.setdefault(pool[int(k)].kind, []).append(pool[int(k)])
    return found


def _as_candidate(task: str, sort: str, way: Variation, loaded: LoadedTask) -> Candidate:
    words = way.varied[0].partition(": ")[2]
    own = {o.id for o in loaded.task.scene.objects}
    added = [o for o in way.scene.objects if o.id not in own]
    faults = [AddObject(category=o.category, places=o.places) for o in added]
    plan = ReplacePlan(plan=tuple(way.plan.texts()))
    title = f"Another valid plan: {words}"
    cause = f"The robot's plan is another valid one: {words}."
    return Candidate(task, f"plan-{sort}", title, cause, (*faults, plan))


def _text(plan: Plan, at: int) -> str:
    """A step of a plan as `known` and `effect` name it."""
    if at >= len(plan):
        return END
    return named(*counted(plan, at))
