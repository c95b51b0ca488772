"""What a segmenter found, with the names that perception gave to it. Called by the perceiver."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from forestall.perception.tracks import View
from forestall.types.observation import Detection


def with_names(detections: Sequence[Detection], view: View) -> tuple[Detection, ...]:
    """Detections of a frame with their things' names and categories, one for each thing.

    Args:
        detections: as the segmenter gave them; surfaces that the view has besides are left out.
        view: of the same frame.
    """
    found: dict[str, Detection] = {}
    for detection, name, category in zip(detections, view.ids, view.categories, strict=False):
        other = found.get(name)
        if other is None:
            found[name] = replace(detection, instance=name, category=category)
        else:  # parts of one thing
            mask, score = other.mask | detection.mask, max(other.score, detection.score)
            found[name] = replace(other, mask=mask, score=score)
    return tuple(found.values())
