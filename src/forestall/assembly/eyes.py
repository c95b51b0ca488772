"""Pictures of demonstrations that somebody else made, seen as a monitor will see its own.

Made by `monitor`, called by `sources`; calls perception.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from forestall.assembly.configuration import Given, choices, domain_of
from forestall.assembly.parts import Assembly
from forestall.domain.model import Domain
from forestall.domain.names import ground_subtask
from forestall.domain.words import Words
from forestall.kinds import DOMAIN, PERCEIVER
from forestall.perception.folder import read_observation
from forestall.perception.scene_dict import scene_from_dict
from forestall.perception.scenes import Scenes
from forestall.seams.perceiving import Perceiver
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation, Vec3
from forestall.types.plan import Subtask

PICTURES = frozenset(("rgb", "frames"))
"""What a scene in plain data has if it is a picture."""


class Eyes:
    """Turns pictures into scene graphs, one demonstration after the other.

    Args:
        perceiver: that of the monitor.
        domain: whose words are matched.
        states: where the perceiver looks for states that are written down beside pictures.
    """

    def __init__(
        self, perceiver: Perceiver, domain: Domain, states: dict[str, Mapping[str, str]]
    ) -> None:
        self._perceiver, self._domain, self._states = perceiver, domain, states
        self._scenes, self._words = Scenes(domain), Words(domain)
        self._robot_m: Vec3 = (0.0, 0.0, 0.0)

    @property
    def domain(self) -> Domain:
        """Whose words are matched."""
        return self._domain

    def describe(self) -> Mapping[str, str]:
        """What it sees with, for demonstrations."""
        return self._perceiver.describe()

    def begin(self) -> None:
        """Another demonstration: nothing of the last one is remembered."""
        self._perceiver.reset()
        self._scenes = Scenes(self._domain)
        self._states.clear()

    def see(self, given: Observation | Mapping[str, Any] | Path) -> SceneGraph:
        """Everything that is known after a look.

        Args:
            given: an observation, one in plain data, or the folder of a stored one.

        Raises:
            InputError: what cannot be read, or cannot be what a camera sees.
        """
        if isinstance(given, Path):
            given, told = read_observation(given, self._domain)
            self._states.update(told)
        elif isinstance(given, Mapping):
            given = scene_from_dict(self._scenes, given)
        self._robot_m = given.robot_position_world_m
        return self._perceiver.perceive(given)

    def step(self, said: Subtask, graph: SceneGraph) -> tuple[Subtask, SceneGraph]:
        """The subtask with the things that it means, and the part of a graph that concerns it."""
        wanted = self._domain.check(self._words.subtask(said))
        ground = ground_subtask(wanted, graph, self._domain, self._robot_m, {})
        return ground, self.scope(graph, ground)

    def acted(self, subtask: Subtask, succeeded: bool) -> None:
        """A skill was carried out: a perceiver that knows skills doubts what it may change."""
        told = getattr(self._perceiver, "acted", None)
        if told is not None:
            told(subtask, succeeded)

    def scope(self, graph: SceneGraph, subtask: Subtask) -> SceneGraph:
        """The part of a graph that concerns a subtask."""
        return self._perceiver.scope(graph, subtask)


def eyes_for(given: Given, domain: Domain | None = None) -> Eyes:
    """Eyes of the parts that somebody named; masks and states are the stored ones by default.

    Args:
        given: what was said about parts.
        domain: whose words are matched; the one that was said, by default.

    Raises:
        InputError: a name or an option that is not valid.
    """
    said = of_stored(given)
    own = domain_of(said.chosen(DOMAIN.name)) if domain is None else domain
    told: dict[str, Mapping[str, str]] = {}
    parts = Assembly(choices(said), own, None, {"states": told})
    return Eyes(parts.part(PERCEIVER), own, told)


def of_stored(given: Given) -> Given:
    """What was said about parts, over those that stored pictures have."""
    return given.over(Given.named({"segmenter": "given-masks", "states": "given"}))


def is_picture(given: object) -> bool:
    """Whether a scene has to be seen first."""
    plain = isinstance(given, Mapping) and bool(PICTURES & given.keys())
    return plain or isinstance(given, Observation)
