"""What a task needs of a scene, and what a scenario changes in it (data, no geometry)."""

from __future__ import annotations

from dataclasses import dataclass

AXES = ("layout", "furniture", "colours", "light", "start", "clutter")
"""What varies with a scene's seed and can be drawn anew on its own.

"layout" is the whole floor plan, "furniture" only what stands free in it (table, chairs, shelf,
bin, lamp, pictures), "start" where the robot is at first.
"""


@dataclass(frozen=True, slots=True)
class ObjectNeed:
    """One object that must be in the scene.

    Args:
        id: instance name, e.g. "Bowl-1".
        category: a category of the vocabulary.
        places: receptacle names (category or instance) of which one takes the object; empty means
            any counter or table that accepts it.
        states: (attribute, value) pairs that differ from the category's defaults.
        in_front_of: an object that this one is put in front of, so that it blocks it.
    """

    id: str
    category: str
    places: tuple[str, ...] = ()
    states: tuple[tuple[str, str], ...] = ()
    in_front_of: str | None = None


@dataclass(frozen=True, slots=True)
class SceneNeeds:
    """What a scene must contain; everything else varies with the seed.

    Args:
        room: "kitchen" or "living-room".
        objects: objects that must be there.
        fixtures: (fixture name, attribute, value) overrides, e.g. ("Microwave-1", "open", "open").
        clutter: smallest and largest number of further objects.
        vary: (axis, number): axes that are drawn anew, each number in another way.
        more_clutter: how many things to strew in beside the clutter, as far as there is room.
        undisturbed: the needs before a scenario changed them. A scene of the same seed is the
            undisturbed one but for what differs between the two.
    """

    room: str = "kitchen"
    objects: tuple[ObjectNeed, ...] = ()
    fixtures: tuple[tuple[str, str, str], ...] = ()
    clutter: tuple[int, int] = (2, 6)
    vary: tuple[tuple[str, int], ...] = ()
    more_clutter: int = 0
    undisturbed: SceneNeeds | None = None
