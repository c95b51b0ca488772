"""What a scene may ask of the kitchen: its rooms, and the axes of its variety.

Called where needs come in; calls nothing.
"""

from __future__ import annotations

from dataclasses import replace

from forestall.errors import UnknownNameError
from forestall.types.scene import SceneNeeds

ROOMS = ("kitchen", "living-room")
"""Kinds of room; the first is built where a task names none."""

AXES = ("layout", "furniture", "colours", "light", "start", "clutter")
"""What varies with a scene's seed and can be drawn anew on its own.

"layout" is the whole floor plan, "furniture" only what stands free in it (table, chairs, shelf,
bin, lamp, pictures), "start" where the robot is at first.
"""


def roomed(needs: SceneNeeds) -> SceneNeeds:
    """The needs with a room that the kitchen has, the undisturbed ones too.

    Raises:
        UnknownNameError: no such room or axis.
    """
    room = needs.room or ROOMS[0]
    if room not in ROOMS:
        raise UnknownNameError("room", room, ROOMS)
    for axis, _ in needs.vary:
        if axis not in AXES:
            raise UnknownNameError("axis of variety", axis, AXES)
    before = None if needs.undisturbed is None else roomed(needs.undisturbed)
    return replace(needs, room=room, undisturbed=before)
