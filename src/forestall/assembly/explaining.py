"""What was understood of stored observations, drawn: `forestall check --explain FILE`.

Calls: command line → here → perception. What the input gate refuses is drawn, too: then above all.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from forestall.assembly.stored import is_graph, scenes_in
from forestall.domain.model import Domain
from forestall.domain.words import Names
from forestall.errors import FileFormatError, ForestallError, InputError
from forestall.perception.explain import explain
from forestall.perception.folder import read_observation
from forestall.perception.gate import inspect
from forestall.perception.given import GivenStateEstimator
from forestall.perception.perceiver import GraphPerceiver
from forestall.perception.segmenters import GivenMasks
from forestall.types.graph import SceneGraph


def explain_stored(paths: Sequence[Path], file: Path, domain: Domain) -> list[Path]:
    """Draw scenes, each into a picture of its own.

    Args:
        paths: as for `judge_stored`; scene graphs among them have no pictures and are left out.
        file: the picture; with several scenes "-1", "-2" ... before its suffix.
        domain: how the observations are read.

    Returns:
        What was written.

    Raises:
        InputError: an observation cannot be read, or the picture cannot be written; there is none.
    """
    folders = [scene for scene in scenes_in(paths) if not is_graph(scene)]
    if not folders:
        raise InputError("nothing to draw: a scene graph has no picture; leave --explain out")
    names, written = Names(domain), []
    for number, folder in enumerate(folders, 1):
        observation, states = read_observation(folder, domain, gate=None, names=names)
        findings = inspect(observation, domain)
        perceiver = GraphPerceiver(GivenMasks(), GivenStateEstimator(states), domain, gate=None)
        try:
            with np.errstate(all="ignore"):
                graph = perceiver.perceive(observation)
        except ForestallError:
            graph = SceneGraph(())
        place = file if len(folders) == 1 else file.with_stem(f"{file.stem}-{number}")
        try:
            explain(observation, graph, findings, domain.scored).save(place)
        except (OSError, ValueError) as error:
            raise FileFormatError(f"cannot write {place}: {error}") from error
        written.append(place)
    return written
