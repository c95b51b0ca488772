"""Puts what a task needs into a scene of AI2-THOR, and what a fault changes in one.

Nothing is made here: a task that asks for a thing gets one that the scene has, under the name that
it gives; a scene without one does not do. Called by `world`; calls `link`, `scene`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from forestall.errors import SceneError
from forestall.types.facts import category_of, is_instance
from forestall.types.observation import Vec3
from forestall.types.scene import ObjectNeed, SceneNeeds
from forestall.worlds.ai2thor.frames import point_from_thor, point_to_thor
from forestall.worlds.ai2thor.link import Link
from forestall.worlds.ai2thor.naming import Thing, type_of
from forestall.worlds.ai2thor.scene import Scene

POINTS = 30
"""Places on one receptacle that are tried for a thing."""

ROOM_M = 0.25
"""More room around a thing is not looked for."""

SUPPORTS = ("CounterTop", "DiningTable", "SideTable", "CoffeeTable", "Desk", "TVStand", "Dresser")
"""Where a thing goes that may lie anywhere and is shut in, in this order."""

_ACTIONS: Mapping[tuple[str, str], str] = {
    ("open", "open"): "OpenObject",
    ("open", "closed"): "CloseObject",
    ("toggled", "on"): "ToggleObjectOn",
    ("toggled", "off"): "ToggleObjectOff",
    ("dirty", "dirty"): "DirtyObject",
    ("dirty", "clean"): "CleanObject",
    ("cooked", "cooked"): "CookObject",
    ("broken", "broken"): "BreakObject",
    ("sliced", "sliced"): "SliceObject",
    ("filled", "empty"): "EmptyLiquidFromObject",
}


def chosen(needs: SceneNeeds, things: Sequence[Thing], scene: Scene) -> dict[str, str]:
    """Name that the task gives → object id, for everything that it needs.

    Args:
        needs: of the task.
        things: every object of the scene.
        scene: the same, under names of its own.

    Raises:
        SceneError: a thing that the scene has not.
    """
    taken: dict[str, str] = {}
    for need in needs.objects:
        here = [n for n in scene.things if type_of(scene.things[n]) == need.category]
        free = [n for n in here if scene.things[n]["objectId"] not in taken.values()]
        if not free:
            raise SceneError(f"this scene has no {need.category} for {need.id}")
        best = min(
            free, key=lambda n: (not _is_there(scene, n, need.places), int(n.split("-")[-1]))
        )
        taken[need.id] = str(scene.things[best]["objectId"])
    return taken


class Stage:
    """A scene that is being set.

    Args:
        link: to the build.
        look: what is true now.
    """

    def __init__(self, link: Link, look: Any) -> None:
        self._link = link
        self._look: Any = look

    def prepare(self, needs: SceneNeeds) -> None:
        """Everything that is needed, where and as it is needed.

        Raises:
            SceneError: something cannot be put there, or cannot be so.
        """
        for name, attribute, value in needs.fixtures:
            for each in self._named(name):
                self._require(each, attribute, value)
        for need in needs.objects:
            self._put_as_needed(need)
            for attribute, value in need.states:
                self._require(need.id, attribute, value)
        for need in needs.objects:
            if need.in_front_of is not None:
                self._block(need.id, need.in_front_of)

    def place(self, name: str, place: str) -> bool:
        """Put a thing on or in a receptacle, opened for it and closed again; whether it is so."""
        scene: Scene = self._look()
        shut = scene.shut(place)
        if shut and not self.set(place, "open", "open"):
            return False
        done = any(self._at(name, point) for point in self._points(place)[:POINTS])
        if shut:
            self.set(place, "open", "closed")
        return done and self._look().parent(name) == place

    def set(self, name: str, attribute: str, value: str) -> bool:
        """Change a state; False where it is so already or cannot be."""
        scene: Scene = self._look()
        now = scene.states(name).get(attribute)
        if now is None or now == value:
            return False
        switch = scene.knob(name) if attribute == "toggled" else None
        target = {"objectId": scene.things[switch or name]["objectId"], "forceAction": True}
        if attribute == "filled" and value != "empty":
            if now != "empty":
                self._link.step("EmptyLiquidFromObject", **target)
            return self._did("FillObjectWithLiquid", fillLiquid=value, **target)
        action = _ACTIONS.get((attribute, value))
        return action is not None and self._did(action, **target)

    def options(self, places: Sequence[str]) -> Iterator[str]:
        """Receptacles of the scene by the names of a task."""
        scene: Scene = self._look()
        for place in places:
            yield from (n for n in self._named(place) if scene.receptacle(n) is not None)

    def _put_as_needed(self, need: ObjectNeed) -> None:
        scene: Scene = self._look()
        shut_in = not need.places and scene.closed_around(need.id) is not None
        if _is_there(scene, need.id, need.places) and not shut_in:
            return
        for place in self.options(need.places or SUPPORTS):
            if self.place(need.id, place):
                return
        where = " or ".join(need.places) or "a support"
        raise SceneError(f"AI2-THOR finds no room for {need.id} at {where} in this scene")

    def _block(self, front: str, behind: str) -> None:
        """Put one thing right before another, on the side from which one comes."""
        scene: Scene = self._look()
        names = self._named(behind)
        place = scene.parent(names[0]) if names else None
        if place is None:
            raise SceneError(f"{front} is to stand in front of {behind}, which stands nowhere")
        at = point_from_thor(scene.things[names[0]]["position"])
        comes = min(self._floor(), key=lambda p: _flat(p, at), default=at)
        before = sorted(self._points(place), key=lambda p: _flat(p, _between(at, comes)))
        for point in before[: 4 * POINTS]:
            if self._at(front, point):
                return
        raise SceneError(f"AI2-THOR finds no room for {front} in front of {behind}")

    def _points(self, place: str) -> list[Vec3]:
        thing = self._look().receptacle(place)
        if thing is None:
            return []
        event = self._link.step(
            "GetSpawnCoordinatesAboveReceptacle", objectId=thing["objectId"], anywhere=True
        )
        found = [point_from_thor(p) for p in event.metadata["actionReturn"] or ()]
        scene: Scene = self._look()
        there = [point_from_thor(scene.things[n]["position"]) for n in scene.contents(place)]
        floor = self._floor()

        def worse(point: Vec3) -> tuple[float, float]:
            """Near to other things; then far from where one stands."""
            room = min((_flat(point, t) for t in there), default=ROOM_M**2)
            return -min(room, ROOM_M**2), min((_flat(point, f) for f in floor), default=0.0)

        return sorted(found, key=worse)

    def _floor(self) -> list[Vec3]:
        """Where the agent can stand."""
        found = self._link.step("GetReachablePositions").metadata["actionReturn"] or []
        return [point_from_thor(p) for p in found]

    def _at(self, name: str, point: Vec3) -> bool:
        thing = self._look().things[name]
        return self._did(
            "PlaceObjectAtPoint", objectId=thing["objectId"], position=point_to_thor(point)
        )

    def _require(self, name: str, attribute: str, value: str) -> None:
        scene: Scene = self._look()
        if name in scene and scene.states(name).get(attribute) == value:
            return
        if name not in scene or not self.set(name, attribute, value):
            raise SceneError(f"AI2-THOR cannot make {attribute}({name})={value} in this scene")

    def _did(self, action: str, **said: Any) -> bool:
        return bool(self._link.step(action, **said).metadata["lastActionSuccess"])

    def _named(self, name: str) -> list[str]:
        scene: Scene = self._look()
        if is_instance(name):
            return [name] if name in scene else []
        return scene.of(name)


def _is_there(scene: Scene, name: str, places: Sequence[str]) -> bool:
    parent = scene.parent(name)
    if not places:
        return True
    return parent is not None and (parent in places or category_of(parent) in places)


def _flat(one: Sequence[float], other: Sequence[float]) -> float:
    return float((one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2)


def _between(at: Sequence[float], comes: Sequence[float]) -> tuple[float, float]:
    """A hand's breadth before a thing, on the way to where one comes from."""
    way = max(_flat(at, comes) ** 0.5, 1e-6)
    return (at[0] + 0.15 * (comes[0] - at[0]) / way, at[1] + 0.15 * (comes[1] - at[1]) / way)
