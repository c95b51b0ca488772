"""The monitor with the ways to make one: `forestall.Monitor`.

Called by users; calls `sources`, `learning` and the registry's parts.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from forestall.assembly.configuration import Choice, Given, choices, domain_of
from forestall.assembly.corrections import MEMORIES, beside_all, of_no_task, remembering
from forestall.assembly.eyes import eyes_for, is_picture
from forestall.assembly.own_domain import corrected
from forestall.assembly.parts import Assembly
from forestall.assembly.sources import Source, demonstrations_from, scoped
from forestall.assembly.stored import check_scene
from forestall.conclusion import MonitorConfig
from forestall.domain.model import Domain
from forestall.domain.words import Words
from forestall.errors import InputError
from forestall.handed import Scene
from forestall.kinds import DOMAIN, LIMIT, PERCEIVER, STRATEGY
from forestall.learning.learn import learn
from forestall.monitor import Monitor as RunMonitor
from forestall.perception.scene_dict import scene_from_dict
from forestall.perception.scenes import Scenes
from forestall.types.decision import MonitorDecision
from forestall.types.demonstration import Demonstration
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation
from forestall.types.plan import Subtask

DEFAULTS = Given.named(
    {
        "detector": "preconditions",
        "segmenter": "given-masks",
        "states": "given",
        "strategy": {"name": "proactive", "repeats": True},
    }
)
"""What a monitor of somebody's own has where nothing is said: it judges by what always held, which
needs no scene of the same kind; masks and states are those that an observation brings; what the
robot says was not done is done again."""


class Monitor(RunMonitor):
    """Says before each subtask whether it may start; see `forestall.monitor` for a run.

    Attributes:
        domain: skills, relations and attributes, as given or as learnt.
        demonstrations: what scenes are compared with.
        limits: what cannot be judged or done, a sentence each; none where a domain was given.
    """

    _scenes: Scenes
    _words: Words
    _learnt: bool = False
    domain: Domain
    demonstrations: tuple[Demonstration, ...]
    limits: tuple[str, ...]

    @classmethod
    def from_demonstrations(
        cls,
        source: Source,
        domain: Domain | str | Path | None = None,
        *,
        hands: Sequence[str] | None = None,
        config: MonitorConfig | None = None,
        **options: Any,
    ) -> Monitor:
        """A monitor that compares with demonstrations.

        Args:
            source: a memory file, folders of runs, graphs, lists of (subtask, scene), or a mixture;
                see `assembly.sources`. With a domain scenes may be pictures. Corrections by hand
                beside each memory file count (docs/preconditions.md); one for a task that nothing
                demonstrates is a warning.
            domain: a domain, its name, or a file of one. Without it skills, relations and
                attributes are those that the demonstrations use, what always held before a skill
                is needed, what always changed is what it does; `limits` says what that leaves out.
            hands: node ids of the robot's hands for a domain that is learnt; by default the nodes
                that are called grippers.
            config: bounds and policies; by default the robot holds where nothing was judged, and
                the limits are the options of the part `limit`: `limit={"perceive_s": 2}`.
            **options: parts and their options: `detector="scene-graph"`,
                `detector={"name": "preconditions", "threshold": 0.3}`; `forestall parts` lists
                them. `Given` as the keyword `given` is what a file or flags said.

        Raises:
            InputError: a source, a name or an option that is not valid, or a demonstration that
                says of things what means nothing in the domain; says what would be.
        """
        given: Given = options.pop("given", Given())
        said = Given.named(options).over(given).over(DEFAULTS)
        limits: tuple[str, ...] = ()
        memories: list[Path] = []
        if domain is None:
            demonstrations = demonstrations_from(source, memories=memories)
            learnt = learn(demonstrations, hands=hands)
            own, limits = corrected(learnt.domain, memories), learnt.limits
        else:
            own = _domain(domain)
            eyes = eyes_for(said, own)
            demonstrations = scoped(demonstrations_from(source, eyes, memories), eyes.scope)
            _check_demonstrations(demonstrations, own)
        chosen = tuple(
            Choice(DOMAIN.name, own.name) if c.kind == DOMAIN.name else c for c in choices(said)
        )
        one = isinstance(source, str | Path) and memories == [Path(source)]
        chosen = remembering(chosen, str(source) if one else None)
        lent = {"states": {}, MEMORIES: tuple(memories)}
        parts = Assembly(chosen, own, demonstrations, lent)
        tasks = [d.task for d in demonstrations]
        for text in of_no_task(beside_all(memories, own), tasks):
            warnings.warn(text, stacklevel=2)
        monitor = cls(
            parts.part(STRATEGY),
            own,
            None if domain is None else parts.part(PERCEIVER),
            config or MonitorConfig(limits=parts.part(LIMIT)),
        )
        monitor._scenes, monitor._words = Scenes(own), Words(own)
        monitor.domain, monitor.limits, monitor._learnt = own, limits, domain is None
        monitor.demonstrations = tuple(demonstrations)
        return monitor

    def check(self, scene: Scene, subtask: Subtask | str) -> MonitorDecision:
        """May this one subtask start in this scene? See `forestall.monitor.Monitor.check`.

        Of a picture the subtask may speak as its detections do: "pick_up(coffee mug)".
        """
        seen = self._read(scene)
        if isinstance(seen, Observation) and isinstance(subtask, str):
            subtask = self._words.subtask(Subtask.parse(subtask))
        return super().check(seen, subtask)

    def _read(self, scene: Scene) -> Observation | SceneGraph:
        """Also pictures as plain data (`perception.scene_dict`).

        A graph has no words but the domain's; one that is learnt may meet others, not judged.
        """
        if isinstance(scene, Mapping) and is_picture(scene):
            scene = scene_from_dict(self._scenes, scene)
        seen = super()._read(scene)
        if isinstance(seen, SceneGraph):
            check_scene(seen, self._domain, self._learnt)
        return seen


def _check_demonstrations(demonstrations: Sequence[Demonstration], domain: Domain) -> None:
    for d in demonstrations:
        for number, step in enumerate(d.steps, 1):
            try:
                check_scene(step.whole, domain, learnt=False)
            except InputError as error:
                raise InputError(f"demonstration {d.id}, step {number}: {error}") from error


def _domain(said: Domain | str | Path) -> Domain:
    if isinstance(said, Domain):
        return said
    return domain_of(Given.named({DOMAIN.name: str(said)}).chosen(DOMAIN.name))
