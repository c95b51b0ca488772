"""Detections from pictures of numbers, and from what says which number is what.

Called by the readers; the reverse of `outlines`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from forestall.errors import InputError
from forestall.logs.outlines import MOST_DETECTIONS
from forestall.types.facts import category_of, is_instance
from forestall.types.observation import Detection

Said = tuple[str, str, float, tuple[float, float, float, float] | None]
"""Category, instance ("" for none), score, and a box: left, top, right, bottom in pixels."""

Layers = Sequence[npt.NDArray[Any]]


def outlined(said: Sequence[Said], layers: Layers, shape: tuple[int, int]) -> tuple[Detection, ...]:
    """Detections in their order: the k-th has the number k + 1 on one of the layers.

    One without any pixel is left out; without layers, masks are made of the boxes.

    Raises:
        InputError: a layer of another shape, or too many detections.
    """
    _check(layers, shape)
    if len(said) > MOST_DETECTIONS:
        raise InputError(f"{len(said)} detections in one picture: at most {MOST_DETECTIONS}")
    found = []
    for number, (category, instance, score, box) in enumerate(said, 1):
        mask = np.zeros(shape, np.bool_)
        for layer in layers:
            mask |= layer == number
        if not layers and box is not None:
            left, top, right, bottom = (_pixel(v) for v in box)
            mask[top:bottom, left:right] = True
        if mask.any() and (category or instance):
            name = instance or None
            kind = category or category_of(instance)
            found.append(Detection(kind, mask, name, float(score), outlined=bool(layers)))
    return tuple(found)


def labelled(
    layers: Layers, labels: Mapping[str, str], shape: tuple[int, int]
) -> tuple[Detection, ...]:
    """Detections of the numbers that have a name; the others are nobody's.

    Raises:
        InputError: a layer of another shape, or a label of no number.
    """
    _check(layers, shape)
    found = []
    for number, name in labels.items():
        if not number.isdecimal() or int(number) < 1:
            raise InputError(f"labels: {number!r} is no number of a mask")
        mask = np.zeros(shape, np.bool_)
        for layer in layers:
            mask |= layer == int(number)
        if mask.any():
            instance = name if is_instance(name) else None
            found.append(Detection(category_of(name), mask, instance))
    return tuple(found)


def _check(layers: Layers, shape: tuple[int, int]) -> None:
    for layer in layers:
        if layer.shape != shape:
            raise InputError(f"masks of {layer.shape} beside a picture of {shape}")


def _pixel(value: float) -> int:
    if not abs(value) < 1e6:
        raise InputError(f"a box at {value} pixels")
    return max(0, round(value))
