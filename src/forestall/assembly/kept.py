"""Everything that a demonstration saw, kept by its content, so that it can be perceived anew.

Beside a memory `pegs.db` lies the folder `pegs.db.observations`, in it one folder for each
observation, in the format of docs/observation-format.md, named by the hash of its files. Called by
recording, by `sources` and the command line; calls perception's reader and writer.
"""

from __future__ import annotations

import hashlib
import re
import shutil
import uuid
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from forestall.assembly.configuration import Given, choices, domain_of
from forestall.assembly.parts import Assembly
from forestall.domain.model import Domain
from forestall.errors import InputError, MemoryFileError, PerceptionError
from forestall.kinds import DOMAIN, PERCEIVER
from forestall.memory.store import open_store
from forestall.perception.folder import read_observation, write_observation
from forestall.seams.perceiving import Perceiver
from forestall.types.demonstration import Demonstration, DemonstrationStep
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation, Rgb
from forestall.types.plan import Subtask

_HASH = re.compile(r"^[0-9a-f]{32}$")

MOVED_M = 0.1
"""How far from the box that other eyes give a thing the former ones may have seen its middle."""


class KeptObservations:
    """The observations of one memory.

    Args:
        memory: its file.
    """

    def __init__(self, memory: Path) -> None:
        self.folder = memory.with_name(memory.name + ".observations")

    def keep(self, observation: Observation) -> str:
        """Store an observation, once; returns the hash of its files.

        Killed at any moment, it leaves the whole of it or a folder that nobody reads.

        Raises:
            MemoryFileError: the folder cannot be written.
        """
        partial = self.folder / f".{uuid.uuid4().hex}"
        try:
            write_observation(partial, observation)
            name = _digest(partial)
            place = self._place(name)
            if place.exists():
                shutil.rmtree(partial)
            else:
                place.parent.mkdir(parents=True, exist_ok=True)
                _moved(partial, place)
        except OSError as error:
            shutil.rmtree(partial, ignore_errors=True)
            raise MemoryFileError(
                f"cannot keep an observation in {self.folder}: {error}"
            ) from error
        return name

    def get(self, name: str, domain: Domain) -> Observation:
        """A stored observation.

        Raises:
            MemoryFileError: there is none, or its files are not what they were.
        """
        place = self._place(name) if _HASH.match(name) else None
        if place is None or not place.is_dir():
            raise MemoryFileError(f"observation {name!r} is not in {self.folder}")
        if _digest(place) != name:
            raise MemoryFileError(f"observation {place} is damaged: its content has changed")
        return read_observation(place, domain)[0]

    def _place(self, name: str) -> Path:
        return self.folder / name[:2] / name


def perceived_anew(
    demonstrations: Sequence[Demonstration],
    kept: KeptObservations,
    perceiver: Perceiver,
    domain: Domain,
) -> tuple[list[Demonstration], list[str]]:
    """The same demonstrations as another perceiver sees them.

    It sees what was kept: the looks before each subtask, and nothing of looks in between. What was
    known after the last subtask is left out. Where its segmenter gives names of its own, arguments
    of subtasks are the things that stand where the former ones stood.

    Args:
        demonstrations: each with all its observations.
        kept: where these are.
        perceiver: sees them; it is reset for each demonstration.
        domain: of all of them.

    Returns:
        The demonstrations, and for each that it cannot see a sentence why: an argument of a subtask
        is not where it was, or nothing is found at all.

    Raises:
        InputError: a step whose observation was not kept.
        MemoryFileError: an observation that is gone or damaged.
    """
    found, unseen = [], []
    for d in demonstrations:
        perceiver.reset()
        steps = []
        try:
            for step in d.steps:
                if step.observation is None:
                    raise InputError(
                        f"what demonstration {d.id} saw before {step.subtask} was not kept: record "
                        "it with --keep-observations"
                    )
                graph = perceiver.perceive(kept.get(step.observation, domain))
                subtask = _found_again(step, graph)
                scoped = perceiver.scope(graph, subtask)
                steps.append(replace(step, subtask=subtask, graph=scoped, whole=graph, view=None))
        except PerceptionError as error:
            unseen.append(f"demonstration {d.id}: {error}")
            continue
        described = tuple(sorted(perceiver.describe().items()))
        found.append(replace(d, steps=tuple(steps), perception=described, final=None))
    return found, unseen


def _found_again(step: DemonstrationStep, graph: SceneGraph) -> Subtask:
    """The subtask of a step with the names that its things have in another graph.

    Raises:
        PerceptionError: one of them is not there.
    """
    args = []
    for arg in step.subtask.args:
        old = step.whole.get(arg)
        again: str | None = arg
        if old is not None and old.centroid_m is not None:
            again = graph.nearest(old.category, old.centroid_m, MOVED_M)
        if again is None:
            raise PerceptionError(f"{arg} is not seen where it was before {step.subtask}")
        args.append(again)
    return Subtask(step.subtask.skill, tuple(args))


def seen_anew(
    memory: Path, demonstrations: Sequence[Demonstration], given: Given
) -> tuple[list[Demonstration], list[str]]:
    """What `perceived_anew` gives with the parts that somebody named.

    Masks are the kept ones, states are read off pictures, unless something else is said.
    """
    chosen = choices(given.over(Given.named({"segmenter": "given-masks"})))
    domain = domain_of(given.chosen(DOMAIN.name))
    states: dict[str, dict[str, str]] = {}
    perceiver = Assembly(chosen, domain, None, {"states": states}).part(PERCEIVER)
    return perceived_anew(demonstrations, KeptObservations(memory), perceiver, domain)


def _moved(partial: Path, place: Path) -> None:
    """Give it its name, unless another process was first."""
    try:
        partial.rename(place)
    except OSError:
        if not place.is_dir():
            raise
        shutil.rmtree(partial)


def _digest(folder: Path) -> str:
    hasher = hashlib.blake2b(digest_size=16)
    for file in sorted(folder.iterdir()):
        content = file.read_bytes()
        hasher.update(f"{file.name} {len(content)} ".encode())
        hasher.update(content)
    return hasher.hexdigest()


def picture_of(memory: Path, step: DemonstrationStep, domain: Domain) -> Rgb | None:
    """What was seen at a step of a demonstration, None where it was not kept.

    Raises:
        MemoryFileError: it was, and is damaged.
    """
    if step.image is not None:
        with open_store(memory) as store:
            return store.get_image(step.image)
    if step.observation is None:
        return None
    frames = KeptObservations(memory).get(step.observation, domain).frames
    return frames[-1].rgb if frames else None
