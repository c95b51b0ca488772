"""Stored pictures seen by models: masks, scene graphs and overlays, for `forestall perceive`.

Calls: command line → here → parts, perception. What is written is an observation again, with the
masks and states that were found: everything that reads observations reads it.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from uuid import uuid4

from forestall.assembly.configuration import Given, choices, domain_of
from forestall.assembly.make import STORED_STATES
from forestall.assembly.other_eyes import EYES_FILE
from forestall.assembly.parts import Assembly
from forestall.assembly.stored import is_graph, scenes_in
from forestall.domain.words import Names
from forestall.errors import InputError
from forestall.files import naming
from forestall.kinds import DOMAIN, PERCEIVER, SEGMENTER
from forestall.perception.explain import explain
from forestall.perception.folder import read_observation, write_observation
from forestall.perception.perceiver import GraphPerceiver
from forestall.types.graph import SceneGraph

GRAPH_FILE, OVERLAY_FILE = "graph.json", "overlay.png"
OWN_MASKS, OF_MODELS = "given-masks", "finder"
"""Segmenters: of pictures that came with masks, of others."""


@dataclass(frozen=True, slots=True)
class Perceived:
    """One scene that was seen.

    Args:
        source: the folder that was read.
        place: the folder that was written.
        graph: everything that is known after it.
        found: how many masks there are.
    """

    source: Path
    place: Path
    graph: SceneGraph
    found: int


def perceive_stored(path: Path, out: Path, given: Given) -> tuple[list[Perceived], dict[str, str]]:
    """See stored pictures, one after the other, and write what was seen; all of it or nothing.

    Args:
        path: an observation folder, or one that holds numbered ones: looks of one run.
        out: a folder that is not there yet. With one scene it is an observation folder itself,
            with several it holds 01, 02, ...
        given: which parts; masks are the folder's own, if it has some and nothing else is said,
            and states those that were written down.

    Returns:
        What was seen, and with which parts, in words.

    Raises:
        InputError: a folder that cannot be read, a part or an option that is not valid, or an
            output folder that is there.
        PerceptionError: nothing was found in any picture of a scene.
    """
    scenes = scenes_in([path])
    if any(map(is_graph, scenes)):
        raise InputError(f"{path} is a scene graph: give a folder with pictures")
    if out.exists():
        raise InputError(f"{out} is there already: name a new folder")
    eyes = _Eyes(given)
    seen: list[Perceived] = []
    partial = out.with_name(f".{uuid4().hex}.part")
    try:
        with naming(out):
            for number, scene in enumerate(scenes, 1):
                place = "" if len(scenes) == 1 else f"{number:02d}"
                graph, masks = eyes.see(scene, partial / place)
                seen.append(Perceived(scene, out / place, graph, masks))
            partial.rename(out)
    except BaseException:  # an interrupt, too, leaves no half folder
        shutil.rmtree(partial, ignore_errors=True)
        raise
    return seen, eyes.described


class _Eyes:
    """Sees scenes of one run and writes them."""

    def __init__(self, given: Given) -> None:
        said = given.over(Given.named({"segmenter": OWN_MASKS, "states": STORED_STATES}))
        self._domain = domain_of(given.chosen(DOMAIN.name))
        self._names = Names(self._domain)
        self._own_masks = said.chosen(SEGMENTER.name).name == OWN_MASKS
        self._states: dict[str, Mapping[str, str]] = {}
        self._parts = Assembly(choices(said), self._domain, None, {"states": self._states})

    @property
    def _perceiver(self) -> GraphPerceiver:
        """Built when the first scene is read: models take time, and a bad folder needs none."""
        perceiver = self._parts.part(PERCEIVER)
        if not isinstance(perceiver, GraphPerceiver):
            raise InputError("pictures are seen by the perceiver 'graph', which locates things")
        return perceiver

    @property
    def described(self) -> dict[str, str]:
        """With which parts, in words."""
        return dict(self._perceiver.describe())

    def see(self, scene: Path, folder: Path) -> tuple[SceneGraph, int]:
        """See one scene and write it; what is known now, and how many masks there are."""
        observation, states = read_observation(scene, self._domain, names=self._names)
        if self._own_masks and not any(frame.detections for frame in observation.frames):
            raise InputError(
                f"{scene} has no masks: say what finds things in its pictures, for example "
                f"--segmenter {OF_MODELS} --finder.model FOLDER"
            )
        self._states.clear()
        self._states.update(states)
        perceiver = self._perceiver
        graph = perceiver.perceive(observation)
        frames = tuple(
            replace(frame, detections=found, instance_ids=None, instance_names=())
            for frame, found in zip(observation.frames, perceiver.named, strict=True)
        )
        shown = replace(observation, frames=frames)
        write_observation(folder, shown, _known_states(graph))
        _write_json(folder / GRAPH_FILE, graph.to_json())
        _write_json(folder / EYES_FILE, {"domain": self._domain.name, "perception": self.described})
        picture = explain(shown, graph, perceiver.findings, self._domain.scored)
        picture.save(folder / OVERLAY_FILE)
        return graph, sum(len(frame.detections or ()) for frame in frames)


def _known_states(graph: SceneGraph) -> dict[str, dict[str, str]]:
    told = {node.id: {a: v for a, v in node.states if v is not None} for node in graph.nodes}
    return {name: states for name, states in told.items() if states}


def _write_json(file: Path, data: object) -> None:
    file.write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")
