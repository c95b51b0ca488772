"""A wrong perception as it is meant: whoever watches sees with the robot's own eyes.

Wraps the environment of a run whose robot takes one thing for another: in everything that is
looked at, the wrong thing bears the name of another instance of the right thing's category, and
commands that speak of that instance mean it. Built by `faults.wrap`; calls point inwards.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from forestall.domain.model import Domain
from forestall.seams.around import Around
from forestall.tasks.execution_faults import FaultyEnvironment
from forestall.types.episode import SkillOutcome
from forestall.types.facts import category_of
from forestall.types.graph import SceneGraph
from forestall.types.observation import Frame, Observation, Vec3
from forestall.types.plan import Subtask


class SharedEyes(Around):
    """Implements `Environment`.

    Args:
        environment: in which the robot mistakes the things.
        mistaken: the instance that is mistaken → the category that it is taken for.
        domain: of the run.
    """

    def __init__(
        self, environment: FaultyEnvironment, mistaken: Mapping[str, str], domain: Domain
    ) -> None:
        super().__init__(environment)
        self._faults = environment
        self._mistaken = dict(mistaken)
        self._domain = domain
        self._names: dict[str, str] = {}
        self._held: str | None = None

    @property
    def idle(self) -> int:
        """As the wrapped environment."""
        return self._faults.idle

    def reset(self, seed: int) -> None:
        """Reset the world; what is mistaken is named anew at the first look."""
        self._names, self._held = {}, None
        self._inner.reset(seed)

    def scan(self, thorough: bool = False) -> Observation:
        """As the wrapped environment sees it, mistaken."""
        return self._seen(self._inner.scan(thorough))

    def observe(self, focus: Sequence[Vec3] = ()) -> Observation:
        """As the wrapped environment sees it, mistaken."""
        return self._seen(self._inner.observe(focus))

    def approach(self, name: str) -> float:
        """Drive to what is meant."""
        return self._inner.approach(self._meant(name))

    def execute(self, subtask: Subtask) -> SkillOutcome:
        """Do it with what is meant."""
        return self._inner.execute(Subtask(subtask.skill, tuple(map(self._meant, subtask.args))))

    def _meant(self, name: str) -> str:
        """The true instance behind a name; the held one where its category is named."""
        known = self._domain.canonical(name)
        for true, seen in self._names.items():
            if known == seen or (known == category_of(seen) and self._held == true):
                return true
        return name

    def _seen(self, observation: Observation) -> Observation:
        there = {n for f in observation.frames for n in f.instance_names}
        there |= set() if observation.graph is None else {n.id for n in observation.graph.nodes}
        for true, category in self._mistaken.items():
            if true in there and true not in self._names:
                number = 2
                while f"{category}-{number}" in there:
                    number += 1
                self._names[true] = f"{category}-{number}"
        gripper = observation.gripper
        self._held = gripper.holding
        return replace(
            observation,
            frames=tuple(map(self._frame, observation.frames)),
            gripper=replace(
                gripper, holding=self._name(gripper.holding), released=self._name(gripper.released)
            ),
            graph=None if observation.graph is None else self.mistaken(observation.graph),
        )

    def _name(self, name: str | None) -> str | None:
        return name if name is None else self._names.get(name, name)

    def _frame(self, frame: Frame) -> Frame:
        names = tuple(self._names.get(n, n) for n in frame.instance_names)
        return replace(frame, instance_names=names)

    def mistaken(self, graph: SceneGraph) -> SceneGraph:
        """A graph of what is, as this robot takes it."""
        names = self._names
        nodes = []
        for node in graph.nodes:
            seen = names.get(node.id)
            if seen is None:
                nodes.append(node)
                continue
            category = category_of(seen)
            known = self._domain[category].attributes
            states = tuple((a, v) for a, v in node.states if a in known)
            nodes.append(replace(node, id=seen, category=category, states=states))
        relations = tuple(
            replace(
                r, subject=names.get(r.subject, r.subject), object=names.get(r.object, r.object)
            )
            for r in graph.relations
        )
        return replace(graph, nodes=tuple(nodes), relations=relations)
