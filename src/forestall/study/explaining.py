"""What each detector says of a boundary, from the record of a run: its own lines, made a sentence.

Called by `making.py`; calls assembly for the detectors and the memory, llm for the writer. The
verdicts are in the record; what a detector noticed is computed from them and from the recorded
graphs and pictures, as the detector itself tells it. A record keeps no pictures and captions of the
demonstrations: they come from the memory.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from forestall.assembly.configuration import Given, choices
from forestall.assembly.kept import picture_of
from forestall.assembly.parts import Assembly
from forestall.config import cache_dir
from forestall.domain.model import Domain
from forestall.domain.spoken import Spoken, sentence
from forestall.errors import ForestallError
from forestall.kinds import DETECTOR, DOMAIN, STORE
from forestall.llm.explaining import Writer
from forestall.memory.store import open_store
from forestall.records.pictures import rgb_of
from forestall.study.model import Explanation
from forestall.study.runs import Failure
from forestall.types.demonstration import Demonstration
from forestall.types.episode import BoundaryRecord, EpisodeRecord, StoredObservation
from forestall.types.observation import Frame, Observation, Rgb
from forestall.types.verdict import Decision, Reference, Verdict

REASONING = "scene-graph + reasoning"
"""Name of what the reasoner makes of the first detector's alarm; its cause is the explanation."""


@dataclass(frozen=True, slots=True)
class Remembered:
    """The memory of a run, as far as it is there.

    Args:
        path: of it.
        demonstrations: by id.
    """

    path: Path
    demonstrations: Mapping[str, Demonstration]

    def picture(self, reference: Reference, domain: Domain) -> Rgb | None:
        """What was seen at a step of a demonstration, None where it was not kept.

        Raises:
            MemoryFileError: it was, and is damaged.
        """
        step = _step(self, reference)
        return None if step is None else picture_of(self.path, step, domain)


def memory_of(record: EpisodeRecord, given: Path | None = None) -> Remembered | None:
    """The memory that a run compared with, None where it is not on this machine any more.

    Args:
        record: of the run; it names the memory.
        given: the memory's file, where it has moved.

    Raises:
        MemoryFileError: there is a file, and it is no memory.
    """
    if given is not None:
        return _remembered(given)
    named = dict(record.provenance).get("memory")
    if not named:
        return None
    for path in (Path(str(named)), cache_dir() / "memory" / Path(str(named)).name):
        if path.is_file():
            return _remembered(path)
    return None


class Explainer:
    """Writes explanations of one run's boundaries.

    Args:
        failure: the run.
        memory: that it compared with, None where it is gone.
        writer: makes the sentences.
    """

    def __init__(self, failure: Failure, memory: Remembered | None, writer: Writer) -> None:
        self._failure, self._memory, self._writer = failure, memory, writer
        demonstrations = None if memory is None else list(memory.demonstrations.values())
        self._parts = Assembly(_choices(failure.record), failure.domain, demonstrations or None)

    def explain(self, boundary: BoundaryRecord, detector: str, verdict: Verdict) -> Explanation:
        """The explanation of one detector's alarm, in the domain's words.

        Raises:
            ForestallError: what it noticed cannot be told; says why.
        """
        lines = self.lines(boundary, detector, verdict)
        if not lines:
            raise ForestallError(f"{detector} noticed nothing that could be told")
        written, asked = self._writer.write(boundary.subtask, detector, lines)
        by_model = any(not exchange.problem for exchange in asked)
        spoken = Spoken(self._failure.domain, boundary.scoped)
        text = sentence(spoken.text(written))
        return Explanation(detector, text, "model" if by_model else "templates")

    def lines(self, boundary: BoundaryRecord, detector: str, verdict: Verdict) -> tuple[str, ...]:
        """What the detector noticed; of one that cannot tell it, what its verdict holds."""
        if detector == REASONING:
            diagnosis = boundary.diagnosis
            return () if diagnosis is None else (diagnosis.cause,)
        verdict = replace(verdict, decision=Decision.REPLAN, nearest=self._seen(verdict.nearest))
        part = None
        if detector in self._parts.declared(DETECTOR):
            with suppress(ForestallError):  # one that needs a memory that is gone
                part = self._parts.part(DETECTOR, detector)
        noticed = getattr(part, "noticed", None)
        if noticed is not None:
            found: Sequence[str] = noticed(verdict, boundary.scoped, self._observation(boundary))
            return tuple(found)
        told = tuple(d.text for d in verdict.discrepancies)
        lacking = tuple(f"not {fact}" for fact in verdict.lacking)
        return told or lacking or ((verdict.note,) if verdict.note else ())

    def _seen(self, nearest: Reference | None) -> Reference | None:
        """The nearest demonstration with its picture's feature and caption, from the memory."""
        if nearest is None or self._memory is None:
            return nearest
        step = _step(self._memory, nearest)
        return nearest if step is None else replace(nearest, view=step.view)

    def _observation(self, boundary: BoundaryRecord) -> Observation | None:
        """What was seen, as far as it was kept: colours, and no depth."""
        stored = boundary.observation
        if not isinstance(stored, StoredObservation):
            return stored
        frames = []
        for frame in stored.frames:
            rgb = rgb_of(frame, self._failure.folder)
            if rgb is not None:
                depth = np.zeros(rgb.shape[:2], np.float32)
                pose = np.asarray(frame.camera_to_world, float)
                frames.append(Frame(rgb, depth, frame.intrinsics, pose, colour_only=True))
        if not frames:
            return None
        place = stored.robot_position_world_m
        return Observation(tuple(frames), stored.gripper, stored.time_s, place)


@lru_cache(maxsize=4)
def _remembered(path: Path) -> Remembered:
    with open_store(path) as store:
        return Remembered(path, {d.id: d for d in store.all()})


def _step(memory: Remembered, reference: Reference) -> Any:
    found = memory.demonstrations.get(reference.demonstration)
    steps = () if found is None else found.steps
    return next((s for s in steps if s.index == reference.index), None)


def _choices(record: EpisodeRecord) -> list[Any]:
    """The parts of the run as its record has them; defaults where it says nothing."""
    config = dict(record.provenance).get("config")
    parts = config.get("parts", {}) if isinstance(config, dict) else {}
    said = {
        kind: (part["name"], part.get("given", {}))
        for kind, part in parts.items()
        if kind not in (DOMAIN.name, STORE.name)
    }
    return list(choices(Given.of(said)))
