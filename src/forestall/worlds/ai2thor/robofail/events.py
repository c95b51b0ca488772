"""AI2-THOR's events as RoboFail pickled them, without the package and without running anything.

Called by `looks`; calls `reading.pickles`. What `frames.frame_from_event` asks of an event
(`metadata`, `frame`, `depth_frame`, `instance_masks`) is here in plain data.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from forestall.errors import FileFormatError
from forestall.reading.pickles import Made, read_pickle

WHAT = "stored event of AI2-THOR"

_EVENT = "ai2thor.server.Event"
ADMITTED = frozenset(
    f"ai2thor.server.{name}"
    for name in (
        "Event",
        "MetadataWrapper",
        "LazyInstanceSegmentationMasks",
        "LazyClassSegmentationMasks",
        "LazyInstanceDetections2D",
        "LazyClassDetections2D",
    )
)
"""Whatever an event of the package's version 5 is pickled with, beside numpy."""

_NEEDED = (
    "objects", "agent", "cameraPosition", "fov", "screenWidth", "screenHeight", "lastAction",
)  # fmt: skip
_MOST_PX = 4096


@dataclass(frozen=True, slots=True, eq=False)
class StoredEvent:
    """One event.

    Args:
        metadata: as AI2-THOR gave it.
        frame: (H, W, 3) uint8.
        depth_frame: (H, W) float32 z-depth in metres.
        instance_masks: object id → (H, W) bool, of what shows.
    """

    metadata: Mapping[str, Any]
    frame: npt.NDArray[np.uint8]
    depth_frame: npt.NDArray[np.float32]
    instance_masks: Mapping[str, npt.NDArray[np.bool_]]


class ColouredMasks(Mapping[str, npt.NDArray[np.bool_]]):
    """Masks in one picture, a colour for each object; made when they are asked for."""

    def __init__(self, picture: npt.NDArray[Any], colours: Mapping[str, int]) -> None:
        there = set(np.unique(picture).tolist())
        self._picture = picture
        self._colours = {name: c for name, c in colours.items() if c in there}

    def __getitem__(self, name: str) -> npt.NDArray[np.bool_]:
        mask: npt.NDArray[np.bool_] = self._picture == self._colours[name]
        return mask

    def __iter__(self) -> Iterator[str]:
        return iter(self._colours)

    def __len__(self) -> int:
        return len(self._colours)


def read_event(path: Path) -> StoredEvent:
    """One event of a run.

    Raises:
        FileFormatError: not readable, no event, or one without what is needed of it; a pickle that
            names anything else than an event does, before any of it is made.
    """
    made = read_pickle(path, WHAT, ADMITTED)
    try:
        return _event(made)
    except FileFormatError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise FileFormatError(f"{path}: this {WHAT} lacks something: {error!r}") from error


def _event(made: Any) -> StoredEvent:
    if not isinstance(made, Made) or made.name != _EVENT:
        raise ValueError(f"it is {type(made).__name__}, no event")
    about = made.state["metadata"]
    metadata = about.items if isinstance(about, Made) else about
    lacking = [key for key in _NEEDED if key not in metadata]
    if lacking:
        raise ValueError(f"its metadata has no {', '.join(lacking)}")
    size = (int(metadata["screenHeight"]), int(metadata["screenWidth"]))
    if not all(0 < n <= _MOST_PX for n in size):
        raise ValueError(f"a picture of {size[1]} by {size[0]} pixels")
    frame = _picture(made.state, "frame", (*size, 3), np.dtype(np.uint8))
    depth = _picture(made.state, "depth_frame", size, np.dtype(np.float32))
    return StoredEvent(metadata, frame, depth, _masks(made.state["instance_masks"], size))


def _picture(
    state: Mapping[str, Any], name: str, shape: tuple[int, ...], dtype: np.dtype[Any]
) -> npt.NDArray[Any]:
    found = state.get(name)
    if not isinstance(found, np.ndarray) or found.shape != shape or found.dtype != dtype:
        said = getattr(found, "shape", None) or type(found).__name__
        raise ValueError(f"{name} should be {shape} {dtype}, it is {said}")
    return found


def _masks(masks: Any, size: tuple[int, int]) -> Mapping[str, npt.NDArray[np.bool_]]:
    if isinstance(masks, dict) and masks:  # older versions of the package
        plain = np.dtype(np.bool_)
        return {str(name): _picture(masks, name, size, plain) for name in masks}
    if not isinstance(masks, Made):
        raise ValueError("it has no instance masks")
    picture = _picture(masks.state, "instance_segmentation_frame_uint32", size, np.dtype(np.uint32))
    alpha = int(masks.state["_alpha_channel_value"])
    colours = {
        str(name): int(np.array([*map(int, colour), alpha], np.uint8).view(np.uint32)[0])
        for name, colour in masks.state["instance_colors"].items()
    }
    return ColouredMasks(picture, colours)
