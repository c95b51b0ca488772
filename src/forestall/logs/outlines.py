"""Masks as pictures of numbers: which detections a frame has, on layers where they overlap.

Called by the writers; calls nothing. The k-th detection has the number k + 1, on one layer or
another; 0 is nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from forestall.errors import InputError
from forestall.types.facts import category_of, is_instance
from forestall.types.observation import Detection, Frame

Numbers = npt.NDArray[np.uint16]

MOST_LAYERS = 8
MOST_DETECTIONS = 2**16 - 1


def detections_of(frame: Frame) -> tuple[Detection, ...] | None:
    """What was found in a frame, in the order of names where it has instance ids; None: nobody."""
    if frame.detections is not None or frame.instance_ids is None:
        return frame.detections
    ids = frame.instance_ids
    found = sorted((frame.instance_names[int(i)], int(i)) for i in np.unique(ids[ids >= 0]))
    return tuple(
        Detection(category_of(n), ids == i, n if is_instance(n) else None) for n, i in found
    )


def layers_of(detections: Sequence[Detection], shape: tuple[int, int]) -> list[Numbers]:
    """(H, W) pictures of numbers, one at least; what overlaps is on different ones.

    Raises:
        InputError: more than can be numbered, or more than `MOST_LAYERS` on one another.
    """
    if len(detections) > MOST_DETECTIONS:
        raise InputError(f"{len(detections)} masks in one picture: at most {MOST_DETECTIONS}")
    layers = [np.zeros(shape, np.uint16)]
    for number, detection in enumerate(detections, 1):
        free = next((layer for layer in layers if not layer[detection.mask].any()), None)
        if free is None:
            if len(layers) == MOST_LAYERS:
                raise InputError(f"more than {MOST_LAYERS} masks lie on one another in a picture")
            free = np.zeros(shape, np.uint16)
            layers.append(free)
        free[detection.mask] = number
    return layers


def numbered(
    detections: Sequence[Detection], shape: tuple[int, int]
) -> tuple[npt.NDArray[np.int32], list[list[int]]]:
    """One (H, W) picture of numbers, and the numbers of each detection.

    What overlaps has a number of its own for each combination.
    """
    numbers = np.zeros(shape, np.int32)
    owners: list[tuple[int, ...]] = [()]
    for index, detection in enumerate(detections):
        for under in np.unique(numbers[detection.mask]).tolist():
            numbers[detection.mask & (numbers == under)] = len(owners)
            owners.append((*owners[under], index))
    own = [[n for n, of in enumerate(owners) if index in of] for index in range(len(detections))]
    return numbers, own


def box_of(mask: npt.NDArray[np.bool_]) -> tuple[int, int, int, int]:
    """First column and row of a mask, and the ones behind the last; zeros for an empty one."""
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    if not len(rows):
        return (0, 0, 0, 0)
    return (int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1)
