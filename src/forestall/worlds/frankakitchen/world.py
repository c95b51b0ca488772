"""FrankaKitchen as a world (implements `Environment`, `OracleView`, `Disturbance`).

Called by the loop through `part`; calls `mechanism`. There are no pictures: an observation is a
scene graph of the fixtures, their states read off their joints, as an encoder would tell them. Its
skills and their refusals are its own; the domain file is judged by them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from forestall.errors import SceneError
from forestall.types.episode import Event, SkillOutcome, SkillStatus
from forestall.types.facts import Literal, category_of
from forestall.types.graph import Box, ObjectNode, SceneGraph
from forestall.types.observation import GripperState, Observation, Vec3
from forestall.types.plan import Subtask
from forestall.types.scene import SceneNeeds
from forestall.worlds.frankakitchen.fixtures import FIXTURES, SKILLS, Fixture
from forestall.worlds.frankakitchen.mechanism import Mechanism

HOLDS = "the robot was told to hold"
LOOK_S = 0.2
NEAR_M = 0.15
"""How far from a handle the hand may be to move it."""

KETTLE, KETTLE_BODY = "Kettle-1", "kettleroot"
_SWAY_RAD = 0.02
_HALF_M = 0.05


class FrankaKitchen:
    """One kitchen.

    Args:
        file: of the model.
        needs: states in which fixtures begin; nothing else of it is known here.

    Raises:
        SceneError: something is needed that is not in this kitchen.
    """

    def __init__(self, file: Path, needs: SceneNeeds) -> None:
        self._start = {f: 0.0 for f in FIXTURES}
        for name, attribute, value in needs.fixtures:
            for fixture in self._meant(name):
                if attribute != fixture.attribute or value not in (fixture.rest, fixture.moved):
                    raise SceneError(f"{fixture.name} has no state {attribute}={value}")
                self._start[fixture] = fixture.position(value)
        if needs.objects:
            names = ", ".join(o.id for o in needs.objects)
            raise SceneError(f"{names}: FrankaKitchen has its own things, and no more")
        self._mechanism = Mechanism(file)
        self.reset(0)

    # --- Environment -----------------------------------------------------------------------------

    def reset(self, seed: int) -> None:
        """The start of a seed: by it the arm is a little off its place."""
        rng = np.random.default_rng(seed)
        self._mechanism.reset(self._start, rng.uniform(-_SWAY_RAD, _SWAY_RAD, 7))
        self._holding = False
        self._events: list[Event] = []

    @property
    def time_s(self) -> float:
        """Simulated time since reset."""
        return self._mechanism.time_s

    def scan(self, thorough: bool = False) -> Observation:
        """All of the kitchen."""
        return self.observe()

    def observe(self, focus: Sequence[Vec3] = ()) -> Observation:
        """All of the kitchen, wherever the robot looks."""
        if not self._holding:
            self._mechanism.wait(LOOK_S)
        hand = GripperState(None, self._mechanism.hand_world_m)
        return Observation((), hand, self.time_s, graph=self.truth())

    def approach(self, name: str) -> float:
        """The robot stands where it is and reaches everything."""
        return 0.0

    def execute(self, subtask: Subtask) -> SkillOutcome:
        """Move one fixture; refuse with a reason where that cannot be."""
        started = self.time_s
        if self._holding:
            return SkillOutcome(SkillStatus.REFUSED, 0.0, HOLDS)
        if subtask.skill not in SKILLS or len(subtask.args) != 1:
            return SkillOutcome(SkillStatus.REFUSED, 0.0, f"there is no skill {subtask} here")
        attribute, value, categories = SKILLS[subtask.skill]
        found = self._meant(subtask.args[0], empty=True)
        if not found or category_of(found[0].name) not in categories:
            why = f"{subtask.args[0] or 'nothing'} is nothing that {subtask.skill} moves"
            return SkillOutcome(SkillStatus.REFUSED, 0.0, why)
        fixture = found[0]
        if self._value(fixture) == value:
            return SkillOutcome(SkillStatus.REFUSED, 0.0, f"{fixture.name} is {value} already")
        off_m = self._mechanism.reach(fixture)
        if off_m <= NEAR_M:
            self._mechanism.move(fixture, fixture.position(value))
        passed = self.time_s - started
        if off_m > NEAR_M:
            why = f"the hand came no nearer to {fixture.name} than {off_m:.2f} m"
            return SkillOutcome(SkillStatus.FAILED, passed, why)
        if self._value(fixture) != value:
            stands = self._mechanism.position(fixture)
            why = f"{fixture.name} did not come to {value}: its joint stands at {stands:.2f}"
            return SkillOutcome(SkillStatus.FAILED, passed, why)
        self._note(fixture, attribute, value)
        return SkillOutcome(SkillStatus.SUCCEEDED, passed)

    def hold(self) -> None:
        """Nothing moves again before `reset`."""
        self._holding = True

    def close(self) -> None:
        """Nothing is held that must be freed."""

    # --- OracleView ------------------------------------------------------------------------------

    def truth(self) -> SceneGraph:
        """Every fixture and the kettle."""
        places = {f.name: self._mechanism.place(f) for f in FIXTURES}
        places[KETTLE] = self._mechanism.body(KETTLE_BODY)
        return SceneGraph(tuple(self._node(n, p, self.states(n)) for n, p in places.items()))

    def states(self, instance: str) -> Mapping[str, str]:
        """The state of a fixture, by its joint; none where it is in between."""
        found = [f for f in FIXTURES if f.name == instance]
        return {f.attribute: v for f in found if (v := self._value(f)) is not None}

    def history(self) -> frozenset[Literal]:
        """Nothing here cannot be undone."""
        return frozenset()

    def events(self) -> tuple[Event, ...]:
        """What has been moved since reset, in order."""
        return tuple(self._events)

    # --- Disturbance -----------------------------------------------------------------------------

    def drop_held(self, hard: bool = False) -> str | None:
        """Nothing is ever held."""
        return None

    def rearrange(self, thing: str, place: str) -> bool:
        """Nobody carries anything here."""
        return False

    def alter(self, thing: str, attribute: str, value: str) -> bool:
        """Somebody moves a fixture."""
        for fixture in self._meant(thing, empty=True)[:1]:
            known = attribute == fixture.attribute and value in (fixture.rest, fixture.moved)
            if known and self._value(fixture) != value:
                self._mechanism.set(fixture, fixture.position(value))
                self._note(fixture, attribute, value)
                return True
        return False

    # --- inside ----------------------------------------------------------------------------------

    def _meant(self, name: str, empty: bool = False) -> list[Fixture]:
        found = [f for f in FIXTURES if name in (f.name, category_of(f.name))]
        if not found and not empty:
            raise SceneError(f"{name} is not in FrankaKitchen")
        return found

    def _value(self, fixture: Fixture) -> str | None:
        return fixture.value(self._mechanism.position(fixture))

    def _note(self, fixture: Fixture, attribute: str, value: str) -> None:
        text = str(Literal(attribute, (fixture.name,), value))
        self._events.append(Event(self.time_s, "state", (fixture.name,), text))

    def _node(self, name: str, place: Vec3, states: Mapping[str, str]) -> ObjectNode:
        x, y, z = place
        box = Box((x - _HALF_M, y - _HALF_M, z - _HALF_M), (x + _HALF_M, y + _HALF_M, z + _HALF_M))
        return ObjectNode(
            name,
            category_of(name),
            tuple(sorted(states.items())),
            box.centre,
            box,
            last_seen_s=self.time_s,
        )
