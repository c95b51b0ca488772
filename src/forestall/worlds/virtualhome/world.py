"""The flat as a world that a robot acts in (implements `Environment`); all of it is seen.

Called by whoever has the packages and a start graph; calls the evolving graph, which refuses what
cannot be done and says why. Skills are those of the household's domain, their first argument is who
acts. Nobody drives before a skill: walking is a skill of its own here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from forestall.types.episode import SkillOutcome, SkillStatus
from forestall.types.facts import category_of, is_instance
from forestall.types.graph import SceneGraph
from forestall.types.observation import GripperState, Observation, Vec3
from forestall.types.plan import Subtask
from forestall.worlds.virtualhome.evolving import Evolving
from forestall.worlds.virtualhome.packages import Flat, Line
from forestall.worlds.virtualhome.plans import SKILLS
from forestall.worlds.virtualhome.seen import HELD, scene

SKILL_S = 5.0
LOOK_S = 1.0
HOLDS = "the character was told to hold"

VERBS: Mapping[str, str] = {
    **{skill: verb for verb, skill in reversed(list(SKILLS.items()))},
    "walk_towards": "WALK",
    "walk_into": "WALK",
}
"""Skill of the domain → verb that does it."""

_NOWHERE: Vec3 = (0.0, 0.0, 0.0)


class FlatWorld:
    """One flat.

    Args:
        package: folder of the evolving graph (`Packages.evolving_graph`).
        start: how the flat begins, the same for every seed.
        about: node ids of what is looked at, beside what is in, on and under it.
    """

    def __init__(self, package: Path, start: Flat, about: Iterable[int]) -> None:
        self._package, self._start = package, start
        self._about = frozenset(about)
        self.reset(0)

    def reset(self, seed: int) -> None:
        """Put the flat into its start."""
        self._flat = Evolving(self._package, self._start)
        self._time_s, self._holding = 0.0, False

    @property
    def time_s(self) -> float:
        """Time since reset."""
        return self._time_s

    def scan(self, thorough: bool = False) -> Observation:
        """Everything that matters."""
        self._time_s += LOOK_S
        return Observation((), self._hand(), self._time_s, _NOWHERE, self.truth())

    def observe(self, focus: Sequence[Vec3] = ()) -> Observation:
        """The same, wherever somebody looks."""
        return self.scan()

    def approach(self, name: str) -> float:
        """Stay: walking is a skill here."""
        return 0.0

    def execute(self, subtask: Subtask) -> SkillOutcome:
        """Do one step, or say why not."""
        if self._holding:
            return SkillOutcome(SkillStatus.REFUSED, 0.0, HOLDS)
        line = self._line(subtask)
        why = line if isinstance(line, str) else self._flat.act(line)
        if why is not None:
            return SkillOutcome(SkillStatus.REFUSED, 0.0, why)
        self._time_s += SKILL_S
        return SkillOutcome(SkillStatus.SUCCEEDED, SKILL_S)

    def hold(self) -> None:
        """Nothing moves again before `reset`."""
        self._holding = True

    def close(self) -> None:
        """There is nothing to free."""

    def truth(self) -> SceneGraph:
        """What concerns the things that are looked at."""
        return scene(self._flat, self._about)

    def _line(self, subtask: Subtask) -> Line | str:
        """The step of a program, or why there is none."""
        if subtask.skill not in VERBS:
            return f"no such skill: {subtask.skill}"
        nodes = self._start.nodes
        things = []
        for name in subtask.args:
            node = nodes.get(int(name.rpartition("-")[2])) if is_instance(name) else None
            if node is None or node.name != category_of(name):
                return f"there is no {name or 'thing without a name'}"
            things.append((node.name, node.id))
        if not things or things[0][1] != self._start.character:
            return f"{subtask}: the first argument is who acts"
        return Line(VERBS[subtask.skill], tuple(things[1:]))

    def _hand(self) -> GripperState:
        held = [r.subject for r in self.truth().relations if r.predicate == HELD]
        return GripperState(held[0] if held else None, _NOWHERE)
