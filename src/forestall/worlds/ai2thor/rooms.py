"""Which of AI2-THOR's rooms a task may have, and in which order a seed tries them.

Called by `world` and `part`; calls nothing.
"""

from __future__ import annotations

import re

from forestall.errors import InputError, UnknownNameError

ROOMS = {"kitchen": 0, "living-room": 200, "bedroom": 300, "bathroom": 400}
"""Kind of room → the number that its thirty scenes come after; the first where none is named."""

EACH = 30


def scenes(room: str, seed: int) -> list[str]:
    """The scenes of a kind of room, beginning with the seed's.

    Raises:
        UnknownNameError: no such kind.
    """
    kind = room or next(iter(ROOMS))
    if kind not in ROOMS:
        raise UnknownNameError("room", kind, ROOMS)
    first = ROOMS[kind] + 1
    return [f"FloorPlan{first + (seed + k) % EACH}" for k in range(EACH)]


def checked_scene(name: str) -> str:
    """A scene's name, or none.

    Raises:
        InputError: it cannot be one.
    """
    if name and re.fullmatch(r"FloorPlan\w+", name) is None:
        raise InputError(
            f"scene {name!r} is none of AI2-THOR: write FloorPlan1 to FloorPlan30, ..."
        )
    return name
