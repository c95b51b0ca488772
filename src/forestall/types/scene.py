"""What a task needs of a scene, and what a scenario changes in it (data, no geometry)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ObjectNeed:
    """One object that must be in the scene.

    Args:
        id: instance name, e.g. "Tray-1".
        category: a category of the domain.
        places: receptacle names (category or instance) of which one takes the object; empty means
            any support that accepts it.
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
        room: what kind of room, in the words of the world that builds it; "" for its usual one.
        objects: objects that must be there.
        fixtures: (fixture name, attribute, value) overrides, (name, attribute, value).
        clutter: smallest and largest number of further objects.
        vary: (axis, number): axes of the scene's variety, in the words of the world that builds
            it, that are drawn anew, each number in another way.
        more_clutter: how many things to strew in beside the clutter, as far as there is room.
        undisturbed: the needs before a scenario changed them. A scene of the same seed is the
            undisturbed one but for what differs between the two.
    """

    room: str = ""
    objects: tuple[ObjectNeed, ...] = ()
    fixtures: tuple[tuple[str, str, str], ...] = ()
    clutter: tuple[int, int] = (2, 6)
    vary: tuple[tuple[str, int], ...] = ()
    more_clutter: int = 0
    undisturbed: SceneNeeds | None = None
