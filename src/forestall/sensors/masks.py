"""Masks as detectors give them: outlines that are off, things missed, called by a wrong name.

Works on the instance ids of a frame. Called by `sensor.py`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from forestall.types.facts import category_of

Ids = npt.NDArray[np.int32]

_WRONG = 900  # numbers of things that are not there


def moved_outlines(ids: Ids, most_px: int, rng: np.random.Generator) -> Ids:
    """Every mask too wide or too narrow by up to so many pixels; later ones lie over earlier."""
    from scipy import ndimage

    found = ids.copy()
    if most_px == 0:
        return found
    square = ndimage.generate_binary_structure(2, 1)
    boxes = ndimage.find_objects(ids + 1)
    for i in rng.permutation(np.unique(ids[ids >= 0])).tolist():
        by = int(rng.integers(-most_px, most_px + 1))
        if by == 0:
            continue
        window = tuple(slice(max(0, s.start - most_px), s.stop + most_px) for s in boxes[i])
        mask = ids[window] == i
        if by > 0:
            found[window][ndimage.binary_dilation(mask, square, iterations=by)] = i
        else:
            inner = ndimage.binary_erosion(mask, square, iterations=-by, border_value=1)
            found[window][mask & ~inner & (found[window] == i)] = -1
    return found


def without(ids: Ids, share: float, least_px: int, rng: np.random.Generator) -> Ids:
    """Each mask missing with a probability, and those of fewer pixels always."""
    present, pixels = np.unique(ids[ids >= 0], return_counts=True)
    gone = present[(rng.random(len(present)) < share) | (pixels < least_px)]
    found: Ids = np.where(np.isin(ids, gone), np.int32(-1), ids)
    return found


def miscalled(
    names: Sequence[str], labels: Sequence[str], share: float, rng: np.random.Generator
) -> tuple[str, ...]:
    """Names, each of a wrong category with a probability.

    Args:
        names: of instances.
        labels: categories that a detector knows; only things of these are mistaken, for another.
        share: probability for each.
        rng: draws.
    """
    wrong = rng.random(len(names)) < share
    found = []
    for number, (name, mistaken) in enumerate(zip(names, wrong, strict=True)):
        others = [c for c in labels if c != category_of(name)]
        if mistaken and others and category_of(name) in labels:
            found.append(f"{others[int(rng.integers(len(others)))]}-{_WRONG + number}")
        else:
            found.append(name)
    return tuple(found)
