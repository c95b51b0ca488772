"""Whether demonstrations and scenes came through the same eyes, and what is said where not.

Both sides of a comparison should: what one segmenter misses, or one estimator reads otherwise,
looks like a change of the scene. Called by `checking` and the command line; calls the readers.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from forestall.perception.segmenters import GivenMasks
from forestall.reading.documents import read_json
from forestall.reading.fields import Field
from forestall.types.demonstration import Demonstration

EYES_FILE = "perception.json"
"""Beside an observation whose masks were found by models: which ones (`perceiving`)."""

GIVEN_GRAPH = "given graph"
"""The segmenter of what nobody has seen: it came as a graph."""

_PARTS = {"segmenter": "masks", "state_estimator": "states"}
"""What a perceiver says of its parts → what comes from them."""

_UNKNOWN = "nobody knows"


def other_eyes(
    demonstrations: Iterable[Demonstration],
    used: Mapping[str, str],
    scenes: Sequence[Path] = (),
) -> str:
    """A sentence where demonstrations were seen with other parts than scenes are; "" where not.

    Args:
        demonstrations: the memory. Those that were given as graphs or labels were seen by nobody.
        used: what the perceiver of the scenes says of its parts.
        scenes: where they are stored, which may say who has found their masks.

    Raises:
        FileFormatError: a file that should say it cannot be read.
    """
    theirs = [e for d in demonstrations if _saw(e := dict(d.perception))]
    ours = [e for e in ([_stored(s, used) for s in scenes] or [dict(used)]) if _saw(e)]
    told = []
    for part, what in _PARTS.items():
        there, here = ({e.get(part, _UNKNOWN) for e in eyes} for eyes in (theirs, ours))
        if there and here and there != here:
            told.append(f"{what}: {', '.join(sorted(there))} there, {', '.join(sorted(here))} here")
    if not told:
        return ""
    return (
        f"the demonstrations were seen with other eyes ({'; '.join(told)}): differences may be "
        "theirs; 'forestall demos perceive' sees a memory anew"
    )


def _saw(eyes: Mapping[str, str]) -> bool:
    return eyes.get("segmenter", GIVEN_GRAPH) != GIVEN_GRAPH


def _stored(scene: Path, used: Mapping[str, str]) -> dict[str, str]:
    """Who has seen a stored scene: it says so itself where its own masks are used."""
    place = scene / EYES_FILE
    if used.get("segmenter") != GivenMasks.name or not place.is_file():
        return dict(used)
    told = Field(read_json(place, "perception"), str(place))["perception"].pairs(Field.text)
    return dict(used) | dict(told)
