"""Where the things of a graph are in a picture of it; called by `page_view.py`, calls nothing.

A record keeps no masks. It has the box of each thing in the room and where the camera stood, and so
the box's outline in the picture is known; what hides the thing is not.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from itertools import product

import numpy as np

from forestall.types.episode import StoredFrame
from forestall.types.graph import Box, SceneGraph, Seen
from forestall.types.observation import Frame

_NEAR_M = 0.05
_LEAST = 0.6


@dataclass(frozen=True, slots=True)
class Framed:
    """Where a thing is in a picture, in percent of the picture's width and height."""

    node: str
    left: float
    top: float
    width: float
    height: float
    culprit: bool


def framed(
    graph: SceneGraph, frame: Frame | StoredFrame, culprits: Collection[str]
) -> tuple[Framed, ...]:
    """The things of a graph that a picture shows, the largest first.

    Args:
        graph: what was known when the picture was taken.
        frame: the picture, or where its camera stood.
        culprits: ids of what an alarm speaks about.

    Returns:
        None for what was not in view, has no box, or reaches behind the camera.
    """
    found = []
    for node in graph.nodes:
        if node.seen is not Seen.VISIBLE or not node.pixels or node.box_m is None:
            continue
        place = _outline(node.box_m, frame)
        if place is not None:
            found.append(Framed(node.id, *place, node.id in culprits))
    return tuple(sorted(found, key=lambda f: (-f.width * f.height, f.node)))


def _outline(box: Box, frame: Frame | StoredFrame) -> tuple[float, float, float, float] | None:
    """Left, top, width and height in percent, cut at the picture's edges."""
    camera = frame.intrinsics
    corners = np.array([(*c, 1.0) for c in product(*zip(box.low, box.high, strict=True))])
    pose = np.asarray(frame.camera_to_world, float)
    x, y, z, _ = np.linalg.inv(pose) @ corners.T
    if z.min() < _NEAR_M:
        return None
    across = np.clip(100 * (camera.fx * x / z + camera.cx) / camera.width, 0, 100)
    down = np.clip(100 * (camera.fy * y / z + camera.cy) / camera.height, 0, 100)
    left, top = float(across.min()), float(down.min())
    width, height = float(across.max()) - left, float(down.max()) - top
    if min(width, height) < _LEAST:
        return None
    return left, top, width, height
