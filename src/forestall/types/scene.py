"""What a task needs of a scene, and what a scenario changes in it (data, no geometry)."""

from __future__ import annotations

from dataclasses import dataclass


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
        variety: which axes vary with the seed (layout, furniture, colours, light, start, clutter).
    """

    room: str = "kitchen"
    objects: tuple[ObjectNeed, ...] = ()
    fixtures: tuple[tuple[str, str, str], ...] = ()
    clutter: tuple[int, int] = (2, 6)
